"""
Racecraft's native core. Private: use racecraft.sim and racecraft.learn.
"""

from collections.abc import Sequence
from typing import Annotated

import numpy
from numpy.typing import NDArray


ROW_COLUMNS: tuple = ...

STATE_COLUMNS: tuple = ...

OBJECT_HEADER: tuple = ...

OBJECT_COLUMNS: tuple = ...

CONDITIONS: tuple = ...

CAR_COLOURS: tuple = ...

RACER_COLOURS: tuple = ...

MAX_CARS_PER_RACE: int = 8

VEHICLE_PARAMETERS: tuple = ...

def number_texts(values: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> list:
    """`repr` of every number."""

def compiler() -> str: ...

def commit() -> str:
    """Of a wheel; empty in a checkout."""

def isa() -> str: ...

def available_isas() -> list[str]: ...

def best_isa() -> str:
    """The best that this CPU could run, whether this build has it or not."""

def set_isa(name: str) -> None: ...

class CameraSpec:
    """
    Where a camera sits on the car and what it covers; SI units and radians.
    """

    def __init__(self, width: int, height: int, hfov: float, forward: float, left: float, above: float, pitch: float) -> None: ...

    @property
    def width(self) -> int: ...

    @property
    def height(self) -> int: ...

class GroundMap:
    """The ground of a track as cameras see it."""

    def __init__(self, centerline: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], inner: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], outer: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], is_closed: bool, texel: float) -> None: ...

    @property
    def num_bytes(self) -> int: ...

class CameraModel:
    """A camera that is ready to draw pictures for people."""

    def __init__(self, spec: CameraSpec) -> None: ...

def render_grey(camera: CameraModel, ground: GroundMap, palette: str, poses: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], out: Annotated[NDArray[numpy.uint8], dict(shape=(None, None, None), order='C', device='cpu')]) -> None: ...

def chase_camera(width: int, height: int) -> CameraSpec: ...

def top_down_camera(ground: GroundMap, width: int, height: int) -> tuple[CameraSpec, float, float, float]: ...

def render_rgb(camera: CameraModel, ground: GroundMap, palette: str, x: float, y: float, heading: float, cars: Annotated[NDArray[numpy.float32], dict(shape=(None, 9), order='C', device='cpu', writable=False)], scan: Annotated[NDArray[numpy.float32], dict(shape=(None, 9), order='C', device='cpu', writable=False)], lit_walls: bool, out: Annotated[NDArray[numpy.uint8], dict(shape=(None, None, 3), order='C', device='cpu')]) -> None: ...

class ObjectGroup:
    """Obstacles or bot cars, and where an episode puts them."""

    def __init__(self, kind: int, count: int, placement: int, min_distance: float, fractions: Sequence[float], lanes: Sequence[float]) -> None: ...

class ObjectRule:
    """What stands and drives on the track besides the car."""

    def __init__(self, obstacles: ObjectGroup, bots: ObjectGroup, speed: float, changes_lane: bool, shortest_stay: float, longest_stay: float, change_distance: float) -> None: ...

class NativeTrack:
    """Both directions of one track, as arrays in metres."""

    def __init__(self, centerline: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], inner: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], outer: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], reversed_centerline: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], reversed_inner: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], reversed_outer: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], widths: Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C', device='cpu', writable=False)], curvatures: Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C', device='cpu', writable=False)], reversed_widths: Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C', device='cpu', writable=False)], reversed_curvatures: Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C', device='cpu', writable=False)], samples_per_metre: float, is_closed: bool, waypoints: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], reversed_waypoints: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

class Engine:
    """A batch of cars; see racecraft.sim.Simulation, its Python face."""

    def __init__(self, tracks: Sequence[NativeTrack], grounds: Sequence[GroundMap], vehicle: Sequence[float], camera: CameraSpec | None, num_envs: int, seed: int, substeps: int, num_threads: int, laps: int, max_steps: int, time_limit: float, start_mode: int, start_offset: float, start_advance: float, start_spread: bool, lateral_jitter: float, heading_jitter: float, direction: int, objects: ObjectRule, has_lidar: bool, baseline: float, draws_tracks: bool = False, randomization: Sequence[float] = [], world: str = '2018', cars_per_race: int = 1, shuffle: bool = False, picture_age: int = 0) -> None: ...

    def reset(self, mask: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C', device='cpu', writable=False)], seeds: Annotated[NDArray[numpy.uint64], dict(shape=(None,), order='C', device='cpu', writable=False)] | None = None) -> None: ...

    def step(self, actions: Annotated[NDArray[numpy.float32], dict(shape=(None, 2), order='C', device='cpu', writable=False)]) -> None: ...

    def set_pose(self, env: int, x: float, y: float, heading: float, speed: float) -> None: ...

    def freeze(self, env: int, steps: int) -> None: ...

    def save(self) -> Annotated[NDArray[numpy.uint8], dict(shape=(None,), order='C')]: ...

    def load(self, state: Annotated[NDArray[numpy.uint8], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

    @property
    def num_threads(self) -> int: ...

    @property
    def num_bytes(self) -> int: ...

    @property
    def rows(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')]: ...

    @property
    def state(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C')]: ...

    @property
    def frames(self) -> Annotated[NDArray[numpy.uint8], dict(shape=(None, None, None, None), order='C')]: ...

    @property
    def lidar(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C')]: ...

    @property
    def terminated(self) -> Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C')]: ...

    @property
    def truncated(self) -> Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C')]: ...

    @property
    def vehicles(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C')]: ...

    @property
    def parameters(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C')]: ...

    @property
    def conditions(self) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C')]: ...

    @property
    def track_choice(self) -> Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C')]: ...

def judge_log(track: NativeTrack, reversed: bool, log: Annotated[NDArray[numpy.float64], dict(shape=(None, 8), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')]: ...

def replay_windows(vehicle: Sequence[float], poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], commands: Annotated[NDArray[numpy.float32], dict(shape=(None, 2), order='C', device='cpu', writable=False)], durations: Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C', device='cpu', writable=False)], first: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], known: int, free: int, substeps: int) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C')]: ...

class Objective:
    """The loss and the step taken on it; see racecraft.learn.Objective."""

    def __init__(self, *, learning_rate: float, clip_coef: float, ent_coef: float, vf_coef: float, is_huber: bool, max_grad_norm: float, adam_eps: float, is_eps_hat: bool) -> None: ...

class Learner:
    """A network that learns; see racecraft.learn.native_learner."""

    def __init__(self, *, height: int, width: int, top: int, pool: int, block: int, convs: Sequence[tuple[int, int, int]], dense: Sequence[int], num_actions: int, is_discrete: bool, state_size: int, critic_units: Sequence[int], lenses: int, lidar_size: int, lidar_units: Sequence[int], policy_units: Sequence[int], num_threads: int) -> None: ...

    def encode(self, sight: Annotated[NDArray[numpy.uint8], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.uint8], dict(shape=(None, None), order='C')]: ...

    def policy(self, observations: Annotated[NDArray[numpy.uint8], dict(shape=(None, None), order='C', device='cpu', writable=False)], states: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C')]: ...

    def values(self, observations: Annotated[NDArray[numpy.uint8], dict(shape=(None, None), order='C', device='cpu', writable=False)], states: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C')]: ...

    def update(self, observations: Annotated[NDArray[numpy.uint8], dict(shape=(None, None), order='C', device='cpu', writable=False)], states: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)], action_indices: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], actions: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)], log_probs: Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C', device='cpu', writable=False)], advantages: Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C', device='cpu', writable=False)], returns: Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C', device='cpu', writable=False)], rows: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], objective: Objective) -> tuple[float, float, float, float, float, float]: ...

    def descend(self, observations: Annotated[NDArray[numpy.uint8], dict(shape=(None, None), order='C', device='cpu', writable=False)], slopes: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)], objective: Objective) -> float:
        """
        One gradient step on another loss, given by its slopes at the policy's outputs; the gradient's norm.
        """

    def read(self, part: str) -> Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C')]:
        """A copy of 'weights', 'moment1' or 'moment2', flat."""

    def write(self, part: str, values: Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

    @property
    def num_updates(self) -> int: ...

    @num_updates.setter
    def num_updates(self, arg: int, /) -> None: ...

    def profile_layers(self, samples: int = 8, repeats: int = 200) -> list[LayerTime]: ...

    @property
    def num_parameters(self) -> int: ...

class LayerTime:
    """Speed of one pass of one layer, for one sample on one thread."""

    @property
    def tower(self) -> str: ...

    @property
    def shape(self) -> str: ...

    @property
    def pass_name(self) -> str: ...

    @property
    def operations(self) -> float: ...

    @property
    def seconds(self) -> float: ...

def peak_operations_per_second() -> float:
    """
    Fused multiply-adds on registers alone, counted as two operations each, on one thread.
    """

class NumpyRandom:
    """The core's own numpy.random.default_rng(seeds), at most four of them."""

    def __init__(self, seeds: Sequence[int]) -> None: ...

    def random(self, count: int) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
        """Uniform in [0, 1)."""

    def integers(self, bound: int, count: int) -> Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C')]:
        """Uniform from 0 to bound - 1."""

    def permutation(self, count: int) -> Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C')]:
        """The whole numbers below count in any order."""

def sample_categorical(logits: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)], uniforms: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C')]:
    """Indices drawn from a categorical policy."""

def categorical_log_probs(logits: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)], actions: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C')]:
    """Log-probability of each action."""

def sample_gaussian(outputs: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)], normals: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C')]:
    """Actions drawn from a Gaussian policy, not clipped."""

def gaussian_log_probs(outputs: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)], actions: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C')]:
    """Log-density of each action."""

def standard_normals(uniforms: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
    """Standard normal numbers from as many uniform ones in [0, 1)."""

def moments(values: Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> tuple[float, float]:
    """Mean and standard deviation, summed up from first to last."""

def orthonormalize(vectors: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')]) -> None:
    """
    Make the rows orthonormal in place, each from itself and those before it.
    """

class DevicePlan:
    """What a GPU needs to drive cars by an engine's settings."""

    def __init__(self, engine: Engine, num_envs: int) -> None: ...

    @property
    def world_bytes(self) -> int: ...

    @property
    def arrays(self) -> list[tuple[str, int]]: ...

    def world(self, address: int) -> Annotated[NDArray[numpy.uint8], dict(shape=(None,), order='C')]: ...

    def initial(self, name: str) -> Annotated[NDArray[numpy.uint8], dict(shape=(None,), order='C')]: ...

    def batch(self, world: int, addresses: Sequence[int]) -> Annotated[NDArray[numpy.uint8], dict(shape=(None,), order='C')]: ...

BATCH_BYTES: int = 1568

CAR_THREADS: int = 128

IMAGE_THREADS: int = 256

ROW_THREADS: int = 128

LIDAR_RAYS: int = 64

class PpoConfig:
    """See racecraft.learn.PPOConfig."""

    def __init__(self, *, num_envs: int, num_steps: int, episodes_per_iteration: int, max_steps_per_iteration: int, rate_steps: int, gamma: float, gae_lambda: float, minibatch_size: int, update_epochs: int, normalize_returns: bool, is_greedy: bool, epsilon_start: float, epsilon_end: float, epsilon_steps: int, objective: Objective) -> None: ...

class Ppo:
    """PPO's loop, native/src/ppo.hpp; see racecraft.learn.PPO, its face."""

    def __init__(self, *, config: PpoConfig, learner: object, sight_size: int, observation_size: int, state_size: int, num_actions: int, is_discrete: bool) -> None: ...

    def begin(self, seed: int, iteration: int, total_steps: int) -> None: ...

    def act(self, sight: Annotated[NDArray, dict(order='C', device='cpu', writable=False)], states: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> bool:
        """
        Store what the cars see and draw `actions`; False where the policy's outputs are not finite.
        """

    def pay(self, rewards: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], terminated: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C', device='cpu', writable=False)], truncated: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> bool:
        """Store the outcome; True where look() is to come before any reset."""

    def look(self, sight: Annotated[NDArray, dict(order='C', device='cpu', writable=False)], states: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> None: ...

    def learn(self) -> bool:
        """False where the last update was not finite, and not applied."""

    def column(self, name: str) -> object:
        """A copy of one column of the rollout  (T, N, ...)."""

    @property
    def is_full(self) -> bool: ...

    @property
    def any_begins(self) -> bool: ...

    @property
    def total_steps(self) -> int: ...

    @property
    def num_driven(self) -> int: ...

    @property
    def explained_variance(self) -> float: ...

    @property
    def updates(self) -> list[tuple[float, float, float, float, float, float]]:
        """What every gradient step of the last learn() saw."""

    @property
    def ended(self) -> list[tuple[int, float, int]]:
        """
        Car, sum of rewards and steps of the episodes that ended since begin().
        """

    @property
    def actions(self) -> object:
        """What the cars do, overwritten by every act()."""

    @property
    def begins(self) -> Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C')]:
        """Which cars are to be put at a new start, overwritten by every pay()."""

    @property
    def totals(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
        """Sums of rewards of the episodes under way, to be read and written."""

    @property
    def lengths(self) -> Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C')]:
        """Steps of the same."""

    @property
    def return_scale(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
        """
        Mean and spread of the returns, the critic's unit, to be read and written.
        """

def generalized_advantages(*, rewards: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)], values: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)], next_values: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)], terminated: Annotated[NDArray[numpy.bool_], dict(shape=(None, None), order='C', device='cpu', writable=False)], truncated: Annotated[NDArray[numpy.bool_], dict(shape=(None, None), order='C', device='cpu', writable=False)], gamma: float, gae_lambda: float) -> tuple:
    """
    Generalised advantages and returns of a rollout, each (T, N), as the loop computes them.
    """
