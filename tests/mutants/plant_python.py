"""Plant small faults in our Python, one at a time, and see whether the tests notice: `make mutants` runs it.

    copy of the tree ─ a fault is written into it ─ a forked child imports it and runs the covering tests ─ taken out

    .venv/bin/python tests/mutants/plant_python.py --jobs 2 [--only race/] [--again]

The plan is read from the copy: what is worked on meanwhile changes no run.
Every outcome is a line of `build/mutants/python.jsonl`; a run goes on where the last one stopped. It plants a fault
anew when its module has changed, and one that nobody noticed when its tests have. What others wrote is imported once.
"""

from __future__ import annotations

import argparse
import importlib
import os
import resource
import shutil
import signal
import subprocess
import sys
import sysconfig
import time
import traceback
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from covering import COVERING, Tests
from outcomes import FOLDER, ROOT, Log, Outcome, digest, report
from planting import Fault, sample

SEED = "2026"
CPU_SECONDS, WALL_SECONDS = 100, 900  # of one fault; who needs longer does not end, and that is noticed
PRELOADED = ("numpy", "pydantic", "scipy.ndimage", "scipy.interpolate", "PIL.Image", "rich", "typer")
PRELOADED += ("gymnasium", "sqlalchemy.orm", "shapely", "safetensors.numpy", "yaml", "openskill.models", "fastapi")
PRELOADED += ("torch", "av", "httpx")


SITE = """import sys
sys.meta_path[:] = [finder for finder in sys.meta_path if "editable" not in type(finder).__module__]
"""
"""Run by every interpreter that a test starts: the package is found by a finder of its own, and the tree's is meant."""


def environment(tree: Path) -> dict[str, str]:
    """What lets processes import the package of a tree, which is left as it is."""
    path = os.pathsep.join((str(tree / "src"), str(tree / "site")))
    return {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}


def lead_into(tree: Path) -> None:
    """Have processes that a test starts with an environment of their own import the package of a tree, too."""
    begin = subprocess.Popen.__init__

    def begin_there(self: Any, *args: Any, env: Any = None, **more: Any) -> None:
        begin(self, *args, env=env if env is None else {**env, **environment(tree)}, **more)

    subprocess.Popen.__init__ = begin_there  # type: ignore[method-assign]


class FirstFailure:
    """A pytest plugin that remembers the first test that failed."""

    name = ""

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed and not self.name:
            self.name = report.nodeid

    def pytest_collectreport(self, report: Any) -> None:
        if report.failed and not self.name:
            self.name = f"{report.nodeid} (cannot be loaded)"


def copy_tree(folder: Path) -> None:
    """What is tracked or new, without the pages; and the native core beside our Python, as a wheel has it."""
    shutil.rmtree(folder, ignore_errors=True)
    listed = ["git", "ls-files", "-co", "--exclude-standard", "-z", "--", ".", ":!web"]
    for name in subprocess.run(listed, cwd=ROOT, capture_output=True, check=True, text=True).stdout.split("\0"):
        if name and (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    (folder / "site").mkdir()
    (folder / "site" / "sitecustomize.py").write_text(SITE, encoding="utf-8")
    # not imported: the tree's own could not bind the same types beside it
    (native,) = Path(sysconfig.get_paths()["platlib"], "racecraft").glob("_native*.so")
    shutil.copy2(native, folder / "src" / "racecraft")
    if (ROOT.parent / "shared").is_dir():
        with suppress(FileExistsError):
            (folder.parent / "shared").symlink_to(ROOT.parent / "shared")


def run_tests(tree: Path, tests: Tests, *, keeps_bytecode: bool = False) -> tuple[str, float]:
    """Run tests of a tree in a child; the test that noticed, empty if none did, and the CPU seconds it took."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.setsid()
            os.close(reading)
            os.chdir(tree)
            for number in (1, 2):
                os.dup2(os.open(tree / "output.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
            resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS))
            os.environ.update(environment(tree))
            lead_into(tree)
            sys.dont_write_bytecode = not keeps_bytecode
            failure = FirstFailure()
            options = ["-x", "-p", "no:cacheprovider", "-m", "not slow", "--basetemp", f"{tree}-tmp"]
            options += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]  # of what is preloaded
            code = pytest.main([*options, *tests], plugins=[failure])
            os.write(writing, (failure.name or (f"pytest ended with {code}" if code else "")).encode() or b"\0")
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(0)
    os.close(writing)
    deadline = time.monotonic() + WALL_SECONDS
    while os.waitpid(child, os.WNOHANG)[0] == 0:
        if time.monotonic() > deadline:
            os.killpg(child, signal.SIGKILL)
        time.sleep(0.05)
    with suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)  # what the tests have started and a fault did not end
    noticed = os.read(reading, 10_000).decode()
    os.close(reading)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return (noticed or "no end").strip("\0"), seconds


@dataclass(frozen=True)
class Step:
    """A fault to plant."""

    module: str
    tests: Tests
    fault: Fault
    key: str
    """Changes with the module."""
    covered_by: str
    """Changes with the tests."""


def planned(tree: Path, only: str) -> list[Step]:
    """Every fault to plant in a tree."""
    found = []
    for module, (number, tests) in COVERING.items():
        if module.startswith(only):
            source = (tree / "src" / "racecraft" / module).read_text(encoding="utf-8")
            files = [tree / test.partition("::")[0] for test in tests if "/" in test]
            texts = [path.read_text(encoding="utf-8") for path in files]
            for index, fault in enumerate(sample(source, number, seed=f"{SEED} {module}")):
                found.append(Step(module, tests, fault, digest(SEED, source, index), digest(tests, texts)))
    return found


def work(tree: Path, plan: list[Step], log: Log) -> None:
    """Plant what is planned in a tree, one fault after the other."""
    sys.meta_path[:] = [finder for finder in sys.meta_path if "editable" not in type(finder).__module__]
    for name in [name for name in sys.modules if name.partition(".")[0] == "racecraft"]:
        del sys.modules[name]
    sys.path.insert(0, str(tree / "src"))
    clean: set[Tests] = set()
    for step in plan:
        module, tests, fault = step.module, step.tests, step.fault
        if tests not in clean:
            noticed, seconds = run_tests(tree, tests, keeps_bytecode=True)
            print(f"{module}: its tests take {seconds:.1f} s of CPU", flush=True)
            if noticed:
                raise SystemExit(f"Without any fault {noticed} fails; see {tree / 'output.txt'}.")
            clean.add(tests)
        path = tree / "src" / "racecraft" / module
        source, stamp = path.read_text(encoding="utf-8"), path.stat()
        path.write_text(fault.plant(source), encoding="utf-8")
        noticed, seconds = run_tests(tree, tests)
        path.write_text(source, encoding="utf-8")
        os.utime(path, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
        told = fault.line, fault.before, fault.after, noticed
        log.add(Outcome(module, *told, step.key, step.covered_by, round(seconds, 1)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--jobs", type=int, default=1, help="trees that faults are planted in side by side")
    parser.add_argument("--only", default="", help="modules whose names begin so")
    parser.add_argument("--again", action="store_true", help="forget earlier outcomes")
    given = parser.parse_args()
    log = Log("python")
    if given.again:
        log.forget()
    trees = [FOLDER / f"tree-{job}" for job in range(given.jobs)]
    copy_tree(trees[0])
    plan = planned(trees[0], given.only)
    todo = [step for step in plan if log.find(step.key, step.covered_by) is None]
    print(f"{len(plan)} faults in Python, {len(plan) - len(todo)} of them planted before")
    for name in PRELOADED if todo else ():
        with suppress(ImportError):
            importlib.import_module(name)
    children = []
    for tree in trees[1:] if todo else ():
        shutil.rmtree(tree, ignore_errors=True)
        shutil.copytree(trees[0], tree)
    for job, tree in enumerate(trees if todo else ()):
        if (child := os.fork()) == 0:
            work(tree, todo[job :: given.jobs], log)
            os._exit(0)
        children.append(child)
    failed = [child for child in children if os.waitpid(child, 0)[1] != 0]

    outcomes = [log.find(step.key, step.covered_by) for step in plan]
    report("Python", [outcome for outcome in outcomes if outcome is not None])
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
