"""`racecraft perceive`: pictures looked at, told and painted, a few at a time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice
from os import PathLike
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.checks import check_type, require
from racecraft.errors import ConfigError, RunError
from racecraft.film.encoding import write_video
from racecraft.perceiving.painting import paint
from racecraft.perceiving.reading import is_sequence, rate_of, read_pictures
from racecraft.perception.network import Perceiver
from racecraft.perception.telling import tell
from racecraft.perception.watching import Watcher

TOGETHER: Final = 64
"""Pictures that are looked at, and kept in memory, together."""
UNKNOWN: Final = (np.nan, np.nan)
"""Commands of a video's pictures."""


def perceive(
    sources: str | Path | Sequence[str | Path],
    *,
    output: str | Path | None = None,
    perceiver: Perceiver | None = None,
    num_threads: int = 0,
) -> list[dict[str, Any]]:
    """Look at pictures. Those of a video, replay or run are in order, and looked at with those before in mind.

    Of a replay or run it is known, too, what the car was told.

    Args:
        sources: Files, folders, a video, a replay or a run; or one of them alone.
        output: Where to paint what is believed: of a single video, replay or run a video ending in ``.mp4``, otherwise
            a folder of PNGs; None paints nothing.
        perceiver: Who looks; by default with the weights that the package brings along.
        num_threads: 0 takes every core.

    Returns:
        What `tell` says of every picture, in order.

    Raises:
        ConfigError: A source is not something to look at, or no film and to be painted as one.
        RunError: The painted pictures cannot be written.
    """
    sources = [sources] if isinstance(sources, str | PathLike) else sources
    is_list = isinstance(sources, Sequence) and all(isinstance(source, str | PathLike) for source in sources)
    require("sources", sources, is_list, "a path, or a list of several")
    if output is not None:
        check_type("output", output, (str, PathLike), "use a path")
        output = Path(output)
    looker = perceiver or Perceiver(num_threads=num_threads)
    told: list[dict[str, Any]] = []
    if output is None:
        for _ in _looked_at(looker, sources, told, paints=False):
            pass
    elif output.suffix.lower() == ".mp4":
        if not is_sequence(sources):
            raise ConfigError(
                f"{output} would be a film of what is none: that is for a single video, replay or run.",
                hint="Name a folder for painted pictures.",
            )
        (film,) = map(Path, sources)
        if output.exists() and output.samefile(film):
            raise ConfigError(f"{output} is the film that is looked at.", hint="Paint it to another file.")
        write_video((pixels for _, pixels in _looked_at(looker, sources, told)), output, rate=rate_of(film))
    else:
        _write_pictures(_looked_at(looker, sources, told), output)
    return told


def _looked_at(
    perceiver: Perceiver, sources: Sequence[str | Path], told: list[dict[str, Any]], *, paints: bool = True
) -> Iterator[tuple[str, NDArray[np.uint8]]]:
    """Name of the file and painted picture, one after the other; `told` grows with them."""
    pictures, watcher = read_pictures(sources), Watcher(perceiver)
    while some := list(islice(pictures, TOGETHER)):
        seen = np.stack([picture.seen for picture in some])
        is_first = np.array([picture.is_first for picture in some])
        is_of_film = np.array([picture.is_of_film for picture in some])
        commands = np.array([picture.commands or UNKNOWN for picture in some], np.float32)
        belief = watcher.film(seen, is_first, is_of_film, commands)
        for index, picture in enumerate(some):
            told.append(tell(picture.file, belief, index))
            yield picture.stem, paint(picture.shown, belief, index) if paints else picture.shown


def _write_pictures(painted: Iterator[tuple[str, NDArray[np.uint8]]], folder: Path) -> None:
    from PIL import Image

    try:
        for number, (name, pixels) in enumerate(painted):
            folder.mkdir(parents=True, exist_ok=True)
            Image.fromarray(pixels).save(folder / f"{number:05d}-{name}.png")
    except OSError as error:
        raise RunError(f"{folder} cannot be written: {error.strerror or error}.") from error
