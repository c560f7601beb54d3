"""What a run learned with, for its report: stretches, their bands on the curves, checkpoints, reward functions."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any

from racecraft.analysis.report_page import section, table
from racecraft.run import RunFolder, Stretch, best_of, judged_laps, stretch_at


def stretch_table(folder: RunFolder, stretches: Sequence[Stretch]) -> str:
    """The stretches of a training with their best laps; nothing where there is but one."""
    if len(stretches) < 2:
        return ""
    judged = judged_laps(folder)
    rows = []
    for place, stretch in enumerate(stretches):
        own = [one for one in judged if stretch_at(stretches, one.step) is stretch]
        best = best_of(own)
        changes = stretch.changes(stretches[place - 1]) if place else ["the beginning"]
        rows.append(
            [
                str(stretch.number),
                f"{stretch.step:,}",
                ", ".join(changes).replace("_", " "),
                _percent(max((one.completion for one in own if one.completion is not None), default=None)),
                _seconds(best.best_lap if best is not None else None),
            ]
        )
    words = "Each part of the training between two changes, with the best that was driven with it."
    heads = ["Stretch", "From step", "Changed", "Completion", "Best lap"]
    return section("Stretches", f"<p>{words}</p>{table(heads, rows)}")


def checkpoint_table(folder: RunFolder, stretches: Sequence[Stretch]) -> str:
    """The checkpoints that are kept, and which stretch each comes from."""
    store = folder.checkpoints
    best = store.best
    rows = [
        [
            f"{entry.step:,}",
            _percent(entry.metrics.get("completion")),
            _seconds(entry.metrics.get("best_lap_s")),
            str(stretch_at(stretches, entry.step).number),
            "best" if best is not None and entry.step == best.step else "",
        ]
        for entry in store.entries()
    ]
    heads = ["Steps", "Completion", "Best lap", "Stretch", ""]
    return section("Checkpoints", table(heads, rows)) if rows else ""


def rewards(stretches: Sequence[Stretch], now: str) -> list[str]:
    """A section for every reward function that was learned with, the newest first; `now` is the one on disk."""
    sources: dict[str, list[int]] = {}
    for stretch in stretches:
        sources.setdefault(stretch.reward_function, []).append(stretch.number)
    sources.setdefault(now, [])
    found = []
    for source, numbers in sorted(sources.items(), key=lambda item: (item[0] == now, item[1]), reverse=True):
        title = "Reward function"
        if len(sources) > 1:
            title += f" of stretch {', '.join(map(str, numbers))}" if numbers else ", not trained with yet"
        found.append(section(title, f'<pre class="code"><code>{escape(source)}</code></pre>'))
    return found


def bands(
    stretches: Sequence[Stretch], points: Sequence[dict[str, Any]], unit: float
) -> list[tuple[float, float, str]]:
    """Where each stretch lies on an axis of seconds over `unit`; nothing where there is but one."""
    if len(stretches) < 2:
        return []
    found: list[tuple[float, float, str]] = []
    for stretch in stretches:
        times = [
            float(point["seconds"]) / unit
            for point in points
            if isinstance(point.get("step"), int)
            and isinstance(point.get("seconds"), int | float)
            and stretch_at(stretches, point["step"]) is stretch
        ]
        if times:
            found.append((found[-1][1] if found else times[0], times[-1], f"Stretch {stretch.number}"))
    return found


def _seconds(value: float | None) -> str:
    return f"{value:.3f} s" if value is not None else "–"


def _percent(value: float | None) -> str:
    return f"{100 * value:.0f} %" if value is not None else "–"
