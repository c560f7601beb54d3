"""Plant the small faults of `native/*.toml` in the native core, one at a time: `make mutants` runs it after Python's.

    copy of the tree ─ a fault is written into it ─ what can differ is compiled ─ the covering tests run ─ taken out

    .venv/bin/python tests/mutants/plant_native.py [--sample 100] [--only objects.hpp] [--again]

Tests of behaviour alone, no golden hashes: programs of native/tests first, then those in Python, until one notices.
The plan, too, is read from the copy: what is worked on meanwhile changes no run.
Every outcome is a line of `build/mutants/native.jsonl`; a run goes on where the last one stopped, planting anew what
changed, or survived tests that have changed since.
"""

from __future__ import annotations

import argparse
import random
import resource
import shutil
import sys
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

from native_build import CHANGED, CLEAN, MODULE, TREE, Build, DoesNotCompileError, make_build, run
from outcomes import Log, Outcome, digest, report
from plant_python import copy_tree, environment

SEED = "2026"
# Large networks take minutes in a core that is hardly optimised.
OPTIONS = ("-x", "-q", "-p", "no:cacheprovider", "-m", "not slow", "-k", "not golden and not DEEP_CONVOLUTIONAL")


@dataclass(frozen=True)
class Fault:
    """One change of a file of the core."""

    tree: Path
    """What it is planted in."""
    file: str
    """Below native/."""
    original: str
    """Text that the file holds once."""
    mutated: str
    breaks: str
    """What is then wrong."""
    tests: tuple[str, ...]
    """Programs of native/tests and files of tests/ that cover it, cheap ones first."""
    source: str = field(repr=False)
    """Of the file, without the fault."""

    @property
    def programs(self) -> list[str]:
        """The tests in C++."""
        return [test for test in self.tests if "/" not in test]

    @property
    def files(self) -> list[str]:
        """The tests in Python."""
        return [test for test in self.tests if "/" in test]

    @property
    def can_be_planted(self) -> bool:
        """Whether the file holds the text, once."""
        return self.source.count(self.original) == 1

    @property
    def line(self) -> int:
        """Where the text begins, from 1."""
        return self.source[: self.source.index(self.original)].count("\n") + 1

    @property
    def block(self) -> range:
        """The lines of the function or type that the text stands in, from 1."""
        lines = self.source.splitlines()
        first, last = self.line - 1, self.line - 1 + self.original.count("\n")
        while first > 0 and not _begins(lines[first]):
            first -= 1
        while last + 1 < len(lines) and not lines[last].startswith("}") and not _begins(lines[last + 1]):
            last += 1
        return range(first + 1, last + 2)

    @property
    def is_code(self) -> bool:
        """Whether it is a function's body that changes, not a type or a constant."""
        head = self.source.splitlines()[self.block.start - 1]
        return "(" in head and not head.startswith(("constexpr", "inline constexpr", "struct", "class"))

    @property
    def key(self) -> str:
        """Changes with the fault and what stands around it."""
        around = self.source.splitlines()[self.block.start - 1 : self.block.stop - 1]
        return digest(self.file, around, self.original, self.mutated)

    @property
    def covered_by(self) -> str:
        """Changes with the tests."""
        programs = self.tree / "native" / "tests"
        paths = [self.tree / test if "/" in test else programs / f"{test}.cpp" for test in self.tests]
        return digest(self.tests, [path.read_bytes() for path in paths])


def _begins(line: str) -> bool:
    return bool(line) and line[0] not in " }/#"


def load_faults(tree: Path) -> list[Fault]:
    """Every fault of a tree's tables, file by file."""
    found = []
    for path in sorted((tree / "tests" / "mutants" / "native").glob("*.toml")):
        table = tomllib.loads(path.read_text(encoding="utf-8"))
        for entry in table["mutant"]:
            tests = tuple(entry.pop("tests", table["tests"][entry["file"]]))
            source = (tree / "native" / entry["file"]).read_text(encoding="utf-8")
            found.append(Fault(tree, **entry, tests=tests, source=source))
    return found


def drawn(faults: list[Fault], number: int) -> list[Fault]:
    """So many by chance, of every file its share; more of them begin with the same ones."""
    chance = random.Random(SEED)
    files: dict[str, list[Fault]] = {}
    for fault in faults:
        files.setdefault(fault.file, []).append(fault)
    ranked = []
    for of_file in files.values():
        chance.shuffle(of_file)
        ranked += [((place + chance.random()) / len(of_file), fault) for place, fault in enumerate(of_file)]
    return [fault for _, fault in sorted(ranked, key=lambda pair: pair[0])][:number]


def notice(build: Build, fault: Fault) -> str:
    """The first of the covering tests that fails with the fault in the tree, empty if none does."""
    path = TREE / "native" / fault.file
    changed: list[str] = []

    def make(target: str) -> Path | None:
        """A program with the fault, if it differs."""
        affected = build.affected(target, path, fault.block if fault.is_code else None)
        build.compile([part for part in affected if part not in changed])
        changed.extend(part for part in affected if part not in changed)
        return build.link(target, changed) if affected else None

    for program in fault.programs:
        if (made := make(program)) and (failed := failed_test(made)):
            return failed
    if fault.files and (made := make(MODULE)):
        install(made)
        return failed_test(*fault.files)
    return ""


def failed_test(*tests: str | Path) -> str:
    """The first test of a program, or of files, that fails; empty if none does."""
    if isinstance(tests[0], Path):
        is_good, output = run([tests[0], "~golden"])
    else:
        is_good, output = run([sys.executable, "-m", "pytest", *OPTIONS, *tests], **environment(TREE))
    failed = [line.split()[1] for line in output.splitlines() if line.startswith(("FAILED ", "ERROR "))]
    return "" if is_good else failed[0] if failed else f"{Path(tests[0]).name} does not end well"


def check_clean(tests: list[str | Path]) -> None:
    """Without any fault every test must be good."""
    install(next(CLEAN.glob("_native*.so")))
    for test in tests:
        if failed := failed_test(test):
            raise SystemExit(f"Without any fault {failed} fails.")


def install(module: Path) -> None:
    """Put the native module into the tree's package."""
    package = TREE / "src" / "racecraft"
    (place,) = package.glob("_native*.so")
    place.unlink()
    shutil.copy2(module, place)


def plant(build: Build, fault: Fault) -> str:
    """What notices a fault, empty if nothing does."""
    path = TREE / "native" / fault.file
    source = path.read_text(encoding="utf-8")
    path.write_text(source.replace(fault.original, fault.mutated), encoding="utf-8")
    try:
        return notice(build, fault)
    finally:
        path.write_text(source, encoding="utf-8")
        shutil.rmtree(CHANGED, ignore_errors=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--sample", type=int, default=1000, help="how many, by chance; all of them unless it is said")
    parser.add_argument("--only", default="", help="faults of files whose names hold this")
    parser.add_argument("--again", action="store_true", help="forget earlier outcomes")
    given = parser.parse_args()
    log = Log("native")
    if given.again:
        log.forget()
    copy_tree(TREE)
    faults = [fault for fault in load_faults(TREE) if given.only in fault.file]
    gone = [fault for fault in faults if not fault.can_be_planted]
    faults = drawn([fault for fault in faults if fault not in gone], given.sample)
    todo = [fault for fault in faults if log.find(fault.key, fault.covered_by) is None]
    print(f"{len(faults)} faults in the native core, {len(faults) - len(todo)} of them planted before", flush=True)
    broken = []
    if todo:
        build = make_build(sorted({program for fault in todo for program in fault.programs}))
    checked: list[str | Path] = []
    for fault in todo:
        covering: list[str | Path] = [*(CLEAN / program for program in fault.programs), *fault.files]
        check_clean([test for test in covering if test not in checked])
        checked += covering
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        try:
            noticed = plant(build, fault)
        except DoesNotCompileError as error:
            print(f"{fault.file}: {fault.mutated!r} does not compile:\n{error}", flush=True)
            broken.append(fault)
            continue
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        told = f"native/{fault.file}", fault.line, fault.original, fault.mutated, noticed
        log.add(Outcome(*told, fault.key, fault.covered_by, round(seconds, 1)))
    outcomes = [log.find(fault.key, fault.covered_by) for fault in faults if fault not in broken]
    report("Native", [outcome for outcome in outcomes if outcome is not None])
    for fault in gone:
        print(f"No longer there, or there twice: {fault.file}: {fault.original!r}")
    sys.exit(bool(broken or gone))


if __name__ == "__main__":
    main()
