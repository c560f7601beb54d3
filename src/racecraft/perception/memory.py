"""What the pictures before tell of this one: a small recurrent network over the answers of the one that looks.

answers to a picture, what the car was told since the last, state ──Memory──▶ better answers, state

A lens sees the road from 16 cm ahead on. What lies beside it now lay ahead of it a moment ago. How far the car has come
since no picture tells: its commands tell something of it, where they are known.

Every sum of products here is exact: its factors are multiples of powers of two, and a float64 holds all of their sums.
So neither the order of summing, which is the BLAS library's own affair, nor how many lenses are looked at together
changes a bit.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.perception.answers import (
    ERRORS,
    IN_SIGHT,
    LOG_LIMITS,
    MIDDLES,
    NUM_CONTINUOUS,
    NUM_OUTPUTS,
    NUM_TARGETS,
    POSE,
)
from racecraft.perception.mirror import mirrored_answers, mirrored_commands

Array = NDArray[np.float64]

UNITS: Final = 64
"""Numbers that are remembered of a lens's pictures, H; as many again of their mirror images."""
ANSWERS: Final = [*POSE, *(ERRORS.start + place for place in POSE)]
"""Outputs that memory corrects: where the lens is and looks, and how far off that may be."""
REACH: Final = 0.25
"""What 1 of memory's own outputs adds to an answer, in units of the network."""
MOST: Final = 4.0
"""In units of the network: numbers and logits beyond it are told as it."""
COMMAND_UNITS: Final = (0.5, 2.0)
"""What 1 of memory is of a steering angle, rad, and of a speed, m/s."""
MOST_COMMANDED: Final = 2.5
"""In those units, to either side: commands beyond it, which no car obeys, are told as it."""
NUM_SEEN: Final = NUM_OUTPUTS + 1 + len(COMMAND_UNITS)
"""Numbers that memory is told of a picture: outputs, whether commands are known, commands."""
SEEN_PLACES, STATE_PLACES, WEIGHT_PLACES = 10, 14, 14
"""Binary places that are kept of what goes into sums."""
SHAPES: Final = {
    "seen": (NUM_SEEN, 2 * UNITS),
    "state": (UNITS, 2 * UNITS),
    "bias": (1, 2 * UNITS),
    "answer": (UNITS, len(ANSWERS)),
    "answer_bias": (1, len(ANSWERS)),
}
"""Weights by name. Of 2 H columns the first half is of what is new, the other of how much of the old stays."""


class Memory:
    """Corrects answers by those before.

    Args:
        weights: By name, of `SHAPES`; finite.
    """

    def __init__(self, weights: Mapping[str, NDArray[np.floating]]) -> None:
        self.weights = {name: exact(weights[name].astype(np.float64).clip(-8, 8), WEIGHT_PLACES) for name in SHAPES}

    @classmethod
    def of(cls, weights: Mapping[str, NDArray[np.floating]]) -> Memory | None:
        """That of a file's weights; None where there are none.

        Raises:
            ValueError: They are not those of `SHAPES`.
        """
        if not weights:
            return None
        if {name: array.shape for name, array in weights.items()} != SHAPES:
            raise ValueError("the weights of its memory are others than a memory has")
        return cls(weights)

    def __call__(
        self, outputs: NDArray[np.float32], commands: NDArray[np.float32], state: Array
    ) -> tuple[NDArray[np.float32], Array]:
        """Better outputs (N, NUM_OUTPUTS) of a picture of each lens, and the state (N, 2, H) that it leaves.

        Args:
            outputs: Of the network  (N, NUM_OUTPUTS).
            commands: What the lens's car was told since its picture before, steering angle in rad and speed in m/s;
                NaN where that is not known, and of a first picture  (N, 2).
            state: That the picture before left  (N, 2, H).
        """
        straight = seen_of(outputs, commands)
        turned = seen_of(mirrored_answers(outputs), mirrored_commands(commands))
        both = np.concatenate([straight, turned])
        later, _ = self.step(both, np.concatenate([state[:, 0], state[:, 1]]))
        here, there = np.split(self.answer(later), 2)
        better = outputs.copy()
        better[:, ANSWERS] += 0.5 * here
        reflected = mirrored_answers(better)
        reflected[:, ANSWERS] += 0.5 * there
        return mirrored_answers(reflected), np.stack(np.split(later, 2), axis=1)

    def step(self, seen: Array, state: Array) -> tuple[Array, tuple[Array, Array]]:
        """The state (B, H) after what is seen (B, NUM_SEEN), and what is new of it and how much of the old stays."""
        weights = self.weights
        sums = seen @ weights["seen"] + state @ weights["state"] + weights["bias"]
        bent = bend(sums)
        new, stays = bent[:, :UNITS], 0.5 + 0.5 * bent[:, UNITS:]
        return exact(new + stays * (state - new), STATE_PLACES), (new, stays)

    def answer(self, state: Array) -> NDArray[np.float32]:
        """What to add to `ANSWERS`  (B, A)."""
        return (REACH * (state @ self.weights["answer"] + self.weights["answer_bias"])).astype(np.float32)


def unseen(count: int) -> Array:
    """The state of lenses that have seen nothing, of what they see and of that in a mirror  (N, 2, H)."""
    return np.zeros((count, 2, UNITS))


def unknown(count: int) -> NDArray[np.float32]:
    """Commands of which nothing is known  (N, 2)."""
    return np.full((count, len(COMMAND_UNITS)), np.nan, np.float32)


def seen_of(outputs: NDArray[np.float32], commands: NDArray[np.float32]) -> Array:
    """Outputs and commands as memory is told them  (B, NUM_SEEN).

    They are bounded; of rows in which the road's middle is not there are no columns, of unknown commands only zeros.
    """
    seen = outputs.astype(np.float64).clip(-MOST, MOST)
    seen[:, MIDDLES] *= seen[:, IN_SIGHT] > 0.0
    seen[:, NUM_CONTINUOUS:NUM_TARGETS] /= MOST
    seen[:, ERRORS] = outputs[:, ERRORS].clip(*LOG_LIMITS) / 3.0
    is_known = ~np.isnan(commands).any(axis=1, keepdims=True)
    told = (commands.astype(np.float64) / COMMAND_UNITS).clip(-MOST_COMMANDED, MOST_COMMANDED)
    return exact(np.concatenate([seen, is_known, np.where(is_known, told, 0.0)], axis=1), SEEN_PLACES)


def bend(sums: Array) -> Array:
    """From -1 to 1, by arithmetic that every machine does alike."""
    return sums / np.sqrt(1.0 + sums * sums)


def exact(numbers: Array, places: int) -> Array:
    """Rounded to so many binary places."""
    scale = 2.0**places
    return np.asarray(np.rint(numbers * scale) / scale)
