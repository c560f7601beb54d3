"""Replays that the page drives again in WebAssembly: genuine where the installed program says so, and the same first
difference where something was changed. Hostile files get one of the page's sentences."""

from __future__ import annotations

import base64
import hashlib
import json
import struct
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_core_bits import in_node

from racecraft.race import Autopilot, Evaluation, RaceRules, evaluate
from racecraft.race.conditions import Conditions
from racecraft.race.evaluation import race_simulation
from racecraft.race.marshal import Marshal
from racecraft.replay import Replay, read_replay, verify, write_replay
from racecraft.replay.codec import MAGIC, VERSION, pack, unpack
from racecraft.sim import Bots, CameraSpec, Objects, Obstacles
from racecraft.sim.columns import STATE_COLUMNS
from racecraft.sim.randomization import PRESETS
from racecraft.sim.vehicle import load_vehicle
from racecraft.site.plan import plan, track_file
from racecraft.track import Track, load_track

pytestmark = pytest.mark.slow
STEADY = Autopilot(speed=2.0)
HASTY = Autopilot(speed=4.0, lateral_acceleration=8.0)
BIG_SEED = 2**63 + 12345  # more than a number of JavaScript's holds
AMONG = Objects(obstacles=Obstacles(count=3, placement="random"), bots=Bots(count=2, speed=0.6, changes_lane=True))
PLACED = Objects(obstacles=Obstacles(count=2, kind="car", placement="fixed", positions=((0.2, 1), (0.5, -1))))


def raced(driver: Autopilot, track: str, rules: dict[str, Any], **settings: Any) -> Evaluation:
    given = {"num_trials": 2, "seed": 3, "sees": "state", "num_threads": 1, **settings}
    return evaluate(driver, load_track(track), rules=RaceRules(**{"laps": 1, **rules}), **given)


def together(**settings: Any) -> Evaluation:
    """Cars on one road, who see each other."""
    rules = RaceRules(laps=1, max_resets=3, starts="lap", time_limit=20.0)
    conditions = Conditions(track=load_track("oval"), rules=rules, seed=BIG_SEED, cars_per_race=3, **settings)
    simulation = race_simulation(conditions, num_cars=3, num_threads=1)
    marshal = Marshal(simulation, rules, seed=conditions.seed)
    while marshal.is_racing:
        commands = HASTY(simulation.state[:, : len(STATE_COLUMNS)])
        commands[:, 1] *= [0.6, 1.0, 0.8]  # the ones behind run into the first
        marshal.step(commands)
    return Evaluation(conditions=conditions, trials=marshal.trials())


RACES: dict[str, Callable[[], Evaluation]] = {
    "mistakes, flying laps": lambda: raced(HASTY, "reinvent_2018", {"laps": 2, "max_resets": 6}),
    "standing laps, the other way": lambda: raced(
        STEADY, "hairpin", {"laps": 2, "is_continuous": False, "direction": "reverse", "start_offset": 0.3}
    ),
    "time up while it stands": lambda: raced(HASTY, "reinvent_2018", {"time_limit": 5.0}),
    "an open road": lambda: raced(STEADY, "straight", {}),
    "boxes and bots": lambda: raced(STEADY, "oval", {"max_resets": 4}, objects=AMONG),
    "parked cars": lambda: raced(STEADY, "oval", {"max_resets": 4, "starts": "lap"}, objects=PLACED),
    "other tyres every time": lambda: raced(STEADY, "oval", {}, randomize="strong"),
    "three on one road": lambda: together(camera=CameraSpec(), randomize=PRESETS["light"]),
    "a car of its own": lambda: raced(STEADY, "oval", {}, vehicle=replace(load_vehicle("v5"), front_friction=0.5)),
}


def bytes_of(replay: Replay, folder: Path) -> bytes:
    return write_replay(replay, folder / "one.replay").read_bytes()


def changed(data: bytes, folder: Path, change: Callable[[Replay], Replay | None]) -> bytes:
    """What a forger writes, with a checksum that fits."""
    path = folder / "forged.replay"
    path.write_bytes(data)
    replay = read_replay(path)
    for car in replay.cars:
        car.recording.rows.flags.writeable = True
    return bytes_of(change(replay) or replay, folder)


def faster(replay: Replay) -> None:
    replay.cars[1].recording.rows[40, 6] = np.nextafter(replay.cars[1].recording.rows[40, 6], 9.0)


def better_paid(replay: Replay) -> None:
    replay.rewards[0][7] = 1.5


def shorter_lap(replay: Replay) -> Replay:
    first, *rest = replay.cars
    lap = replace(first.laps[0], time=first.laps[0].time - 1.0)
    return replace(replay, cars=(replace(first, laps=(lap, *first.laps[1:])), *rest))


def other_seed(replay: Replay) -> Replay:
    return replace(replay, conditions=replace(replay.conditions, seed=replay.conditions.seed + 1))


FORGERIES = {"speed": faster, "reward": better_paid, "lap": shorter_lap, "seed": other_seed}


def hostile(data: bytes) -> dict[str, bytes]:
    """Files by the page's sentence about them and a few words."""
    header, body = unpack(data, name="it")
    columns = [bytes(body)]

    def says(**fields: Any) -> bytes:
        return pack({**header, **fields}, columns)

    def holding(size: int, packed: bytes) -> bytes:
        return struct.pack("<16sIQ32s", MAGIC, VERSION, size, hashlib.sha256(b"").digest()) + packed

    return {
        "replay_not: another file": b"%PDF-1.7" + data,
        "replay_not: nothing": b"",
        "replay_version: of tomorrow": MAGIC + struct.pack("<I", 3) + data[20:],
        "replay_damaged: cut": data[:-20],
        "replay_damaged: a bit": data[:-30] + bytes([data[-30] ^ 1]) + data[-29:],
        "replay_damaged: a bomb": holding(1000, zlib.compress(bytes(50 << 20))),
        "replay_large: a vault": holding(1 << 40, zlib.compress(b"")),
        "replay_large: denser than a race": holding(64 << 20, zlib.compress(bytes(64 << 20))),
        "replay_damaged: more columns": pack(header, [bytes(body), b"1"]),
        "replay_header: laps": says(rules={**header["rules"], "laps": 10**9}),
        "replay_header: unknown": says(more=1),
        "replay_header: seed": says(seed=2**64),
        "replay_header: lines": says(cars=[{**header["cars"][0], "steps": 10**8}]),
        "replay_damaged: steps": says(cars=[{**header["cars"][0], "steps": 10**5}]),
        "replay_track: stranger's": says(track={**header["track"], "name": "../../etc/passwd"}),
        "replay_road: another": says(track={**header["track"], "name": "hairpin"}),
    }


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What the page says of every file, beside the replays."""
    folder = tmp_path_factory.mktemp("replays")
    replays = {name: Replay.of(race(), title=name) for name, race in RACES.items()}
    files = {name: bytes_of(replay, folder) for name, replay in replays.items()}
    first = files["mistakes, flying laps"]
    files |= {name: changed(first, folder, change) for name, change in FORGERIES.items()}
    files |= hostile(first)
    tracks = {replay.conditions.track.name for replay in replays.values()}
    case = {
        "what": "verify",
        "plan": {**plan(), "tracks": sorted(tracks)},
        "replays": [base64.b64encode(data).decode() for data in files.values()],
        "tracks": {name: track_file(name) for name in tracks},
    }
    says = in_node("core", [case], folder)["results"][0]
    return {"says": dict(zip(files, says, strict=True)), "files": files, "folder": folder, "replays": replays}


def test_what_was_driven_is_driven_again_to_the_bit_in_the_page(found: dict[str, Any]) -> None:
    for name, replay in found["replays"].items():
        said = found["says"][name]
        assert said["difference"] is None, (name, said)
        assert said["steps"] == sum(len(car.recording) for car in replay.cars)
        assert [car["laps"] for car in said["cars"]] == [len(car.lap_times) for car in replay.cars]


def test_the_page_says_by_whose_rules_and_in_whose_car(found: dict[str, Any]) -> None:
    driven = found["says"]["a car of its own"]["driven"]
    assert driven["vehicle"]["name"] == "v5"
    ((name, value, known),) = driven["vehicle"]["differing"]
    assert (name, float(value), float(known)) == ("front_friction", 0.5, load_vehicle("v5").front_friction)
    together = found["says"]["three on one road"]["driven"]
    assert (together["randomize"]["name"], together["others"]) == ("light", 2)
    assert found["says"]["an open road"]["driven"]["rules"] == {"name": "drfc", "differing": []}


def test_what_was_changed_differs_where_the_installed_program_says_so(found: dict[str, Any]) -> None:
    for name in FORGERIES:
        path = found["folder"] / "read.replay"
        path.write_bytes(found["files"][name])
        difference = verify(read_replay(path), num_threads=1).difference
        said = found["says"][name]["difference"]
        assert difference is not None
        assert said is not None, name
        assert (said["car"], said["what"]) == (difference.car, difference.what), name
        if name != "lap":  # the page names the car's last step
            assert said["step"] == difference.step, name
        if isinstance(difference.stored, float):
            assert (float(said["stored"]), float(said["driven"])) == (difference.stored, difference.driven)


def test_a_hostile_file_gets_a_sentence(found: dict[str, Any]) -> None:
    texts = (Path(__file__).parents[2] / "web/src/tab/en.ts").read_text(encoding="utf-8")
    says = {name: said for name, said in found["says"].items() if name.startswith("replay_")}
    assert len(says) == 16
    for name, said in says.items():
        assert said.get("key") == name.partition(":")[0], (name, json.dumps(said)[:300])
        assert f"{said['key']}:" in texts


def test_what_the_page_is_told_of_a_road_is_the_tracks_own(found: dict[str, Any]) -> None:
    track: Track = load_track("oval").reversed()
    road = track_file("oval")["road"]
    arcs = np.frombuffer(base64.b64decode(road["arcs"]["data"])).reshape(2, -1)
    assert (arcs[1] == track.arc_length).all()
    assert road["innerIsLeft"][1] == track.inner_is_left
