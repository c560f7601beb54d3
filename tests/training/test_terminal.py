from __future__ import annotations

import io
import math
import re
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from racecraft.learn import IterationStats, UpdateStats
from racecraft.learn.ledger import Ended
from racecraft.training.progress import EvaluationReport, IterationReport, Lesson
from racecraft.training.terminal import TerminalReporter, curve

LOSSES = UpdateStats(policy_loss=0.0, value_loss=0.0, entropy=1.5, approx_kl=0.0, clip_fraction=0.0, grad_norm=0.0)


def iteration(step: int, *, completion: float = 0.5, remaining: float | None = None) -> IterationReport:
    stats = IterationStats(
        iteration=step // 512,
        total_steps=step,
        num_steps=512,
        ended=(Ended(0, 1.0, 20),) * 3,
        losses=LOSSES,
        explained_variance=math.nan,
        environment_seconds=0.1,
        policy_seconds=0.1,
        update_seconds=0.1,
    )
    return IterationReport(
        stats=stats,
        seconds=step / 1000,
        steps_per_second=4321.0,
        episodes=step // 20,
        mean_reward=completion,
        completion=completion,
        remaining=remaining,
    )


def evaluation(step: int, laps: int = 3, *, is_best: bool = True) -> EvaluationReport:
    return EvaluationReport(
        step=step,
        seconds=step / 1000,
        completions=(1.0,) * laps + (0.25,) * (5 - laps),
        lap_times=(9.5,) * laps,
        is_best=is_best,
    )


def picture(width: int, *, height: int = 40, evaluations: int = 2, notes: int = 0) -> list[str]:
    """The lines of the panel after some training."""
    console = Console(file=io.StringIO(), width=width, height=height, force_terminal=True, color_system=None)
    reporter = TerminalReporter(title="Racecraft · [bold]oval[/bold] · mine", console=console)
    for step in range(512, 10_240, 512):
        reporter.iteration(iteration(step, completion=step / 10_240, remaining=83.0))
    for number in range(evaluations):
        reporter.evaluation(evaluation(4096 * (number + 1), laps=5))
    for number in range(notes):
        reporter.note(f"Note {number}: " + "a long story " * 20)
    with console.capture() as capture:
        console.print(reporter._picture())
    return capture.get().rstrip("\n").split("\n")


@pytest.mark.parametrize("width", [40, 60, 72, 80, 100, 120, 200])
def test_the_panel_fits_the_terminal_and_keeps_its_height(width: int) -> None:
    lines = picture(width)
    assert {len(line) for line in lines} == {min(width, 100)}
    assert len(lines) == len(picture(width, evaluations=0)) == len(picture(width, evaluations=9))
    assert len(lines) <= 22  # with the notes it still fits 24 lines
    assert len(picture(width, notes=5)) == len(lines) + 2


def test_the_panel_shows_what_matters_uncut_at_80_columns() -> None:
    text = "\n".join(picture(80))
    for shown in ("9,728", "4,321", "5 of 5 laps", "9.50 s", "1:23", "best evaluation", "completion", "100 %", "●"):
        assert shown in text
    assert "…" not in text
    assert "[bold]oval[/bold]" in text  # a title is no markup


def test_the_panel_without_anything_yet() -> None:
    console = Console(file=io.StringIO(), width=80, force_terminal=True)
    console.print(TerminalReporter(title="x", console=console)._picture())
    assert "starting" in console.file.getvalue()  # type: ignore[attr-defined]


def test_what_is_not_known_is_a_dash() -> None:
    console = Console(file=io.StringIO(), width=80, force_terminal=True)
    reporter = TerminalReporter(title="x", console=console)
    reporter.iteration(iteration(512, completion=math.nan))
    with console.capture() as capture:
        console.print(reporter._picture())
    assert "nan" not in capture.get().lower()


def test_a_pipe_gets_plain_lines() -> None:
    stream = io.StringIO()
    with TerminalReporter(title="x", console=Console(file=stream, width=40)) as reporter:
        reporter.note("Resumed at step 5.")
        reporter.iteration(iteration(512))
        reporter.evaluation(evaluation(1_234_567, laps=3))
        reporter.evaluation(evaluation(2_345_678, laps=0, is_best=False))
    lines = stream.getvalue().splitlines()
    assert lines == [
        "Resumed at step 5.",
        " 1234.6 s   1,234,567 steps  3 of 5 laps   70 %  best lap 9.50 s  (best so far)",
        " 2345.7 s   2,345,678 steps  0 of 5 laps   25 %",
    ]


def taught(steps: int, *, seconds: float, pace: float = 81_234.0) -> IterationReport:
    """An iteration of a teacher's."""
    lesson = Lesson(steps=steps, needed=3_000_000, steps_per_second=pace)
    nothing_driven = replace(iteration(0).stats, num_steps=0)
    return replace(iteration(0, completion=math.nan), stats=nothing_driven, seconds=seconds, lesson=lesson)


@pytest.mark.parametrize("width", [40, 80])
def test_the_panel_tells_how_far_a_teacher_is(width: int) -> None:
    console = Console(file=io.StringIO(), width=width, force_terminal=True, color_system=None)
    reporter = TerminalReporter(title="mine", console=console)
    for number in range(1, 21):
        reporter.iteration(taught(number * 61_700, seconds=0.5 * number))
    with console.capture() as capture:
        console.print(reporter._picture())
    text = capture.get()
    assert re.search(r"teacher learned +41 % │", text)
    assert "81,234" in text
    assert len(text.rstrip("\n").split("\n")) == len(picture(width))  # it keeps its height when the student begins
    reporter.iteration(taught(3_002_368, seconds=40.0))
    with console.capture() as capture:
        console.print(reporter._picture())
    assert re.search(r"teacher learned +100 % │", capture.get())


def test_a_teachers_iterations_are_no_part_of_the_curve() -> None:
    def drawn(*reports: IterationReport) -> str:
        console = Console(file=io.StringIO(), width=80, force_terminal=True, color_system=None)
        reporter = TerminalReporter(title="mine", console=console)
        for report in reports:
            reporter.iteration(report)
        reporter.evaluation(evaluation(1024, laps=5))
        return reporter._graph(50).plain

    driven = [iteration(512 * number, completion=0.1 * number) for number in range(1, 5)]
    lessons = [taught(4096 * number, seconds=0.1 * number) for number in range(1, 50)]
    assert drawn(*lessons, *driven) == drawn(*driven)


def test_a_pipe_hears_of_a_teacher_every_ten_seconds() -> None:
    stream = io.StringIO()
    with TerminalReporter(title="x", console=Console(file=stream, width=40)) as reporter:
        for number in range(1, 101):
            reporter.iteration(taught(number * 30_000, seconds=1.25 + 0.25 * number))
        reporter.iteration(iteration(512))
    assert stream.getvalue().splitlines() == [
        "   11.5 s  the teacher has learned 41 % of its 3,000,000 steps, 81,234 a second",
        "   21.5 s  the teacher has learned 81 % of its 3,000,000 steps, 81,234 a second",
    ]


def test_nothing_stays_on_the_screen_when_nothing_was_trained() -> None:
    stream = io.StringIO()
    with TerminalReporter(title="mine", console=Console(file=stream, force_terminal=True)) as reporter:
        reporter.note("The limit was reached before.")
    after = stream.getvalue().rsplit("\x1b[2K", 1)[-1]  # the last line erased
    assert "mine" not in after
    assert "reached before" in after


# ---- the curve


@given(
    values=st.lists(st.floats(-1, 2) | st.just(math.nan), max_size=300),
    width=st.integers(1, 60),
    rows=st.integers(1, 10),
)
def test_a_curve_always_has_its_size(values: list[float], width: int, rows: int) -> None:
    lines = curve(values, width=width, rows=rows)
    assert [len(line) for line in lines] == [width] * rows
    assert all(0x2800 <= ord(cell) <= 0x28FF for line in lines for cell in line)


def _dots(lines: list[str]) -> int:
    return sum((ord(cell) - 0x2800).bit_count() for line in lines for cell in line)


def test_more_completion_is_more_ink() -> None:
    inks = [_dots(curve([value] * 9, width=20, rows=5)) for value in (0.0, 0.25, 0.5, 0.75, 1.0)]
    assert all(less < more for less, more in pairwise(inks))
    assert inks[0] == 40  # a line at the bottom
    assert inks[-1] == 20 * 5 * 8
    assert _dots(curve([math.nan] * 5, width=20, rows=5)) == _dots(curve([], width=20, rows=5)) == 0


def test_a_rising_curve_rises_to_the_right() -> None:
    lines = curve([i / 99 for i in range(100)], width=30, rows=4)
    heights = [sum((ord(line[column]) - 0x2800).bit_count() for line in lines) for column in range(30)]
    assert heights == sorted(heights)
