"""What a picture to send around has beyond the racing line: the reward in letters below it, the replay file inside."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from racecraft.analysis.share_page import MAX_REPLAY_BYTES
from racecraft.errors import RunError
from racecraft.film.racing_line import draw_racing_line
from racecraft.race.recording import Recording
from racecraft.replay.in_picture import CHUNK
from racecraft.track.canvas import Canvas, text_width
from racecraft.track.road_art import INK, PAPER, SOFT_INK

if TYPE_CHECKING:
    from PIL import Image

MOST_LINES: Final = 60
"""Of a reward that are drawn; the rest is told by three dots, and stands whole in the picture's own text."""


def draw_line(
    drive: Recording,
    path: Path,
    *,
    title: str,
    subtitle: str,
    figures: Sequence[tuple[str, str]],
    words: Mapping[str, str],
) -> None:
    """The racing line of a drive, with nothing in letters but what is given: see `draw_racing_line`."""
    draw_racing_line(
        drive,
        path,
        title=title,
        subtitle=subtitle,
        figures=figures,
        has_own_figures=False,
        speed=words["speed"].upper(),
        point=words["point"],
    )


def finish_picture(path: Path, heading: str, reward: str, *, replay: bytes) -> Path:
    """Draw a reward function below a picture, and put it and the replay file into the file.

    Args:
        path: A PNG picture, written anew.
        heading: What stands above the reward; nothing is drawn where ``reward`` is empty.
        reward: Source of the function.
        replay: The replay file; left out where it is too large.

    Raises:
        RunError: The picture cannot be written.
    """
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    info = PngInfo()
    if reward:
        info.add_itxt("Description", reward)
    if len(replay) <= MAX_REPLAY_BYTES:
        info.add(CHUNK, replay)
    try:
        with Image.open(path) as opened:
            picture = opened.convert("RGB")
        if reward:
            below = _letters(picture.width, heading, reward)
            whole = Image.new("RGB", (picture.width, picture.height + below.height))
            whole.paste(picture, (0, 0))
            whole.paste(below, (0, picture.height))
            picture = whole
        picture.save(path, pnginfo=info, optimize=True)
    except OSError as error:
        raise RunError(f"{path} cannot be written: {error.strerror or error}.") from error
    return path


def _letters(width_px: int, heading: str, source: str) -> Image.Image:
    """The source on paper, its lines cut where the paper ends."""
    unit = width_px / 100.0
    size, left, room = 1.25 * unit, 5.0 * unit, 90.0 * unit
    lines = source.rstrip().expandtabs(4).split("\n")
    if len(lines) > MOST_LINES:
        lines = [*lines[:MOST_LINES], "…"]
    step = 1.55 * size
    height = round(6.5 * unit + step * len(lines))
    canvas = Canvas((width_px, height), scale=1.0, origin=(0.0, 0.0), background=PAPER)
    canvas.text((left, 2.2 * unit), heading.upper(), SOFT_INK, size=0.95 * unit, spacing=0.12, weight=0.01)
    for row, line in enumerate(lines):
        text = line.lstrip()
        indent = 0.55 * size * (len(line) - len(text))
        canvas.text((left + indent, 4.6 * unit + step * row), _cut(text, size, room - indent), INK, size=size)
    return canvas.finish()


def _cut(text: str, size: float, room: float) -> str:
    """A line that ends where there is no more room."""
    text = "".join(letter if letter.isprintable() else "?" for letter in text[:400])
    if text_width(text, size=size) <= room:
        return text
    # The most letters that leave room for the dots; by halving, as measuring one more costs what all before it do.
    kept = bisect_right(range(1, len(text) + 1), room, key=lambda count: text_width(text[:count] + "…", size=size))
    return text[:kept] + "…"
