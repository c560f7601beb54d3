"""Which of a model's files hold its weights: graphs and checkpoints by iteration, and the one that is wanted.

``8_Step-1234.ckpt.index`` and its data are the checkpoint of iteration 8 after 1,234 steps, ``model_8.pb`` is the graph
of the same, ``model.pb`` alone is what a car gets: the best. ``deepracer_checkpoints.json`` says which checkpoint was
best and which came last, ``.coach_checkpoint`` the last.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Final

from racecraft.errors import ConfigError, SourceError, did_you_mean
from racecraft.importing.source import Source
from racecraft.json_file import parse_json_object

BEST: Final = "best"
LAST: Final = "last"
NONE: Final = "none"
"""For fresh weights instead of the files'."""
CHECKPOINTS_FILE: Final = "deepracer_checkpoints.json"
COACH_FILE: Final = ".coach_checkpoint"
_CHECKPOINT: Final = re.compile(r"((\d{1,9})_Step-(\d{1,12})\.ckpt)\.(index|data-00000-of-00001)")
_GRAPH: Final = re.compile(r"model_(\d{1,9})\.pb")
_NUMBER: Final = re.compile(r"(?:model_)?(\d{1,9})(?:_Step-\d{1,12})?(?:\.pb|\.ckpt)?")


@dataclass(frozen=True)
class ModelFiles:
    """One state of a model."""

    iteration: int = -1
    """Of its training; -1 where its name does not say."""
    steps: int = -1
    """Of its training; -1 where its name does not say."""
    graph: str = ""
    """Path of the frozen graph."""
    index: str = ""
    """Path of the checkpoint's index."""
    data: str = ""
    """Path of the checkpoint's numbers."""

    @property
    def is_checkpoint(self) -> bool:
        """Whether there is a checkpoint, which says more than a graph."""
        return bool(self.index and self.data)

    @property
    def name(self) -> str:
        """The file that is read, without its folder and endings of a pair."""
        path = self.index.removesuffix(".index") if self.is_checkpoint else self.graph
        return path.rpartition("/")[2]

    @property
    def paths(self) -> tuple[str, ...]:
        """What is read."""
        return (self.index, self.data) if self.is_checkpoint else (self.graph,)


def find_models(names: Iterable[str]) -> list[ModelFiles]:
    """Every state of the model among files, in the order of its training; one without a number comes first."""
    numbered: dict[int, ModelFiles] = {}
    others: list[ModelFiles] = []
    for path in sorted(names):
        base = path.rpartition("/")[2]
        checkpoint, graph = _CHECKPOINT.fullmatch(base), _GRAPH.fullmatch(base)
        if checkpoint is not None:
            number = int(checkpoint[2])
            known = replace(numbered.get(number, ModelFiles(iteration=number)), steps=int(checkpoint[3]))
            numbered[number] = replace(known, index=path) if checkpoint[4] == "index" else replace(known, data=path)
        elif graph is not None:
            number = int(graph[1])
            numbered[number] = replace(numbered.get(number, ModelFiles(iteration=number)), graph=path)
        elif base.endswith(".pb"):
            others.append(ModelFiles(graph=path))
    return [*others, *(model for _, model in sorted(numbered.items()) if model.graph or model.is_checkpoint)]


def choose_model(source: Source, names: Iterable[str], wanted: str, notes: list[str]) -> ModelFiles | None:
    """The state of the model that is wanted; None where there is none, or none is wanted.

    Args:
        source: What is imported.
        names: Those of its files that belong to the model.
        wanted: ``best``, ``last``, ``none``, an iteration or a file's name.
        notes: Gets a sentence where the choice is not plain.

    Raises:
        SourceError: There is no such state.
    """
    names = list(names)
    models = find_models(names)
    if wanted == NONE:
        return None
    if wanted not in (BEST, LAST):
        return _named(models, wanted, source)
    if not models:
        return None
    said = _said(source, names)
    plain = [model for model in models if model.iteration < 0]
    if said.get(wanted, -1) >= 0:
        for model in models:
            if model.iteration == said[wanted]:
                return model
        notes.append(f"The {wanted} checkpoint, of iteration {said[wanted]}, is not among the files.")
    if plain and (wanted == BEST or len(plain) == len(models)):
        if len(plain) > 1:
            listed = ", ".join(model.graph[-80:] for model in plain[:5])
            raise SourceError(
                f"{source.title} holds {len(plain)} graphs: {listed}.", hint="Name one with --checkpoint FILE."
            )
        return plain[0]
    chosen = next((model for model in models if model.iteration == said.get(LAST, -1) >= 0), models[-1])
    if len(models) > 1:
        notes.append(f"{chosen.name} was taken of {len(models)} states of the model; --checkpoint chooses another.")
    return chosen


def _named(models: list[ModelFiles], wanted: str, source: Source) -> ModelFiles:
    number = _NUMBER.fullmatch(wanted)
    for model in models:
        is_it = wanted in (model.graph, model.name, model.graph.rpartition("/")[2])
        if is_it or (number is not None and model.iteration == int(number[1])):
            is_graph = wanted.endswith(".pb") and bool(model.graph)
            return replace(model, index="", data="") if is_graph else model
    known = [model.name for model in models]
    listed = ", ".join(known[:10]) or "no weights"
    raise SourceError(
        f"{source.title} has no checkpoint {wanted[:80]!r}; it has {listed}.", hint=did_you_mean(wanted, known)
    )


def _said(source: Source, names: list[str]) -> Mapping[str, int]:
    """Iterations of the best and the last checkpoint by the files that say so; what is damaged says nothing."""
    said: dict[str, int] = {}
    for path in sorted(names, reverse=True):
        base = path.rpartition("/")[2]
        if base not in (CHECKPOINTS_FILE, COACH_FILE) or source.files[path].path is None:
            continue
        with suppress(ConfigError):
            text = source.text(path)
            if base == COACH_FILE:
                said.setdefault(LAST, _iteration(text.strip()))
                continue
            for which, entry in parse_json_object(text, name=path).items():
                if isinstance(entry, dict) and which in ("best_checkpoint", "last_checkpoint"):
                    said[which.removesuffix("_checkpoint")] = _iteration(str(entry.get("name", "")))
    return said


def _iteration(name: str) -> int:
    number = _NUMBER.fullmatch(name)
    return -1 if number is None else int(number[1])
