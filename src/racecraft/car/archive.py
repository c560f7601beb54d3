"""The archive that is put on a car: one graph and its metadata in a ``.tar.gz``, the same bytes for the same model.

The car looks for exactly one ``.pb``, wherever it lies, and for ``model_metadata.json`` at the root; it cuts the
archive's name at the first dot and makes ``_`` of spaces. AWS's console puts the graph into ``agent/``.
"""

from __future__ import annotations

import gzip
import io
import json
import re
import tarfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from racecraft.errors import ConfigError

ENDING: Final = ".tar.gz"
GRAPH: Final = "agent/model.pb"
METADATA: Final = "model_metadata.json"
_NAME: Final = re.compile(r"[A-Za-z0-9_-]{1,64}")


def archive_name(run: str) -> str:
    """A file name for a run's archive that a car takes as it is."""
    return (re.sub(r"[^A-Za-z0-9_-]", "-", run)[:64] or "model") + ENDING


def check_archive_name(path: Path) -> None:
    """Refuse a name that a car would change or not take.

    Raises:
        ConfigError: It has another ending, or characters that the car cuts off or replaces.
    """
    if not path.name.endswith(ENDING):
        raise ConfigError(f"The archive is to be called {path.name!r}; a car takes only names that end in {ENDING}.")
    if not _NAME.fullmatch(path.name.removesuffix(ENDING)):
        raise ConfigError(
            f"The archive is to be called {path.name!r}; a car cuts names at the first dot and replaces spaces: "
            "use 1 to 64 letters, digits, - and _."
        )


def car_archive(graph: bytes, metadata: Mapping[str, Any]) -> bytes:
    """The archive's content."""
    packed = io.BytesIO()
    with (
        gzip.GzipFile(filename="", fileobj=packed, mode="wb", compresslevel=1, mtime=0) as zipped,  # weights: noise
        tarfile.open(mode="w", fileobj=zipped, format=tarfile.USTAR_FORMAT) as tar,
    ):
        text = json.dumps(metadata, indent=2, allow_nan=False) + "\n"
        for name, data in ((METADATA, text.encode()), (GRAPH, graph)):
            member = tarfile.TarInfo(name)
            member.size, member.mode = len(data), 0o644
            tar.addfile(member, io.BytesIO(data))
    return packed.getvalue()
