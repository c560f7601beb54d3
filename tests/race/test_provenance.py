"""By whose rules something was driven: every way to make it easier has its words, and nothing else has."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecraft.race import RULE_SETS, Autopilot, Conditions, RaceRules, evaluate, placings
from racecraft.race.provenance import provenance, track_note
from racecraft.replay import Replay, verify
from racecraft.sim import Bots, Objects, Obstacles, Vehicle
from racecraft.sim.randomization import PRESETS as RANDOMIZATIONS
from racecraft.sim.randomization import Randomization
from racecraft.sim.vehicle import PRESETS
from racecraft.track import Track, generate_track, load_track, save_route

OVAL = load_track("oval")


def conditions(**settings: Any) -> Conditions:
    return Conditions(**{"track": OVAL, "rules": RULE_SETS["drfc"], **settings})


@pytest.mark.parametrize("name", RULE_SETS)
@pytest.mark.parametrize("vehicle", PRESETS)
def test_what_the_library_has_is_named(name: str, vehicle: str) -> None:
    found = provenance(conditions(rules=RULE_SETS[name], vehicle=PRESETS[vehicle]))
    standard = "standard " if vehicle == "v5" else ""
    assert found.sentence == f"driven by {name} rules with the {standard}car {vehicle} on oval"
    assert found.own == ()


@pytest.mark.parametrize(
    "change",
    [{"laps": 7}, {"time_limit": 60.0}, {"direction": "reverse"}, {"start_offset": 0.5}, {"lateral_jitter": 0.3}],
)
def test_what_is_driven_is_a_choice_and_no_rule_of_ones_own(change: dict[str, Any]) -> None:
    assert provenance(conditions(rules=RaceRules(**change))).own == ()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"offtrack_penalty": 0.0}, "offtrack_penalty 0 instead of 5"),
        ({"collision_penalty": 0.0}, "collision_penalty 0 instead of 5"),
        ({"immobilized_penalty": 1.0}, "immobilized_penalty 1 instead of 0"),
        ({"max_resets": 101}, "max_resets 101 instead of 100"),
        ({"mercy_after": 1}, "mercy_after 1 instead of 3"),
        ({"is_continuous": False}, "is_continuous False instead of True"),
    ],
)
def test_every_rule_that_says_what_a_mistake_costs_is_told(change: dict[str, Any], words: str) -> None:
    found = provenance(conditions(rules=RaceRules(**change)))
    assert found.own == ("rules",)
    assert found.rules == f"by rules of its own ({words}, otherwise drfc)"


@pytest.mark.parametrize("name", [name for name in vars(Vehicle()) if name not in ("yaw_inertia", "mass")])
def test_every_parameter_of_the_car_is_told(name: str) -> None:
    value = getattr(Vehicle(), name) * 1.01
    found = provenance(conditions(vehicle=Vehicle(**{name: value})))
    assert found.own == ("vehicle",)
    assert f"car of its own ({name} {value:g} instead of {getattr(Vehicle(), name):g}, otherwise v5)" in found.sentence


def test_what_the_car_differs_in_least_is_what_it_is_compared_with() -> None:
    found = provenance(conditions(vehicle=replace(PRESETS["v4"], speed_gain=1.5)))
    assert "(speed_gain 1.5 instead of 1.102, otherwise v4)" in found.vehicle
    strange = replace(PRESETS["v5"], **{name: 0.9 * value for name, value in vars(Vehicle()).items()})
    assert "12 more, otherwise v5" in provenance(conditions(vehicle=strange)).vehicle


def test_randomisation_may_not_hide_better_tyres() -> None:
    found = provenance(conditions(randomize=Randomization(friction=(3.0, 3.0))))
    assert found.own == ("randomize",)
    assert "friction 3 to 3 instead of 1 to 1" in found.sentence
    assert provenance(conditions(randomize=RANDOMIZATIONS["light"])).sentence.endswith(
        "under the randomisation 'light'"
    )


def test_the_track_is_the_one_of_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wide = replace(OVAL, outer=OVAL.outer + 0.3 * (OVAL.outer - OVAL.centerline))
    found = provenance(conditions(track=wide))
    assert (found.own, found.track) == (("track",), "on a track of its own that is called oval")
    assert provenance(conditions(track=replace(OVAL, name="mine"))).own == ("track",)
    assert provenance(conditions(track=generate_track(7))).own == ()
    # a name is a stranger's: it opens no file, not even one that is there and the same
    save_route(OVAL, tmp_path / "route.npy")
    monkeypatch.chdir(tmp_path)
    for name in ("route.npy", str(tmp_path / "route.npy"), "../route.npy"):
        assert track_note(Track(name, OVAL.centerline, OVAL.inner, OVAL.outer)) == "known from the file only"


def test_what_was_on_the_road_is_told() -> None:
    objects = Objects(obstacles=Obstacles(count=1), bots=Bots(count=3, speed=0.4))
    found = provenance(conditions(objects=objects, cars_per_race=3))
    assert found.sentence.endswith("on oval among 1 box, 3 bots at 0.4 m/s, 2 other cars")
    parked = Objects(obstacles=Obstacles(count=2, kind="car"))
    assert provenance(conditions(objects=parked)).among == "among 2 parked cars"


# ---- where it is said


def raced(**settings: Any) -> Any:
    given = {"rules": RaceRules(laps=1), "num_trials": 1, "sees": "state", "num_threads": 1, **settings}
    return evaluate(Autopilot(), OVAL, **given)


def test_a_replay_that_verifies_says_by_whose_rules() -> None:
    standard = verify(Replay.of(raced()))
    assert standard.sentence == "Genuine: driven by drfc rules with the standard car v5 on oval."
    tuned = verify(Replay.of(raced(vehicle=Vehicle(front_friction=1.9, speed_gain=1.5))))
    assert tuned.is_genuine
    assert tuned.sentence == (
        "Genuine, but with a car of its own (front_friction 1.9 instead of 0.32, speed_gain 1.5 instead of 1.041, "
        "otherwise v5): driven by drfc rules on oval."
    )
    assert tuned.to_dict()["driven"]["own"] == ["vehicle"]
    assert tuned.to_dict()["verdict"] == tuned.sentence
    easy = verify(Replay.of(raced(rules=RaceRules(laps=1, offtrack_penalty=0.0), vehicle=Vehicle(speed_gain=1.5))))
    assert easy.sentence.startswith(
        "Genuine, but by rules of its own (offtrack_penalty 0 instead of 5, otherwise drfc)"
    )
    assert easy.sentence.endswith(
        "and with a car of its own (speed_gain 1.5 instead of 1.041, otherwise v5): driven on oval."
    )


def test_a_car_of_ones_own_has_no_place_among_official_entrants() -> None:
    scale = 50.3 / OVAL.length  # a name with official history, and its length
    lines = (scale * np.asarray(line) for line in (OVAL.centerline, OVAL.inner, OVAL.outer))
    track = Track("2022_april_open", *lines)
    settings: dict[str, Any] = {"rules": RaceRules(laps=1), "num_trials": 1, "sees": "state", "num_threads": 1}
    assert len(placings(evaluate(Autopilot(), track, **settings))) == 1
    own = evaluate(Autopilot(), track, vehicle=Vehicle(speed_gain=1.5), **settings)
    assert own.best_lap is not None
    assert placings(own) == []
