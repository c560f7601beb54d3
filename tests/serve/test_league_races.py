"""A league's races: what is sent in, who judges it, where it stands; and what is refused with which sentence."""

from __future__ import annotations

import gzip
import io
import json
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
import sqlalchemy as sa
from leagues import RunningLeague, ok, refused, running_league, untrained_run

from racecraft.errors import RunError
from racecraft.race.announcement import Announcement, draw_secret
from racecraft.race.conditions import Conditions
from racecraft.race.entry_file import pack_entry
from racecraft.race.likeness import FRAMES
from racecraft.race.policy import WEIGHTS
from racecraft.race.rules import RaceRules
from racecraft.run import RunFolder
from racecraft.run.checkpoint import HEADER_KEY
from racecraft.run.starters import unpack_starter
from racecraft.run.tensor_file import tensor_file
from racecraft.serve.races.races import time_limit
from racecraft.serve.settings import STATE_FOLDER
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job, Race, Submission, now
from racecraft.serve.submissions.bench import Bench
from racecraft.serve.submissions.tasks import REPLAY, submission_folder
from racecraft.track import load_track

pytestmark = pytest.mark.costly

CUP: dict[str, Any] = {"title": "Cup", "track": "oval", "laps": 1, "trials": 2, "max_resets": 1}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    return untrained_run(tmp_path_factory.mktemp("runs"), "novice")


@pytest.fixture(scope="module")
def league(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningLeague]:
    with running_league(tmp_path_factory.mktemp("league") / "runs") as league:
        yield league


class Cup:
    """A race of a group with two racers, who are called otherwise in every one."""

    made = 0

    def __init__(self, league: RunningLeague) -> None:
        Cup.made += 1
        self.owner, group = league.owner, league.group(f"Club {Cup.made}")
        code = league.code(group)
        self.league = league
        self.names = [f"Ada {Cup.made}", f"Bob {Cup.made}"]
        self.ada, self.bob = (league.join(code, name) for name in self.names)
        self.race = ok(self.owner.post(f"/api/groups/{group}/races", json=CUP), 201)["id"]
        self.address = f"/api/league/races/{self.race}/submissions"

    def submit(self, client: httpx.Client, data: bytes, model: str = "novice") -> httpx.Response:
        return client.post(f"{self.address}?model={model}", content=data)

    def judged(self, client: httpx.Client, number: int) -> Any:
        def ended() -> Any:
            found = ok(client.get(f"{self.address}/{number}"))
            return found if found["state"] in ("done", "failed", "cancelled") else None

        return self.league.console.wait_for(ended)

    def drives(self, client: httpx.Client, run: RunFolder) -> int:
        """Somebody's entry, judged."""
        number: int = ok(self.submit(client, pack_entry(run)), 202)["id"]
        assert self.judged(client, number)["state"] == "done"
        return number


@pytest.fixture
def cup(league: RunningLeague) -> Cup:
    return Cup(league)


@pytest.mark.costly
def test_a_judge_that_fails_is_there_for_the_next_entry(run: RunFolder, tmp_path: Path) -> None:
    bench, conditions = Bench(), Conditions(track=load_track("oval"), rules=RaceRules(laps=1, max_resets=1))
    terms = Announcement.of(
        conditions, kind="time-trial", ranking="total", minimum_laps=1, num_trials=1, secret=draw_secret()
    )
    told: dict[str, Any] = {
        "document": dict(terms.document),
        "commitment": terms.commitment,
        "track": "oval",
        "name": "x",
    }
    told |= {"seed": 1, "frames": 2}

    def asked(folder: Path) -> dict[str, Any]:
        with bench.asked(told, folder=folder) as (said, _):
            return said

    (tmp_path / "nowhere").mkdir()
    try:
        with pytest.raises(RunError, match="judge's process failed"):
            asked(tmp_path / "nowhere")
        judge = bench._process
        assert judge is not None
        (tmp_path / "entry.safetensors").write_bytes(b"no weights")
        with pytest.raises(RunError, match="no safetensors file"):
            asked(tmp_path)
        (tmp_path / "entry.safetensors").write_bytes(pack_entry(run))
        answer = asked(tmp_path)
        assert answer["step"] == 64
        assert np.shape(answer["choices"]) == (FRAMES, 2)
        assert bench._process is judge
        environment = Path(f"/proc/{judge.pid}/environ").read_bytes().decode().split("\0")
        assert sorted(filter(None, environment)) == ["OMP_NUM_THREADS=1", "OPENBLAS_NUM_THREADS=1"]
    finally:
        bench.close()


def test_what_is_sent_in_is_judged_and_stands_on_the_board(cup: Cup, run: RunFolder) -> None:
    data = pack_entry(run)
    first = ok(cup.submit(cup.ada, data), 202)
    again = ok(cup.submit(cup.ada, data, "another-name"), 202)
    assert again["id"] == first["id"], "the same file again is the same submission"
    assert "already" in refused(cup.submit(cup.bob, data), 409)
    found = cup.judged(cup.ada, first["id"])
    assert found["state"] == "done", found
    assert found["has_replay"] is False
    board = ok(cup.bob.get(f"/api/boards/{cup.race}"))
    assert (board["entrants"], board["running"], board["mine"]) == (1, 0, None)
    (row,) = board["rows"]
    assert (row["name"], row["model"], row["is_me"]) == (cup.names[0], "novice", False)
    assert ok(cup.ada.get(f"/api/boards/{cup.race}"))["rows"][0]["is_me"]
    refused(cup.bob.get(f"{cup.address}/{first['id']}"), 404)

    # until it is over nobody sees where it starts
    assert board["race"]["secret"] == ""
    assert board["race"]["time_limit"] == time_limit(load_track("oval"), laps=1)
    assert "tells where it starts" in refused(cup.ada.get(f"/api/boards/{cup.race}/replays/{first['id']}"), 409)
    assert "secret" not in json.dumps(ok(cup.ada.get("/api/jobs")))
    with database_of(cup.league) as database, database.transaction() as session:
        race = session.get_one(Race, cup.race)
        job = session.get_one(Job, session.get_one(Submission, first["id"]).job_id)
        assert len(race.secret) == 64
        assert race.secret not in json.dumps(job.payload), "the table of jobs is read on other machines, too"
        own = {"announcement": {"secret": race.secret}}  # as a race in a console of one's own has it
        session.add(Job(id="own", kind="race", run="novice", payload=own, user_id=job.user_id, state="cancelled"))
        secret = race.secret
    kept = ok(cup.ada.get("/api/account/data"))
    assert {(one["race"], one["model"]) for one in kept["submissions"]} == {("Cup", "novice")}
    assert {one["id"] for one in kept["jobs"]} >= {job.id, "own"}
    assert secret not in json.dumps(kept)
    assert ok(cup.bob.get(f"/api/boards/{cup.race}/race.json"))["secret"] == ""
    for nosy in (cup.bob, cup.ada):
        refused(nosy.patch(f"/api/league/races/{cup.race}", json={"is_public": True}), 404)
    with cup.league.stranger() as stranger:
        refused(stranger.get(f"/api/boards/{cup.race}"), 404)
        ok(cup.owner.patch(f"/api/league/races/{cup.race}", json={"is_public": True}))
        told = ok(stranger.get(f"/api/boards/{cup.race}"))["race"]
        assert (told["part"], told["track"], told["track_title"]) == ("spectator", "oval", "Paperclip")
        refused(stranger.post(f"{cup.address}?model=x", content=data), 401)

    # a reason, and back again
    address = f"{cup.address}/{first['id']}"
    refused(cup.bob.post(f"{address}/disqualify", json={"reason": "No."}), 404)
    ok(cup.owner.post(f"{address}/disqualify", json={"reason": "Not its own work."}), 204)
    assert ok(cup.ada.get(address))["disqualified"] == "Not its own work."
    assert ok(cup.ada.get(f"/api/boards/{cup.race}"))["entrants"] == 0
    ok(cup.owner.post(f"{address}/restore"), 204)
    assert ok(cup.ada.get(f"/api/boards/{cup.race}"))["entrants"] == 1


def test_what_is_no_entry_is_refused_with_its_sentence(cup: Cup, run: RunFolder, tmp_path: Path) -> None:
    good = pack_entry(run)
    header, arrays = _parts(good)
    name = next(iter(arrays))

    def packed(tensors: dict[str, Any], **changes: Any) -> bytes:
        return b"".join(tensor_file(tensors, {HEADER_KEY: json.dumps({**header, **changes})}))

    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as bomb:
        bomb.writestr("weights", bytes(1 << 24))
    nothing = np.full_like(arrays[name], np.nan)
    cases: list[tuple[bytes, int, str]] = [
        (b"", 422, "no safetensors"),
        (archive.getvalue(), 422, "no safetensors"),
        (gzip.compress(bytes(1 << 22)), 422, "no safetensors"),
        ((1 << 62).to_bytes(8, "little") + b"{}", 422, "no safetensors"),
        ((8).to_bytes(8, "little") + b"[[[[[[[[", 422, "no entry"),
        (good[:-1], 422, "no entry"),
        (bytes(33 << 20), 413, "at most 32 MB"),
        (packed(arrays, reward="def reward_function(params): pass"), 422, "exactly"),
        (packed({**arrays, "optimizer/m": np.zeros(3, np.float32)}), 422, "no weight of a policy"),
        (packed({**arrays, f"{WEIGHTS}policy.extra": np.zeros(3, np.float32)}), 422, "missing in the network"),
        (packed({**arrays, name: arrays[name].astype(np.float64)}), 422, "F64"),
        (packed({**arrays, name: arrays[name].astype(np.float16)}), 422, "F16"),
        (packed({**arrays, name: arrays[name][:1]}), 422, "does not hold the weights"),
        (packed({**arrays, name: nothing}), 422, "NaN"),
        (packed(arrays, network={**header["network"], "name": "EVIL"}), 422, "known are"),
        (packed(arrays, network={**header["network"], "code": "import os"}), 422, "do not know"),
        (packed(arrays, model_metadata={**header["model_metadata"], "sensor": ["RADAR"]}), 422, "RADAR"),
        (packed(arrays, step="many"), 422, "step"),
    ]
    kept = cup.league.console.runs / ".racecraft" / "submissions"
    before = sorted(kept.glob("*"))
    found = [(refused(cup.submit(cup.bob, data), status), text) for data, status, text in cases]
    assert [(message, text) for message, text in found if text not in message] == []
    assert all("submissions/" not in message for message, _ in found), "no path of the server is told"
    assert ok(cup.bob.get(cup.address)) == ok(cup.owner.get(f"{cup.address}?everybody=true")) == []
    assert sorted(kept.glob("*")) == before
    refused(cup.submit(cup.bob, good, "../../etc"), 422)


def test_who_drives_like_somebody_else_is_shown_to_a_person(league: RunningLeague, tmp_path: Path) -> None:
    owner, group = league.owner, league.group("Copies")
    code = league.code(group)
    ada, bob, mia = (league.join(code, name) for name in ("Lovelace", "Copycat", "Honest"))
    race = ok(owner.post(f"/api/groups/{group}/races", json={**CUP, "title": "Copies"}), 201)["id"]
    address = f"/api/league/races/{race}/submissions"
    header, arrays = _parts(pack_entry(RunFolder(unpack_starter("quick", tmp_path))))
    draw = np.random.default_rng(1)
    noised = {
        name: (one + 0.03 * one.std() * draw.standard_normal(one.shape)).astype(one.dtype)
        for name, one in arrays.items()
    }

    def judged(client: httpx.Client, data: bytes) -> dict[str, Any]:
        number = ok(client.post(f"{address}?model=mine", content=data), 202)["id"]

        def ended() -> Any:
            found = ok(client.get(f"{address}/{number}"))
            return found if found["state"] in ("done", "failed") else None

        found = dict(league.console.wait_for(ended))
        assert found["state"] == "done", found
        return found

    def packed(arrays: dict[str, Any]) -> bytes:
        return b"".join(tensor_file(arrays, {HEADER_KEY: json.dumps(header)}))

    first = judged(ada, packed(arrays))
    own = judged(ada, packed({name: one * np.float32(1.0000001) for name, one in noised.items()}))
    copy = judged(bob, packed(noised))
    honest = judged(mia, pack_entry(RunFolder(unpack_starter("steady", tmp_path))))
    assert [one["is_looked_at"] for one in (first, own, copy, honest)] == [False, False, True, False]
    assert copy["like"] is None, "whose it is like is for who holds the race"
    assert copy["score"] is not None, "it counts until a person says otherwise"

    def seen() -> dict[int, Any]:
        return {one["id"]: one for one in ok(owner.get(f"{address}?everybody=true"))}

    like = seen()[copy["id"]]["like"]
    assert (like["submission"], like["name"], like["model"]) == (first["id"], "Lovelace", "mine")
    assert 0.75 <= like["likeness"] < 1
    assert [seen()[one["id"]]["like"] for one in (first, own, honest)] == [None, None, None]

    refused(bob.post(f"{address}/{copy['id']}/accept"), 404)
    assert "like nobody else's" in refused(owner.post(f"{address}/{honest['id']}/accept"), 409)
    ok(owner.post(f"{address}/{copy['id']}/accept"), 204)
    assert not ok(bob.get(f"{address}/{copy['id']}"))["is_looked_at"]
    assert seen()[copy["id"]]["like"] == like

    # driven once more it is not shown again; taken out it is no longer looked at, and let in again it was
    ok(owner.post(f"{address}/{copy['id']}/judge"), 202)
    league.console.wait_for(lambda: ok(bob.get(f"{address}/{copy['id']}"))["state"] == "done")
    assert not ok(bob.get(f"{address}/{copy['id']}"))["is_looked_at"]


def _parts(data: bytes) -> tuple[dict[str, Any], dict[str, Any]]:
    from safetensors.numpy import load

    length = int.from_bytes(data[:8], "little")
    return json.loads(json.loads(data[8 : 8 + length])["__metadata__"][HEADER_KEY]), load(data)


def test_a_final_of_the_first_a_day_that_is_used_up_and_a_season(league: RunningLeague, tmp_path: Path) -> None:
    owner, group = league.owner, league.group("Season")
    code = league.code(group)
    pupils = {name: league.join(code, name) for name in ("Mia", "Noah")}
    terms = {"track": "oval", "laps": 1, "trials": 1}
    files = [pack_entry(untrained_run(tmp_path, f"novice-{seed}", seed=seed)) for seed in (1, 6, 3)]

    def race(title: str) -> int:
        return int(ok(owner.post(f"/api/groups/{group}/races", json={"title": title, **terms}), 201)["id"])

    def submit(number: int, name: str, file: int) -> httpx.Response:
        return pupils[name].post(f"/api/league/races/{number}/submissions?model=novice", content=files[file])

    def judged(number: int, name: str, submission: int) -> Any:
        def ended() -> Any:
            found = ok(pupils[name].get(f"/api/league/races/{number}/submissions/{submission}"))
            return found if found["state"] == "done" else None

        return league.console.wait_for(ended)

    qualifying, final = race("Qualifying"), race("Final")
    address = f"/api/league/races/{final}"
    ok(owner.post(f"{address}/follow", json={"race": qualifying, "best": 1}))
    assert "itself" in refused(owner.post(f"/api/league/races/{qualifying}/follow", json={"race": final}), 409)
    elsewhere = league.group("Elsewhere")
    foreign = ok(owner.post(f"/api/groups/{elsewhere}/races", json={"title": "x", **terms}), 201)["id"]
    refused(owner.post(f"{address}/follow", json={"race": foreign}), 404)

    # it can follow none again, and is not left behind by the race that it follows
    assert "'Final' takes its drivers from this race" in refused(owner.delete(f"/api/league/races/{qualifying}"), 409)
    refused(pupils["Mia"].delete(f"{address}/follow"), 404)
    assert ok(owner.delete(f"{address}/follow"))["after"] is None
    spare = race("Spare")
    ok(owner.post(f"{address}/follow", json={"race": spare, "best": 1}))
    ok(owner.delete(f"{address}/follow"))
    ok(owner.delete(f"/api/league/races/{spare}"), 204)
    ok(owner.post(f"{address}/follow", json={"race": qualifying, "best": 1}))

    # one a day, and what fails costs none
    ok(owner.patch(f"/api/league/races/{qualifying}", json={"attempts_per_day": 1, "is_frozen": True}))
    assert "frozen" in refused(submit(qualifying, "Mia", 0), 409)
    ok(owner.patch(f"/api/league/races/{qualifying}", json={"is_frozen": False}))
    first = ok(submit(qualifying, "Mia", 0), 202)["id"]
    ok(submit(qualifying, "Mia", 0), 202)  # the same one again is no attempt
    assert "takes 1 a day" in refused(submit(qualifying, "Mia", 2), 409)
    other = ok(submit(qualifying, "Noah", 1), 202)["id"]
    scores = {name: judged(qualifying, name, number)["score"] for name, number in (("Mia", first), ("Noah", other))}
    with database_of(league) as database, database.transaction() as session:
        job = sa.select(Submission.job_id).where(Submission.id == first).scalar_subquery()
        session.execute(sa.update(Job).where(Job.id == job).values(state="failed"))
    ok(submit(qualifying, "Mia", 2), 202)

    # judged again it comes out the same
    refused(pupils["Noah"].post(f"/api/league/races/{qualifying}/submissions/{other}/judge"), 404)
    ok(owner.post(f"/api/league/races/{qualifying}/submissions/{other}/judge"), 202)
    assert judged(qualifying, "Noah", other)["score"] == scores["Noah"]

    # only the first of qualifying drive in the final, once that is over
    assert "not over yet" in refused(submit(final, "Mia", 0), 409)
    league.console.wait_for(lambda: ok(owner.get(f"/api/boards/{qualifying}"))["running"] == 0)
    ok(owner.patch(f"/api/league/races/{qualifying}", json={"closes": now().isoformat()}))
    winner, loser = (row["name"] for row in ok(owner.get(f"/api/boards/{qualifying}"))["rows"])
    assert "The first 1 of 'Qualifying' drive here" in refused(submit(final, loser, 1), 409)
    number = ok(submit(final, winner, 0), 202)["id"]
    judged(final, winner, number)
    assert [row["points"] for row in ok(owner.get(f"/api/groups/{group}/season"))] == [0, 0], "qualifying gives none"
    ok(owner.patch(address, json={"closes": now().isoformat()}))
    first_row, second_row = ok(pupils[winner].get(f"/api/groups/{group}/season"))
    told = [first_row[name] for name in ("name", "points", "races", "wins", "is_me")]
    assert told == [winner, 25, 1, 1, True]
    assert [(one["title"], one["place"], one["points"], one["gap"]) for one in first_row["results"]] == [
        *(("Qualifying", 1, 0, 0.0), ("Final", 1, 25, 0.0))
    ]
    (only,) = second_row["results"]
    assert (second_row["name"], second_row["points"], only["place"]) == (loser, 0, 2)
    times = [row["score"] for row in ok(owner.get(f"/api/boards/{qualifying}"))["rows"]]
    assert only["gap"] == pytest.approx(times[1] / times[0] - 1.0)
    assert only["gap"] > 0


@contextmanager
def database_of(league: RunningLeague) -> Iterator[Database]:
    database = Database(f"sqlite:///{league.console.runs / '.racecraft' / 'console.db'}")
    yield database
    database.close()


def test_a_model_of_ones_own_garage_is_entered_like_any_other(cup: Cup, run: RunFolder) -> None:
    cup.drives(cup.ada, run)
    home = cup.league.console.runs / ".racecraft" / "people" / str(cup.league.number(cup.bob))
    ok(cup.bob.get("/api/models"))
    untrained_run(home, "homemade", seed=2)
    entered = ok(cup.bob.post(f"/api/league/races/{cup.race}/enter", json={"model": "homemade"}), 202)
    assert entered["seconds_left"] is None or entered["seconds_left"] > 0
    assert cup.judged(cup.bob, entered["id"])["state"] == "done"
    board = ok(cup.bob.get(f"/api/boards/{cup.race}"))
    assert {row["name"] for row in board["rows"]} == set(cup.names)
    assert board["mine"] is not None
    assert board["beaten"] in (0.0, 100.0)


def test_the_command_line_enters_from_any_machine(cup: Cup, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from typer.testing import CliRunner

    from racecraft.cli.entry import every_verb

    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    token = ok(cup.bob.post("/api/account/tokens", json={}), 201)["secret"]
    url, run = str(cup.owner.base_url), untrained_run(tmp_path, "from-afar", seed=5)

    def said(*arguments: str) -> str:
        result = CliRunner().invoke(every_verb(), [*arguments], catch_exceptions=True)
        return result.output + (str(result.exception) if result.exception is not None else "")

    assert "No league is known" in said("races")
    assert "no longer good" in said("login", url, "--token", "rc_wrong")
    assert "knows you" in said("login", url, "--token", token)
    kept = tmp_path / "racecraft" / "league.json"
    assert kept.stat().st_mode & 0o077 == 0
    assert "Cup" in said("races")
    assert "Submission" in said("submit", str(run.path), "--race", str(cup.race))
    assert [one["state"] for one in ok(cup.bob.get(cup.address)) if one["model"] == "from-afar"] == ["done"]
    assert "no race 999" in said("submit", str(run.path), "--race", "999")
    for address in ("ftp://x", "http://", "http://x/path"):
        assert "allowed are" in said("login", address, "--token", token)


def test_when_it_is_over_anybody_can_check_it(
    cup: Cup, run: RunFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from typer.testing import CliRunner

    from racecraft.cli.entry import every_verb
    from racecraft.race.announcement import Announcement
    from racecraft.replay import read_replay, verify

    first = cup.drives(cup.ada, run)
    second = cup.drives(cup.bob, untrained_run(tmp_path, "other", seed=2))
    promised = ok(cup.ada.get(f"/api/boards/{cup.race}"))["race"]["commitment"]
    moment = (now()).isoformat()
    ok(cup.owner.patch(f"/api/league/races/{cup.race}", json={"closes": moment}))
    assert "is over" in refused(cup.submit(cup.ada, pack_entry(untrained_run(tmp_path, "late", seed=3))), 409)
    announced = Announcement.from_dict(ok(cup.ada.get(f"/api/boards/{cup.race}/race.json")))
    assert announced.commitment == promised
    assert len(announced.secret) == 64
    path = tmp_path / "entry.replay"
    path.write_bytes(cup.bob.get(f"/api/boards/{cup.race}/replays/{first}").content)
    assert verify(read_replay(path), race=announced).is_genuine

    # the whole board, by the command line of somebody without an account
    ok(cup.owner.patch(f"/api/league/races/{cup.race}", json={"is_public": True}))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    address = f"{cup.owner.base_url}/api/boards/{cup.race}"
    arguments = ["verify", "--race", address, "--commitment", promised]
    checked = CliRunner().invoke(every_verb(), arguments)
    assert checked.exit_code == 0, checked.output
    assert "Genuine: starts, 2 replays and places are what the board says." in checked.output
    assert CliRunner().invoke(every_verb(), ["verify", str(path), "--race", address]).exit_code == 0
    with database_of(cup.league) as database, database.transaction() as session:
        session.execute(sa.update(Submission).where(Submission.id == first).values(completion=1.0))
    checked = CliRunner().invoke(every_verb(), arguments)
    assert checked.exit_code == 1
    assert f"{cup.names[0]}: submission {first}: its distance is 1.000000 on the board" in checked.output
    assert "is over" in refused(cup.owner.patch(f"/api/league/races/{cup.race}", json={"closes": None}), 409)
    _lose_films(cup, first, second)


def _lose_films(cup: Cup, first: int, second: int) -> None:
    """One recording that is damaged or gone spoils no other's film."""
    film = f"/api/boards/{cup.race}/film?submissions={first},{second}"
    with database_of(cup.league) as database, database.transaction() as session:
        jobs = {number: session.get_one(Submission, number).job_id for number in (first, second)}
    state = cup.league.console.runs / STATE_FOLDER
    files = {number: submission_folder(state, job) / REPLAY for number, job in jobs.items()}
    assert ok(cup.bob.get(film))["missing"] == []
    files[first].write_bytes(b"damaged")
    for _ in ("damaged", "gone"):
        told = ok(cup.bob.get(film))
        assert [car["entry"] for car in told["cars"]] == [second]
        assert told["missing"] == [{"entry": first, "model": cup.names[0]}]
        files[first].unlink(missing_ok=True)
    files[second].unlink()
    assert "has no replay" in refused(cup.bob.get(film), 404)


def test_films_of_an_open_race_tell_no_driver_apart(cup: Cup, run: RunFolder) -> None:
    """Of a race whose starts everybody knows there are films at once, too coarse to train by, and no replays."""
    owner, group = cup.owner, ok(cup.owner.get(f"/api/boards/{cup.race}"))["race"]["group"]
    practice = ok(owner.post(f"/api/groups/{group}/races", json={**CUP, "seed": 5}), 201)["id"]
    address = f"/api/league/races/{practice}"
    number = ok(cup.ada.post(f"{address}/submissions?model=novice", content=pack_entry(run)), 202)["id"]
    cup.league.console.wait_for(lambda: ok(cup.ada.get(f"{address}/submissions/{number}"))["state"] == "done")

    def poses(*, sectors: int) -> np.ndarray[Any, Any]:
        film = ok(cup.bob.get(f"/api/boards/{practice}/film?submissions={number}"))
        assert len(film["sectors"]) == sectors  # by which it would be told who brakes where
        return np.array(film["cars"][0]["trace"])

    assert "when the race is over" in refused(cup.bob.get(f"/api/boards/{practice}/replays/{number}"), 409)
    assert ok(cup.bob.get(f"/api/boards/{practice}/race.json"))["board"] == []
    coarse = poses(sectors=0)
    assert (coarse % 50 == 0).all()
    ok(owner.patch(address, json={"closes": now().isoformat()}))
    exact = poses(sectors=2)
    assert (np.abs(exact - coarse) <= 26).all()
    assert (exact % 50 != 0).any()
    assert cup.bob.get(f"/api/boards/{practice}/replays/{number}").status_code == 200
    assert [row["submission"] for row in ok(cup.bob.get(f"/api/boards/{practice}/race.json"))["board"]] == [number]
