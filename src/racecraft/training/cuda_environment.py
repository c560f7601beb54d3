"""What PPO drives on a GPU: simulator and rewards whose arrays stay there.

commands -> *CudaSimulation* -> rows -> *CudaReward*, or the worker process on the CPU -> rewards
                 └-> frames, state -> policy
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.agent.action_space import ActionSpace
from racecraft.reward.cuda import CudaReward
from racecraft.reward.numeric import NotNumeric
from racecraft.reward.worker import RewardWorker
from racecraft.run import Episode, EpisodeCounter
from racecraft.sim import Simulation, Start
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.sim.cuda_simulation import SOURCES, CudaSimulation
from racecraft.track import Track

PROVING_CARS: Final = 64
PROVING_STEPS: Final = 40


class CudaTrainingEnvironment:
    """A batch of cars with rewards on a device; an implementation of `DeviceEnvironment` of ``learn.torch_cuda_ppo``.

    A reward function that is purely numeric runs there as well, once it gave the interpreter's rewards on recorded
    steps. Any other is asked on the CPU, which costs a copy of all rows and a call per car and step; so is somebody
    else's, as nothing could end a loop on the GPU.

    Args:
        simulation: The cars.
        worker: The interpreter.
        source: Text of the reward function.
        action_space: Turns the policy's actions into commands.
        counter: Numbers the episodes.
        note: Is told once how rewards are computed.
    """

    def __init__(
        self,
        simulation: CudaSimulation,
        worker: RewardWorker,
        source: str,
        action_space: ActionSpace,
        *,
        counter: EpisodeCounter,
        note: Callable[[str], None],
    ) -> None:
        self.simulation = simulation
        self.worker = worker
        self.counter = counter
        self.reward_seconds = 0.0
        self.trace_seconds = 0.0
        self._action_space = action_space
        self._finished: list[Episode] = []
        device = simulation.device
        self._rewards = device.allocate(8 * simulation.num_envs)
        self._rows = simulation.address("rows")
        self._width = simulation.judged.shape[1]
        self._kernel: CudaReward | None = None
        try:
            if worker.foreign:
                raise NotNumeric("it comes from somebody else")
            if simulation.objects.count:
                raise NotNumeric("there are objects on the track")
            kernel = CudaReward(source, simulation.tracks, device=device, width=self._width, include=SOURCES)
            kernel.prove(worker, recorded_rows(simulation.tracks))
            self._kernel = kernel
            note("The reward function runs on the GPU.")
        except NotNumeric as reason:
            note(f"The reward function is interpreted on the CPU, far slower than on the GPU: {reason}.")
        self.is_capturable = self._kernel is not None

    @property
    def shown(self) -> Simulation:
        """A car on the CPU that stands for those on the device."""
        return self.simulation.template

    @property
    def num_envs(self) -> int:
        """N, the number of cars."""
        return self.simulation.num_envs

    def arrays(self) -> dict[str, Any]:
        """Frames, state, judged rows, flags and rewards, on the device."""
        simulation = self.simulation
        return {
            "frames": simulation.frames,
            "state": simulation.state,
            "rows": simulation.judged,
            "terminated": simulation.terminated,
            "truncated": simulation.truncated,
            "rewards": simulation.device.array(self._rewards, (simulation.num_envs,), np.float64),
        }

    def command_table(self) -> NDArray[np.float32]:
        """Commands of every discrete action (A, 2), or of the lowest and highest continuous one (2, 2)."""
        space = self._action_space
        if space.kind == "discrete":
            return space.to_commands(np.arange(space.size))
        return space.to_commands(np.array([[-1.0, -1.0], [1.0, 1.0]]))

    def use_stream(self, stream: int) -> None:
        """Queue everything from now on in this CUDA stream."""
        self.simulation.stream = stream

    def move(self, commands: Any) -> None:
        """Judge and move with commands float32 (N, 2), and pay.

        Raises:
            RewardError: The user's function failed.
        """
        simulation = self.simulation
        simulation.move(commands)
        if self._kernel is not None:
            self._kernel.pay(self._rows, self._rewards, count=simulation.num_envs, stream=simulation.stream)
            return
        begun = time.perf_counter()
        device, count = simulation.device, simulation.num_envs
        rows = device.read(self._rows, 8 * count * self._width).view(np.float64).reshape(count, self._width)
        device.write(self._rewards, self.worker(rows))
        self.reward_seconds += time.perf_counter() - begun

    def restart_finished(self) -> None:
        """Begin the next episode of every car whose episode is over."""
        self.simulation.restart_finished()

    def draw(self) -> None:
        """Frames of the cars that moved."""
        self.simulation.draw()

    def end_episodes(self, cars: NDArray[np.int64], returns: NDArray[np.float64], rows: NDArray[np.float64]) -> None:
        """Number the episodes that ended."""
        for car, total, row in zip(cars.tolist(), returns.tolist(), rows, strict=True):
            self._finished.append(self.counter.end(car, row, reward=total))

    def take_finished(self) -> list[Episode]:
        """The episodes that ended since the last call."""
        finished, self._finished = self._finished, []
        return finished


def recorded_rows(tracks: Sequence[Track]) -> NDArray[np.float64]:
    """Steps of cars that drive at random over all tracks, in both directions  (R, len(ROW_COLUMNS))."""
    start = Start(mode="random", lateral_jitter=0.3, heading_jitter=1.0)
    cars = max(PROVING_CARS, 2 * len(tracks))
    simulation = Simulation(tracks, num_envs=cars, camera=None, start=start, direction="alternate", max_steps=25)
    rng = np.random.default_rng(0)
    rows = [simulation.rows.copy()]
    for _ in range(PROVING_STEPS):
        simulation.step(np.column_stack([rng.uniform(-0.5, 0.5, cars), rng.uniform(0.0, 4.0, cars)]))
        rows.append(simulation.rows.copy())
        simulation.reset(simulation.terminated | simulation.truncated)
    return np.concatenate(rows).reshape(-1, len(ROW_COLUMNS))
