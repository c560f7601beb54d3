"""Copies of runs in an object store: S3, as moto's server plays it, and a folder."""

from __future__ import annotations

import hashlib
import json
import shutil
import socket
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from running_consoles import PATIENCE, running_console
from s3_servers import S3Server

from racecraft.errors import ConfigError, RunError
from racecraft.run import RunFolder

pytest.importorskip("obstore")
from racecraft.serve.jobs.access import Access
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.jobs.supervisor import Supervisor
from racecraft.serve.models import mirror
from racecraft.serve.settings import ServeSettings
from racecraft.serve.store.artifacts import Artifacts
from racecraft.serve.store.database import Database

REWARD = "def reward_function(params):\n    return 1.0\n"


@pytest.fixture(params=["s3", "file"])
def url(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    if request.param == "file":
        return f"file://{tmp_path}/store"
    server: S3Server = request.getfixturevalue("s3")
    for name, value in server.environment.items():
        monkeypatch.setenv(name, value)
    return server.url(tmp_path.name)


def make_run(runs: Path, name: str = "a") -> RunFolder:
    folder = RunFolder(runs / name)
    for path, text in (
        ("run.json", "{}"),
        ("reward_function.py", REWARD),
        ("metrics/history.jsonl", '{"step": 1}\n'),
        ("evaluation-20260101000000/evaluation.json", '{"laps": 1}'),
        ("mp4/camera-pip/0-video.mp4", "film" * 1000),
        (".lock", "not kept"),
        (".live", "not kept"),
    ):
        (folder.path / path).parent.mkdir(parents=True, exist_ok=True)
        (folder.path / path).write_text(text)
    folder.checkpoints.save(100, {"w": np.arange(1000.0)})
    (folder.path / "link").symlink_to("/etc/hostname")
    return folder


def contents(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file() and not path.is_symlink())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files if not path.name.startswith(".")}


@pytest.mark.costly
def test_a_run_comes_back_as_it_was(tmp_path: Path, url: str) -> None:
    store, folder = Artifacts(url), make_run(tmp_path / "runs")
    assert store.names() == []
    assert store.keep(folder) == len(contents(folder.path))
    assert store.names() == ["a"]
    assert store.is_current(folder)
    (tmp_path / "elsewhere").mkdir()
    assert Artifacts(url).bring("a", tmp_path / "elsewhere", incoming=tmp_path / "incoming")
    back = RunFolder(tmp_path / "elsewhere" / "a")
    assert contents(back.path) == contents(folder.path)
    np.testing.assert_array_equal(back.checkpoints.load().arrays["w"], np.arange(1000.0))
    assert store.is_current(back)
    assert not list((tmp_path / "incoming").iterdir())


def test_only_what_changed_is_copied_and_what_is_gone_is_removed(tmp_path: Path, url: str) -> None:
    store, folder = Artifacts(url), make_run(tmp_path / "runs")
    store.keep(folder)
    assert store.keep(folder) == 0
    (folder.path / "metrics" / "history.jsonl").write_text('{"step": 1}\n{"step": 2}\n')
    shutil.rmtree(folder.path / "mp4")
    assert not store.is_current(folder)
    assert store.keep(folder) == 1
    assert store.bring("a", tmp_path, incoming=tmp_path / "incoming")
    assert contents(tmp_path / "a") == contents(folder.path)
    store.forget("a")
    assert store.names() == []
    with pytest.raises(RunError, match="no run 'a'"):
        store.bring("a", tmp_path / "runs", incoming=tmp_path / "incoming")


def test_a_name_that_is_given_again_is_another_run_also_to_who_has_the_old_one(tmp_path: Path, url: str) -> None:
    store, first, incoming = Artifacts(url), make_run(tmp_path / "first"), tmp_path / "incoming"
    store.keep(first)
    there = tmp_path / "there"
    there.mkdir()
    store.bring("a", there, incoming=incoming)
    for step in (200, 300):
        RunFolder(there / "a").checkpoints.save(step, {"w": np.arange(3.0)})
        store.keep(RunFolder(there / "a"))
    store.forget("a")
    second = make_run(tmp_path / "second")
    second.reward_function.write_text("another")
    store.keep(second)
    with pytest.raises(RunError, match="changed by another machine"):
        store.keep(RunFolder(there / "a"))
    assert not store.bring("a", there, incoming=incoming, is_home=True)
    assert store.bring("a", there, incoming=incoming)
    assert contents(there / "a") == contents(second.path)
    assert not store.bring("a", there, incoming=incoming)
    RunFolder(there / "a").checkpoints.save(200, {"w": np.arange(3.0)})
    store.keep(RunFolder(there / "a"))
    assert store.bring("a", tmp_path / "second", incoming=incoming)
    assert contents(there / "a") == contents(second.path)


def test_two_machines_take_turns(tmp_path: Path, url: str) -> None:
    store, here, incoming = Artifacts(url), make_run(tmp_path / "here"), tmp_path / "incoming"
    store.keep(here)
    (tmp_path / "there").mkdir()
    store.bring("a", tmp_path / "there", incoming=incoming)
    there = RunFolder(tmp_path / "there" / "a")
    assert not store.bring("a", tmp_path / "there", incoming=incoming)  # as new as the copy
    there.checkpoints.save(200, {"w": np.arange(3.0)})
    (there.path / "mp4" / "camera-pip" / "0-video.mp4").unlink()
    (there.path / ".live").write_text("of this machine")
    store.keep(there)
    (here.path / "metrics" / "history.jsonl").write_text("of one who was away")
    with pytest.raises(RunError, match="changed by another machine"):
        store.keep(here)
    assert store.bring("a", tmp_path / "here", incoming=incoming)
    assert contents(here.path) == contents(there.path)
    assert (here.path / ".live").read_text() == "not kept"
    assert here.checkpoints.load().step == 200
    (here.path / "metrics" / "history.jsonl").write_text("its turn")
    assert store.keep(here) == 1
    assert store.bring("a", tmp_path / "there", incoming=incoming)
    assert contents(there.path) == contents(here.path)
    assert not list(incoming.iterdir())


@pytest.mark.costly
def test_a_copy_taken_while_checkpoints_are_saved_holds_those_of_one_moment(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "runs")
    store, is_ended = Artifacts(f"file://{tmp_path}/store"), threading.Event()

    def train() -> None:
        step = 200
        while not is_ended.is_set():
            with (folder.path / "metrics" / "history.jsonl").open("a") as history:
                history.write(json.dumps({"step": step}) + "\n")
            folder.checkpoints.save(step, {"w": np.full(1000, float(step))})
            step += 1

    training = threading.Thread(target=train)
    training.start()
    try:
        for turn in range(20):
            store.keep(folder)
            elsewhere = tmp_path / f"elsewhere-{turn}"
            elsewhere.mkdir()
            store.bring("a", elsewhere, incoming=tmp_path / "incoming")
            back = RunFolder(elsewhere / "a")
            listed = {entry.file for entry in back.checkpoints.entries()}
            assert listed <= {path.name for path in (back.path / "checkpoints").glob("*.safetensors")}
            last = back.checkpoints.load("last")  # warnings are errors: none was passed over
            steps = [json.loads(line)["step"] for line in back.history.read_text().splitlines()]
            assert last.step <= steps[-1] or last.step == 100
    finally:
        is_ended.set()
        training.join()


def test_a_run_from_before_copies_were_counted_is_neither_replaced_nor_refused(tmp_path: Path) -> None:
    store, folder = Artifacts(f"file://{tmp_path}/store"), make_run(tmp_path / "runs")
    store.keep(folder)
    (folder.path / ".copy").unlink()
    (folder.path / "reward_function.py").write_text("changed")
    assert not store.bring("a", tmp_path / "runs", incoming=tmp_path / "incoming")
    assert store.keep(folder) == 1


def test_a_damaged_copy_is_refused_whole(tmp_path: Path) -> None:
    store, folder = Artifacts(f"file://{tmp_path}/store"), make_run(tmp_path / "runs")
    store.keep(folder)
    digest = hashlib.sha256(REWARD.encode()).hexdigest()
    stored = tmp_path / "store" / "runs" / "a" / digest
    for damage in (REWARD.replace("1.0", "2.0"), REWARD + "#" * 1000, REWARD[:-1]):
        stored.write_text(damage)
        with pytest.raises(RunError, match=r"reward_function.py of run 'a' is damaged"):
            store.bring("a", tmp_path, incoming=tmp_path / "incoming")
        assert not (tmp_path / "a").exists()


@pytest.mark.parametrize(
    "files",
    [
        {"../../up": {"size": 1, "time": 1, "sha256": "a" * 64}},
        {"/etc/cron.d/x": {"size": 1, "time": 1, "sha256": "a" * 64}},
        {"a/../../b": {"size": 1, "time": 1, "sha256": "a" * 64}},
        {"x": {"size": -1, "time": 1, "sha256": "a" * 64}},
        {"x": {"size": 1 << 60, "time": 1, "sha256": "a" * 64}},
        {"x": {"size": 1, "time": 1, "sha256": "../../b"}},
        {"x": {"size": 1, "time": 1e40, "sha256": "a" * 64}},
        {"x": None},
        [],
        None,
    ],
)
def test_a_hostile_list_of_files_is_refused(tmp_path: Path, files: Any) -> None:
    store = Artifacts(f"file://{tmp_path}/store")
    index = tmp_path / "store" / "runs" / "a.json"
    index.parent.mkdir()
    index.write_text(json.dumps({"format": 1, "files": files}))
    with pytest.raises(RunError, match="not one of Racecraft's"):
        store.bring("a", tmp_path, incoming=tmp_path / "incoming")
    for text in ("{", '{"format": 1, "number": Infinity, "files": {}}'):
        index.write_text(text)
        with pytest.raises(RunError, match="damaged"):
            store.bring("a", tmp_path, incoming=tmp_path / "incoming")
    assert not (tmp_path / "up").exists()


def test_cars_are_shown_as_they_were_last(tmp_path: Path) -> None:
    store = Artifacts(f"file://{tmp_path / 'store'}")
    assert store.shown("a") == b""
    for live in (b"first", b"second"):
        store.show("a", live)
    assert (store.shown("a"), store.shown("b")) == (b"second", b"")


def test_what_fails_here_is_not_the_stores_fault(tmp_path: Path) -> None:
    store, folder = Artifacts(f"file://{tmp_path}/store"), make_run(tmp_path / "runs")
    (folder.path / "study.sqlite").write_text("no database" * 100)
    with pytest.raises(RunError, match=r"cannot be made on this machine: study\.sqlite cannot be read"):
        store.keep(folder)


def test_a_store_that_does_not_answer_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))
        monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://127.0.0.1:{nobody.getsockname()[1]}")
        monkeypatch.setenv("AWS_ACCESS_KEY_ID", "x")
        monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "x")
        with pytest.raises(RunError, match="does not answer"):
            Artifacts("s3://racing/x").names()


def test_a_store_that_did_not_answer_at_first_is_asked_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(mirror, "FIRST_WAIT", 0.01)
    store, folder = Artifacts(f"file://{tmp_path}/store"), make_run(tmp_path / "runs")
    store.keep(folder)
    stored = tmp_path / "store" / "runs" / "a" / hashlib.sha256(REWARD.encode()).hexdigest()
    stored.rename(tmp_path / "hidden")
    there = tmp_path / "there"
    there.mkdir()
    database = Database(f"sqlite:///{tmp_path / 'console.db'}")
    queue = JobQueue(database)
    settings = ServeSettings(runs=there)
    supervisor = Supervisor(settings, queue, Access.of(settings))
    keeper = mirror.Mirror(store, settings=settings, queue=queue, supervisor=supervisor)
    thread = threading.Thread(target=keeper.start)
    thread.start()
    deadline = time.monotonic() + PATIENCE
    while "cannot be fetched" not in caplog.text:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert not (there / "a").exists()
    (tmp_path / "hidden").rename(stored)
    thread.join(PATIENCE)
    assert contents(there / "a") == contents(folder.path)
    stored.unlink()  # and for ever, until the server ends
    shutil.rmtree(there / "a")
    thread = threading.Thread(target=keeper.start)
    thread.start()
    keeper.end()
    thread.join(PATIENCE)
    assert not thread.is_alive()
    database.close()


def test_a_store_lies_in_its_folder_whatever_that_is_called(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "runs")
    store = Artifacts(f"file://{tmp_path}/which? 50%20 #1")
    store.keep(folder)
    assert store.names() == ["a"]
    assert (tmp_path / "which? 50%20 #1" / "runs" / "a").is_dir()
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize("url", ["gs://x", "http://127.0.0.1", "file://relative", ""])
def test_other_stores_are_refused(url: str) -> None:
    with pytest.raises(ConfigError, match="s3://"):
        Artifacts(url)


@pytest.mark.slow
def test_a_server_with_an_empty_folder_has_the_runs_again(tmp_path: Path, url: str) -> None:
    with running_console(tmp_path / "first", "--artifacts", url) as console:
        client = console.client
        name = console.create(name="kept", until="2000 steps", track="oval")
        job = client.get("/api/jobs", params={"run": name}).json()[-1]
        ended = console.wait_for(console.job_ended(job["id"]))
        assert ended["state"] == "done", ended
        console.create(name="dropped", train=False)
        request = {"laps": 1, "num_trials": 1, "rules": "first_lap"}  # without penalties to film for minutes
        raced = client.post(f"/api/models/{name}/evaluations", json=request).json()
        ended = console.wait_for(console.job_ended(raced["id"]))
        assert ended["state"] == "done"
        assert "not_stored" not in ended["result"]
        console.wait_for(lambda: all(job["state"] == "done" for job in client.get("/api/jobs").json()))
        assert client.delete("/api/models/dropped").status_code == 204
        console.kill()
    shutil.rmtree(tmp_path / "first")
    with running_console(tmp_path / "second", "--artifacts", url) as console:
        client = console.client
        console.wait_for(lambda: client.get("/api/models").json())
        assert [model["name"] for model in client.get("/api/models").json()] == ["kept"]
        card = client.get(f"/api/models/{name}/evaluations").json()[0]
        video = client.get(f"/api/models/{name}/files/{card['video']}")
        assert video.headers["content-type"] == "video/mp4"
        assert len(video.content) > 1000
        on = client.post(f"/api/models/{name}/train", json={"until": "4000 steps"}).json()
        assert console.wait_for(console.job_ended(on["id"]))["result"]["steps"] >= 4000
