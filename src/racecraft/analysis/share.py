"""`share`: an evaluation's best lap on one HTML page to be sent around: it opens offline, and the replay is inside.

    evaluation.replay -> best lap -> figures and medal, the lap (share.js), racing line, reward, the file itself

Who gets it can watch the lap, read the reward, and check every bit of it with `racecraft verify`.
"""

from __future__ import annotations

import base64
import json
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

import numpy as np

from racecraft.analysis.corners import sectors_of
from racecraft.analysis.report_page import page, section
from racecraft.analysis.svg import racing_line
from racecraft.errors import RunError
from racecraft.film.racing_line import draw_racing_line
from racecraft.json_file import read_json_object
from racecraft.limits import known_limit
from racecraft.race.recording import Recording
from racecraft.race.rules import RESET_STATUSES
from racecraft.replay.replay import Replay, read_replay
from racecraft.run import RunFolder, read_stretches, stretch_at
from racecraft.run.atomic import write_file
from racecraft.track import Track
from racecraft.track.picture import describe

LANGUAGES: Final = ("en", "de")
MAX_REPLAY_BYTES: Final = 4 << 20
"""Of a replay file that is put into the page; a larger one is left out."""
PLACES: Final = 200
"""Of the road that the lap is shown on."""
_WORDS: Final[dict[str, dict[str, str]]] = {
    "en": {
        "lap": "Lap time",
        "part": "Share of the lap",
        "medal": "Medal",
        "author": "Author",
        "gold": "Gold",
        "silver": "Silver",
        "bronze": "Bronze",
        "top": "Top speed",
        "trained": "Trained for",
        "steps": "steps",
        "replay": "The lap",
        "play": "Play or pause",
        "moment": "Moment",
        "above": "From above",
        "line": "Racing line",
        "reward": "Reward function",
        "proof": "Proof",
        "proof_lead": "The replay file holds every action. Whoever has Racecraft drives it again, bit by bit:",
        "download": "Save the replay file",
        "made": "Trained with Racecraft: a small car learns to race on one's own machine.",
    },
    "de": {
        "lap": "Rundenzeit",
        "part": "Anteil der Runde",
        "medal": "Medaille",
        "author": "Autor",
        "gold": "Gold",
        "silver": "Silber",
        "bronze": "Bronze",
        "top": "Höchstgeschwindigkeit",
        "trained": "Trainiert über",
        "steps": "Schritte",
        "replay": "Die Runde",
        "play": "Abspielen oder anhalten",
        "moment": "Zeitpunkt",
        "above": "Von oben",
        "line": "Ideallinie",
        "reward": "Belohnungsfunktion",
        "proof": "Beweis",
        "proof_lead": "Die Replay-Datei enthält jede Aktion. Wer Racecraft hat, fährt sie nach, Bit für Bit:",
        "download": "Replay-Datei sichern",
        "made": "Trainiert mit Racecraft: Ein kleines Auto lernt auf dem eigenen Rechner, Rennen zu fahren.",
    },
}


def write_share(run: str | Path, path: str | Path | None = None, *, stamp: str = "", language: str = "en") -> Path:
    """Write the page of a run's evaluation.

    Args:
        run: The run folder.
        path: Where to; by default ``share.html`` in the run folder.
        stamp: Of the evaluation; by default the newest.
        language: ``en`` or ``de``.

    Raises:
        RunError: There is no evaluation with a replay, or the file cannot be written.
    """
    folder = RunFolder.open(run)
    if not stamp:
        found = sorted(folder.path.glob("evaluation-*/evaluation.json"))
        if not found:
            raise RunError(f"{folder.name} has no evaluation to share.", hint=f"racecraft evaluate {folder.path}")
        stamp = found[-1].parent.name.removeprefix("evaluation-")
    target = Path(path) if path is not None else folder.path / "share.html"
    text = share(folder, stamp, language=language)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        write_file(target, text.encode())
    except OSError as error:
        raise RunError(f"{target} cannot be written: {error.strerror or error}.") from error
    return target


def share(folder: RunFolder, stamp: str, *, language: str = "en") -> str:
    """The best lap of an evaluation as one HTML text; without a whole lap, the drive that came furthest.

    Raises:
        RacecraftError: There is no such evaluation, or its files cannot be read.
    """
    replay, lap = _driven(folder, stamp)
    words = _WORDS[language if language in LANGUAGES else "en"]
    track, step = lap.track, _step(folder, stamp)
    title, _ = describe(track)
    figures = [(what, value, "") for what, value in _figures(replay, lap, words)]
    if step:
        figures.append((words["trained"], f"{step:,} {words['steps']}", ""))
    sections = [
        section(words["line"], _line(lap)),
        section(words["reward"], f"<pre>{escape(_reward(folder, step))}</pre>"),
        section(words["proof"], _proof(folder, stamp, words)),
    ]
    return page(
        folder.name,
        f"{escape(title)} · {escape(words['made'])}",
        figures,
        _stage(lap, words),
        sections,
        versions=folder.read_info().versions,
        script=files("racecraft.analysis").joinpath("share.js").read_text(encoding="utf-8"),
        language=language if language in LANGUAGES else "en",
    )


def draw_share(folder: RunFolder, stamp: str, path: Path, *, language: str = "en") -> Path:
    """The same lap as a picture: racing line, time, medal.

    Raises:
        RacecraftError: There is no such evaluation, or the picture cannot be written.
    """
    replay, lap = _driven(folder, stamp)
    words = _WORDS[language if language in LANGUAGES else "en"]
    title, _ = describe(lap.track)
    won = _medal(replay, lap)
    medal = [(words["medal"].upper(), words[won])] if won else []
    return draw_racing_line(lap, path, title=folder.name, subtitle=title, figures=medal)


def _driven(folder: RunFolder, stamp: str) -> tuple[Replay, Recording]:
    path = folder.evaluation(stamp) / "evaluation.replay"
    if not (stamp.isascii() and stamp.isdigit()) or not path.is_file():
        raise RunError(f"{folder.name} has no evaluation {stamp[:40]!r} with a replay.", hint="Evaluate it once more.")
    replay = read_replay(path)
    whole = [
        (seconds, index, number)
        for index, car in enumerate(replay.cars)
        for number, seconds in car.recording.lap_times.items()
    ]
    if whole:
        _, index, number = min(whole)
        return replay, replay.cars[index].recording.lap(number)
    return replay, replay.evaluation.best_trial.recording


def _figures(replay: Replay, lap: Recording, words: dict[str, str]) -> list[tuple[str, str]]:
    times = list(lap.lap_times.values())
    if not times:
        found = [(words["part"], f"{100 * float(lap.column('progress').max(initial=0.0)):.0f} %")]
    else:
        found = [(words["lap"], f"{times[0]:.3f} s")]
        if medal := _medal(replay, lap):
            found.append((words["medal"], words[medal]))
    return [*found, (words["top"], f"{float(lap.column('actual_speed').max()):.2f} m/s")]


def _medal(replay: Replay, lap: Recording) -> str:
    limit, times = known_limit(lap.track, replay.conditions.vehicle), list(lap.lap_times.values())
    return limit.medals.won_by(times[0]) if limit is not None and times else ""


def _stage(lap: Recording, words: dict[str, str]) -> str:
    speed = lap.column("actual_speed")
    document = {
        **_road(lap.track),
        **{name: np.round(values, 3).tolist() for name, values in zip(("x", "y"), lap.origins.T, strict=True)},
        "heading": np.round(lap.column("heading"), 4).tolist(),
        "speed": np.round(speed, 2).tolist(),
    }
    data = json.dumps(document, separators=(",", ":")).replace("<", "\\u003c")
    return (
        f"<h2>{escape(words['replay'])}</h2>"
        f'<canvas id="stage" class="stage" role="img" aria-label="{escape(words["replay"])}"></canvas>'
        f'<div class="controls"><button id="play" aria-label="{escape(words["play"])}">▶</button>'
        f'<input id="moment" type="range" min="0" step="0.01" value="0" aria-label="{escape(words["moment"])}">'
        f'<span id="clock"></span><button id="view" aria-pressed="false">{escape(words["above"])}</button></div>'
        f'<script type="application/json" id="lap">{data}</script>'
    )


def _road(track: Track) -> dict[str, Any]:
    """The edges of the road at places along it, every 20 cm at the closest, m."""
    count = int(min(max(track.length / 0.2, 24), PLACES))
    places = np.linspace(0.0, track.length, count, endpoint=not track.is_closed)
    middle, heading, half = track.point_at(places), track.heading_at(places), 0.5 * track.width_at(places)
    left = np.column_stack([-np.sin(heading), np.cos(heading)]) * half[:, None]
    return {
        "closed": track.is_closed,
        "inner": np.round(middle + left, 3).tolist(),
        "outer": np.round(middle - left, 3).tolist(),
    }


def _line(lap: Recording) -> str:
    numbers = [(sector.apex, str(sector.number)) for sector in sectors_of(lap.track) if sector.turn]
    statuses = lap.statuses
    puts = [row + 1 for row, status in enumerate(statuses[:-1]) if status in RESET_STATUSES]
    return racing_line(lap.track, lap.origins, lap.column("actual_speed"), numbers, puts)


def _step(folder: RunFolder, stamp: str) -> int:
    step = read_json_object(folder.evaluation(stamp) / "evaluation.json").get("step")
    return step if isinstance(step, int) and not isinstance(step, bool) else 0


def _reward(folder: RunFolder, step: int) -> str:
    """What the policy that drove had learned with last."""
    stretches = read_stretches(folder)
    return stretch_at(stretches, step).reward_function if stretches else folder.read_reward_function()


def _proof(folder: RunFolder, stamp: str, words: dict[str, str]) -> str:
    data = (folder.evaluation(stamp) / "evaluation.replay").read_bytes()
    if len(data) > MAX_REPLAY_BYTES:
        return ""
    name = f"{folder.name}.replay"
    return (
        f"<p>{escape(words['proof_lead'])}</p><pre>racecraft verify {escape(name)}</pre>"
        f'<p><a class="button" download="{escape(name, quote=True)}" '
        f'href="data:application/octet-stream;base64,{base64.b64encode(data).decode()}">{escape(words["download"])}</a></p>'
    )
