"""Packages that only some verbs need: what brings each of them, said in one sentence where it is missing."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from racecraft.errors import ConfigError

EXTRAS: Final[dict[str, tuple[str, ...]]] = {
    "video": ("av",),
    "limit": ("casadi", "scipy"),
    "compile": ("numba",),
    "torch": ("torch",),
    "sb3": ("stable-baselines3",),
    "cuda": ("torch", "cuda-bindings"),
    "tune": ("optuna",),
    "ray": ("ray",),
    "serve": (
        "fastapi",
        "uvicorn",
        "sse-starlette",
        "sqlalchemy",
        "alembic",
        "pwdlib[argon2]",
        "limits",
        "segno",
        "av",
        "authlib",
        "joserfc",
    ),
    "postgres": ("psycopg[binary]",),
    "s3": ("obstore",),
    "multi": ("pettingzoo", "openskill"),
    "watch": ("pygame-ce",),
    "atari": ("ale-py",),
    "lessons": ("jupyterlab", "ipykernel"),
}
"""The extras of pyproject.toml and the packages that each brings; a test holds the two alike."""
MODULES: Final = {
    "stable_baselines3": "sb3",
    "cuda": "cuda",
    "sse_starlette": "serve",
    "starlette": "serve",
    "pygame": "watch",
    "ale_py": "atari",
}
"""Modules that are not called like their packages, and the extra that brings them."""


def not_installed(module: str, what: str = "This") -> ConfigError | None:
    """What to say of a module that is not there; None where no extra brings it, which is a bug.

    Args:
        module: Dotted name.
        what: Needs it; the beginning of a sentence.
    """
    top = module.partition(".")[0]
    known = {package.partition("[")[0]: extra for extra, packages in reversed(EXTRAS.items()) for package in packages}
    extra = {**known, **MODULES}.get(top)
    if extra is None:
        return None
    packages = " ".join(f"'{package}'" if "[" in package else package for package in EXTRAS[extra])
    return ConfigError(
        f"{what} needs {top}, which is not installed.",
        hint=f"pip install 'racecraft[{extra}]', or in a checkout: .venv/bin/pip install {packages}",
    )


def check_installed(module: str, what: str) -> None:
    """Say what is missing without importing it, which may take a second.

    Args:
        module: That an extra brings.
        what: Needs it; the beginning of a sentence.

    Raises:
        ConfigError: It is not installed.
    """
    told = not_installed(module, what)
    if told is not None and importlib.util.find_spec(module) is None:
        raise told


@contextmanager
def needed_for(what: str) -> Iterator[None]:
    """Import inside of this what an extra brings.

    Args:
        what: Needs it; the beginning of a sentence.

    Raises:
        ConfigError: It is not installed.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        told = not_installed(error.name or "", what)
        if told is None:
            raise
        raise told from error
