"""What is published of a race: nothing of its starts before it is over, and everything to check them by afterwards."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from racecraft.errors import ConfigError
from racecraft.race import Conditions, RaceRules
from racecraft.race.announcement import MAX_DUELS, Announcement, canonical, commitment_of, draw_secret, seed_of
from racecraft.race.rules import race_rules
from racecraft.sim import Bots, Objects, Obstacles, Vehicle
from racecraft.sim.randomization import Randomization
from racecraft.sim.vehicle import PRESETS
from racecraft.track import generate_track, load_track

OVAL = load_track("oval")
OBJECTS = Objects(obstacles=Obstacles(count=2, placement="random"), bots=Bots(count=1))
SECRET = bytes(range(32))


def conditions(**settings: Any) -> Conditions:
    return Conditions(**{"track": OVAL, "rules": race_rules("drfc", {"laps": 2}), "objects": OBJECTS, **settings})


def announced(secret: bytes | None = SECRET, **settings: Any) -> Announcement:
    return Announcement.of(
        conditions(**settings), kind="time-trial", ranking="total", minimum_laps=2, num_trials=5, secret=secret
    )


def test_anybody_can_compute_the_commitment_and_the_seed_without_us() -> None:
    """As docs/races.md says: with nothing but SHA-256 and JSON."""
    published = json.loads(json.dumps(announced().to_dict()))
    document = json.dumps(published["document"], sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    secret = bytes.fromhex(published["secret"])
    assert hashlib.sha256(secret + document.encode()).hexdigest() == published["commitment"]
    seed = int.from_bytes(hashlib.sha256(secret + b"seed").digest()[:8], "little")
    assert announced().seed == seed == seed_of(SECRET)


def test_the_commitment_is_pinned() -> None:
    """One that was published must be checked by every later version in the same way."""
    document = {"form": 1, "b": [1.0, 2.5, True, None], "a": {"ä": 1e-3, "z": "x"}}
    assert canonical(document) == '{"a":{"z":"x","ä":0.001},"b":[1,2.5,true,null],"form":1}'.encode()
    assert commitment_of(document, SECRET) == "a9b6fabc481de0f71eeadd1ed2120c548c8816c44046cd681381b2acdceb4bd0"
    assert seed_of(SECRET) == 1874125158001925932


def test_secrets_are_of_32_bytes_and_never_the_same() -> None:
    drawn = {draw_secret() for _ in range(100)}
    assert len(drawn) == 100
    assert {len(secret) for secret in drawn} == {32}


@pytest.mark.parametrize("secret", [b"", b"short", bytes(33), "0" * 32, bytearray(31)])
def test_of_another_secret_nobody_could_read_the_announcement(secret: Any) -> None:
    with pytest.raises(ConfigError, match="number of bytes of a secret is"):
        announced(secret)
    assert Announcement.from_dict(announced().to_dict()) == announced()


def test_a_seed_is_a_whole_number_that_json_knows() -> None:
    assert announced(None, seed=np.uint64(2**64 - 1)).to_dict() == announced(None, seed=2**64 - 1).to_dict()
    for seed in (-1, 2**64, 1.5, None, "1"):
        with pytest.raises(ConfigError, match="seed is"):
            conditions(seed=seed)
    with pytest.raises(ConfigError, match="objects is None"):
        conditions(objects=None)


def test_while_the_race_is_open_nothing_tells_the_starts() -> None:
    ours = announced()
    open_race = replace(ours, secret="")
    assert open_race.is_secret
    assert open_race.seed is None
    text = json.dumps(open_race.to_dict())
    assert ours.secret not in text
    assert str(ours.seed) not in text
    # not even to somebody who has the document and guesses seeds: the commitment is of the secret, not of the seed
    assert commitment_of(open_race.document, ours.seed.to_bytes(8, "little")) != ours.commitment
    again = Announcement.from_dict(json.loads(text))
    assert again == open_race
    assert again.conditions(OVAL) == replace(conditions(), seed=0)


def test_two_races_with_the_same_rules_have_other_starts() -> None:
    one, other = announced(draw_secret()), announced(draw_secret())
    assert one.document == other.document
    assert one.seed != other.seed
    assert one.commitment != other.commitment


def test_a_race_with_a_known_seed_says_it() -> None:
    known = announced(None, seed=7)
    assert (known.seed, known.secret, known.is_secret) == (7, "", False)
    assert known.document["seed"] == 7
    assert Announcement.from_dict(known.to_dict()) == known
    forged = {**known.to_dict(), "document": {**known.document, "seed": 8}}
    with pytest.raises(ConfigError, match="commitment is not that"):
        Announcement.from_dict(forged)


@pytest.mark.parametrize(
    "change",
    [
        lambda document: document["rules"].update(offtrack_penalty=0.0),
        lambda document: document["rules"].update(laps=1),
        lambda document: document["vehicle"].update(speed_gain=1.5),
        lambda document: document["track"].update(digest="0" * 64),
        lambda document: document["objects"].update(bots=None),
        lambda document: document["randomize"].update(friction=[2.0, 2.0]),
        lambda document: document.update(trials=1),
        lambda document: document.update(ranking="best"),
        lambda document: document.update(minimum_laps=1),
        lambda document: document.update(kind="grid"),
        lambda document: document.update(note="more"),
    ],
)
def test_whatever_is_changed_afterwards_breaks_the_commitment(change: Any) -> None:
    found = json.loads(json.dumps(announced().to_dict()))
    change(found["document"])
    with pytest.raises(ConfigError, match="commitment is not that"):
        Announcement.from_dict(found)


def test_another_secret_breaks_it_too() -> None:
    with pytest.raises(ConfigError, match="commitment is not that"):
        Announcement.from_dict({**announced().to_dict(), "secret": draw_secret().hex()})


@pytest.mark.parametrize(
    "found",
    [
        {},
        {"document": [], "commitment": "0" * 64, "secret": ""},
        {"document": {"form": 1}, "commitment": "0" * 64, "secret": ""},
        {"document": {"form": 2}, "commitment": "0" * 64, "secret": ""},
        {"commitment": "0" * 63},
        {"commitment": "G" * 64},
        {"commitment": 5},
        {"secret": "00"},
        {"secret": None},
        {"document": {"seed": -1}},
        {"document": {"seed": 2**64}},
        {"document": {"seed": True}},
        {"document": {"seed": 5}},
        {"document": {"trials": "5"}},
        {"document": {"trials": True}},
        {"document": {"kind": None}},
    ],
)
def test_what_is_no_announcement_is_refused(found: dict[str, Any]) -> None:
    base = announced().to_dict()
    part = found.get("document")
    if isinstance(part, dict) and "form" not in part:
        found = {**found, "document": {**base["document"], **part}}
    with pytest.raises(ConfigError):
        Announcement.from_dict({**base, **found} if found else {})


def test_nested_without_end_is_refused() -> None:
    deep: Any = []
    for _ in range(100_000):
        deep = [deep]
    with pytest.raises(ConfigError, match="not allowed"):
        Announcement.from_dict({**announced().to_dict(), "document": {**announced().document, "deep": deep}})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"rules": race_rules("drfc", {"laps": 2, "offtrack_penalty": 0.0})},
            "rules offtrack_penalty is 0.0 in the replay and 5",
        ),
        ({"rules": race_rules("drfc", {"laps": 1})}, "rules laps is 1 in the replay and 2"),
        ({"rules": RaceRules(laps=2)}, "jitter is"),
        ({"vehicle": Vehicle(speed_gain=1.5)}, "vehicle speed_gain is 1.5 in the replay and 1.041"),
        ({"vehicle": PRESETS["v6"]}, "vehicle "),
        ({"objects": Objects()}, "objects "),
        ({"objects": replace(OBJECTS, bots=Bots(count=1, speed=0.1))}, "objects bots speed is 0.1"),
        ({"randomize": Randomization(friction=(2.0, 2.0))}, "randomize friction is"),
        ({"cars_per_race": 2}, "cars_per_race is 2"),
        ({"track": generate_track(3)}, "another track"),
        ({"track": replace(OVAL, outer=OVAL.outer * 1.001)}, "another track"),
        ({"seed": 1}, "driven from the seed 1"),
    ],
)
def test_what_was_driven_otherwise_than_announced_is_told(change: dict[str, Any], words: str) -> None:
    race = announced()
    honest = conditions(seed=race.seed)
    assert race.mismatch(honest, num_cars=5) == ""
    assert words in race.mismatch(replace(honest, **change), num_cars=5)


def test_fewer_trials_than_announced_are_told() -> None:
    race = announced()
    for number in (1, 3, 6):
        assert race.mismatch(conditions(seed=race.seed), num_cars=number) == (
            f"it has {number} cars and its race asks for 5"
        )


def test_a_finals_duels_start_where_its_secret_says_and_nowhere_else() -> None:
    final = {"form": "bracket", "best": 8, "qualifying": "c" * 64}
    road = conditions(cars_per_race=2)
    terms: dict[str, Any] = {"kind": "head-to-model", "ranking": "total", "minimum_laps": 1, "num_trials": 1}
    race = Announcement.of(road, **terms, secret=SECRET, final=final)
    seeds = [race.duel_seed(number) for number in range(MAX_DUELS)]
    assert len({*seeds, race.seed}) == MAX_DUELS + 1
    assert seeds[1] == int.from_bytes(hashlib.sha256(SECRET + b"duel 1").digest()[:8], "little")
    for seed in seeds:
        assert race.mismatch(replace(road, seed=seed), num_cars=2) == ""
    assert "none of its race's duels" in race.mismatch(replace(road, seed=race.seed or 0), num_cars=2)
    assert "asks for 2" in race.mismatch(replace(road, seed=seeds[0]), num_cars=1)
    open_race = Announcement.of(road, **terms, secret=None, final=final)
    assert open_race.duel_seed(0) != seeds[0]
    assert open_race.mismatch(replace(road, seed=open_race.duel_seed(0)), num_cars=2) == ""


def test_a_document_of_an_earlier_version_has_the_defaults_of_what_came_later() -> None:
    race = announced()
    document = json.loads(json.dumps(dict(race.document)))
    document["rules"].pop("immobilized_penalty")
    older = Announcement(document=document, commitment=commitment_of(document, SECRET), secret=SECRET.hex())
    assert older.mismatch(conditions(seed=race.seed), num_cars=5) == ""


@pytest.mark.parametrize(
    "change",
    [
        {"rules": {"laps": "many"}},
        {"rules": None},
        {"rules": {"wings": 2}},
        {"vehicle": {"mass": 1e9}},
        {"vehicle": []},
        {"objects": {"obstacles": {"count": 10**6}}},
        {"objects": 3},
        {"objects": {"wings": 2}},
        {"randomize": {"friction": "soft"}},
        {"cars_per_race": "2"},
        {"cars_per_race": 0},
        {"track": None},
    ],
)
def test_settings_that_cannot_be_are_refused_in_our_words(change: dict[str, Any]) -> None:
    document = {**announced().document, **change}
    race = Announcement.from_dict(
        {"document": document, "commitment": commitment_of(document, SECRET), "secret": SECRET.hex()}
    )
    with pytest.raises(ConfigError):
        race.conditions(OVAL)
    assert race.mismatch(conditions(), num_cars=5)
