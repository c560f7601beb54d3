from dataclasses import replace

import av
import numpy as np
import pytest

from racecraft.errors import ConfigError, RunError
from racecraft.film.overlay import HEIGHT, INSET, WIDTH, Overlay
from racecraft.film.racing_line import draw_racing_line
from racecraft.film.video import END_SECONDS, blink, film, follow, frames
from racecraft.race import Autopilot, RaceRules, Recording, evaluate
from racecraft.sim import CameraSpec
from racecraft.sim.camera import CAMERAS
from racecraft.sim.views import Scene
from racecraft.track import load_track

OVAL = load_track("oval")


def record(driver=None, **rules):
    settings = RaceRules(**{"laps": 1, "offtrack_penalty": 1.0, **rules})
    driver = driver or (lambda state: np.tile(np.float32([0, 2]), (len(state), 1)))
    return evaluate(driver, OVAL, rules=settings, num_trials=1, sees="state").trials[0].recording


CLUMSY = record(max_resets=1)


@pytest.mark.costly
def test_a_video_can_be_read_again(tmp_path):
    path = film(CLUMSY, tmp_path / "race.mp4", name="racer", laps=1)
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        assert (stream.width, stream.height, stream.average_rate) == (640, 480, 15)
        decoded = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
    drawn = [frame.copy() for frame in frames(CLUMSY, name="racer", laps=1)]
    assert len(decoded) == len(drawn) == len(CLUMSY) + round(15 * END_SECONDS)
    for step in (0, len(CLUMSY) // 2, len(drawn) - 1):
        assert np.abs(decoded[step].astype(int) - drawn[step]).mean() < 6
    assert [file.name for file in tmp_path.iterdir()] == ["race.mp4"]
    data = path.read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")  # playable while it loads


def test_bad_paths(tmp_path):
    with pytest.raises(ConfigError, match=r"\.mp4"):
        film(CLUMSY, tmp_path / "race.avi")
    with pytest.raises(RunError, match="cannot be written"):
        film(CLUMSY, tmp_path / "nowhere" / "race.mp4")
    assert list(tmp_path.iterdir()) == []


def test_what_is_no_recording_and_no_path_is_told():
    with pytest.raises(ConfigError, match="recording is 5; use a trial's recording"):
        film(5, "car.mp4")
    with pytest.raises(ConfigError, match="path is 5; use a file's path"):
        film(None, 5)
    with pytest.raises(ConfigError, match="name is 5; use a text"):
        film(None, "car.mp4", name=5)
    with pytest.raises(ConfigError, match="recording is 5; use a trial's recording"):
        draw_racing_line(5, "line.png")
    with pytest.raises(ConfigError, match="title is 5; use a text"):
        draw_racing_line(CLUMSY, "line.png", title=5)


def test_an_empty_recording():
    with pytest.raises(ConfigError, match="recorded"):
        next(frames(Recording(OVAL, CLUMSY.rows[:0], CLUMSY.clock[:0], CLUMSY.actions[:0])))


def test_a_single_step_is_a_video():
    few = Recording(OVAL, CLUMSY.rows[:1], CLUMSY.clock[:1], CLUMSY.actions[:1])
    assert sum(1 for _ in frames(few)) == 1 + round(15 * END_SECONDS)


def test_the_drivers_view_stays_as_the_camera_saw_it():
    x, y, width, height = INSET
    driver = Scene(OVAL).driver_view(CameraSpec(width=width, height=height))
    heading = CLUMSY.column("heading")
    for step, frame in zip(range(20), frames(CLUMSY), strict=False):
        seen = driver.draw(*CLUMSY.origins[step], heading[step])
        np.testing.assert_array_equal(frame[y : y + height, x : x + width], seen)


def test_the_drivers_view_is_that_of_the_cars_own_camera_and_as_old():
    x, y, width, height = INSET
    lens = replace(CAMERAS["2026"], left=0.03, age=0.05)
    driver = Scene(OVAL, palette="2026").driver_view(replace(lens, width=width, height=height))
    poses = CLUMSY.seen_from(lens.age)
    assert np.abs(poses - CLUMSY.poses)[:20, :2].max() > 0.03  # m
    for pose, frame in zip(poses[:20], frames(CLUMSY, camera=lens), strict=False):
        np.testing.assert_array_equal(frame[y : y + height, x : x + width], driver.draw(*pose))


def test_the_car_blinks_while_it_stands():
    alphas = blink(CLUMSY)
    stands = np.array(CLUMSY.statuses) == "pause"
    assert stands.sum() == 15
    assert (alphas[~stands] == 1.0).all()
    assert alphas[stands].min() < 0.4
    assert alphas[stands].max() > 0.9


def test_the_camera_follows_smoothly_and_jumps_with_the_car():
    recording = record(Autopilot(speed=2.0), laps=2)
    behind = np.unwrap(recording.column("heading")) - follow(recording)
    assert np.abs(behind).max() < 0.6
    assert np.abs(np.diff(follow(recording))).max() < 0.15
    stands = CLUMSY.statuses.index("pause")
    assert follow(CLUMSY)[stands] == pytest.approx(np.unwrap(CLUMSY.column("heading"))[stands])


def shown(recording, step, *, is_over=False, laps=0):
    frame = np.full((HEIGHT, WIDTH, 3), 128, dtype=np.uint8)
    Overlay(recording, name="racer", laps=laps).draw(frame, step, is_over=is_over)
    return frame


def pill(frame):
    """The colour where the notice is, if there is one."""
    return tuple(np.median(frame[98:100, 290:350], axis=(0, 1)).astype(int).tolist())


def test_mistakes_and_the_end_are_announced():
    mistake = CLUMSY.statuses.index("off_track")
    none = pill(shown(CLUMSY, mistake - 1))
    assert 60 < min(none) <= max(none) < 128  # the shaded ground
    red = pill(shown(CLUMSY, mistake))
    assert red[0] > 180 > 90 > red[1]
    assert pill(shown(CLUMSY, mistake + 15)) == red
    assert pill(shown(CLUMSY, mistake + 16)) == none
    assert pill(shown(CLUMSY, len(CLUMSY) - 1, is_over=True)) == red
    whole = record(Autopilot(speed=2.0))
    green = pill(shown(whole, len(whole) - 1, is_over=True))
    assert green[1] > 120 > green[0]


def test_progress_grows_along_the_lower_edge():
    recording = record(Autopilot(speed=2.0))
    filled = [(shown(recording, step)[-2, :, 0] > 200).sum() for step in (0, 40, 80, len(recording) - 1)]
    assert filled == sorted(filled)
    assert filled[-1] == WIDTH
    progress = recording.column("progress")
    assert filled[1] == pytest.approx(WIDTH * progress[40], abs=1)


def test_the_middle_is_left_alone():
    frame = shown(CLUMSY, 5)
    assert (frame[140:320] == 128).all()


def test_long_names_are_cut():
    frame = np.full((HEIGHT, WIDTH, 3), 128, dtype=np.uint8)
    Overlay(CLUMSY, name="a name that goes on and on and on and on and never ends").draw(frame, 5)
    plain = shown(CLUMSY, 5)
    np.testing.assert_array_equal(frame[:70, 380:440], plain[:70, 380:440])
