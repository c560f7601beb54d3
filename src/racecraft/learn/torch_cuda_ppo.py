"""PPO whose rollout never leaves the GPU: simulator, network, rewards, advantages and updates on one device.

    frames -> encode -> policy -> actions -> commands -> move -> rewards -> restart -> draw -> frames
    └──────────────────── one CUDA graph for all steps of a rollout ────────────────────────┘
    minibatch -> loss -> gradient -> Adam                                one CUDA graph for a gradient step

The algorithm is `PPO`'s. What differs: random numbers are torch's, and a car whose episode is over restarts at once.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from racecraft.errors import ConfigError, TrainingError
from racecraft.learn.learner import UpdateStats
from racecraft.learn.ledger import Ended
from racecraft.learn.ppo import PPO, IterationStats, PPOConfig
from racecraft.learn.torch_cuda_learner import CudaLearner
from racecraft.learn.torch_losses import gaussian, gaussian_densities

_WARM_UPS = 2  # runs before a graph is captured: libraries choose their kernels in them


class DeviceEnvironment(Protocol):
    """Cars whose arrays lie where the learner's do; see ``racecraft.training.cuda_environment``."""

    is_capturable: bool
    """Whether a step only queues work, so that a CUDA graph can hold it."""

    @property
    def num_envs(self) -> int:
        """N, the number of cars."""

    def arrays(self) -> dict[str, Any]:
        """For torch.as_tensor: frames (N, H, W), state (N, S), rows (N, columns), terminated, truncated, rewards."""

    def command_table(self) -> NDArray[np.float32]:
        """Commands of every discrete action (A, 2); of continuous ones the lowest and the highest command (2, 2)."""

    def use_stream(self, stream: int) -> None:
        """Queue everything from now on in this CUDA stream."""

    def move(self, commands: Any) -> None:
        """Judge and move with commands float32 (N, 2), and pay."""

    def restart_finished(self) -> None:
        """Begin the next episode of every car whose episode is over."""

    def draw(self) -> None:
        """Frames of the cars that moved."""

    def end_episodes(self, cars: NDArray[np.int64], returns: NDArray[np.float64], rows: NDArray[np.float64]) -> None:
        """Episodes ended, in this order: their cars (E,), sums of rewards (E,) and last rows (E, columns)."""


class CudaPPO(PPO):
    """The algorithm of `PPO` on a device.

    Args:
        config: Settings; whole episodes and e-greedy exploration are not for a GPU.
        learner: The network.
        environment: The cars.
        seed: Decides all sampling and shuffling, together with the number of the iteration.

    Raises:
        ConfigError: The settings do not fit.
    """

    learner: CudaLearner

    def __init__(
        self, config: PPOConfig, learner: CudaLearner, environment: DeviceEnvironment, *, seed: int = 0
    ) -> None:
        if config.episodes_per_iteration or config.exploration != "categorical":
            raise ConfigError(
                "Device 'cuda' trains after a fixed number of steps, with categorical exploration; these settings "
                "ask for whole episodes or e-greedy exploration.",
                hint="Use device 'cpu' for AWS's hyperparameters.",
            )
        super().__init__(config, learner, environment, seed=seed)  # type: ignore[arg-type]
        self.cars = environment
        device, spec = learner.device, learner.spec
        steps, cars = config.num_steps, config.num_envs
        arrays = {name: torch.as_tensor(array, device=device) for name, array in environment.arrays().items()}
        self._frames, self._state, self._rows = arrays["frames"], arrays["state"], arrays["rows"]
        self._terminated, self._truncated, self._paid = arrays["terminated"], arrays["truncated"], arrays["rewards"]
        self._table = torch.from_numpy(environment.command_table()).to(device)

        def store(*shape: int, dtype: torch.dtype = torch.float32) -> Tensor:
            return torch.zeros((steps, cars, *shape), dtype=dtype, device=device)

        self._observations = store(*learner.observation_shape, dtype=torch.uint8)
        self._states = store(spec.state_size)
        self._actions = store(dtype=torch.int64) if spec.is_discrete else store(spec.num_actions)
        self._log_probs, self._rewards, self._next_values = store(), store(), store()
        self._ends, self._cuts = store(dtype=torch.bool), store(dtype=torch.bool)
        self._sums, self._judged = store(dtype=torch.float64), store(self._rows.shape[1], dtype=torch.float64)
        self._running = torch.zeros(cars, dtype=torch.float64, device=device)
        self._advantages, self._returns = store().view(-1), store().view(-1)
        self._picked = torch.zeros(min(config.minibatch_size, steps * cars), dtype=torch.int64, device=device)
        self._losses = torch.zeros(6, device=device)
        self._generator = torch.Generator(device)
        self._stream: Any = torch.cuda.Stream(device) if device.type == "cuda" else None  # type: ignore[no-untyped-call]
        self._graphs: dict[str, Any] = {}
        self._runs: dict[str, int] = {}
        self.uses_graphs = self._stream is not None
        """Whether what can be captured is; set it before the first iteration."""

    def iterate(self) -> IterationStats:
        """Collect one rollout and improve the policy on it.

        Raises:
            TrainingError: Loss or gradient is not finite; the steps where they were not have not been taken.
        """
        with self._own_stream():
            return self._iterate()

    def _iterate(self) -> IterationStats:
        self._generator.manual_seed((self.seed << 32) + self.iteration)
        started = time.perf_counter()
        self._run("rollout", self._collect_all, is_capturable=self.cars.is_capturable)
        ended = self._tell_episodes()
        collected = time.perf_counter()
        explained = self._estimate_all()
        losses = self._improve()
        self._average.add(iteration=self.iteration + 1)
        steps = self.config.num_steps * self.config.num_envs
        self.iteration += 1
        self.total_steps += steps
        return IterationStats(
            iteration=self.iteration,
            total_steps=self.total_steps,
            num_steps=steps,
            ended=tuple(ended),
            losses=losses,
            explained_variance=explained,
            environment_seconds=collected - started,  # with the policy: they are one graph
            policy_seconds=0.0,
            update_seconds=time.perf_counter() - collected,
        )

    # ---- collect

    def _collect_all(self) -> None:
        for t in range(self.config.num_steps):
            self._collect_step(t)

    @torch.no_grad()
    def _collect_step(self, t: int) -> None:
        """See, act, be paid: row t of the rollout."""
        learner, size = self.learner, self.learner.spec.state_size
        observations = learner.encode_frames(self._frames)
        actions, log_probs = self._choose(learner.outputs(observations))
        self._observations[t].copy_(observations)
        self._states[t].copy_(self._state[:, :size])
        self._actions[t].copy_(actions)
        self._log_probs[t].copy_(log_probs)
        self.cars.move(self._commands(actions))
        self._rewards[t].copy_(self._paid)
        self._ends[t].copy_(self._terminated)
        self._cuts[t].copy_(self._truncated & ~self._terminated)
        if not size:
            self.cars.draw()
            observations = learner.encode_frames(self._frames)
        self._next_values[t].copy_(learner.estimates(observations, self._state[:, :size].contiguous()))
        self._running += self._paid
        self._sums[t].copy_(self._running)
        self._judged[t].copy_(self._rows)
        self._running.masked_fill_(self._terminated | self._truncated, 0.0)
        self.cars.restart_finished()
        self.cars.draw()

    def _choose(self, outputs: Tensor) -> tuple[Tensor, Tensor]:
        """Draw actions, and their log-probabilities under the policy."""
        if self.learner.spec.is_discrete:
            log_probs = torch.log_softmax(outputs, dim=1)
            noise = torch.rand(outputs.shape, generator=self._generator, device=outputs.device)
            # The largest of log p plus Gumbel noise is a draw from p.
            actions = (log_probs - torch.log(-torch.log(noise.clamp(1e-20, 1 - 1e-7)))).argmax(dim=1)
            return actions, log_probs.gather(1, actions[:, None])[:, 0]
        mean, log_std = gaussian(outputs)
        noise = torch.randn(mean.shape, generator=self._generator, device=outputs.device)
        return mean + noise * log_std.exp(), gaussian_densities(noise, log_std).sum(1)

    def _commands(self, actions: Tensor) -> Tensor:
        if self.learner.spec.is_discrete:
            return self._table[actions]
        share = (actions.clamp(-1.0, 1.0) + 1.0) * 0.5
        return self._table[0] * (1.0 - share) + self._table[1] * share

    def _tell_episodes(self) -> list[Ended]:
        """Hand the episodes that ended to the environment."""
        steps, cars = (self._ends | self._cuts).nonzero(as_tuple=True)
        if not torch.isfinite(self._rewards).all():
            raise TrainingError(
                "A reward is not a number.", hint="Train on device 'cpu' to see the line and the params at fault."
            )
        totals, rows = self._sums[steps, cars].cpu().numpy(), self._judged[steps, cars].cpu().numpy()
        self.cars.end_episodes(cars.cpu().numpy(), totals, rows)
        lengths = (rows[:, 1] - 1).astype(int)
        return list(map(Ended, cars.tolist(), totals.tolist(), lengths.tolist()))

    # ---- estimate

    @torch.no_grad()
    def _estimate_all(self) -> float:
        """Fill advantages and returns, normalised as `PPO` does it; the share of variance that the critic explains."""
        config = self.config
        shape = self._rewards.shape
        mean, spread = (float(number) for number in self.return_scale)
        observations = self._observations.view(-1, *self._observations.shape[2:])
        estimates = self.learner.estimates(observations, self._states.view(-1, self._states.shape[2]))
        values = estimates.view(shape) * spread + mean
        next_values = self._next_values * spread + mean
        advantages = torch.zeros_like(values)
        carried = torch.zeros_like(values[0])
        last = shape[0] - 1
        for t in range(last, -1, -1):
            following = next_values[t] if t == last else torch.where(self._cuts[t], next_values[t], values[t + 1])
            following = following.masked_fill(self._ends[t], 0.0)
            delta = self._rewards[t] + config.gamma * following - values[t]
            over = self._ends[t] | self._cuts[t]
            carried = delta + config.gamma * config.gae_lambda * carried.masked_fill(over, 0.0)
            advantages[t] = carried
        returns = advantages + values
        wide = (returns.double(), advantages.double())
        found = torch.stack([moment for x in wide for moment in (x.mean(), x.std(correction=0))])
        return_mean, return_spread, centre, scale = found.tolist()
        if config.normalize_returns:
            seen = np.array([return_mean, max(return_spread, 1e-6)])
            self.return_scale = seen if self.iteration == 0 else 0.9 * self.return_scale + 0.1 * seen
        mean, spread = (float(number) for number in self.return_scale)
        self._returns.copy_(((returns - mean) / spread).view(-1))
        self._advantages.copy_(((advantages - centre) / (scale + 1e-8)).view(-1))
        return 1 - (scale / return_spread) ** 2 if return_spread > 0 else float("nan")

    # ---- update

    def _improve(self) -> UpdateStats:
        config = self.config
        everything, size = len(self._returns), len(self._picked)
        self._losses.zero_()
        count = 0
        for _ in range(config.update_epochs):
            order = torch.randperm(everything, generator=self._generator, device=self._returns.device)
            for start in range(0, everything - size + 1, size):  # a last partial one is dropped
                self._picked.copy_(order[start : start + size])
                self._run("update", self._improve_once, is_capturable=True)
                count += 1
        stats = UpdateStats.of((self._losses / count).tolist())
        if not stats.is_finite:
            raise TrainingError(
                f"The loss is {stats.policy_loss + stats.value_loss} with gradient norm {stats.grad_norm} in "
                f"iteration {self.iteration + 1}; such steps were not taken.",
                hint="Lower learning_rate, set max_grad_norm, or look for huge rewards.",
            )
        return stats

    def _improve_once(self) -> None:
        rows = self._picked
        samples = (
            self._observations.view(-1, *self._observations.shape[2:])[rows],
            self._states.view(-1, self._states.shape[2])[rows],
            self._actions.view(-1, *self._actions.shape[2:])[rows],
            self._log_probs.view(-1)[rows],
            self._advantages[rows],
            self._returns[rows],
        )
        self._losses += self.learner.step(samples, self.config.objective)

    # ---- graphs, resume

    def _run(self, name: str, work: Callable[[], None], *, is_capturable: bool) -> None:
        """Do the work: twice as it is written, to warm up, and from then on as one CUDA graph where that can be."""
        self._runs[name] = self._runs.get(name, 0) + 1
        if not (self.uses_graphs and is_capturable) or self._runs[name] <= _WARM_UPS:
            work()
            return
        if name not in self._graphs:
            graph = torch.cuda.CUDAGraph()
            graph.register_generator_state(self._generator)
            with torch.cuda.graph(graph, stream=self._stream):
                work()
            self._graphs[name] = graph
        self._graphs[name].replay()

    @contextmanager
    def _own_stream(self) -> Iterator[None]:
        """Within, torch and the simulator queue their work in one stream that may be captured."""
        if self._stream is None:
            yield
            return
        self._stream.wait_stream(torch.cuda.current_stream(self.learner.device))
        with torch.cuda.stream(self._stream):
            self.cars.use_stream(self._stream.cuda_stream)
            try:
                yield
            finally:
                self._stream.synchronize()
                self.cars.use_stream(0)

    def state(self) -> dict[str, NDArray[Any]]:
        """Everything needed to continue, except where the cars are; the names of `PPO`."""
        self._loop.totals[:] = self._running.cpu().numpy()
        return super().state()

    def load_state(self, state: dict[str, NDArray[Any]]) -> None:
        """Continue from what ``state`` gave."""
        super().load_state(state)
        self._running.copy_(torch.from_numpy(self._loop.totals))
