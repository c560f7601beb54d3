"""What a run begins with where files of the original hold a trained model: its weights, as a checkpoint of ours."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import Any

import numpy as np

from racecraft.agent.sensor_suite import SensorSuite
from racecraft.errors import SourceError, typed
from racecraft.importing.frozen_graph import FrozenGraph, open_frozen_graph
from racecraft.importing.model_files import ModelFiles
from racecraft.importing.policy_weights import (
    Tensors,
    critic_weights,
    find_tower,
    has_critic,
    policy_head,
    policy_weights,
)
from racecraft.importing.source import Source
from racecraft.importing.tf_bundle import TensorBundle
from racecraft.learn import NetworkSpec
from racecraft.learn.learner import Weights
from racecraft.learn.networks import architecture_of
from racecraft.run import RunFolder
from racecraft.training.parent import WEIGHTS


@contextmanager
def open_model(source: Source, model: ModelFiles) -> Iterator[Tensors]:
    """A model's tensors, good inside the block.

    Raises:
        SourceError: They cannot be read.
    """
    paths = [source.files[name].path for name in model.paths]
    if any(path is None for path in paths):
        raise SourceError(f"{model.name} is too large to be read.")
    if model.is_checkpoint:
        index, data = paths
        assert index is not None
        assert data is not None
        yield TensorBundle(index, data, name=model.name)
    else:
        (graph,) = paths
        assert graph is not None
        with open_frozen_graph(graph, name=model.name) as tensors:
            yield tensors


@contextmanager
def or_other_weights(weights: ModelFiles | None) -> Iterator[None]:
    """Within, an error of the weights says how to do without them.

    Raises:
        SourceError: The one of the weights.
    """
    try:
        yield
    except SourceError as error:
        hint = f"{error.hint} With --checkpoint none the run begins with fresh weights.".strip()
        if weights is not None and weights.is_checkpoint and weights.graph:
            hint = f"{hint} With --checkpoint {typed(weights.graph)} it begins with those of its graph."
        raise SourceError(str(error), hint=hint) from error


def read_weights(tensors: Tensors, spec: NetworkSpec, sensors: SensorSuite, notes: list[str]) -> Weights:
    """The weights that a network begins with.

    Args:
        tensors: Of the model.
        spec: The network; a critic that sees the sensors is taken from the file, too.
        sensors: Of the car.
        notes: Gets a sentence for what the file does not tell.

    Raises:
        SourceError: The file is of another network, or damaged.
    """
    weights = policy_weights(tensors, spec, sensors)
    if isinstance(tensors, FrozenGraph):
        _check_operations(tensors, spec)
    if not spec.is_discrete and "policy.log_std" not in weights:
        spread = architecture_of(spec).log_std
        weights["policy.log_std"] = np.full(spec.num_actions, spread, np.float32)
        if not spec.is_squashed:
            notes.append(
                f"{tensors.name} does not say how widely the policy explores: should it be trained, as at first."
            )
    if not spec.state_size and has_critic(tensors):
        weights |= critic_weights(tensors, spec, sensors)
    return weights


def _check_operations(graph: FrozenGraph, spec: NetworkSpec) -> None:
    """Refuse a graph that does something else with its weights than our network, or ends before its output.

    Raises:
        SourceError: As `read_weights`.
    """
    head = policy_head(spec)
    scope = find_tower(graph, head)
    expected = {name: "Relu" for name in graph.nodes if name.startswith(scope) and name.endswith("_activation")}
    output = f"{scope}/{head.partition('/')[0]}/policy"
    expected[output] = "Softmax" if spec.is_discrete else "Identity"
    if spec.is_squashed and output in graph.nodes and graph.nodes[output].operation == "Tanh":
        expected[output] = "Tanh"  # as we export it, for a car clips what SAC squashes
    for name, operation in expected.items():
        node = graph.nodes.get(name)
        if node is None or node.operation != operation:
            has = "has no" if node is None else f"has a {node.operation[:40]!a} as its"
            layer = "/".join(name.split("/")[-2:])
            raise SourceError(f"{graph.name} {has} {layer[-80:]}, expected a {operation}: it is of another network.")


def save_weights(folder: RunFolder, weights: Weights, spec: NetworkSpec, origin: dict[str, Any]) -> None:
    """Make them the run's checkpoint, at step 0 of its own training."""
    arrays = {f"{WEIGHTS}{name}": array for name, array in weights.items()}
    folder.checkpoints.save(0, arrays, metadata={"network": asdict(spec), "origin": origin})
