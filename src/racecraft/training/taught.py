"""A teacher that has taught before: a child's begins with what its parent's knew.

    parent's checkpoint ──teachers_arrays──▶ <run>/parent/ ──begin_taught──▶ first weights of the child's teacher

Only who is to be fast alone has use for it: what an earlier teacher knew of boxes and other racers would be of others.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from racecraft.agent import ModelMetadata
from racecraft.errors import CheckpointError
from racecraft.learn import Distill, DistillConfig, NetworkSpec
from racecraft.learn.learner import below
from racecraft.learn.networks import TEACHER, weight_shapes
from racecraft.run import Checkpoint
from racecraft.sim.columns import state_width
from racecraft.sim.objects import NO_OBJECTS
from racecraft.training.parent import Arrays, require_finite
from racecraft.training.settings import TrainSettings

TEACHERS: Final = "teacher/"
"""Arrays of a checkpoint that begin like this are its teacher's."""
SCALE: Final = "ppo/return_scale"
"""How its rewards were measured, which its critic's estimates are in."""
RATE: Final = 7e-4
"""Adam's step size of a teacher that knows something: at twice that it forgets in its first 100,000 steps what it
knew. docs/log/fastest-lap.md."""


def teachers_arrays(parent: Checkpoint, settings: TrainSettings, metadata: ModelMetadata) -> Arrays:
    """What a checkpoint holds of a teacher, where a child's may begin with it; its averaged weights, if there are.

    Args:
        parent: The checkpoint to begin from.
        settings: The child's.
        metadata: The child's, for its actions.

    Raises:
        CheckpointError: A number in it is NaN or infinite.
    """
    is_alone = settings.objects == NO_OBJECTS and settings.opponents is None
    if settings.algorithm != "distill" or not is_alone or metadata.action_space.kind != "continuous":
        return {}
    kept = below(TEACHERS, parent.arrays)
    weights = below("average/", kept) or below("weights/", kept)
    arrays = {f"weights/{name}": array for name, array in weights.items()}
    arrays |= {name: array for name, array in kept.items() if name == SCALE}
    if not _fits(arrays, settings.network_spec(metadata)):
        return {}
    named = {f"{TEACHERS}{name}": array for name, array in arrays.items()}
    require_finite(parent, named)
    return named


def taught(lessons: DistillConfig) -> DistillConfig:
    """The lessons of a teacher that knows something, in smaller steps, and of a student that sees already.

    Both take half as long, but what is the least for who has to learn to see is enough.
    """
    enough = min(lessons.student_steps, DistillConfig.student_steps)
    return replace(
        lessons,
        teacher_steps=max(1, lessons.teacher_steps // 2),
        teacher_rate=RATE,
        student_steps=max(enough, lessons.student_steps // 2),
    )


def begin_taught(algorithm: Distill, parent: Checkpoint) -> bool:
    """Give a teacher that has learned nothing what a parent's knew, where a copy of that is there; whether it is.

    What it is told beyond the plain state, say of its lap, begins with no weight.

    Raises:
        CheckpointError: The copy is not of such a teacher, or a number in it is NaN or infinite.
    """
    arrays = below(TEACHERS, parent.arrays)
    if not arrays:
        return False
    teacher = algorithm.teacher
    if not _fits(arrays, teacher.learner.spec):
        raise CheckpointError(f"{parent.path} cannot be begun from: its teacher is of other actions or another state.")
    require_finite(parent, {f"{TEACHERS}{name}": array for name, array in arrays.items()})
    weights = {name: np.zeros_like(array) for name, array in teacher.learner.weights().items()}
    for name, array in below("weights/", arrays).items():
        weights[name][..., : array.shape[-1]] = array
    teacher.learner.load_weights(weights)
    teacher.return_scale = arrays[SCALE]
    return True


def _fits(arrays: Arrays, spec: NetworkSpec) -> bool:
    """Whether they are of a teacher with the same actions, told the same state, or no more than what all are told."""
    shapes = {name: array.shape for name, array in arrays.items()}
    told = [weight_shapes(replace(spec, name=TEACHER, state_size=size)) for size in (spec.state_size, state_width(0))]
    return any(shapes == {**{f"weights/{name}": shape for name, shape in one.items()}, SCALE: (2,)} for one in told)
