"""Cars, conditions and roads that races, heats and ladders are asked for in numbers and selections: what they drive."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel, ValidationError
from running_consoles import RunningConsole

from racecraft.errors import ConfigError, TrackError, TrackNotFound
from racecraft.limits import known_limit
from racecraft.race.recording import Recording
from racecraft.replay import read_replay, verify
from racecraft.serve.conditions import randomization_of, told_randomization, told_vehicle, vehicle_of
from racecraft.serve.contests.schemas import NewHeat, NewLadder
from racecraft.serve.contests.terms import terms_of
from racecraft.serve.evaluations.schemas import EvaluateModel
from racecraft.serve.models.schemas import NewModel
from racecraft.serve.races.schemas import NewRace
from racecraft.serve.submissions.league import League
from racecraft.serve.tracks.courses import Courses
from racecraft.sim.randomization import PRESETS as RANDOMIZATIONS
from racecraft.sim.randomization import Randomization
from racecraft.sim.vehicle import PRESETS as VEHICLES
from racecraft.sim.vehicle import Vehicle
from racecraft.track import save_route
from racecraft.track.load import load_track

CAR: dict[str, float] = {"mass": 9.5, "speed_gain": 0.3}
RANGES: dict[str, list[float]] = {"friction": [0.5, 0.5], "blur": [0.0, 1.5]}


@pytest.fixture(scope="module")
def cars(console: RunningConsole) -> list[dict[str, str]]:
    for name in ("ada", "bob"):
        console.create(name=name, track="oval", until="2000 steps", seed=ord(name[0]))
    for job in console.client.get("/api/jobs").json():
        assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    return [{"model": "ada"}, {"model": "bob"}]


def held(console: RunningConsole, room: str, **settings: Any) -> dict[str, Any]:
    reply = console.client.post(f"/api/contests/{room}", json=settings)
    assert reply.status_code == 202, reply.text

    def over() -> Any:
        found = console.client.get(f"/api/contests/{reply.json()['id']}").json()
        assert found["state"] != "failed", found
        return found if found["state"] == "done" else None

    return dict(console.wait_for(over))


def _driven(recording: Recording) -> float:
    """Metres in the first second."""
    return float(np.hypot(*np.diff(recording.poses[:15, :2], axis=0).T).sum())


def test_what_is_asked_is_what_is_told() -> None:
    assert vehicle_of("v4") == VEHICLES["v4"]
    assert told_vehicle(vehicle_of(CAR)) == CAR
    assert vehicle_of({}) == Vehicle()
    assert told_vehicle(Vehicle()) == "v5"
    assert told_randomization(randomization_of({"friction": (0.5, 0.5)})) == {"friction": (0.5, 0.5)}
    assert told_randomization(randomization_of("real")) == "real"
    assert told_randomization(randomization_of({})) == "none"
    for name in ("", "v7", "/etc/passwd", "v4.json"):
        with pytest.raises(ConfigError, match="allowed are v4, v5 and v6"):
            vehicle_of(name)
    with pytest.raises(ConfigError, match="allowed are none, light, strong, aws, real"):
        randomization_of("../x.json")
    with pytest.raises(ConfigError, match=r"A vehicle has no parameter 'mas'\.") as caught:
        vehicle_of({"mas": 3.0})
    assert "mass" in caught.value.hint
    with pytest.raises(ConfigError, match=r"randomize has no quantity 'blurr'\."):
        randomization_of({"blurr": (0.0, 1.0)})


@pytest.mark.parametrize("kind", [EvaluateModel, NewHeat, NewLadder, NewModel, NewRace])
@pytest.mark.parametrize("value", ["heavy", "", None, True, {}, [1.0]])
def test_what_is_no_number_is_refused_in_our_words(kind: type[BaseModel], value: object) -> None:
    for asked, told in (
        ({"vehicle": {"mass": value}}, "Vehicle parameter mass is {}; allowed is a number from 0.1 to 1000."),
        ({"randomize": {"mass": [0.9, value]}}, "Randomization mass is {}; allowed is a number from 0.2 to 5."),
        ({"vehicle": {"wings": value}}, "A vehicle has no parameter 'wings'."),
        ({"randomize": {"mass": value}}, "Randomization mass is {}; allowed is two numbers, least and most."),
    ):
        with pytest.raises(ValidationError) as refused:
            kind.model_validate(asked)
        said = {str(one.get("ctx", {}).get("error")) for one in refused.value.errors()}
        assert told.format(repr(value)) in said


def test_jobs_from_before_cars_had_numbers_still_tell_theirs() -> None:
    before: dict[str, Any] = {
        **{"models": [{"model": "ada", "checkpoint": "best"}] * 2, "track": "oval", "laps": 2, "title": ""},
        **{"kind": "head-to-model", "tracks": ["oval"], "paths": ["oval"], "vehicle": "v6", "randomize": "light"},
    }
    terms = terms_of(before)
    assert (terms.vehicle, terms.randomize) == (VEHICLES["v6"], RANDOMIZATIONS["light"])
    kept = {name: terms.to_dict()[name] for name in ("rules", "objects")}  # all that was kept for a while
    assert terms_of(before | {"terms": kept}) == terms
    del before["randomize"]
    assert terms_of(before | {"terms": kept}).randomize == Randomization()
    assert terms_of({"terms": terms.to_dict()}) == terms


@pytest.mark.costly
def test_a_heat_is_driven_in_a_car_and_conditions_of_ones_own(
    console: RunningConsole, cars: list[dict[str, str]], tmp_path: Path
) -> None:
    asked = {"models": cars, "track": "oval", "seed": 3, "max_resets": 0, "time_limit": 8}
    usual = held(console, "heats", **asked)
    own = held(console, "heats", vehicle=CAR, randomize=RANGES, **asked)
    assert (usual["vehicle"], usual["randomize"]) == ("v5", "none")
    assert (own["vehicle"], own["randomize"]) == (CAR, RANGES)
    replays = []
    for heat in (usual, own):
        path = tmp_path / f"{heat['id']}.replay"
        path.write_bytes(console.client.get(f"/api/contests/{heat['id']}/replay.file").content)
        replays.append(read_replay(path))
    conditions = replays[1].conditions
    assert conditions.vehicle == Vehicle(mass=9.5, speed_gain=0.3)
    assert conditions.randomize == Randomization(friction=(0.5, 0.5), blur=(0.0, 1.5))
    assert verify(replays[1]).is_genuine
    distances = [_driven(replay.cars[0].recording) for replay in replays]
    assert distances[1] < 0.7 * distances[0]  # the other car is slower, whatever the same model asks of it


@pytest.mark.costly
def test_a_race_is_driven_in_a_car_and_conditions_of_ones_own(
    console: RunningConsole, cars: list[dict[str, str]]
) -> None:
    asked = {"title": "Heavy", "track": "oval", "laps": 2, "trials": 1, "seed": 3, "max_resets": 0, "time_limit": 8}
    ranked = {"ranking": "best", "minimum_laps": 2}
    race = console.client.post("/api/races", json={**asked, **ranked, "vehicle": CAR, "randomize": RANGES}).json()
    assert (race["vehicle"], race["randomize"], race["minimum_laps"]) == (CAR, RANGES, 2)
    entries = f"/api/races/{race['id']}/entries"
    assert console.client.post(entries, json={"models": ["ada"]}).status_code == 202
    (job,) = [one for one in console.client.get("/api/jobs?run=ada").json() if one["kind"] == "race"]
    result = console.wait_for(console.job_ended(job["id"]))["result"]
    assert result["verification"]["is_genuine"]
    replay = read_replay(console.runs / ".racecraft" / "races" / job["id"] / "entry.replay")
    assert replay.conditions.vehicle == Vehicle(mass=9.5, speed_gain=0.3)
    assert replay.conditions.randomize == Randomization(friction=(0.5, 0.5), blur=(0.0, 1.5))


@pytest.mark.costly
def test_a_ladder_is_held_on_selections_of_tracks_in_a_car_of_ones_own(
    console: RunningConsole, cars: list[dict[str, str]]
) -> None:
    asked: dict[str, Any] = {"models": cars, "kind": "time-trial", "starts": 1, "seed": 3, "time_limit": 2.0}
    tracks = ["oval", "generated:3..5,length=30", "generated:4,length=30"]
    usual, own = (held(console, "ladders", **asked, tracks=tracks, vehicle=car) for car in ("v5", CAR))
    assert own["tracks"] == tracks
    assert own["vehicle"] == CAR
    driven = {"oval", *(f"generated:{seed},length=30" for seed in (3, 4, 5))}
    assert {match["track"] for match in own["matches"]} == driven
    assert (own["planned"], len(own["matches"])) == (4, 4)
    films = [
        console.client.get(f"/api/contests/{ladder['id']}/replay?match={match['number']}").json()
        for ladder in (usual, own)
        for match in ladder["matches"]
        if match["track"] == "generated:5,length=30"
    ]
    assert films[0]["geometry"] == films[1]["geometry"]
    assert films[0]["geometry"]["name"] == "generated:5,length=30"
    assert films[0]["cars"][0]["trace"] != films[1]["cars"][0]["trace"]


@pytest.mark.parametrize("room", ["contests/heats", "contests/ladders", "races"])
@pytest.mark.costly
def test_cars_and_conditions_that_cannot_be_are_refused(
    console: RunningConsole, cars: list[dict[str, str]], room: str
) -> None:
    needed: dict[str, Any] = {"title": "Cup"} if room == "races" else {"models": cars}
    needed |= {"tracks": ["oval"]} if room.endswith("ladders") else {"track": "oval"}
    for settings, told in (
        ({"vehicle": "/etc/passwd"}, "vehicle is '/etc/passwd'; allowed are v4, v5 and v6."),
        ({"vehicle": {"wings": 2.0}}, "A vehicle has no parameter 'wings'."),
        ({"vehicle": {"mass": -1.0}}, "Vehicle parameter mass is -1.0"),
        ({"vehicle": {"mass": "NaN"}}, "Vehicle parameter mass is nan; allowed is a number from 0.1 to 1000."),
        ({"randomize": {"blur": [0.0, "Infinity"]}}, "Randomization blur is inf; allowed is a number from 0 to "),
        ({"vehicle": {"mass": "heavy"}}, "Vehicle parameter mass is 'heavy'; allowed is a number from 0.1 to 1000."),
        ({"vehicle": {"mass": [1.0]}}, "Vehicle parameter mass is [1.0]; allowed is a number from 0.1 to 1000."),
        ({"vehicle": {"m" * 41: 1.0}}, "vehicle"),
        ({"vehicle": None}, "vehicle is None; allowed are v4, v5 and v6."),
        ({"randomize": "own.json"}, "randomize is 'own.json'"),
        ({"randomize": {"rain": [0.0, 1.0]}}, "randomize has no quantity 'rain'."),
        ({"randomize": {"blur": [1.0, 0.0]}}, "the first number is greater than the second"),
        ({"randomize": {"blur": [0.0, 99.0]}}, "Randomization blur"),
        ({"randomize": {"blur": [0.0]}}, "Randomization blur is [0.0]; allowed is two numbers, least and most."),
        ({"vehicle": {"mass": 0.2}, "randomize": {"mass": [0.2, 0.2]}}, "At an end of the randomization's ranges"),
    ):
        reply = console.client.post(f"/api/{room}", json=needed | settings)
        assert reply.status_code == 422, (settings, reply.text)
        assert told in reply.text


@pytest.mark.costly
def test_roads_that_cannot_be_are_refused(console: RunningConsole, cars: list[dict[str, str]], tmp_path: Path) -> None:
    path = save_route(load_track("oval"), tmp_path / "others.npy")
    for status, tracks in (
        (404, [f"generated:1 + {path}"]),
        (404, [f"generated:1..2 + {path}"]),
        (404, [str(path)]),
        (404, ["generated"]),
        (422, ["generated:1..999"]),
        (422, ["generated:5..1"]),
        (422, ["generated:x"]),
        (422, ["generated:1..3,depth=2"]),
        (422, ["oval"] * 101),
        (404, ["library", "nowhere"]),
    ):
        reply = console.client.post("/api/contests/ladders", json={"models": cars, "tracks": tracks})
        assert reply.status_code == status, (tracks, reply.text)
    many = {"models": [*cars] * 10, "tracks": ["all"], "starts": 20}
    reply = console.client.post("/api/contests/ladders", json=many)
    assert reply.json()["error"]["message"] == "This ladder would have 190000 races; allowed are 20000."


def test_selections_are_of_ones_own_names(tmp_path: Path) -> None:
    courses = Courses(tmp_path)
    save_route(load_track("oval"), tmp_path / "mine.npy")
    library = courses.paths(["library"])
    assert "oval" in library
    assert courses.paths(["all"]) == [*library, *(f"generated:{seed}" for seed in range(32))]
    assert courses.paths(["mine", "oval", "library"])[:2] == [str(tmp_path / "mine.npy"), "oval"]
    assert len(courses.paths(["oval", "library"])) == len(library)
    with pytest.raises(TrackError, match="201 tracks are more than the 200 that go together"):
        courses.paths(["generated:0..200"])
    refusals: list[Callable[[], object]] = [
        lambda: courses.load(f"generated:1 + {tmp_path / 'mine.npy'}"),
        lambda: courses.paths([f"library + {tmp_path / 'mine.npy'}"]),
        lambda: courses.paths([str(tmp_path)]),
    ]
    for refusal in refusals:
        with pytest.raises(TrackNotFound):
            refusal()


def test_a_league_gives_no_medals_for_a_car_that_randomisation_makes_another() -> None:
    track, document = load_track("reinvent_2018"), {"vehicle": asdict(Vehicle())}

    def medals(randomize: Randomization) -> Any:
        told = {**document, "randomize": asdict(randomize)}
        race = SimpleNamespace(owner_id=1, track=track.name, rules={}, document=told)
        session = nullcontext(SimpleNamespace(get_one=lambda *_: race))
        database: Any = SimpleNamespace(transaction=lambda: session)
        courses: Any = SimpleNamespace(load=lambda _: track)
        return League(database, lambda _: courses).medals(1)

    limit = known_limit(track, Vehicle())
    assert limit is not None
    assert medals(Randomization()) == limit.medals
    assert medals(RANDOMIZATIONS["aws"]) == limit.medals  # another light
    assert medals(RANDOMIZATIONS["light"]) is None
