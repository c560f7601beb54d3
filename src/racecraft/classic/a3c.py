"""Asynchronous advantage actor-critic, A3C (Mnih et al. 2016): A2C by several processes that do not wait.

Every process plays worlds of its own, works out a gradient from weights that others are changing meanwhile, and adds
its step to them without a lock. That costs no waiting and some staleness, and it makes no two runs alike: worlds and
lots follow the seed, but in which order steps arrive is the operating system's affair.

The weights lie in a file that all processes have mapped into memory; so do the running squares of RMSProp, which the
paper shares, too, and the numbers of steps that were taken.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.classic.a2c import ActorCriticSettings, begin, gradients
from racecraft.classic.network import Floats
from racecraft.classic.policy import ActorCritic
from racecraft.classic.rollout import collect
from racecraft.classic.views import VectorView
from racecraft.classic.worlds import Worlds
from racecraft.errors import RacecraftError, TrainingError
from racecraft.run.atomic import write_json

__all__ = ["A3CSettings", "begin", "learn"]

PAUSE: Final = 0.02
"""s between two looks of the parent at what the others did, and of a process at whether it may go on."""
LEAD: Final = 5_000
"""Steps that the processes may be ahead of the parent's last look: one that judges what they have learned on a busy
machine would else find them far beyond, and see too few policies to choose a good one from."""
FADE: Final = 0.99
"""Of RMSProp's running squares."""
PROGRAM: Final = "from racecraft.classic.a3c import work; work()"
"""A process of its own rather than multiprocessing, which would run the caller's script once more."""


@dataclass(frozen=True, kw_only=True)
class A3CSettings(ActorCriticSettings):
    """Of A3C."""

    processes: int = 2
    """That learn at once."""


class Shared:
    """What all processes see, in files of one folder: weights, squares, and a step counter and a stop mark for each."""

    def __init__(self, folder: Path, *, size: int, processes: int) -> None:
        self.weights: Floats = _mapped(folder / "weights", size, np.float32)
        self.squares: Floats = _mapped(folder / "squares", size, np.float32)
        self.steps: NDArray[Any] = _mapped(folder / "steps", processes, np.int64)
        self.end: NDArray[Any] = _mapped(folder / "end", 2, np.int64)
        """Steps of all processes after which they stop, and after which they wait."""


def _mapped(path: Path, size: int, kind: type[Any]) -> NDArray[Any]:
    if not path.exists():
        np.zeros(size, kind).tofile(path)
    return np.memmap(path, kind, "r+", shape=(size,))


def learn(worlds: Worlds, policy: ActorCritic, settings: A3CSettings, rng: np.random.Generator) -> Iterator[None]:
    """Let the processes learn, and take over now and then what they have; yields after each time."""
    split = len(policy.actor.parameters)
    with tempfile.TemporaryDirectory(prefix="racecraft-a3c-") as name:
        folder, before = Path(name), worlds.steps
        shared = Shared(folder, size=split + len(policy.critic.parameters), processes=settings.processes)
        shared.weights[:split], shared.weights[split:] = policy.actor.parameters, policy.critic.parameters
        shared.end[:] = settings.steps - before, LEAD
        task = {"name": worlds.name, "make": worlds.make, "settings": asdict(settings), "folder": name}
        workers = []
        try:
            for number, seed in enumerate(rng.integers(2**31, size=settings.processes).tolist()):
                text = json.dumps({**task, "number": number, "seed": seed, "parent": os.getpid()})
                environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
                workers.append(  # in a group of its own, which Ctrl-C at a terminal does not reach
                    subprocess.Popen([sys.executable, "-c", PROGRAM, text], env=environment, process_group=0)
                )
            read = [0] * settings.processes
            while True:
                is_last = all(worker.poll() is not None for worker in workers)
                policy.actor.parameters[:], policy.critic.parameters[:] = shared.weights[:split], shared.weights[split:]
                worlds.steps = before + int(shared.steps.sum())
                for number in range(settings.processes):
                    returns = _returns(folder, number, skip=read[number])
                    read[number] += len(returns)
                    worlds.returns += returns
                if any(worker.returncode for worker in workers):
                    raise _failure(folder)
                yield
                if is_last:
                    return
                shared.end[1] = worlds.steps - before + LEAD
                time.sleep(PAUSE)
        finally:
            shared.end[0] = 0
            for worker in workers:
                try:
                    worker.wait(timeout=10.0)
                except subprocess.TimeoutExpired:
                    worker.kill()
                    worker.wait()


def _returns(folder: Path, number: int, *, skip: int) -> list[float]:
    """Returns of the episodes that a process has finished, without the first ones."""
    path = folder / f"returns-{number}"
    return np.fromfile(path, np.float64, offset=8 * skip).tolist() if path.exists() else []


def _failure(folder: Path) -> TrainingError:
    """What the first of the processes said that could not go on."""
    for path in sorted(folder.glob("failure-*")):
        said = json.loads(path.read_text(encoding="utf-8"))
        return TrainingError(said["message"], hint=said["hint"])
    return TrainingError("A process of A3C has ended early; what it said stands above.")


def work() -> None:
    """What each process does; what an environment or a setting is to blame for, it leaves to its parent to tell."""
    task = json.loads(sys.argv[1])
    try:
        _play(task)
    except RacecraftError as error:
        said = {"message": str(error), "hint": error.hint}
        write_json(Path(task["folder"]) / f"failure-{task['number']}", said)
        sys.exit(1)


def _play(task: dict[str, Any]) -> None:
    """Copy the weights, play, work out a gradient, add it; wait for the parent now and then."""
    number, values = task["number"], task["settings"]
    settings = A3CSettings(**{**values, "hidden": tuple(values["hidden"])})
    rng = np.random.default_rng(task["seed"])
    worlds = Worlds(task["name"], num_envs=settings.num_envs, seed=task["seed"], view=VectorView, make=task["make"])
    policy = begin(worlds, settings, rng)
    split = len(policy.actor.parameters)
    shared = Shared(Path(task["folder"]), size=split + len(policy.critic.parameters), processes=settings.processes)
    with (Path(task["folder"]) / f"returns-{number}").open("ab", buffering=0) as ledger:
        while shared.steps.sum() < shared.end[0] and os.getppid() == task["parent"]:
            if shared.steps.sum() >= shared.end[1]:
                time.sleep(PAUSE)
                continue
            policy.actor.parameters[:], policy.critic.parameters[:] = shared.weights[:split], shared.weights[split:]
            rollout = collect(
                worlds,
                policy,
                rng,
                length=settings.length,
                gamma=settings.gamma,
                gae_lambda=settings.gae_lambda,
                reward_scale=settings.reward_scale,
            )
            for part, gradient in zip(
                (slice(None, split), slice(split, None)), gradients(policy, rollout, settings), strict=True
            ):
                length = float(np.sqrt(gradient @ gradient))
                gradient = gradient * min(settings.max_norm / (length + 1e-8), 1.0)
                squares, weights = shared.squares[part], shared.weights[part]
                squares += (1.0 - FADE) * (gradient * gradient - squares)
                weights -= settings.learning_rate * gradient / (np.sqrt(squares) + 1e-5)
            shared.steps[number] = worlds.steps
            ledger.write(np.array(worlds.returns).tobytes())
            worlds.returns.clear()
    worlds.close()
