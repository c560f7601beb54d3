"""The generalisation table: the same laps whatever the batch, counted right, written and printed."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from racecraft import generalize as generalize_run
from racecraft import train
from racecraft.errors import ConfigError, TrackNotFound
from racecraft.learn import PPOConfig
from racecraft.race import Generalization, TrackResult, generalization, generalize
from racecraft.sim import CameraSpec
from racecraft.track import Track, load_tracks

SMALL = CameraSpec(width=40, height=30)
TRACKS = load_tracks(["oval", "straight", "kidney", "reinvent_2018"])


class LineFollower:
    """Steers to where the road is in the lower part of the frame; gets round wide bends, not tight ones."""

    def __call__(self, frames: np.ndarray) -> np.ndarray:
        road = frames[:, 14:22].astype(float) < 80
        across = np.arange(frames.shape[2]) - (frames.shape[2] - 1) / 2
        offset = (road * across).sum(axis=(1, 2)) / np.maximum(road.sum(axis=(1, 2)), 1)
        return np.stack([-0.06 * offset, np.full(len(frames), 0.8)], axis=1).astype(np.float32)


class Remembering(LineFollower):
    """Drives slower with every picture that it has seen of a car."""

    def __init__(self) -> None:
        self.seen = np.zeros(99, int)

    def __call__(self, frames: np.ndarray, cars: np.ndarray | None = None) -> np.ndarray:
        assert cars is not None
        assert len(cars) == len(frames)
        commands = super().__call__(frames)
        commands[:, 1] -= 0.0005 * self.seen[cars]
        self.seen[cars] += 1
        return commands

    def forget(self) -> None:
        self.seen[:] = 0


@pytest.fixture(scope="module")
def table() -> Generalization:
    return generalize(LineFollower(), TRACKS, camera=SMALL, num_trials=2, num_threads=1)


def test_rows_come_in_the_order_asked_for(table):
    assert [(row.track, row.direction) for row in table.results] == [
        (track.name, direction) for track in TRACKS for direction in ("forward", "reverse")
    ]
    for row in table.results:
        assert len(row.completions) == 2
        assert row.laps == sum(value == 1.0 for value in row.completions)
        assert all(row.length / 1.2 < time < row.length / 0.5 for time in row.lap_times)
    assert table.trials == 16
    assert table.laps >= 4  # it does get round
    assert table.laps == sum(row.laps for row in table.results)


def test_a_trial_does_not_depend_on_its_company(table, monkeypatch):
    monkeypatch.setattr(generalization, "GROUP", 1)
    alone = generalize(LineFollower(), TRACKS[::-1], camera=SMALL, directions=["reverse"], num_threads=2)
    by_name = {row.track: row for row in table.results if row.direction == "reverse"}
    for row in alone.results:
        assert row.completions[0] == by_name[row.track].completions[0]


def test_who_remembers_is_told_the_cars_apart_and_when_they_begin(table):
    together = generalize(Remembering(), TRACKS[:3], camera=SMALL, num_trials=2, num_threads=1)
    for index, track in enumerate(TRACKS[:3]):
        alone = generalize(Remembering(), [track], camera=SMALL, num_trials=2, num_threads=1)
        assert alone.results == together.results[2 * index : 2 * index + 2]
    assert min(together.results[0].lap_times) > 1.02 * min(table.results[0].lap_times)


def test_no_longer_road_beside_it_gives_a_slow_car_more_time():
    def slowly(frames: np.ndarray) -> np.ndarray:
        return LineFollower()(frames) * np.float32([1.0, 0.3])

    straight, _, longer = sorted(load_tracks(["straight", "oval", "reinvent_2018"]), key=lambda track: track.length)
    assert straight.name == "straight"

    def drive(*tracks: Track) -> TrackResult:
        found = generalize(slowly, tracks, camera=SMALL, directions=["forward"], num_trials=2, num_threads=1)
        return found.results[0]

    alone = drive(straight)
    assert all(0.5 < completion < 1.0 for completion in alone.completions)  # not waited for
    assert drive(straight, longer) == alone


def test_randomisation_changes_trials_and_repeats_with_the_seed():
    def drive(seed: int, **settings: object) -> tuple[tuple[float, ...], ...]:
        found = generalize(
            LineFollower(), TRACKS[2:], camera=SMALL, randomize="strong", seed=seed, directions=["forward"], **settings
        )
        return tuple(row.completions for row in found.results)

    first = drive(1)
    assert first == drive(1, num_threads=2)
    assert first != drive(2)


def test_a_blind_policy_masters_nothing():
    found = generalize(lambda frames: np.tile(np.float32([0.0, 1.0]), (len(frames), 1)), TRACKS[2:], camera=SMALL)
    assert found.laps == 0
    assert 0.0 < found.completion < 0.5
    assert found.mastered == ()


def test_directions_that_are_none_are_told():
    with pytest.raises(ConfigError, match="directions is 5; use a list of forward, reverse"):
        generalize(LineFollower(), TRACKS[:1], directions=5)


def test_what_is_named_twice_counts_once(table):
    twice = generalize(
        LineFollower(), [*TRACKS[:1], *TRACKS[:1]], camera=SMALL, directions=["reverse", "reverse"], num_threads=1
    )
    once = generalize(LineFollower(), TRACKS[:1], camera=SMALL, directions="reverse", seed=np.int64(0), num_threads=1)
    assert twice == once
    assert once.results[0].completions == table.results[1].completions[:1]


def test_the_sums():
    row = TrackResult(track="a", direction="forward", length=10.0, completions=(1.0, 0.5), lap_times=(9.0,))
    other = replace(row, direction="reverse", completions=(1.0, 1.0), lap_times=(8.0, 10.0))
    table = Generalization(results=(row, other, replace(other, track="b")))
    assert (table.trials, table.laps, table.mastered) == (6, 5, ("b",))
    assert table.lap_share == pytest.approx(5 / 6)
    assert table.completion == pytest.approx(5.5 / 6)
    assert table.lap_interval.low < 5 / 6 < table.lap_interval.high
    document = table.to_dict()
    assert document["results"][1]["mean_lap_s"] == 9.0
    assert document["results"][1]["best_lap_s"] == 8.0
    assert document["tracks"] == 2


@pytest.mark.parametrize(
    "settings",
    [
        *({"tracks": []}, {"directions": []}, {"directions": ["up"]}, {"num_trials": 0}, {"num_trials": 101}),
        *({"seed": seed} for seed in (-1, 2**64, 1.5, None, "1")),
    ],
)
def test_mistakes(settings):
    with pytest.raises(ConfigError):
        generalize(LineFollower(), **{"tracks": TRACKS[:1], "camera": SMALL, **settings})


@pytest.mark.costly
def test_a_run_on_several_tracks_keeps_its_table(tmp_path: Path):
    ppo = PPOConfig(num_envs=8, num_steps=8, minibatch_size=32, update_epochs=1)
    run = train(
        ["oval", "generated:0..2"],
        until="128 steps",
        direction="alternate",
        randomize="strong",
        ppo=ppo,
        evaluate_every=64,
        evaluation_trials=3,
        num_threads=1,
        root=tmp_path,
    ).run
    found = generalize_run(run, tracks=["oval", "kidney"], randomize="light", num_threads=1)
    written = json.loads(found.path.read_text())
    assert written["results"] == found.to_dict()["results"]
    assert written["step"] == found.step
    assert [row["track"] for row in written["results"]] == ["oval", "oval", "kidney", "kidney"]
    with pytest.raises(TrackNotFound):
        generalize_run(run, tracks="ovall")
