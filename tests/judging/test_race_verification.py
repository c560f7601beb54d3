"""A whole race checked from its files, and what forgers do to one."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from racecraft import train
from racecraft.contest.contest import hold_race
from racecraft.contest.terms import race_terms
from racecraft.errors import ConfigError, ReplayError
from racecraft.judging.race import RunRace, race_models
from racecraft.judging.verification import published, verify_race
from racecraft.learn import PPOConfig
from racecraft.race.announcement import Announcement, draw_secret
from racecraft.race.entry import load_entry
from racecraft.replay import read_replay, verify, write_replay
from racecraft.sim import Vehicle

SOON = {"max_resets": 1, "time_limit": 3.0}
SECRET = bytes(range(32))


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    ppo = PPOConfig(num_envs=8, num_steps=8, minibatch_size=32, update_epochs=1)
    root = tmp_path_factory.mktemp("runs")
    small: dict[str, Any] = {"ppo": ppo, "until": "64 steps", "evaluation_trials": 1, "num_threads": 1, "root": root}
    return [train("oval", **small, seed=seed, name=f"m{seed}").run for seed in (1, 2)]


def race(models: list[Path], root: Path, **settings: Any) -> RunRace:
    given = {"track": "oval", "laps": 1, "changes": SOON, "video": False, "num_threads": 1, "num_trials": 3, **settings}
    return race_models(models, root=root, **given)


@pytest.fixture(scope="module")
def held(models: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    return race(models, tmp_path_factory.mktemp("races"), secret=SECRET).folder


@pytest.fixture
def folder(held: Path, tmp_path: Path) -> Path:
    """A copy to be forged."""
    return Path(shutil.copytree(held, tmp_path / "race"))


def edit(folder: Path, change: Callable[[dict[str, Any]], object]) -> None:
    path = folder / "race.json"
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))


@pytest.mark.costly
def test_the_commitment_is_told_before_anybody_drives(models: list[Path], tmp_path: Path) -> None:
    told: list[Announcement] = []

    def announce(announcement: Announcement) -> None:
        assert not list(tmp_path.iterdir())
        told.append(announcement)

    secret = draw_secret()
    found = race(models, tmp_path, secret=secret, announce=announce)
    document = json.loads((found.folder / "race.json").read_text())
    assert document["commitment"] == told[0].commitment
    assert document["secret"] == secret.hex()
    assert document["driven"]["vehicle"] == "with the standard car v5"
    other = race(models, tmp_path, secret=draw_secret()).contest
    assert other.conditions.seed != found.contest.conditions.seed
    assert other.trials[0][0].recording.rows[0].tolist() != found.contest.trials[0][0].recording.rows[0].tolist()


@pytest.mark.costly
def test_a_race_is_genuine_from_its_files_alone(held: Path, models: list[Path], tmp_path: Path) -> None:
    found = verify_race(held, num_threads=1)
    assert (found.is_genuine, found.is_old, found.foul) == (True, False, "")
    assert set(found.verifications) == {"replay of m1", "replay of m2"}
    commitment = json.loads((held / "race.json").read_text())["commitment"]
    assert verify_race(held / "race.json", race=commitment, num_threads=1).is_genuine
    assert verify_race(held, race=str(held), num_threads=1).is_genuine
    elsewhere = race(models, tmp_path, seed=5).folder
    assert verify_race(elsewhere, num_threads=1).is_genuine  # of a known seed
    assert not verify_race(held, race=str(elsewhere), num_threads=1).is_genuine
    grid = race(models, tmp_path, kind="grid", num_trials=None, secret=SECRET).folder
    assert verify_race(grid, num_threads=1).is_genuine


def test_a_replay_says_of_which_race_it_is(held: Path) -> None:
    replay = read_replay(held / "m1.replay")
    document = json.loads((held / "race.json").read_text())
    found = verify(replay, num_threads=1)
    assert found.is_genuine
    assert found.race_note == f"Of the race {document['commitment']}: its secret gives these starts."
    for race in (document["commitment"], published(str(held)), published(str(held / "race.json"))):
        assert verify(replay, race=race, num_threads=1).is_genuine
    other = verify(replay, race="0" * 64, num_threads=1)
    assert not other.is_genuine
    assert other.sentence == f"Not of its race: its race has the commitment {document['commitment']}, not {'0' * 64}."
    nameless = verify(replace(replay, race=None), race=document["commitment"], num_threads=1)
    assert nameless.foul.startswith("it names no race")


def easier(models: list[Path], held: Path, **conditions: Any) -> Any:
    """A replay driven by the race's starts, but under conditions of the forger's own."""
    replay = read_replay(held / "m1.replay")
    rules = replace(replay.conditions.rules, **conditions.pop("rules", {}))
    given = replace(replay.conditions, rules=rules, **conditions)
    terms = race_terms(given, num_trials=conditions.get("num_trials", 3))
    forged = hold_race([load_entry(models[0])], terms, num_threads=1).replays()[0][1]
    assert verify(forged, num_threads=1).is_genuine  # as far as physics goes
    return forged, replay.race


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"rules": {"offtrack_penalty": 0.0}}, "rules offtrack_penalty is 0.0 in the replay and 5 in its race"),
        ({"rules": {"time_limit": 9.0}}, "rules time_limit is 9.0"),
        ({"rules": {"starts": "line"}}, "rules starts is line in the replay and lap"),
        ({"vehicle": Vehicle(front_friction=1.9)}, "vehicle front_friction is 1.9"),
        ({"seed": 4}, "driven from the seed 4"),
    ],
)
@pytest.mark.costly
def test_a_replay_made_under_easier_rules_is_not_the_races(
    models: list[Path], held: Path, folder: Path, change: dict[str, Any], words: str
) -> None:
    forged, real = easier(models, held, **change)
    # with the announcement of the real race in its header
    claimed = read_replay(write_replay(replace(forged, race=real), folder / "m1.replay"))
    found = verify(claimed, num_threads=1)
    assert not found.is_genuine
    assert words in found.foul
    assert not verify_race(folder, num_threads=1).is_genuine
    # with an announcement of its own, which fits it: the commitment is another one
    own = read_replay(write_replay(forged, folder / "m1.replay"))
    assert verify(own, num_threads=1).is_genuine
    assert not verify(own, race=real.commitment, num_threads=1).is_genuine
    assert words in verify(own, race=real, num_threads=1).foul
    whole = verify_race(folder, num_threads=1)
    assert words in whole.verifications["replay of m1"].foul


def test_a_race_json_that_fits_a_forged_replay_has_another_commitment(
    models: list[Path], held: Path, folder: Path
) -> None:
    commitment = json.loads((held / "race.json").read_text())["commitment"]
    easy = race(models, folder.parent, secret=SECRET, changes={**SOON, "offtrack_penalty": 0.0}).folder
    assert verify_race(easy, num_threads=1).is_genuine
    assert not verify_race(easy, race=commitment, num_threads=1).is_genuine
    forged = json.loads((easy / "race.json").read_text())
    edit(easy, lambda document: document.update(commitment=commitment))
    with pytest.raises(ConfigError, match="commitment is not that"):
        verify_race(easy)
    edit(easy, lambda document: document.update(forged))
    assert verify_race(easy, num_threads=1).is_genuine


@pytest.mark.parametrize(
    "change",
    [
        lambda results: results[0].update(place=1),
        lambda results: results[1].update(score=5.0),
        lambda results: results[1].update(scores=[5.0, 5.0, 5.0]),
        lambda results: results[1].update(resets=0, completion=1.0),
        lambda results: results[0]["lap_seconds"].append([5.0]),
        lambda results: results[0].update(name="m3"),
        lambda results: results.pop(),
        lambda results: results.append(dict(results[0])),
        lambda results: results.clear(),
    ],
)
def test_results_that_the_replays_do_not_lead_to_are_found(
    folder: Path, change: Callable[[list[dict[str, Any]]], object]
) -> None:
    edit(folder, lambda document: change(document["results"]))
    found = verify_race(folder, num_threads=1)
    assert not found.is_genuine
    assert "result" in found.foul


def test_a_forged_action_is_found_in_its_entry(folder: Path) -> None:
    replay = read_replay(folder / "m2.replay")
    replay.cars[1].recording.actions[5] = [0.3, 3.0]
    write_replay(replay, folder / "m2.replay")
    found = verify_race(folder, num_threads=1)
    assert not found.is_genuine
    assert found.verifications["replay of m1"].is_genuine
    difference = found.verifications["replay of m2"].difference
    assert difference is not None
    assert difference.car == 1


def test_while_the_race_is_open_all_but_the_starts_is_checked(held: Path, folder: Path) -> None:
    edit(folder, lambda document: document.update(secret=""))
    announced = published(str(folder))
    assert isinstance(announced, Announcement)
    assert announced.is_secret
    replay = read_replay(held / "m1.replay")
    assert verify(replay, race=announced, num_threads=1).is_genuine
    other = replace(replay, conditions=replace(replay.conditions, vehicle=Vehicle(mass=7.0)))
    assert "mass" in verify(other, race=announced, num_threads=1).foul


@pytest.mark.parametrize("file", ["../m1.replay", "/etc/passwd", "sub/m1.replay", 5, None, ".."])
def test_race_json_opens_no_other_files(folder: Path, file: Any) -> None:
    edit(folder, lambda document: document["files"].update({"replay of m1": file}))
    with pytest.raises(ReplayError, match=r"no file beside it|cannot be read"):
        verify_race(folder)


def test_what_is_no_race_is_refused(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot be read"):
        verify_race(tmp_path / "nothing")
    edit(folder, lambda document: document.update(format=3))
    with pytest.raises(ConfigError, match="version 3"):
        verify_race(folder)
    edit(folder, lambda document: document.update(format=2, files={}))
    with pytest.raises(ReplayError, match="names no replay"):
        verify_race(folder)


def test_a_runs_folder_is_no_race_and_its_replay_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"holds no race: race\.json is missing") as told:
        verify_race(tmp_path)
    assert told.value.hint == ""
    for stamp in ("20260101000000", "20260102000000"):
        replay = tmp_path / f"evaluation-{stamp}" / "evaluation.replay"
        replay.parent.mkdir()
        replay.touch()
    with pytest.raises(ConfigError, match="holds no race") as told:
        verify_race(tmp_path)
    assert told.value.hint == f"Its last evaluation's replay: racecraft verify {replay}"


def test_a_race_under_the_old_rules_says_so(models: list[Path], folder: Path) -> None:
    """As written until there were announcements: one trial from the line, in whatever car, results without scores."""

    def old(document: dict[str, Any]) -> None:
        for name in ("format", "document", "commitment", "secret", "driven"):
            document.pop(name)

    edit(folder, old)
    for name in ("m1", "m2"):
        replay = read_replay(folder / f"{name}.replay")
        write_replay(replace(replay, race=None), folder / f"{name}.replay")
    found = verify_race(folder, num_threads=1)
    assert found.is_old
    assert found.is_genuine
    assert found.to_dict()["is_old"]
    assert not verify_race(folder, race="0" * 64, num_threads=1).is_genuine
