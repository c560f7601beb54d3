"""A policy as a physical car would drive it, in the simulator.

camera 640 x 480 -> *car_picture* -> network of the exported file -> argmax or clip -> shares of lock and throttle
                                                                 -> *CarCalibration* -> angle and speed
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.agent.action_space import ActionSpace, ContinuousActionSpace, DiscreteActionSpace
from racecraft.agent.sensors import FRAME_HEIGHT, FRAME_WIDTH
from racecraft.car.calibration import CarCalibration
from racecraft.car.command import Floats
from racecraft.learn import distributions
from racecraft.race.policy import NetworkPolicy
from racecraft.sim.camera import CameraSpec

SCALE: Final = 4
CAR_CAMERA: Final = CameraSpec(width=SCALE * FRAME_WIDTH, height=SCALE * FRAME_HEIGHT)
"""What the car's camera gives before the car's software makes it smaller."""


def car_picture(frames: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Pictures as the car's software makes them smaller: bilinear without smoothing, so of 4 x 4 pixels 4 count.

    Grey before or after is the same here, but for the rounding: it is a weighted sum, too.

    Args:
        frames: Grey  (..., 480, 640).

    Returns:
        (..., 120, 160).
    """
    *others, height, width = frames.shape
    squares = frames.reshape(*others, height // SCALE, SCALE, width // SCALE, SCALE)
    sums = squares[..., 1:3, :, 1:3].sum(axis=(-3, -1), dtype=np.uint16)
    return np.asarray((sums + 2) >> 2, dtype=np.uint8)


class CarPolicy(NetworkPolicy):
    """What a car does with a policy. It remembers what was chosen and what came of it.

    Args:
        policy: Read from the exported file.
        car: What was measured.
    """

    def __init__(self, policy: NetworkPolicy, car: CarCalibration) -> None:
        super().__init__(policy.learner, _resulting(policy.action_space, car), sensors=policy.sensors)
        self.listed: ActionSpace = policy.action_space
        """What the model may choose; `action_space` is what the car makes of it, which is what a sim-trace holds."""
        self.car = car
        self.chosen: list[Floats] = []
        """rad and m/s as the metadata lists them, a step each  (N, 2)."""
        self.resulting: list[Floats] = []
        """rad of the wheels and m/s  (N, 2)."""

    def __call__(self, frames: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Commands (N, 2) for what the sensors of `CAR_CAMERA` read."""
        outputs = self.learner.policy(self.learner.encode(self._sight(frames)))
        chosen = self._choose(outputs)
        resulting = self.car.commands(chosen, self.listed)
        self.chosen.append(chosen)
        self.resulting.append(resulting)
        return resulting.astype(np.float32)

    def _sight(self, frames: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The same with smaller pictures."""
        if not self.sensors.lidar_name:
            return car_picture(frames)
        count, size = len(frames), self.sensors.lenses * CAR_CAMERA.height * CAR_CAMERA.width
        pictures = frames[:, :size].reshape(count, self.sensors.lenses, CAR_CAMERA.height, CAR_CAMERA.width)
        return np.concatenate([car_picture(pictures).reshape(count, -1), frames[:, size:]], axis=1)

    def _choose(self, outputs: NDArray[np.float32]) -> Floats:
        """The largest probability's action as it is listed, or what is clipped to ±1 on its scale."""
        spec, space = self.learner.spec, self.listed
        best = distributions.most_likely(outputs, is_discrete=spec.is_discrete, is_squashed=spec.is_squashed)
        if isinstance(space, ContinuousActionSpace):
            share = (best.astype(np.float64) + 1.0) / 2
            return np.asarray(space.low + share * (space.high - space.low))
        return np.asarray(space.table[best])


def _resulting(space: ActionSpace, car: CarCalibration) -> ActionSpace:
    """A table of what the car makes of each action; a continuous space is left as it is."""
    if isinstance(space, ContinuousActionSpace):
        return space
    return DiscreteActionSpace(car.commands(space.table, space))
