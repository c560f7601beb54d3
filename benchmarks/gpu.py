"""Builds, checks and measures everything that runs on a GPU, in less than eight minutes, and prints one JSON document.

    python benchmarks/gpu.py [--seconds 440] [--parts simulator,ppo] > gpu.json

Every part runs in a process of its own with a limit, so one that fails says why and leaves the others alone. Nothing
is written but compiled kernels (in ~/.cache/racecraft) and run folders in a temporary folder.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.gpu import open_device
from racecraft.sim import Bots, CameraSpec, CudaSimulation, Objects, Obstacles, Simulation, Start
from racecraft.sim.cuda_simulation import PROGRAMS
from racecraft.track import load_track

TRACK = "reinvent_2018"
TORCH_DEVICE = "cuda"
BATCHES = (1024, 4096, 16384, 32768)  # cars of the simulator's figures
PPO_BATCHES = ((1024, 8, 1024), (2048, 16, 4096), (4096, 16, 8192))  # cars, steps, minibatch
ITERATIONS = 40
SEEDS = (0, 1, 2)
MESSY = Start(mode="random", lateral_jitter=0.2, heading_jitter=0.6)
CASES: dict[str, dict[str, Any]] = {
    "default": {"camera": CameraSpec(), "start": MESSY, "direction": "alternate", "max_steps": 40},
    "no camera": {"camera": None, "start": MESSY, "direction": "alternate", "max_steps": 40},
    "randomised": {"camera": CameraSpec(), "randomize": "strong", "start": MESSY, "max_steps": 40},
    "stereo, lidar": {"camera": CameraSpec(baseline=0.06), "lidar": True, "start": MESSY, "max_steps": 40},
    "objects": {
        "camera": CameraSpec(),
        "objects": Objects(
            obstacles=Obstacles(count=4, placement="random"),
            bots=Bots(count=3, speed=1.0, changes_lane=True, placement="random"),
        ),
        "start": MESSY,
        "max_steps": 40,
    },
}


def machine() -> dict[str, Any]:
    """What is measured on."""
    device = open_device("cuda")  # where there is none, torch need not be loaded to say so

    import torch

    return {
        "gpu": device.name,
        "architecture": device.architecture,
        "torch": torch.__version__,
        "cuda_of_torch": torch.version.cuda,
        "torch_finds_a_gpu": torch.cuda.is_available(),
    }


def kernels() -> dict[str, Any]:
    """Seconds to compile each program for this GPU, then registers and local memory of every kernel."""
    from cuda.bindings import driver

    from racecraft import _native
    from racecraft.gpu import compile_program
    from racecraft.sim.cuda_simulation import SOURCES

    device = open_device("cuda")
    found: dict[str, Any] = {}
    attribute = driver.CUfunction_attribute
    for name, names in PROGRAMS.items():
        begun = time.perf_counter()
        code = compile_program(
            (SOURCES / f"{name}.cu").read_text(),
            name=f"{name}.cu",
            architecture=device.architecture,
            include=SOURCES,
            defines={"RC_BATCH_BYTES": _native.BATCH_BYTES, "RC_IMAGE_WIDTH": 160},
        )
        found[name] = {"compile_s": round(time.perf_counter() - begun, 2), "bytes": len(code)}
        module = driver.cuModuleLoadData(code)[1]
        for kernel in names:
            function = driver.cuModuleGetFunction(module, kernel.encode())[1]
            registers = driver.cuFuncGetAttribute(attribute.CU_FUNC_ATTRIBUTE_NUM_REGS, function)[1]
            local = driver.cuFuncGetAttribute(attribute.CU_FUNC_ATTRIBUTE_LOCAL_SIZE_BYTES, function)[1]
            shared = driver.cuFuncGetAttribute(attribute.CU_FUNC_ATTRIBUTE_SHARED_SIZE_BYTES, function)[1]
            found[name][kernel] = {"registers": registers, "local_bytes": local, "shared_bytes": shared}
    return found


def parity(cars: int = 257, steps: int = 80) -> dict[str, Any]:
    """Numbers and pixels that differ from the CPU's, over some settings; all must be 0."""
    found: dict[str, Any] = {}
    for name, settings in CASES.items():
        try:
            found[name] = _differences(settings, cars, steps)
        except Exception as error:
            found[name] = {"error": f"{type(error).__name__}: {error}"}
    return found


def _differences(settings: dict[str, Any], cars: int, steps: int) -> dict[str, Any]:
    tracks = [load_track("oval"), load_track(TRACK)]
    ours = CudaSimulation(tracks, num_envs=cars, device=open_device("cuda"), seed=7, **settings)
    theirs = Simulation(tracks, num_envs=cars, seed=7, **settings)
    names = ("judged", "state", "vehicles", "terminated", "truncated", "lidar", "frames", "conditions")
    counts, first = dict.fromkeys(names, 0), {}
    rng = np.random.default_rng(0)
    ended = 0
    for step in range(steps + 1):
        for name in names:
            mine, reference = _host(getattr(ours, name)), getattr(theirs, name)
            different = int((mine != reference).sum())
            if different and name not in first:
                first[name] = step
            counts[name] += different
        actions = np.column_stack([rng.uniform(-0.6, 0.6, cars), rng.uniform(0.0, 4.2, cars)]).astype(np.float32)
        ours.step(actions)
        theirs.step(actions)
        if step % 3 == 2:
            over = theirs.terminated | theirs.truncated
            ended += int(over.sum())
            ours.reset(over)
            theirs.reset(over)
    saved = ours.save().tobytes() == theirs.save().tobytes()
    return {"different": counts, "first_step": first, "episodes": ended, "saved_bytes_equal": saved}


def _host(array: Any) -> Any:
    return array if isinstance(array, np.ndarray) else array.numpy()


def rewards() -> dict[str, Any]:
    """Which presets run on the GPU with the interpreter's rewards, or why not."""
    from racecraft.reward import RewardWorker, load_reward
    from racecraft.reward.cuda import CudaReward
    from racecraft.reward.numeric import NotNumeric
    from racecraft.sim.cuda_simulation import SOURCES
    from racecraft.training.cuda_environment import recorded_rows

    tracks = [load_track("oval"), load_track(TRACK)]
    rows = recorded_rows(tracks)
    found = {}
    for name in ("racing", "centerline", "heading", "anti_zigzag", "progress_pace", "speed_gate", "lap_time"):
        source = load_reward(name)
        try:
            reward = CudaReward(source, tracks, device=open_device("cuda"), width=rows.shape[1], include=SOURCES)
            with RewardWorker(source, tracks) as worker:
                reward.prove(worker, rows)
            found[name] = "proved"
        except NotNumeric as reason:
            found[name] = str(reason)
    return found


def simulator(seconds: float = 2.0) -> dict[str, Any]:
    """Car steps a second: with the 160 x 120 camera, with objects, randomised, and without a camera."""
    found: dict[str, Any] = {}
    settings: dict[str, dict[str, Any]] = {
        "camera": {},
        "no camera": {"camera": None},
        "camera, 8 boxes": {"objects": Objects(obstacles=Obstacles(count=8))},
        "camera, randomised": {"randomize": "strong"},
    }
    for name, chosen in settings.items():
        for cars in BATCHES if name in ("camera", "no camera") else BATCHES[1:2]:
            try:
                found[f"{name}, {cars} cars"] = round(_pace(cars, chosen, seconds))
            except Exception as error:
                found[f"{name}, {cars} cars"] = f"{type(error).__name__}: {error}"
    return found


def _pace(cars: int, settings: dict[str, Any], seconds: float) -> float:
    """Steps a second, cars whose episode is over restarting in every step."""
    device = open_device("cuda")
    simulation = CudaSimulation(
        load_track(TRACK), num_envs=cars, device=device, start=Start(mode="random", spread=True), **settings
    )
    rng = np.random.default_rng(0)
    actions = np.column_stack([rng.uniform(-0.3, 0.3, cars), rng.uniform(0.5, 2.0, cars)]).astype(np.float32)
    address = device.allocate(actions.nbytes)
    device.write(address, actions)
    commands = device.array(address, actions.shape, np.float32)

    def drive(steps: int) -> float:
        device.read(address, 4)  # waits
        begun = time.perf_counter()
        for _ in range(steps):
            simulation.move(commands)
            simulation.restart_finished()
            simulation.draw()
        device.read(address, 4)
        return time.perf_counter() - begun

    drive(3)
    steps = max(3, min(int(seconds / max(drive(5) / 5, 1e-6)), 5000))
    return cars * steps / drive(steps)


def learner() -> dict[str, Any]:
    """One gradient step and one forward pass against torch on the CPU, in float32."""
    import torch

    from racecraft.learn import Minibatch, NetworkSpec, Objective
    from racecraft.learn.torch_cuda_learner import CudaLearner

    torch.backends.cuda.matmul.allow_tf32 = torch.backends.cudnn.allow_tf32 = False
    spec = NetworkSpec(num_actions=10, state_size=16)
    objective = Objective(
        learning_rate=1e-3, clip_coef=0.2, ent_coef=0.01, vf_coef=0.5, value_loss="mse", max_grad_norm=0.5
    )
    sides = [CudaLearner(spec, device=name, precision="float32") for name in (TORCH_DEVICE, "cpu")]
    rng = np.random.default_rng(0)
    frames = rng.integers(0, 256, (256, *spec.frame_shape), dtype=np.uint8)
    minibatch = Minibatch(
        observations=sides[0].encode(frames),
        states=rng.normal(size=(256, 16)).astype(np.float32),
        actions=rng.integers(0, 10, 256),
        log_probs=np.full(256, -2.3, np.float32),
        advantages=rng.normal(size=256).astype(np.float32),
        returns=rng.normal(size=256).astype(np.float32),
    )
    on_device = torch.from_numpy(frames).to(sides[0].device)
    same = bool((sides[0].encode_frames(on_device).cpu().numpy() == minibatch.observations).all())
    stats = [side.update(minibatch, objective) for side in sides]
    ours, theirs = (np.concatenate([a.ravel() for a in side.weights().values()]) for side in sides)
    return {
        "frames_encoded_alike": same,
        "grad_norm": [one.grad_norm for one in stats],
        "weights_relative_difference": float(np.linalg.norm(ours - theirs) / np.linalg.norm(theirs)),
    }


def ppo() -> dict[str, Any]:
    """Camera steps a second of whole iterations of PPO, and where their time goes."""
    found: dict[str, Any] = {}
    for cars, steps, minibatch in PPO_BATCHES:
        for uses_graphs in (True, False):
            name = f"{cars} cars x {steps} steps, minibatch {minibatch}" + ("" if uses_graphs else ", no graphs")
            try:
                found[name] = _ppo_pace(cars, steps, minibatch, uses_graphs=uses_graphs)
            except Exception as error:
                found[name] = {"error": f"{type(error).__name__}: {error}", "trace": traceback.format_exc()[-1500:]}
            if not uses_graphs and (cars, steps, minibatch) != PPO_BATCHES[0]:
                break
    return found


def _ppo_pace(cars: int, steps: int, minibatch: int, *, uses_graphs: bool) -> dict[str, Any]:
    from racecraft.agent import action_space
    from racecraft.learn import NetworkSpec, PPOConfig
    from racecraft.learn.torch_cuda_learner import CudaLearner
    from racecraft.learn.torch_cuda_ppo import CudaPPO
    from racecraft.reward import RewardWorker, load_reward
    from racecraft.run import EpisodeCounter
    from racecraft.training.cuda_environment import CudaTrainingEnvironment

    track, source, space = load_track(TRACK), load_reward("racing"), action_space("default")
    simulation = CudaSimulation(track, num_envs=cars, device=open_device("cuda"), start=Start(spread=True))
    notes: list[str] = []
    with RewardWorker(source, [track]) as worker:
        environment = CudaTrainingEnvironment(
            simulation, worker, source, space, counter=EpisodeCounter(cars), note=notes.append
        )
        spec = NetworkSpec(num_actions=space.size, state_size=16)
        learner = CudaLearner(spec, device=TORCH_DEVICE)
        config = PPOConfig(num_envs=cars, num_steps=steps, minibatch_size=minibatch)
        algorithm = CudaPPO(config, learner, environment, seed=0)
        algorithm.uses_graphs = algorithm.uses_graphs and uses_graphs
        lengths: list[float] = []
        for _ in range(4):  # warms up and captures
            algorithm.iterate()
        begun = time.perf_counter()
        collect = update = 0.0
        for _ in range(ITERATIONS):
            stats = algorithm.iterate()
            environment.take_finished()
            collect += stats.environment_seconds
            update += stats.update_seconds
            lengths.append(stats.mean_length)
        elapsed = time.perf_counter() - begun
    return {
        "steps_per_s": round(ITERATIONS * cars * steps / elapsed),
        "collect_s": round(collect / ITERATIONS, 5),
        "update_s": round(update / ITERATIONS, 5),
        "graphs": sorted(algorithm._graphs),
        "mean_length_first_last": [lengths[0], lengths[-1]],
        "notes": notes,
    }


def five_laps() -> dict[str, Any]:
    """Seconds from nothing to 5 of 5 laps, start-up included, over seeds."""
    from racecraft.training import train

    found: dict[str, Any] = {}
    for seed in SEEDS:
        with tempfile.TemporaryDirectory() as folder:
            begun = time.monotonic()
            result = train(TRACK, until="5 laps or 45 seconds", seed=seed, device="cuda", root=folder)
            found[f"seed {seed}"] = {
                "seconds": round(time.monotonic() - begun, 2),
                "reason": result.reason,
                "steps": result.steps,
                "laps": result.laps_completed,
                "best_lap_s": result.best_lap_seconds,
                "parts_s": {name: round(value, 2) for name, value in result.parts.items()},
            }
    return found


PARTS: dict[str, tuple[Callable[[], dict[str, Any]], float]] = {  # with the most seconds it may take
    "machine": (machine, 60),
    "kernels": (kernels, 90),
    "parity": (parity, 120),
    "rewards": (rewards, 60),
    "simulator": (simulator, 90),
    "learner": (learner, 60),
    "ppo": (ppo, 120),
    "five_laps": (five_laps, 170),
}


def run_part(name: str, limit: float) -> dict[str, Any]:
    """A part in a process of its own."""
    begun = time.monotonic()
    command = [sys.executable, str(Path(__file__).resolve()), "--part", name]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit, check=False)
        lines = done.stdout.strip().splitlines()
        if done.returncode == 0 and lines:
            found: dict[str, Any] = json.loads(lines[-1])
        else:
            found = {"error": f"exit status {done.returncode}", "output": (done.stdout + done.stderr)[-3000:]}
    except subprocess.TimeoutExpired as error:
        output = error.stderr if isinstance(error.stderr, str) else (error.stderr or b"").decode("utf-8", "replace")
        found = {"error": f"not done within {limit:.0f} s", "output": output[-3000:]}
    except ValueError as error:
        found = {"error": f"no JSON: {error}"}
    return {**found, "seconds": round(time.monotonic() - begun, 1)}


def main() -> None:
    """Run all parts, or print one of them."""
    parser = argparse.ArgumentParser(description="Everything GPU: build, check, measure.")
    parser.add_argument("--seconds", type=float, default=440.0, help="for all parts together")
    parser.add_argument("--parts", default=",".join(PARTS), help=f"some of {','.join(PARTS)}")
    parser.add_argument("--part", choices=list(PARTS), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.part:
        try:
            found = PARTS[arguments.part][0]()
        except Exception as error:
            hint = getattr(error, "hint", "")
            found = {"error": f"{type(error).__name__}: {error}", "hint": hint, "trace": traceback.format_exc()[-3000:]}
        print(json.dumps(found))
        return
    begun = time.monotonic()
    document: dict[str, Any] = {}
    for name in arguments.parts.split(","):
        left = arguments.seconds - (time.monotonic() - begun)
        if name not in PARTS:
            document[name] = {"error": f"no such part; there are {', '.join(PARTS)}"}
        elif left < 5:
            document[name] = {"error": "no time left"}
        else:
            document[name] = run_part(name, min(PARTS[name][1], left))
        print(f"{name}: {'failed' if 'error' in document[name] else 'done'}", file=sys.stderr, flush=True)
        if name == "machine" and "error" in document[name]:
            break  # nothing else could work
    print(json.dumps(document, indent=1))


if __name__ == "__main__":
    main()
