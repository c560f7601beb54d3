"""What heats and ladders leave in their folders when they cannot begin, or are killed."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import pytest
import sqlalchemy as sa

from racecraft.run.starters import unpack_starter
from racecraft.serve.contests.contests import Contests
from racecraft.serve.contests.schemas import NewHeat
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.jobs.supervisor import Supervisor
from racecraft.serve.models.garage import Garage
from racecraft.serve.models.mirror import Mirror
from racecraft.serve.settings import ServeSettings
from racecraft.serve.store.database import Database
from racecraft.serve.tracks.courses import Courses


def test_a_heat_that_the_database_does_not_take_leaves_no_ghosts(
    database: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings, queue = ServeSettings(runs=tmp_path / "runs"), JobQueue(database)
    names = [unpack_starter(name, settings.runs).name for name in ("quick", "steady")]
    garage = Garage(settings.runs, settings.state, database)
    mirror = Mirror(None, settings=settings, queue=queue, supervisor=cast(Supervisor, None))
    contests = Contests(settings.state, database, queue, garage, Courses(settings.tracks), mirror=mirror)
    (tmp_path / "a.replay").write_bytes(b"a replay")
    monkeypatch.setattr(contests, "replays", lambda *_: {0: tmp_path / "a.replay"})
    heat = NewHeat.model_validate({"track": "oval", "models": [{"model": name} for name in names]})
    trigger = "CREATE TRIGGER full BEFORE INSERT ON jobs BEGIN SELECT RAISE(ABORT, 'disk is full'); END"
    with database.engine.begin() as connection:
        connection.exec_driver_sql(trigger)
    with pytest.raises(sa.exc.DBAPIError, match="disk is full"):
        contests.start_heat(heat)
    assert not list(settings.state.rglob("*.replay"))
    with database.engine.begin() as connection:
        connection.exec_driver_sql("DROP TRIGGER full")
    contests.start_heat(heat)
    assert len(list(settings.state.rglob("*.replay"))) == 1
