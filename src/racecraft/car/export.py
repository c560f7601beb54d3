"""A run becomes the archive of a physical car, and an archive the policy that it holds.

run -> policy -> graph, metadata -> *export_run* -> NAME.tar.gz -> *read_exported* -> policy
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Final

from racecraft.agent.model_metadata import ModelMetadata
from racecraft.car.archive import GRAPH, METADATA, archive_name, car_archive, check_archive_name
from racecraft.car.converters import openvino_model, tflite_model
from racecraft.car.metadata import car_metadata, car_notes
from racecraft.car.policy_graph import policy_graph, policy_onnx, policy_output, sensor_inputs
from racecraft.checks import check_choice, check_type
from racecraft.errors import ConfigError, RunError, SourceError
from racecraft.importing.model_files import ModelFiles
from racecraft.importing.source import open_source
from racecraft.importing.weights import open_model, read_weights
from racecraft.json_file import parse_json_object
from racecraft.learn import NetworkSpec
from racecraft.race.policy import NetworkPolicy, load_policy
from racecraft.race.seeing import learner_of
from racecraft.run import RunFolder
from racecraft.run.atomic import write_file

ENDINGS: Final = {"onnx": ".onnx", "tflite": ".tflite", "openvino": ".xml"}
"""What a network alone can become, and how the name of its file ends; OpenVINO writes a second one, ``.bin``."""
TARGETS: Final = ("car", *ENDINGS)
"""What a run can become."""


@dataclass(frozen=True, kw_only=True)
class ExportedModel:
    """What was written."""

    run: Path
    """The run folder."""
    step: int
    """Camera steps of training behind the checkpoint."""
    file: Path
    """What was written."""
    size: int
    """Bytes; of both files of OpenVINO."""
    network: str
    """Name of the network."""
    notes: tuple[str, ...]
    """Sentences on what a car does otherwise than the simulator."""

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {**asdict(self), "run": str(self.run), "file": str(self.file), "notes": list(self.notes)}


def export_run(
    run: str | Path, *, to: str = "car", output: str | Path | None = None, checkpoint: str | int = "best"
) -> ExportedModel:
    """Write the archive that a physical car takes, or a policy's network alone as another program's model.

    Args:
        run: The run folder.
        to: What it is for, one of `TARGETS`.
        output: The file; by default it lies in the run folder and is called like the run.
        checkpoint: ``best``, ``last`` or a number of steps.

    Raises:
        RunError: There is no such run, or the file cannot be written.
        CheckpointError: There is no such checkpoint, or it is damaged.
        ConfigError: The car has not what the policy needs, or would not take the archive's name, or the library that
            the target needs is not installed.
    """
    check_choice("--to", to, TARGETS)
    if output is not None:
        check_type("output", output, (str, PathLike), "use a file's path")
    folder = RunFolder.open(run)
    ending = ENDINGS.get(to, "")
    name = folder.name + ending if ending else archive_name(folder.name)
    file = folder.path / name if output is None else Path(output)
    if to == "car":
        check_archive_name(file)
    elif file.suffix != ending:
        raise ConfigError(f"The model is to be called {file.name!r}; the name of a model for {to} ends in {ending}.")
    step, policy = load_policy(folder, checkpoint=checkpoint, num_threads=1)
    metadata, spec, weights = folder.read_model_metadata(), policy.learner.spec, policy.learner.weights()
    files: dict[Path, bytes] = {}
    if to == "onnx":
        files[file] = policy_onnx(weights, spec, metadata.suite)
    else:
        graph = policy_graph(weights, spec, metadata.suite)
        if to == "car":
            files[file] = car_archive(graph, car_metadata(metadata, spec))
        elif to == "tflite":
            files[file] = tflite_model(graph, sensor_inputs(spec, metadata.suite), policy_output(spec))
        else:
            files[file], files[file.with_suffix(".bin")] = openvino_model(graph)
    for path, data in files.items():
        _write(path, data)
    return ExportedModel(
        run=folder.path,
        step=step,
        file=file,
        size=sum(map(len, files.values())),
        network=spec.name,
        notes=tuple(car_notes(metadata, spec)) if to == "car" else (),
    )


def _write(path: Path, data: bytes) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, data)
    except OSError as error:
        raise RunError(f"{path} cannot be written: {error.strerror or error}.") from error


def read_exported(archive: str | Path, *, num_threads: int = 1) -> NetworkPolicy:
    """The policy in an archive that `export_run` wrote; one that is told by perception, by that of this version.

    Args:
        archive: The file.
        num_threads: 0 takes one per core.

    Raises:
        RacecraftError: The archive is damaged, or of another kind.
    """
    with open_source(archive) as source:
        for name, where in ((METADATA, " at its root"), (GRAPH, "")):
            if name not in source.files:
                hint = "Give an archive that racecraft export wrote; racecraft import reads every other one."
                raise SourceError(f"{source.title} has no {name}{where}.", hint=hint)
        metadata = ModelMetadata.from_dict(parse_json_object(source.text(METADATA), name=METADATA), name=METADATA)
        space, suite = metadata.action_space, metadata.suite
        spec = NetworkSpec(
            name=metadata.neural_network,
            num_actions=space.size,
            is_discrete=space.kind == "discrete",
            is_squashed=metadata.training_algorithm == "sac",
            state_size=1,  # the smallest critic there is: it does not drive
            lenses=suite.lenses,
            lidar_size=suite.lidar_size,
        )
        with open_model(source, ModelFiles(graph=GRAPH)) as tensors:
            weights = read_weights(tensors, spec, suite, [])
    learner = learner_of(spec, seed=None, num_threads=num_threads)
    learner.load_weights({**learner.weights(), **weights})
    return NetworkPolicy(learner, space, sensors=suite)
