"""What our source says of other places of it: modules, what they hold, and files of the repository are there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
MODULE = re.compile(r"`racecraft((?:\.\w+)+)`")
FOLDERS = "src/racecraft|web/src|native|tests|benchmarks|examples|lessons"
FILE = re.compile(rf"\b(?:{FOLDERS})/[\w./-]+\.(?:py|ts|svelte|hpp|cpp)\b")


def is_there(names: list[str]) -> bool:
    """Whether there is a module of these names below the package, or something in one, by its text."""
    place = ROOT / "src" / "racecraft"
    for index, name in enumerate(names):
        if (place / name).is_dir():
            place /= name
            continue
        file = place / f"{name}.py"
        text, rest = (file, names[index + 1 :]) if file.is_file() else (place / "__init__.py", names[index:])
        return not rest or re.search(rf"\b{rest[0]}\b", text.read_text(encoding="utf-8")) is not None
    return True


@pytest.mark.parametrize(("names", "expected"), [("race.policy.NetworkPolicy", True), ("race.policy.Polity", False)])
def test_a_name_is_looked_up(names: str, expected: bool) -> None:
    assert is_there(names.split(".")) is expected


def said(sources: list[Path], pattern: re.Pattern[str]) -> list[tuple[str, re.Match[str]]]:
    """What sources say, and where."""
    return [
        (f"{path.relative_to(ROOT)}: {found[0]}", found)
        for path in sorted(sources)
        for found in pattern.finditer(path.read_text(encoding="utf-8"))
    ]


def test_modules_that_are_named_are_there() -> None:
    told = said([*(ROOT / "src" / "racecraft").rglob("*.py")], MODULE)
    assert [where for where, found in told if not is_there(found[1].strip(".").split("."))] == []
    assert len(told) > 50


def test_files_that_are_named_are_there() -> None:
    sources = [*(ROOT / "src" / "racecraft").rglob("*.py"), *(ROOT / "native").rglob("*.?pp")]
    sources += [*(ROOT / "web" / "src").rglob("*.ts"), *(ROOT / "web" / "src").rglob("*.svelte")]
    told = said(sources, FILE)
    assert [where for where, found in told if not (ROOT / found[0]).exists()] == []
    assert told
