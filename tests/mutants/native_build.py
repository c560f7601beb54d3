"""The native core compiled once for planting, and of a fault no more than what can differ.

    clean build ─ which objects hold code of the changed lines? ─ compiled beside it ─ a program is linked of both

What an object holds is read from its debug lines: a change of an inline function is nothing to a file that includes
its header and never calls it. Types and constants leave no lines; with them, whatever includes the file is compiled.
"""

from __future__ import annotations

import json
import os
import re
import resource
import shlex
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from outcomes import FOLDER

TREE = FOLDER / "native-tree"
CLEAN = FOLDER / "native-build"
CHANGED = FOLDER / "native-changed"
ARCHIVE = "libracecraft_core.a"
MODULE = "_native"
CPU_SECONDS, WALL_SECONDS = 100, 600  # of one program; who needs longer does not end, and that is noticed
TOOLS = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))


class DoesNotCompileError(Exception):
    """A fault is no C++."""


def run(command: Sequence[str | Path], *, folder: Path = TREE, **environment: str) -> tuple[bool, str]:
    """Whether a command succeeds, and what it says."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS))

    try:
        done = subprocess.run(
            command,
            cwd=folder,
            env={**os.environ, "PATH": TOOLS, **environment},
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


def _must(command: Sequence[str | Path], *, folder: Path = CLEAN, **environment: str) -> str:
    is_done, output = run(command, folder=folder, **environment)
    if not is_done:
        raise SystemExit(output[-4000:])
    return output


@dataclass
class Build:
    """A clean build, and what it is made of."""

    commands: dict[str, list[str]] = field(default_factory=dict)
    """Of every object, how it is compiled."""
    includes: dict[str, set[Path]] = field(default_factory=dict)
    """Of every object, the files of the tree that it is compiled from."""
    lines: dict[str, dict[str, set[int]]] = field(default_factory=dict)
    """Of every object, the lines that it holds code of, by the name of the file."""
    links: dict[str, list[str]] = field(default_factory=dict)
    """Of every program, and the module, how it is linked, the archive's objects one by one."""

    def affected(self, target: str, file: Path, lines: range | None) -> list[str]:
        """The objects of a program that a change of a function's lines changes; without lines, all that include it."""
        found = [part for part in self.links[target] if part in self.commands and file in self.includes[part]]
        if lines is None:
            return found
        # Of what a test computes from constants only the result is left: its own object always counts. And of what
        # only hands on to other functions no line may be left anywhere.
        own = [part for part in self.lines if "/tests/" in part]
        holding = [part for part, held in self.lines.items() if not held.get(file.name, set()).isdisjoint(lines)]
        return [part for part in found if part in own or part in holding or set(holding) <= set(own)]

    def compile(self, objects: list[str]) -> None:
        """Compile the tree as it is into a folder of its own."""
        for part in objects:
            place = CHANGED / part
            place.parent.mkdir(parents=True, exist_ok=True)
            command = [str(place) if word == part else word for word in self.commands[part]]
            is_done, output = run(command, folder=CLEAN)
            if not is_done:
                raise DoesNotCompileError(output[-3000:])

    def link(self, target: str, changed: list[str]) -> Path:
        """A program, or the module, with the changed objects in their places."""
        made = CHANGED / target
        made.unlink(missing_ok=True)
        command = [str(CHANGED / word) if word in changed else word for word in self.links[target]]
        command[command.index("-o") + 1] = str(made)
        is_done, output = run(command, folder=CLEAN)
        if not is_done:
            raise DoesNotCompileError(output[-3000:])
        return made


def make_build(programs: list[str]) -> Build:
    """Build the copied tree: hardly optimised, one instruction set, the programs and the module."""
    CLEAN.mkdir(exist_ok=True)
    nanobind = _must([sys.executable, "-m", "nanobind", "--cmake_dir"]).strip()
    settings = {
        "CMAKE_BUILD_TYPE": "Mutant",
        "CMAKE_CXX_FLAGS_MUTANT": "-O1 -g1",
        "CMAKE_EXPORT_COMPILE_COMMANDS": "ON",
        "RACECRAFT_PORTABLE": "ON",
        "SKBUILD": "ON",
        "nanobind_DIR": nanobind,
        "Python_EXECUTABLE": sys.executable,
    }
    _must(["cmake", "-S", TREE, "-B", CLEAN, "-G", "Ninja", *(f"-D{key}={value}" for key, value in settings.items())])
    _must(["ninja", "-j1", *programs, MODULE], CCACHE_BASEDIR=str(FOLDER), CCACHE_NOHASHDIR="1")

    build = Build()
    for entry in json.loads((CLEAN / "compile_commands.json").read_text(encoding="utf-8")):
        command = shlex.split(entry["command"])
        part = command[command.index("-o") + 1]
        if "/native/" in part and (CLEAN / part).exists():
            build.commands[part] = command[_compiler(command) :]
            build.lines[part] = _lines_of(CLEAN / part)
    for block in _must(["ninja", "-t", "deps"]).split("\n\n"):
        part, *paths = block.splitlines() or [""]
        if (part := part.partition(":")[0]) in build.commands:
            build.includes[part] = {(CLEAN / path.strip()).resolve() for path in paths}
    members = {Path(part).name: part for part in build.commands}
    for target in (*programs, MODULE):
        build.links[target] = _link_of(target, members)
    return build


def _compiler(command: list[str]) -> int:
    """Where the compiler stands in a command, behind what keeps its objects."""
    return next((place for place, word in enumerate(command, 1) if Path(word).name == "ccache"), 0)


def _lines_of(path: Path) -> dict[str, set[int]]:
    found: dict[str, set[int]] = {}
    listing = _must(["objdump", "-d", "-l", "--no-show-raw-insn", "--no-addresses", path])
    for name, line in set(re.findall(r"^/.*/([\w.]+):(\d+)", listing, flags=re.MULTILINE)):
        found.setdefault(name, set()).add(int(line))
    return found


def _link_of(target: str, members: dict[str, str]) -> list[str]:
    """The command that links a target, with what it takes from the archive instead of the archive."""
    file = target if target != MODULE else next(path.name for path in CLEAN.glob("_native*.so"))
    script = _must(["ninja", "-t", "commands", "-s", file])
    command = next(shlex.split(part) for part in script.split(" && ") if f"-o {file}" in part)
    traced = _must([*command, "-Wl,-t,-t"])  # twice: members of archives as well
    taken = re.findall(rf"{re.escape(ARCHIVE)}\)?\(?([\w.]+\.o)", traced)
    place = command.index(ARCHIVE)
    return [*command[:place], *(members[name] for name in taken), *command[place + 1 :]]
