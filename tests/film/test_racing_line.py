import numpy as np
import pytest
from PIL import Image

from racecraft.errors import ConfigError, TrackError
from racecraft.film.racing_line import (
    MISTAKE,
    SPEED_COLORS,
    draw_racing_line,
    speed_color,
    speed_range,
)
from racecraft.race import Autopilot, RaceRules, Recording, evaluate
from racecraft.race.rules import race_rules
from racecraft.track import TrackPicture, load_track

OVAL = load_track("oval")


def record(driver, **rules):
    return evaluate(driver, OVAL, rules=RaceRules(**rules), num_trials=1, sees="state").trials[0].recording


def share_of(image, color, tolerance=12):
    return float((np.abs(np.asarray(image, dtype=int) - color).max(axis=2) <= tolerance).mean())


def test_a_lap_lies_over_the_picture_of_the_track(tmp_path):
    recording = record(Autopilot(speed=2.0), laps=2).lap(2)
    path = draw_racing_line(recording, tmp_path / "line.png", title="A racer", width_px=640)
    with Image.open(path) as image:
        assert image.size == TrackPicture(OVAL, width_px=640).size
        drawn = image.convert("RGB")
    speeds = recording.column("actual_speed")
    low, high = speed_range(speeds)
    pixels = TrackPicture(OVAL, width_px=640).canvas.to_pixels(recording.origins).astype(int)
    for (x, y), speed in zip(pixels[5:-5:10].tolist(), speeds[5:-5:10].tolist(), strict=True):
        assert np.abs(np.subtract(drawn.getpixel((x, y)), speed_color((speed - low) / (high - low)))).max() < 40
    assert share_of(drawn, MISTAKE) < 1e-3


def test_a_long_title_leaves_the_colours_alone(tmp_path):
    recording = record(Autopilot(), laps=1)
    short, *long = (
        np.asarray(Image.open(draw_racing_line(recording, tmp_path / f"{len(title)}.png", title=title, width_px=640)))
        for title in ("A", "badger@last - heron@last - otter - fox", " - ".join(8 * ["a" * 64]))
    )
    for drawn in long:
        assert (drawn[:, :476] != short[:, :476]).any()
        assert (drawn[:, 476:] == short[:, 476:]).all()  # where the bar stands


def test_mistakes_are_marked_and_lines_do_not_jump(tmp_path):
    recording = record(lambda state: np.tile(np.float32([0, 1]), (len(state), 1)), laps=1, offtrack_penalty=1.0)
    with Image.open(draw_racing_line(recording, tmp_path / "line.png", width_px=640)) as image:
        assert share_of(image.convert("RGB"), MISTAKE) > 1e-3


def test_a_trial_that_ends_by_a_mistake_behind_its_start(tmp_path, monkeypatch):
    shown = []
    monkeypatch.setattr(TrackPicture, "caption", lambda self, **told: shown.append(dict(told["figures"])))

    def turns(state):
        return np.tile(np.float32([0.52, 1.0]), (len(state), 1))

    track = load_track("speedway")
    rules = race_rules("drfc", {"laps": 1, "max_resets": 0})
    trials = evaluate(turns, track, rules=rules, num_trials=2, sees="state").trials
    assert trials[1].recording.column("progress")[-1] < 0
    for trial in trials:
        draw_racing_line(trial.recording, tmp_path / "line.png", width_px=640)
    assert [figures["COMPLETION"] for figures in shown] == ["0.0 %", "0.0 %"]
    assert [trial.laps[0].resets for trial in trials] == [0, 0]
    assert not any("RESETS" in figures for figures in shown)


def test_two_steps_are_the_least(tmp_path):
    recording = record(Autopilot(), laps=1)
    few = Recording(recording.track, recording.rows[:1], recording.clock[:1], recording.actions[:1])
    with pytest.raises(ConfigError, match="two steps"):
        draw_racing_line(few, tmp_path / "line.png")
    two = Recording(recording.track, recording.rows[:2], recording.clock[:2], recording.actions[:2])
    assert draw_racing_line(two, tmp_path / "line.png", width_px=320).exists()


def test_only_images_are_written(tmp_path):
    with pytest.raises(TrackError, match=r"\.png"):
        draw_racing_line(record(Autopilot(), laps=1), tmp_path / "line.txt", width_px=320)


def test_speed_colors_grow_brighter():
    assert speed_color(0.0) == speed_color(-1.0) == SPEED_COLORS[0]
    assert speed_color(1.0) == speed_color(2.0) == SPEED_COLORS[-1]
    luma = [np.dot(speed_color(f), [0.299, 0.587, 0.114]) for f in np.linspace(0, 1, 50)]
    assert (np.diff(luma) > 0).all()


@pytest.mark.parametrize(
    ("speeds", "ends"), [([1.23, 2.78], (1.2, 2.8)), ([1.0, 1.0], (1.0, 1.5)), ([0.0, 0.0], (0.0, 0.5))]
)
def test_speed_range(speeds, ends):
    assert speed_range(np.array(speeds)) == pytest.approx(ends)
