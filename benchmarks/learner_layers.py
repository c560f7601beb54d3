"""The native learner, layer by layer: GFLOP/s of each pass on one thread, and its share of what the CPU can do.

    python benchmarks/learner_layers.py [--network RACECRAFT_SMALL] [--isa avx2] [--critic camera] [--minibatch-size 64]

The ceiling is measured first: fused multiply-adds on registers alone. Every figure is the best of many short runs, so
that other work on the machine disturbs it least. Below the table: the whole gradient step and 64 cars' actions.

The limit of a gradient step on one thread is the longer of two times, as computing and moving can overlap: its
operations at the ceiling, and the bytes that parameters too many for a cache must move at the speed of a copy, measured
beside it. Its share of that is of CPU time.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from racecraft import _native
from racecraft.learn import Minibatch, NetworkSpec, Objective, network_names
from racecraft.learn.native_learner import NativeLearner
from racecraft.sim import STATE_COLUMNS

OBJECTIVE = Objective(
    learning_rate=5e-4, clip_coef=0.2, ent_coef=0.01, vf_coef=0.5, value_loss="mse", max_grad_norm=0.5
)


def best_seconds(body: Any, repeats: int, *, clock: Callable[[], float] = time.perf_counter) -> float:
    """The shortest of `repeats` runs, after one to warm up."""
    body()
    times = []
    for _ in range(repeats):
        start = clock()
        body()
        times.append(clock() - start)
    return min(times)


MOVES = 10
"""Floats moved per parameter: weights forwards and backwards, the gradient for its norm, Adam's seven."""


def copy_bytes_per_second(repeats: int = 10) -> float:
    """What one thread reads and writes of arrays far larger than a cache, per second of CPU time."""
    source = np.ones(1 << 25, np.float32)
    target = np.empty_like(source)
    return 2 * source.nbytes / best_seconds(lambda: np.copyto(target, source), repeats, clock=time.process_time)


def measure(
    network: str, *, minibatch_size: int = 256, repeats: int = 30, critic: str = "privileged"
) -> dict[str, Any]:
    """Times of the layers and of the whole, the critic seeing the privileged state or, as AWS's, the camera."""
    state_size = len(STATE_COLUMNS) if critic == "privileged" else 0
    spec = NetworkSpec(name=network, num_actions=10, state_size=state_size)
    peak = _native.peak_operations_per_second()
    learner = NativeLearner(spec, num_threads=1)
    layers = learner._native.profile_layers()
    rows = [
        {
            "tower": layer.tower,
            "shape": layer.shape,
            "pass": layer.pass_name,
            "kflop": layer.operations / 1e3,
            "microseconds": layer.seconds * 1e6,
            "gflops": layer.operations / layer.seconds / 1e9,
            "share_of_peak": layer.operations / layer.seconds / peak,
        }
        for layer in layers
    ]
    operations = sum(layer.operations for layer in layers)

    rng = np.random.default_rng(0)
    frames = rng.integers(0, 256, (minibatch_size, *spec.frame_shape), dtype=np.uint8)
    observations = learner.encode(frames)
    columns = [rng.standard_normal(minibatch_size).astype(np.float32) for _ in range(2)]
    minibatch = Minibatch(
        observations=observations,
        states=rng.standard_normal((minibatch_size, spec.state_size)).astype(np.float32),
        actions=rng.integers(0, spec.num_actions, minibatch_size),
        log_probs=np.full(minibatch_size, -np.log(spec.num_actions), np.float32),
        advantages=columns[0],
        returns=columns[1],
    )
    whole = []
    for num_threads in (1, 0):
        learner = NativeLearner(spec, num_threads=num_threads)
        update = best_seconds(lambda learner=learner: learner.update(minibatch, OBJECTIVE), repeats)
        act = best_seconds(lambda learner=learner: learner.policy(observations[:64]), repeats * 3)
        encode = best_seconds(lambda learner=learner: learner.encode(frames[:64]), repeats * 3)
        whole.append(
            {
                "threads": num_threads or "all",
                "update_samples_per_second": minibatch_size / update,
                "update_gflops": minibatch_size * operations / update / 1e9,
                "act_64_cars_ms": act * 1e3,
                "encode_64_frames_ms": encode * 1e3,
            }
        )
    learner = NativeLearner(spec, num_threads=1)
    step = best_seconds(lambda: learner.update(minibatch, OBJECTIVE), repeats, clock=time.process_time)
    bandwidth = copy_bytes_per_second()
    num_bytes = MOVES * 4 * sum(array.size for array in learner.weights().values())
    computing, moving = minibatch_size * operations / peak, num_bytes / bandwidth
    return {
        "step_cpu_seconds": step,
        "limit_seconds": {"computing": computing, "moving": moving},
        "copy_gigabytes_per_second": bandwidth / 1e9,
        "share_of_limit": max(computing, moving) / step,
        "network": network,
        "isa": _native.isa(),
        "peak_gflops": peak / 1e9,
        "mflop_per_training_sample": operations / 1e6,
        "layers": rows,
        "whole": whole,
    }


def main() -> None:
    """Print a table for people and one line of JSON for programs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--network", default=network_names()[0], choices=network_names())
    parser.add_argument("--minibatch-size", type=int, default=256)
    parser.add_argument("--critic", default="privileged", choices=["privileged", "camera"])
    parser.add_argument("--isa", default=_native.isa(), choices=_native.available_isas())
    options = parser.parse_args()
    _native.set_isa(options.isa)
    result = measure(options.network, minibatch_size=options.minibatch_size, critic=options.critic)

    print(f"{result['network']}, {result['isa']}: peak {result['peak_gflops']:.1f} GFLOP/s on one thread, ", end="")
    print(f"{result['mflop_per_training_sample']:.2f} MFLOP for a training sample")
    print(f"{'tower':8}{'layer':12}{'pass':17}{'kFLOP':>8}{'µs':>9}{'GFLOP/s':>9}{'of peak':>9}")
    for row in result["layers"]:
        print(
            f"{row['tower']:8}{row['shape']:12}{row['pass']:17}{row['kflop']:8.0f}{row['microseconds']:9.2f}"
            f"{row['gflops']:9.1f}{row['share_of_peak']:9.0%}"
        )
    for row in result["whole"]:
        print(
            f"threads {row['threads']}: update {row['update_samples_per_second']:,.0f} samples/s "
            f"({row['update_gflops']:.1f} GFLOP/s), 64 cars act in {row['act_64_cars_ms']:.2f} ms, "
            f"64 frames encoded in {row['encode_64_frames_ms']:.2f} ms"
        )
    limit = result["limit_seconds"]
    print(
        f"a step of {options.minibatch_size}: {1e3 * result['step_cpu_seconds']:.1f} ms of CPU time; computing alone "
        f"{1e3 * limit['computing']:.1f} ms, moving alone {1e3 * limit['moving']:.1f} ms at "
        f"{result['copy_gigabytes_per_second']:.1f} GB/s: {result['share_of_limit']:.0%} of the limit"
    )
    print(json.dumps(result))


if __name__ == "__main__":
    main()
