"""What the reward function prints while a run trains, as ``logs/reward.log`` in the run folder.

The last few megabytes are kept: a function that prints in every call writes that much in seconds.
"""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO, Final

from racecraft.errors import RunError, printable
from racecraft.run.closing import Closing

MAX_BYTES: Final = 4 * 2**20
"""Of one file; a full one becomes ``reward.1.log`` and the one before is gone."""


class PrintLog(Closing):
    """Appends text to a file that is made with the first of it; a context manager.

    Args:
        path: The file; a resumed run goes on with it.
        max_bytes: Its size, at most; there are two such files.
    """

    def __init__(self, path: str | Path, *, max_bytes: int = MAX_BYTES) -> None:
        self.path = Path(path)
        self.max_bytes = max_bytes
        self._file: BinaryIO | None = None
        self._size = 0

    @property
    def older(self) -> Path:
        """Where a full file goes."""
        return self.path.with_suffix(".1.log")

    def write(self, text: str, *, lost: int = 0) -> None:
        """Append, without what could drive the terminal in which somebody reads it.

        Args:
            text: What was printed; a stranger's reward function prints what it likes.
            lost: How many bytes were printed before it, and were not kept.

        Raises:
            RunError: The disk does not take it.
        """
        data = "\n".join(map(_harmless, text.split("\n"))).encode()
        if lost:
            data = f"\n[{lost:,} bytes printed here were too many at once and are not kept]\n".encode() + data
        if not data:
            return
        try:
            if self._file is not None and self._size + len(data) > self.max_bytes:
                self.close()
                self.path.replace(self.older)
            if self._file is None:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                self._file = self.path.open("ab", buffering=0)
                self._size = self._file.tell()
            self._file.write(data[-self.max_bytes :])
            self._size += len(data)
        except OSError as error:
            raise RunError(f"{self.path} cannot be written: {error.strerror or error}.") from error

    def close(self) -> None:
        """Finish the file; calling again does nothing."""
        if self._file is not None:
            self._file.close()
            self._file = None


def _harmless(line: str) -> str:
    return "\t".join(map(printable, line.split("\t")))
