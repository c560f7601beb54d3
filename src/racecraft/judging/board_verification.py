"""`verify_board`: a league's race that is over, checked from what it publishes alone, on anybody's machine.

race.json ─▶ announcement: commitment == SHA-256(secret + document), seed == that of the secret
   └─▶ every row's replay: there, of this race and from its seed, the same to the bit when driven again, nobody else's
         └─▶ its laps == the row's figures; all rows placed by the rules == the board
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from racecraft.contest.classification import Standing, classify
from racecraft.contest.finals import FinalTerms
from racecraft.contest.standings import places, ranking_key
from racecraft.errors import ConfigError, ReplayError
from racecraft.judging.board_rows import CheckedDuel, CheckedRow, are_figures, figures_foul, place_foul, read_fetched
from racecraft.judging.final_verification import check_final
from racecraft.judging.league import League, LeagueRefused, remembered_token
from racecraft.judging.race import FORMAT
from racecraft.race.announcement import Announcement
from racecraft.replay.replay import Replay
from racecraft.replay.verification import verify

ADDRESS: Final = re.compile(r"(https?://[^/?#]+)/(?:.*/)?([0-9]{1,9})(?:/(?:race\.json)?)?")


@dataclass(frozen=True, kw_only=True)
class BoardVerification:
    """What came of checking a league's race."""

    title: str
    commitment: str
    rows: list[CheckedRow]
    duels: list[CheckedDuel]
    """Of a final in which two meet at a time, in the order in which they were driven."""
    foul: str
    """What else does not fit; empty if nothing."""
    is_seed_known: bool
    """Whether everybody knew the starts, so that there was no secret to promise."""

    @property
    def is_genuine(self) -> bool:
        """Whether everything is as it says."""
        return not self.foul and self.num_fouls == 0

    @property
    def num_fouls(self) -> int:
        """Rows and duels that are not what was driven."""
        return sum(bool(row.foul) for row in self.rows) + sum(bool(duel.foul) for duel in self.duels)

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        rows, duels = ([vars(one) for one in found] for found in (self.rows, self.duels))
        return {"is_genuine": self.is_genuine, **vars(self), "rows": rows, "duels": duels}


def is_address(race: str) -> bool:
    """Whether a race is meant that a league publishes."""
    return race.startswith(("http://", "https://"))


def verify_board(address: str, *, commitment: str = "", num_threads: int = 0) -> BoardVerification:
    """Check a race that a league has held.

    Args:
        address: Of its board, such as ``https://NAME/api/boards/1``, or of its page.
        commitment: That the race had while it was open; by default it is believed what the league says now.
        num_threads: 0 takes one per core.

    Raises:
        ConfigError: It is no address, or no board is there.
        LeagueRefused: The league does not answer, or the race is not over.
    """
    league, number = _league(address)
    told = league.published(number)
    announcement, rows = _announced(told), _rows(told)
    foul = ""
    if commitment and commitment != announcement.commitment:
        foul = f"its commitment is {announcement.commitment}, and {commitment[:80]} was promised"
    elif told.get("running"):
        foul = f"{told['running']} submissions are not judged yet, so the board is not the last one"
    terms = FinalTerms.of(announcement.document)
    if terms is not None:
        final = check_final(league, number, told, announcement, terms, num_threads=num_threads)
        return _verified(told, announcement, final.rows, final.duels, foul or final.foul)
    checked, standings, driven = [], [], dict[str, int]()
    for row in rows:
        standing, fault = _check(league, number, row, announcement, driven, num_threads=num_threads)
        standings.append(standing)
        checked.append(CheckedRow(submission=row["submission"], name=row["name"], place=row["place"], foul=fault))
    return _verified(told, announcement, _places_checked(checked, standings), [], foul)


def _verified(
    told: Mapping[str, Any], race: Announcement, rows: list[CheckedRow], duels: list[CheckedDuel], foul: str
) -> BoardVerification:
    return BoardVerification(
        title=str(told.get("title", "")),
        commitment=race.commitment,
        rows=rows,
        duels=duels,
        foul=foul,
        is_seed_known="seed" in race.document,
    )


def published_at(address: str) -> Announcement:
    """What a league publishes of a race, for one replay to be held against.

    Raises:
        ConfigError: It is no address, or no race is there.
        LeagueRefused: The league does not answer, or the race is not over.
    """
    league, number = _league(address)
    return _announced(league.published(number))


def _league(address: str) -> tuple[League, int]:
    parts = ADDRESS.fullmatch(address)
    if parts is None:
        raise ConfigError(
            f"{address[:200]!r} is no address of a race.", hint="It looks like https://NAME/api/boards/1."
        )
    return League(parts[1], remembered_token(parts[1])), int(parts[2])


def _announced(told: Mapping[str, Any]) -> Announcement:
    if told.get("format") != FORMAT:
        raise ConfigError(f"The board is of a version {told.get('format')!r}; this Racecraft reads {FORMAT}.")
    if told.get("state") != "closed":
        raise LeagueRefused("The race is not over.", hint="Secret and replays are published when it is.")
    announcement = Announcement.from_dict(told)
    if announcement.is_secret:
        raise ConfigError("The race is over and its secret is not published, so nobody can check its starts.")
    return announcement


def _rows(told: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The board's rows, of the right types; a stranger wrote them."""
    rows = told.get("board")
    if not isinstance(rows, list):
        raise ConfigError("The race is over and its board is not published.")
    seen = set()
    for row in rows:
        is_row = isinstance(row, dict) and type(row.get("submission")) is int and 0 <= row["submission"] < 2**31
        is_row = is_row and isinstance(row.get("name"), str) and isinstance(row.get("model"), str)
        if not is_row or not isinstance(row.get("place"), int | None) or not are_figures(row):
            raise ConfigError(f"The board has a row that is none: {str(row)[:200]}.")
        if row["submission"] in seen:
            raise ConfigError(f"Submission {row['submission']} stands twice on the board.")
        seen.add(row["submission"])
    return rows


def _check(
    league: League,
    number: int,
    row: Mapping[str, Any],
    announcement: Announcement,
    driven: dict[str, int],
    *,
    num_threads: int,
) -> tuple[Standing | None, str]:
    """How a row's replay stands alone, and what does not fit; `driven` remembers what was driven by whom."""
    try:
        replay = read_fetched(league.replay(number, row["submission"]))
    except LeagueRefused as error:
        return None, f"its replay is missing: {str(error).rstrip('.')}"
    except ReplayError as error:
        return None, f"its replay cannot be read: {str(error).rstrip('.')}"
    terms = announcement.document
    (standing,) = classify([replay.cars], ranking=terms["ranking"], minimum_laps=terms["minimum_laps"])
    if foul := announcement.mismatch(replay.conditions, num_cars=len(replay.cars)):
        return standing, f"its replay is not of this race: {foul}"
    try:
        found = verify(replay, race=announcement, num_threads=num_threads)
    except ReplayError as error:
        return standing, str(error).rstrip(".")
    if found.difference is not None:
        return standing, f"its replay was changed: {found.difference.sentence.rstrip('.')}"
    digest = _drive_of(replay)
    if (other := driven.setdefault(digest, row["submission"])) != row["submission"]:
        return standing, f"its replay is that of submission {other}, choice for choice"
    if not all(name in (row["model"], f"{row['model']}, trial {n}") for n, name in enumerate(replay.names, 1)):
        return standing, f"its replay is one of {replay.names[0][:80]!r}, not of {row['model'][:80]!r}"
    return standing, figures_foul(row, standing)


def _drive_of(replay: Replay) -> str:
    digest = hashlib.sha256()
    for car in replay.cars:
        digest.update(car.recording.actions.tobytes())
    return digest.hexdigest()


def _places_checked(rows: list[CheckedRow], standings: list[Standing | None]) -> list[CheckedRow]:
    """The same, each with its place held against what all replays together lead to, as far as there are any."""
    known = [standing for standing in standings if standing is not None]
    if len(known) < len(rows):
        return rows  # a place says nothing where somebody's drive is not known
    ranks = places([_key(standing) for standing in known])
    due = [None if standing.score is None else rank for standing, rank in zip(known, ranks, strict=True)]
    return [
        row if row.foul else replace(row, foul=place_foul(row.place, place))
        for row, place in zip(rows, due, strict=True)
    ]


def _key(standing: Standing) -> tuple[float, ...]:
    best = [] if standing.best is None else [standing.best]
    score = math.inf if standing.score is None else standing.score
    return ranking_key(score, lap_times=best, completion=standing.completion, resets=standing.resets)
