from __future__ import annotations

from typing import Any

import pytest
from rich.console import Console

from racecraft.bench import table
from racecraft.cli.tables import show_table

RESULTS: dict[str, Any] = {
    "machine": {"processor": "A processor with a long name @ 3.00 GHz", "cores": 2, "instruction_set": "avx512"},
    "simulator": {
        "camera_steps_per_second": 100_000,
        "camera_steps_per_second_one_thread": 51_234,
        "cars": {"camera": 256},
        "limits": {"camera_steps_per_second": {"value": 500_000, "what": "copying frames"}},
    },
    "train": {"steps_per_second": 5_000, "parts_percent": {"simulator": 12.7, "learner": 80.0}},
    "skill": {"wall_seconds": [7.1, 8.2, 9.3], "median_seconds": 8.2, "runs": [{"seed": 1}]},
    "rivals": {"carracing": {"steps_per_second": 123.4}, "sb3_ppo": {"skipped": "it is not installed " * 5}},
}


def printed(results: dict[str, Any], width: int) -> list[str]:
    console = Console(width=width)
    figures, notes = table(results)
    with console.capture() as capture:
        show_table(console, figures)
        for note in notes:
            console.print(note)
    return [line.rstrip() for line in capture.get().splitlines()]


@pytest.mark.parametrize("width", [80, 120])
def test_a_figure_is_one_line_with_its_limit_and_share(width: int) -> None:
    lines = printed(RESULTS, width)
    assert all(len(line) <= width for line in lines)
    (line,) = (line for line in lines if "camera_steps_per_second " in line)
    assert line.split() == ["camera_steps_per_second", "100,000", "500,000", "[1]", "20", "%"]
    assert "[1] copying frames" in lines
    assert any(line.split() == ["wall_seconds", "7.10", "…", "9.30"] for line in lines)
    assert any("simulator 13 %, learner 80 %" in line for line in lines)


def test_what_was_skipped_is_a_note() -> None:
    text = " ".join(printed(RESULTS, 80))
    assert "rivals sb3_ppo.skipped: it is not installed" in text
