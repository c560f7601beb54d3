"""What pages that are sent around are made of: cars on their road, the racing line, and the very replay file.

recordings -> document in the page -> share.js draws it -> whoever opens it
"""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from typing import Any, Final

import numpy as np

from racecraft.analysis.corners import sectors_of
from racecraft.analysis.svg import racing_line
from racecraft.race.recording import Recording
from racecraft.race.rules import RESET_STATUSES
from racecraft.track import Track

LANGUAGES: Final = ("en", "de")
MAX_REPLAY_BYTES: Final = 4 << 20
"""Of a replay file that is put into a page or a picture; a larger one is left out."""
PLACES: Final = 200
"""Of the road that cars are shown on."""
COLORS: Final = ("#ff7a2f", "#4ea8ff", "#3fc17a", "#e65fa8", "#f2c230", "#9a7cf0", "#35c4c4", "#c9ced6")
"""Of the cars, whoever stands first in the first."""
WORDS: Final[dict[str, dict[str, str]]] = {
    "en": {
        "lap": "Lap time",
        "part": "Share of the lap",
        "medal": "Medal",
        "author": "Author",
        "gold": "Gold",
        "silver": "Silver",
        "bronze": "Bronze",
        "top": "Top speed",
        "speed": "Speed",
        "point": ".",
        "trained": "Trained for",
        "steps": "steps",
        "replay": "The lap",
        "play": "Play or pause",
        "moment": "Moment",
        "above": "From above",
        "follow": "Follow",
        "line": "Racing line",
        "reward": "Reward function",
        "proof": "Proof",
        "proof_lead": "The replay file holds every action. Whoever has Racecraft drives it again, bit by bit:",
        "download": "Save the replay file",
        "heat": "The heat",
        "place": "Place",
        "name": "Model",
        "total": "Time",
        "best": "Best lap",
        "gap": "Behind",
        "winner": "Winner",
        "line_of": "Racing line of",
        "proof_heat": "The replay file holds all cars' actions. Whoever has Racecraft drives it again, bit by bit:",
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
        "speed": "Tempo",
        "point": ",",
        "trained": "Trainiert über",
        "steps": "Schritte",
        "replay": "Die Runde",
        "play": "Abspielen oder anhalten",
        "moment": "Zeitpunkt",
        "above": "Von oben",
        "follow": "Verfolgen",
        "line": "Ideallinie",
        "reward": "Belohnungsfunktion",
        "proof": "Beweis",
        "proof_lead": "Die Replay-Datei enthält jede Aktion. Wer Racecraft hat, fährt sie nach, Bit für Bit:",
        "download": "Replay-Datei sichern",
        "heat": "Der Lauf",
        "place": "Platz",
        "name": "Modell",
        "total": "Zeit",
        "best": "Beste Runde",
        "gap": "Rückstand",
        "winner": "Sieger",
        "line_of": "Ideallinie von",
        "proof_heat": "Die Replay-Datei enthält alle Aktionen. Wer Racecraft hat, fährt sie nach, Bit für Bit:",
        "made": "Trainiert mit Racecraft: Ein kleines Auto lernt auf dem eigenen Rechner, Rennen zu fahren.",
    },
}
"""What the page itself says."""


@dataclass(frozen=True)
class Shown:
    """A car on the road."""

    name: str
    """Whose it is; empty of one that drives alone."""
    drive: Recording
    """What it did, 15 steps a second."""


def words_of(language: str) -> dict[str, str]:
    """The page's own words; English where it has none in a language."""
    return WORDS[language if language in LANGUAGES else "en"]


def number(value: float, digits: int, words: dict[str, str]) -> str:
    """A number as the page's language writes it: 9.274 or 9,274."""
    text = f"{value:,.{digits}f}"
    return text if words["point"] == "." else text.translate(str.maketrans(",.", ".,"))


def script() -> str:
    """What draws the cars."""
    return files("racecraft.analysis").joinpath("share.js").read_text(encoding="utf-8")


def stage(cars: Sequence[Shown], words: dict[str, str], *, heading: str) -> str:
    """Cars on the road of the first of them, all from the same moment on; the camera follows the first."""
    document = {
        **_road(cars[0].drive.track),
        "cars": [_car(car, color) for car, color in zip(cars, COLORS, strict=False)],
    }
    data = json.dumps(document, separators=(",", ":")).replace("<", "\\u003c")
    follow = escape(words["follow"], quote=True)
    choice = "".join(
        f'<button class="car" data-car="{index}" aria-pressed="{str(index == 0).lower()}" aria-label="{follow}: '
        f'{escape(car.name, quote=True)}"><span style="color:{color}">●</span> {escape(car.name)}</button>'
        for index, (car, color) in enumerate(zip(cars, COLORS, strict=False))
    )
    return (
        f"<h2>{escape(heading)}</h2>"
        f'<canvas id="stage" class="stage" role="img" aria-label="{escape(heading, quote=True)}"></canvas>'
        f'<div class="controls"><button id="play" aria-label="{escape(words["play"])}">▶</button>'
        f'<input id="moment" type="range" min="0" step="0.01" value="0" aria-label="{escape(words["moment"])}">'
        f'<span id="clock"></span><button id="view" aria-pressed="false">{escape(words["above"])}</button></div>'
        + (f'<div class="controls">{choice}</div>' if len(cars) > 1 else "")
        + f'<script type="application/json" id="lap">{data}</script>'
    )


def proof(data: bytes, name: str, lead: str, words: dict[str, str]) -> str:
    """A replay file inside the page, and how it is driven again; empty where it is too large for that."""
    if len(data) > MAX_REPLAY_BYTES:
        return ""
    return (
        f"<p>{escape(lead)}</p><pre>racecraft verify {escape(name)}</pre>"
        f'<p><a class="button" download="{escape(name, quote=True)}" '
        f'href="data:application/octet-stream;base64,{base64.b64encode(data).decode()}">{escape(words["download"])}</a></p>'
    )


def _car(car: Shown, color: str) -> dict[str, Any]:
    drive = car.drive
    return {
        "name": car.name,
        "color": color,
        **{name: np.round(values, 3).tolist() for name, values in zip(("x", "y"), drive.origins.T, strict=True)},
        "heading": np.round(drive.column("heading"), 4).tolist(),
        "speed": np.round(drive.column("actual_speed"), 2).tolist(),
    }


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


def line_of(lap: Recording, words: dict[str, str]) -> str:
    """The racing line of a drive, coloured by speed."""
    numbers = [(sector.apex, str(sector.number)) for sector in sectors_of(lap.track) if sector.turn]
    statuses = lap.statuses
    puts = [row + 1 for row, status in enumerate(statuses[:-1]) if status in RESET_STATUSES]
    speeds = lap.column("actual_speed")
    return racing_line(lap.track, lap.origins, speeds, numbers, puts, label=words["line"], point=words["point"])
