"""Replay files: nothing is lost, what was driven is driven again to the bit, and no forger or vandal gets far."""

from __future__ import annotations

import json
import re
import struct
import zlib
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecraft.errors import ConfigError, ReplayError
from racecraft.race import Autopilot, Evaluation, RaceRules, evaluate
from racecraft.replay import Replay, header, read_replay, verify, write_replay
from racecraft.replay.codec import MAGIC, TYPES, VERSION, pack, pack_column, unpack, unpack_column
from racecraft.sim import Bots, Objects, Obstacles
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.sim.objects import MAX_OBJECTS
from racecraft.track import load_track

AUTOPILOT = Autopilot(speed=2.0)
HASTY = Autopilot(speed=4.0, lateral_acceleration=8.0)
OVAL = load_track("oval")


def raced(driver: Autopilot = AUTOPILOT, **settings: Any) -> Evaluation:
    rules = RaceRules(**{"laps": 1, **settings.pop("rules", {})})
    given = {"num_trials": 2, "seed": 3, "sees": "state", "num_threads": 1, **settings}
    return evaluate(driver, given.pop("track", OVAL), rules=rules, **given)


EVALUATIONS = {
    "a clean lap": lambda: raced(),
    "mistakes, flying laps": lambda: raced(HASTY, track=load_track("reinvent_2018"), rules={"laps": 2}),
    "standing laps, the other way": lambda: raced(rules={"laps": 2, "is_continuous": False, "direction": "reverse"}),
    "time up while it stands": lambda: raced(HASTY, track=load_track("reinvent_2018"), rules={"time_limit": 5.0}),
    "an open road": lambda: raced(track=load_track("straight")),
    "boxes and bots": lambda: raced(
        objects=Objects(
            obstacles=Obstacles(count=3, placement="random"), bots=Bots(count=2, speed=0.6, changes_lane=True)
        ),
        rules={"max_resets": 4},
    ),
    "other tyres every time": lambda: raced(randomize="strong", num_trials=3),
}


@pytest.fixture(scope="module", params=EVALUATIONS)
def evaluation(request: pytest.FixtureRequest) -> Evaluation:
    return EVALUATIONS[request.param]()


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("replays") / "clean.replay"
    return write_replay(Replay.of(EVALUATIONS["mistakes, flying laps"](), title="mine", names=("a", "b")), path)


def test_nothing_is_lost(evaluation: Evaluation, tmp_path: Path) -> None:
    path = write_replay(Replay.of(evaluation, title="mine"), tmp_path / "race.replay")
    found = read_replay(path)
    assert found.evaluation.summary() == evaluation.summary()
    assert found.conditions.track.digest == evaluation.track.digest
    assert found.conditions == replace(evaluation.conditions, track=found.conditions.track)
    for stored, trial, rewards in zip(found.cars, evaluation.trials, found.rewards, strict=True):
        assert replace(stored, recording=trial.recording) == trial
        for name in ("rows", "clock", "actions", "poses"):
            value, expected = getattr(stored.recording, name), getattr(trial.recording, name)
            assert value.dtype == expected.dtype
            assert value.tobytes() == expected.tobytes(), name
        assert rewards.tobytes() == trial.recording.rewards.tobytes()
    assert write_replay(found, tmp_path / "again.replay").read_bytes() == path.read_bytes()


def test_what_was_driven_is_driven_again_to_the_bit(evaluation: Evaluation) -> None:
    for num_threads in (1, 3):
        assert verify(Replay.of(evaluation), num_threads=num_threads).difference is None


def test_what_is_no_replay_and_no_path_is_not_written(clean: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"^replay is 5; make one with Replay\.of\(evaluation\)\.$"):
        write_replay(5, tmp_path / "five.replay")  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match=r"^path is 5; use a file's path\.$"):
        write_replay(read_replay(clean), 5)  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())
    with pytest.raises(ConfigError, match="evaluation is 5; use what"):
        Replay.of(5)  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match="max_numbers is 'a'; allowed is a whole number"):
        read_replay(clean, max_numbers="a")  # type: ignore[arg-type]
    for wrong in (2, -3, None, 0.5, "a"):
        for told in (read_replay(clean).poses, read_replay(clean).actions):
            with pytest.raises(ConfigError, match=r"^car is .*; allowed is a whole number from -2 to 1\.$"):
                told(wrong)  # type: ignore[arg-type]
    assert (read_replay(clean).poses(-1) == read_replay(clean).poses(1)).all()
    evaluation = read_replay(clean).evaluation
    with pytest.raises(ConfigError, match="title is 5; use a text"):
        Replay.of(evaluation, title=5)  # type: ignore[arg-type]
    for names in (("one",), ("one", 2), "ab"):
        with pytest.raises(ConfigError, match=r"names is .*; allowed is a text for each of 2 trials\."):
            Replay.of(evaluation, names=names)  # type: ignore[arg-type]


def test_what_was_read_cannot_be_changed_by_mistake_and_is_told_as_genuine(clean: Path) -> None:
    replay = read_replay(clean)
    assert not any(car.recording.rows.flags.writeable for car in replay.cars)
    poses = replay.poses(0)
    poses[:, :2] -= poses[0, :2]  # as who plots it from its start does
    replay.actions(0)[:] = 0.0
    assert np.array_equal(replay.poses(0)[:, :2] - replay.poses(0)[0, :2], poses[:, :2])
    assert np.hypot(*replay.poses(0)[0, :2]) > 1.0
    assert verify(replay, num_threads=1).to_dict()["difference"] is None


@pytest.mark.parametrize("race", [{"document": {}, "commitment": 64 * "0", "secret": ""}, 5, b"0"])
def test_a_race_that_is_no_announcement_is_not_passed_over(clean: Path, race: Any) -> None:
    with pytest.raises(ConfigError, match=r"race is .*; use a commitment, or Announcement\.from_dict"):
        verify(read_replay(clean), race=race)


def test_it_says_what_happened_and_is_small(clean: Path) -> None:
    replay = read_replay(clean)
    assert (replay.title, replay.names) == ("mine", ("a", "b"))
    kinds = [kind for car, _, kind in replay.events() if car == 0]
    assert kinds[0] == "prepare"
    assert kinds.count("lap_complete") == 2
    assert kinds.count("off_track") == sum(lap.off_track_count for lap in replay.cars[0].laps) > 0
    assert replay.poses(0).shape == (len(replay.actions(0)), 3)
    steps = sum(len(car.recording) for car in replay.cars)
    assert clean.stat().st_size < 60 * steps


# ---- forgers


def forged(path: Path, change: Any) -> Replay:
    """A replay with a change that its checksum hides."""
    replay = read_replay(path)
    for car in replay.cars:
        car.recording.rows.flags.writeable = True
    return change(replay) or replay


def driving_step(replay: Replay, car: int, number: int) -> int:
    return [i for i, status in enumerate(replay.cars[car].recording.statuses) if status == "in_progress"][number]


@pytest.mark.parametrize("column", [name for name in ROW_COLUMNS if name not in ("time",)])
def test_a_row_that_was_changed_is_found_where_it_was_changed(clean: Path, column: str, tmp_path: Path) -> None:
    replay = forged(clean, lambda _: None)
    step = driving_step(replay, 1, 9)
    rows = replay.cars[1].recording.rows
    rows[step, ROW_COLUMNS.index(column)] = np.nextafter(rows[step, ROW_COLUMNS.index(column)], 1e3)
    found = verify(replay).difference
    assert found is not None
    assert (found.car, found.step, found.what) == (1, step, column)


def test_an_action_that_was_changed_is_found_in_its_step(clean: Path) -> None:
    replay = forged(clean, lambda _: None)
    step = driving_step(replay, 0, 30)
    replay.cars[0].recording.actions[step, 1] *= np.float32(0.999)
    found = verify(replay).difference
    assert found is not None
    assert (found.car, found.step, found.what) == (0, step, "speed")
    assert f"Car 1 differs first in step {step}" in found.sentence


def test_an_action_where_nobody_was_asked_is_found(clean: Path) -> None:
    replay = forged(clean, lambda _: None)
    replay.cars[0].recording.actions[0] = 1.0
    found = verify(replay).difference
    assert found is not None
    assert (found.car, found.step, found.what) == (0, 0, "action")


def test_rewards_laps_and_results_are_checked_too(clean: Path) -> None:
    def reward(replay: Replay) -> None:
        replay.rewards[0][7] += 0.5

    def lap(replay: Replay) -> Replay:
        first = replay.cars[0].laps[0]
        laps = (replace(first, time=first.time - 1.0), *replay.cars[0].laps[1:])
        return replace(replay, cars=(replace(replay.cars[0], laps=laps), replay.cars[1]))

    def result(replay: Replay) -> Replay:
        return replace(replay, cars=(replay.cars[0], replace(replay.cars[1], completion=0.5)))

    def shorter(replay: Replay) -> Replay:
        recording = replay.cars[1].recording
        cut = type(recording)(recording.track, recording.rows[:-3], recording.clock[:-3], recording.actions[:-3])
        return replace(
            replay,
            cars=(replay.cars[0], replace(replay.cars[1], recording=cut)),
            rewards=(replay.rewards[0], replay.rewards[1][:-3]),
        )

    def longer(replay: Replay) -> Replay:
        recording = replay.cars[1].recording
        more = (
            np.concatenate([column, column[-1:]]) for column in (recording.rows, recording.clock, recording.actions)
        )
        return replace(
            replay,
            cars=(replay.cars[0], replace(replay.cars[1], recording=type(recording)(recording.track, *more))),
            rewards=(replay.rewards[0], np.append(replay.rewards[1], 0.0)),
        )

    changes = ((reward, "reward", 0), (lap, "lap", 0), (result, "result", 1), (shorter, "length", 1))
    for change, what, car in (*changes, (longer, "length", 1)):
        verified = verify(forged(clean, change))
        found = verified.difference
        assert found is not None
        assert (found.what, found.car) == (what, car)
        if what == "result":
            assert found.step == len(read_replay(clean).cars[car].recording) - 1
        told = verified.to_dict()
        assert (told["difference"]["what"], told["difference"]["car"]) == (what, car)
        assert told["difference"]["sentence"] == found.sentence
        if what == "reward":
            assert found.step == 7


@pytest.mark.parametrize(
    ("what", "value"),
    [("seed", 4), ("vehicle", {"mass": 7.0}), ("rules", {"laps": 3}), ("rules", {"offtrack_penalty": 1.0})],
)
def test_settings_that_were_changed_lead_elsewhere(clean: Path, tmp_path: Path, what: str, value: Any) -> None:
    document, body = unpack(clean.read_bytes(), name="clean")
    document[what] = {**document[what], **value} if isinstance(value, dict) else value
    path = tmp_path / "forged.replay"
    path.write_bytes(pack(document, [bytes(body)]))
    assert not verify(read_replay(path)).is_genuine


def test_a_replay_of_another_version_says_so(clean: Path, tmp_path: Path) -> None:
    replay = read_replay(clean)
    assert verify(replay).version_note == ""
    old = read_replay(write_replay(replace(replay, written_by="0.0.1"), tmp_path / "old.replay"))
    found = verify(old)
    assert found.is_genuine
    assert "Racecraft 0.0.1" in found.version_note


def test_files_of_the_first_version_are_read_and_driven_as_they_were(clean: Path, tmp_path: Path) -> None:
    """They know neither races nor starts all over the lap."""
    document, body = unpack(clean.read_bytes(), name="clean")
    document.pop("race")
    document["rules"].pop("starts")
    text = json.dumps(document).encode()
    path = tmp_path / "old.replay"
    path.write_bytes(sealed(struct.pack("<I", len(text)) + text + bytes(body), version=1))
    found = read_replay(path)
    assert (found.race, found.conditions.rules.starts) == (None, "line")
    assert verify(found).is_genuine


def test_a_wider_track_of_the_same_name_is_told(clean: Path) -> None:
    replay = read_replay(clean)
    assert verify(replay).track_note == "as in the library"
    track = replay.conditions.track
    wide = replace(track, outer=track.outer + 0.3 * (track.outer - track.centerline))
    found = verify(replace(replay, conditions=replace(replay.conditions, track=wide)))
    assert found.track_note == "not the one of this name in the library"


# ---- vandals


def refused(path: Path, data: bytes, words: str = "") -> None:
    path.write_bytes(data)
    with pytest.raises(ReplayError, match=words or None):
        read_replay(path)


def sealed(body: bytes, *, version: int = VERSION, size: int | None = None) -> bytes:
    prefix = struct.pack("<16sIQ32s", MAGIC, version, len(body) if size is None else size, sha256(body).digest())
    return prefix + zlib.compress(body)


def is_same_stream(data: bytes, other: bytes) -> bool:
    """Whether both say the same: a few bits of what zlib writes mean nothing, and which depends on the content."""
    try:
        return unpack(data, name="one") == unpack(other, name="other")
    except ReplayError:
        return False


def test_every_cut_and_every_flipped_byte_is_noticed(clean: Path, tmp_path: Path) -> None:
    data, path = clean.read_bytes(), tmp_path / "bad.replay"
    for end in [*range(64), *range(64, len(data), max(1, len(data) // 40))]:
        refused(path, data[:end], "damaged|does not begin")
    for place in [*range(64), *range(64, len(data), max(1, len(data) // 40))]:
        changed = bytearray(data)
        changed[place] ^= 0x40
        if not is_same_stream(bytes(changed), data):
            refused(path, bytes(changed), "damaged|does not begin|version|says it holds")
    refused(path, data + b"more", "damaged")
    broken = data[:-1] + bytes([data[-1] ^ 1])
    refused(path, broken, r"^bad\.replay is damaged: its content cannot be unpacked\.$")  # in our words, not in zlib's


def test_what_is_no_replay_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bad.replay"
    refused(path, b"", "does not begin")
    refused(path, b"PK\3\4" + bytes(100), "does not begin")
    with pytest.raises(ReplayError, match="cannot be read"):
        read_replay(tmp_path / "none.replay")
    with pytest.raises(ReplayError, match="cannot be read"):
        read_replay(tmp_path)


def test_a_file_that_is_too_large_is_refused_unread(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("racecraft.replay.replay.MAX_FILE_BYTES", 2000)
    refused(tmp_path / "bad.replay", bytes(2000), "does not begin")
    refused(tmp_path / "bad.replay", bytes(2001), "larger than 2,000 bytes")


def test_other_versions_and_impossible_sizes_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "bad.replay"
    refused(path, sealed(bytes(10), version=3), "version 3")
    refused(path, sealed(bytes(10), version=0), "version 0")
    refused(path, sealed(bytes(10), size=2**63), "says it holds")
    refused(path, sealed(bytes(10), size=4), "damaged")
    refused(path, sealed(bytes(10))[: -len(zlib.compress(bytes(10)))], "damaged")  # a beginning, and nothing after it
    refused(path, sealed(bytes(10_000_000), size=100), "damaged")  # a bomb goes off no further than it says
    refused(path, sealed(struct.pack("<I", 2**31) + b"{}"), "header has")
    refused(path, sealed(struct.pack("<I", 2) + b"[]"), "object")
    refused(path, sealed(struct.pack("<I", 60_000) + b"[" * 60_000), "nested|JSON")


def test_a_body_that_is_larger_than_races_of_its_file_are_is_refused_before_it_takes_memory(tmp_path: Path) -> None:
    refused(tmp_path / "bad.replay", sealed(bytes(20 << 20)), "allowed are 4 to 17,1.* in a file of its size")
    refused(
        tmp_path / "bad.replay",
        sealed(bytes([255]) * (20 << 20) + np.random.default_rng(5).bytes(1 << 19)),
        "header has",
    )  # not too many of it


@pytest.mark.costly
def test_a_car_that_stands_for_half_a_day_is_written_so_that_it_is_read(clean: Path, tmp_path: Path) -> None:
    replay = read_replay(clean)
    car = replay.cars[0]
    rows = np.repeat(car.recording.rows[:1], 700_000, axis=0)
    standing = replace(
        car.recording, rows=rows, clock=np.zeros(len(rows)), actions=np.zeros((len(rows), 2), np.float32)
    )
    long = replace(replay, cars=(replace(car, recording=standing),), rewards=(np.zeros(len(rows)),), names=("a",))
    data = write_replay(long, tmp_path / "long.replay").read_bytes()
    assert len(data) > 5_000_000  # runs of zeros alone would have made 45 kB
    assert read_replay(tmp_path / "long.replay").cars[0].recording.rows.tobytes() == rows.tobytes()


def changed_header(document: dict[str, Any], place: str, value: Any) -> dict[str, Any]:
    document = json.loads(json.dumps(document))
    *way, last = place.split(".")
    inside: Any = document
    for part in way:
        inside = inside[int(part)] if part.isdigit() else inside[part]
    inside[last] = value
    return document


@pytest.mark.parametrize(
    ("place", "value"),
    [
        ("cars.0.steps", 10_000_000),
        ("cars.0.steps", 2**40),
        ("cars.0.steps", 0),
        ("cars.0.steps", -1),
        ("cars.0.steps", "12"),
        ("cars.0.types", []),
        ("cars.0.types", ["f8"] * 999),
        ("cars.0.types", ["f2"]),
        ("cars.0.status", "won"),
        ("cars.0.name", "x" * 10_000),
        ("cars.0.laps", {}),
        ("cars.0.laps", [{"number": 1}]),
        ("cars.0.completion", 3.0),
        ("cars", []),
        ("cars", None),
        ("track.waypoints", 99_999),
        ("track.waypoints", 1),
        ("track.repeats", [10**9]),
        ("track.types", ["f8"]),
        ("seed", -1),
        ("seed", 2**64),
        ("rules", {"laps": 0}),
        ("rules", {"laps": 10**9}),
        ("rules", {"no_such_rule": 1}),
        ("vehicle", {"mass": 0.0}),
        ("vehicle", {"wings": 2}),
        ("camera", {"width": 10**9}),
        ("objects", {"obstacles": {"count": 10**6}}),
        ("objects", {"obstacles": {"count": 2}}),  # allowed, but the rows have no columns for them
        ("objects", {"wings": 2}),
        ("randomize", {"friction": [0.0, 99.0]}),
        ("unknown", 1),
    ],
)
def test_hostile_headers_are_refused(clean: Path, tmp_path: Path, place: str, value: Any) -> None:
    document, body = unpack(clean.read_bytes(), name="clean")
    refused(tmp_path / "bad.replay", pack(changed_header(document, place, value), [bytes(body)]))


def test_hostile_numbers_are_refused(clean: Path, tmp_path: Path) -> None:
    path, replay = tmp_path / "bad.replay", read_replay(clean)
    status, lap = ROW_COLUMNS.index("status"), ROW_COLUMNS.index("lap")
    for column, value in ((status, 10.0), (status, -1.0), (status, 0.5), (lap, 1e12)):
        bad = forged(clean, lambda _: None)
        bad.cars[0].recording.rows[5, column] = value
        with pytest.raises(ReplayError):
            read_replay(write_replay(bad, path))
    rude = replace(replay, names=("\x1b[2J", "b"), title="a\nb")
    found = read_replay(write_replay(rude, path))
    assert (found.names[0], found.title) == ("�[2J", "a�b")
    far = replace(replay.conditions.track, outer=replay.conditions.track.outer + 1e8)
    with pytest.raises(ReplayError, match="within 10,000"):
        read_replay(write_replay(replace(replay, conditions=replace(replay.conditions, track=far)), path))
    replay.rewards[0][3] = np.nan
    with pytest.raises(ReplayError, match="finite"):
        write_replay(replay, path)
    document, body = unpack(clean.read_bytes(), name="clean")
    for value in (np.nan, np.inf):
        with pytest.raises(ReplayError, match="allowed are finite"):
            unpack_column("f8", np.array([value]).tobytes())
    refused(path, pack(document, [bytes(body), b"more"]), "more than its header")
    refused(path, pack(document, [bytes(body[:-5])]), "are missing")


def test_columns_come_back_as_they_were() -> None:
    rng = np.random.default_rng(5)
    columns = [
        (np.zeros(0), "u1"),
        (np.arange(256.0), "u1"),
        (np.array([-1.0, 3.0]), "i2"),
        (np.array([40_000.0, -5.0]), "i4"),
        (np.array([0.5, 2.0**40]), "f4"),
        (np.array([-0.0, 1.0]), "f4"),  # zero has a sign, and keeps it
        (rng.standard_normal(1000), "f8"),
        (np.array([5e-324, 1.7e308]), "f8"),
    ]
    for values, expected in columns:
        kind, data = pack_column(values)
        assert (kind, len(data)) == (expected, len(values) * TYPES[kind])
        assert unpack_column(kind, data).astype(np.float64).tobytes() == values.tobytes()


def test_core_program_and_tab_take_roads_and_races_of_the_same_size() -> None:
    root = Path(__file__).parents[2]
    names = "MAX_CARS", "MAX_LAPS", "MAX_STEPS", "MAX_WAYPOINTS"
    limits = [*(getattr(header, name) for name in names), MAX_OBJECTS]
    tab = (root / "web/src/tab/verify/header.ts").read_text(encoding="utf-8")
    told = re.search(
        r"^const \[MOST_CARS, MOST_LAPS, MOST_STEPS, MOST_WAYPOINTS, MOST_OBJECTS\] = \[(.*)\];", tab, re.M
    )
    assert told is not None
    assert [int(number.replace("_", "")) for number in told[1].split(",")] == limits
    core = (root / "native/src/bindings.cpp").read_text(encoding="utf-8")
    assert f"A track needs 2 to {header.MAX_WAYPOINTS} waypoints" in core
