"""The run folder: everything about one model, in AWS's layout where AWS has one.

runs/<name>/run.json                      what is needed to repeat the run
            reward_function.py  model_metadata.json  hyperparameters.json  training_params.yaml
            race_rules.json               rules of its evaluations, where it has its own
            metrics/                      TrainingMetrics.json, EvaluationMetrics-<time>.json, curves and laps (jsonl)
            training-simtrace/            <iteration>-iteration.csv
            evaluation-<time>/            evaluation-simtrace/, pictures
            mp4/  events/                 videos, TensorBoard
            model/  ip/                   for AWS's tools: index of checkpoints, metadata; hyperparameters
            checkpoints/                  weights, see racecraft.run.checkpoint
            stretches/                    what it learned with from which step on, see racecraft.run.stretches
            notes.md                      what people wrote about it
            parent/                       weights it began with, where another run gave them
            logs/                         reward.log: what the reward function printed
"""

from __future__ import annotations

import os
import platform
import re
import time
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime, timedelta
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.checks import check_path, check_type, shown
from racecraft.errors import ConfigError, RunError, did_you_mean, quoted, typed
from racecraft.json_file import read_json_object, read_text
from racecraft.moved import place_of
from racecraft.run.atomic import write_file, write_json
from racecraft.run.checkpoint import CheckpointStore
from racecraft.run.lock import exclusive_lock
from racecraft.run.starters import STARTER, unpack_starter
from racecraft.version import VERSION

if TYPE_CHECKING:
    from racecraft.agent import Hyperparameters, ModelMetadata
    from racecraft.run.training_params import TrainingParams

FORMAT = 1
MAX_NAME = 64  # characters, as in AWS's console
MAX_REWARD_BYTES = 4 * 140_000  # AWS allows 140,000 characters
MAX_NOTES_BYTES = 1 << 16
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)  # devices on Windows

_OF_AWS = ("model_metadata.json", "reward_function.py", "run.env")
"""Files that tell a folder that can be imported."""
_ARCHIVES = (".tar.gz", ".tgz", ".tar", ".zip")


@dataclass(frozen=True)
class RunInfo:
    """The content of ``run.json``: with the files beside it, all that is needed to repeat a run."""

    seed: int
    """Seed of every random number of the run."""
    track: str
    """Name or path of the track."""
    track_digest: str
    """SHA-256 of its geometry, which the name alone does not fix."""
    settings: dict[str, Any] = field(default_factory=dict)
    """Every other setting, as JSON."""
    created: str = field(default_factory=lambda: datetime.now(UTC).isoformat(timespec="seconds"))
    """When the run began, ISO 8601 in UTC."""
    versions: dict[str, str] = field(default_factory=lambda: _versions())
    """Versions of what may change the result, and the machine."""
    parent: dict[str, Any] | None = None
    """The run, step and file of the checkpoint it began from, if it did."""
    foreign: bool = False
    """Whether the reward function is somebody else's: it was imported, or comes from a run that was."""


@dataclass(frozen=True)
class RunFolder:
    """One run on disk; `create` makes a new one, `open` finds an old one."""

    path: Path

    @classmethod
    def create(cls, root: str | Path, *, name: str | None = None, prefix: str = "run") -> RunFolder:
        """Make a new folder.

        Args:
            root: Folder of all runs, made when missing.
            name: 1 to 64 letters, digits, dots, hyphens and underscores; made from prefix and time if None.
            prefix: Anything; a track's name, say.

        Raises:
            RunError: The name is not allowed or taken, or the folder cannot be made.
            ConfigError: The name is no text, or the root no path.
        """
        check_path("root", root, "use a folder's path")
        root = Path(root)
        if name is not None:
            names = [checked_name(name)]
        else:
            stem = f"{sanitize_name(prefix)[:40]}-{time.strftime('%Y%m%d-%H%M%S')}"
            names = [stem, *(f"{stem}-{count}" for count in range(2, 1000))]
        try:
            root.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RunError(f"{root} cannot be made: {error.strerror or error}.") from error
        for candidate in names:
            path = root / candidate
            try:
                path.mkdir()
            except FileExistsError:
                continue
            except OSError as error:
                raise RunError(f"{path} cannot be made: {error.strerror or error}.") from error
            return cls(path)
        raise RunError(f"{root / names[0]} exists.", hint="Choose another name, or continue it with --resume.")

    @classmethod
    def open(cls, path: str | Path) -> RunFolder:
        """Find a run by its folder, or a starter as ``starter:quick``, which is put into ``runs/`` first.

        Raises:
            RunError: There is none, or it holds no run.
            ConfigError: It is no path.
        """
        check_type("run", path, (str, Path), "use the path of a run's folder, such as 'runs/NAME'")
        if str(path).startswith(STARTER):
            path = unpack_starter(str(path).removeprefix(STARTER), "runs")
        path = place_of(path)
        hint = f"racecraft import {typed(path)} makes a run of a model of AWS's."
        if not os.path.isdir(path):  # False of names too long for one, too
            if path.name.endswith(_ARCHIVES) and os.path.isfile(path):
                raise RunError(f"{shown(str(path))} is an archive, not a run's folder.", hint=hint)
            siblings = [run.path.name for run in list_runs(path.parent)]
            meant = path.name.partition("@")[0]  # a whole run is asked for where somebody names a checkpoint
            raise RunError(f"There is no run {shown(str(path))}.", hint=did_you_mean(meant, siblings))
        if not (path / "run.json").is_file():
            if not any((path / name).is_file() for name in _OF_AWS):
                inside = list_runs(path)
                hint = f"It is a folder of runs: name one of them, such as {typed(inside[0].path)}." if inside else ""
            raise RunError(f"{path} holds no run: run.json is missing.", hint=hint)
        return cls(path)

    @property
    def name(self) -> str:
        """The folder's name, also of the one that somebody works in."""
        return self.path.absolute().name

    @property
    def reward_function(self) -> Path:
        """The reward function's source."""
        return self.path / "reward_function.py"

    @property
    def model_metadata(self) -> Path:
        """Action space, sensors, network."""
        return self.path / "model_metadata.json"

    @property
    def hyperparameters(self) -> Path:
        """AWS's hyperparameters, where the run has them."""
        return self.path / "hyperparameters.json"

    @property
    def aws_model_metadata(self) -> Path:
        """Where AWS's tools look for action space, sensors, network."""
        return self.path / "model" / "model_metadata.json"

    @property
    def aws_hyperparameters(self) -> Path:
        """Where AWS's tools look for hyperparameters; here also those of a run that does not follow AWS."""
        return self.path / "ip" / "hyperparameters.json"

    @property
    def training_params(self) -> Path:
        """AWS's settings of the training job."""
        return self.path / "training_params.yaml"

    @property
    def race_rules(self) -> Path:
        """The rules of its evaluations, where it has its own."""
        return self.path / "race_rules.json"

    @property
    def training_metrics(self) -> Path:
        """Every episode's result."""
        return self.path / "metrics" / "TrainingMetrics.json"

    @property
    def history(self) -> Path:
        """The curves, see racecraft.run.history."""
        return self.path / "metrics" / "history.jsonl"

    @property
    def evolution(self) -> Path:
        """Laps driven while it learned, see racecraft.run.evolution."""
        return self.path / "metrics" / "evolution.jsonl"

    @property
    def training_simtrace(self) -> Path:
        """Every step of training, a file per iteration."""
        return self.path / "training-simtrace"

    @property
    def videos(self) -> Path:
        """MP4 files."""
        return self.path / "mp4"

    @property
    def events(self) -> Path:
        """TensorBoard's files."""
        return self.path / "events"

    @property
    def reward_log(self) -> Path:
        """What the reward function printed; made with the first of it."""
        return self.path / "logs" / "reward.log"

    @property
    def notes(self) -> Path:
        """What people wrote about it; made with the first word."""
        return self.path / "notes.md"

    @property
    def checkpoints(self) -> CheckpointStore:
        """Weights, with AWS's index of them in ``model/``."""
        return CheckpointStore(self.path / "checkpoints", aws_index=self.path / "model" / "deepracer_checkpoints.json")

    @property
    def stretches(self) -> Path:
        """What it learned with, a file for every change, see racecraft.run.stretches."""
        return self.path / "stretches"

    @property
    def parent_checkpoint(self) -> CheckpointStore:
        """A copy of the weights the run began with, where another run gave them."""
        return CheckpointStore(self.path / "parent", keep=1)

    def evaluation(self, stamp: str) -> Path:
        """Folder of the evaluation begun at ``stamp`` (YYYYmmddHHMMSS)."""
        return self.path / f"evaluation-{stamp}"

    def evaluation_replay(self, stamp: str) -> Path:
        """Every trial of that evaluation, to be shown and driven again."""
        return self.evaluation(stamp) / "evaluation.replay"

    def new_evaluation(self) -> tuple[str, Path]:
        """Make the folder of an evaluation that begins now; its time stamp and its path."""
        return dated_folder(self.path, prefix="evaluation-")

    def evaluation_metrics(self, stamp: str) -> Path:
        """Results of that evaluation."""
        return self.path / "metrics" / f"EvaluationMetrics-{stamp}.json"

    def lock(self) -> AbstractContextManager[None]:
        """Keep others from writing to this run during a ``with`` block; RunError when it is in use."""
        return exclusive_lock(self.path / ".lock")

    def write_info(self, info: RunInfo) -> None:
        """Write ``run.json``."""
        self._write(self.path / "run.json", {"format": FORMAT, **asdict(info)})

    def read_info(self) -> RunInfo:
        """Read ``run.json``.

        Raises:
            RunError: It is missing, damaged or of a later version.
        """
        path = self.path / "run.json"
        try:
            document = read_json_object(path)
            if document.pop("format") != FORMAT:
                raise RunError(f"{path} was written by another version of Racecraft.", hint="Update Racecraft.")
            info = RunInfo(**document)
            for name, kind in (
                ("seed", int),
                ("track", str),
                ("track_digest", str),
                ("settings", dict),
                ("created", str),
                ("versions", dict),
                ("parent", dict | None),
                ("foreign", bool),
            ):
                if not isinstance(getattr(info, name), kind):
                    raise TypeError(f"{name} in run.json is {getattr(info, name)!r}.")
            return info
        except (ConfigError, KeyError, TypeError) as error:
            raise RunError(f"{self.path} cannot be opened: {error}") from error

    def write_inputs(
        self,
        *,
        reward_function: str,
        model_metadata: ModelMetadata,
        hyperparameters: Hyperparameters | None = None,
        training_params: TrainingParams | None = None,
        equivalent: Mapping[str, Any] | None = None,
    ) -> None:
        """Write what the run is made from, each in AWS's file, and once more where AWS's tools look for it.

        `equivalent` are the settings of a run without hyperparameters, by AWS's names: for tools, never read back.
        """
        self._write(self.reward_function, reward_function)
        self._write(self.model_metadata, model_metadata.to_dict())
        if hyperparameters is not None:
            self._write(self.hyperparameters, hyperparameters.to_dict())
        for folder in (self.aws_model_metadata.parent, self.aws_hyperparameters.parent):
            folder.mkdir(exist_ok=True)
        self._write(self.aws_model_metadata, model_metadata.to_dict())
        for_tools = equivalent if hyperparameters is None else hyperparameters.to_dict()
        if for_tools is not None:
            self._write(self.aws_hyperparameters, dict(for_tools))
        if training_params is not None:
            self._write(self.training_params, training_params.to_yaml())

    def read_reward_function(self) -> str:
        """Source of the reward function.

        Raises:
            RunError: It is missing, too large or not UTF-8.
        """
        try:
            return read_text(self.reward_function, max_bytes=MAX_REWARD_BYTES)
        except ConfigError as error:
            raise RunError(str(error)) from error

    def read_model_metadata(self) -> ModelMetadata:
        """Action space, sensors, network. Raises ConfigError where a value is not allowed."""
        from racecraft.agent import ModelMetadata

        return ModelMetadata.load(self.model_metadata)

    def read_notes(self) -> str:
        """What people wrote about it; empty where there is nothing that can be read."""
        try:
            return read_text(self.notes, max_bytes=MAX_NOTES_BYTES) if self.notes.is_file() else ""
        except ConfigError:
            return ""

    def write_notes(self, text: str) -> None:
        """Replace what people wrote about it.

        Raises:
            RunError: It is too long, or the file cannot be written.
        """
        size = len(text.encode(errors="surrogatepass"))
        if size > MAX_NOTES_BYTES:
            raise RunError(f"The notes have {size:,} bytes; allowed are {MAX_NOTES_BYTES:,}.")
        if text.strip():
            self._write(self.notes, text)
        else:
            self.notes.unlink(missing_ok=True)

    def read_hyperparameters(self) -> Hyperparameters | None:
        """AWS's hyperparameters, or None where the run has no such file."""
        from racecraft.agent import Hyperparameters

        return Hyperparameters.load(self.hyperparameters) if self.hyperparameters.exists() else None

    def read_aws_hyperparameters(self) -> dict[str, Any]:
        """How the run learned, by AWS's names, of whatever range; empty where the run does not say."""
        try:
            return read_json_object(self.aws_hyperparameters) if self.aws_hyperparameters.exists() else {}
        except ConfigError as error:
            raise RunError(str(error)) from error

    def read_training_params(self) -> TrainingParams | None:
        """AWS's training settings, or None where the run has no such file."""
        from racecraft.run.training_params import TrainingParams

        return TrainingParams.load(self.training_params) if self.training_params.exists() else None

    def _write(self, path: Path, content: str | dict[str, Any]) -> None:
        try:
            if isinstance(content, str):
                write_file(path, content.encode())
            else:
                write_json(path, content)
        except (OSError, ValueError, TypeError) as error:
            raise RunError(f"{path} cannot be written: {getattr(error, 'strerror', None) or error}.") from error


def list_runs(root: str | Path) -> list[RunFolder]:
    """The runs in a folder, oldest name first."""
    try:
        return [RunFolder(path.parent) for path in sorted(Path(root).glob("*/run.json"))]
    except OSError:
        return []


def dated_folder(root: Path, *, prefix: str = "") -> tuple[str, Path]:
    """Make a folder named after now, to the second, or a little later where one of this second exists.

    Args:
        root: Where; made when missing.
        prefix: Before the time.

    Returns:
        Its time stamp, UTC as ``20260131235959``, and its path.
    """
    root.mkdir(parents=True, exist_ok=True)
    moment = datetime.now(UTC)
    while True:
        stamp = moment.strftime("%Y%m%d%H%M%S")
        path = root / f"{prefix}{stamp}"
        try:
            path.mkdir()
            return stamp, path
        except FileExistsError:
            moment += timedelta(seconds=1)


def checked_name(name: str) -> str:
    """The name, where a run may have it.

    Raises:
        RunError: It may not; the hint has one that is near.
        ConfigError: It is no text.
    """
    check_type("name", name, str, "use a text")
    if len(name) > MAX_NAME or not _NAME.fullmatch(name) or _RESERVED.fullmatch(name) or name.endswith("."):
        raise RunError(
            f"Name {quoted(name)} is not allowed: 1 to {MAX_NAME} letters, digits, dots, hyphens and underscores.",
            hint=f"Use '{sanitize_name(name)}'.",
        )
    return name


def sanitize_name(text: str) -> str:
    """The nearest name a folder may have: ``Mein Auto #1`` becomes ``Mein-Auto-1``."""
    name = re.sub(r"[^A-Za-z0-9._-]+", "-", text).strip("-._")[:MAX_NAME].rstrip("-._")
    return f"run-{name}".rstrip("-")[:MAX_NAME] if not name or _RESERVED.fullmatch(name) else name


def _versions() -> dict[str, str]:
    versions = {
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}",
        "racecraft": VERSION,
        "numpy": np.__version__,
    }
    torch = find_spec("torch")
    if torch is not None and torch.origin is not None:
        versions["torch"] = _installed_version("torch", beside=Path(torch.origin).parent)
    return versions


def _installed_version(package: str, *, beside: Path) -> str:
    """The version that a package's folder has beside it, as installers write it there."""
    for folder in beside.parent.glob(f"{package}-*.dist-info"):
        return folder.name.removeprefix(f"{package}-").removesuffix(".dist-info")
    from importlib.metadata import version  # knows every other way to install one, and takes its time

    return version(package)
