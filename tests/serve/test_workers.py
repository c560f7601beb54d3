"""Workers on other machines: the console shows what they do as if it were done here, and nothing is lost with them."""

from __future__ import annotations

import random
import shutil
import sqlite3
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
from postgres_servers import USER, PostgresServer
from running_consoles import RunningConsole, running_console
from running_workers import RunningWorker, running_worker

pytest.importorskip("obstore")
pytest.importorskip("psycopg")
from racecraft.agent import ModelMetadata, action_space
from racecraft.errors import ConfigError, RunError
from racecraft.moved import move
from racecraft.reward import load_preset
from racecraft.run import RunFolder
from racecraft.serve.jobs.access import Access
from racecraft.serve.jobs.cargo import Cargo, files_of, rivals_of
from racecraft.serve.jobs.courier import Courier
from racecraft.serve.jobs.follower import Follower
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.jobs.supervisor import Supervisor
from racecraft.serve.models.mirror import Mirror
from racecraft.serve.people.people import add_person
from racecraft.serve.settings import ServeSettings
from racecraft.serve.station import work_for, work_through
from racecraft.serve.store.artifacts import Artifacts
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Job
from racecraft.track import load_track, save_route
from racecraft.training import Until
from racecraft.training.job import Training
from racecraft.training.opponents import Opponents
from racecraft.training.settings import make_settings
from racecraft.training.start import start_run

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="finds processes in /proc")

UNTIL = "20000 steps"
LOOKS = 40  # at most, until the cars have moved twice: the same look may be sent again
KILLS = 10  # at most; the trainings are over before on a fast machine


class Place:
    """A console that leaves all work to others, and what they share with it."""

    def __init__(self, console: RunningConsole, database: str, artifacts: str, folder: Path) -> None:
        self.console, self.database, self.artifacts, self.folder = console, database, artifacts, folder

    def worker(self, name: str) -> Any:
        return running_worker(self.folder / name, database=self.database, artifacts=self.artifacts)

    def done(self, job: str) -> dict[str, Any]:
        ended: dict[str, Any] = self.console.wait_for(self.console.job_ended(job))
        assert ended["state"] == "done", ended["error"]
        return ended


@pytest.fixture(scope="module")
def shared_place(postgres: PostgresServer, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Place]:
    folder = tmp_path_factory.mktemp("machines")
    database, artifacts = postgres.new_database(), f"file://{folder}/store"
    options = ("--database", database, "--artifacts", artifacts, "--trainings", "0", "--others", "1")
    with running_console(folder / "console", *options) as console:
        yield Place(console, database, artifacts, folder)


@pytest.fixture
def place(shared_place: Place) -> Iterator[Place]:
    """What a test that failed left undone takes no other test's worker."""
    yield shared_place
    client = shared_place.console.client
    for job in client.get("/api/jobs").json():
        if job["state"] in ("queued", "running"):
            client.post(f"/api/jobs/{job['id']}/cancel")


@contextmanager
def busy_at_home(place: Place) -> Iterator[None]:
    """The only place of the console's own machine is taken."""
    database, home = Database(place.database), ServeSettings(runs=place.console.runs).machine
    busy = Job(id="busy", kind="store", run="", state="running", owner="nobody", machine=home)
    with database.transaction() as session:
        session.add(busy)
    try:
        yield
    finally:
        with database.transaction() as session:
            session.execute(sa.delete(Job).where(Job.id == "busy"))
        database.close()


def weights(folder: RunFolder) -> dict[str, Any]:
    arrays = folder.checkpoints.load("last").arrays
    return {name: value for name, value in arrays.items() if name != "recent_episodes"}  # holds wall-clock times


@pytest.mark.costly
def test_a_training_elsewhere_is_seen_as_if_it_were_here(place: Place) -> None:
    console = place.console
    name = console.create(name="away", until="20 minutes", track="oval", seed=2)
    (job,) = console.client.get("/api/jobs", params={"run": name}).json()
    time.sleep(1.0)
    assert console.client.get(f"/api/jobs/{job['id']}").json()["state"] == "queued"  # nobody is there yet
    with place.worker("lab-1"):
        seen: set[str] = set()
        with console.client.stream("GET", f"/api/events/{name}") as stream:
            for line, _ in zip(filter(_is_look, stream.iter_lines()), range(LOOKS), strict=False):
                seen.add(line.split('"poses":')[1].split('"steps"')[0])
                if len(seen) == 3:
                    break
        assert len(seen) == 3  # they move
        console.wait_for(lambda: console.client.get(f"/api/models/{name}").json()["checkpoints"])
        assert console.client.get(f"/api/models/{name}/history").json()["points"]
        assert console.client.get(f"/api/models/{name}").json()["status"] == "training"
        assert console.client.get(f"/api/jobs/{job['id']}").json()["machine"] == "lab-1"
        console.client.post(f"/api/models/{name}/stop")
        ended = place.done(job["id"])
        there, here = (RunFolder(place.folder / where / name) for where in ("lab-1", "console"))
        assert ended["result"]["steps"] == here.checkpoints.load("last").step  # it is here when its end is told
        assert here.history.read_bytes() == there.history.read_bytes()

        asked = {"laps": 1, "num_trials": 1, "rules": "first_lap"}  # or beginners are filmed for minutes
        evaluated = console.client.post(f"/api/models/{name}/evaluations", json=asked).json()
        place.done(evaluated["id"])
        (card,) = console.client.get(f"/api/models/{name}/evaluations").json()
        picture = console.client.get(f"/api/models/{name}/files/evaluation-{card['stamp']}/racing-line.png")
        assert picture.content.startswith(b"\x89PNG")


def _is_look(line: str) -> bool:
    return line.startswith("data: ") and '"poses"' in line


@pytest.mark.slow
def test_races_and_searches_and_own_tracks_travel_too(place: Place) -> None:
    pytest.importorskip("optuna")
    console, client = place.console, place.console.client
    made = client.put("/api/tracks/own", json=client.get("/api/tracks/oval/sketch").json())
    assert made.status_code in (200, 201), made.text
    console.create(name="first", track="own", until="512 steps")
    with place.worker("lab-2"), busy_at_home(place):
        (job,) = client.get("/api/jobs", params={"run": "first"}).json()
        assert place.done(job["id"])["machine"] == "lab-2"
        before = {one["id"] for one in client.get("/api/jobs").json()}
        console.create(name="second", track="own", until="512 steps", race="head-to-head", opponents=["first"])
        number = client.post("/api/races", json={"title": "Club", "track": "own", "max_resets": 1, "seed": 1}).json()[
            "id"
        ]
        assert client.post(f"/api/races/{number}/entries", json={"models": ["first"]}).status_code == 202
        two = [{"model": "first"}, {"model": "first"}]
        heat = client.post("/api/contests/heats", json={"models": two, "track": "own", "max_resets": 1}).json()["id"]
        ladder = client.post("/api/contests/ladders", json={"models": two, "tracks": ["own"], "starts": 1}).json()["id"]
        search = {"trials": 1, "trial_steps": 512, "minutes": 5}
        client.post("/api/models/first/tunings", json=search)
        jobs = [job for job in client.get("/api/jobs").json() if job["kind"] != "store" and job["id"] not in before]
        assert {(job["kind"], place.done(job["id"])["machine"]) for job in jobs} == {
            (kind, "lab-2") for kind in ("train", "race", "heat", "ladder", "tune")
        }
        (row,) = client.get(f"/api/races/{number}").json()["standings"]
        assert client.get(row["video"]).headers["content-type"] == "video/mp4"
        assert client.get(f"/api/contests/{heat}/video").status_code == 200
        assert client.get(f"/api/contests/{ladder}/replay?match=0").status_code == 200
        (card,) = client.get("/api/models/first/tunings").json()
        assert [trial["can_be_kept"] for trial in card["trials"]] == [True]
    for shelf in ("races", "contests", "tunings"):  # it is at home for good
        assert Artifacts(place.artifacts).shelf(shelf).names() == []


@pytest.mark.costly
def test_the_ghosts_of_a_heat_and_of_an_entry_travel_with_it(place: Place) -> None:
    """An evaluation's and an earlier heat's, also where both are removed before anybody drives."""
    console, client = place.console, place.console.client
    console.create(name="haunter", track="oval", until="512 steps", seed=3)
    asked: dict[str, Any] = {"models": [{"model": "haunter"}] * 2, "track": "oval", "max_resets": 0, "seed": 1}
    with place.worker("lab-3"):
        (job,) = client.get("/api/jobs", params={"run": "haunter"}).json()
        place.done(job["id"])
        trial = {"laps": 1, "num_trials": 1, "rules": "first_lap"}
        place.done(client.post("/api/models/haunter/evaluations", json=trial).json()["id"])
        earlier = client.post("/api/contests/heats", json=asked).json()["id"]
        place.done(earlier)
    (card,) = (one for one in client.get("/api/contests/ghosts?track=oval").json() if one["model"] == "haunter")
    ghosts = [{"heat": earlier}, "best-lap", {"model": "haunter", "evaluation": card["evaluation"]}]
    with busy_at_home(place):
        heat = client.post("/api/contests/heats", json=asked | {"ghosts": ghosts}).json()["id"]
        cup = {"title": "Cup", "track": "oval", "laps": 1, "trials": 1, "max_resets": 0, "seed": 1, "time_limit": 8}
        race = client.post("/api/races", json=cup).json()["id"]
        alone = {"models": ["haunter"], "ghosts": [*ghosts, {"model": "haunter"}]}
        (entry,) = client.post(f"/api/races/{race}/entries", json=alone).json()["undecided"]
        (drive,) = (one for one in client.get("/api/jobs", params={"run": "haunter"}).json() if one["kind"] == "race")
        assert client.delete(f"/api/contests/{earlier}").status_code == 204
        (console.runs / "haunter" / f"evaluation-{card['evaluation']}" / "evaluation.replay").unlink()
        unwanted = client.post("/api/contests/heats", json=asked | {"ghosts": ghosts[1:]})
        assert unwanted.json()["error"]["message"].endswith("has no replay.")
        with place.worker("lab-4"):
            assert place.done(heat)["machine"] == place.done(drive["id"])["machine"] == "lab-4"
        assert client.get(f"/api/contests/{heat}/video").status_code == 200
        film = client.get(f"/api/races/{race}/replay", params={"entries": entry["entry"]}).json()
        assert len([ghost for ghost in film["ghosts"] if not ghost["is_lap"]]) == 3
    for shelf in ("contests", "races"):
        assert Artifacts(place.artifacts).shelf(shelf).names() == []


@pytest.mark.costly
def test_a_guests_training_on_an_own_track_against_another_run_travels(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    database = Database(f"sqlite:///{tmp_path / 'console.db'}")
    database.migrate()
    with database.transaction() as session:
        guest = add_person(session, "Ada")
    queue, store = JobQueue(database).of(guest), Artifacts(f"file://{tmp_path}/store")
    owner = ServeSettings(runs=tmp_path / "home")
    settings = owner.of(guest)
    keeper = Mirror(store, settings=owner, queue=queue, supervisor=Supervisor(owner, queue, Access.of(owner)))
    keeper = keeper.of(settings, queue)
    own = settings.tracks / "own.npy"
    own.parent.mkdir(parents=True)
    save_route(load_track("oval"), own)
    metadata = ModelMetadata(action_space=action_space("default"), neural_network="RACECRAFT_SMALL")
    reward = load_preset("racing")
    plain: dict[str, Any] = {
        "metadata": metadata,
        "hyperparameters": None,
        "track": str(own),
        "until": Until(steps=256),
    }
    start: dict[str, Any] = {"reward": reward, "metadata": metadata, "root": settings.runs}
    rival = start_run(make_settings(**plain), name="rival", **start)
    Training(rival).run()
    against = Opponents(drivers=(str(rival.path.resolve()),))
    folder = start_run(make_settings(**plain, opponents=against), name="duel", **start)
    cargo = keeper.share_training(folder)
    assert cargo is not None
    assert set(cargo.runs) == {"duel", "rival"}
    job = queue.add("train", "duel", {}, cargo=cargo)
    own.rename(tmp_path / "gone.npy")  # as on a machine that never had it
    rival.path.rename(tmp_path / "gone")

    there = tmp_path / "there"
    courier = Courier(store.of(guest), job, there, kept=there / "duel" / "checkpoints" / "manifest.json")
    monkeypatch.setenv("RACECRAFT_MOVED", "")  # which is put back
    move(courier.fetch())
    Training(RunFolder(there / "duel")).run()
    courier.deliver()
    monkeypatch.undo()
    follower = Follower(store, settings=owner, queue=queue)
    job.state, job.machine = "done", "there"
    follower.see(job)
    assert folder.checkpoints.load("last").step == RunFolder(there / "duel").checkpoints.load("last").step > 0
    assert store.names() == []  # the owner has none
    assert store.of(guest).names() == ["duel", "rival"]
    keeper.forget_all()
    assert store.of(guest).names() == []
    with pytest.raises(RunError, match="not removed"):
        store.forget_all()
    database.close()


def test_what_only_this_machine_has_stays_here(tmp_path: Path) -> None:
    folder = tmp_path / "tracks"
    folder.mkdir()
    save_route(load_track("oval"), folder / "own.npy")
    assert files_of("oval + generated:3", str(folder / "own.npy")) == {str(folder / "own.npy")}
    assert files_of(str(folder)) is None
    assert files_of(str(tmp_path / "nothing.npy")) is None
    assert rivals_of({"opponents": {"drivers": ["self"]}}, tmp_path) == set()
    assert rivals_of({"opponents": {"drivers": [str(folder)]}}, tmp_path) is None
    assert rivals_of({"opponents": None}, tmp_path) == set()


def test_a_search_is_copied_as_its_last_transaction_left_it(tmp_path: Path) -> None:
    store, search = Artifacts(f"file://{tmp_path}/store").shelf("tunings"), tmp_path / "tunings" / "a"
    search.mkdir(parents=True)
    with closing(sqlite3.connect(search / "study.sqlite")) as study:
        study.execute("PRAGMA journal_mode=WAL")
        study.execute("CREATE TABLE trials (number INTEGER)")
        study.execute("INSERT INTO trials VALUES (1)")
        study.commit()
        study.execute("INSERT INTO trials VALUES (2)")  # not kept yet
        store.keep(RunFolder(search))
    (tmp_path / "there").mkdir()
    assert store.bring("a", tmp_path / "there", incoming=tmp_path / "incoming")
    with closing(sqlite3.connect(tmp_path / "there" / "a" / "study.sqlite")) as study:
        assert study.execute("SELECT number FROM trials").fetchall() == [(1,)]
    assert not store.bring("b", tmp_path / "there", incoming=tmp_path / "incoming", missing_ok=True)
    (tmp_path / "left").mkdir()
    shutil.copytree(search, tmp_path / "left" / "a", ignore=shutil.ignore_patterns(".copy"))
    (search / "result.json").write_text("{}")
    store.keep(RunFolder(search))
    assert store.bring("a", tmp_path / "left", incoming=tmp_path / "incoming")  # of a job that was killed here
    assert (tmp_path / "left" / "a" / "result.json").is_file()


@pytest.mark.costly
def test_a_worker_needs_no_more_rights_than_it_is_said_to(place: Place, postgres: PostgresServer) -> None:
    import psycopg

    database = place.database.split("@/")[1].split("?")[0]
    with psycopg.connect(f"user={USER} host={postgres.folder} dbname={database}", autocommit=True) as owner:
        for grant in RIGHTS:
            owner.execute(grant)
    limited = place.database.replace(f"{USER}@", "pupil@")
    name = place.console.create(name="limited", track="oval", until="512 steps")
    (job,) = place.console.client.get("/api/jobs", params={"run": name}).json()
    with running_worker(place.folder / "lab-3", database=limited, artifacts=place.artifacts):
        place.done(job["id"])
    with psycopg.connect(f"user=pupil host={postgres.folder} dbname={database}") as pupil:
        refused = [f"SELECT * FROM {table}" for table in ("users", "sessions", "races")]
        refused += [f"UPDATE jobs SET {column} = {column}" for column in ("id", "kind", "run", "user_id", "payload")]
        refused += [f"UPDATE jobs SET {column} = {column}" for column in ("cargo", "travels", "is_cancelled")]
        refused += ["DELETE FROM jobs", "INSERT INTO jobs (id, kind, run, user_id) VALUES ('a', 'train', 'b', 1)"]
        for statement in refused:
            with pytest.raises(psycopg.errors.InsufficientPrivilege), pupil.transaction():
                pupil.execute(statement)
        with busy_at_home(place):
            assert place.console.client.get("/api/jobs").status_code == 200  # which sees all
            assert pupil.execute("SELECT count(*) FROM jobs WHERE NOT travels").fetchone() == (0,)


def _rights() -> list[str]:
    """The lines of SQL in the docs."""
    text = (Path(__file__).parents[2] / "docs" / "workers.md").read_text()
    return [line for line in text.split("```sql\n")[1].split("```")[0].splitlines() if line]


RIGHTS = _rights()


@pytest.mark.costly
def test_two_machines_never_work_on_one_run(postgres: PostgresServer) -> None:
    database = Database(postgres.new_database())
    database.migrate()
    queue = JobQueue(database)
    first = queue.add("evaluate", "a", {}, cargo=Cargo())
    second = queue.add("evaluate", "a", {}, cargo=Cargo())
    third = queue.add("evaluate", "b", {}, cargo=Cargo())
    home = queue.add("evaluate", "c", {})
    kinds = ("evaluate",)

    def claimed(machine: str, *, is_home: bool = False) -> Job | None:
        return queue.claim(kinds, owner=machine, machine=machine, is_home=is_home)

    def ids(*jobs: Job | None) -> list[str | None]:
        return [None if job is None else job.id for job in jobs]

    assert ids(claimed("x"), claimed("y"), claimed("y"), claimed("x"), claimed("x")) == ids(
        first, third, None, second, None
    )
    assert ids(claimed("console", is_home=True)) == [home.id]
    assert {job.id for job in queue.elsewhere("y")} == {first.id, second.id}
    assert {job.id for job in queue.elsewhere("x")} == {third.id}
    heat = queue.add("heat", "a", {}, cargo=Cargo())  # which only reads the run
    assert ids(queue.claim(("heat",), owner="y", machine="y", is_home=False)) == [heat.id]
    database.close()


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"database": "", "artifacts": "file:///tmp/x"}, "needs a console's server and a token, or its database"),
        ({"database": "sqlite:///x.db", "artifacts": ""}, "needs a console's server and a token, or its database"),
        ({"database": "sqlite:////nowhere/x.db", "artifacts": "file:///tmp/x"}, "cannot be opened"),
    ],
)
def test_a_worker_that_cannot_work_says_why(tmp_path: Path, settings: dict[str, str], says: str) -> None:
    with pytest.raises((ConfigError, RunError), match=says):
        work_for(ServeSettings(runs=tmp_path, **settings), on_ready=pytest.fail)


def test_a_worker_without_a_place_or_a_token_says_so(tmp_path: Path) -> None:
    url, store = f"sqlite:///{tmp_path / 'console.db'}", f"file://{tmp_path}/store"
    database = Database(url)
    database.migrate()
    database.close()
    idle = ServeSettings(runs=tmp_path / "w", database=url, artifacts=store, training_slots=0, other_slots=0)
    with pytest.raises(ConfigError, match="without a place does nothing"):
        work_for(idle, on_ready=pytest.fail)
    with pytest.raises(ConfigError, match=r"token's file .*none\.token cannot be read"):
        work_through("http://127.0.0.1:1", tmp_path / "none.token", idle, on_ready=pytest.fail)


def test_a_worker_of_another_version_changes_nothing(tmp_path: Path) -> None:
    database = Database(f"sqlite:///{tmp_path / 'console.db'}")
    database.migrate()
    with database.engine.begin() as connection:
        connection.execute(sa.text("UPDATE alembic_version SET version_num = '0001'"))
    settings = ServeSettings(runs=tmp_path / "runs", database=database.url, artifacts=f"file://{tmp_path}/store")
    with pytest.raises(RunError, match="of version 0001") as told:
        work_for(settings, on_ready=pytest.fail)
    assert "same version" in told.value.hint
    with database.engine.connect() as connection:
        assert connection.scalar(sa.text("SELECT version_num FROM alembic_version")) == "0001"
    database.close()


def test_a_run_whose_copy_waits_behind_others_is_shared_all_the_same(tmp_path: Path) -> None:
    database = Database(f"sqlite:///{tmp_path / 'console.db'}")
    database.migrate()
    store, queue = Artifacts(f"file://{tmp_path}/store"), JobQueue(database)
    settings = ServeSettings(runs=tmp_path / "runs")
    mirror = Mirror(store, settings=settings, queue=queue, supervisor=Supervisor(settings, queue, Access.of(settings)))
    metadata = ModelMetadata(action_space=action_space("default"), neural_network="RACECRAFT_SMALL")
    oval = make_settings(metadata=metadata, hyperparameters=None, track="oval")
    folder = start_run(oval, reward=load_preset("racing"), metadata=metadata, root=settings.runs, name="fresh")
    mirror.copy("fresh")  # a job that nobody does here
    assert store.names() == []
    assert mirror.share(folder)
    assert store.names() == ["fresh"]
    assert not mirror.share(folder, tracks=(str(tmp_path / "own.npy"),))
    database.close()


@pytest.mark.slow
def test_workers_killed_again_and_again_end_in_the_bits_of_an_undisturbed_run(place: Place) -> None:
    console, dice = place.console, random.Random(20)
    names = [f"tough-{seed}" for seed in range(2)]
    for seed, name in enumerate(names):
        console.create(name=name, train=False, track="oval", seed=seed, until=UNTIL)
        shutil.copytree(console.runs / name, place.folder / "calm" / name)
        Training(RunFolder(place.folder / "calm" / name)).run()
    with ExitStack() as stack:
        machines = [f"killed-{number}" for number in range(3)]
        workers: dict[str, RunningWorker] = {one: stack.enter_context(place.worker(one)) for one in machines}
        jobs = {name: console.client.post(f"/api/models/{name}/train", json={}).json()["id"] for name in names}

        def is_ended(job: str) -> bool:
            return console.job_ended(job)() is not None

        database = Database(place.database)
        stack.callback(database.close)
        queue, kills = JobQueue(database), 0
        console.wait_for(lambda: len(queue.elsewhere("")) == len(names))
        while kills < KILLS and (working := [job.machine for job in queue.elsewhere("")]):
            time.sleep(dice.uniform(0.0, 1.5))
            victim = dice.choice(working)
            workers[victim].kill()
            workers[victim] = stack.enter_context(place.worker(victim))
            kills += 1
            console.wait_for(lambda: queue.elsewhere("") or all(is_ended(job) for job in jobs.values()))
        attempts = 0
        for name, job in jobs.items():
            attempts += place.done(job)["attempts"]
            calm, tough = RunFolder(place.folder / "calm" / name), RunFolder(console.runs / name)
            assert tough.checkpoints.load("last").step == calm.checkpoints.load("last").step
            expected, found = weights(calm), weights(tough)
            assert set(found) == set(expected)
            for array, value in expected.items():
                np.testing.assert_array_equal(found[array], value, err_msg=f"{name} {array}")
    assert kills >= 3
    assert attempts >= len(names) + kills // 2  # kills that met a training
