"""A league's race that is over, checked from afar, and what a dishonest league publishes."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from racecraft.contest.classification import classify
from racecraft.contest.terms import race_terms
from racecraft.errors import ConfigError, RacecraftError
from racecraft.judging.board_verification import published_at, verify_board
from racecraft.judging.race import FORMAT
from racecraft.race import Autopilot, RaceRules, evaluate
from racecraft.race.announcement import Announcement
from racecraft.race.conditions import Conditions
from racecraft.replay import Replay, read_replay, verify, write_replay
from racecraft.track import load_track

SPEEDS = {"Ada": 2.5, "Bob": 1.5, "Cyd": 0.3}  # the last one does not finish
Files = dict[str, bytes]


def driven(speed: float, name: str, secret: bytes) -> tuple[Replay, Announcement]:
    """What somebody drove in the race that a secret gives."""
    rules = RaceRules(laps=1, time_limit=20.0)
    terms = race_terms(Conditions(track=load_track("oval"), rules=rules, seed=0), num_trials=1, secret=secret)
    conditions = terms.conditions
    pilot, seed = Autopilot(speed=speed), terms.announcement.seed or 0
    found = evaluate(pilot, conditions.track, rules=rules, num_trials=1, seed=seed, sees="state", num_threads=1)
    return replace(Replay.of(found, names=(f"{name}s-car",)), race=terms.announcement), terms.announcement


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Files:
    """What an honest league publishes, by path."""
    folder, files, rows = tmp_path_factory.mktemp("league"), {}, []
    replays = [driven(speed, name, bytes(32))[0] for name, speed in SPEEDS.items()]
    announcement = replays[0].race
    assert announcement is not None
    for standing in classify([replay.cars for replay in replays]):
        name = list(SPEEDS)[standing.car]
        number = standing.car + 1
        files[f"/api/boards/7/replays/{number}"] = write_replay(replays[standing.car], folder / name).read_bytes()
        place = {"submission": number, "name": name, "model": f"{name}s-car", "place": standing.place}
        rows.append({**place, **standing.in_whole_ms()})
    assert [row["place"] for row in rows] == [1, 2, None]
    told = {"format": FORMAT, "title": "Cup", "state": "closed", "running": 0, **announcement.to_dict(), "board": rows}
    return {"/api/boards/7/race.json": json.dumps(told).encode(), **files}


@pytest.fixture(scope="module")
def league() -> Iterator[tuple[str, Files]]:
    """A server that publishes whatever is put into its dictionary."""
    files: Files = {}

    class Publisher(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            found = files.get(self.path)
            self.send_response(404 if found is None else 200)
            self.end_headers()
            self.wfile.write(found or b'{"error": {"message": "There is none."}}')

        def log_message(self, *_: Any) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Publisher) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_address[1]}/api/boards/7", files
        server.shutdown()


@pytest.fixture
def publish(
    league: tuple[str, Files], honest: Files, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., str]:
    """Publish a race, changed by a forger; its address."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))

    def published(change: Callable[[dict[str, Any], Files], object] = lambda told, files: None) -> str:
        address, files = league
        files.clear()
        files.update(honest)
        told = json.loads(files["/api/boards/7/race.json"])
        change(told, files)
        files["/api/boards/7/race.json"] = json.dumps(told).encode()
        return address

    return published


def test_an_honest_board_is_genuine(publish: Callable[..., str], tmp_path: Path, honest: Files) -> None:
    address = publish()
    commitment = json.loads(honest["/api/boards/7/race.json"])["commitment"]
    for way in (address, f"{address}/", f"{address}/race.json", address.replace("/api/boards/", "/league/races/")):
        found = verify_board(way, commitment=commitment, num_threads=1)
        assert [row.foul for row in found.rows] == ["", "", ""]
        assert found.is_genuine
    (tmp_path / "its.replay").write_bytes(honest["/api/boards/7/replays/1"])
    assert verify(read_replay(tmp_path / "its.replay"), race=published_at(address), num_threads=1).is_genuine


def row(told: dict[str, Any], name: str) -> dict[str, Any]:
    return next(one for one in told["board"] if one["name"] == name)


def edited_times(told: dict[str, Any], _: Files) -> None:
    row(told, "Bob")["score_ms"] = 5000
    row(told, "Bob")["best_lap_ms"] = 5000


def edited_distance(told: dict[str, Any], _: Files) -> None:
    row(told, "Cyd")["completion"] = 0.999


def swapped_places(told: dict[str, Any], _: Files) -> None:
    row(told, "Ada")["place"], row(told, "Bob")["place"] = 2, 1


def a_place_for_who_did_not_finish(told: dict[str, Any], _: Files) -> None:
    row(told, "Cyd")["place"] = 3


def missing_file(_: dict[str, Any], files: Files) -> None:
    del files["/api/boards/7/replays/2"]


def damaged_file(_: dict[str, Any], files: Files) -> None:
    files["/api/boards/7/replays/2"] = files["/api/boards/7/replays/2"][:-9]


def somebody_elses_replay(_: dict[str, Any], files: Files) -> None:
    files["/api/boards/7/replays/2"] = files["/api/boards/7/replays/1"]


def borrowed_replay(told: dict[str, Any], files: Files) -> None:
    """Bob's row is taken off, and his drive given to Ada."""
    ada, bob = row(told, "Ada"), row(told, "Bob")
    files["/api/boards/7/replays/1"] = files["/api/boards/7/replays/2"]
    ada.update({name: bob[name] for name in ("score_ms", "best_lap_ms", "resets", "completion")})
    told["board"].remove(bob)


FRAUDS: list[tuple[Callable[[dict[str, Any], Files], None], str, str]] = [
    (edited_times, "Bob", "its score is 5.000 s on the board"),
    (edited_distance, "Cyd", "its distance is 0.999000 on the board"),
    (swapped_places, "Ada", "its place is 2 on the board, 1 by the race's rules"),
    (a_place_for_who_did_not_finish, "Cyd", "its place is 3 on the board, none by the race's rules"),
    (missing_file, "Bob", "its replay is missing: There is none"),
    (damaged_file, "Bob", "its replay cannot be read"),
    (somebody_elses_replay, "Bob", "its replay is that of submission 1, choice for choice"),
    (borrowed_replay, "Ada", "its replay is one of 'Bobs-car', not of 'Adas-car'"),
]


@pytest.mark.parametrize(("change", "name", "words"), FRAUDS, ids=lambda value: getattr(value, "__name__", ""))
def test_a_forged_row_is_named(
    publish: Callable[..., str], change: Callable[[dict[str, Any], Files], None], name: str, words: str
) -> None:
    found = verify_board(publish(change), num_threads=1)
    assert not found.is_genuine
    fouls = {one.name: one.foul for one in found.rows}
    assert words in fouls[name]
    assert {other for other, foul in fouls.items() if foul} == ({"Ada", "Bob"} if change is swapped_places else {name})


def test_a_replay_of_another_seed_or_by_other_rules_is_none_of_this_race(
    publish: Callable[..., str], tmp_path: Path
) -> None:
    other, announced = driven(3.0, "Ada", bytes(range(32)))
    here, _ = driven(2.5, "Ada", bytes(32))
    easier = replace(here, conditions=replace(here.conditions, rules=replace(here.conditions.rules, time_limit=99.0)))
    recording = here.cars[0].recording
    actions = recording.actions.copy()
    actions[20, 0] += 0.01
    steered = replace(here, cars=(replace(here.cars[0], recording=replace(recording, actions=actions)),))
    assert announced.seed != here.conditions.seed
    forged = {
        "it was driven from the seed": replace(other, race=here.race),
        "time_limit is 99.0 in the replay": easier,
        "its replay was changed: Car 1 differs first in step": steered,
    }
    for words, replay in forged.items():
        data = write_replay(replay, tmp_path / "forged").read_bytes()
        address = publish(lambda _, files, data=data: files.update({"/api/boards/7/replays/1": data}))
        found = verify_board(address, num_threads=1)
        assert [one.name for one in found.rows if words in one.foul] == ["Ada"], [one.foul for one in found.rows]


@pytest.mark.costly
def test_another_promise_and_what_is_not_over(publish: Callable[..., str]) -> None:
    found = verify_board(publish(), commitment="0" * 64, num_threads=1)
    assert f"and {'0' * 64} was promised" in found.foul
    assert not found.is_genuine
    found = verify_board(publish(lambda told, _: told.update(running=1)), num_threads=1)
    assert "1 submissions are not judged yet" in found.foul
    refused: list[tuple[dict[str, Any], str]] = [
        ({"secret": "1" * 64}, "commitment is not that of its secret and its document"),
        ({"secret": ""}, "its secret is not published"),
        ({"state": "open"}, "not over"),
        ({"format": 99}, "of a version 99"),
        ({"board": None}, "its board is not published"),
        ({"board": [{"submission": 1}]}, "a row that is none"),
        ({"board": [dict.fromkeys(("submission", "resets", "completion"), 1)]}, "row that is none"),
    ]
    for change, words in refused:
        with pytest.raises(RacecraftError, match=words):
            verify_board(publish(lambda told, _, change=change: told.update(change)), num_threads=1)
    with pytest.raises(ConfigError, match="stands twice"):
        verify_board(publish(lambda told, _: told["board"].append(told["board"][0])), num_threads=1)
    for address in ("https://x", "https://x/api/boards/", "https:///api/boards/1", "https://x/1?y"):
        with pytest.raises(ConfigError, match="no address of a race"):
            verify_board(address)
