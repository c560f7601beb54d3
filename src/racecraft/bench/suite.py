"""The benchmarks by name. Each warms up, prepares its input outside the clock and gives a median of rounds."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from statistics import median
from typing import Any

import numpy as np

from racecraft.agent import action_space
from racecraft.bench.learning import measure_learning
from racecraft.bench.machine import copy_bandwidth, describe_machine, matrix_flops
from racecraft.bench.rivals import measure_rivals
from racecraft.bench.walls import measure_walls
from racecraft.checks import check_number, check_whole
from racecraft.errors import ConfigError, RacecraftError, did_you_mean
from racecraft.learn import NetworkSpec, PPOConfig, forward_operations
from racecraft.reward import RewardWorker, load_preset
from racecraft.sim import STATE_COLUMNS, CameraSpec, Objects, Obstacles, Simulation, Start
from racecraft.track import Track, load_track

ROUNDS = 5
TRACK = "reinvent_2018"
CAMERA_CARS = 256
STATE_CARS = 8192
RACE_CARS = 4
SIX_BOXES = tuple((0.042 + 0.018 * i, 1 if i % 2 else -1) for i in range(6))  # of a lap, from 0.6 m on
REWARD = "centerline"
REWARD_BATCH = 64
START_SECONDS = 2.0  # that a training may take to start, beside the time it is measured for
SKILL_TIMEOUT_S = 300.0

Say = Callable[[str], None]


def run_benchmarks(*, only: list[str], seconds: float = 3.0, seeds: int = 5, say: Say | None = None) -> dict[str, Any]:
    """Run the benchmarks and return one JSON-able document.

    Args:
        only: Names of `BENCHMARKS`; empty runs all but those of `ON_REQUEST`.
        seconds: Time of each throughput measurement.
        seeds: Trainings of the skill benchmark.
        say: Is told what is being measured.

    Raises:
        ConfigError: An unknown name, or numbers out of range.
    """
    for name in only:
        if name not in BENCHMARKS:
            raise ConfigError(
                f"Benchmark {name!r} does not exist; there are {', '.join(BENCHMARKS)}.",
                hint=did_you_mean(name, BENCHMARKS),
            )
    check_number("seconds", seconds, 0.1, 600.0)
    check_whole("seeds", seeds, 1, 100)
    results: dict[str, Any] = {"machine": describe_machine()}
    for name, measure in BENCHMARKS.items():
        if name in only or (not only and name not in ON_REQUEST):
            if say is not None:
                say(f"measuring {name} …")
            results[name] = measure(seconds, seeds)
    return results


def measure_simulator(seconds: float, seeds: int) -> dict[str, Any]:
    """Steps per second with and without the camera, all cores; finished cars are reset, as in training."""
    del seeds
    track = load_track(TRACK)
    camera = _steps_per_second(track, CAMERA_CARS, CameraSpec(), seconds)
    state = _steps_per_second(track, STATE_CARS, None, seconds)
    one = _steps_per_second(track, CAMERA_CARS, CameraSpec(), seconds, num_threads=1)
    frame, car = CameraSpec().width * CameraSpec().height, bytes_per_car(track)
    copied = copy_bandwidth()
    return {
        "camera_steps_per_second": round(camera),
        "camera_steps_per_second_one_thread": round(one),
        "state_steps_per_second": round(state),
        "bytes_per_car": car,
        "cars": {"camera": CAMERA_CARS, "state": STATE_CARS},
        "limits": {
            "camera_steps_per_second": _limit(
                copied / frame, f"copying finished frames of {frame:,} bytes, one thread"
            ),
            "state_steps_per_second": _limit(copied / car, f"copying the {car} bytes of a car, one thread"),
        },
    }


def _limit(value: float, what: str) -> dict[str, Any]:
    """What the machine could do at most: a figure, and what was measured for it."""
    return {"value": round(value), "what": what}


def bytes_per_car(track: Track) -> int:
    """Memory of the simulator for one more car, beside its frame."""
    few, more = 64, 1024
    sizes = [Simulation(track, num_envs=n, camera=None, num_threads=1).num_bytes for n in (few, few + more)]
    return (sizes[1] - sizes[0]) // more


def measure_races(seconds: float, seeds: int) -> dict[str, Any]:
    """Four cars on one track with camera, all cores; and what boxes in view cost, as shares of CPU time in turns."""
    del seeds
    track = load_track(TRACK)
    cars = _steps_per_second(track, CAMERA_CARS, CameraSpec(), seconds, cars_per_race=RACE_CARS)
    boxes = Objects(obstacles=Obstacles(count=6, placement="fixed", positions=SIX_BOXES))
    start = Start(mode="fixed")
    simulations = [
        Simulation(track, num_envs=64, objects=objects, start=start, num_threads=1, max_steps=10**6)
        for objects in (Objects(), boxes)
    ]
    spent = [0.0, 0.0]
    action = np.tile(np.array([0.0, 0.1], dtype=np.float32), (64, 1))  # so slow that the boxes stay in view
    begun = time.perf_counter()
    while time.perf_counter() - begun < seconds:
        for i, simulation in enumerate(simulations):
            simulation.reset()
            before = time.process_time()
            for _ in range(20):
                simulation.step(action)
            spent[i] += time.process_time() - before
    return {
        "camera_steps_per_second": round(cars),
        "cars_per_race": RACE_CARS,
        "six_boxes_in_view_percent": round(100 * spent[0] / spent[1], 1),
        "limits": {
            "camera_steps_per_second": _limit(
                copy_bandwidth() / (CameraSpec().width * CameraSpec().height), "copying finished frames, one thread"
            )
        },
    }


def measure_reward(seconds: float, seeds: int) -> dict[str, Any]:
    """Calls per second of the centre-line reward through the worker process, at batch 64; and what its walls cost."""
    del seeds
    track = load_track(TRACK)
    source = load_preset(REWARD)
    rows = _recorded_rows(track)
    batches = [rows[i : i + REWARD_BATCH] for i in range(0, len(rows), REWARD_BATCH)]
    with RewardWorker(source, track) as worker:

        def work() -> int:
            for batch in batches:
                worker(batch)
            return len(rows)

        calls = _rate(work, seconds)
    compiled = _compiled_rate(source, track, batches, seconds)
    function = import_module(f"racecraft.reward.presets.{REWARD}").reward_function
    params = _example_params(rows, track)
    bare = _rate(lambda: _call_many(function, params), min(seconds, 1.0))
    return {
        "calls_per_second": round(calls),
        "microseconds_per_call": round(1e6 / calls, 3),
        **({"compiled_calls_per_second": round(compiled)} if compiled else {}),
        "batch": REWARD_BATCH,
        "confinement": measure_walls(source, track, batches, seconds) if sys.platform == "linux" else None,
        "limits": {"calls_per_second": _limit(bare, "the same function called on ready params, in one process")},
    }


def _compiled_rate(source: str, track: Track, batches: list[Any], seconds: float) -> float:
    """The same through a worker that compiled the function; 0 where numba is not installed."""
    if not has_numba():
        return 0.0
    with RewardWorker(source, track, compiled=True, start_timeout_s=120.0) as worker:

        def work() -> int:
            for batch in batches:
                worker(batch)
            return sum(map(len, batches))

        return _rate(work, seconds)


def has_numba() -> bool:
    """Whether rewards can be compiled here."""
    return find_spec("numba") is not None


def measure_training(seconds: float, seeds: int) -> dict[str, Any]:
    """Camera steps per second end to end: simulator, reward process, learner, logs, evaluation, checkpoints."""
    del seeds
    from racecraft.training import Until, train

    with tempfile.TemporaryDirectory() as root:
        result = train(TRACK, until=Until(seconds=seconds + START_SECONDS), seed=1, root=root)
    busy = result.wall_seconds - result.parts["start"]
    spec = NetworkSpec(num_actions=action_space("default").size, state_size=len(STATE_COLUMNS))
    # One pass to act and one for the values; in every epoch a forward pass and a backward one that costs twice that.
    per_step = forward_operations(spec) * (2 + 3 * PPOConfig().update_epochs)
    peak = matrix_flops()
    return {
        "steps_per_second": round(result.steps / busy),
        "steps": result.steps,
        "parts_percent": {name: round(100 * part / busy, 1) for name, part in result.parts.items() if name != "start"},
        "limits": {
            "steps_per_second": _limit(
                peak / per_step, f"{per_step / 1e6:.1f} MFLOP a step, {peak / 1e9:.0f} GFLOP/s of a float32 product"
            )
        },
    }


def measure_skill(seconds: float, seeds: int) -> dict[str, Any]:
    """Wall clock from typing the command to 5 of 5 evaluation laps, process start included, over seeds."""
    del seconds
    runs = []
    with tempfile.TemporaryDirectory() as root:
        for seed in range(1, seeds + 1):
            command = [sys.executable, "-m", "racecraft", "train", "--until", f"5 laps or {SKILL_TIMEOUT_S:g} s"]
            command += ["--seed", str(seed), "--runs", root, "--json"]
            begun = time.perf_counter()
            done = subprocess.run(command, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
            wall = time.perf_counter() - begun
            if done.returncode != 0:
                raise RacecraftError(f"Training with seed {seed} failed: {done.stderr.strip()[-500:]}")
            runs.append({"seed": seed, "wall_seconds": round(wall, 2), **_of_run(json.loads(done.stdout))})
    walls = [run["wall_seconds"] for run in runs]
    return {
        "wall_seconds": walls,
        "median_seconds": median(walls),
        "worst_seconds": max(walls),
        "solved": sum(run["laps_completed"] >= 5 for run in runs),
        "runs": runs,
    }


BENCHMARKS: dict[str, Callable[[float, int], dict[str, Any]]] = {
    "simulator": measure_simulator,
    "races": measure_races,
    "reward": measure_reward,
    "train": measure_training,
    "skill": measure_skill,
    "rivals": lambda seconds, seeds: measure_rivals(seconds),
    "learn": lambda seconds, seeds: measure_learning(seeds),
}
ON_REQUEST = ("learn",)
"""Those that take many minutes, and run only when they are named."""


def _of_run(result: dict[str, Any]) -> dict[str, Any]:
    return {key: result[key] for key in ("steps", "laps_completed", "best_lap_seconds", "parts")}


def _steps_per_second(
    track: Track,
    num_envs: int,
    camera: CameraSpec | None,
    seconds: float,
    *,
    num_threads: int = 0,
    cars_per_race: int = 1,
) -> float:
    simulation = Simulation(
        track,
        num_envs=num_envs,
        camera=camera,
        start=Start(spread=True),
        num_threads=num_threads,
        seed=1,
        cars_per_race=cars_per_race,
    )
    rng = np.random.default_rng(1)
    actions = [
        np.stack([rng.uniform(-0.5, 0.5, num_envs), rng.uniform(0.5, 2.0, num_envs)], axis=1).astype(np.float32)
        for _ in range(16)
    ]

    def work() -> int:
        for action in actions:
            simulation.step(action)
            simulation.reset(simulation.terminated | simulation.truncated)
        return len(actions) * num_envs

    return _rate(work, seconds)


def _rate(work: Callable[[], int], seconds: float) -> float:
    """Items per second of `work`, which returns how many it did: median of rounds, after a warm-up."""
    work()
    rates = []
    for _ in range(ROUNDS):
        done, begun = 0, time.perf_counter()
        while (elapsed := time.perf_counter() - begun) < seconds / ROUNDS:
            done += work()
        rates.append(done / elapsed)
    return median(rates)


def _recorded_rows(track: Track) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Judged rows of cars that drive about at random."""
    simulation = Simulation(track, num_envs=64, camera=None, start=Start(spread=True), num_threads=1, seed=1)
    rng = np.random.default_rng(1)
    rows = []
    for _ in range(64):
        simulation.step(np.stack([rng.uniform(-0.5, 0.5, 64), rng.uniform(0.5, 2.0, 64)], axis=1))
        rows.append(simulation.rows.copy())
        simulation.reset(simulation.terminated | simulation.truncated)
    return np.concatenate(rows)


def _example_params(rows: np.ndarray[Any, np.dtype[np.float64]], track: Track) -> list[dict[str, Any]]:
    from racecraft.reward import make_params
    from racecraft.reward.worker import waypoints_of

    waypoints = waypoints_of([track])
    return [make_params(row, waypoints) for row in rows.tolist()]


def _call_many(function: Callable[[dict[str, Any]], float], params: list[dict[str, Any]]) -> int:
    for one in params:
        function(one)
    return len(params)
