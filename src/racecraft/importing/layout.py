"""Where things lie in the folders of the original, and what each file is for.

Layouts: deepracer-for-cloud's working folder, the folder of a model (its S3 prefix), the console's downloads of models
and logs, DeepRacer on AWS. All of them differ only in where the same few files lie.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Final, Literal

from racecraft.errors import SourceError
from racecraft.importing.archive import is_archive_name

Role = Literal["settings", "trace", "metrics", "log", "weights", "video", "code", "archive", "own", "other"]

REWARD: Final = "reward_function.py"
METADATA: Final = "model_metadata.json"
HYPERPARAMETERS: Final = "hyperparameters.json"
TRAINING_PARAMS: Final = "training_params.yaml"
RUN_ENV: Final = "run.env"
SYSTEM_ENV: Final = "system.env"
CUSTOM_FILES: Final = "custom_files"
EXPERIMENTS: Final = "experiments"
"""Folder of deepracer-for-cloud for run.env and the custom files of one experiment each."""
BUCKET: Final = "data/minio/bucket"
"""Where deepracer-for-cloud's own storage keeps models, those of experiments as well."""
RUN: Final = "run.json"
"""In an archive of Racecraft's own."""

PLACES: Final[Mapping[str, tuple[str, ...]]] = {
    REWARD: (f"{CUSTOM_FILES}/{REWARD}", REWARD),
    METADATA: (f"{CUSTOM_FILES}/{METADATA}", METADATA, f"model/{METADATA}"),
    HYPERPARAMETERS: (f"{CUSTOM_FILES}/{HYPERPARAMETERS}", HYPERPARAMETERS, f"ip/{HYPERPARAMETERS}"),
    TRAINING_PARAMS: (TRAINING_PARAMS,),
    RUN_ENV: (RUN_ENV,),
    SYSTEM_ENV: (SYSTEM_ENV,),
}
"""Where a settings file may lie below a model's root, the first one counts."""

_MARKS: Final = sorted({place for places in PLACES.values() for place in places}, key=lambda place: -place.count("/"))
_PLAIN: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._:@+-]{0,150}")
_BOOKKEEPING: Final = (".coach_checkpoint", "checkpoint", "deepracer_checkpoints.json", ".ready", ".lock", ".finished")
_WEIGHTS: Final = re.compile(r".*\.(ckpt\..*|ckpt|index|meta|data-\d+-of-\d+|pb|pbtxt|h5|tflite|onnx|pt|pth)")
_COPY: Final = re.compile(r"(\.txt|[ _-]*(\(\d+\)|copy|kopie|\d+))+$")
"""What a download, a copy or an editor of Windows puts behind a file's name."""
_MEANT: Final = {
    **dict.fromkeys(("rewardfunction.py", "rewardfunctions.py", "reward.py"), REWARD),
    "modelmetadata.json": METADATA,
    **dict.fromkeys(("hyperparameters.json", "hyperparameter.json", "hyperparams.json"), HYPERPARAMETERS),
}
_FOLDERS_OF_OTHERS: Final = ("defaults", "data", EXPERIMENTS)  # of deepracer-for-cloud, beside the model's own files


def role(name: str) -> Role:
    """What a file is for, by its path."""
    parts = name.split("/")
    base, parent = parts[-1], parts[-2] if len(parts) > 1 else ""
    if base in PLACES or (CUSTOM_FILES in parts[:-1] and base.endswith(".json")):
        return "settings"
    if name == RUN or name.endswith((f"/{RUN}", "metrics/history.jsonl", "metrics/evolution.jsonl", "/notes.md")):
        return "own"
    if parent == "stretches" and base.endswith(".json"):
        return "own"
    if parent == "checkpoints" and (base == "manifest.json" or base.endswith(".safetensors")):
        return "own"
    if base.endswith("-iteration.csv") and parent in ("training-simtrace", "evaluation-simtrace"):
        return "trace"
    if base in _BOOKKEEPING or _WEIGHTS.fullmatch(base):
        return "weights"
    if base.endswith(".json") and ("metrics" in parts[:-1] or re.match(r"(Training|Evaluation)Metrics", base)):
        return "metrics"
    if base.endswith(".log"):
        return "log"
    if base.endswith((".mp4", ".png", ".jpg", ".jpeg")):
        return "video"
    if base.endswith(".py"):
        return "code"
    is_packed_file = base.endswith((".csv.gz", ".log.gz", ".json.gz"))  # which are no archives
    return "archive" if is_archive_name(base) and not is_packed_file else "other"


def meant_by(name: str) -> str:
    """What a file would be read as if it were called so, or an empty string: ``Reward_Function (1).py`` as a reward."""
    base = name.rpartition("/")[2]
    stem, dot, ending = _COPY.sub("", base.lower()).rpartition(".")
    plain = re.sub("[ _-]", "", _COPY.sub("", stem))
    meant = _MEANT.get(f"{plain}{dot}{ending}", "")
    return "" if meant == base else meant


def hint_at(files: Iterable[str], wanted: Iterable[str]) -> str:
    """What to do where none of the wanted files is there, but perhaps one that should be called so, or an archive."""
    files = sorted(files, key=lambda name: (name.count("/"), name))
    for name in files:
        if meant_by(name) in wanted:
            return f"Is {ascii(name)[:100]} meant? Call it {meant_by(name)}."
    packed = next((name for name in files if role(name) == "archive"), "")
    return f"It holds an archive, {ascii(packed)[:100]}: unpack it and import that." if packed else ""


def is_plain(name: str) -> bool:
    """Whether a path can be kept as it is: no odd characters, no hidden files."""
    return all(_PLAIN.fullmatch(part) and not part.endswith(".") for part in name.split("/"))


def runs_inside(names: Iterable[str], root: str) -> set[str]:
    """Folders of Racecraft's runs inside of a model's folder, such as its first import left in ``runs/`` there."""
    runs = {name.removesuffix(RUN) for name in names if name == RUN or name.endswith(f"/{RUN}")}
    return set() if is_below(root, runs) else {run for run in runs if run.startswith(root)}


def is_below(path: str, folders: set[str]) -> bool:
    """Whether a path is one of some folders, or lies in one; folders end with a slash."""
    places = (place for place in range(len(path) + 1) if not place or path[place - 1] == "/")
    return any(path[:place] in folders for place in places)


def is_of_others(name: str) -> bool:
    """Whether a path leads through a folder of deepracer-for-cloud that holds what is of other models."""
    return not set(_FOLDERS_OF_OTHERS).isdisjoint(name.split("/")[:-1])


def find_root(names: Iterable[str], *, source: str) -> str:
    """The folder of the model among all files: ``""``, or a path that ends in ``/``.

    Args:
        names: Relative paths of all files.
        source: What messages call it.

    Raises:
        SourceError: There are several models, or nothing that is understood.
    """
    roots: dict[str, set[str]] = {}  # folder -> what there marks it
    has_history, names = False, list(names)
    for name in names:
        has_history = has_history or role(name) in ("trace", "metrics", "weights", "log")
        for mark in _MARKS:
            if name == mark or name.endswith(f"/{mark}"):
                root = name[: -len(mark)]
                roots.setdefault(root, set()).add(mark)
                break
    if not roots:
        if has_history:
            return ""
        raise SourceError(
            f"{source} holds nothing that is understood: neither {REWARD} nor {METADATA} nor {RUN_ENV}.",
            hint=hint_at(names, (REWARD, METADATA))
            or "Name a deepracer-for-cloud folder, a model's folder or archive, or a reward function's file.",
        )
    runs = runs_inside(names, "")
    originals = {root for root in roots if not is_below(root, runs)}
    roots = {  # but for runs that were made of the model that lies around them
        root: marks for root, marks in roots.items() if root in originals or not is_below(root, originals)
    }
    own = {root: marks for root, marks in roots.items() if not is_of_others(root)} or roots
    trained = [root for root, marks in own.items() if {REWARD, TRAINING_PARAMS} <= marks]
    own = {root: marks for root, marks in own.items() if not _is_bucket(root, marks, trained)}
    candidates = [root for root, marks in own.items() if any(mark.endswith(REWARD) for mark in marks)] or list(own)
    outer = min(root.count("/") for root in candidates)
    found = sorted(root for root in candidates if root.count("/") == outer)
    if len(found) > 1:
        listed = ", ".join(ascii(root.rstrip("/"))[:80] for root in found[:5])
        raise SourceError(f"{source} holds {len(found)} models: {listed}.", hint="Import the folder of one of them.")
    return found[0]


def _is_bucket(root: str, marks: Iterable[str], trained: Iterable[str]) -> bool:
    """Whether a folder is deepracer-for-cloud's bucket: ``custom_files``, for the next training, beside its models."""
    is_next = all(mark.startswith(f"{CUSTOM_FILES}/") for mark in marks)
    return is_next and any(
        model.startswith(root) and model != root and CUSTOM_FILES not in model.split("/") for model in trained
    )
