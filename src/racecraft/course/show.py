"""Pictures and animations of a lesson: shown in a notebook, saved beside the run of a script."""

from __future__ import annotations

import base64
import io
import re
import sys
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Final

from racecraft.course.phrases import learner_language, said_in
from racecraft.errors import ConfigError

if TYPE_CHECKING:
    from PIL import Image

NOT_KEPT: Final = "The picture {} cannot be kept: {}."
"""Of a script: the file, and why."""


@dataclass(frozen=True)
class Picture:
    """One image, or the images of an animation."""

    frames: Sequence[Image.Image]
    seconds: float = 0.1
    """That each image of an animation stands."""
    description: str = ""
    """For those who cannot see it."""
    words: Sequence[str] = ()
    """What is written on it, in English."""

    @property
    def suffix(self) -> str:
        """``.png``, of an animation ``.webp``."""
        return ".png" if len(self.frames) == 1 else ".webp"

    def encoded(self) -> bytes:
        """The file's content."""
        file = io.BytesIO()
        if len(self.frames) == 1:
            self.frames[0].save(file, "PNG", optimize=True)
        else:
            first, *rest = self.frames
            milliseconds = round(1000 * self.seconds)
            first.save(
                file, "WEBP", save_all=True, append_images=rest, duration=milliseconds, loop=0, quality=80, method=2
            )
        return file.getvalue()

    def _repr_html_(self) -> str:
        """For a notebook."""
        kind, data = self.suffix[1:], base64.b64encode(self.encoded()).decode()
        words = self.description.replace('"', "'")
        return f'<img alt="{words}" style="max-width: 100%" src="data:image/{kind};base64,{data}">'


def show(picture: Picture, name: str) -> Path | None:
    """Show a picture: in a notebook below the cell, otherwise as a file in ``runs/`` and the script's name.

    Args:
        picture: What to show.
        name: Of the file, without its ending.

    Returns:
        The file; None in a notebook, and where it cannot be written.

    Raises:
        ConfigError: The name is not one of a file, or there can be no folder for it. A full disk only costs the
            picture: the lesson goes on, with a warning.
    """
    if not re.fullmatch(r"[\w-]+", name):
        raise ConfigError(f"A picture's name is {name!r}; allowed are letters, digits, - and _.")
    shell = sys.modules.get("IPython")
    if shell is not None and shell.get_ipython() is not None:
        import_module("IPython.display").display(picture)
        return None
    path = picture_folder(Path(sys.argv[0]).stem or "lesson") / f"{name}{picture.suffix}"
    try:
        path.write_bytes(picture.encoded())
    except OSError as error:
        told = NOT_KEPT.format(path, error.strerror or error)
        warnings.warn(said_in(learner_language(), told), stacklevel=2)
        return None
    sys.stdout.write(f"[picture: {path}]\n")
    return path


def picture_folder(script: str) -> Path:
    """Where the pictures of a script go, by its name; made where it is missing.

    Raises:
        ConfigError: It cannot be made.
    """
    folder = Path("runs") / script
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"The folder {folder} for pictures cannot be made: {error.strerror or error}.") from error
    return folder
