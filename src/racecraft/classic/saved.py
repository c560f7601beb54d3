"""What was learned, in a folder: plain text and numbers, nothing that runs.

runs/<name>/learned.json         what was learned from what, with which settings, and how well
            policy.safetensors   the table or the weights
            curve.jsonl          a line for every evaluation
            film.mp4             where it was watched
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from os import PathLike
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.checks import check_number, check_type, check_whole
from racecraft.classic.algorithms import find_algorithm
from racecraft.classic.settings import Settings
from racecraft.classic.views import Cut
from racecraft.errors import RacecraftError, RunError
from racecraft.json_file import read_json_object
from racecraft.run.atomic import write_file, write_json
from racecraft.run.tensor_file import tensor_file

FORMAT: Final = 1
INFO, POLICY, CURVE, FILM = "learned.json", "policy.safetensors", "curve.jsonl", "film.mp4"
MAX_POLICY_BYTES: Final = 1 << 30


@dataclass(frozen=True, kw_only=True)
class Lesson:
    """What is to be learned from what: with the seed, all that is needed to do it again."""

    environment: str
    """Id, as ``gymnasium.make`` takes it."""
    make: Mapping[str, Any]
    """Further arguments of ``gymnasium.make``."""
    algorithm: str
    """Its name."""
    settings: Settings
    """Of the algorithm."""
    seed: int
    """Of all random numbers."""


def save(
    folder: Path,
    lesson: Lesson,
    arrays: Mapping[str, NDArray[Any]],
    *,
    steps: int,
    curve: Sequence[tuple[int, float]],
    result: Mapping[str, Any],
) -> None:
    """Write all files; each is either the old or the new one."""
    write_file(folder / POLICY, tensor_file(arrays, {"algorithm": lesson.algorithm}), durable=False)
    lines = (json.dumps({"steps": at, "mean_return": mean}) + "\n" for at, mean in curve)
    write_file(folder / CURVE, "".join(lines).encode(), durable=False)
    document = {
        "format": FORMAT,
        "environment": lesson.environment,
        "make": dict(lesson.make),
        "algorithm": lesson.algorithm,
        "settings": asdict(lesson.settings),
        "seed": lesson.seed,
        "steps": steps,
        **result,
    }
    write_json(folder / INFO, document, durable=False)


def load(folder: str | Path) -> tuple[Lesson, dict[str, NDArray[Any]], int]:
    """The lesson of a saved run, what was learned, and the steps that it took.

    Raises:
        RunError: The folder holds nothing that was learned, or what is not understood.
        ConfigError: It is no path.
    """
    check_type("run", folder, (str, PathLike), "use the path of a run's folder, such as 'runs/NAME'")
    from safetensors import SafetensorError
    from safetensors.numpy import load_file

    folder = Path(folder)
    if not (folder / INFO).is_file():
        raise RunError(f"{folder} holds nothing that 'racecraft learn' saved: {INFO} is missing.")
    try:
        document = read_json_object(folder / INFO)
        if document.get("format") != FORMAT:
            raise RunError(f"{folder / INFO} has format {document.get('format')!r}; this version reads {FORMAT}.")
        made = find_algorithm(document.get("algorithm", ""))
        check_type("environment", document.get("environment"), str, "allowed is the id of an environment")
        check_type("make", document.get("make"), dict, "allowed is an object")
        check_whole("seed", document.get("seed"), 0, 2**63 - 1)
        check_whole("steps", document.get("steps"), 0, 10**15)
        lesson = Lesson(
            environment=document["environment"],
            make=document["make"],
            algorithm=document["algorithm"],
            settings=_settings(made.settings, document.get("settings")),
            seed=document["seed"],
        )
        if (folder / POLICY).stat().st_size > MAX_POLICY_BYTES:
            raise RunError(f"{folder / POLICY} is larger than a policy can be.")
        arrays: dict[str, NDArray[Any]] = load_file(folder / POLICY)
    except (SafetensorError, OSError) as error:
        raise RunError(f"{folder / POLICY} is damaged: {error}") from error
    except RunError:
        raise
    except RacecraftError as error:
        raise RunError(f"{folder} is damaged: {error}") from error
    return lesson, arrays, document["steps"]


def read_curve(folder: Path) -> list[tuple[int, float]]:
    """Steps and mean return of the evaluations so far.

    Raises:
        RunError: The file is damaged.
    """
    if not (folder / CURVE).is_file():
        return []
    curve = []
    try:
        for line in (folder / CURVE).read_text(encoding="utf-8").splitlines():
            document = json.loads(line)
            check_whole("steps", document["steps"], 0, 10**15)
            check_number("mean_return", document["mean_return"], -1e300)
            curve.append((document["steps"], float(document["mean_return"])))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise RunError(f"{folder / CURVE} is damaged: {error}") from error
    return curve


def _settings(kind: type[Settings], values: Any) -> Settings:
    known = {field.name for field in fields(kind)}
    check_type("settings", values, dict, "allowed is an object")
    if set(values) != known:
        raise RunError(f"settings name {sorted(set(values) ^ known)}, which {kind.__name__} does not know or misses.")
    values = {name: tuple(value) if isinstance(value, list) else value for name, value in values.items()}
    if "cuts" in values:
        values["cuts"] = tuple(_cut(cut) for cut in values["cuts"])
    return kind(**values)


def _cut(value: Any) -> Cut:
    check_type("cut", value, dict, "allowed is an object")
    check_whole("column", value.get("column"), 0, 10**6)
    edges = value.get("edges")
    check_type("edges", edges, list, "allowed is a list of numbers")
    for edge in edges:
        check_number("edge", edge, -1e9, 1e9)
    if len(edges) > 10_000 or not np.all(np.diff(edges) > 0.0):
        raise RunError("edges of a cut must ascend.")
    return Cut(value["column"], tuple(map(float, edges)))
