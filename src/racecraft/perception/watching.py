"""Pictures in order, of a video or of cars under way: a perceiver that remembers those before.

frames ──perceiver──▶ outputs ──memory──▶ better outputs ──believe──▶ Belief
 commands since the last, state of each lens ──┴──▶ state
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from racecraft.perception.belief import Belief, believe
from racecraft.perception.memory import unknown, unseen
from racecraft.perception.network import Perceiver


class Watcher:
    """Looks at the pictures of some lenses, each lens's in order; without a memory as the perceiver alone.

    Memory learned from 15 pictures a second of cars at up to 4 m/s, which begin anywhere in a drive. Who knows what
    the cars are told passes it on; memory does without it, but knows less of how far they have come.

    Args:
        perceiver: Who looks, and what it remembers with.
    """

    def __init__(self, perceiver: Perceiver) -> None:
        self.perceiver = perceiver
        self._states, self._commands = unseen(0), unknown(0)

    def __call__(self, frames: NDArray[np.uint8], lenses: NDArray[np.intp] | None = None) -> Belief:
        """What is believed of a picture of each of N lenses.

        Args:
            frames: Grey uint8 (N, 120, 160).
            lenses: Which they are of, each once; by default of the first N  (N,).

        Raises:
            ShapeError: The pictures are not of this type and shape.
        """
        outputs, memory = self.perceiver.outputs(frames), self.perceiver.memory
        if memory is None or not len(frames):
            return believe(outputs)
        which = self._places(len(frames), lenses)
        outputs, self._states[which] = memory(outputs, self._commands[which], self._states[which])
        self._commands[which] = np.nan
        return believe(outputs)

    def tell(self, commands: NDArray[np.float32], lenses: NDArray[np.intp] | None = None) -> None:
        """What cars do from now until their next pictures.

        Args:
            commands: Steering angle in rad and speed in m/s; NaN where it is not known  (N, 2).
            lenses: Whose cars they are, each once; by default of the first N  (N,).
        """
        if len(commands):
            which = self._places(len(commands), lenses)
            self._commands[which] = commands

    def forget(self, lenses: NDArray[np.intp] | NDArray[np.bool_] | None = None) -> None:
        """Begin anew with some lenses, whose next picture is of another place; by default with all."""
        if lenses is None:
            self._states, self._commands = self._states[:0], self._commands[:0]
        else:
            which = np.flatnonzero(lenses) if lenses.dtype == np.bool_ else lenses
            known = which[which < len(self._states)]  # of the others nothing was seen
            self._states[known], self._commands[known] = 0.0, np.nan

    def film(
        self,
        frames: NDArray[np.uint8],
        is_first: NDArray[np.bool_],
        is_of_film: NDArray[np.bool_] | None = None,
        commands: NDArray[np.float32] | None = None,
    ) -> Belief:
        """What is believed of pictures of the first lens, one after the other; it goes on where the last call ended.

        Args:
            frames: Grey uint8 (T, 120, 160).
            is_first: Whether a picture does not follow the one before  (T,).
            is_of_film: Which of them are; the others are looked at by themselves. By default all  (T,).
            commands: What the car did since the picture before, as of `tell`; by default it is not known  (T, 2).

        Raises:
            ShapeError: The pictures are not of this type and shape.
        """
        outputs, memory = self.perceiver.outputs(frames), self.perceiver.memory
        if memory is None:
            return believe(outputs)
        told = unknown(len(frames)) if commands is None else commands
        self._places(1, None)
        state = self._states[:1]
        for place in range(len(frames)) if is_of_film is None else np.flatnonzero(is_of_film).tolist():
            here = slice(place, place + 1)
            outputs[here], state = memory(outputs[here], told[here], unseen(1) if is_first[place] else state)
        self._states[:1] = state
        return believe(outputs)

    def _places(self, count: int, lenses: NDArray[np.intp] | None) -> NDArray[np.intp]:
        """Which lenses are meant, and a place for each that there was not yet."""
        which = np.arange(count) if lenses is None else lenses
        missing = int(which.max()) + 1 - len(self._states)
        if missing > 0:
            self._states = np.concatenate([self._states, unseen(missing)])
            self._commands = np.concatenate([self._commands, unknown(missing)])
        return which
