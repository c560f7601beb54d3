"""Races by their rules: ranked, entered, announced, kept secret, with jobs that the test decides."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa

from racecraft.analysis import sectors_of
from racecraft.contest.classification import classify
from racecraft.contest.terms import announced_terms
from racecraft.errors import ConfigError
from racecraft.race import Lap, Recording, Trial
from racecraft.race.announcement import Announcement, commitment_of, seed_of
from racecraft.run import CheckpointStore
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.models.garage import Garage
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.races import races as races_module
from racecraft.serve.races.races import Races
from racecraft.serve.races.replays import replay_of
from racecraft.serve.races.schemas import Enter, NewRace, RaceChange, ReplayCar
from racecraft.serve.store.database import Database, upgrade
from racecraft.serve.store.tables import Entry, Job, Race
from racecraft.serve.tracks.courses import Courses
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.sim.vehicle import PRESETS
from racecraft.track import load_track

NOTHING = Recording(load_track("oval"), np.zeros((1, len(ROW_COLUMNS))), np.zeros(1), np.zeros((1, 2), np.float32))


class Stewards:
    """Races whose jobs are decided by the test."""

    def __init__(self, folder: Path, url: str) -> None:
        self.folder = folder
        self.database = Database(url)
        self.database.migrate()
        self.queue = JobQueue(self.database)
        (folder / "tracks").mkdir()
        garage = Garage(folder, folder / "state", self.database)
        self.races = Races(self.database, self.queue, garage, Courses(folder / "tracks"))

    def race(self, **settings: Any) -> int:
        return self.races.create(NewRace(title="Cup", track="oval", **settings), user_id=1)

    def drive(self, race: int, model: str, laps: list[float], **result: Any) -> int:
        job = self.queue.add("race", model, {})
        document = {"lap_seconds": [laps], "mean_completion": len(laps) / 3, **result}
        with self.database.transaction() as session:
            session.execute(sa.update(Job).where(Job.id == job.id).values(state="done", result=document))
            entry = Entry(race_id=race, user_id=1, run=model, job_id=job.id)
            session.add(entry)
            session.flush()
            return entry.id

    def model(self, name: str) -> None:
        """A run folder with a checkpoint, as far as entering looks."""
        CheckpointStore(self.folder / name / "checkpoints").save(64, {})
        (self.folder / name / "run.json").write_text("{}")

    def entries(self, race: int) -> list[str]:
        with self.database.transaction() as session:
            return list(session.scalars(sa.select(Entry.run).where(Entry.race_id == race).order_by(Entry.id)))

    def table(self, race: int) -> list[tuple[int | None, str, float | None, float | None]]:
        return [(row.place, row.model, row.score, row.gap) for row in self.races.get(race).standings]


@pytest.fixture
def stewards(tmp_path: Path) -> Iterator[Stewards]:
    stewards = Stewards(tmp_path, f"sqlite:///{tmp_path / 'console.db'}")
    yield stewards
    stewards.database.close()


@pytest.fixture
def either_stewards(tmp_path: Path, database_url: str) -> Iterator[Stewards]:
    """On either kind of database."""
    stewards = Stewards(tmp_path, database_url)
    yield stewards
    stewards.database.close()


def test_a_total_needs_every_lap_and_equals_share_a_place(stewards: Stewards) -> None:
    race = stewards.race(laps=3)
    stewards.drive(race, "steady", [9.0, 10.0, 11.0])
    stewards.drive(race, "twin", [10.0, 11.0, 9.0])
    stewards.drive(race, "quick", [8.0, 8.0], mean_completion=0.9)
    stewards.drive(race, "slow", [12.0, 12.0, 12.0])
    stewards.drive(race, "lost", [])
    assert stewards.table(race) == [
        (1, "steady", 30.0, 0.0),
        (1, "twin", 30.0, 0.0),
        (3, "slow", 36.0, 6.0),
        (None, "quick", None, None),
        (None, "lost", None, None),
    ]


FIELD: list[tuple[list[float], int, float]] = [
    ([10.0, 10.0, 10.0], 0, 1.0),
    ([9.0, 11.0, 10.0], 0, 1.0),  # the same time with a faster lap
    ([9.0, 11.0, 10.0], 2, 1.0),  # and with resets
    ([10.0, 10.0, 10.0004], 0, 1.0),  # the same in whole milliseconds
    ([10.0, 10.0, 9.9996], 0, 1.0),
    ([10.0, 10.0, 9.9994], 1, 1.0),
    ([10.0], 1, 0.4002),
    ([12.0], 0, 0.3998),  # as far to a tenth of a per cent, with fewer resets
    ([], 0, 0.1),
]
"""Lap times, resets and completion of races of three laps."""


def _trial(times: list[float], resets: int, completion: float) -> Trial:
    """The same as a car's race."""
    statuses = ["lap_complete"] * len(times) + ["off_track"] * (3 - len(times) > 0)
    laps = tuple(
        Lap(
            number=number + 1,
            status=status,
            start_time=0.0,
            time=[*times, 1.0][number],
            completion=1.0,
            resets=resets if number == 0 else 0,
        )
        for number, status in enumerate(statuses)
    )
    return Trial(index=0, laps=laps, status=statuses[-1], completion=completion, recording=NOTHING)


@pytest.mark.parametrize("ranking", ["total", "best", "average"])
def test_a_race_is_ranked_in_the_console_as_on_the_command_line(stewards: Stewards, ranking: str) -> None:
    race = stewards.race(laps=3, ranking=ranking, minimum_laps=2 if ranking == "average" else None)
    trials = [_trial(*driven) for driven in FIELD]
    for number, (times, resets, completion) in enumerate(FIELD):
        stewards.drive(race, f"model-{number}", times, mean_completion=completion, resets=resets)
    needed = {"total": 3, "best": 1, "average": 2}[ranking]
    expected = [
        (standing.place, f"model-{standing.car}", standing.score, standing.gap)
        for standing in classify([[trial] for trial in trials], ranking=ranking, minimum_laps=needed)
    ]
    assert stewards.table(race) == expected
    assert len({place for place, *_ in expected}) > 4
    card = stewards.races.cards()[0]
    assert (card.leader, card.leader_score) == expected[0][1:3]


def test_of_a_models_entries_the_best_by_the_same_rules_counts(stewards: Stewards) -> None:
    race = stewards.race(laps=3)
    stewards.drive(race, "model", [10.0, 10.0, 10.0], resets=0)
    best = stewards.drive(race, "model", [10.0, 9.0, 11.0], resets=1)
    stewards.drive(race, "model", [10.0, 9.0, 11.0], resets=1)  # an equal one that came later
    assert [row.entry for row in stewards.races.get(race).standings] == [best]


def test_the_best_lap_of_the_best_entry_counts(stewards: Stewards) -> None:
    race = stewards.race(ranking="best")
    first = stewards.drive(race, "learner", [11.0, 12.0, 13.0])
    second = stewards.drive(race, "learner", [9.5, 30.0])
    stewards.drive(race, "other", [10.0, 10.0, 10.0])
    assert stewards.table(race) == [(1, "learner", 9.5, 0.0), (2, "other", 10.0, 0.5)]
    rows = stewards.races.get(race).standings
    assert (rows[0].entry, rows[0].attempts, rows[0].laps) == (second, 2, 2)
    stewards.races.withdraw(race, second)
    assert [row.model for row in stewards.races.get(race).standings] == ["other", "learner"]
    assert stewards.races.get(race).standings[1].entry == first


def test_an_average_is_of_laps_in_a_row(stewards: Stewards) -> None:
    race = stewards.race(ranking="average", laps=4, minimum_laps=2)
    stewards.drive(race, "even", [10.0, 10.0, 10.0, 10.0])
    stewards.drive(race, "wild", [8.0, 20.0, 8.0, 11.0])
    assert stewards.table(race) == [(1, "wild", 9.5, 0.0), (2, "even", 10.0, 0.5)]
    card = stewards.races.cards()[0]
    assert (card.leader, card.leader_score, card.models) == ("wild", 9.5, 2)


def test_a_best_lap_may_need_others_beside_it(stewards: Stewards) -> None:
    race = stewards.race(ranking="best", laps=3, minimum_laps=2)
    stewards.drive(race, "steady", [10.0, 10.5])
    stewards.drive(race, "wild", [8.0])
    assert stewards.table(race) == [(1, "steady", 10.0, 0.0), (None, "wild", None, None)]
    assert stewards.races.cards()[0].leader == "steady"


def test_no_race_needs_more_laps_than_it_has(stewards: Stewards) -> None:
    with pytest.raises(ConfigError, match="An average over 3 laps cannot be had from 2"):
        stewards.race(ranking="average", laps=2, minimum_laps=3)
    stewards.race(ranking="average", laps=3, minimum_laps=3)
    with pytest.raises(ConfigError, match="minimum_laps is 3; allowed is 1 to 2"):
        stewards.race(ranking="best", laps=2, minimum_laps=3)
    assert stewards.races.get(stewards.race(ranking="total", laps=4, minimum_laps=1)).minimum_laps == 4  # as ever
    usual = {ranking: stewards.race(ranking=ranking, laps=4) for ranking in ("total", "average", "best")}
    assert {ranking: stewards.races.get(race).minimum_laps for ranking, race in usual.items()} == {
        **{"total": 4, "average": 3, "best": 1}
    }


def test_a_failed_entry_is_not_ranked_but_shown(stewards: Stewards) -> None:
    race = stewards.race()
    entry = stewards.drive(race, "unlucky", [])
    with stewards.database.transaction() as session:
        session.execute(sa.update(Job).values(state="failed", error={"message": "No checkpoint."}))
    found = stewards.races.get(race)
    assert found.standings == []
    assert [(one.entry, one.state) for one in found.undecided] == [(entry, "failed")]


def test_what_a_run_says_about_itself_opens_no_other_files(stewards: Stewards, tmp_path: Path) -> None:
    race = stewards.race()
    (tmp_path / "secret.mp4").write_bytes(b"x")
    files = {"video": str(tmp_path / "secret.mp4"), "summary": "/etc/passwd"}
    entry = stewards.drive(race, "liar", [1.0], run=str(tmp_path / "liar"), files=files)
    row = stewards.races.get(race).standings[0]
    assert row.video is None
    assert not row.has_replay
    assert row.entry == entry


# ---- entering


def test_models_are_entered_all_or_none(stewards: Stewards) -> None:
    race = stewards.race()
    for name in ("ada", "bob"):
        stewards.model(name)
    entered = stewards.races.enter(race, Enter(models=["ada", "bob", "ada"]), user_id=1)
    assert len(entered) == 2
    assert stewards.entries(race) == ["ada", "bob"]
    jobs = stewards.queue.list(kind="race")
    assert {(job.run, job.state, job.payload["track"]) for job in jobs} == {
        ("ada", "queued", "oval"),
        ("bob", "queued", "oval"),
    }
    with pytest.raises(NotFound):
        stewards.races.enter(race, Enter(models=["ada", "nobody"]), user_id=1)
    stewards.races.set_deleted(race, is_deleted=True)
    with pytest.raises(NotFound):
        stewards.races.enter(race, Enter(models=["ada"]), user_id=1)
    assert stewards.entries(race) == ["ada", "bob"]
    assert len(stewards.queue.list(kind="race")) == 2


@pytest.mark.costly
def test_of_two_who_race_for_the_last_place_one_gets_it(
    either_stewards: Stewards, monkeypatch: pytest.MonkeyPatch
) -> None:
    stewards = either_stewards
    monkeypatch.setattr(races_module, "MAX_ENTRIES", 2)
    race = stewards.race()
    for name in ("ada", "bob", "cleo"):
        stewards.model(name)
    stewards.races.enter(race, Enter(models=["ada"]), user_id=1)
    both_counted = threading.Barrier(2)

    @sa.event.listens_for(stewards.database.engine, "after_cursor_execute")
    def wait(*arguments: Any) -> None:
        """Whoever has counted the entries waits a while for the other one, who must not have counted as many."""
        if str(arguments[2]).startswith("SELECT count(entries.id)"):
            with suppress(threading.BrokenBarrierError):
                both_counted.wait(timeout=0.5)

    def enter(name: str) -> list[int] | None:
        try:
            return stewards.races.enter(race, Enter(models=[name]), user_id=1)
        except Conflict:
            return None

    with ThreadPoolExecutor(2) as pool:
        entered = list(pool.map(enter, ["bob", "cleo"]))
    assert entered.count(None) == 1
    assert len(stewards.entries(race)) == 2
    assert len(stewards.queue.list(kind="race")) == 2


# ---- secrets, trials, and races of before


def test_every_race_has_a_secret_of_its_own_and_announces_what_decides_it(stewards: Stewards) -> None:
    races = [stewards.race(laps=2, ranking="best") for _ in range(2)]
    one, other = (stewards.races.announcement(race) for race in races)
    assert one.document == other.document
    assert one.commitment != other.commitment
    assert one.is_secret
    assert (one.document["kind"], one.document["trials"], one.document["minimum_laps"]) == ("time-trial", 5, 1)
    assert one.document["rules"]["starts"] == "lap"
    assert one.document["vehicle"] == vars(PRESETS["v5"])
    kept = [_row(stewards, race) for race in races]
    assert len({race.secret for race in kept}) == 2
    for race, announced in zip(kept, (one, other), strict=True):
        assert commitment_of(announced.document, bytes.fromhex(race.secret)) == announced.commitment
        assert len(bytes.fromhex(race.secret)) == 32


def test_the_secret_is_told_when_the_race_is_over_and_not_before(stewards: Stewards) -> None:
    race = stewards.race()
    stewards.drive(race, "ada", [10.0, 10.0, 10.0])
    found = stewards.races.get(race)
    assert (found.secret, found.is_withheld, found.seed) == ("", True, None)
    with pytest.raises(Conflict, match="tells where it starts"):
        stewards.races.driven(race, [found.standings[0].entry])
    with stewards.database.transaction() as session:
        moment = datetime.now(UTC)
        session.execute(sa.update(Race).values(opens=moment - timedelta(days=2), closes=moment - timedelta(days=1)))
    over = stewards.races.get(race)
    assert over.secret == _row(stewards, race).secret
    assert not over.is_withheld
    assert Announcement.from_dict(stewards.races.announcement(race).to_dict()).seed is not None
    assert stewards.races.driven(race, [found.standings[0].entry])


def test_a_race_for_practice_tells_its_seed_and_can_be_opened_again(stewards: Stewards) -> None:
    race = stewards.race(seed=7)
    found = stewards.races.get(race)
    assert (found.seed, found.secret, found.is_withheld) == (7, "", False)
    assert stewards.races.announcement(race).seed == 7
    stewards.races.change(race, RaceChange(closes=datetime.now(UTC)))
    assert stewards.races.get(race).state == "closed"
    stewards.races.change(race, RaceChange(closes=None))
    assert stewards.races.get(race).state == "open"


def test_the_median_of_an_entrys_trials_counts(stewards: Stewards) -> None:
    race = stewards.race(laps=1)
    stewards.drive(race, "lucky", [], lap_seconds=[[5.0], [20.0], [21.0], [22.0], [23.0]], mean_completion=1.0)
    stewards.drive(race, "steady", [], lap_seconds=[[15.0], [16.0], [17.0], [18.0], []], mean_completion=0.9)
    stewards.drive(race, "rare", [], lap_seconds=[[9.0], [9.0], [], [], []], mean_completion=0.8)
    assert stewards.table(race) == [(1, "steady", 17.0, 0.0), (2, "lucky", 21.0, 4.0), (None, "rare", None, None)]
    rows = stewards.races.get(race).standings
    assert rows[0].scores == [15.0, 16.0, 17.0, 18.0, None]
    assert (rows[1].best_lap, rows[1].laps) == (5.0, 5)


def test_what_an_entry_drives_by_is_what_was_announced(stewards: Stewards) -> None:
    race = stewards.race(kind="object-avoidance", objects=2, vehicle="v4", offtrack_penalty=2.0, trials=3)
    stewards.model("ada")
    stewards.races.enter(race, Enter(models=["ada"]), user_id=1)
    (job,) = stewards.queue.list(kind="race")
    assert set(job.payload) == {"track", "announcement", "checkpoint", "ghosts"}
    announced = Announcement.from_dict(job.payload["announcement"])
    terms = announced_terms(announced, load_track("oval"))
    assert terms.conditions.seed == seed_of(bytes.fromhex(_row(stewards, race).secret))
    assert terms.conditions.vehicle == PRESETS["v4"]
    assert terms.conditions.rules.offtrack_penalty == 2.0
    assert (terms.num_trials, terms.conditions.objects.count) == (3, 2)
    with pytest.raises(ConfigError, match="secret"):
        announced_terms(stewards.races.announcement(race), load_track("oval"))


def test_races_of_before_say_so_and_take_nobody_any_more(tmp_path: Path) -> None:
    """A database of the version before, with a race that was held then."""
    database = Database(f"sqlite:///{tmp_path / 'console.db'}")
    with database.engine.begin() as connection:
        upgrade(connection, "0003")
        connection.execute(sa.text("INSERT INTO users (id, name, created) VALUES (1, 'you', '2025-01-01')"))
        connection.execute(
            sa.text(
                "INSERT INTO races (id, owner_id, title, description, visibility, kind, track, rules, objects, vehicle,"
                " seed, ranking, minimum_laps, opens, created) VALUES (1, 1, 'Old cup', '', 'private', 'time-trial',"
                " 'oval', '{\"laps\": 1}', '{}', '', 0, 'total', 1, '2025-01-01', '2025-01-01')"
            )
        )
    database.close()
    stewards = Stewards(tmp_path, database.url)
    stewards.drive(1, "ada", [10.0])
    stewards.drive(1, "bob", [9.0])
    found = stewards.races.get(1)
    assert (found.is_old, found.state, found.trials, found.commitment) == (True, "closed", 1, "")
    assert stewards.table(1) == [(1, "bob", 9.0, 0.0), (2, "ada", 10.0, 1.0)]
    assert stewards.races.cards()[0].is_old
    stewards.model("ada")
    with pytest.raises(Conflict, match="over"):
        stewards.races.enter(1, Enter(models=["ada"]), user_id=1)
    with pytest.raises(Conflict, match="old rules"):
        stewards.races.change(1, RaceChange(closes=datetime.now(UTC) + timedelta(days=1)))
    with pytest.raises(NotFound, match="old rules"):
        stewards.races.announcement(1)
    assert not stewards.races.get(stewards.race()).is_old
    stewards.database.close()


def _row(stewards: Stewards, race: int) -> Race:
    with stewards.database.transaction() as session:
        return session.get_one(Race, race)


@pytest.mark.parametrize("is_reversed", [False, True])
def test_a_film_knows_the_corners_as_they_are_driven(is_reversed: bool) -> None:
    track = load_track("delta")
    driven = track.reversed() if is_reversed else track
    points = driven.point_at(np.arange(5.0, 12.0, 0.1))
    trace = [[round(1000 * float(x)), round(1000 * float(y)), 0] for x, y in points]
    cars = [ReplayCar(entry=1, model="ada", trace=trace, laps=[], objects=[])]
    film = replay_of("delta", track, cars, trial=0)
    assert film.is_reversed is is_reversed
    assert [sector.apex for sector in film.sectors] == [sector.apex for sector in sectors_of(driven)]
    assert film.geometry.center[1] == pytest.approx(track.centerline[1], abs=1e-4)
    assert replay_of("delta", track, cars, trial=0, is_coarse=True).sectors == []
