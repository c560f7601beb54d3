"""One car as a Gymnasium environment: an adapter over the simulation, which is its own documentation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Unpack

import gymnasium
import numpy as np

from racecraft.agent import DiscreteActionSpace
from racecraft.env.info import single_info
from racecraft.env.observation import Observation
from racecraft.env.opponents import Driver, Opponents, check_opponents
from racecraft.env.rendering import Renderer, check_render_mode
from racecraft.env.task import MOST_STEPS, DrivingTask, TaskSettings, check_names, of_one_car, seed_key
from racecraft.errors import ConfigError, ResetNeeded
from racecraft.track import Track


class RacecraftEnv(gymnasium.Env[Observation, Any]):
    """A 1/18-scale car learns to drive laps from what its camera sees.

    ## Description

    The car of AWS DeepRacer on a track laid on the floor of a hall. Fifteen times a second it chooses a
    steering angle and a speed; the wheels follow with a lag, and tyres slip. As in the original, a step
    first *judges* the pose with the action that is about to act (reward, rules, info), then moves the
    car, then looks.

    ```python
    import gymnasium, racecraft.env

    env = gymnasium.make("Racecraft-v0", track="oval")
    ```

    ## Action Space

    With `action_space="default"`, `"aws"`, `"fast"`, `"safe"`, `"steady"` or a discrete `model_metadata.json`, a
    `Discrete(n)` of table rows:

    | Preset    | n  | Steering (degrees, left positive) | Speed (m/s)          |
    |-----------|----|-----------------------------------|----------------------|
    | `default` | 10 | -30, -15, 0, 15, 30               | 1, 2                 |
    | `aws`     | 10 | -30, -15, 0, 15, 30               | 0.5, 1               |
    | `fast`    | 21 | -30, -20, -10, 0, 10, 20, 30      | 1.33333, 2.66667, 4  |
    | `safe`    | 14 | -30, -20, -10, 0, 10, 20, 30      | 0.7, 1.4             |
    | `steady`  | 5  | -30, -15, 0, 15, 30               | 1                    |

    Row `i` is steering `i // speeds` with speed `i % speeds`; `env.unwrapped.commands` lists them. With
    `action_space="continuous"` or a continuous file, a `Box(-1.0, 1.0, (2,), float32)`, scaled linearly:

    | Num | Action         | -1            | +1           |
    |-----|----------------|---------------|--------------|
    | 0   | steering angle | -30° (right)  | 30° (left)   |
    | 1   | speed          | 0.5 m/s       | 4 m/s        |

    ## Observation Space

    `observation="camera"`: `Box(0, 255, (120, 160, 1), uint8)`, grey pixels, row 0 on top, channel last.

    `observation="state"`: `Box(..., (16,), float32)`, what a perfect sensor would know, clipped to the
    bounds:

    | Num | Observation       | Min | Max | Unit                                  |
    |-----|-------------------|-----|-----|---------------------------------------|
    | 0   | speed             | -2  | 2   | 4 m/s                                 |
    | 1   | lateral_speed     | -4  | 4   | m/s, left positive                    |
    | 2   | yaw_rate          | -4  | 4   | 4 rad/s, counter-clockwise            |
    | 3   | steering          | -2  | 2   | 30 degrees, of the wheels             |
    | 4   | offset            | -4  | 4   | half the track's width, left positive |
    | 5   | sin_heading_error | -1  | 1   | against the centre line               |
    | 6   | cos_heading_error | -1  | 1   | against the centre line               |
    | 7   | half_width        | 0   | 4   | m                                     |
    | 8   | curvature_0       | -10 | 10  | 1/m, here, left positive              |
    | 9   | curvature_1       | -10 | 10  | 1/m, 0.25 m ahead                     |
    | 10  | curvature_2       | -10 | 10  | 1/m, 0.5 m ahead                      |
    | 11  | curvature_3       | -10 | 10  | 1/m, 0.75 m ahead                     |
    | 12  | curvature_4       | -10 | 10  | 1/m, 1 m ahead                        |
    | 13  | curvature_5       | -10 | 10  | 1/m, 1.5 m ahead                      |
    | 14  | curvature_6       | -10 | 10  | 1/m, 2 m ahead                        |
    | 15  | curvature_7       | -10 | 10  | 1/m, 3 m ahead                        |

    With `objects` or `opponents`, six more numbers tell of the next two ahead: closeness, offset and speed of each.

    `observation="both"`: a `Dict` with `camera` and `state`.

    With `sensors`, a `Dict` of what AWS's networks take: cameras `Box(0, 255, (120, 160, 1 or 2), uint8)`, LIDARs
    `Box(0.0, 1.0, ...)` of 64, 8, or sectors times values numbers.

    ## Rewards

    What `reward_function(params)` returns for the judged pose and action, `params` being AWS's dict. By
    default the preset `racing`: metres about to be gained along the track, less near its borders, and -1
    off the track. A source or a file runs in a process of its own; a callable runs in this one and is
    trusted.

    ## Info

    Every column of the judged row by its name in `racecraft.sim.ROW_COLUMNS`, in SI units and radians:
    `progress` (a fraction of the lap), `lap`, `time`, `offset`, `is_offtrack` and so on; `status` as a
    word, and `episode` as `episode_number`. A step that completes a lap adds `lap_time` in seconds.

    ## Starting State

    Standing on the centre line, heading along it: anywhere on the lap (`start="random"`), at the first
    waypoint (`"fixed"`), or 5 % of a lap further with every episode (`"advance"`, as AWS trains). An open
    track starts at its beginning. `reset(seed=...)` begins anew: same seed, settings and actions give the
    same bits.

    ## Episode End

    Termination, `status` says which:

    1. `lap_complete`: the last of `laps` is done.
    2. `off_track`: no wheel is on the track.
    3. `reversed`: progress fell in 15 consecutive steps.
    4. `immobilized`: the car stood for 15 steps.
    5. `crashed`: the car ran into an object.

    Truncation:

    1. `max_episode_steps` steps were taken.

    ## Arguments

    | Argument            | Default         | Meaning                                                        |
    |---------------------|-----------------|----------------------------------------------------------------|
    | `track`             | `reinvent_2018` | name in `racecraft tracks`, file, or `Track`                   |
    | `reward`            | `racing`        | preset, file, source text, or callable                         |
    | `action_space`      | `default`       | preset, `model_metadata.json`, or `ActionSpace`                |
    | `observation`       | `camera`        | `camera`, `state` (many times faster) or `both`                |
    | `camera`            | `CameraSpec()`  | size, lens and place of the driver's camera                    |
    | `vehicle`           | `v5`            | preset, file, or `Vehicle`                                     |
    | `randomize`         | `none`          | preset, file, or `racecraft.Randomization` of every episode    |
    | `sensors`           | None            | AWS's sensor names, for a `Dict` of what each of them sees     |
    | `lidar`             | None            | `LidarConfig` of `DISCRETIZED_SECTOR_LIDAR`                    |
    | `objects`           | None            | boxes and bot cars: `racecraft.sim.Objects`                    |
    | `start`             | `random`        | `random`, `advance`, `fixed`, or a `Start` with jitter         |
    | `direction`         | `forward`       | `forward`, `reverse`, or `alternate` with every episode        |
    | `laps`              | `1`             | laps to an episode, driven without a stop                      |
    | `max_episode_steps` | `3000`          | steps that truncate an episode, 200 s                          |
    | `opponents`         | `()`            | drivers of other cars on the track, up to 7                    |

    `render_mode="rgb_array"` renders the car from behind, 640 x 480 pixels. Reward functions that keep state
    or draw random numbers begin anew with `reset(seed=...)`, callables do not.

    `opponents=[driver, ...]` puts other cars on the track: policies of runs (`racecraft.race.load_driver`), an
    `Autopilot`, or your own functions. All start on a grid, the car in front; it is crashed when it runs into one
    ahead. An opponent whose episode is over comes back into the race. Bot cars, which follow a lane, are `objects`.

    ## Version History

    * v0: first version.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 15}  # noqa: RUF012

    def __init__(
        self,
        track: str | Path | Track = "reinvent_2018",
        *,
        render_mode: str | None = None,
        opponents: Sequence[Driver] = (),
        **settings: Unpack[TaskSettings],
    ) -> None:
        check_names(settings, own=("track", "render_mode", "opponents"))
        if not isinstance(track, str | Path | Track):
            raise ConfigError(
                f"track is {track!r}, expected one name, path or Track.",
                hint="Several tracks at once are for RacecraftVectorEnv.",
            )
        check_render_mode(render_mode)
        self.render_mode = render_mode
        cars = 1 + len(drivers := check_opponents(opponents))
        self._task = DrivingTask(track, num_envs=cars, cars_per_race=cars, num_threads=1, **settings)
        self._opponents = Opponents(self._task.simulation, drivers) if drivers else None
        self._everyone = np.ones(cars, dtype=np.bool_)
        self._learns = np.arange(cars) == 0
        self._renderer = Renderer(self._task.simulation) if render_mode else None
        self.observation_space = self._task.observer.space
        self.action_space = self._task.action_space.space
        self._has_key = False
        self._is_running = False

    @property
    def commands(self) -> list[tuple[float, float]]:
        """Steering angle in degrees and speed in m/s of every discrete action; empty if continuous."""
        space = self._task.action_space
        return space.to_degrees() if isinstance(space, DiscreteActionSpace) else []

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin the next episode; with a seed, the first of the episodes that belong to this seed.

        Args:
            seed: Key of all random numbers. Without one, the first reset draws it.
            options: None are known; they are ignored.

        Returns:
            The first observation, and the info of the prepare step.
        """
        key = None if seed is None else seed_key(seed)
        super().reset(seed=key)
        if key is None and not self._has_key:
            key = int(self.np_random.integers(2**63))
        seeds = None if key is None else np.full(len(self._everyone), key, dtype=np.uint64)
        self._task.reset(self._everyone, seeds=seeds)
        if self._opponents is not None:
            self._opponents.begin(self._everyone)
        self._has_key = self._is_running = True
        return self._task.observer.one(0), single_info(self._task.simulation.rows[0])

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Drive for 1/15 s.

        Raises:
            ResetNeeded: No episode is under way.
            ShapeError: The action has another form than the action space's.
            ConfigError: There is no such discrete action.
            NonFiniteAction: It holds NaN.
            RewardError: The reward function failed.
        """
        if not self._is_running:
            raise ResetNeeded("step() was called while no episode is under way; call reset() first.")
        task = self._task
        if self._opponents is None:
            reward = float(task.step(of_one_car(action))[0])
        else:
            over = task.done
            commands = self._opponents.commands(task.action_space.to_commands(of_one_car(action)))
            reward = float(task.drive(commands, reset=over, paid=self._learns)[0])
            self._opponents.begin(over)
        terminated, truncated = bool(task.simulation.terminated[0]), bool(task.simulation.truncated[0])
        self._is_running = not (terminated or truncated)
        info = single_info(task.simulation.rows[0])
        laps = task.lap_times()
        if laps is not None and laps[0][0]:
            info["lap_time"] = float(laps[1][0])
        return task.observer.one(0), reward, terminated, truncated, info

    def render(self) -> Any:
        """The scene as uint8 (480, 640, 3) if ``render_mode`` is ``rgb_array``."""
        return None if self._renderer is None else self._renderer.frame(0)

    def close(self) -> None:
        """End the reward's process; calling again does nothing."""
        self._is_running = False
        self._task.close()


def make_single(*args: Any, **settings: Any) -> RacecraftEnv:
    """The environment as `gymnasium.make` wants it, which cuts its episodes itself."""
    return RacecraftEnv(*args, **{"max_episode_steps": MOST_STEPS, **settings})


make_single.metadata = RacecraftEnv.metadata  # type: ignore[attr-defined]  # Gymnasium looks for its render modes
