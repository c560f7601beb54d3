from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from racecraft.errors import ConfigError
from racecraft.race import RULE_SETS, Autopilot, evaluate, official_races, placings
from racecraft.race.yardstick import PERCENTILES, TIMINGS, Placing, _table
from racecraft.sim import Randomization, Vehicle
from racecraft.track import Track, load_track

SHARED = Path(__file__).parents[3] / "shared"


def named(name: str, length: float) -> Track:
    """Our oval, scaled to a length and called something else."""
    oval = load_track("oval")
    scale = length / oval.length
    lines = {line: scale * getattr(oval, line) for line in ("centerline", "inner", "outer")}
    return Track(name=name, **lines)


def test_every_race_makes_sense() -> None:
    assert len(_table()) == 60
    for race in _table():
        assert race.timing in TIMINGS
        assert race.best <= race.times[0]
        assert list(race.times) == sorted(race.times)
        assert race.length / race.best < 4.0  # so the times are of one lap
        assert race.title.startswith("race of ")


def test_known_percentiles_come_back_and_the_share_falls_with_the_time() -> None:
    for race in _table():
        for percent, time in zip(PERCENTILES, race.times, strict=True):
            if race.times.count(time) == 1 and time > race.best:
                assert race.share_beaten(time)[0] == pytest.approx(100.0 - percent)
        times = np.geomspace(0.5 * race.best, 2 * race.times[-1], 200)
        shares = [race.share_beaten(float(time))[0] for time in times]
        assert (np.diff(shares) <= 0.0).all()
        assert race.share_beaten(0.99 * race.best) == (100.0, "all")
        assert race.share_beaten(1.01 * race.times[-1]) == (10.0, "at most")
    with pytest.raises(ConfigError, match="more than 0"):
        _table()[0].share_beaten(0.0)


def test_a_race_is_found_by_name_and_length_in_its_direction() -> None:
    assert {race.track for race in official_races(named("LGSWide", 38.0))} == {"LGSWide"}
    assert official_races(named("LGSWide", 30.0)) == []
    assert official_races(named("LGSWide", 38.0), direction="reverse") == []
    assert official_races(load_track("oval")) == []
    assert official_races(named("reInvent2019_track_ccw", 23.1))
    assert official_races(named("reInvent2019_track_cw", 23.1)) == []
    assert official_races(named("Albert_cw", 51.4))
    assert official_races(named("Albert_ccw", 51.4)) == []
    found = official_races(named("2024_reinvent_champ_ccw", 25.1))
    assert [race.entrants for race in found] == [6652, 2681]


def test_an_evaluation_is_placed_by_what_the_race_was_ranked_by() -> None:
    track = named("caecer_loop", 35.1)
    rules = replace(RULE_SETS["drfc"], laps=2)
    evaluation = evaluate(Autopilot(speed=2.0), track, rules=rules, num_trials=2, sees="state", num_threads=1)
    by_timing = {placing.race.timing: placing for placing in placings(evaluation)}
    assert by_timing["BEST_LAP_TIME"].time == evaluation.best_lap
    assert by_timing["TOTAL_TIME"].time == pytest.approx(evaluation.total_time / 2)
    assert "faster than about" in by_timing["TOTAL_TIME"].sentence
    assert by_timing["TOTAL_TIME"].to_dict()["month"] == "2021-11"
    own = replace(evaluation.conditions, vehicle=Vehicle(mass=1.7))  # a car that nobody had
    assert placings(replace(evaluation, conditions=own)) == []
    for ranges, places in (({"friction": (2.0, 2.0)}, 0), ({"latency": (0.0, 1.0)}, 0), ({"light": (0.8, 1.0)}, 2)):
        other = replace(evaluation.conditions, randomize=Randomization(**ranges))
        assert len(placings(replace(evaluation, conditions=other))) == places
    unfinished = replace(rules, max_resets=0, time_limit=10.0)
    cut = evaluate(Autopilot(speed=1.0), track, rules=unfinished, num_trials=1, sees="state", num_threads=1)
    assert placings(cut) == []


def test_the_sentences() -> None:
    race = official_races(named("LGSWide", 38.0))[0]

    def says(time: float) -> str:
        share, certainty = race.share_beaten(time)
        return Placing(race=race, time=time, share_beaten=share, certainty=certainty).sentence

    whom = "the 621 entrants of the race of March 2020 on LGSWide"
    assert says(10.0) == f"Total time, per lap 10.00 s: faster than all of {whom} (fastest 13.68 s)."
    assert says(23.0) == f"Total time, per lap 23.00 s: faster than about 92 % of {whom}."
    assert says(200.0) == f"Total time, per lap 200.00 s: slower than 90 % of {whom}."


def test_the_table_is_that_of_the_official_results() -> None:
    if not (SHARED / "laptimes.csv").is_file():
        pytest.skip("../shared/laptimes.csv with the official percentiles is not here")
    with (SHARED / "laptimes.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["race_type"] == "TIME_TRIAL"]
    theirs = sorted(
        (row["track"], row["launch"][:7], int(row["entrants"]), row["timing"], float(row["best"])) for row in rows
    )
    points = sorted([float(row[f"p{percent:.0f}"]) for percent in PERCENTILES] for row in rows)
    assert points == sorted(list(race.times) for race in _table())
    ours = sorted((race.track, race.month, race.entrants, race.timing, race.best) for race in _table())
    assert ours == theirs


def test_every_race_finds_its_route() -> None:
    routes = SHARED / "tracks"
    if not routes.is_dir():
        pytest.skip("the folder ../shared/tracks with AWS's routes is not here")
    found = {race.track for path in routes.glob("*.npy") for race in official_races(load_track(path))}
    assert found == {race.track for race in _table()}
