"""Workers that hold an address and a token, and nothing else: they do what others do, and may do nothing more."""

from __future__ import annotations

import hashlib
import json
import secrets
import shutil
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
import sqlalchemy as sa
from leagues import RunningLeague, ok, refused, running_league
from postgres_servers import PostgresServer
from running_consoles import PATIENCE, plain_client, running_console
from running_workers import RunningWorker, running_worker
from s3_servers import S3Server
from sqlalchemy.orm import Session

from free_ports import free_port

pytest.importorskip("obstore")
from racecraft.run import RunFolder
from racecraft.serve.jobs.line import MAX_OBJECT, Line
from racecraft.serve.jobs.parcel import MAX_PARCEL, pack
from racecraft.serve.jobs.queue import LEASE
from racecraft.serve.jobs.remote import RemoteObjects
from racecraft.serve.settings import ServeSettings
from racecraft.serve.store.artifacts import Artifacts
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job
from racecraft.training.job import Training
from racecraft.version import VERSION

pytestmark = [
    pytest.mark.costly,
    pytest.mark.skipif(sys.platform != "linux", reason="finds processes in /proc"),
]

UNTIL = "8000 steps"


class Place:
    """A league that leaves its trainings to workers who come with tokens."""

    def __init__(self, league: RunningLeague, folder: Path, store: str) -> None:
        self.league, self.console, self.folder = league, league.console, folder
        self.url = str(league.owner.base_url).rstrip("/")
        self.artifacts = Artifacts(store)

    def token(self) -> tuple[int, str]:
        asked = {"title": "lab", "scopes": ["worker"]}
        made = ok(self.league.owner.post("/api/account/tokens", json=asked), 201)
        return made["id"], made["secret"]

    def worker(self, name: str, token: str, *, is_forked: bool = True) -> AbstractContextManager[RunningWorker]:
        file = self.folder / f"{name}.token"
        file.write_text(f"{token}\n")
        file.chmod(0o600)
        return running_worker(self.folder / name, "--server", self.url, "--token-file", str(file), is_forked=is_forked)

    def hand(self, token: str) -> Hand:
        hand = Hand(self.url, token)
        self.league.strangers.append(hand.client)  # closed with it
        return hand

    def training(self, name: str, *, seed: int, until: str = UNTIL) -> tuple[str, RunFolder]:
        """A training that waits, and the run as it is when nobody disturbs it."""
        self.console.create(name=name, train=False, track="oval", seed=seed, until=until)
        calm = self.folder / "calm" / name
        shutil.copytree(self.console.runs / name, calm)
        Training(RunFolder(calm)).run()
        return ok(self.console.client.post(f"/api/models/{name}/train", json={}), 202)["id"], RunFolder(calm)

    def done(self, job: str) -> dict[str, Any]:
        ended: dict[str, Any] = self.console.wait_for(self.console.job_ended(job))
        assert ended["state"] == "done", ended["error"]
        return ended

    @contextmanager
    def rows(self) -> Iterator[Session]:
        url = ServeSettings(runs=self.console.runs).database_url
        with closing(Database(url)) as database, database.transaction() as session:
            yield session

    def row(self, job: str) -> Job:
        with self.rows() as session:
            return session.get_one(Job, job)

    def saved(self, name: str) -> bool:
        """Whether a training elsewhere got as far as its first checkpoint, and the console has it."""
        return (self.console.runs / name / "checkpoints" / "manifest.json").is_file()


class Hand:
    """A worker that is no program: what a hostile one could ask."""

    def __init__(self, url: str, token: str) -> None:
        self.name = secrets.token_hex(8)
        self.client = plain_client(url, headers={"authorization": f"Bearer {token}"})

    def post(self, what: str, **body: Any) -> httpx.Response:
        return self.client.post(f"/api/workers/{self.name}/{what}", json=body)

    def take(self, *, slot: str = "training", kinds: tuple[str, ...] = ("train",), **more: Any) -> httpx.Response:
        asked = {"slot": slot, "kinds": kinds, "machine": "hand", "places": 1, "version": VERSION, **more}
        return self.post("take", **asked)

    def get(self, key: str) -> httpx.Response:
        return self.client.get(f"/api/workers/{self.name}/objects/{key}")

    def put(self, key: str, data: bytes) -> httpx.Response:
        return self.client.put(f"/api/workers/{self.name}/objects/{key}", content=data)

    def put_all(self, *pieces: tuple[str, bytes]) -> httpx.Response:
        return self.client.put(f"/api/workers/{self.name}/objects", content=pack(pieces))

    def put_list(self, run: str, document: dict[str, Any]) -> httpx.Response:
        return self.put(f"runs/{run}.json", json.dumps(document).encode())


class CountingLine(Line):
    """Knows where files were sent."""

    def __init__(self, url: str, token_file: Path) -> None:
        super().__init__(url, token_file)
        self.sent: list[str] = []

    def send(self, path: str, data: bytes) -> None:
        self.sent.append(path)
        super().send(path, data)


@contextmanager
def place_at(folder: Path, port: int = 0) -> Iterator[Place]:
    store = f"file://{folder}/store"
    options = ["--artifacts", store, "--trainings", "0", "--port", str(port)]
    with running_league(folder / "console", *options) as league:
        yield Place(league, folder, store)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Place]:
    with place_at(tmp_path_factory.mktemp("tokens")) as place:
        yield place


@contextmanager
def busy_at_home(place: Place) -> Iterator[None]:
    """The only place of the console's own machine is taken."""
    home = ServeSettings(runs=place.console.runs).machine
    with place.rows() as session:
        session.add(Job(id="busy", kind="store", run="", state="running", owner="nobody", machine=home))
    try:
        yield
    finally:
        with place.rows() as session:
            session.execute(sa.delete(Job).where(Job.id == "busy"))


def weights(folder: RunFolder) -> dict[str, Any]:
    arrays = folder.checkpoints.load("last").arrays
    return {name: value for name, value in arrays.items() if name != "recent_episodes"}  # holds wall-clock times


def same_bits(one: RunFolder, other: RunFolder) -> None:
    assert one.checkpoints.load("last").step == other.checkpoints.load("last").step
    expected, found = weights(one), weights(other)
    assert set(found) == set(expected)
    for array, value in expected.items():
        np.testing.assert_array_equal(found[array], value, err_msg=array)


def test_a_token_and_an_address_are_enough(place: Place) -> None:
    job, calm = place.training("away", seed=1)
    client = place.console.client
    with place.worker("lab-1", token := place.token()[1], is_forked=False) as worker:
        ended = place.done(job)
        assert ended["machine"].startswith("lab-1#")
        same_bits(calm, here := RunFolder(place.console.runs / "away"))
        assert here.history.read_bytes() == RunFolder(place.folder / "lab-1" / "away").history.read_bytes()
        with busy_at_home(place):
            asked = {"laps": 1, "num_trials": 1, "rules": "first_lap"}  # or a beginner is filmed for minutes
            evaluated = ok(client.post("/api/models/away/evaluations", json=asked), 202)["id"]
            assert place.done(evaluated)["machine"].startswith("lab-1#")
        (card,) = ok(client.get("/api/models/away/evaluations"))
        picture = client.get(f"/api/models/away/files/evaluation-{card['stamp']}/racing-line.png")
        assert picture.content.startswith(b"\x89PNG")

        long = place.console.create(name="seen", track="oval", seed=2, until="20 minutes")
        with client.stream("GET", f"/api/events/{long}") as stream:
            lines = (line for line in stream.iter_lines() if line.startswith("data: ") and '"poses"' in line)
            looks = [line for line, _ in zip(lines, range(3), strict=False)]
        assert len({look.split('"poses":')[1].split('"steps"')[0] for look in looks}) == 3  # they move
        for number in (worker.process.pid, *worker.children()):
            environment = Path(f"/proc/{number}/environ").read_bytes()
            assert token.encode() not in environment + Path(f"/proc/{number}/cmdline").read_bytes()
        client.post(f"/api/models/{long}/stop")


def test_what_a_revoked_token_had_ends_elsewhere_in_the_same_bits(place: Place) -> None:
    job, calm = place.training("passed-on", seed=3, until="20000 steps")
    number, secret = place.token()
    with place.worker("shut-out", secret, is_forked=False) as worker:
        place.console.wait_for(lambda: place.saved("passed-on"))
        ok(place.league.owner.delete(f"/api/account/tokens/{number}"), 204)
        began = time.monotonic()
        place.console.wait_for(lambda: place.row(job).state == "queued")
        assert time.monotonic() - began < 0.8 * LEASE.total_seconds()  # before its lease runs out
        assert worker.process.wait(PATIENCE) != 0  # it is told, and goes
        place.console.wait_for(lambda: not worker.children())
    held = place.row(job).attempts
    with place.worker("lab-2", place.token()[1]):
        ended = place.done(job)
    assert ended["machine"].startswith("lab-2#")
    assert ended["attempts"] == held + 1
    same_bits(calm, RunFolder(place.console.runs / "passed-on"))


@pytest.mark.slow
def test_a_league_on_postgresql_and_s3_has_workers_that_know_of_neither(
    tmp_path: Path, postgres: PostgresServer, s3: S3Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    database, store = postgres.new_database(), s3.url(tmp_path.name)
    options = ["--database", database, "--artifacts", store, "--trainings", "0"]
    with ExitStack() as stack:
        with monkeypatch.context() as environment:
            for name, value in s3.environment.items():
                environment.setenv(name, value)
            league = stack.enter_context(running_league(tmp_path / "console", *options))
            place = Place(league, tmp_path, store)
        job, calm = place.training("away", seed=7, until="30000 steps")
        number, secret = place.token()
        worker = stack.enter_context(place.worker("killed", secret, is_forked=False))
        for process in (worker.process.pid, *worker.children()):
            environ = Path(f"/proc/{process}/environ").read_bytes()
            assert not [told for told in (database, store, s3.address) if told.encode() in environ]
        place.console.wait_for(lambda: place.saved("away"))
        worker.kill()
        stack.enter_context(place.worker("next", secret))
        assert place.done(job)["machine"].startswith("next#")
        same_bits(calm, RunFolder(place.console.runs / "away"))
        kept = place.artifacts.copy("away")
        assert kept is not None
        assert "checkpoints/manifest.json" in kept.files
        ok(league.owner.delete(f"/api/account/tokens/{number}"), 204)
        assert "token" in refused(place.hand(secret).take(), 401)


@pytest.mark.slow
def test_killed_worker_and_killed_server_lose_nothing(tmp_path: Path) -> None:
    port = free_port()
    with ExitStack() as stack:
        place = stack.enter_context(place_at(tmp_path, port))
        job, calm = place.training("tough", seed=4, until="40000 steps")
        token = place.token()[1]
        worker = stack.enter_context(place.worker("lab", token))
        place.console.wait_for(lambda: place.saved("tough"))
        worker.kill()
        worker = stack.enter_context(place.worker("lab", token))
        place.console.wait_for(lambda: place.row(job).attempts == 2)
        assert place.row(job).state == "running"
        place.console.kill()
        options = ["--league", "--artifacts", f"file://{tmp_path}/store", "--trainings", "0", "--port", str(port)]
        place.console = stack.enter_context(running_console(place.console.runs, *options))
        place.done(job)
        same_bits(calm, RunFolder(place.console.runs / "tough"))
        assert worker.process.poll() is None


def test_a_worker_reads_and_writes_what_its_job_names_and_nothing_else(place: Place) -> None:
    for name in ("secret", "mine"):
        place.console.create(name=name, train=False, track="oval", seed=5, until="512 steps")
    place.console.wait_for(lambda: {"secret", "mine"} <= set(place.artifacts.names()))
    hand = place.hand(place.token()[1])
    assert ok(hand.take()) is None
    assert "does not have this job" in refused(hand.get("runs/mine.json"), 409)
    job = ok(place.console.client.post("/api/models/mine/train", json={}), 202)["id"]
    assert "this worker is 0.0.1" in refused(hand.take(version="0.0.1"), 409)
    told = ok(hand.take())
    assert told["id"] == ok(hand.take())["id"] == job  # who did not hear it hears it again
    assert ok(hand.client.get(f"/api/workers/{hand.name}/job"))["run"] == "mine"
    assert set(told) == {"id", "kind", "run", "user_id", "payload", "cargo", "travels", "attempts"}

    document = json.loads(hand.get("runs/mine.json").content)
    line = document["files"]["run.json"]
    assert hashlib.sha256(hand.get(f"runs/mine/{line['sha256']}").content).hexdigest() == line["sha256"]
    other = place.artifacts.copy("secret")
    assert other is not None
    tricks = ["runs/secret.json", f"runs/secret/{other.files['run.json']['sha256']}", "live/mine", "tracks/" + "0" * 64]
    tricks += ["runs/mine/..", "runs/..%2Fsecret.json", "../runs/mine.json", "runs/mine/" + "0" * 64, "runs", "a/b/c/d"]
    tricks += ["people/2/runs/mine.json", "contests/mine.json", "runs/mine.json/", "runs//mine.json", "runs/%00.json"]
    assert {key: hand.get(key).status_code for key in tricks if hand.get(key).status_code not in (404, 405)} == {}
    for key in ("runs/secret.json", "live/secret", "tracks/" + "0" * 64, "contests/mine.json", "submissions/x.json"):
        assert hand.put(key, b"{}").status_code == 404, key

    content = b"a new checkpoint"
    digest = hashlib.sha256(content).hexdigest()
    wrong = refused(hand.put(f"runs/mine/{digest}", b"something else"), 422)
    assert wrong == "What came has another digest than it was sent under."
    assert hand.get(f"runs/mine/{digest}").status_code == 404
    entry = {"size": len(content), "time": 1, "sha256": digest}
    newer = {**document, "number": document["number"] + 1}
    missing = {**newer, "files": {**document["files"], "new.txt": entry}}
    assert "is not there" in refused(hand.put_list("mine", missing), 422)
    ok(hand.put(f"runs/mine/{digest}", content), 204)
    lies = {**newer, "files": {**document["files"], "new.txt": {**entry, "size": 5}}}
    assert "another size" in refused(hand.put_list("mine", lies), 422)
    for path in ("run.json", "reward_function.py", "parent/x"):
        changed = {**newer, "files": {**document["files"], path: entry}}
        assert refused(hand.put_list("mine", changed), 422) == f"A job does not change {path}."
    gone = {path: line for path, line in document["files"].items() if path != "reward_function.py"}
    assert "does not change" in refused(hand.put_list("mine", {**newer, "files": gone}), 422)
    for path in ("../x", "/etc/x", ".hidden", "a/../b"):
        escaped = {**newer, "files": {**document["files"], path: entry}}
        assert "not one of Racecraft's" in refused(hand.put_list("mine", escaped), 422)
    stale = {**missing, "number": document["number"]}
    assert "another machine" in refused(hand.put_list("mine", stale), 409)
    assert "damaged" in refused(hand.put("runs/mine.json", b"[" * 100_000), 422)
    ok(hand.put_list("mine", missing), 204)
    ok(hand.put_list("mine", missing), 204)  # its answer was lost
    assert hand.get(f"runs/mine/{digest}").content == content
    after = {**missing, "number": missing["number"] + 1, "files": document["files"]}
    ok(hand.put_list("mine", after), 204)
    assert hand.get(f"runs/mine/{digest}").status_code == 404  # nothing names it any more

    unnamed = hashlib.sha256(b"unnamed").hexdigest()
    ok(hand.put(f"runs/mine/{unnamed}", b"unnamed"), 204)
    stranger = place.hand(place.token()[1])
    stranger.name = hand.name  # the same name under another token
    assert ok(stranger.client.get(f"/api/workers/{stranger.name}/job")) is None
    assert ok(stranger.post("heartbeat", job=job)) == {"word": "lost", "is_watched": False}
    refused(stranger.post("finish", job=job, state="done", result={}), 409)
    ok(stranger.post("release", why="asked"), 204)
    assert place.row(job).state == "running"
    refused(hand.post("finish", job="another", state="done", result={}), 409)
    assert place.row(job).state == "running"
    ok(hand.post("release", why="asked"), 204)
    assert place.artifacts.objects.below(f"runs/mine/{unnamed}") == []
    assert "does not have this job" in refused(hand.put_list("mine", missing), 409)
    place.console.client.post(f"/api/jobs/{job}/cancel")


def test_a_result_that_could_not_be_read_again_is_refused(place: Place) -> None:
    """NaN once took the list of models away on SQLite, a zero character on PostgreSQL, half a letter that of jobs."""
    name = place.console.create(name="odd", train=False, track="oval", seed=5, until="512 steps")
    job = ok(place.console.client.post(f"/api/models/{name}/train", json={}), 202)["id"]
    hand = place.hand(place.token()[1])
    place.console.wait_for(lambda: ok(hand.take()))
    for told in ("NaN", "[-Infinity]", "1e999", '"\\u0000"', '"\\ud800"', '{"\\udfff": 1}', 500 * "[" + 500 * "]"):
        body = f'{{"job": "{job}", "state": "done", "result": {{"x": {told}}}}}'
        reply = hand.client.post(
            f"/api/workers/{hand.name}/finish", content=body, headers={"content-type": "application/json"}
        )
        assert "cannot be kept" in refused(reply, 422), told
    assert "wrong at 'steps'" in refused(hand.post("finish", job=job, state="done", result={"steps": "x"}), 422)
    ok(hand.post("finish", job=job, state="done", result={"x": "whole"}), 204)
    for path in ("/api/jobs", f"/api/jobs/{job}", "/api/models", f"/api/models/{name}", "/api/choices"):
        ok(place.console.client.get(path))


def test_small_files_travel_together_and_nowhere_else_than_alone(place: Place) -> None:
    for name in ("packed", "other"):
        place.console.create(name=name, train=False, track="oval", seed=5, until="512 steps")
    place.console.wait_for(lambda: {"packed", "other"} <= set(place.artifacts.names()))
    job = ok(place.console.client.post("/api/models/packed/train", json={}), 202)["id"]
    hand = place.hand(secret := place.token()[1])
    assert "does not have this job" in refused(hand.put_all(("runs/packed.json", b"{}")), 409)
    assert ok(hand.take())["id"] == job

    for key in ("runs/other.json", "live/other", "tracks/" + "0" * 64, "contests/packed.json", "../runs/packed.json"):
        assert hand.put_all((key, b"{}")).status_code == 404, key
    digest = hashlib.sha256(b"good").hexdigest()
    wrong = refused(hand.put_all((f"runs/packed/{digest}", b"good"), (f"runs/packed/{'0' * 64}", b"bad")), 422)
    assert wrong == "What came has another digest than it was sent under."
    assert hand.get(f"runs/packed/{digest}").content == b"good"
    document = json.loads(hand.get("runs/packed.json").content)
    missing = {"size": 3, "time": 1, "sha256": "0" * 64}
    lies = {**document, "number": document["number"] + 1, "files": {**document["files"], "new.txt": missing}}
    assert "is not there" in refused(hand.put_all(("runs/packed.json", json.dumps(lies).encode())), 422)
    assert json.loads(hand.get("runs/packed.json").content) == document
    assert "at most 1 MB" in refused(hand.put_all((f"runs/packed/{digest}", b"x" * MAX_PARCEL)), 413)

    (file := place.folder / "hand.token").write_text(secret)
    line = CountingLine(place.url, file)
    there = Artifacts(RemoteObjects(line, hand.name))
    there.bring("packed", runs := place.folder / "hand", incoming=runs / "incoming")
    here = RunFolder(runs / "packed")
    (here.path / "checkpoints").mkdir(exist_ok=True)
    for number in range(40):
        (here.path / f"{number}.txt").write_text(str(number))
    (here.path / "large.bin").write_bytes(large := bytes(2 * MAX_PARCEL))
    assert there.keep(here) == 42 - 1
    room = f"/api/workers/{hand.name}/objects"
    alone = f"{room}/runs/packed/{hashlib.sha256(large).hexdigest()}"
    assert line.sent == [room, alone, room], "forty files and a list go beside a large one"
    assert place.artifacts.is_current(here)
    assert there.keep(here) == 0
    assert len(line.sent) == 3
    line._hang_up()  # else the process's end does
    ok(hand.post("release", why="asked"), 204)
    place.console.client.post(f"/api/jobs/{job}/cancel")


def test_what_is_too_large_is_refused_before_it_is_read(place: Place) -> None:
    place.console.create(name="small", track="oval", seed=6, until="512 steps")
    hand = place.hand(place.token()[1])
    place.console.wait_for(lambda: ok(hand.take()))
    room = f"/api/workers/{hand.name}"
    for key, size, says in (
        (f"objects/runs/small/{'0' * 64}", MAX_OBJECT + 1, "at most 128 MB"),
        ("objects/runs/small.json", (8 << 20) + 1, "at most 8 MB"),
        ("objects/live/small", (1 << 20) + 1, "at most 1 MB"),
        ("finish", (1 << 20) + 1, "at most 1 MB"),
    ):
        method = "POST" if key == "finish" else "PUT"
        head = f"{method} {room}/{key} HTTP/1.1\r\nHost: {hand.client.base_url.netloc.decode()}\r\n"
        head += f"Authorization: {hand.client.headers['authorization']}\r\nContent-Length: {size}\r\n"
        head += "Connection: close\r\n\r\n"
        with socket.create_connection((hand.client.base_url.host, hand.client.base_url.port), PATIENCE) as line:
            line.sendall(head.encode())  # and not a byte of it
            told = b"".join(iter(lambda: line.recv(1 << 16), b"")).decode()
        assert says in told, told
    job = ok(hand.client.get(f"{room}/job"))["id"]
    ok(hand.post("finish", job=job, state="failed", error={"code": "x", "message": "Enough."}), 204)
    assert ok(place.console.client.get(f"/api/jobs/{job}"))["error"]["message"] == "Enough."


def test_a_workers_token_opens_nothing_else(place: Place) -> None:
    number, secret = place.token()
    hand = place.hand(secret)
    for path in ("/api/models", "/api/account", "/api/jobs", "/api/audit", "/api/workersX"):
        assert "not for that" in refused(hand.client.get(path), 403)
    assert "not for that" in refused(hand.client.post("/api/models", json={}), 403)
    reader = ok(place.league.owner.post("/api/account/tokens", json={"scopes": ["read"]}), 201)["secret"]
    assert "not for that" in refused(place.hand(reader).client.get("/api/workers"), 403)
    refused(place.league.owner.get("/api/workers"), 404)  # a browser is no worker
    assert ok(hand.client.get("/api/workers")) == {"version": VERSION}

    both = {"scopes": ["worker", "read"]}
    assert "nothing else" in refused(place.league.owner.post("/api/account/tokens", json=both), 422)
    teacher = place.league.organiser("Teacher")
    for person in (teacher, place.league.join(place.league.code(place.league.group("5b")), "Ada")):
        made = person.post("/api/account/tokens", json={"scopes": ["worker"]})
        assert "Only whoever holds the league" in refused(made, 422)
    ok(place.league.owner.delete(f"/api/account/tokens/{number}"), 204)
    assert "no longer good" in refused(hand.client.get("/api/workers"), 401)


def test_a_judged_entry_is_never_for_workers(place: Place) -> None:
    with place.rows() as session:
        session.add(Job(id="verdict", kind="judge", run="", travels=True, cargo={}))  # as if it said that it could
    with busy_at_home(place):
        found = ok(place.hand(place.token()[1]).take(slot="other", kinds=("judge", "store", "evolution", "evaluate")))
    assert found is None
    with place.rows() as session:
        session.execute(sa.delete(Job).where(Job.id == "verdict"))
