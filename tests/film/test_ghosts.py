"""Ghosts: in the right place at the right time, seen by people and not by the driver."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from racecraft.errors import ConfigError, RunError
from racecraft.film.ghost import LINGERING, best_lap_ghost, ghost_of
from racecraft.film.ghost_source import check_sources, load_ghosts
from racecraft.film.overlay import INSET
from racecraft.film.video import frames
from racecraft.race import Autopilot, RaceRules, evaluate
from racecraft.replay import Replay, write_replay
from racecraft.run.checkpoint import split_model
from racecraft.track import load_track

OVAL = load_track("oval")
BLUE = (62, 130, 247)


def drive(speed: float, *, laps: int = 1, direction: str = "forward"):
    rules = RaceRules(laps=laps, direction=direction)
    return evaluate(Autopilot(speed=speed), OVAL, rules=rules, num_trials=1, sees="state", num_threads=1)


SLOW, FAST = drive(1.5, laps=2), drive(2.5, laps=2)


def test_a_ghost_is_where_its_car_was_at_that_time() -> None:
    recording = FAST.trials[0].recording
    ghost = ghost_of(recording, name="fast", color=BLUE)
    for step in (0, 1, 17, len(recording) - 1):
        view = ghost.at(float(recording.clock[step]))
        assert view is not None
        assert (view.x, view.y, view.heading) == pytest.approx(recording.poses[step])
        assert view.alpha < 1.0
        assert view.color == BLUE
    end = float(recording.clock[-1])
    assert ghost.at(end + LINGERING - 0.1) == ghost.at(end)
    assert ghost.at(end + LINGERING + 0.1) is None
    assert ghost.at(-1.0) == ghost.at(0.0)


def test_the_best_lap_starts_again_with_every_lap() -> None:
    recording = FAST.trials[0].recording
    number = min(recording.lap_times, key=lambda lap: recording.lap_times[lap])
    ghost = best_lap_ghost([SLOW.trials[0].recording, recording], color=BLUE)
    assert ghost is not None
    assert ghost.is_lap
    assert f"{recording.lap_times[number]:.2f} s" in ghost.name
    assert len(ghost.poses) == (recording.lap_numbers == number).sum()
    assert best_lap_ghost([recording.until(1.0)], color=BLUE) is None


def test_a_ghost_accompanies_another_car_step_by_step_and_a_lap_does_so_again_and_again() -> None:
    slow, fast = SLOW.trials[0].recording, FAST.trials[0].recording
    beside = ghost_of(fast, name="fast", color=BLUE).beside(slow)
    assert len(beside) == len(slow)
    assert beside[len(fast) - 1] == ghost_of(fast, name="fast", color=BLUE).at(float(slow.clock[len(fast) - 1]))
    assert beside[-1] is None  # it is home
    lap = best_lap_ghost([fast], color=BLUE)
    assert lap is not None
    again = lap.beside(slow)
    begins = [step for step in range(1, len(slow)) if slow.lap_numbers[step] != slow.lap_numbers[step - 1]]
    assert begins
    assert all(again[step] == lap.at(slow.lap_clock[0]) for step in begins)


def test_the_driver_does_not_see_ghosts_and_people_do() -> None:
    recording = SLOW.trials[0].recording.until(1.5)
    ghost = ghost_of(FAST.trials[0].recording, name="fast", color=BLUE)
    left, top, width, height = INSET
    plain = [frame.copy() for frame in frames(recording)]
    haunted = [frame.copy() for frame in frames(recording, ghosts=[ghost])]
    assert len(plain) == len(haunted)
    inside = (slice(top, top + height), slice(left, left + width))
    seen = 0
    for without, with_ghost in zip(plain, haunted, strict=True):
        assert np.array_equal(without[inside], with_ghost[inside])
        seen += int((without[100:330] != with_ghost[100:330]).any())
    assert seen > len(plain) // 2


def test_ghosts_come_from_replays_of_the_same_road(tmp_path: Path) -> None:
    path = write_replay(Replay.of(FAST, title="fast"), tmp_path / "fast.replay")
    (ghost, again) = load_ghosts([str(path), "best-lap"], SLOW.conditions, recordings=[SLOW.trials[0].recording])
    assert ghost.name == "fast"
    assert np.array_equal(ghost.poses, FAST.trials[0].recording.poses)
    assert again.is_lap
    assert ghost.color != again.color
    track, rules = SLOW.conditions.track, SLOW.conditions.rules
    check_sources([str(path), "best-lap"], track, rules, run=None)
    with pytest.raises(ConfigError, match="another direction"):  # before anybody drives
        check_sources([str(path)], track, replace(rules, direction="reverse"), run=None)
    with pytest.raises(ConfigError, match="up to 16"):
        check_sources(["best-lap"] * 17, track, rules, run=None)
    with pytest.raises(ConfigError, match="another direction"):
        load_ghosts([str(path)], drive(1.5, direction="reverse").conditions)
    with pytest.raises(ConfigError, match="up to 16"):
        load_ghosts(["best-lap"] * 17, SLOW.conditions)
    with pytest.raises(ConfigError, match="no run"):
        load_ghosts(["@100"], SLOW.conditions)
    for ghosts in ("best-lap", None, {"best-lap"}, [5], b"best-lap"):
        with pytest.raises(ConfigError, match=r"ghosts is .*; use a list such as \['best-lap'\]"):
            load_ghosts(ghosts, SLOW.conditions)  # type: ignore[arg-type]
    with pytest.raises(RunError, match="There is no run"):
        load_ghosts([str(tmp_path / "nobody")], SLOW.conditions)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("runs/a", ("runs/a", "")),
        ("runs/a@best", ("runs/a", "best")),
        ("runs/a@4096", ("runs/a", "4096")),
        ("runs/me@home/a", ("runs/me@home/a", "")),
    ],
)
def test_a_model_may_name_its_checkpoint(text: str, expected: tuple[str, str]) -> None:
    assert split_model(text) == expected


def test_a_checkpoint_that_is_none_is_refused() -> None:
    for checkpoint in ("bset", "²", "٣", "-1", "1.0", "9" * 5000):
        with pytest.raises(ConfigError, match=f"Checkpoint '{checkpoint}'"):
            split_model(f"runs/a@{checkpoint}")
    with pytest.raises(ConfigError, match="no name"):
        split_model("")
