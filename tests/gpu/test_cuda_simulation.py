"""The kernels against the engine, to the bit, whatever the settings: on a GPU where there is one, and on the CPU."""

from __future__ import annotations

import numpy as np
import pytest
from host_device import HostDevice

from racecraft import _native
from racecraft.errors import ConfigError, ShapeError
from racecraft.sim import Bots, CameraSpec, Objects, Obstacles, Simulation, Start
from racecraft.sim.cuda_simulation import CudaSimulation
from racecraft.sim.saved_state import SEAL_BYTES
from racecraft.track import load_track

CARS = 37
STEPS = 60
MESSY = Start(mode="random", lateral_jitter=0.2, heading_jitter=0.6)
ARRAYS = ("judged", "state", "terminated", "truncated", "vehicles", "parameters", "lidar", "conditions", "track_choice")
PLAIN = {"start": MESSY, "direction": "alternate", "max_steps": 40}
CASES = {
    "no camera": {"camera": None, **PLAIN},
    "small camera": {"camera": CameraSpec(width=64, height=48), **PLAIN},
    "odd camera": {"camera": CameraSpec(width=37, height=29, pitch=0.4, above_ground=0.3), **PLAIN},
    "original camera": {"camera": CameraSpec(), **PLAIN, "start": Start(spread=True)},
    "camera of 2026": {"camera": CameraSpec(width=64, height=48, palette="2026", age=0.025), **PLAIN},
    "stereo": {"camera": CameraSpec(width=64, height=48, baseline=0.06), **PLAIN},
    "laps and time": {"camera": None, "start": Start(spread=True), "laps": 2, "time_limit": 3.0, "substeps": 5},
    "lidar": {"camera": None, "lidar": True, "objects": Objects(obstacles=Obstacles(count=5)), **PLAIN},
    "boxes": {"camera": CameraSpec(width=64, height=48), "objects": Objects(obstacles=Obstacles(count=8)), **PLAIN},
    "bots": {
        "camera": CameraSpec(width=96, height=64),
        "objects": Objects(
            obstacles=Obstacles(count=3, kind="car", placement="random"),
            bots=Bots(count=4, speed=1.0, changes_lane=True, shortest_stay=0.5, longest_stay=1.0, placement="random"),
        ),
        **PLAIN,
    },
    "randomised": {"camera": CameraSpec(width=64, height=48), "randomize": "strong", **PLAIN},
}


def actions_of(step: int, cars: int) -> np.ndarray:
    rng = np.random.default_rng([step // 4, cars])
    steering = rng.uniform(-0.7, 0.7, cars) * np.where(np.arange(cars) % 3, 0.4, 1.0)
    speed = np.where(np.arange(cars) % 5 == 4, 0.0, rng.uniform(-0.2, 4.5, cars))
    return np.column_stack([steering, speed]).astype(np.float32)


def on_host(array) -> np.ndarray:
    return array if isinstance(array, np.ndarray) else array.numpy()


def assert_same(kernels, engine, step) -> None:
    for name in ARRAYS:
        ours, theirs = on_host(getattr(kernels, name)), getattr(engine, name)
        assert ours.shape == theirs.shape, name
        assert ours.tobytes() == theirs.tobytes(), f"{name} in step {step}"
    assert kernels.frames.shape == engine.frames.shape
    different = int((on_host(kernels.frames) != engine.frames).sum())
    assert different == 0, f"{different} pixels of {engine.frames.size} in step {step}"


def pair(name: str, device=None, cars: int = CARS):
    tracks = [load_track("oval"), load_track("reinvent_2018")]
    settings = {"seed": 7, **CASES[name]}
    return (
        CudaSimulation(tracks, num_envs=cars, device=device or HostDevice(), **settings),
        Simulation(tracks, num_envs=cars, **settings),
    )


@pytest.mark.costly
@pytest.mark.parametrize("name", CASES)
def test_kernels_and_engine_give_the_same_bits(name, device):
    kernels, engine = pair(name, device)
    assert_same(kernels, engine, 0)
    ended = 0
    for step in range(1, STEPS + 1):
        actions = actions_of(step, CARS)
        kernels.step(actions)
        engine.step(actions)
        assert_same(kernels, engine, step)
        over = engine.terminated | engine.truncated
        ended += int(over.sum())
        if step % 3 == 0:
            kernels.reset(over)
            engine.reset(over)
            assert_same(kernels, engine, step)
    assert ended > CARS
    assert kernels.save().tobytes() == engine.save().tobytes()


@pytest.mark.costly
@pytest.mark.parametrize("name", ["bots", "randomised", "camera of 2026"])
def test_states_go_from_one_to_the_other(name, device):
    kernels, engine = pair(name, device, cars=9)
    for step in range(12):
        engine.step(actions_of(step, 9))
    kernels.load(engine.save())
    assert_same(kernels, engine, "load")
    for step in range(12, 30):
        for simulation in (kernels, engine):
            simulation.step(actions_of(step, 9))
        assert_same(kernels, engine, step)
    with pytest.raises(ShapeError):
        kernels.load(engine.save()[:-1])


@pytest.mark.costly
def test_seeds_and_finished_cars(device):
    kernels, engine = pair("small camera", device, cars=12)
    seeds = np.arange(100, 112, dtype=np.uint64)
    mask = np.arange(12) % 2 == 0
    kernels.reset(mask, seeds=seeds)
    engine.reset(mask, seeds=seeds)
    assert_same(kernels, engine, 0)
    for step in range(50):
        actions = actions_of(step, 12)
        kernels.move(actions)
        kernels.restart_finished()
        kernels.draw()
        engine.step(actions)
        engine.reset(engine.terminated | engine.truncated)
        assert_same(kernels, engine, step)


@pytest.mark.costly
def test_only_frames_that_changed_are_drawn():
    kernels, _ = pair("small camera", cars=4)
    kernels.frames[:] = 7
    kernels.reset(np.array([True, False, False, True]))
    assert (kernels.frames[1:3] == 7).all()
    assert (kernels.frames[0] != 7).any()


@pytest.mark.costly
def test_wrong_arguments_are_refused():
    kernels, _ = pair("no camera", cars=3)
    with pytest.raises(ShapeError, match=r"action is float32 of shape \(2, 2\)"):
        kernels.step(np.zeros((2, 2), np.float32))
    with pytest.raises(ShapeError, match="action is float64"):
        kernels.step(np.zeros((3, 2)))
    with pytest.raises(ShapeError, match="reset mask"):
        kernels.reset(np.zeros(3, np.uint8))
    with pytest.raises(ConfigError, match="num_envs"):
        CudaSimulation(load_track("oval"), num_envs=0, device=HostDevice())
    with pytest.raises(ConfigError, match="substeps"):
        CudaSimulation(load_track("oval"), num_envs=2, device=HostDevice(), substeps=1)
    with pytest.raises(ConfigError, match=r"draws crowd, sheen, folds, .* which a GPU cannot show yet"):
        CudaSimulation(load_track("oval"), num_envs=2, device=HostDevice(), randomize="real")
    with pytest.raises(ConfigError, match="With objects"):
        _ = pair("boxes", cars=2)[0].rows


@pytest.mark.costly
def test_a_state_may_not_lead_a_kernel_astray():
    kernels, _ = pair("no camera", cars=2)
    saved = kernels.save()
    saved[-1 - SEAL_BYTES] = 9  # a flag
    with pytest.raises(ShapeError, match="damaged"):
        kernels.load(saved)


def test_cars_that_share_a_track_are_refused_by_the_plan_too() -> None:
    racing = Simulation(load_track("oval"), num_envs=4, cars_per_race=2, camera=None)
    with pytest.raises(ValueError, match="cars_per_race must be 1"):
        _native.DevicePlan(racing._engine, 4)
