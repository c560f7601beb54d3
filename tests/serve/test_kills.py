"""The server and its workers, killed again and again: nothing finished is lost, nothing is done twice."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from postgres_servers import PostgresServer
from running_consoles import RunningConsole, running_console
from running_workers import processes_on

from racecraft.run import RunFolder
from racecraft.training.job import Training

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="finds processes in /proc")]

KILLS = 8
UNTIL = "24000 steps"


def test_a_server_killed_eight_times(runs: Path) -> None:
    dice = random.Random(6)
    raced: list[str] = []
    for kill in range(KILLS):
        with running_console(runs) as console:
            if kill == 0:
                console.create(name="calm", train=False, track="oval", seed=11, until=UNTIL)
                shutil.copytree(runs / "calm", runs / "tough")
                Training(RunFolder(runs / "calm")).run()  # undisturbed
                assert console.client.post("/api/models/tough/train", json={}).status_code == 202
            if kill < 6:
                # the first is filmed for as long as all kills, which fall into it; the others end in a moment, anywhere
                asked = {"laps": 1, "num_trials": 1, "rules": "drfc" if kill == 0 else "first_lap"}
                reply = console.client.post("/api/models/calm/evaluations", json=asked)
                assert reply.status_code == 202
                raced.append(reply.json()["id"])
            time.sleep(dice.uniform(0.0, 1.5))
            victims = processes_on(runs) if kill % 5 == 2 else []
            console.kill()
            for process in victims:
                with suppress(ProcessLookupError):
                    os.kill(process, signal.SIGKILL)
    with running_console(runs) as console:
        jobs = {job["id"]: job for job in console.client.get("/api/jobs").json()}
        ended = {job: console.wait_for(console.job_ended(job)) for job in jobs}
        assert {job["state"] for job in ended.values()} == {"done"}, ended
        assert sorted(job["kind"] for job in ended.values()) == [*["evaluate"] * len(raced), "train"]
        cards = console.client.get("/api/models/calm/evaluations").json()
        console.wait_for(lambda: len(processes_on(runs)) <= 1)  # the one that waits for a job
    assert not processes_on(runs)
    done = [json.loads(path.read_text())["job"] for path in (runs / "calm").glob("evaluation-*/evaluation.json")]
    assert sorted(done) == sorted(raced)
    assert len(cards) == len(raced)
    calm, tough = (RunFolder(runs / name).checkpoints.load("last") for name in ("calm", "tough"))
    assert tough.step == calm.step
    assert set(tough.arrays) == set(calm.arrays)
    for name in calm.arrays:
        if name != "recent_episodes":  # holds wall-clock times
            np.testing.assert_array_equal(tough.arrays[name], calm.arrays[name], err_msg=name)


def test_the_database_goes_away_and_comes_back(tmp_path: Path, postgres: PostgresServer) -> None:
    with running_console(tmp_path / "runs", "--database", postgres.new_database()) as console:
        name = console.create(name="patient", until="30000 steps", track="oval")
        console.wait_for(lambda: console.client.get(f"/api/models/{name}/history").json()["points"])
        postgres.restart()
        job = _patiently(console, name)
        ended = console.wait_for(console.job_ended(job))
        assert ended["state"] == "done"
        assert ended["attempts"] == 1


def _patiently(console: RunningConsole, name: str) -> str:
    """The id of a run's job, as soon as the database answers again."""
    reply = console.wait_for(
        lambda: (found := console.client.get("/api/jobs", params={"run": name})).status_code == 200 and found
    )
    return str(reply.json()[0]["id"])
