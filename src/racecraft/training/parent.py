"""The run a new one begins from: another run's checkpoint, its settings, and what of its network goes over.

    RUN[@checkpoint] ──open_parent──▶ Parent ──start_run──▶ <run>/parent/, run.json ──Training──▶ first weights

The new run keeps a copy of the weights, so the parent may be deleted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.agent import ModelMetadata
from racecraft.errors import CheckpointError, ConfigError, printable
from racecraft.learn import Learner, NetworkSpec
from racecraft.learn.learner import below
from racecraft.learn.networks import weight_shapes
from racecraft.run import Checkpoint, RunFolder
from racecraft.run.checkpoint import StoredCheckpoint, split_model

WEIGHTS: Final = "weights/"
HEADS: Final = ("policy.head.weight", "policy.head.bias", "policy.log_std")
"""What depends on the action space alone."""

Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True, eq=False)
class Parent:
    """A run's checkpoint to begin from."""

    folder: RunFolder
    saved: Checkpoint

    @property
    def name(self) -> str:
        """Run and step, as `open_parent` reads them."""
        return f"{self.folder.path}@{self.saved.step}"

    @property
    def address(self) -> str:
        """The name, from whatever folder it is read."""
        return f"{self.folder.path.resolve()}@{self.saved.step}"

    @property
    def weights(self) -> Arrays:
        """The network's parameters by name: those that drove its evaluations."""
        return below(WEIGHTS, self.saved.arrays)

    def record(self) -> dict[str, Any]:
        """For run.json."""
        return {"run": printable(str(self.folder.path)), "step": self.saved.step, "file": self.saved.path.name}

    def check(self, spec: NetworkSpec, metadata: ModelMetadata) -> list[str]:
        """Refuse a network that the weights do not fit.

        Args:
            spec: The new run's network.
            metadata: The new run's, for its sensors.

        Returns:
            Sentences about what of the network begins anew.

        Raises:
            ConfigError: Other sensors, or another network.
            CheckpointError: A weight is NaN or infinite.
        """
        theirs = self.folder.read_model_metadata()
        if set(theirs.sensors) != set(metadata.sensors):
            raise ConfigError(
                f"{self.folder.path} sees with {', '.join(theirs.sensors)}, the new run is to see with "
                f"{', '.join(metadata.sensors)}; a run that begins from another keeps its sensors.",
                hint="Leave out --from to train new sensors from the beginning.",
            )
        network = self.saved.metadata.get("network")
        name = network.get("name") if isinstance(network, dict) else None
        if name != spec.name:
            raise ConfigError(
                f"{self.folder.path} has the network {name}, the new run is to have {spec.name}; a run that begins "
                "from another keeps its network.",
                hint=f"Give --network {name}, or leave out --from.",
            )
        kept = fitting(self.weights, spec)
        require_finite(self.saved, kept)
        return _sentences(kept, spec)


def open_parent(text: str | Path) -> Parent:
    """Read ``RUN`` or ``RUN@checkpoint``.

    Args:
        text: A run folder, then, if wanted, ``@best`` (the default), ``@last`` or ``@`` and a number of steps.

    Raises:
        RunError: There is no such run.
        ConfigError: What follows the @ names no checkpoint.
        CheckpointError: It has no such checkpoint, or it is damaged.
    """
    path, which = split_model(text)
    folder = RunFolder.open(path)
    return Parent(folder, folder.checkpoints.load(which or "best"))


def fitting(weights: Mapping[str, NDArray[Any]], spec: NetworkSpec) -> Arrays:
    """Those of another network's parameters that a network begins with.

    The head of the policy may be of another action space, and the critic may see something else; then they begin anew.

    Raises:
        ConfigError: Something else differs.
    """
    shapes = weight_shapes(spec)
    given = {name: np.asarray(array) for name, array in weights.items()}
    same = {name for name, array in given.items() if shapes.get(name) == array.shape}
    critic = {name for name in shapes if name.startswith("critic.")}
    if not critic <= same:
        same -= critic
    head = {name for name in HEADS if name in shapes}
    if not head <= same:
        same -= set(HEADS)
    lost = [name for name in shapes if name not in same | critic | head]
    if lost:
        raise ConfigError(f"The weights to begin from do not fit the network {spec.name}: {', '.join(lost[:3])}.")
    return {name: given[name] for name in shapes if name in same}


def is_weights_only(saved: Checkpoint | StoredCheckpoint) -> bool:
    """Whether a checkpoint is what its run began with, weights from elsewhere and nothing of a training."""
    return "origin" in saved.metadata


def is_starter(saved: Checkpoint) -> bool:
    """Whether they are of a policy that comes with Racecraft, which learned on other roads than its run names."""
    origin = saved.metadata.get("origin")
    return isinstance(origin, dict) and origin.get("format") == "racecraft"


def origin_of(saved: Checkpoint) -> dict[str, Any]:
    """Where the weights that a run begins with came from: what an import says, or a parent's checkpoint and step."""
    named = {name: saved.metadata[name] for name in ("file", "step") if name in saved.metadata}
    return dict(saved.metadata.get("origin", named))


def begin_from(learner: Learner, saved: Checkpoint, *, has_lessons: bool = False) -> None:
    """Give a learner with fresh weights those of a parent that fit it.

    Args:
        learner: To begin with them.
        saved: The parent's.
        has_lessons: Whether a teacher is to follow. Its answers lie many of a driver's small standard deviations away,
            and gradients would speak of nothing else for long: who has lessons begins as unsure as from nothing.

    Raises:
        CheckpointError: The copy of the parent's weights is not of this network, or one is NaN or infinite.
    """
    try:
        kept = fitting(below(WEIGHTS, saved.arrays), learner.spec)
    except ConfigError as error:
        raise CheckpointError(f"{saved.path} cannot be begun from: {error}") from error
    require_finite(saved, kept)
    if has_lessons:
        kept.pop("policy.log_std", None)
    learner.load_weights({**learner.weights(), **kept})


def require_finite(saved: Checkpoint, kept: Arrays) -> None:
    """Refuse weights of which no training comes; those that are left behind do no harm."""
    for name, array in kept.items():
        if not np.isfinite(array).all():
            raise CheckpointError(f"{saved.path} has weights that are NaN or infinite: {name}.")


def _sentences(kept: Arrays, spec: NetworkSpec) -> list[str]:
    """What begins anew, for the user."""
    lost = [name for name in weight_shapes(spec) if name not in kept]
    notes = []
    if any(name in HEADS for name in lost):
        notes.append("The action space has another shape: the policy's last layer begins anew.")
    if any(name.startswith("critic.") for name in lost):
        notes.append("The critic sees something else: it begins anew.")
    return notes
