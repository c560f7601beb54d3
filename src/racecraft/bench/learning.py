"""`learn`: the learning goals beside those of `train` and `skill`, each a whole command with its process start.

They take minutes, so they run only when asked for by name.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from statistics import median
from typing import Any, Final

from racecraft.errors import RacecraftError

TIMEOUT_S: Final = 600.0
FAST_LAP_S: Final = 8.79  # faster than what racers reached on this track at AWS after some ten hours of training
SHALLOW: Final = "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW"
AWS_HYPERPARAMETERS: Final = {  # the defaults of AWS's platform
    "batch_size": 64,
    "num_epochs": 5,
    "lr": 0.0003,
    "beta_entropy": 0.01,
    "discount_factor": 0.99,
    "loss_type": "huber",
    "num_episodes_between_training": 20,
    "exploration_type": "categorical",
    "stack_size": 1,
}


def measure_learning(seeds: int) -> dict[str, Any]:
    """Time to a fast lap, and to five laps as AWS trains; peak memory of the commands."""
    with tempfile.TemporaryDirectory() as folder:
        hyperparameters = Path(folder) / "hyperparameters.json"
        hyperparameters.write_text(json.dumps(AWS_HYPERPARAMETERS), encoding="utf-8")
        as_aws = ["--network", SHALLOW, "--hyperparameters", str(hyperparameters), "--reward", "centerline"]
        fast = ["--reward", "lap_time", "--actions", "continuous"]
        return {
            "fast_lap": _over_seeds(fast, goal=f"{FAST_LAP_S:g} s lap", seeds=seeds, folder=folder),
            "shallow": _over_seeds([*as_aws, "--evaluate-every", "1500"], goal="5 laps", seeds=seeds, folder=folder),
        }


def _over_seeds(options: list[str], *, goal: str, seeds: int, folder: str) -> dict[str, Any]:
    """Wall clock from typing the command to its goal, over seeds."""
    runs = []
    for seed in range(1, seeds + 1):
        result, wall, peak = _command([*options, "--until", f"{goal} or {TIMEOUT_S:g} s", "--seed", str(seed)], folder)
        runs.append(
            {
                "seed": seed,
                "wall_seconds": round(wall, 2),
                "peak_megabytes": round(peak),
                **{key: result[key] for key in ("reason", "steps", "best_lap_seconds", "parts")},
            }
        )
    walls = [run["wall_seconds"] for run in runs]
    return {
        "goal": goal,
        "wall_seconds": walls,
        "median_seconds": median(walls),
        "worst_seconds": max(walls),
        "solved": sum(run["reason"] in ("laps", "lap_time") for run in runs),
        "peak_megabytes": max(run["peak_megabytes"] for run in runs),
        "runs": runs,
    }


def _command(options: list[str], folder: str) -> tuple[dict[str, Any], float, float]:
    """What `racecraft train` prints, its seconds, and its peak memory in MB."""
    command = [sys.executable, "-m", "racecraft", "train", "--runs", folder, "--json", *options]
    begun = time.perf_counter()
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True
    ) as process:
        memory = _PeakMemory(process.pid)
        memory.start()
        output, errors = process.communicate()
        wall = time.perf_counter() - begun
        memory.join()
    if process.returncode != 0:
        raise RacecraftError(f"racecraft train {' '.join(options)} failed: {errors.strip()[-500:]}")
    result: dict[str, Any] = json.loads(output)
    return result, wall, memory.megabytes


class _PeakMemory(threading.Thread):
    """Follows the largest resident size of a process until it ends; 0 where there is no /proc."""

    def __init__(self, pid: int) -> None:
        super().__init__(daemon=True)
        self._path = Path(f"/proc/{pid}/status")
        self.megabytes = 0.0

    def run(self) -> None:
        """Look ten times a second."""
        while True:
            try:
                text = self._path.read_text(encoding="ascii")
            except OSError:
                return
            if "VmHWM:" not in text:  # it has ended, or was not there yet
                if "zombie" in text:
                    return
            else:
                self.megabytes = int(text.split("VmHWM:")[1].split()[0]) / 1000
            time.sleep(0.1)
