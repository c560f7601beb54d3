"""Several learning cars on one track, as a PettingZoo environment."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Unpack

import gymnasium
import numpy as np
from numpy.typing import NDArray

from racecraft.checks import check_type, check_whole
from racecraft.env.info import single_info
from racecraft.env.observation import Observation
from racecraft.env.rendering import Renderer, check_render_mode
from racecraft.env.task import DrivingTask, TaskSettings, check_names, of_one_car, seed_key
from racecraft.errors import ConfigError, ResetNeeded, ShapeError
from racecraft.extras import needed_for
from racecraft.sim.columns import STATUS_NAMES
from racecraft.track import Track

with needed_for("The environment of several learning cars"):
    from pettingzoo import ParallelEnv  # type: ignore[import-untyped]

StepResult = tuple[
    dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]
]


class RacecraftParallelEnv(ParallelEnv[str, Observation, Any]):  # type: ignore[misc]  # PettingZoo has no types
    """A race of up to eight agents' cars, each as `RacecraftEnv` has one; its datasheet describes spaces and rewards.

    ```python
    from racecraft.env import RacecraftParallelEnv

    race = RacecraftParallelEnv(track="oval", num_cars=4)
    observations, infos = race.reset(seed=1)
    ```

    The cars see and hit each other. They start on a staggered grid, ``car_0`` in front. Who is done (lap complete, off
    the track, crashed ...) leaves the race; it ends when nobody is left. A car is crashed when it runs into what is
    ahead of it; whoever is hit from behind drives on.

    Args:
        track: Name in `racecraft tracks`, file, or `Track`.
        num_cars: Agents, 1 to 8.
        render_mode: None or ``rgb_array``: the foremost of the cars that still race, from behind.
        **settings: As for `RacecraftEnv`; a reward function sees the others as objects.

    Raises:
        ConfigError: A setting is not allowed.
        RewardError: The reward function is not valid.
    """

    metadata: ClassVar[dict[str, Any]] = {
        "name": "racecraft_v0",
        "render_modes": ["rgb_array"],
        "render_fps": 15,
        "is_parallelizable": True,
    }

    def __init__(
        self,
        track: str | Path | Track = "reinvent_2018",
        *,
        num_cars: int = 2,
        render_mode: str | None = None,
        **settings: Unpack[TaskSettings],
    ) -> None:
        check_names(settings, own=("track", "num_cars", "render_mode"))
        check_whole("num_cars", num_cars, 1, 8)
        check_render_mode(render_mode)
        self.render_mode = render_mode
        self._task = DrivingTask(track, num_envs=num_cars, cars_per_race=num_cars, num_threads=1, **settings)
        self._renderer = Renderer(self._task.simulation) if render_mode else None
        self.possible_agents = [f"car_{car}" for car in range(num_cars)]
        self.agents: list[str] = []
        self._cars = {agent: car for car, agent in enumerate(self.possible_agents)}
        self.observation_spaces: dict[str, gymnasium.Space[Any]]
        self.action_spaces: dict[str, gymnasium.Space[Any]]
        # A space of its own for each agent: whoever seeds one leaves the others alone.
        self.observation_spaces, self.action_spaces = {}, {}
        for agent in self.possible_agents:
            self.observation_spaces[agent] = self._task.observer.space
            self.action_spaces[agent] = self._task.action_space.space
        self._rng = np.random.default_rng()
        self._has_key = False

    def observation_space(self, agent: str) -> gymnasium.Space[Any]:
        """The space of an agent's observation; always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.Space[Any]:
        """The space of an agent's action; always the same object."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Begin the next race; with a seed, the first of the races that belong to this seed.

        Args:
            seed: Key of all random numbers. Without one, the first reset draws it.
            options: None are known; they are ignored.
        """
        key = None if seed is None else seed_key(seed)
        if key is None and not self._has_key:
            key = int(self._rng.integers(2**63))
        everyone = np.ones(len(self.possible_agents), dtype=np.bool_)
        self._task.reset(everyone, seeds=None if key is None else np.full(len(everyone), key, dtype=np.uint64))
        self._has_key = True
        self.agents = list(self.possible_agents)
        rows = self._task.simulation.rows
        return self._observe(self.agents), {agent: single_info(rows[self._cars[agent]]) for agent in self.agents}

    def step(self, actions: dict[str, Any]) -> StepResult:
        """Drive for 1/15 s.

        Args:
            actions: One for each agent that still races.

        Returns:
            Observations, rewards, terminations, truncations and infos of those agents.

        Raises:
            ResetNeeded: No race is under way.
            ConfigError: An agent that races has no action, or one that does not exist.
            ShapeError: An action has another form than the action space's.
            NonFiniteAction: An action holds NaN.
            RewardError: The reward function failed.
        """
        if not self.agents:
            raise ResetNeeded("step() was called while no race is under way; call reset() first.")
        check_type("actions", actions, Mapping, "use a dict of agents and their actions")
        missing = [agent for agent in self.agents if agent not in actions]
        if missing:
            raise ConfigError(f"actions lack {', '.join(missing)}; every agent in `agents` needs one.")
        task, racing = self._task, self.agents
        idle = racing[0]  # whoever has left the race stands, whatever it is told
        given = [of_one_car(actions[agent if agent in racing else idle]) for agent in self.possible_agents]
        shapes = {agent: one.shape[1:] for agent, one in zip(self.possible_agents, given, strict=True)}
        if len(set(shapes.values())) > 1:
            raise ShapeError(f"The actions have different shapes, {shapes}; allowed is that of the action space.")
        rewards = task.step(np.concatenate(given), paid=np.array([agent in racing for agent in self.possible_agents]))
        simulation = task.simulation
        laps = task.lap_times()
        results: StepResult = (self._observe(racing), {}, {}, {}, {})
        for agent in racing:
            car = self._cars[agent]
            results[1][agent] = float(rewards[car])
            results[2][agent] = bool(simulation.terminated[car])
            results[3][agent] = bool(simulation.truncated[car])
            results[4][agent] = single_info(simulation.rows[car])
            if laps is not None and laps[0][car]:
                results[4][agent]["lap_time"] = float(laps[1][car])
        self.agents = [agent for agent in racing if not (results[2][agent] or results[3][agent])]
        return results

    def render(self) -> NDArray[np.uint8] | None:
        """The scene as uint8 (480, 640, 3) if ``render_mode`` is ``rgb_array``."""
        if self._renderer is None:
            return None
        racing = [self._cars[agent] for agent in self.agents] or [0]
        places = self._places()
        return self._renderer.frame(max(racing, key=lambda car: places[car]))

    def close(self) -> None:
        """End the reward's process; calling again does nothing."""
        self.agents = []
        self._task.close()

    def _places(self) -> NDArray[np.float64]:
        """Laps that every car is ahead of where car 0 began: each counts its own from its place in the grid."""
        simulation = self._task.simulation
        length, distance = simulation.column("track_length"), simulation.column("projection_distance")
        began = distance / length - simulation.column("progress")
        began -= began[0]
        if simulation.tracks[0].is_closed:
            began -= np.round(began)
        has_lap = simulation.column("status") == STATUS_NAMES.index("lap_complete")  # counted already
        return began + simulation.column("lap") + np.where(has_lap, 0.0, simulation.column("progress"))

    def _observe(self, agents: list[str]) -> dict[str, Observation]:
        return {agent: self._task.observer.one(self._cars[agent]) for agent in agents}
