"""`racecraft doctor`: every part tried for a moment, with what to do where one fails."""

from __future__ import annotations

import platform
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from racecraft import __version__


@dataclass(frozen=True, kw_only=True)
class Finding:
    """The outcome of one check."""

    name: str
    """What was looked at."""
    ok: bool
    """Whether it works."""
    text: str
    """What was found."""
    hint: str = ""
    """What to do about it."""
    warns: bool = False
    """It works, with less than there could be."""

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return asdict(self)


class Lacking(Exception):
    """What works, and what it lacks; a hint says what that means."""

    def __init__(self, text: str, *, hint: str) -> None:
        super().__init__(text)
        self.hint = hint


def examine() -> list[Finding]:
    """Try every part; a failure never stops the checks that follow."""
    return [_try(name, check, hint) for name, check, hint in CHECKS]


def _try(name: str, check: Callable[[], str], hint: str) -> Finding:
    try:
        return Finding(name=name, ok=True, text=check())
    except Lacking as lack:
        return Finding(name=name, ok=True, text=str(lack), hint=lack.hint, warns=True)
    except Exception as error:  # whatever is broken here is what the user wants to know
        return Finding(name=name, ok=False, text=f"{type(error).__name__}: {error}", hint=hint)


def _python() -> str:
    return f"Python {platform.python_version()}, Racecraft {__version__}, {platform.system()} {platform.machine()}"


def _core() -> str:
    from racecraft.sim import instruction_set, slower_than_could_be

    isa = instruction_set()
    text = f"native core loaded, instruction set {isa}"
    if slower := slower_than_could_be():
        raise Lacking(text, hint=f"{slower} Results are the same, a training takes longer.")
    if isa == "portable" and platform.machine() in ("x86_64", "AMD64"):
        raise Lacking(
            text, hint="This CPU has no AVX2 and FMA: results are the same, a training takes several times as long."
        )
    return text


def _simulator() -> str:
    import numpy as np

    from racecraft.sim import Simulation
    from racecraft.track import load_track

    simulation = Simulation(load_track("oval"), num_envs=4)
    for _ in range(10):
        simulation.step(np.tile([0.0, 1.0], (4, 1)))
    contrast = int(simulation.frames.max()) - int(simulation.frames.min())
    if contrast < 20:
        raise RuntimeError(f"the camera's picture is blank (contrast {contrast})")
    return f"10 steps driven on {simulation.num_threads} threads, camera sees"


def _reward() -> str:
    from racecraft.reward import dry_run, load_preset
    from racecraft.track import load_track

    outcomes = dry_run(load_preset("centerline"), load_track("oval"))
    for outcome in outcomes:
        if outcome.error is not None:
            raise outcome.error
    return f"worker process started, {len(outcomes)} rewards paid"


def _sandbox() -> str:
    from racecraft.reward.sandbox import find_confinement

    walls = find_confinement()
    if walls.is_complete:
        return f"reward code is locked in: {walls}" + ("" if walls.bubblewrap else "; bubblewrap could stand around it")
    raise Lacking(
        f"reward code has {walls}; the system has no {walls.missing}",
        hint="Your own reward functions run all the same: run only what you have read. Somebody else's are refused. "
        "Linux 5.13 or newer with Landlock can lock them in.",
    )


def _learner() -> str:
    from racecraft.learn import NetworkSpec, make_learner

    learner = make_learner(NetworkSpec(num_actions=10), num_threads=1)
    return f"{type(learner).__name__} ready"


def _video() -> str:
    from racecraft.film.encoding import AV1, encoder

    if encoder() == AV1:
        return "films are AV1, which browsers play, but few phones before 2023: with the package av they are H.264"
    import av

    return f"films are {encoder()}, by {av.codec.Codec('libx264', 'w').name}"


def _disk() -> str:
    with tempfile.NamedTemporaryFile(dir=Path.cwd()) as file:
        file.write(b"racecraft")
    return "the current folder can be written to, for runs/"


CHECKS: list[tuple[str, Callable[[], str], str]] = [
    ("python", _python, "Install Python 3.11 or newer."),
    ("native core", _core, "Build it again: make clean setup."),
    ("simulator", _simulator, "Build it again: make clean setup."),
    ("reward worker", _reward, "Racecraft must be allowed to start processes."),
    ("reward sandbox", _sandbox, "Look at the error: it is a bug in Racecraft."),
    ("learner", _learner, "Compile the native core again: make build."),
    ("video", _video, "Install PyAV: pip install av."),
    ("folder", _disk, "Change into a folder that you may write to."),
]
