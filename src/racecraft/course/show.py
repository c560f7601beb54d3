"""Pictures and animations of a lesson: shown in a notebook, saved beside the run of a script."""

from __future__ import annotations

import base64
import io
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.errors import ConfigError

if TYPE_CHECKING:
    from PIL import Image


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
        The file; None in a notebook.

    Raises:
        ConfigError: The name is not one of a file.
    """
    if not re.fullmatch(r"[\w-]+", name):
        raise ConfigError(f"A picture's name is {name!r}; allowed are letters, digits, - and _.")
    shell = sys.modules.get("IPython")
    if shell is not None and shell.get_ipython() is not None:
        import_module("IPython.display").display(picture)
        return None
    folder = Path("runs") / (Path(sys.argv[0]).stem or "lesson")
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}{picture.suffix}"
    path.write_bytes(picture.encoded())
    sys.stdout.write(f"[picture: {path}]\n")
    return path
