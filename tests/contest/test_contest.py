"""Races and ladders of runs, with files: models that can hardly drive, by rules that end soon."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecraft import load_track, train
from racecraft.contest.ladder import hold_ladder
from racecraft.contest.terms import race_terms
from racecraft.errors import ConfigError, RunError
from racecraft.judging.ladder import rate_models
from racecraft.judging.race import race_models
from racecraft.learn import PPOConfig
from racecraft.race import RaceRules
from racecraft.race.conditions import Conditions
from racecraft.race.entry import load_entries
from racecraft.replay import read_replay, verify
from racecraft.run import read_simtrace
from racecraft.sim import Objects, Obstacles

BOXES = Objects(obstacles=Obstacles(count=3, placement="random"))
SOON = {"max_resets": 1, "time_limit": 12.0}


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    ppo = PPOConfig(num_envs=8, num_steps=8, minibatch_size=32, update_epochs=1)
    root = tmp_path_factory.mktemp("runs")
    small: dict[str, Any] = {"ppo": ppo, "until": "64 steps", "evaluate_every": 64, "evaluation_trials": 1}
    return [train("oval", **small, num_threads=1, seed=seed, name=f"m{seed}", root=root).run for seed in (1, 2)]


def race(models: list[Any], root: Path, **settings: Any):
    given = {"track": "oval", "laps": 1, "changes": SOON, "video": False, "num_threads": 1, **settings}
    return race_models(models, root=root, **given)


@pytest.mark.parametrize("models", ["runs/m1", Path("runs/m1"), None, {"runs/m1"}])
def test_what_is_no_list_of_models_is_told(models: Any) -> None:
    with pytest.raises(ConfigError, match=r"models is .*; use a list of run folders"):
        race_models(models, track="oval")
    with pytest.raises(ConfigError, match=r"models is .*; use a list of run folders"):
        rate_models(models, tracks="oval")


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"announce": 5}, "announce is 5; allowed is a function that takes an announcement"),
        ({"changes": 5}, "changes is 5; allowed is a dict of rules by name"),
        ({"root": "\0"}, r"root is '\\x00'; use a folder's path"),
    ],
)
def test_what_is_no_setting_of_a_race_is_told_before_it_is_driven(settings: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        race_models(["a", "b"], track="oval", **settings)
    if "changes" in settings:
        with pytest.raises(ConfigError, match=says):
            rate_models(["a", "b"], tracks="oval", **settings)
        with pytest.raises(ConfigError, match="progress is None; allowed is a function that takes a text"):
            rate_models(["a", "b"], tracks="oval", progress=None)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "settings", [*({"seed": seed} for seed in (-1, None, 1.5)), *({"num_trials": n} for n in (1.5, "2", np.int64(2)))]
)
def test_a_seed_or_a_number_of_trials_that_is_none_is_told(settings: dict[str, Any]) -> None:
    with pytest.raises(ConfigError, match=rf"{next(iter(settings))} is .*; allowed is a whole number from"):
        race_models(["a", "b"], track="oval", **settings)
    if "seed" in settings:
        with pytest.raises(ConfigError, match="seed is"):
            rate_models(["a", "b"], tracks="oval", **settings)


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"root": 5}, "root is 5; use a folder's path"),
        ({"minimum_laps": "a"}, "minimum_laps is 'a'; allowed is 1 to 3, the laps of the race"),
        ({"minimum_laps": 1.5}, "minimum_laps is 1.5; allowed is 1 to 3, the laps of the race"),
    ],
)
def test_a_place_and_laps_that_are_none_are_told(settings: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        race_models(["a", "b"], track="oval", **settings)


@pytest.mark.costly
def test_a_race_writes_results_replays_and_sim_traces(models: list[Path], tmp_path: Path) -> None:
    found = race(models, tmp_path, kind="object-avoidance", objects=BOXES, seed=5)
    document = json.loads((found.folder / "race.json").read_text())
    assert document["results"] == json.loads(json.dumps(found.to_dict()["results"]))
    assert {result["name"] for result in document["results"]} == {"m1", "m2"}
    assert document["models"]["m1"]["step"] == 64
    boxes = []
    for name, trials in zip(("m1", "m2"), found.contest.trials, strict=True):
        replay = read_replay(found.folder / document["files"][f"replay of {name}"])
        assert verify(replay, num_threads=1).is_genuine
        assert replay.names == tuple(f"{name}, trial {number}" for number in range(1, 6))
        rows = read_simtrace(found.folder / document["files"][f"sim-trace of {name}"])
        assert len(rows["episode"]) == sum(len(trial.recording) for trial in trials)
        boxes.append([[(view.x, view.y) for view in trial.recording.objects(0)] for trial in trials])
    assert boxes[0] == boxes[1]  # everybody meets the same boxes
    assert all(one != other for one, other in itertools.combinations(boxes[0], 2))  # in each trial others
    again = race(models, tmp_path, kind="object-avoidance", objects=BOXES, seed=5)
    assert again.folder != found.folder
    assert again.contest.standings == found.contest.standings
    other = race(models, tmp_path, kind="object-avoidance", objects=BOXES, seed=6).contest.trials[0][0]
    assert [(view.x, view.y) for view in other.recording.objects(0)] != boxes[0][0]


def test_a_model_ties_with_itself(models: list[Path], tmp_path: Path) -> None:
    found = race([models[0], f"{models[0]}@64", models[0]], tmp_path)
    assert found.contest.names == ("m1", "m1@64", "m1-2")
    rows = [[trial.recording.rows for trial in trials] for trials in found.contest.trials]
    for one, other, third in zip(*rows, strict=True):
        assert np.array_equal(one, other)
        assert np.array_equal(one, third)
    assert [standing.place for standing in found.contest.standings] == [None] * 3  # nobody came round
    assert len({path.name for path in found.files.values()}) >= 4


@pytest.mark.costly
def test_a_race_is_filmed_with_ghosts(models: list[Path], tmp_path: Path) -> None:
    import av

    found = race(models, tmp_path, video=True, ghosts=[f"{models[0]}@64"], changes={**SOON, "time_limit": 2.0})
    for name in ("m1", "m2"):
        with av.open(str(found.files[f"video of {name}"])) as film:
            assert sum(1 for _ in film.decode(video=0)) > 30


@pytest.mark.parametrize(
    ("settings", "needed"),
    [
        ({}, 3),
        ({"minimum_laps": 3}, 3),
        ({"ranking": "best"}, 1),
        ({"ranking": "best", "minimum_laps": 2}, 2),
        ({"ranking": "average"}, 3),
        ({"ranking": "average", "minimum_laps": 1}, 1),
    ],
)
def test_a_total_needs_all_laps_and_the_other_rankings_as_many_as_are_asked_for(
    settings: dict[str, Any], needed: int
) -> None:
    conditions = Conditions(track=load_track("oval"), rules=RaceRules(laps=3))
    assert race_terms(conditions, **settings).minimum_laps == needed


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"kind": "time-trail"}, "time-trial"),
        ({"kind": "head-to-model", "models": 3}, "is of 2 models; this one has 3"),
        ({"kind": "grid", "models": 9}, "2 to 8"),
        ({"ranking": "luck"}, "ranking"),
        ({"minimum_laps": 2}, "1 to 1"),
        ({"laps": 3, "minimum_laps": 1}, "needs all 3 laps"),  # who gives up after one would be the fastest
        ({"num_trials": 0}, "1 to 99"),
        ({"num_trials": 100}, "1 to 99"),
        ({"num_trials": 2, "kind": "grid"}, "all are on one road"),
        ({"rules": "nobody's"}, "rules is"),
        ({"changes": {"max_resets": -1}}, "max_resets"),
    ],
)
def test_impossible_races_are_refused_before_anything_is_written(
    models: list[Path], tmp_path: Path, settings: dict[str, Any], words: str
) -> None:
    field = (models * 5)[: settings.pop("models", 2)]
    with pytest.raises(ConfigError) as refused:
        race(field, tmp_path / "races", **settings)
    assert words in f"{refused.value} {refused.value.hint}"
    with pytest.raises(RunError):
        race([tmp_path / "nobody"], tmp_path / "races")
    assert not (tmp_path / "races").exists()


# ---- ladders


def ladder(models: list[Any], **settings: Any):
    given = {"tracks": ["oval"], "starts": 2, "changes": SOON, "num_threads": 1, **settings}
    return rate_models(models, **given)


@pytest.mark.costly
def test_a_ladder_is_the_same_again_from_its_seed(models: list[Path]) -> None:
    field = [*models, f"{models[0]}@64"]
    found = ladder(field, seed=4, tracks=["oval", "reinvent_2018"])
    assert ladder(field, seed=4, tracks=["oval", "reinvent_2018"]).to_dict() == found.to_dict()
    assert ladder(field, seed=5, tracks=["oval", "reinvent_2018"]).matches != found.matches
    assert len(found.matches) == 3 * 2 * 2
    rows = {row.name: row for row in found.rows}
    assert sum(row.wins for row in rows.values()) == sum(row.losses for row in rows.values())
    assert all(row.wins + row.draws + row.losses == 8 for row in rows.values())
    assert rows["m1"].draws >= 4  # against itself
    assert [row.place for row in found.rows] == sorted(row.place for row in found.rows)


def test_a_swiss_ladder_has_its_rounds(models: list[Path]) -> None:
    found = ladder([*models, models[0]], schedule="swiss", rounds=4)
    assert len(found.matches) == 4  # one pair, one rests
    assert {match.start for match in found.matches} == {0, 1}


def test_a_model_that_always_ties_with_another_is_rated_like_it(models: list[Path]) -> None:
    found = ladder([models[0], models[0]])
    assert [row.place for row in found.rows] == [1, 1]
    assert found.ratings[0] == found.ratings[1]


def test_a_ladder_of_duels_is_driven_and_the_same_again(models: list[Path]) -> None:
    found = ladder(models, kind="head-to-model", starts=3)
    assert len(found.matches) == 3
    assert ladder(models, kind="head-to-model", starts=3).to_dict() == found.to_dict()


def test_a_model_that_duels_with_itself_wins_by_where_it_starts(models: list[Path]) -> None:
    """A course's second start, half a lap on, is the first of one that begins there, with the other car in front."""
    rules = RaceRules(laps=1, max_resets=1, time_limit=12.0)
    courses = [
        Conditions(track=load_track("oval"), rules=replace(rules, start_offset=offset), seed=1) for offset in (0.0, 0.5)
    ]
    twice = load_entries([models[0], models[0]], num_threads=1)
    found = hold_ladder(twice, courses, kind="head-to-model", starts=2, num_threads=1)
    places = {start: sorted(match.places for match in found.matches if match.start == start) for start in (0, 1)}
    assert [len(of_start) for of_start in places.values()] == [2, 2]
    assert places[1] == sorted(other[::-1] for other in places[0])
    assert (1, 1) not in places[0]


def test_a_grid_race_has_one_replay_of_all(models: list[Path], tmp_path: Path) -> None:
    found = race([*models, models[0]], tmp_path, kind="grid")
    (path,) = tmp_path.glob("*/*.replay")
    replay = read_replay(path)
    assert replay.names == ("m1", "m2", "m1-2")
    assert replay.conditions.cars_per_race == 3
    assert verify(replay, num_threads=1).is_genuine
    assert sorted(standing.place or 0 for standing in found.contest.standings)[0] == 1
    forged = read_replay(path)
    forged.cars[1].recording.actions[10] = [0.3, 3.0]
    difference = verify(forged, num_threads=1).difference
    assert difference is not None
    assert (difference.car, difference.step) == (1, 10)
    assert race([*models, models[0]], tmp_path, kind="grid").contest.standings == found.contest.standings


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"kind": "grid"}, "allowed are time-trial"),
        ({"schedule": "swis"}, "round-robin, swiss"),
        ({"starts": 0}, "1 to 1000"),
        ({"rounds": -1}, "0 to 1000"),
        ({"models": 1}, "2 to 200"),
    ],
)
def test_impossible_ladders_are_refused(models: list[Path], settings: dict[str, Any], words: str) -> None:
    field = models[: settings.pop("models", 2)]
    with pytest.raises(ConfigError, match=words):
        ladder(field, **settings)
