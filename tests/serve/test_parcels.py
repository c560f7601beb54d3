"""What a worker may send of a run or of a folder: nothing that says what is to be done, nor what was done before."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("obstore")
from racecraft.agent import ModelMetadata, action_space
from racecraft.errors import RunError
from racecraft.reward import load_preset
from racecraft.run import RunFolder, begin_stretch, change_reward
from racecraft.serve.jobs.cargo import Cargo
from racecraft.serve.jobs.queue import KINDS, JobQueue
from racecraft.serve.jobs.task import Task
from racecraft.serve.people.people import add_person
from racecraft.serve.problems import Conflict
from racecraft.serve.settings import STATE_FOLDER, TUNINGS
from racecraft.serve.store.artifacts import RUNS, Artifacts, Copy
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job
from racecraft.serve.tuning.tasks import tune
from racecraft.serve.workers.leases import Lease
from racecraft.serve.workers.parcels import Key, Parcels
from racecraft.training import Until
from racecraft.training.settings import make_settings
from racecraft.training.start import start_run
from racecraft.version import VERSION

TUNING = "0123456789abcdef"
OTHER = "def reward_function(params):\n    return 2.0\n"


class Desk:
    """A worker with a guest's job, between it and the store what a token's worker passes."""

    def __init__(self, queue: JobQueue, store: Artifacts, runs: Path) -> None:
        self.queue, self.artifacts, self.runs = queue, store, runs
        self.parcels, self.lease = Parcels(store), Lease(queue, token=1, worker="0123456789abcdef")
        self.store = store.of(queue.user_id)

    def take(self, kind: str, *, job_id: str | None = None, **payload: Any) -> Job:
        self.queue.add(kind, "run", payload, cargo=Cargo(runs=("run",)), job_id=job_id)
        job = self.lease.take(KINDS[kind].slot, [kind], machine="lab", places=1, of_version=VERSION)
        assert job is not None
        return job

    def send(self, job: Job, shelf: str, name: str, changes: dict[str, bytes | None]) -> None:
        """The copy as it is, with other files; None for one that is gone."""
        before = self.store.shelf(shelf).copy(name) or Copy()
        files = dict(before.files)
        for path, content in changes.items():
            if content is None:
                del files[path]
                continue
            digest = hashlib.sha256(content).hexdigest()
            self._keep(job, Key(shelf, name, digest), content)
            files[path] = {"size": len(content), "time": 1, "sha256": digest}
        document = {"format": 1, "number": before.number + 1, "life": before.life, "files": files}
        self._keep(job, Key(shelf, name), json.dumps(document).encode())

    def _keep(self, job: Job, key: Key, data: bytes) -> None:
        digest = hashlib.sha256(data).hexdigest()
        self.parcels.keep(job, key, data, size=len(data), digest=digest, lease=self.lease)

    def refuses(self, job: Job, shelf: str, name: str, changes: dict[str, bytes | None]) -> str:
        before = self.store.shelf(shelf).copy(name)
        with pytest.raises(RunError) as refused:
            self.send(job, shelf, name, changes)
        assert self.store.shelf(shelf).copy(name) == before
        return str(refused.value)


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[Desk]:
    database = Database(f"sqlite:///{tmp_path / 'console.db'}")
    database.migrate()
    with database.transaction() as session:
        guest = add_person(session, "Ada")
    yield Desk(JobQueue(database, user_id=guest), Artifacts(f"file://{tmp_path}/store"), tmp_path / "runs")
    database.close()


def new_run(runs: Path) -> RunFolder:
    metadata = ModelMetadata(action_space=action_space("default"), neural_network="RACECRAFT_SMALL")
    settings = make_settings(metadata=metadata, hyperparameters=None, track="oval", until=Until(steps=256))
    return start_run(settings, reward=load_preset("racing"), metadata=metadata, root=runs, name="run")


def test_a_stretch_says_what_the_files_say_and_those_before_it_stay(desk: Desk) -> None:
    folder = new_run(desk.runs)
    desk.store.keep(folder)
    job = desk.take("train")
    begin_stretch(folder, step=0)
    one, first = "stretches/1.json", (folder.path / "stretches" / "1.json").read_bytes()
    lies: list[Callable[[dict[str, Any]], Any]] = [
        lambda said: said.update(reward_function=OTHER),
        lambda said: said["settings"].update(direction="reverse"),
        lambda said: said["model_metadata"].update(sensor=["LIDAR"]),
        lambda said: said.update(track="reinvent_2018"),
    ]
    for lie in lies:
        said = json.loads(first)
        lie(said)
        assert "says something else" in desk.refuses(job, RUNS, "run", {one: json.dumps(said).encode()})
    for nonsense in (b"[", b"{}", first.replace(b'"step": 0', b'"step": 7')):
        assert "cannot be read" in desk.refuses(job, RUNS, "run", {one: nonsense})
    assert "at most 4 MB" in desk.refuses(job, RUNS, "run", {one: b" " * (4 << 20) + first})
    desk.send(job, RUNS, "run", {one: first})
    desk.send(job, RUNS, "run", {one: None})  # and begins again, as nothing was saved
    desk.send(job, RUNS, "run", {one: first})
    desk.lease.finish(job.id, "done", result={}, error=None)

    change_reward(folder, OTHER)  # by its owner, and the next worker goes on with it
    begin_stretch(folder, step=256)
    two, second = "stretches/2.json", (folder.path / "stretches" / "2.json").read_bytes()
    folder.path.joinpath(two).unlink()
    document = desk.store.copy("run")
    assert document is not None
    (folder.path / ".copy").write_text(f"{document.number} {document.life}")
    desk.store.keep(folder)
    job = desk.take("train")
    assert "says something else" in desk.refuses(job, RUNS, "run", {two: second.replace(b"2.0", b"3.0")})
    desk.send(job, RUNS, "run", {two: second})
    later = json.loads(second) | {"began": "2027-01-01T00:00:00+00:00"}
    desk.send(job, RUNS, "run", {two: json.dumps(later).encode()})  # after a restart at the same step
    for change in (None, second.replace(b'"step": 256', b'"step": 0').replace(b'"number": 2', b'"number": 1')):
        assert desk.refuses(job, RUNS, "run", {one: change}) == f"A job does not change {one}."


def test_another_run_of_the_name_is_not_replaced(desk: Desk) -> None:
    folder = new_run(desk.runs)
    desk.store.keep(folder)
    job, before = desk.take("train"), desk.store.copy("run")
    assert before is not None
    document = {"format": 1, "number": before.number + 1, "life": "0" * 16, "files": before.files}
    with pytest.raises(Conflict, match="changed by another machine"):
        desk._keep(job, Key(RUNS, "run"), json.dumps(document).encode())
    assert desk.store.copy("run") == before


def test_what_a_search_is_about_is_not_changed_by_who_makes_it(desk: Desk) -> None:
    folder = desk.runs / TUNING
    folder.mkdir(parents=True)
    settled = ("tuning.json", "reward_function.py", "model_metadata.json")
    for name in settled:
        (folder / name).write_text('{"foreign": true}')
    desk.store.shelf(TUNINGS).keep(RunFolder(folder))
    job = desk.take("tune", tuning=TUNING)
    for name in settled:
        for change in (b'{"foreign": false}', None):
            assert desk.refuses(job, TUNINGS, TUNING, {name: change}) == f"A job does not change {name}."
    trial = "trial-0000"
    made: dict[str, bytes | None] = {"result.json": b"{}", f"{trial}/run.json": b"{}", "study.sqlite": b"SQLite"}
    desk.send(job, TUNINGS, TUNING, {**made, f"{trial}/reward_function.py": OTHER.encode()})
    desk.send(job, TUNINGS, TUNING, {"result.json": b'{"trials": []}', "study.sqlite": b"SQLite 2"})


def test_ghosts_of_a_heat_are_those_that_were_asked_for(desk: Desk) -> None:
    heat = "fedcba9876543210"
    folder = desk.runs / heat
    (folder / "ghosts").mkdir(parents=True)
    (folder / "ghosts" / "0.replay").write_bytes(b"a replay")
    desk.store.shelf("contests").keep(RunFolder(folder))
    job = desk.take("heat", job_id=heat)
    (line,) = (desk.store.shelf("contests").copy(heat) or Copy()).files.values()
    assert desk.parcels.fetch(job, Key("contests", heat, line["sha256"])).read() == b"a replay"
    for change in (b"another", None):
        refusal = desk.refuses(job, "contests", heat, {"ghosts/0.replay": change})
        assert refusal == "A job does not change ghosts/0.replay."
    desk.send(job, "contests", heat, {"race.replay": b"what was driven"})


@pytest.mark.costly
def test_a_guests_search_is_made_as_a_guests_whatever_its_folder_says(
    desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("optuna")
    from racecraft.tuning import Tuning, start_tuning

    root = desk.runs / STATE_FOLDER / TUNINGS
    folder = start_tuning("oval", reward="racing", search=["BORDER_LOSS"], root=root, name=TUNING)
    assert json.loads((folder / "tuning.json").read_text())["foreign"] is False
    found: list[bool] = []

    def run(tuning: Tuning, **_: Any) -> None:
        found.append(tuning.plan.foreign)
        raise RunError("Enough.")

    monkeypatch.setattr(Tuning, "run", run)
    for owner in (desk.queue.user_id, 1):
        job = Job(id="1", kind="tune", run="run", user_id=owner, payload={"tuning": TUNING, "minutes": 1, "trials": 1})
        task = Task(job=job, runs=desk.runs, home=tmp_path, database=None, artifacts=None, on_stop=lambda _: None)
        with pytest.raises(RunError, match="Enough"):
            tune(task)
    assert found == [True, False]
    other = new_run(tmp_path / "others")
    document = json.loads((folder / "tuning.json").read_text())
    other.checkpoints.save(64, {}, metadata={})
    (folder / "tuning.json").write_text(json.dumps({**document, "parent": f"{other.path}@64"}))
    with pytest.raises(RunError, match="does not lie in"):
        tune(task)
