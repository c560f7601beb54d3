"""What a job needs besides its payload, so that another machine can do it: runs, tracks, and the folder that it fills.

console: files ──share──▶ object store, and a `Cargo` in the job's row ──fetch──▶ worker: files, and where they lie
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Self

from racecraft.track import track_names
from racecraft.track.selection import JOINT

SELF: Final = "self"
"""Instead of a run: what the policy itself was."""
TRACK_FILES: Final = (".npy", ".csv")
ROADS: Final = "roads"
"""Inside a worker's state folder: the tracks of others, a folder for each by its content."""
_PLAIN: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._ -]{0,150}")


@dataclass(frozen=True, kw_only=True)
class Cargo:
    """What the object store has for a job."""

    home: str = ""
    """The folder of the runs, as settings on the console's machine name it."""
    runs: tuple[str, ...] = ()
    """Names of the runs that it reads."""
    tracks: dict[str, str] = field(default_factory=dict)
    """SHA-256 of the content of track files, by the paths that settings name."""

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {"home": self.home, "runs": list(self.runs), "tracks": self.tracks}

    @classmethod
    def from_dict(cls, document: dict[str, Any]) -> Self:
        """From what `to_dict` gave, and from the nothing of a job that needs nothing."""
        return cls(
            home=document.get("home", ""), runs=tuple(document.get("runs", ())), tracks=document.get("tracks", {})
        )

    def place_of_track(self, state: Path, path: str) -> Path:
        """Where a track lies on the machine that does the job; its name stays."""
        return state / ROADS / self.tracks[path][:32] / Path(path).name

    def places(self, runs: Path, state: Path) -> dict[str, Path]:
        """Where everything lies on the machine that does the job, by the paths that settings name."""
        return {
            **{str(Path(self.home, name)): runs / name for name in self.runs},
            **{path: self.place_of_track(state, path) for path in self.tracks},
        }


def files_of(*names: str) -> set[str] | None:
    """The files of tracks among what settings name, several joined as in run.json; None where one cannot travel."""
    files = set()
    for path in (part.strip() for name in names if name for part in name.split(JOINT)):
        if path in track_names() or ("/" not in path and "\\" not in path and not Path(path).exists()):
            continue  # of the library or drawn from a seed
        file = Path(path)
        if file.suffix.lower() not in TRACK_FILES or not _PLAIN.fullmatch(file.name) or not file.is_file():
            return None
        files.add(path)
    return files


def rivals_of(settings: dict[str, Any], runs: Path) -> set[str] | None:
    """The runs that a training races against, by its settings as JSON; None where one does not lie in this folder."""
    names = set()
    for driver in (settings.get("opponents") or {}).get("drivers", ()):
        if driver == SELF:
            continue
        if Path(driver).parent != runs.resolve() or not Path(driver, "run.json").is_file():
            return None
        names.add(Path(driver).name)
    return names
