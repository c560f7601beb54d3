"""What heats and ladders leave in their folders when they cannot begin, or are killed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any, cast

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


LADDER = """
import sys
from pathlib import Path
from types import SimpleNamespace

import racecraft.judging.ladder
from racecraft.race.rules import race_rules
from racecraft.serve.contests.tasks import ladder
from racecraft.serve.contests.terms import Terms
from racecraft.sim.objects import NO_OBJECTS
from racecraft.sim.randomization import load_randomization
from racecraft.sim.vehicle import load_vehicle


def rated(*_, watch, **__):
    print("driving", flush=True)
    input()
    return SimpleNamespace(to_dict=lambda: {"ladder": [], "matches": []})


racecraft.judging.ladder.rate_models = rated
terms = Terms(
    rules=race_rules("drfc", {}),
    vehicle=load_vehicle("v5"),
    objects=NO_OBJECTS,
    randomize=load_randomization("none"),
)
asked = {"kind": "time-trial", "schedule": "round-robin", "starts": 1, "laps": 1, "seed": 1, "paths": [], "models": []}
job = SimpleNamespace(id=sys.argv[2], payload={**asked, "terms": terms.to_dict()})
ladder(SimpleNamespace(job=job, runs=Path(sys.argv[1])))
"""


@pytest.mark.costly
def test_the_next_ladder_clears_what_a_killed_one_left_and_nothing_of_one_that_drives(tmp_path: Path) -> None:
    def begun(name: str) -> subprocess.Popen[str]:
        arguments: list[Any] = [sys.executable, "-c", LADDER, tmp_path, name]
        process = subprocess.Popen(arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        assert process.stdout.readline() == "driving\n"
        return process

    def there() -> list[str]:
        return sorted(f"{path.parent.name}/{path.name}" for path in tmp_path.rglob("*matches.zip*"))

    killed, driving = begun("a"), begun("b")
    both = [f"a/.matches.zip.{killed.pid}", f"b/.matches.zip.{driving.pid}"]
    assert there() == both
    killed.kill()
    killed.communicate()
    assert there() == both
    begun("c").communicate("\n")
    assert there() == [both[1], "c/matches.zip"]
    driving.communicate("\n")
    assert driving.returncode == 0
    assert there() == ["b/matches.zip", "c/matches.zip"]
