"""The page's tables of what a training takes by itself, against the rows that decide it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from racecraft.agent import PRESETS, ContinuousActionSpace, action_space
from racecraft.training.regimes import CUDA, DUEL, FAST_DISTILL, FAST_OBJECTS, MANY_TRACKS, OBJECTS, TIME_TRIAL, Regime

PAGE = Path(__file__).parents[2] / "docs/training.md"
ROWS = {
    "`--device cuda`": CUDA,
    "several tracks": MANY_TRACKS,
    "among objects": OBJECTS,
    "head to head": DUEL,
    "`--algorithm distill` with continuous actions": FAST_DISTILL,
    "else": TIME_TRIAL,
}
SAID = {
    ("FRONT_FACING_CAMERA",): "`FRONT_FACING_CAMERA`",
    ("FRONT_FACING_CAMERA", "LIDAR"): "camera and `LIDAR`",
}


def table(first: str) -> dict[str, dict[str, str]]:
    """The page's table whose head begins with a word: cells by row and column."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    begin = next(number for number, line in enumerate(lines) if line.startswith(f"| {first} |".replace("  ", " ")))
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[begin:]]
    end = next(number for number, line in enumerate(lines[begin:]) if not line.startswith("|"))
    head, _, *rows = cells[:end]
    return {row[0]: dict(zip(head[1:], row[1:], strict=True)) for row in rows}


def said(regime: Regime) -> dict[str, str]:
    """A row, as the page writes it."""
    trials = f"{regime.evaluation_trials} laps" if regime.evaluation_trials else ""
    every = f"every {regime.evaluate_every:,} steps" if regime.evaluate_every else ""
    quoted = {name: f"`{value}`" if (value := getattr(regime, name)) else "" for name in ("actions", "until")}
    return {
        "reward": f"`{regime.reward}`" if regime.reward else "",
        **quoted,
        "sensors": SAID[regime.sensors] if regime.sensors else "",
        "algorithm": f"`{regime.algorithm}`" if regime.algorithm else "",
        "evaluates": ", ".join(part for part in (trials, every) if part),
    }


def test_every_kind_has_its_row() -> None:
    assert list(table("")) == list(ROWS)


@pytest.mark.parametrize("kind", ROWS)
def test_a_row_says_what_is_taken(kind: str) -> None:
    told = said(ROWS[kind])
    if kind == "among objects":
        told["reward"] += f"; above 1 m/s `{FAST_OBJECTS.reward}`"
    assert table("")[kind] == told


def test_every_list_of_actions_is_told_with_its_numbers() -> None:
    rows = table("`--actions`")
    assert [name.strip("`") for name in rows] == list(PRESETS)
    for name, row in rows.items():
        space = action_space(name.strip("`"))
        angles, speeds = (numbers(row[column]) for column in ("steering angles", "speeds, m/s"))
        if isinstance(space, ContinuousActionSpace):
            low, high = space.to_aws()["steering_angle"], space.to_aws()["speed"]
            assert (angles, speeds) == ([low["high"]], [high["low"], high["high"]])
            continue
        pairs = space.to_degrees()
        assert sorted({round(abs(angle), 2) for angle, _ in pairs}) == angles
        assert sorted({round(speed, 2) for _, speed in pairs}) == speeds


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"\d+(?:\.\d+)?", text)]
