"""`from racecraft import …`: small, typed as documented, and free of charge."""

from __future__ import annotations

import inspect
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import racecraft

NAMES = [name for name in dir(racecraft) if name != "__version__"]


@pytest.mark.parametrize("name", NAMES)
def test_every_name_is_there_and_documented(name: str) -> None:
    thing = getattr(racecraft, name)
    assert inspect.getdoc(thing)
    assert thing is getattr(racecraft, name)


def test_what_the_readme_promises_is_public() -> None:
    assert {"load_track", "Simulation", "train", "resume", "evaluate", "RacecraftError"} <= set(NAMES)
    assert racecraft.load_track("reinvent_2018").length == pytest.approx(17.7, abs=0.05)


def test_type_checkers_see_the_same_names() -> None:
    source = inspect.getsource(racecraft)
    for name in NAMES:
        assert f" as {name}\n" in source or f"    {name} = " in source


def test_a_star_brings_all_of_them() -> None:
    brought: dict[str, object] = {}
    exec("from racecraft import *", brought)
    assert set(NAMES) <= set(brought)


@pytest.mark.parametrize(
    ("call", "others"),
    [
        *((racecraft.load_track, [["oval"], 5, None, b"oval"]), (racecraft.load_tracks, [5, None])),
        (lambda what: racecraft.load_tracks([what]), [5, ["oval"], racecraft.load_track("oval")]),
        (lambda what: racecraft.draw_track(what, "oval.png"), ["oval", None]),
        *((racecraft.evaluate, [None, 5, ["runs/one"]]), (racecraft.generalize, [None, 5, ["runs/one"]])),
        *((racecraft.resume, [None, 5]), (racecraft.verify, ["one.replay", None])),
        (racecraft.read_replay, [0, None, []]),
        *((racecraft.ModelMetadata.load, [0, {}]), (racecraft.Hyperparameters.load, [0, {}])),
    ],
)
def test_what_is_no_name_or_path_is_told_in_a_sentence(call: Callable[[Any], object], others: list[Any]) -> None:
    for other in others:
        with pytest.raises(racecraft.RacecraftError) as error:
            call(other)
        assert repr(other) in str(error.value)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'trian'"):
        racecraft.trian  # noqa: B018
    with pytest.raises(ImportError):
        from racecraft import trian  # type: ignore[attr-defined]  # noqa: F401


@pytest.mark.costly
@pytest.mark.parametrize(
    "first", ["import racecraft.training", "import racecraft.race.evaluation", "import racecraft.env"]
)
def test_train_and_evaluate_are_functions_whatever_was_imported_before(first: str) -> None:
    program = f"{first}; import racecraft; assert callable(racecraft.train) and callable(racecraft.evaluate)"
    subprocess.run([sys.executable, "-c", program], check=True)


def test_the_version_is_the_projects() -> None:
    project = Path(__file__).parents[1] / "pyproject.toml"
    assert racecraft.__version__ == tomllib.loads(project.read_text(encoding="utf-8"))["project"]["version"]


def test_importing_racecraft_imports_nothing_else() -> None:
    program = (
        "import sys; before = set(sys.modules); import racecraft; "
        "new = {name.split('.')[0] for name in set(sys.modules) - before} - set(sys.stdlib_module_names); "
        "print(sorted(new))"
    )
    done = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "['racecraft']"
