"""Which of a model's files hold its weights: graphs and checkpoints by iteration, and the one that is wanted.

``8_Step-1234.ckpt.index`` and its data are the checkpoint of iteration 8 after 1,234 steps, ``model_8.pb`` is the graph
of the same, ``model.pb`` alone is what a car gets: the best. ``deepracer_checkpoints.json`` says which checkpoint was
best and which came last, ``.coach_checkpoint`` the last.
"""

from __future__ import annotations

import re
from collections import Counter
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
    def path(self) -> str:
        """The file that is read, without the endings of a pair."""
        return self.index.removesuffix(".index") if self.is_checkpoint else self.graph

    @property
    def name(self) -> str:
        """The same without its folder."""
        return self.path.rpartition("/")[2]

    @property
    def paths(self) -> tuple[str, ...]:
        """What is read."""
        return (self.index, self.data) if self.is_checkpoint else (self.graph,)


def find_models(names: Iterable[str]) -> list[ModelFiles]:
    """Every state of the model among files, in the order of its training; one without a number comes first.

    A checkpoint and a graph of one iteration are the same state, but where several folders have that iteration only
    those of one folder are.
    """
    pairs: dict[tuple[str, int, int], dict[str, str]] = {}  # folder, iteration, steps -> paths by their ending
    graphs: dict[tuple[str, int], str] = {}
    others: list[ModelFiles] = []
    for path in sorted(names):
        folder, _, base = path.rpartition("/")
        checkpoint, graph = _CHECKPOINT.fullmatch(base), _GRAPH.fullmatch(base)
        if checkpoint is not None:
            pairs.setdefault((folder, int(checkpoint[2]), int(checkpoint[3])), {})[checkpoint[4]] = path
        elif graph is not None:
            graphs[folder, int(graph[1])] = path
        elif base.endswith(".pb"):
            others.append(ModelFiles(graph=path))
    whole = {key: paths for key, paths in pairs.items() if len(paths) == 2}
    num_pairs = Counter(iteration for _, iteration, _ in whole)
    folders: dict[int, list[str]] = {}
    for folder, iteration in graphs:
        folders.setdefault(iteration, []).append(folder)
    numbered = []
    for (folder, iteration, steps), paths in sorted(whole.items(), reverse=True):  # the later of two takes the graph
        there = folders.get(iteration, [])
        is_alone = len(there) == num_pairs[iteration] == 1
        graph_path = graphs.pop((there[0] if is_alone else folder, iteration), "")
        index, data = paths["index"], paths["data-00000-of-00001"]
        numbered.append(ModelFiles(iteration=iteration, steps=steps, graph=graph_path, index=index, data=data))
    numbered += [ModelFiles(iteration=iteration, graph=path) for (_, iteration), path in graphs.items()]
    return [*others, *sorted(numbered, key=lambda model: (model.iteration, model.steps, model.path))]


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
    said = _said(source, names)
    if not models:
        halves = [half[1] for name in names if (half := _CHECKPOINT.fullmatch(name.rpartition("/")[2]))]
        if missed := [*(said[which] for which in (wanted, LAST) if which in said), *halves]:
            notes.append(f"The checkpoint {missed[0]} is not whole among the files: it begins with fresh weights.")
        return None
    plain = [model for model in models if model.iteration < 0]
    if wanted in said:
        if meant := _of(models, said[wanted]):
            return _only(meant, source)
        notes.append(f"The {wanted} checkpoint, of iteration {_iteration(said[wanted])}, is not among the files.")
    if plain and (wanted == BEST or len(plain) == len(models)):
        return _only(plain, source)
    highest = [model for model in models if model.iteration == models[-1].iteration]
    chosen = _only(_of(models, said.get(LAST, "")) or highest, source)
    if len(models) > 1:
        notes.append(f"{chosen.name} was taken of {len(models)} states of the model; --checkpoint chooses another.")
    return chosen


def _only(models: list[ModelFiles], source: Source) -> ModelFiles:
    """The one state that is meant.

    Raises:
        SourceError: There are several: nobody knows which of them is the model.
    """
    if len(models) == 1:
        return models[0]
    listed, hint = ", ".join(model.path[-80:] for model in models[:5]), "Name one with --checkpoint FILE."
    if models[0].iteration < 0:
        raise SourceError(f"{source.title} holds {len(models)} graphs: {listed}.", hint=hint)
    raise SourceError(
        f"{source.title} holds {len(models)} models of iteration {models[0].iteration}: {listed}.", hint=hint
    )


def _of(models: list[ModelFiles], checkpoint: str) -> list[ModelFiles]:
    """Those that a checkpoint's name means: of its iteration, and of its steps where some are."""
    iteration = _iteration(checkpoint)
    of_the_iteration = [model for model in models if model.iteration == iteration >= 0]
    return [model for model in of_the_iteration if model.name == checkpoint] or of_the_iteration


def _named(models: list[ModelFiles], wanted: str, source: Source) -> ModelFiles:
    number = _NUMBER.fullmatch(wanted)
    by_path = [model for model in models if wanted in (model.path, model.graph)]
    by_name = [model for model in models if wanted in (model.name, model.graph.rpartition("/")[2])]
    by_number = [model for model in models if number is not None and model.iteration == int(number[1])]
    for found in (by_path, by_name, by_number):
        if found:
            is_graph = wanted.endswith(".pb") and bool(found[0].graph)
            model = _only(found, source)
            return replace(model, index="", data="") if is_graph else model
    known = [model.name for model in models]
    listed = ", ".join(known[:10]) or "no weights"
    raise SourceError(
        f"{source.title} has no checkpoint {wanted[:80]!r}; it has {listed}.",
        hint=did_you_mean(wanted, (BEST, LAST, NONE, *known)),
    )


def _said(source: Source, names: list[str]) -> Mapping[str, str]:
    """Names of the best and the last checkpoint by the files that say so; what is damaged says nothing."""
    said: dict[str, str] = {}
    for path in sorted(names, reverse=True):
        base = path.rpartition("/")[2]
        if base not in (CHECKPOINTS_FILE, COACH_FILE) or source.files[path].path is None:
            continue
        with suppress(ConfigError):
            text = source.text(path)
            if base == COACH_FILE:
                said.setdefault(LAST, text.strip())
                continue
            for which, entry in parse_json_object(text, name=path).items():
                if isinstance(entry, dict) and which in ("best_checkpoint", "last_checkpoint"):
                    said[which.removesuffix("_checkpoint")] = str(entry.get("name", ""))
    return {which: name for which, name in said.items() if _iteration(name) >= 0}


def _iteration(name: str) -> int:
    number = _NUMBER.fullmatch(name)
    return -1 if number is None else int(number[1])
