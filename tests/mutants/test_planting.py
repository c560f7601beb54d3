"""The planter itself: what it changes, what it leaves alone, and that it tells what was noticed from what was not."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from covering import COVERING
from plant_native import drawn, load_faults
from planting import faults_of, sample

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "src" / "racecraft"


def planted(source: str) -> list[str]:
    return [fault.plant(source).strip() for fault in faults_of(source)]


@pytest.mark.parametrize(
    ("source", "changed"),
    [
        ("a < b", ["(a <= b)", "(a > b)"]),
        ("a == b", ["(a != b)"]),
        ("a is not None", ["(a is None)"]),
        ("a + b", ["(a - b)"]),
        ("a // b", ["(a * b)"]),
        ("-a", ["(a)"]),
        ("not a", ["(a)"]),
        ("a and b", ["(a or b)"]),
        ("a if b else c", ["(c if b else a)"]),
        ("x[3]", ["x[(4)]"]),
        ("f(0.5)", ["pass", "f((1.0))"]),
        ("max(a, b)", ["pass", "(min)(a, b)"]),
        ("x.y = a", ["pass"]),
        ("x = True", ["x = (False)"]),
        ("x += y", ["pass"]),
        ("for a in b:\n    break", ["for a in b:\n    pass"]),
        ("def f():\n    return a", ["def f():\n    return None"]),
    ],
)
def test_a_fault_is_a_slip_in_one_place(source: str, changed: list[str]) -> None:
    assert planted(source) == changed


@pytest.mark.parametrize(
    "source",
    [
        '"""Says 1 < 2."""',
        "from a import b",
        "x: Final[Literal[1]]",
        "def f(a: Annotated[int, 3]) -> Annotated[int, 4]: ...",
        "@decorated(3)\nclass A: ...",
        "raise Error(1 + 2)",
        "assert a < b",
        "f'{a + 1}'",
        "if TYPE_CHECKING:\n    x = 3",
        "x = zip(a, b, strict=True)",
        "x = [a] * b",
        "x = 'a' + b",
    ],
)
def test_what_no_behaviour_shows_is_left_alone(source: str) -> None:
    assert planted(source) == []


def test_a_sample_is_the_same_again_and_of_each_place_takes_one() -> None:
    source = (SOURCES / "race" / "placement.py").read_text(encoding="utf-8")
    first = sample(source, 20, seed="1")
    assert first == sample(source, 20, seed="1") != sample(source, 20, seed="2")
    assert len({fault.span for fault in first}) == 20
    assert [fault.span for fault in first] == sorted(fault.span for fault in first)
    assert len(sample("a + b", 20, seed="1")) == 1


@pytest.mark.costly
@pytest.mark.parametrize("module", ["race/marshal.py", "replay/codec.py", "run/simtrace.py"])  # the last with umlauts
def test_with_a_fault_a_file_is_still_python_and_differs_in_that_place_alone(module: str) -> None:
    source = (SOURCES / module).read_text(encoding="utf-8")
    for fault in faults_of(source)[::10]:
        text = fault.plant(source)
        assert ast.dump(ast.parse(text)) != ast.dump(ast.parse(source))
        start, end = fault.span
        assert (text[:start], text[start + len(fault.after) :]) == (source[:start], source[end:])
        assert source[:start].count("\n") + 1 == fault.line


@pytest.mark.costly
def test_there_are_faults_enough_and_tests_that_cover_them() -> None:
    for module, (number, tests) in COVERING.items():
        assert len(sample((SOURCES / module).read_text(encoding="utf-8"), number, seed="1")) == number, module
        assert all((ROOT / test.partition("::")[0]).is_file() for test in tests if "/" in test), module
    assert sum(number for number, _ in COVERING.values()) >= 180


def test_every_fault_of_the_core_names_a_file_another_text_and_tests_that_there_are() -> None:
    faults = load_faults(ROOT)
    assert len({(fault.file, fault.original, fault.mutated) for fault in faults}) == len(faults)
    for fault in faults:
        assert fault.original != fault.mutated, fault
        assert fault.tests, fault
        assert all((ROOT / test).is_file() for test in fault.files), fault
        assert all((ROOT / "native" / "tests" / f"{program}.cpp").is_file() for program in fault.programs), fault
    # where the core moved on, the planter says which texts are no longer there
    assert sum(fault.can_be_planted for fault in faults) >= 250


def test_a_fault_of_the_core_stands_in_its_function() -> None:
    for fault in load_faults(ROOT)[::5]:
        lines = fault.source.splitlines()
        block = [lines[number - 1] for number in fault.block]
        assert fault.original in "\n".join(block), fault
        assert not block[0].startswith((" ", "}", "#")), fault
        assert block[-1].startswith("}") or not any(line.startswith("}") for line in block), fault


def test_a_sample_of_the_core_takes_of_every_file_its_share_and_a_larger_one_begins_with_it() -> None:
    faults = load_faults(ROOT)
    half = drawn(faults, len(faults) // 2)
    assert drawn(faults, 50) == half[:50]
    assert len(set(half)) == len(faults) // 2
    every, taken = (Counter(fault.file for fault in some) for some in (faults, half))
    assert all(abs(taken[file] - every[file] / 2) <= 1.0 for file in every)


TESTS = """
def test_good():
    assert True

def test_bad():
    assert 1 > 2

def test_that_kills():
    import os, signal
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.costly
def test_the_first_test_that_fails_has_noticed(tmp_path: Path) -> None:
    (tmp_path / "test_it.py").write_text(TESTS)
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    for test, noticed in (("good", ""), ("good or bad", "test_it.py::test_bad"), ("kills", "no end")):
        ask = (
            f"from plant_python import *; print(run_tests(Path({str(tmp_path)!r}), ('test_it.py', '-k', {test!r}))[0])"
        )
        told = subprocess.run(
            [sys.executable, "-c", ask], cwd=Path(__file__).parent, capture_output=True, text=True, check=True
        )
        assert told.stdout.strip() == noticed
