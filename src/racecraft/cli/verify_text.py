"""What `racecraft verify` prints for people."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from rich.console import Console
from rich.text import Text

from racecraft.errors import printable

if TYPE_CHECKING:
    from racecraft.judging.board_verification import BoardVerification
    from racecraft.judging.verification import RaceVerification
    from racecraft.replay import Verification

WIDTH: Final = 1000  # characters of somebody else's text


def say_verified(found: Verification) -> None:
    """Whether a replay is what its actions lead to, and what it holds."""
    replay = found.replay
    for name, car in zip(replay.names, replay.cars, strict=True):
        best = f", best {min(car.lap_times):.2f} s" if car.lap_times else ""
        laps = f"{len(car.lap_times)} laps{best}, {car.time:.2f} s in all"
        _say(f"  {_harmless(name)}: ", (laps, "dim"))
    if found.is_genuine:
        _say(("Genuine", "bold green"), _harmless(found.provenance.verdict), ".")
        _say(f"All {found.num_steps:,} steps come out the same, bit for bit.")
        if found.race_note:
            _say(found.race_note)
    elif found.difference is None:
        _say(("Not of its race: ", "bold red"), _harmless(found.foul), ".")
    else:
        _say(("Not genuine: ", "bold red"), found.difference.sentence)
        if found.version_note:
            _say(("note: ", "bold"), _harmless(found.version_note))


def say_race_verified(found: RaceVerification) -> None:
    """Whether a race's starts, replays and result are what it says."""
    from racecraft.judging.verification import OLD_RULES

    for name, one in found.verifications.items():
        _say(f"  {_harmless(name)}: ", (_harmless(one.sentence), "dim" if one.is_genuine else "bold red"))
    race = found.announcement
    if race is None:
        _say(("note: ", "bold"), OLD_RULES)
    else:
        _say_commitment(race.commitment, is_seed_known="seed" in race.document)
    if found.is_genuine:
        _say(
            ("Genuine: ", "bold green"),
            "replays, starts and result are what the race says." if race else "its replays.",
        )
    else:
        reason = found.foul or "not all of its replays are genuine"
        _say(("Not genuine: ", "bold red"), _harmless(reason), ".")


def say_board_verified(found: BoardVerification) -> None:
    """Whether a league's race was what its board says."""
    for row in found.rows:
        place = "-" if row.place is None else str(row.place)
        verdict: tuple[str, str] = (f"genuine, submission {row.submission}", "dim")
        if row.foul:
            verdict = (f"submission {row.submission}: {_harmless(row.foul)}", "bold red")
        _say(f"{place:>3}  {_harmless(row.name)}: ", verdict)
    for duel in found.duels:
        verdict = (_harmless(duel.foul), "bold red") if duel.foul else ("genuine", "dim")
        _say(f"  duel {duel.number + 1}, {_harmless(' and '.join(duel.names))}: ", verdict)
    _say_commitment(found.commitment, is_seed_known=found.is_seed_known)
    if found.is_genuine:
        driven = f"{len(found.duels)} duels" if found.duels else f"{len(found.rows)} replays"
        _say(("Genuine: ", "bold green"), f"starts, {driven} and places are what the board says.")
    else:
        reason = found.foul or f"{found.num_fouls} of {len(found.rows) + len(found.duels)} rows are not what was driven"
        _say(("Not genuine: ", "bold red"), _harmless(reason), ".")


def _say_commitment(commitment: str, *, is_seed_known: bool) -> None:
    _say(f"Commitment {commitment}{' (its seed was known)' if is_seed_known else ''}")


def _harmless(line: str) -> str:
    """A line of somebody else's text, without what could drive a terminal."""
    return printable(line[:WIDTH] + "…" * (len(line) > WIDTH))


def _say(*parts: str | tuple[str, str]) -> None:
    """One line, whatever its length."""
    Console().print(Text.assemble(*parts), soft_wrap=True)
