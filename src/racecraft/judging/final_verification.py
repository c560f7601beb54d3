"""`check_final`: a league's final in which two meet at a time, checked from what it publishes.

qualifying's board ─▶ who drives, by seed ─▶ who meets first ─▶ both heats of a duel: of this race, from the duel's own
start, the same to the bit ─▶ its figures and its winner ─▶ who meets next ─▶ … ─▶ places == the board
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from racecraft.contest.classification import Standing
from racecraft.contest.finals import HEATS, FinalTerms, duel_result, final_places, plan_final, seats_of
from racecraft.errors import ConfigError, ReplayError
from racecraft.judging.board_rows import CheckedDuel, CheckedRow, are_figures, figures_foul, place_foul, read_fetched
from racecraft.judging.league import League, LeagueRefused
from racecraft.race.announcement import Announcement
from racecraft.race.results import Trial
from racecraft.replay.verification import verify


@dataclass(frozen=True, kw_only=True)
class FinalVerification:
    """What came of checking a final."""

    rows: list[CheckedRow]
    duels: list[CheckedDuel]
    foul: str
    """What else does not fit; empty if nothing."""


@dataclass(frozen=True, kw_only=True)
class _Published:
    """What a stranger says of a final, of the right types."""

    qualifying: int
    finalists: list[dict[str, Any]]
    """In the order of their seeds."""
    duels: dict[int, dict[str, Any]]
    """By number."""

    def name(self, seed: int | None) -> str:
        return "?" if seed is None else str(self.finalists[seed - 1]["name"])


def check_final(
    league: League, number: int, told: Mapping[str, Any], race: Announcement, terms: FinalTerms, *, num_threads: int
) -> FinalVerification:
    """Check a final.

    Args:
        league: That published it.
        number: Of the race there.
        told: What is published of it, its board checked for the right types.
        race: Its announcement, with its secret.
        terms: What was announced of it as a final.
        num_threads: 0 takes one per core.

    Raises:
        ConfigError: What is published is no final.
        LeagueRefused: The league does not answer.
    """
    found = _published(told.get("final"), terms)
    plan, winners = plan_final(terms.form, len(found.finalists)), dict[int, int]()
    duels = []
    for planned in plan:
        one, other = seats_of(plan, winners)[planned.number]
        names = found.name(one), found.name(other)
        if one is None or other is None:
            foul = "who meets in it is not known"
        else:
            pair = min(one, other), max(one, other)
            winner, foul = _check_duel(league, number, planned.number, pair, found, race, num_threads=num_threads)
            if winner is not None:
                winners[planned.number] = winner
        duels.append(CheckedDuel(number=planned.number, names=names, foul=foul))
    rows = [
        CheckedRow(submission=row["submission"], name=row["name"], place=row["place"], foul="") for row in told["board"]
    ]
    if len(winners) == len(plan):
        places = final_places(terms.form, len(found.finalists), winners)
        due = {one["submission"]: places[one["seed"]] for one in found.finalists}
        rows = [replace(row, foul=place_foul(row.place, due.get(row.submission))) for row in rows]
    return FinalVerification(rows=rows, duels=duels, foul=_field_foul(league, found, rows, terms))


def _check_duel(
    league: League,
    race_id: int,
    number: int,
    seeds: tuple[int, int],
    found: _Published,
    race: Announcement,
    *,
    num_threads: int,
) -> tuple[int | None, str]:
    """The winner as far as it is known, and what does not fit."""
    told = found.duels.get(number)
    if told is None:
        return None, "it is missing"
    believed = told["winner"] if told["winner"] in seeds else None
    if tuple(told["seeds"]) != seeds:
        return believed, f"seeds {told['seeds']} meet on the board, {list(seeds)} by the race's rules"
    heats: list[tuple[Trial, ...]] = []
    for heat in range(HEATS):
        try:
            replay = read_fetched(league.heat(race_id, number, heat))
            foul = race.mismatch(replay.conditions, num_cars=len(replay.cars))
            if not foul and replay.conditions.seed != race.duel_seed(number):
                foul = "it was driven from the start of another duel"
            if foul:
                return believed, f"heat {heat + 1} is not of this duel: {foul}"
            grid = seeds if heat == 0 else seeds[::-1]
            if replay.names != tuple(f"seed {seed}" for seed in grid):
                return believed, f"heat {heat + 1} is one of {', '.join(replay.names)[:80]!r}"
            driven = verify(replay, race=race, num_threads=num_threads)
        except LeagueRefused as error:
            return believed, f"the replay of heat {heat + 1} is missing: {str(error).rstrip('.')}"
        except ReplayError as error:
            return believed, f"the replay of heat {heat + 1} cannot be read: {str(error).rstrip('.')}"
        if driven.difference is not None:
            return believed, f"the replay of heat {heat + 1} was changed: {driven.difference.sentence.rstrip('.')}"
        heats.append(replay.cars if heat == 0 else replay.cars[::-1])
    (one, other), first_won = _result(heats, race)
    for seed, standing in zip(seeds, (one, other), strict=True):
        if foul := figures_foul(told["results"].get(str(seed), {}), standing):
            return believed, f"{found.name(seed)}: {foul}"
    winner = seeds[0 if first_won else 1]
    foul = f"{found.name(told['winner'])} has won it on the board, {found.name(winner)} by what was driven"
    return winner, "" if told["winner"] == winner else foul


def _result(heats: list[tuple[Trial, ...]], race: Announcement) -> tuple[tuple[Standing, Standing], bool]:
    first, second = zip(*heats, strict=True)
    terms = race.document
    return duel_result(first, second, ranking=terms["ranking"], minimum_laps=terms["minimum_laps"])


def _field_foul(league: League, found: _Published, rows: list[CheckedRow], terms: FinalTerms) -> str:
    """What does not fit about who drives: those who are still on qualifying's board are its first, in this order."""
    if sorted(row.submission for row in rows) != sorted(one["submission"] for one in found.finalists):
        return "its board does not hold those who drove"
    try:
        before = league.published(found.qualifying)
    except LeagueRefused as error:
        return f"its qualifying cannot be looked at: {str(error).rstrip('.')}"
    if before.get("commitment") != terms.qualifying:
        return f"it follows a race with the commitment {str(before.get('commitment'))[:64]}, not the announced one"
    board = before.get("board")
    ranked = [row.get("submission") for row in board if isinstance(row, dict) and row.get("place")] if board else []
    drove = [one["submission"] for one in found.finalists if one["submission"] in ranked]
    if drove != ranked[: len(drove)]:
        return "those who drove are not the first of its qualifying, in that order"
    return ""


def _published(told: Any, terms: FinalTerms) -> _Published:
    wrong = ConfigError("The race is over and who met in its final is not published.")
    if not isinstance(told, dict) or type(told.get("qualifying")) is not int:
        raise wrong
    finalists, duels = told.get("finalists"), told.get("duels")
    if not isinstance(finalists, list) or not isinstance(duels, list) or not 2 <= len(finalists) <= terms.best:
        raise wrong
    for seed, one in enumerate(finalists, start=1):
        if not isinstance(one, dict) or one.get("seed") != seed or type(one.get("submission")) is not int:
            raise ConfigError(f"The final has a finalist that is none: {str(one)[:200]}.")
        if not isinstance(one.get("name"), str):
            raise ConfigError(f"The final has a finalist that is none: {str(one)[:200]}.")
    for one in duels:
        is_duel = isinstance(one, dict) and type(one.get("number")) is int and isinstance(one.get("results"), dict)
        seeds = [*one["seeds"], one.get("winner")] if is_duel and isinstance(one.get("seeds"), list) else []
        is_duel = len(seeds) == 3 and all(type(seed) is int and 1 <= seed <= len(finalists) for seed in seeds)
        if not is_duel or not all(are_figures(result) for result in one["results"].values()):
            raise ConfigError(f"The final has a duel that is none: {str(one)[:200]}.")
    return _Published(qualifying=told["qualifying"], finalists=finalists, duels={one["number"]: one for one in duels})
