"""`report`: everything about a run on one HTML page that needs nothing else: no script, no font, no other file.

It is read from the run's files alone; what a run does not have is left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from contextlib import suppress
from html import escape
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.analysis.corners import passages, sectors_of
from racecraft.analysis.laps import TracedLap, driven_direction, read_laps
from racecraft.analysis.learned import bands, checkpoint_table, rewards, stretch_table
from racecraft.analysis.maps import LARGEST, draw_maps, iterations_of
from racecraft.analysis.report_page import page, pairs, section, table
from racecraft.analysis.svg import Chart, Curve, action_fan, cell_map, line_chart, racing_line
from racecraft.checks import check_path, is_number
from racecraft.errors import RacecraftError, RunError, TrackError, TrackNotFound
from racecraft.json_file import read_json_object
from racecraft.judging.trained import is_road_of, trained_title
from racecraft.run import RunFolder, RunInfo, Stretch, read_stretches
from racecraft.run.atomic import write_file
from racecraft.run.history import read_history
from racecraft.track import Track, joint_digest, load_track, load_tracks

MAX_POINTS: Final = 200_000
PLACES: Final = 240
LAST_ITERATIONS: Final = 12


def write_report(run: str | Path, path: str | Path | None = None) -> Path:
    """Write a run's report.

    Args:
        run: The run folder.
        path: Where to; by default ``report.html`` in the run folder.

    Raises:
        RunError: The run cannot be read, or the file cannot be written.
    """
    if path is not None:
        check_path("path", path, "use a file's path")
    folder = RunFolder.open(run)
    target = Path(path) if path is not None else folder.path / "report.html"
    text = report(folder)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        write_file(target, text.encode())
    except OSError as error:
        raise RunError(f"{target} cannot be written: {error.strerror or error}.") from error
    return target


def report(folder: RunFolder) -> str:
    """A run's report as one HTML text.

    Raises:
        RacecraftError: The run cannot be read.
    """
    info = folder.read_info()
    roads = _roads(info)
    points = _history(folder)
    evaluation = _latest_evaluation(folder)
    stretches = read_stretches(folder)
    sections = [_learning(points, stretches), stretch_table(folder, stretches)]
    figures = _training_figures(folder, points)
    lead = f"{escape(trained_title(info))} · {escape(info.created.replace('T', ' ')[:16])} UTC"
    hero = ""
    if evaluation is not None:
        stamp, summary = evaluation
        figures = _race_figures(summary) + figures
        with suppress(RacecraftError, KeyError):
            hero, more = _race(folder, stamp, summary, roads)
            sections = [*more, *sections]
    is_as_it_was = bool(roads) and joint_digest(roads) == info.track_digest
    sections += [
        _maps(folder, roads[0]) if is_as_it_was else "",
        checkpoint_table(folder, stretches),
        _actions(folder, roads),
    ]
    sections += rewards(stretches, folder.read_reward_function())
    sections.append(_settings(folder))
    return page(folder.name, lead, figures, hero, sections, versions=info.versions)


# ---- the parts


def _race(folder: RunFolder, stamp: str, summary: dict[str, Any], trained_on: Sequence[Track]) -> tuple[str, list[str]]:
    """Racing line, telemetry, corners and laps of an evaluation."""
    laps = read_laps(folder.evaluation(stamp) / "evaluation-simtrace" / "0-iteration.csv")
    if not laps:
        return "", []
    track = _road(str(summary.get("track", "")), trained_on)
    if track is None or not is_road_of(summary, folder.read_info(), track):
        how = "is not there any more" if track is None else "was changed since"
        words = f"The track {how}, so neither the line nor the corners are drawn."
        return "", [section("Laps of the last evaluation", f"<p>{words}</p>{_laps(laps)}")]
    driven = driven_direction(track, [lap.points for lap in laps])
    whole = sorted((lap for lap in laps if lap.is_complete), key=lambda lap: lap.seconds)
    best = whole[0] if whole else max(laps, key=lambda lap: lap.share[-1])
    sectors = sectors_of(driven)
    numbers = [(sector.apex, str(sector.number)) for sector in sectors if sector.turn]
    hero = racing_line(driven, best.points, best.speed, numbers, best.puts)
    parts = []
    if len(whole) > 1:
        parts.append(section("The two best laps, place by place", _telemetry(driven, whole[0], whole[1])))
    if whole:
        parts.append(_corners(driven, whole))
    parts.append(section("Laps of the last evaluation", _laps(laps)))
    return hero, parts


def _laps(laps: Sequence[TracedLap]) -> str:
    rows = [
        [
            str(lap.number),
            f"{lap.seconds:.3f}" if lap.is_complete else "–",
            f"{100 * lap.share[-1]:.0f} %",
            f"{lap.speed.mean():.2f}",
            f"{lap.penalty_seconds:.1f}",
            lap.status.replace("_", " "),
        ]
        for lap in laps
    ]
    heads = ["Lap", "Time, s", "Completion", "Mean speed, m/s", "Penalty, s", "End"]
    return table(heads, rows)


def _telemetry(track: Track, first: TracedLap, second: TracedLap) -> str:
    shares = np.linspace(0.0, 1.0, PLACES)
    place = shares * track.length
    laps = ((first, "first"), (second, "second"))

    def curves(name: str, factor: float = 1.0) -> list[Curve]:
        return [
            Curve(
                label=f"Lap {lap.number}, {lap.seconds:.2f} s",
                x=place,
                y=factor * np.interp(shares, lap.share, getattr(lap, name)),
                kind=kind,
            )
            for lap, kind in laps
        ]

    delta = second.time_at(shares) - first.time_at(shares)
    charts = (
        Chart(curves=curves("speed"), x_label="m along the lap", y_label="Speed, m/s", height=220),
        Chart(
            curves=curves("steering_angle", math.degrees(1.0)),
            x_label="m along the lap",
            y_label="Steering, degrees",
            height=200,
        ),
        Chart(
            curves=[Curve(label=f"Lap {second.number} behind lap {first.number}", x=place, y=delta)],
            x_label="m along the lap",
            y_label="Time lost, s",
            height=180,
        ),
    )
    return "".join(line_chart(chart) for chart in charts)


def _corners(track: Track, laps: Sequence[TracedLap]) -> str:
    sectors = sectors_of(track)
    through = [passages(track, lap, sectors) for lap in laps]
    rows, ideal = [], 0.0
    for index, sector in enumerate(sectors):
        mine = through[0][index]
        times = [found[index].seconds for found in through if found[index] is not None]  # type: ignore[union-attr]
        if mine is None or not times:
            continue
        ideal += min(times)
        side = "left" if sector.turn > 0 else "right" if sector.turn else ""
        rows.append(
            [
                f"{sector.number} {side}",
                f"{abs(math.degrees(sector.turn)):.0f}°",
                f"{mine.seconds:.2f}",
                f"{mine.seconds - min(times):+.2f}",
                f"{mine.entry_speed:.2f}",
                f"{mine.slowest:.2f}",
                f"{mine.exit_speed:.2f}",
            ]
        )
    heads = ["Corner", "Turn", "Time, s", "Lost to the best, s", "In, m/s", "Slowest, m/s", "Out, m/s"]
    words = "The best lap, corner by corner."
    if len(laps) > 1:
        words += f" All corners at their best of {len(laps)} laps would make {ideal:.2f} s."
    return section("Corners", f"<p>{words}</p>{table(heads, rows)}")


def _learning(points: list[dict[str, Any]], stretches: Sequence[Stretch]) -> str:
    iterations = [point for point in points if point.get("kind") == "iteration"]
    evaluations = [point for point in points if point.get("kind") == "evaluation"]
    if not iterations:
        return ""
    seconds = np.array([_number(point.get("seconds")) for point in iterations])
    unit, x_label = (1.0, "seconds of training") if seconds[-1] < 180 else (60.0, "minutes of training")
    parts = bands(stretches, iterations, unit)
    judged = [_mean(point.get("completions")) for point in evaluations]
    best = next((point for point in reversed(evaluations) if point.get("is_best")), None)
    charts = [
        Chart(
            curves=[
                Curve(label="Training", x=seconds / unit, y=_column(iterations, "completion")),
                Curve(
                    label="Evaluation",
                    x=np.array([_number(point.get("seconds")) for point in evaluations]) / unit,
                    y=np.array(judged, np.float64),
                    kind="dots",
                ),
            ],
            x_label=x_label,
            y_label="Completion",
            y_text=lambda value: f"{100 * value:.0f} %",
            y_range=(0.0, 1.04),
            marks=[_number(best.get("seconds")) / unit] if best else [],
            bands=parts,
        )
    ]
    for name, label in (("reward", "Reward of an episode"), ("entropy", "Entropy"), ("value_loss", "Value loss")):
        curve = Curve(label=label, x=seconds / unit, y=_column(iterations, name), kind="first")
        charts.append(Chart(curves=[curve], x_label=x_label, y_label=label, height=200, bands=parts))
    return section("Learning", "".join(line_chart(chart) for chart in charts))


def _maps(folder: RunFolder, track: Track) -> str:
    iterations = iterations_of(folder.training_simtrace)[-LAST_ITERATIONS:]
    if not iterations:
        return ""
    maps = draw_maps(track, folder.training_simtrace, iterations)
    picture = cell_map(track, maps.grid, maps.reward, "Mean reward by place", maps.exits)
    words = f"Mean reward of the last {maps.episodes} episodes of training by place; crosses mark early ends."
    return section("Where it was paid", f"<p>{words}</p>{picture}") if picture else ""


def _actions(folder: RunFolder, roads: Sequence[Track]) -> str:
    metadata = folder.read_model_metadata()
    space = metadata.action_space
    if space.kind != "discrete":
        limits: Any = space.to_aws()
        rows = [[name.replace("_", " "), str(limit["low"]), str(limit["high"])] for name, limit in limits.items()]
        return section("Actions", table(["Continuous", "Low", "High"], rows))
    iterations = iterations_of(folder.training_simtrace)[-LAST_ITERATIONS:]
    is_known = bool(iterations and roads)
    usage = draw_maps(roads[0], folder.training_simtrace, iterations).usage if is_known else np.zeros(0)
    actions = space.to_degrees()  # type: ignore[union-attr]
    rows = [
        [str(index), f"{angle:g}", f"{speed:.2f}", f"{100 * usage[index]:.0f} %" if index < len(usage) else "–"]
        for index, (angle, speed) in enumerate(actions)
    ]
    heads = ["#", "Steering, degrees", "Speed, m/s", "Used lately"]
    return section("Actions", f'<div class="two">{action_fan(actions, usage)}{table(heads, rows)}</div>')


def _settings(folder: RunFolder) -> str:
    info = folder.read_info()
    document = {"seed": info.seed, "track": trained_title(info), **info.settings}
    rows = _flat(document)
    metadata = _flat({"model_metadata": folder.read_model_metadata().to_dict()})
    rows += [(name, text) for name, text in metadata if ".action_space" not in name or name.endswith("_type")]
    return section("Settings", pairs(rows))


# ---- figures


def _race_figures(summary: dict[str, Any]) -> list[tuple[str, str, str]]:
    low, high = [*(summary.get("clean_lap_interval") or ()), 0.0, 1.0][:2]
    interval = f"95 % interval {100 * _number(low):.0f} to {100 * _number(high):.0f} %"
    return [
        ("Best lap", _seconds(summary.get("best_lap_seconds")), ""),
        ("Mean lap", _seconds(summary.get("mean_lap_seconds")), ""),
        ("Clean laps", f"{summary.get('laps_clean', 0)} of {summary.get('laps_begun', 0)}", interval),
        ("Off track", str(summary.get("off_track_count", 0)), ""),
    ]


def _training_figures(folder: RunFolder, points: list[dict[str, Any]]) -> list[tuple[str, str, str]]:
    last = folder.checkpoints.last
    seconds = max((_number(point.get("seconds")) for point in points), default=0.0)
    minutes, rest = divmod(round(seconds), 60)
    return [
        ("Trained", f"{minutes}:{rest:02d} min" if minutes else f"{rest} s", ""),
        ("Camera steps", f"{last.step:,}" if last is not None else "0", ""),
    ]


# ---- reading


def _roads(info: RunInfo) -> Sequence[Track]:
    """The tracks of the training; none where their files are gone, or lie elsewhere on this machine."""
    with suppress(TrackNotFound, TrackError):
        return load_tracks(info.track)
    return ()


def _road(name: str, trained_on: Sequence[Track]) -> Track | None:
    """The track of an evaluation: of the training's where one is called so; None where there is none."""
    for road in trained_on:
        if name in ("", road.name):
            return road
    with suppress(TrackNotFound, TrackError):
        return load_track(name)
    return None


def _history(folder: RunFolder) -> list[dict[str, Any]]:
    points: list[dict[str, Any]] = []
    offset = 0
    while len(points) < MAX_POINTS:
        page_of_points, end = read_history(folder.history, offset=offset)
        if end <= offset:
            break
        points += [point for point in page_of_points if not math.isnan(_number(point.get("seconds")))]
        offset = end
    return points


def _latest_evaluation(folder: RunFolder) -> tuple[str, dict[str, Any]] | None:
    for path in sorted(folder.path.glob("evaluation-*/evaluation.json"), reverse=True):
        if (path.parent / "evaluation-simtrace" / "0-iteration.csv").is_file():
            with suppress(RacecraftError):
                return path.parent.name.removeprefix("evaluation-"), read_json_object(path)
    return None


def _column(points: Iterable[dict[str, Any]], name: str) -> NDArray[np.float64]:
    return np.array([_number(point.get(name)) for point in points])


def _number(value: Any) -> float:
    return float(value) if is_number(value) and abs(value) < LARGEST else math.nan


def _mean(values: Any) -> float:
    """Of what in a list is a number."""
    known = [float(value) for value in values if is_number(value)] if isinstance(values, list) else []
    return sum(known) / len(known) if known else math.nan


def _seconds(value: Any) -> str:
    return f"{value:.3f} s" if isinstance(value, int | float) else "–"


def _flat(value: Any, name: str = "") -> list[tuple[str, str]]:
    """A nested document as dotted names and texts."""
    if isinstance(value, dict):
        return [pair for key, item in value.items() for pair in _flat(item, f"{name}.{key}" if name else str(key))]
    if isinstance(value, list) and len(str(value)) > 200:
        return [(name, f"{len(value)} entries")]
    return [(name, str(value))]
