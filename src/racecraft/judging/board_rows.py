"""What is checked of a published board, row by row and duel by duel, and how it is told."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from racecraft.contest.classification import Standing
from racecraft.replay.replay import Replay, read_replay

FIGURES: Final = {"score_ms": "score", "best_lap_ms": "best lap", "resets": "resets", "completion": "distance"}


@dataclass(frozen=True, kw_only=True)
class CheckedRow:
    """A row of a board, and what came of checking it."""

    submission: int
    name: str
    """Whose it is."""
    place: int | None
    """On the board."""
    foul: str
    """What does not fit, in words; empty where all does."""


@dataclass(frozen=True, kw_only=True)
class CheckedDuel:
    """A duel of a final, and what came of checking it."""

    number: int
    """From 0."""
    names: tuple[str, str]
    """Who met; nobody's where that is not known."""
    foul: str
    """What does not fit, in words; empty where all does."""


def read_fetched(data: bytes) -> Replay:
    """A replay file that was fetched.

    Raises:
        ReplayError: It is damaged, hostile, or of another version.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "its.replay"
        path.write_bytes(data)
        return read_replay(path)


def figures_foul(told: Mapping[str, Any], driven: Standing) -> str:
    """The first figure that is told otherwise than it was driven, in words."""
    for name, value in driven.in_whole_ms().items():
        if told.get(name) != value:
            return f"its {FIGURES[name]} is {_shown(name, told.get(name))} on the board, {_shown(name, value)} driven"
    return ""


def place_foul(told: int | None, due: int | None) -> str:
    """What is wrong with a place, in words."""
    return "" if told == due else f"its place is {_nth(told)} on the board, {_nth(due)} by the race's rules"


def are_figures(told: Any) -> bool:
    """Whether somebody's figures are of the right types; a stranger wrote them."""
    return (
        isinstance(told, dict)
        and all(isinstance(told.get(one), int | None) for one in ("score_ms", "best_lap_ms"))
        and type(told.get("resets")) is int
        and isinstance(told.get("completion"), int | float)
    )


def _nth(place: int | None) -> str:
    return "none" if place is None else str(place)


def _shown(name: str, value: Any) -> str:
    if value is None:
        return "none"
    return f"{value / 1000:.3f} s" if name.endswith("_ms") else f"{value:.6f}" if name == "completion" else str(value)
