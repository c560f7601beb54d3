"""What the command line prints for people: tables and sentences, on stdout unless it is progress or an error."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from racecraft.cli.tables import show_table
from racecraft.errors import printable, printable_lines, typed

if TYPE_CHECKING:
    from pathlib import Path

    from racecraft.bench.doctor import Finding
    from racecraft.contest.ladder import Ladder
    from racecraft.fidelity import Calibration, Comparison, FrameFit
    from racecraft.importing import ImportedRun
    from racecraft.judging.evaluation import RunEvaluation
    from racecraft.judging.generalization import RunGeneralization
    from racecraft.judging.race import RunRace
    from racecraft.limits import TrackLimit
    from racecraft.race.generalization import Generalization
    from racecraft.reward import Outcome, Problem
    from racecraft.track import Track
    from racecraft.training import TrainResult

SHOWN_LINES = 4  # of what a reward function prints in one situation
SHOWN_WIDTH = 200  # characters of such a line
ENDED = {
    "laps": "Learned it",
    "lap_time": "The lap time is reached",
    "no_better_lap": "No better lap has come for a while",
    "seconds": "Time is up",
    "steps": "All steps are done",
    "episodes": "All episodes are done",
    "score": "The score is reached",
    "interrupted": "Stopped",
}

SAME_PLACE: Final = 0.7
"""Structural similarity under which a frame was hardly taken there."""


def say_error(name: str, message: str, hint: str) -> None:
    """An error, and what to do about it."""
    console = Console(stderr=True)
    _say(console, (f"{name}: ", "bold red"), message)
    if hint:
        _say(console, ("hint: ", "bold"), hint)


def say_progress(text: str) -> None:
    """What is being done, on stderr."""
    _say(Console(stderr=True), (text, "dim"))


def say_trained(result: TrainResult) -> None:
    """How a training ended, where its time went and where its files are."""
    from racecraft.run import RunFolder

    console = Console()
    lap = f", best lap {result.best_lap_seconds:.2f} s" if result.best_lap_seconds is not None else ""
    _say(
        console,
        (ENDED[result.reason], "bold"),
        f" after {result.wall_seconds:.1f} s and {result.steps:,} camera steps: "
        f"{result.laps_completed} of {result.evaluation_trials} evaluation laps{lap}.",
    )
    parts = ", ".join(f"{name} {seconds:.1f}" for name, seconds in result.parts.items() if seconds >= 0.05)
    if parts:
        _say(console, (f"Seconds: {parts}.", "dim"))
    _say(console, "Run folder: ", (str(result.run), "bold"))
    if (prints := RunFolder(result.run).reward_log).exists():
        _say(console, "Prints:     ", (str(prints), "bold"))
    if result.reason not in ("laps", "no_better_lap"):
        _say(console, "Continue:   ", (f"racecraft train --resume {typed(result.run)}", "bold"))
    if result.reason != "interrupted":
        _say(console, "Race it:    ", (f"racecraft evaluate {typed(result.run)}", "bold"))


def say_imported(result: ImportedRun) -> None:
    """What was understood, what was not, and how to go on."""
    console = Console()
    _say(console, ("Imported ", "bold"), f"{result.kind}, to drive on {result.track}.")
    for what, becomes in result.used.items():
        _say(console, ("  + ", "bold green"), f"{what}  ", (becomes, "dim"))
    reasons: dict[str, list[str]] = {}
    for what, why in result.unused.items():
        reasons.setdefault(why, []).append(what)
    for why, names in reasons.items():
        _say(console, ("  - ", "bold yellow"), f"{', '.join(names)}  ", (why, "dim"))
    for what, suggestion in result.unknown.items():
        _say(console, ("  ? ", "bold red"), f"{what}  ", (f"unknown, has no effect. {suggestion}".rstrip(), "dim"))
    if result.kept:
        _say(
            console,
            ("  = ", "bold green"),
            f"{len(result.kept)} metrics, sim-traces and logs  ",
            (f"in {result.kept_in}/" if result.kept_in else "where they were in it", "dim"),
        )
    for note in result.notes:
        _say(console, ("note: ", "bold"), note)
    _say(console, "Run folder: ", (str(result.run), "bold"))
    _say(console, "Train it:   ", (result.next_command, "bold"))


def say_evaluated(outcome: RunEvaluation) -> None:
    """Every trial, the summary, and what was written."""
    console, evaluation = Console(), outcome.evaluation
    table = _table(title=f"{outcome.run.absolute().name} on {evaluation.track.name}")
    has_objects = evaluation.conditions.objects.count > 0
    crashes = ("crashes",) if has_objects else ()
    table.collapse_padding = has_objects  # or a terminal of 80 characters has no room for its figures
    for heading in ("trial", "laps", "best lap", "total", "off track", *crashes, "resets", "penalty", "driven"):
        heading = heading.replace(" ", "\n") if has_objects else heading
        table.add_column(heading, justify="right", no_wrap=True)
    for trial in evaluation.trials:
        table.add_row(
            str(trial.index + 1),
            f"{len(trial.lap_times)} of {evaluation.rules.laps}",
            f"{min(trial.lap_times):.2f} s" if trial.lap_times else "–",
            f"{trial.time:.2f} s",
            str(sum(lap.off_track_count for lap in trial.laps)),
            *([str(sum(lap.crash_count for lap in trial.laps))] if has_objects else []),
            str(sum(lap.resets for lap in trial.laps)),
            f"{sum(lap.penalty_seconds for lap in trial.laps):.1f} s",
            f"{100 * trial.completion:.0f} %",
        )
    show_table(console, table)
    _say(console, outcome.summary)
    driven = outcome.provenance
    _say(console, (f"{driven.sentence[:1].upper()}{driven.sentence[1:]}.", "bold yellow" if driven.own else "dim"))
    if outcome.limit is not None and evaluation.best_lap is not None:
        _say(console, f"Best lap: {outcome.limit.sentence(evaluation.best_lap)}")
    for placing in outcome.placings[:1]:
        _say(console, placing.sentence)
    for what, path in outcome.files.items():
        _say(console, f"  {what:<12} ", (str(path), "bold"))


def say_raced(outcome: RunRace) -> None:
    """The result of a race, the winner first, and what was written."""
    console, contest = Console(), outcome.contest
    conditions, terms = contest.conditions, contest.terms
    laps = f"{conditions.rules.laps} lap" + "s" * (conditions.rules.laps > 1)
    if terms.num_trials > 1:
        laps = f"median of {terms.num_trials} trials of {laps}"
    is_crowded = conditions.objects.count > 0 or terms.shares_road
    room = max(8, console.width - (80 if is_crowded else 70))  # for names
    table = _table(title=f"{terms.kind} on {conditions.track.name}, {laps}")
    table.add_column("", justify="right", no_wrap=True)
    table.add_column("model", style="bold", overflow="ellipsis", no_wrap=True, max_width=room)
    crashes = ("crashes",) if is_crowded else ()
    for heading in ("laps", "best lap", "score", "gap", "off track", *crashes, "resets"):
        table.add_column(heading, justify="right", no_wrap=True)
    for standing in contest.standings:
        score = "–" if standing.score is None else f"{standing.score:.2f} s"
        gap = "–" if standing.gap is None else f"+{standing.gap:.2f}" if standing.gap else ""
        table.add_row(
            "–" if standing.place is None else str(standing.place),
            Text(contest.names[standing.car]),
            f"{standing.laps}/{conditions.rules.laps * terms.num_trials}",
            "–" if standing.best is None else f"{standing.best:.2f} s",
            score,
            gap,
            str(standing.off_track_count),
            *([str(standing.crash_count)] if is_crowded else []),
            str(standing.resets),
        )
    show_table(console, table)
    if terms.ranking != "total" or terms.minimum_laps < conditions.rules.laps:
        what = {"total": "total time", "best": "best lap", "average": "best average"}[terms.ranking]
        _say(console, f"Ranked by {what}; {terms.minimum_laps} laps of a trial needed.")
    if terms.announcement.secret:
        _say(console, "Secret:      ", terms.announcement.secret)
        _say(console, "Commitment:  ", terms.announcement.commitment)
    _say(console, "Race folder: ", (str(outcome.folder), "bold"))
    for what, path in outcome.files.items():
        if what.startswith(("video", "replay")):
            _say(console, f"  {what}  ", (str(path), "bold"))


def say_rated(found: Ladder) -> None:
    """The ladder, the strongest model first, with the uncertainty of every rating."""
    console, count = Console(), len(found.matches)
    table = _table(title=f"{found.kind}, {count:,} races on {', '.join(dict.fromkeys(found.tracks))}")
    table.add_column("", justify="right", no_wrap=True)
    table.add_column("model", style="bold", overflow="ellipsis", no_wrap=True)
    for heading in ("rating", "95 %", "won", "drawn", "lost"):
        table.add_column(heading, justify="right", no_wrap=True)
    for row in found.rows:
        table.add_row(
            str(row.place),
            Text(row.name),
            f"{row.rating.mean:.1f}",
            f"± {1.96 * row.rating.deviation:.1f}",
            str(row.wins),
            str(row.draws),
            str(row.losses),
        )
    show_table(console, table)
    _say(console, (f"Schedule {found.schedule}, seed {found.seed}: the same command gives the same table.", "dim"))


def say_filmed(path: Path) -> None:
    """Where a film is."""
    _say(Console(), "Film: ", (str(path), "bold"))


def say_limit(name: str, limit: TrackLimit) -> None:
    """The minimum lap time and the medals."""
    console, medals = Console(), limit.medals
    _say(console, f"{name}: no lap under ", (f"{limit.ideal:.2f} s", "bold"), ", all wheels on the road.")
    _say(
        console,
        f"Medals: author {medals.author:.2f} s (driven by our line driver), gold {medals.gold:.2f} s, "
        f"silver {medals.silver:.2f} s, bronze {medals.bronze:.2f} s.",
    )


def say_generalized(outcome: RunGeneralization) -> None:
    """A line for each track, the sum, and where the table is."""
    say_laps(outcome.generalization, title=f"{outcome.run.absolute().name} after {outcome.step:,} camera steps")
    _say(Console(), "  table        ", (str(outcome.path), "bold"))


def say_laps(found: Generalization, *, title: str) -> None:
    """A line for each track and the sum."""
    console = Console()
    directions = tuple(dict.fromkeys(result.direction for result in found.results))
    table = _table(title=title)
    table.add_column("track", style="bold", overflow="ellipsis", no_wrap=True)
    table.add_column("length", justify="right", no_wrap=True)
    for direction in directions:
        table.add_column(direction, justify="right", no_wrap=True)
        table.add_column("lap", justify="right", no_wrap=True)
    by_track: dict[str, list[Any]] = {}
    for result in found.results:
        by_track.setdefault(result.track, []).append(result)
    for name, results in by_track.items():
        cells: list[str | Text] = []
        for result in results:
            is_done = result.laps == len(result.completions)
            cells.append(Text(f"{100 * result.completion:.0f} %", "" if is_done else "yellow"))
            cells.append(f"{min(result.lap_times):.1f} s" if result.lap_times else "–")
        table.add_row(name, f"{results[0].length:.1f} m", *cells)
    show_table(console, table)
    low, high = found.lap_interval
    _say(
        console,
        (f"{found.laps} of {found.trials} laps completed, {100 * found.lap_share:.1f} %", "bold"),
        f" (95 % interval {100 * low:.0f} to {100 * high:.0f} %); "
        f"mean {100 * found.completion:.1f} % of a lap; {len(found.mastered)} of {len(by_track)} tracks mastered.",
    )


def say_tracks(listed: list[tuple[Track, Any]], limits: list[TrackLimit | None]) -> None:
    """The library, a line for each track; the limit is that of the default car."""
    console, table = Console(), _table()
    table.expand = True
    table.add_column("track", style="bold", no_wrap=True)
    for heading in ("length", "width", "radius", "limit"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("", no_wrap=True, overflow="ellipsis", ratio=1)
    for (track, design), known in zip(listed, limits, strict=True):
        radius = f"{track.min_radius:.2f} m" if track.min_radius < 1000 else "–"
        limit = f"{known.ideal:.2f} s" if known else "–"
        facts = (f"{track.length:.1f} m", f"{track.mean_width:.2f} m", radius, limit)
        table.add_row(track.name, *facts, design.description)
    show_table(console, table)
    _say(console, "Draw one with ", ("racecraft tracks show NAME", "bold"), "; files and 'generated:7' work too.")


def say_rewards(listed: dict[str, str]) -> None:
    """The presets and what they pay for."""
    console, table = Console(), _table()
    table.add_column("reward", style="bold", no_wrap=True)
    table.add_column("", overflow="fold")
    for name, text in listed.items():
        table.add_row(name, text)
    show_table(console, table)
    _say(console, "Start your own from one: ", ("racecraft reward show racing > reward_function.py", "bold"))


def say_checked(problems: list[Problem], outcomes: list[Outcome], *, failed: bool) -> None:
    """What is wrong with a reward function, and what it pays in each situation."""
    console = Console()
    for problem in problems:
        style = "bold red" if problem.severity == "error" else "bold yellow"
        _say(console, (f"{problem.severity}: ", style), str(problem))
    if outcomes:
        table = _table()
        table.add_column("situation")
        table.add_column("reward", justify="right", no_wrap=True)
        for outcome in outcomes:
            reward = Text("error", "bold red") if outcome.reward is None else Text(f"{outcome.reward:.4g}")
            table.add_row(outcome.situation.description, reward)
        show_table(console, table)
    for outcome in outcomes:
        if lines := outcome.printed.splitlines():
            _say(console, (f"Printed at {outcome.situation.name!r}:", "bold"))
            for line in lines[:SHOWN_LINES]:
                _say(console, (f"    {_harmless(line)}", "dim"))
            if len(lines) > SHOWN_LINES:
                _say(console, (f"    and {len(lines) - SHOWN_LINES:,} lines more", "dim"))
    error = next((outcome.error for outcome in outcomes if outcome.error is not None), None)
    if error is not None:
        _say(console, ("error: ", "bold red"), str(error))
        if error.hint:
            _say(console, ("hint: ", "bold"), error.hint)
    _say(console, ("Not fit for training.", "bold red") if failed else ("Fit for training.", "bold green"))


def say_examined(findings: list[Finding]) -> None:
    """What works and what does not."""
    console, table = Console(), Table.grid(padding=(0, 2, 0, 0))
    for finding in findings:
        text = Text(finding.text)
        if finding.hint:
            text.append(f"\n{finding.hint}", style="yellow")
        good = Text("warn", "bold yellow") if finding.warns else Text("ok", "green")
        mark = good if finding.ok else Text("bad", "bold red")
        table.add_row(mark, Text(finding.name, "bold"), text)
    show_table(console, table)


def say_replayed(result: Comparison, picture: Path | None) -> None:
    """How much of the logs comes out the same here, and what does not."""
    console, found = Console(), result.to_dict()
    _say(console, f"{found['rows']:,} rows, {found['episodes']:,} finished episodes on {result.track.name}.")
    table = _table()
    for heading, justify in (("same as logged", "left"), ("share", "right")):
        table.add_column(heading, justify=justify, no_wrap=True)  # type: ignore[arg-type]
    for name, key in (
        ("progress", "progress_agreement"),
        ("wheels on track", "all_wheels_agreement"),
        ("closest waypoint", "closest_waypoint_agreement"),
        ("end of the episode", "episode_end_agreement"),
        ("reward", "reward_agreement"),
    ):
        if found[key] is not None:
            table.add_row(name, f"{100 * found[key]:.3f} %")
    show_table(console, table)
    if result.examples:
        _say_errors(console, {"median": _medians(found), "90 %": _medians(found, "_p90")})
    for note in (*result.differences.shown(10), *result.faults.notes[:5]):
        _say(console, (f"  {note}", "dim"))
    if result.rules.unseen:
        ended = f"{result.rules.unseen:,} of the episodes ended by a crash or the clock."
        _say(console, f"{ended} A log shows no boxes, other cars or clock, so these ends are not compared.")
    _say_moved(console, result.moved)
    if result.faults.count:
        _say(console, (f"{result.faults.count:,} rows could not be read.", "bold yellow"))
    if picture is not None:
        _say(console, "Median and worst window: ", (str(picture), "bold"))


def say_frame(fit: FrameFit, picture: Path | None) -> None:
    """Where a frame was taken, and how much ours from there looks like it."""
    console, found = Console(), fit.to_dict()
    lens, offsets = found["lens"], found["edge_offsets_px"]
    _say(
        console,
        f"Taken on {found['track']} with the lens at x = {lens['x']:.3f} m, y = {lens['y']:.3f} m, "
        f"{math.degrees(found['pose']['heading']):.1f}° from the x axis,",
    )
    _say(console, f"{100 * lens['above_ground']:.1f} cm above the road, {math.degrees(lens['pitch']):.1f}° down.")
    table = _table()
    for heading, justify in (("our frame from there", "left"), ("", "right")):
        table.add_column(heading, justify=justify, no_wrap=True)  # type: ignore[arg-type]
    table.add_row("mean absolute difference", f"{found['mean_absolute_difference']:.2f} of 255")
    table.add_row("structural similarity", f"{found['structural_similarity']:.3f}")
    for name in ("horizon", "lines", "dashes"):
        if offsets[name] is not None:
            table.add_row(f"{name}, 95 % within", f"{offsets[name]:.2f} px")
    show_table(console, table)
    if found["structural_similarity"] < SAME_PLACE:
        _say(console, ("That is not alike: is it this track, and its front camera?", "bold yellow"))
    if picture is not None:
        _say(console, "Frame, ours and the difference: ", (str(picture), "bold"))


def say_calibrated(result: Calibration, output: Path) -> None:
    """How well the fitted car predicts episodes that the fit did not see, beside the one it began with."""
    console, found = Console(), result.to_dict()
    _say(console, f"Fitted to {result.windows:,} windows, judged on {result.held_out_windows:,} others.")
    _say_errors(console, {"started from": found["preset"], "fitted": found["held_out"]})
    _say_moved(console, result.moved)
    _say(console, "Vehicle file: ", (str(output), "bold"))
    _say(console, "Drive it:     ", (f"racecraft train --vehicle {typed(output)}", "bold"))


def _say_moved(console: Console, moved: int) -> None:
    """Of jumps in logs."""
    if moved:
        times = "once" if moved == 1 else f"{moved:,} times"
        _say(console, (f"The car was moved by hand {times}, as no car drives; it starts anew there.", "bold yellow"))


def _harmless(line: str, *, width: int = SHOWN_WIDTH) -> str:
    """A line of somebody else's text, short, and without what could drive a terminal."""
    return printable(line[:width] + "…" * (len(line) > width))


def _medians(found: dict[str, Any], kind: str = "") -> dict[str, dict[str, float]]:
    return {
        "position_error_m": found[f"position_error{kind}_m"],
        "heading_error_deg": found[f"heading_error{kind}_deg"],
    }


def _say_errors(console: Console, rows: dict[str, dict[str, dict[str, float]]]) -> None:
    """A line for each of several errors: position and heading after so many steps alone."""
    table = _table()
    table.add_column("error after")
    steps = list(next(iter(rows.values()))["position_error_m"])
    for step in steps:
        table.add_column(f"{step} steps", justify="right", no_wrap=True)
    for name, errors in rows.items():
        pairs = zip(errors["position_error_m"].values(), errors["heading_error_deg"].values(), strict=True)
        table.add_row(name, *(f"{100 * metres:.1f} cm, {degrees:.1f}°" for metres, degrees in pairs))
    show_table(console, table)


def say_measured(results: dict[str, Any]) -> None:
    """The benchmarks."""
    from racecraft.bench import table

    console = Console()
    figures, notes = table(results)
    show_table(console, figures)
    for note in notes:
        console.print(note)


def _table(*, title: str | None = None) -> Table:
    return Table(
        title=Text(title) if title else None,
        title_justify="left",
        title_style="bold",
        header_style="bold",
        box=SIMPLE_HEAD,
        pad_edge=False,
    )


def _say(console: Console, *parts: str | tuple[str, str]) -> None:
    """One line, whatever its length: paths and commands must survive copying. Nothing in it drives a terminal."""
    line = Text.assemble(*parts)
    line.plain = printable_lines(line.plain)
    console.print(line, soft_wrap=True)
