"""Training on several tracks at once, both ways, under randomised conditions."""

from __future__ import annotations

import sys

import pytest
from tiny_runs import TINY, Train, assert_same

from racecraft.agent.sensor_suite import SensorSuite
from racecraft.errors import ConfigError, RewardError
from racecraft.run import RunFolder
from racecraft.sim import Randomization
from racecraft.track import load_track
from racecraft.training import Until, resume
from racecraft.training.environment import open_simulation
from racecraft.training.settings import TrainSettings

MANY = {
    "track": ["oval", "generated:0..3"],
    "direction": "alternate",
    "randomize": "strong",
    "ppo": TINY,
    "evaluate_every": 128,
    "evaluation_trials": 4,
}


@pytest.mark.costly
def test_a_resumed_run_ends_in_the_same_weights(tmp_path, tiny: Train):
    whole = tiny(**MANY, until="384 steps", name="whole").run
    part = tiny(**MANY, until="128 steps", name="part").run
    resume(part, until="384 steps")
    assert_same(whole, part)


@pytest.mark.costly
def test_it_drives_all_tracks_both_ways(tiny: Train):
    run = tiny(**MANY, until="2000 steps").run
    settings = RunFolder.open(run).read_info()
    assert settings.track == "oval + generated:0..3"
    assert settings.settings["start"]["mode"] == "random"
    assert settings.settings["randomize"]["latency"] == [0.0, 1.0]
    text = "".join(path.read_text() for path in (run / "training-simtrace").iterdir())
    assert "nan" not in text.lower()


@pytest.mark.parametrize("names", [("oval",), ("oval", "bowtie")])
def test_of_several_tracks_a_car_draws_one_for_every_episode(names):
    tracks = [load_track(name) for name in names]
    settings = TrainSettings(track=" + ".join(names), until=Until(steps=1000), num_threads=1)
    cars = open_simulation(settings, tracks, SensorSuite(("FRONT_FACING_CAMERA",)))
    drawn = [cars.column("track_index").tolist()]
    for _ in range(3):
        cars.reset()
        drawn.append(cars.column("track_index").tolist())
    assert len({tuple(indices) for indices in drawn}) == (1 if len(names) == 1 else 4)
    assert {index for indices in drawn for index in indices} == set(range(len(names)))


@pytest.mark.costly
def test_a_reward_is_tried_on_every_track_that_is_learned_on(tmp_path, tiny: Train):
    source = tmp_path / "short.py"
    source.write_text(
        "def reward_function(params):\n    return {17: 1.0, 23: 1.0}[int(params['track_length'] + 0.5)]\n"
    )
    settings = {"reward": source, "ppo": TINY, "until": "64 steps", "evaluate_every": 64}
    with pytest.raises(RewardError, match="KeyError: 39") as caught:
        tiny(**settings, track=["oval", "bowtie", "hairpin"])
    assert (caught.value.line, caught.value.hint) == (2, "It failed on the track 'hairpin', one of 3.")
    with pytest.raises(RewardError, match="KeyError: 39") as caught:
        tiny(**settings, track="hairpin")
    assert caught.value.hint == ""
    assert tiny(**settings, track=["oval", "bowtie"]).steps == 64


def test_of_very_many_tracks_some_are_tried_the_first_and_the_last_among_them(monkeypatch: pytest.MonkeyPatch):
    dry_run = sys.modules["racecraft.reward.dry_run"]
    tried: list[object] = []
    monkeypatch.setattr(dry_run, "dry_run", lambda source, track: tried.append(track) or [])
    assert dry_run.dry_run_on("", list(range(1000))) == ([], None)
    assert (len(tried), tried[0], tried[-1]) == (dry_run.MOST_TRACKS, 0, 999)
    tried.clear()
    dry_run.dry_run_on("", list(range(7)))
    assert tried == list(range(7))


def test_a_track_that_changed_is_refused(tmp_path, tiny: Train):
    from racecraft.track import generate_track, save_route

    save_route(generate_track(1), tmp_path / "mine.npy")
    run = tiny(**{**MANY, "track": ["oval", str(tmp_path / "mine.npy")]}, until="64 steps").run
    save_route(generate_track(2), tmp_path / "mine.npy")
    with pytest.raises(ConfigError, match="not the one this run was started on"):
        resume(run, until="128 steps")


@pytest.mark.parametrize("randomize", ["stong", Randomization(camera_pitch=(-0.5, 0.0)), 3])
def test_randomisations_that_are_refused(randomize, tiny: Train):
    with pytest.raises(ConfigError):
        tiny(**{**MANY, "randomize": randomize}, until="64 steps")
