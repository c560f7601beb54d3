"""What is sent to a race on another machine: one safetensors file with what drives, and nothing else.

    header    format, step, network, model_metadata (action space and sensors)
    tensors   weights/policy.…, exactly the network's, float32, finite

No reward, no replay, no critic, nothing to be run. A file comes from a stranger: it is bounded before it is read, and
all that `racecraft.race.policy` demands of a run's checkpoint is demanded of it.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from numpy.typing import NDArray

from racecraft.agent.metadata_words import CONFIGURED
from racecraft.agent.model_metadata import ModelMetadata
from racecraft.agent.sensors import LidarConfig
from racecraft.errors import CheckpointError, ConfigError
from racecraft.json_file import open_regular
from racecraft.learn import NetworkSpec
from racecraft.race.entry import Entry
from racecraft.race.policy import WEIGHTS, driving_weights, network_of, policy_of
from racecraft.run.checkpoint import HEADER_KEY, StoredCheckpoint, header_of
from racecraft.run.folder import RunFolder
from racecraft.run.tensor_file import tensor_file

FORMAT: Final = "racecraft entry 1"
MAX_BYTES: Final = 32 << 20
"""Of a file; AWS's deepest network has 17 MB of weights that drive."""
MAX_HEADER: Final = 1 << 18
FIELDS: Final = ("format", "step", "network", "model_metadata")


@dataclass(frozen=True)
class EntryFile:
    """A file whose contents were found to be what they have to be."""

    saved: StoredCheckpoint
    metadata: ModelMetadata
    digest: str
    """SHA-256 of what drives: the same for two files that drive alike by the same weights, whatever else they say."""

    def entry(self, name: str, *, num_threads: int = 0) -> Entry:
        """The model at the start, under a name."""
        policy = policy_of(self.saved, self.metadata, num_threads=num_threads)
        return Entry(name, self.saved.path, self.saved.step, policy)


def pack_entry(run: RunFolder, *, checkpoint: str = "best") -> bytes:
    """The file of a run's checkpoint.

    Raises:
        RunError: The run cannot be read.
        CheckpointError: There is no such checkpoint, or it holds what is not its network's.
        ConfigError: The action space or the sensors are not allowed.
    """
    saved, metadata = run.checkpoints.find(checkpoint), run.read_model_metadata()
    weights = driving_weights(saved, network_of(saved, metadata))
    header = {
        "format": FORMAT,
        "step": saved.step,
        "network": saved.metadata["network"],
        "model_metadata": metadata.to_dict(),
    }
    arrays = {f"{WEIGHTS}{name}": array for name, array in weights.items()}
    return b"".join(tensor_file(arrays, {HEADER_KEY: json.dumps(header, sort_keys=True)}))


def read_entry_file(path: Path) -> EntryFile:
    """Look at a stranger's file.

    Raises:
        CheckpointError: It is none, too large, or holds what is not its network's; the message names no path.
        ConfigError: Its action space or sensors are not allowed.
    """
    try:
        return _read(path)
    except CheckpointError as error:
        raise CheckpointError(str(error).replace(str(path), "The file"), hint=error.hint) from error


def _read(path: Path) -> EntryFile:
    try:
        size = path.stat().st_size
        with open_regular(path) as file:
            length = int.from_bytes(file.read(8), "little")
    except OSError as error:
        raise CheckpointError(f"{path} cannot be read: {error.strerror or error}.") from error
    if size > MAX_BYTES:
        raise CheckpointError(f"{path} has {size:,} bytes; an entry has at most {MAX_BYTES:,}.")
    if not 2 <= length <= min(MAX_HEADER, size - 8):
        raise CheckpointError(f"{path} is no safetensors file.", hint="racecraft submit makes one of a run.")
    try:
        header, kinds = header_of(path)
    except (ValueError, KeyError, TypeError) as error:
        why = str(error)[:200].rstrip(".") or "no header"
        raise CheckpointError(f"{path} is no entry of Racecraft: {why}.") from error
    if header.get("format") != FORMAT or set(header) != set(FIELDS):
        raise CheckpointError(
            f"{path} is no entry of Racecraft: its header has not exactly {', '.join(FIELDS)} of {FORMAT!r}.",
            hint="racecraft submit makes one of a run.",
        )
    if type(header["step"]) is not int or not 0 <= header["step"] < 10**18:
        raise CheckpointError(f"{path} has the step {str(header['step'])[:40]!r}; allowed are whole numbers from 0.")
    if not isinstance(header["model_metadata"], dict):
        raise ConfigError("model_metadata is no object.")
    if foreign := next((name for name in sorted(kinds) if not name.startswith(f"{WEIGHTS}policy.")), None):
        raise CheckpointError(f"{path} holds {foreign[:80]!r}, which is no weight of a policy.")
    metadata = ModelMetadata.from_dict(header["model_metadata"])
    saved = StoredCheckpoint(header["step"], {"network": header["network"]}, {}, None, path, kinds)
    spec = network_of(saved, metadata)
    return EntryFile(saved, metadata, _digest(spec, metadata, driving_weights(saved, spec)))


def _digest(spec: NetworkSpec, metadata: ModelMetadata, weights: dict[str, NDArray[Any]]) -> str:
    """What does not change a choice is not in it, so that nobody has a second try by renaming the first."""
    sizes = metadata.lidar if CONFIGURED in metadata.sensors else None
    driving = {
        "network": [spec.name, spec.is_squashed],
        "action_space": [metadata.action_space.kind, metadata.action_space.to_aws()],
        "sensors": [sorted(metadata.sensors), None if sizes is None or sizes == LidarConfig() else vars(sizes)],
    }
    digest = hashlib.sha256(json.dumps(driving, sort_keys=True).encode())
    for name in sorted(weights):
        digest.update(f"\n{name} {weights[name].shape}\n".encode())
        digest.update(weights[name].tobytes())
    return digest.hexdigest()
