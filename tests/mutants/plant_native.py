"""Plant the small faults of `native/*.toml` in the native core, one at a time.

`make mutants` runs it after that of Python.

    copy of the tree ─ a fault is written into it ─ what changed is compiled ─ the covering tests run ─ taken out

    .venv/bin/python tests/mutants/plant_native.py [--only objects.hpp] [--again]

The tests of behaviour run first; if none of them notices, those that compare golden hashes. Every outcome is a line of
`build/mutants/native.jsonl`; a run goes on where the last one stopped, planting anew what changed, or survived tests
that have changed since. The sum of it is `build/mutants/native.json`. Kernels are compiled for one instruction set.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import resource
import subprocess
import sys
import tomllib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from plant_python import FOLDER, ROOT, copy_tree

TABLES = Path(__file__).parent / "native"
TREE = FOLDER / "native-tree"
BUILD = FOLDER / "native-build"
LOG = FOLDER / "native.jsonl"
GOLDEN = ("engine_test", "camera_test", "tests/sim/test_determinism.py", "tests/sim/test_race_bits.py")
CPU_SECONDS, WALL_SECONDS = 200, 1800  # of one program; who needs longer does not end, and that is noticed
TOOLS = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
# The installed package is found by a finder of its own; the tree's comes instead.
PYTEST = """import sys
sys.meta_path[:] = [finder for finder in sys.meta_path if "editable" not in type(finder).__module__]
sys.path.insert(0, "src")
import pytest
sys.exit(pytest.main(sys.argv[1:]))"""
Outcome = dict[str, Any]


@dataclass(frozen=True)
class Fault:
    """One change of a file of the core."""

    file: str
    """Below native/."""
    original: str
    """Text that the file holds once."""
    mutated: str
    breaks: str
    """What is then wrong."""
    tests: tuple[str, ...]
    """Programs of native/tests and files of tests/ that cover it, cheap ones first."""

    def plant(self, source: str) -> str:
        """The source with the fault."""
        assert source.count(self.original) == 1, (
            f"{self.file}: {self.original!r} is there {source.count(self.original)} times"
        )
        return source.replace(self.original, self.mutated)

    @property
    def key(self) -> str:
        """Changes with the fault and the file."""
        return _digest(self.file, (ROOT / "native" / self.file).read_bytes(), self.original, self.mutated)

    @property
    def covered_by(self) -> str:
        """Changes with the tests."""
        return _digest(self.tests, [_source(test).read_bytes() for test in self.tests])


def _digest(*parts: object) -> str:
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:12]


def _source(test: str) -> Path:
    return ROOT / test if "/" in test else ROOT / "native" / "tests" / f"{test}.cpp"


def load_faults() -> list[Fault]:
    """Every fault of the tables, file by file."""
    found = []
    for path in sorted(TABLES.glob("*.toml")):
        table = tomllib.loads(path.read_text(encoding="utf-8"))
        for entry in table["mutant"]:
            tests = tuple(entry.pop("tests", table["tests"][entry["file"]]))
            found.append(Fault(**entry, tests=tests))
    return found


def _run(command: list[str | Path]) -> tuple[bool, str]:
    """Whether a command succeeds in the tree, and what it says."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS))

    try:
        done = subprocess.run(
            command,
            cwd=TREE,
            env={**os.environ, "PATH": TOOLS, "CCACHE_BASEDIR": str(FOLDER), "CCACHE_NOHASHDIR": "1"},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            timeout=WALL_SECONDS,
            preexec_fn=limit,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False, "no end"
    return done.returncode == 0, done.stdout


def configure() -> None:
    """A tree of its own, and how it is built: hardly optimised, one instruction set, tests and module."""
    copy_tree(TREE)
    nanobind = subprocess.run(
        [sys.executable, "-m", "nanobind", "--cmake_dir"], capture_output=True, text=True, check=True
    ).stdout.strip()
    settings = {
        "CMAKE_BUILD_TYPE": "Mutant",
        "CMAKE_CXX_FLAGS_MUTANT": "-O1",
        "RACECRAFT_PORTABLE": "ON",
        "SKBUILD": "ON",
        "nanobind_DIR": nanobind,
        "Python_EXECUTABLE": sys.executable,
    }
    arguments = [f"-D{key}={value}" for key, value in settings.items()]
    is_done, output = _run(["cmake", "-S", TREE, "-B", BUILD, "-G", "Ninja", *arguments])
    if not is_done:
        raise SystemExit(output[-3000:])


def build(tests: tuple[str, ...]) -> tuple[bool, str]:
    """Compile what the tests need and bring the module to its place."""
    targets = [test for test in tests if "/" not in test]
    if len(targets) < len(tests):
        targets.append("_native")
    is_done, output = _run(["ninja", "-C", BUILD, "-j1", *targets])
    for module in BUILD.glob("_native*.so"):
        place = TREE / "src" / "racecraft" / module.name
        place.unlink(missing_ok=True)
        place.hardlink_to(module)
    return is_done, output


def notice(tests: tuple[str, ...], *, is_golden: bool) -> str:
    """The first of the tests that fails, empty if none does."""
    for test in tests:
        if "/" not in test:
            is_good, output = _run([BUILD / test, "golden" if is_golden else "~golden"])
            failed = [line.split()[1] for line in output.splitlines() if line.startswith("FAILED ")]
        else:
            words = [
                "-x",
                "-q",
                "-p",
                "no:cacheprovider",
                "-m",
                "not slow",
                "-k",
                "golden" if is_golden else "not golden",
            ]
            is_good, output = _run([sys.executable, "-c", PYTEST, *words, test])
            failed = [line.split()[1].partition("::")[2] for line in output.splitlines() if line.startswith("FAILED ")]
        if not is_good:
            return f"{test}: {failed[0] if failed else 'does not end well'}"
    return ""


def plant(fault: Fault) -> Outcome:
    """What becomes of a fault."""
    path = TREE / "native" / fault.file
    source = path.read_text(encoding="utf-8")
    path.write_text(fault.plant(source), encoding="utf-8")
    try:
        cheap = tuple(test for test in fault.tests if "/" not in test)
        dear = tuple(test for test in fault.tests if "/" in test)
        for tests, kind in ((cheap, "behaviour"), (dear, "behaviour"), (GOLDEN, "golden")):
            if not tests:
                continue
            is_built, output = build(tests)
            if not is_built:
                raise SystemExit(f"{fault.file}: {fault.mutated!r} does not compile:\n{output[-3000:]}")
            if noticed := notice(tests, is_golden=kind == "golden"):
                return {"killed_by": kind, "noticed": noticed}
        return {"killed_by": "", "noticed": ""}
    finally:
        path.write_text(source, encoding="utf-8")


def known(fault: Fault) -> Outcome | None:
    """What became of a fault before, if that still holds."""
    found = None
    for line in LOG.read_text(encoding="utf-8").splitlines() if LOG.exists() else []:
        outcome = json.loads(line)
        is_final = outcome["killed_by"] == "behaviour" or outcome["covered_by"] == fault.covered_by
        if outcome["key"] == fault.key and is_final:
            found = outcome
    return found


def summary(faults: list[Fault]) -> dict[str, Any]:
    """Counts, and the faults that no test of behaviour noticed."""
    outcomes = [(fault, outcome) for fault in faults if (outcome := known(fault)) is not None]
    counts = Counter(outcome["killed_by"] or "nothing" for _, outcome in outcomes)
    rest = [
        {"file": fault.file, "breaks": fault.breaks, "original": fault.original, "mutated": fault.mutated, **outcome}
        for fault, outcome in outcomes
        if outcome["killed_by"] != "behaviour"
    ]
    share = counts["behaviour"] / max(len(outcomes), 1)
    return {"planted": len(outcomes), **counts, "share_by_behaviour": round(share, 4), "rest": rest}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--only", default="", help="faults of files whose names hold this")
    parser.add_argument("--again", action="store_true", help="forget earlier outcomes")
    given = parser.parse_args()
    FOLDER.mkdir(parents=True, exist_ok=True)
    if given.again:
        LOG.unlink(missing_ok=True)
    faults = [fault for fault in load_faults() if given.only in fault.file]
    todo = [fault for fault in faults if known(fault) is None]
    print(f"{len(faults)} faults in the native core, {len(faults) - len(todo)} of them planted before", flush=True)
    if todo:
        configure()
        tests = tuple(dict.fromkeys(test for fault in todo for test in fault.tests))
        is_built, output = build(tests)
        noticed = notice(tests, is_golden=False) if is_built else output[-3000:]
        if noticed:
            raise SystemExit(f"Without any fault: {noticed}")
    for fault in todo:
        outcome = plant(fault)
        with LOG.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"key": fault.key, "covered_by": fault.covered_by, **outcome}) + "\n")
        print(f"{outcome['killed_by'] or 'SURVIVED':9} {fault.file}: {fault.breaks} ({outcome['noticed']})", flush=True)
    result = summary(faults)
    (FOLDER / "native.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    for entry in result["rest"]:
        print(f"{entry['killed_by'] or 'nothing'} noticed {entry['file']}: {entry['breaks']}")
    counts = f"{result.get('behaviour', 0)} by behaviour, {result.get('golden', 0)} by golden hashes alone"
    print(f"\nNative: {result['planted']} faults planted, {counts}: {result['share_by_behaviour']:.1%}")


if __name__ == "__main__":
    main()
