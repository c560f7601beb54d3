"""How much one person may send in: a day's attempts hold, whatever fails, is cancelled or comes at the same moment."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import sqlalchemy as sa
from leagues import untrained_run

from racecraft.errors import ConfigError
from racecraft.race.entry_file import pack_entry
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.jobs.routes import cancel_job
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Group, Job, Member, Race, Submission, User, now
from racecraft.serve.submissions import admission
from racecraft.serve.submissions import entries as entries_module
from racecraft.serve.submissions.admission import MAX_FREE
from racecraft.serve.submissions.entries import Entries
from racecraft.serve.submissions.league import League
from racecraft.serve.submissions.schemas import LeagueRaceChange
from racecraft.serve.tracks.courses import Courses

ADA = 2


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[bytes]:
    """Entries of which no two drive alike."""
    root = tmp_path_factory.mktemp("runs")
    return [pack_entry(untrained_run(root, f"novice-{seed}", seed=seed)) for seed in range(1, 5)]


@pytest.fixture
def database(database_url: str) -> Iterator[Database]:
    database = Database(database_url)
    database.migrate()
    yield database
    database.close()


@pytest.fixture
def league(database: Database, tmp_path: Path) -> League:
    """A league in which Ada may enter race 1 once a day."""
    with database.transaction() as session:
        session.add(User(id=ADA, name="Ada", handle="ada"))
        session.add(Group(id=1, title="Class"))
        session.flush()
        session.add(Member(group_id=1, user_id=ADA, role="racer"))
        terms = {"track": "oval", "ranking": "total", "commitment": "0" * 64, "attempts_per_day": 1}
        session.add(Race(owner_id=1, group_id=1, title="Cup", **terms))
    return League(database, lambda _: Courses(tmp_path / "tracks"))


@pytest.fixture
def entries(database: Database, league: League, tmp_path: Path) -> Entries:
    return Entries(database, tmp_path / "state", lambda _: Courses(tmp_path / "tracks"), league)


def race_of(database: Database) -> int:
    with database.transaction() as session:
        return int(session.scalars(sa.select(Race.id)).one())


def enter(entries: Entries, database: Database) -> Callable[[bytes], int]:
    number = race_of(database)
    return lambda data: entries.submit(number, data, model="novice", user_id=ADA)


def end(database: Database, submission: int, state: str, *, days_ago: int = 0) -> None:
    """Let a submission's job be over, and everything that happened so far be some days ago."""
    with database.transaction() as session:
        job = session.get_one(Job, session.get_one(Submission, submission).job_id)
        job.state = state
        for row in (*session.scalars(sa.select(Submission)), *session.scalars(sa.select(Job))):
            row.created -= timedelta(days=days_ago)


def folders(tmp_path: Path) -> list[str]:
    return sorted(path.name for path in (tmp_path / "state" / "submissions").iterdir())


def test_a_race_tells_which_way_round_it_goes(league: League, database: Database) -> None:
    assert [race.direction for race in league.races(ADA)] == ["forward"]  # one from before there was a choice
    with database.transaction() as session:
        session.scalars(sa.select(Race)).one().rules = {"direction": "reverse"}
    assert [race.direction for race in league.races(ADA)] == ["reverse"]


def test_what_was_cancelled_yesterday_and_is_sent_again_is_todays_attempt(
    entries: Entries, database: Database, files: list[bytes], tmp_path: Path
) -> None:
    submit = enter(entries, database)
    first = submit(files[0])
    (before,) = folders(tmp_path)
    end(database, first, "cancelled", days_ago=2)
    assert submit(files[0]) == first
    (after,) = folders(tmp_path)
    assert after != before, "the file of the cancelled job is gone"
    with pytest.raises(Conflict, match="takes 1 a day"):
        submit(files[1])
    assert folders(tmp_path) == [after]


def test_of_many_at_the_same_moment_only_the_days_attempts_come_in(
    entries: Entries, database: Database, files: list[bytes], tmp_path: Path
) -> None:
    submit = enter(entries, database)

    def attempt(data: bytes) -> int | None:
        try:
            return submit(data)
        except Conflict:
            return None

    with ThreadPoolExecutor(len(files)) as pool:
        numbers = [number for number in pool.map(attempt, files) if number is not None]
    assert len(numbers) == 1
    assert len(folders(tmp_path)) == 1


def test_only_some_that_fail_are_free(entries: Entries, database: Database, files: list[bytes]) -> None:
    submit = enter(entries, database)
    for _ in range(MAX_FREE):
        end(database, submit(files[0]), "failed")
    with pytest.raises(Conflict, match="failed or were cancelled") as refused:
        submit(files[1])
    assert refused.value.hint.startswith("The next one is possible at")
    with database.transaction() as session:
        for job in session.scalars(sa.select(Job)):
            job.created -= timedelta(days=1)
    submit(files[1])


def test_so_many_wait_and_so_many_are_kept(
    entries: Entries, database: Database, files: list[bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(admission, "MAX_WAITING", 2)
    monkeypatch.setattr(admission, "MAX_SUBMISSIONS", 3)
    with database.transaction() as session:
        session.get_one(Race, race_of(database)).attempts_per_day = 0
    submit = enter(entries, database)
    first, second = submit(files[0]), submit(files[1])
    with pytest.raises(Conflict, match="2 of your submissions are not judged yet"):
        submit(files[2])
    end(database, first, "done")
    end(database, second, "running")
    third = submit(files[2])
    for number in (second, third):
        end(database, number, "done")
    with pytest.raises(Conflict, match="You have 3 submissions in this race"):
        submit(files[3])


def test_what_is_published_of_a_race_is_of_one_moment(
    league: League, entries: Entries, database: Database, files: list[bytes]
) -> None:
    """It ends, and its only entry is judged, while it is read."""
    number, submission = race_of(database), enter(entries, database)(files[0])
    written: list[int] = []

    def over(_: object, __: object, statement: str, *___: object) -> None:
        if "FROM groups" in statement and not written:
            written.append(1)
            with database.transaction() as session:
                session.get_one(Race, number).closes = now()
            end(database, submission, "done")

    before = league.published(number, user_id=ADA)
    assert (before["state"], before["running"]) == ("open", 1)
    sa.event.listen(sa.Engine, "before_cursor_execute", over)
    try:
        assert league.published(number, user_id=ADA) == before
    finally:
        sa.event.remove(sa.Engine, "before_cursor_execute", over)
    after = league.published(number, user_id=ADA)
    assert (written, after["state"], after["running"]) == ([1], "closed", 0)


def test_a_change_of_a_race_changes_what_it_names_and_nothing_else(league: League, database: Database) -> None:
    number = race_of(database)
    with database.transaction() as session:
        session.get_one(Member, (1, ADA)).role = "organiser"

    def changed(**told: Any) -> dict[str, Any]:
        league.change(number, LeagueRaceChange(**told), user_id=ADA)
        race = league.get(number, ADA)
        return {name: getattr(race, name) for name in ("title", "attempts_per_day", "is_frozen", "is_public")}

    first = changed()
    assert first == {"title": "Cup", "attempts_per_day": 1, "is_frozen": False, "is_public": False}
    assert changed(is_frozen=True) == {**first, "is_frozen": True}
    assert changed(title=" Final ") == {**first, "is_frozen": True, "title": "Final"}
    assert changed(is_public=True, attempts_per_day=3, is_frozen=False) == {
        "title": "Final", "attempts_per_day": 3, "is_frozen": False, "is_public": True
    }  # fmt: skip
    with pytest.raises(ConfigError, match="closes before it opens"):
        changed(closes=now() - timedelta(days=9), title="Never")
    assert changed()["title"] == "Final"


def test_who_is_in_no_group_of_a_race_sees_no_entries_and_the_board_says_how_many_wait(
    league: League, entries: Entries, database: Database, files: list[bytes]
) -> None:
    first, number = race_of(database), enter(entries, database)(files[0])
    with database.transaction() as session:
        session.add(User(id=ADA + 1, name="Bob", handle="bob"))
        terms = {"track": "oval", "ranking": "total", "commitment": "0" * 64, "attempts_per_day": 0}
        session.add(Race(owner_id=1, group_id=1, title="Second", visibility="public", **terms))
    second = first + 1
    assert [entry.id for entry in entries.submissions(first, user_id=ADA)] == [number]
    for race in (first, second):  # that it is public is for its board alone
        with pytest.raises(NotFound):
            entries.submissions(race, user_id=ADA + 1)
    waiting = {race: league.board(race, user_id=ADA, top=10)[2] for race in (first, second)}
    assert waiting == {first: 1, second: 0}


def test_the_trial_that_counts_is_that_with_the_score(
    entries: Entries, database: Database, files: list[bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(entries_module, "trial_scores", lambda race, job: [19.985, 20.0, 30.0])
    number = enter(entries, database)(files[0])
    assert entries.counted_trial(number) == 0, "it has no score"
    with database.transaction() as session:
        session.get_one(Submission, number).score_ms = 20_000
    assert entries.counted_trial(number) == 1


def test_nobody_enters_a_final_before_all_of_its_qualifying_is_judged(
    entries: Entries, database: Database, files: list[bytes]
) -> None:
    qualifying = race_of(database)
    number = enter(entries, database)(files[0])
    with database.transaction() as session:
        session.get_one(Submission, number).judged = now()
        terms = {"track": "oval", "ranking": "total", "commitment": "0" * 64, "attempts_per_day": 0}
        final = Race(owner_id=1, group_id=1, title="Final", after_id=qualifying, best_of_it=1, **terms)
        session.add(final)
        session.flush()
        after = final.id

    def refusal() -> str:
        with pytest.raises(Conflict) as refused:
            entries.submit(after, files[1], model="novice", user_id=ADA)
        return str(refused.value)

    assert refusal() == "Who drives here is decided by 'Cup', which is not over yet."
    with database.transaction() as session:
        session.get_one(Race, qualifying).closes = now()
    for state in ("queued", "running"):
        end(database, number, state)
        assert refusal() == "Not all submissions to 'Cup' are judged yet."
    end(database, number, "done")
    assert refusal() == "The first 1 of 'Cup' drive here.", "without a score she has no place"
    with database.transaction() as session:
        session.get_one(Submission, number).score_ms = 20_000
    entries.submit(after, files[1], model="novice", user_id=ADA)


def test_judging_again_leaves_one_copy_of_the_file(
    entries: Entries, database: Database, files: list[bytes], tmp_path: Path
) -> None:
    submission = enter(entries, database)(files[0])
    (before,) = folders(tmp_path)
    end(database, submission, "done")
    with database.transaction() as session:
        session.get_one(Member, (1, ADA)).role = "organiser"
    entries.judge_again(race_of(database), submission, user_id=ADA)
    (after,) = folders(tmp_path)
    assert after != before


def test_two_organisers_at_the_same_moment_have_it_judged_again_once(
    entries: Entries, database: Database, files: list[bytes], tmp_path: Path
) -> None:
    submission, race = enter(entries, database)(files[0]), race_of(database)
    end(database, submission, "done")
    with database.transaction() as session:
        session.get_one(Member, (1, ADA)).role = "organiser"

    def again(_: int) -> str:
        try:
            entries.judge_again(race, submission, user_id=ADA)
        except Conflict as error:
            return str(error)
        return "judged again"

    with ThreadPoolExecutor(4) as pool:
        said = sorted(pool.map(again, range(4)))
    assert said == [*["It is not judged yet."] * 3, "judged again"]
    with database.transaction() as session:
        states = session.scalars(sa.select(Job.state).order_by(Job.state)).all()
        assert folders(tmp_path) == [session.get_one(Submission, submission).job_id]
    assert states == ["done", "queued"]


def test_what_an_organiser_has_judged_again_its_racer_does_not_cancel(
    entries: Entries, database: Database, files: list[bytes]
) -> None:
    teacher, race, submit = 1, race_of(database), enter(entries, database)
    with database.transaction() as session:
        session.add(Member(group_id=1, user_id=teacher, role="organiser"))
    seen = SimpleNamespace(see=lambda job: job)
    context: Any = SimpleNamespace(queue=JobQueue(database, user_id=ADA), follower=seen)

    def job_of(submission: int) -> Job:
        with database.transaction() as session:
            return session.get_one(Job, session.get_one(Submission, submission).job_id)

    def cancel(submission: int) -> str:
        return cancel_job(job_of(submission).id, context).state

    first = submit(files[0])
    assert cancel(first) == "cancelled", "what she has sent in herself"
    first = submit(files[0])
    end(database, first, "done")
    entries.judge_again(race, first, user_id=teacher)
    with pytest.raises(Conflict, match="An organiser has this judged again"):
        cancel(first)
    assert job_of(first).state == "queued"
    with pytest.raises(Conflict, match="takes 1 a day"):
        submit(files[1])
    with database.transaction() as session:
        session.get_one(Member, (1, ADA)).role = "organiser"
    end(database, first, "done")
    entries.judge_again(race, first, user_id=ADA)
    assert cancel(first) == "cancelled", "what she has judged again herself"


def test_who_leaves_takes_the_files_along(
    entries: Entries, database: Database, files: list[bytes], tmp_path: Path
) -> None:
    enter(entries, database)(files[0])
    assert len(folders(tmp_path)) == 1
    entries.forget(ADA + 1)
    assert len(folders(tmp_path)) == 1
    entries.forget(ADA)
    assert folders(tmp_path) == []
