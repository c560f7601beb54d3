"""Finals in which two meet at a time: who drives is decided by qualifying, and anybody can check who won."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from leagues import RunningLeague, ok, refused, running_league
from sqlalchemy.orm import Session
from typer.testing import CliRunner

from racecraft.cli.entry import every_verb
from racecraft.race.entry_file import pack_entry
from racecraft.replay import read_replay
from racecraft.run import RunFolder
from racecraft.run.starters import unpack_starter
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Duel, Finalist, Job, Race, Submission, now
from racecraft.serve.submissions.season import POINTS

pytestmark = pytest.mark.costly

TERMS: dict[str, Any] = {"track": "oval", "laps": 1, "trials": 1, "max_resets": 3}


class Season:
    """A class with a qualifying in which three have driven."""

    def __init__(self, league: RunningLeague, folder: Path) -> None:
        self.league, self.teacher = league, league.organiser("Steward")
        self.group = league.group("Finals", self.teacher)
        code = league.code(self.group, self.teacher)
        self.pupils = {name: league.join(code, name) for name in ("Ann", "Ben", "Cem")}
        self.qualifying = self.make(title="Qualifying")
        for (name, pupil), starter in zip(self.pupils.items(), ("quick", "steady", "dodger"), strict=True):
            address = f"/api/league/races/{self.qualifying}/submissions"
            self.entry = pack_entry(RunFolder(unpack_starter(starter, folder)))
            number = ok(pupil.post(f"{address}?model={name}s-car", content=self.entry), 202)["id"]
            self.league.console.wait_for(lambda: ok(pupil.get(f"{address}/{number}"))["state"] == "done")  # noqa: B023

    def make(self, **settings: Any) -> int:
        address = f"/api/groups/{self.group}/races"
        return int(ok(self.teacher.post(address, json={"title": "Final", **TERMS, **settings}), 201)["id"])

    def close(self, race: int) -> None:
        ok(self.teacher.patch(f"/api/league/races/{race}", json={"closes": now().isoformat()}))

    def page(self, race: int, client: httpx.Client | None = None) -> Any:
        return ok((client or self.teacher).get(f"/api/boards/{race}/final"))

    def driven(self, race: int) -> Any:
        ok(self.teacher.post(f"/api/league/races/{race}/hold"), 202)

        def ended() -> Any:
            found = self.page(race)
            assert found["state"] not in ("failed", "cancelled"), found
            return found if found["state"] == "done" else None

        return self.league.console.wait_for(ended)


@pytest.fixture(scope="module")
def season(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Season]:
    with running_league(tmp_path_factory.mktemp("finals") / "runs") as league:
        yield Season(league, tmp_path_factory.mktemp("starters"))


@contextmanager
def rows_of(season: Season) -> Iterator[Session]:
    database = Database(f"sqlite:///{season.league.console.runs / '.racecraft' / 'console.db'}")
    with database.transaction() as session:
        yield session
    database.close()


@pytest.fixture(scope="module")
def bracket(season: Season) -> int:
    """A knock-out of three that was driven; what is refused before is refused here, as it ends qualifying."""
    make, final = f"/api/groups/{season.group}/races", {"title": "Final", **TERMS, "form": "bracket"}
    assert "follows the race in which" in refused(season.teacher.post(make, json=final), 422)
    assert "no race 999" in refused(season.teacher.post(make, json={**final, "after": 999}), 404)
    final["after"] = season.qualifying
    assert "allowed are 2 to 32" in refused(season.teacher.post(make, json={**final, "best": 33}), 422)
    ends = {**final, "closes": "2099-01-01T00:00:00Z"}
    assert "ends when it has been driven" in refused(season.teacher.post(make, json=ends), 422)

    race = season.make(form="bracket", after=season.qualifying, best=3)
    address, ann = f"/api/league/races/{race}", season.pupils["Ann"]
    page = season.page(race, ann)
    assert (page["state"], page["is_qualified"], page["finalists"], page["duels"]) == ("waiting", False, [], [])
    assert "not over yet" in refused(season.teacher.post(f"{address}/hold"), 409)
    refused(ann.post(f"{address}/hold"), 404)
    assert "those drive who qualify" in refused(ann.post(f"{address}/submissions?model=x", content=season.entry), 409)
    assert "announced with the race" in refused(season.teacher.delete(f"{address}/follow"), 409)
    change = {"closes": now().isoformat()}
    assert "ends when it has been driven" in refused(season.teacher.patch(address, json=change), 409)
    refused(season.teacher.post(f"/api/league/races/{season.qualifying}/hold"), 404)

    season.close(season.qualifying)
    assert season.page(race)["is_qualified"]
    season.driven(race)
    return race


def test_the_first_of_qualifying_meet_until_one_is_left(season: Season, bracket: int) -> None:
    order = [row["name"] for row in ok(season.teacher.get(f"/api/boards/{season.qualifying}"))["rows"]]
    page = season.page(bracket, season.pupils["Ann"])
    assert [one["name"] for one in page["finalists"]] == order
    assert [one["seed"] for one in page["finalists"] if one["is_me"]] == [1 + order.index("Ann")]
    first, last = page["duels"]
    assert [one["seed"] for one in first["racers"]] == [2, 3]
    assert [one["seed"] for one in last["racers"]] == [1, first["winner"]]
    assert [one["source"] for one in (*first["racers"], *last["racers"])] == [None, None, None, 0]
    for duel in (first, last):
        fastest = min(duel["racers"], key=lambda one: one["score"] or 999)
        assert duel["winner"] == fastest["seed"]
    board = ok(season.teacher.get(f"/api/boards/{bracket}"))
    assert (board["race"]["state"], board["race"]["form"]) == ("closed", "bracket"), "what was driven is over"
    assert [row["place"] for row in board["rows"]] == [1, 2, 3]
    winner = page["finalists"][last["winner"] - 1]["name"]
    assert board["rows"][0]["name"] == winner
    kept = ok(season.pupils[winner].get("/api/account/data"))["finals"]
    assert [(one["race"], one["place"]) for one in kept] == [("Final", 1)]
    points = {row["name"]: row["points"] for row in ok(season.teacher.get(f"/api/groups/{season.group}/season"))}
    assert points == {row["name"]: POINTS[row["place"] - 1] for row in board["rows"]}, "qualifying gives none"


def test_in_both_heats_of_a_duel_both_start_at_one_place_and_each_is_in_front_once(
    season: Season, bracket: int, tmp_path: Path
) -> None:
    def grid(duel: int, heat: int) -> list[list[float]]:
        path = tmp_path / "a.replay"
        address = f"/api/boards/{bracket}/duels/{duel}/heats/{heat}"
        path.write_bytes(season.teacher.get(f"{address}/replay").content)
        replay = read_replay(path)
        film = ok(season.teacher.get(f"{address}/film"))
        assert [len(car["trace"]) for car in film["cars"]] == [len(car.recording) for car in replay.cars]
        names = {one["seed"]: one["name"] for one in season.page(bracket)["finalists"]}
        assert [car["model"] for car in film["cars"]] == [names[int(name.split()[1])] for name in replay.names]
        starts = dict(zip(replay.names, (replay.poses(car)[0].round(6).tolist() for car in (0, 1)), strict=True))
        return [starts[name] for name in sorted(starts)]

    first, second, other = grid(0, 0), grid(0, 1), grid(1, 0)
    assert first[0] != first[1]
    assert first == second[::-1]
    assert other not in (first, first[::-1]), "every duel starts somewhere else"


def test_anybody_can_check_a_final_and_sees_what_was_changed(
    season: Season, bracket: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    for race in (season.qualifying, bracket):
        ok(season.teacher.patch(f"/api/league/races/{race}", json={"is_public": True}))
    with season.league.stranger() as stranger:
        assert season.page(bracket, stranger)["state"] == "done"
    address = f"{season.league.owner.base_url}/api/boards/{bracket}"

    def said() -> str:
        found = CliRunner().invoke(every_verb(), ["verify", "--race", address])
        return f"{found.exit_code}: {' '.join(found.output.split())}"

    honest = said()
    assert honest.startswith("0: ")
    assert "Genuine: starts, 2 duels and places are what the board says." in honest

    def changed(table: Any, key: Any, **values: Any) -> str:
        with rows_of(season) as session:
            row = session.get_one(table, key)
            before = {name: getattr(row, name) for name in values}
            for name, value in values.items():
                setattr(row, name, value)
        told = said()
        with rows_of(season) as session:
            row = session.get_one(table, key)
            for name, value in before.items():
                setattr(row, name, value)
        assert told.startswith("1: "), told
        return told

    last = season.page(bracket)["duels"][1]
    loser = next(one["seed"] for one in last["racers"] if one["seed"] != last["winner"])
    assert "has won it on the board" in changed(Duel, (bracket, 1), winner=loser)
    with rows_of(season) as session:
        results = session.get_one(Duel, (bracket, 1)).results
    edited = {**results, "1": {**results["1"], "score_ms": 5000}}
    assert "its score is 5.000 s on the board" in changed(Duel, (bracket, 1), results=edited)
    assert "meet on the board" in changed(Duel, (bracket, 1), first=2, second=3, results={**results, "3": results["1"]})
    assert "its place is 9 on the board" in changed(Finalist, (bracket, 3), place=9)
    with rows_of(season) as session:
        submission = session.get_one(Finalist, (bracket, 1)).submission_id
    slower = {"score_ms": 99_000, "best_lap_ms": 99_000}
    assert "not the first of its qualifying" in changed(Submission, submission, **slower)
    folder = season.league.console.runs / ".racecraft" / "finals"
    (heat,) = folder.glob("*/1/heat-0.replay")
    right, wrong = heat.read_bytes(), heat.with_name("heat-1.replay").read_bytes()
    heat.write_bytes(wrong)
    assert "heat 1 is one of 'seed 2, seed 1'" in said()
    heat.write_bytes((heat.parents[1] / "0" / "heat-0.replay").read_bytes())
    assert "the start of another duel" in said()
    heat.write_bytes(right)
    assert said() == honest


def test_a_stranger_sees_the_season_of_the_public_races_alone(season: Season, bracket: int) -> None:
    both = (season.qualifying, bracket)
    for race in both:
        ok(season.teacher.patch(f"/api/league/races/{race}", json={"is_public": True}))

    def told(client: httpx.Client, race: int) -> dict[str, list[int]]:
        return {
            row["name"]: [one["race"] for one in row["results"]]
            for row in ok(client.get(f"/api/boards/{race}/season"))
            if not row["is_me"]
        }

    with season.league.stranger() as stranger:
        everything = told(season.teacher, bracket)
        assert set(everything) == {"Ann", "Ben", "Cem"}
        assert everything == {name: list(both) for name in everything}
        assert told(stranger, bracket) == everything
        ok(season.teacher.patch(f"/api/league/races/{season.qualifying}", json={"is_public": False}))
        assert told(stranger, bracket) == {name: [bracket] for name in everything}
        refused(stranger.get(f"/api/boards/{season.qualifying}/season"), 404)
        assert told(season.teacher, bracket) == everything
        ann = season.pupils["Ann"]
        assert set(told(ann, bracket)) == {"Ben", "Cem"}, "she is told which row is hers"
    ok(season.teacher.patch(f"/api/league/races/{season.qualifying}", json={"is_public": True}))


def test_until_a_final_is_over_its_films_are_coarse_and_a_job_that_is_begun_again_goes_on(
    season: Season, bracket: int
) -> None:
    address = f"/api/boards/{bracket}/duels/0/heats/0"
    exact = np.array(ok(season.teacher.get(f"{address}/film"))["cars"][0]["trace"])
    with rows_of(season) as session:
        race = session.get_one(Race, bracket)
        race.closes, race.over = None, None
        session.delete(session.get_one(Duel, (bracket, 1)))
        for seed in (1, 2, 3):
            session.get_one(Finalist, (bracket, seed)).place = None
    page = season.page(bracket)
    assert [[one["seed"] for one in duel["racers"]] for duel in page["duels"]][1] == [1, page["duels"][0]["winner"]]
    assert [duel["winner"] is None for duel in page["duels"]] == [False, True]
    coarse = np.array(ok(season.teacher.get(f"{address}/film"))["cars"][0]["trace"])
    assert (coarse % 50 == 0).all()
    assert (np.abs(exact - coarse) <= 26).all()
    assert "when the race is over" in refused(season.teacher.get(f"{address}/replay"), 409)
    assert ok(season.teacher.get(f"/api/boards/{bracket}/race.json"))["secret"] == ""
    refused(season.teacher.get(f"/api/boards/{bracket}/duels/1/heats/0/film"), 404)
    refused(season.teacher.get(f"/api/boards/{bracket}/duels/0/heats/2/film"), 404)

    (first,) = (season.league.console.runs / ".racecraft" / "finals").glob("*/0/heat-0.replay")
    before = first.stat().st_mtime_ns
    (first.parent / "driven-before").mkdir()  # of a worker that was killed
    with rows_of(season) as session:
        job = session.get_one(Job, session.get_one(Race, bracket).final_job_id)
        job.state, job.finished, job.result = "queued", None, None
    season.league.console.wait_for(lambda: season.page(bracket)["state"] == "done")
    assert first.stat().st_mtime_ns == before
    assert list(first.parents[1].glob("*/driven*")) == []
    assert [one["place"] is None for one in season.page(bracket)["finalists"]] == [False] * 3
    assert ok(season.teacher.get(f"/api/boards/{bracket}"))["race"]["state"] == "closed"


def test_head_to_head_and_once_more_without_who_was_taken_out(season: Season, bracket: int) -> None:
    race = season.make(title="Duel", form="head-to-head", after=season.qualifying, best=2)
    order = [row["name"] for row in ok(season.teacher.get(f"/api/boards/{season.qualifying}"))["rows"]]
    page = season.driven(race)
    assert [one["name"] for one in page["finalists"]] == order[:2]
    (duel,) = page["duels"]
    assert {one["seed"] for one in duel["racers"]} == {1, 2}
    assert [one["place"] for one in page["finalists"]] == ([1, 2] if duel["winner"] == 1 else [2, 1])
    leader = ok(season.teacher.get(f"/api/boards/{season.qualifying}"))["rows"][0]["submission"]
    out = f"/api/league/races/{season.qualifying}/submissions/{leader}/disqualify"
    ok(season.teacher.post(out, json={"reason": "Not its own work."}), 204)
    assert [one["name"] for one in season.driven(race)["finalists"]] == order[1:]
