"""What counts on a league's board: only what came out the same twice, holds when it is driven again, and is done."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
from courts import ADA, OWNER, RACE, RULES, Court, HereBench, Said, announced
from leagues import untrained_run
from safetensors.numpy import load

from racecraft.contest.terms import RaceTerms
from racecraft.race.entry_file import pack_entry
from racecraft.race.policy import WEIGHTS
from racecraft.race.rules import race_rules
from racecraft.replay.replay import read_replay, write_replay
from racecraft.run.checkpoint import HEADER_KEY, header_of
from racecraft.run.tensor_file import tensor_file
from racecraft.serve.problems import Conflict
from racecraft.serve.races.races import time_limit
from racecraft.serve.settings import STATE_FOLDER
from racecraft.serve.store.tables import Job, Submission
from racecraft.serve.submissions import judge, tasks
from racecraft.serve.submissions.bench import DriverFailed
from racecraft.serve.submissions.judge import JUDGED
from racecraft.track import load_track


@pytest.fixture
def court(tmp_path: Path) -> Iterator[Court]:
    court = Court(tmp_path)
    yield court
    court.database.close()


# ---- twice


def test_what_drives_differently_the_second_time_is_not_ranked(
    court: Court, entry: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    drive = judge._drive

    def moody(told: Said, path: Path, terms: RaceTerms, *, number: int) -> tuple[Said, bytes]:
        if number == 2:
            terms = replace(terms, conditions=replace(terms.conditions, seed=terms.conditions.seed + 1))
        return drive(told, path, terms, number=number)

    monkeypatch.setattr(judge, "_drive", moody)
    monkeypatch.setattr(tasks, "BENCH", HereBench())
    error = court.fail(court.enter(entry))
    assert str(error) == "It drove differently the second time."
    assert "bug in Racecraft" in error.hint
    assert court.on_board == 0
    monkeypatch.setattr(judge, "_drive", drive)
    court.enter(entry)  # which was no fault of Ada's: the attempt of the day is still hers


def test_who_fails_the_second_time_alone_drove_differently(
    court: Court, entry: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    drive = judge._drive

    def tired(*told: Any, number: int) -> tuple[Said, bytes]:
        if number == 2:
            raise DriverFailed("It is tired.")
        return drive(*told, number=number)

    monkeypatch.setattr(judge, "_drive", tired)
    monkeypatch.setattr(tasks, "BENCH", HereBench())
    assert "differently" in str(court.fail(court.enter(entry)))


# ---- lies


def other_starts(folder: Path, _: Said) -> None:
    replay = read_replay(folder / JUDGED)
    elsewhere = replace(replay.conditions, seed=replay.conditions.seed + 1)
    write_replay(replace(replay, conditions=elsewhere), folder / JUDGED)


def faster(folder: Path, _: Said) -> None:
    replay = read_replay(folder / JUDGED)
    best = replace(replay.cars[0], completion=1.0, status="lap_complete")
    write_replay(replace(replay, cars=(best, *replay.cars[1:])), folder / JUDGED)


def only_the_best(folder: Path, _: Said) -> None:
    replay = read_replay(folder / JUDGED)
    one = {"names": replay.names[:1], "cars": replay.cars[:1], "rewards": replay.rewards[:1]}
    write_replay(replace(replay, **one), folder / JUDGED)


def easier_rules(folder: Path, _: Said) -> None:
    replay = read_replay(folder / JUDGED)
    easier = replace(replay.conditions, rules=replace(RULES, offtrack_penalty=0.0))
    write_replay(replace(replay, conditions=easier), folder / JUDGED)


LIES: dict[str, Callable[[Path, Said], object]] = {
    "no replay": lambda folder, _: (folder / JUDGED).unlink(),
    "no replay file": lambda folder, _: (folder / JUDGED).write_bytes(b"fast"),
    "from other starts": other_starts,
    "laps that were not driven": faster,
    "the best trial alone": only_the_best,
    "easier rules": easier_rules,
    "no choices": lambda _, said: said.pop("choices") and None,
    "choices of words": lambda _, said: said.update(choices=[["left", "fast"]] * 256),
    "steps of words": lambda _, said: said.update(step="many"),
    "steps beyond number": lambda _, said: said.update(step=10**30),
    "nothing": lambda *_: "",
    "a list": lambda *_: "[1, 2]",
    "brackets": lambda *_: "[" * 100_000,
}


@pytest.mark.costly
@pytest.mark.parametrize("lie", LIES)
def test_what_a_judge_says_that_does_not_hold_is_not_ranked(
    court: Court, entry: bytes, lie: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tasks, "BENCH", HereBench(LIES[lie]))
    task = court.enter(entry)
    error = court.fail(task)
    assert not isinstance(error, DriverFailed), "Ada does not pay for it"
    assert court.on_board == 0
    assert not (tasks.submission_folder(court.root / STATE_FOLDER, task.job.id) / tasks.REPLAY).exists()


def test_a_replay_is_of_the_race_whatever_a_judge_calls_it(
    court: Court, entry: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    def misnamed(folder: Path, _: Said) -> None:
        write_replay(replace(read_replay(folder / JUDGED), race=announced()), folder / JUDGED)

    monkeypatch.setattr(tasks, "BENCH", HereBench(misnamed))
    task = court.enter(entry)
    tasks.judge(task)
    published = read_replay(tasks.submission_folder(court.root / STATE_FOLDER, task.job.id) / tasks.REPLAY).race
    known = court.league.announcement(RACE, user_id=ADA)
    assert published is not None
    assert (published.commitment, published.secret) == (known.commitment, "")


def test_a_sentence_of_a_child_is_never_long(court: Court, entry: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    class Talkative(HereBench):
        def _answer(self, told: Said) -> Said:
            return {"status": judge.REFUSED, "said": json.dumps({"message": "a" * 10**6, "hint": ["b"] * 10**5})}

    monkeypatch.setattr(tasks, "BENCH", Talkative())
    error = court.fail(court.enter(entry))
    assert len(str(error)) + len(error.hint) <= 2000


# ---- done


@pytest.mark.costly
def test_an_entry_counts_in_the_moment_in_which_it_is_done(
    court: Court, entry: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tasks, "BENCH", HereBench())
    task = court.enter(entry)
    result = tasks.judge(task)
    assert court.on_board == 0, "whoever cancels it now has no place"
    court.queue.cancel(task.job.id)
    assert court.queue.heartbeat(task.job.id, owner=OWNER).word == "stop"
    assert court.end(task, "cancelled")
    assert not court.end(task, "done", result=result), "and what its worker says a moment later changes nothing"
    assert court.on_board == 0

    again = court.enter(entry)
    assert court.end(again, "done", result=tasks.judge(again))
    assert court.on_board == 1
    with court.database.transaction() as session:
        submission = session.scalars(sa.select(Submission)).one()
        assert {name: getattr(submission, name) for name in result["standing"]} == result["standing"]
    court.queue.cancel(again.job.id)
    assert court.on_board == 1, "what is done can no longer be cancelled"


# ---- drivers that fail


def test_a_driver_of_nan_has_had_its_attempt(
    court: Court, entry: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tasks, "BENCH", HereBench())
    overflowing = pack_entry(untrained_run(tmp_path / "runs", "wild", actions="continuous"))
    error = court.fail(court.enter(with_weights(overflowing, (3e38, -3e38), tmp_path)))
    assert isinstance(error, DriverFailed)
    assert "cannot drive" in str(error)
    assert court.on_board == 0
    with pytest.raises(Conflict, match="takes 1 a day"):
        court.enter(entry)


def with_weights(entry: bytes, values: tuple[float, ...], tmp_path: Path) -> bytes:
    """The same network with these numbers for its weights, over and over."""
    path = tmp_path / "entry"
    path.write_bytes(entry)
    arrays = {name: np.resize(np.float32(values), array.shape) for name, array in load(entry).items()}
    assert all(name.startswith(WEIGHTS) for name in arrays)
    return b"".join(tensor_file(arrays, {HEADER_KEY: json.dumps(header_of(path)[0], sort_keys=True)}))


@pytest.mark.costly
def test_a_driver_that_never_arrives_is_over_in_simulated_time(entry: bytes, tmp_path: Path) -> None:
    """By deepracer-for-cloud's rules, which have no limit of time, with all the resets of a race; it turns left."""
    track = load_track("oval")
    seconds = time_limit(track, laps=3)
    assert seconds == np.ceil(3 * (60 + 2 * track.length))
    terms = announced(race_rules("drfc", {"laps": 3, "max_resets": 10_000, "time_limit": seconds}), trials=5)
    (tmp_path / judge.ENTRY).write_bytes(with_weights(entry, (0.0,), tmp_path))
    told = {"document": dict(terms.document), "commitment": terms.commitment, "track": "oval", "name": "x"}
    began = time.process_time()
    status, _ = judge.judge({**told, "seed": 1, "frames": 2, "folder": str(tmp_path), "results": str(tmp_path)})
    assert status == judge.DROVE
    assert time.process_time() - began < 60
    ends = {(trial.status, round(trial.time)) for trial in read_replay(tmp_path / JUDGED).cars}
    assert ends == {("time_up", seconds)}


def test_an_old_job_of_the_same_entry_has_no_say(court: Court, entry: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tasks, "BENCH", HereBench())
    task = court.enter(entry)
    result = tasks.judge(task)
    with court.database.transaction() as session:
        session.execute(sa.update(Job).where(Job.id == task.job.id).values(owner="another"))
    assert not court.end(task, "done", result=result)
    assert court.on_board == 0
