"""Layer order, cycles, heavy and native imports and the size of files, read from the source without importing it."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[1] / "src" / "racecraft"
NATIVE = Path(__file__).parents[1] / "native"
LAYERS = (
    "errors",
    "scoped_warnings",
    "version",
    "system",
    "checks",
    "extras",
    "json_file",
    "moved",
    "track",
    "gpu",
    "sim",
    "limits",
    "reward",
    "agent",
    "env",
    "learn",
    "run",
    "perception",
    "race",
    "replay",
    "film",
    "perceiving",
    "contest",
    "judging",
    "fidelity",
    "training",
    "classic",
    "tuning",
    "sweeping",
    "importing",
    "car",
    "analysis",
    "course",
    "serve",
    "site",
    "bench",
    "cli",
)
CONSOLE = (
    "quick",
    "provider_settings",
    "settings",
    "schemas",
    "naming",
    "road",
    "conditions",
    "compression",
    "tab",
    "problems",
    "replies",
    "store",
    "people",
    "provider",
    "live",
    "jobs",
    "streams",
    "door",
    "audit",
    "tracks",
    "evaluations",
    "models",
    "tuning",
    "sweeps",
    "races",
    "contests",
    "driving",
    "rewards",
    "machine",
    "lessons",
    "groups",
    "comments",
    "quotas",
    "desks",
    "submissions",
    "finals",
    "workers",
    "context",
    "app",
    "server",
    "station",
    "openapi",
)
"""Rooms of serve/, lowest first; a room's routes see the context, which is made of what all rooms know."""
ROUTES = (
    *("serve/models/archives.py", "serve/models/choices.py", "serve/models/exports.py"),
    *("serve/evaluations/analysis.py", "serve/evaluations/beliefs.py"),
)
"""Besides those that are called routes.py."""
FACADE = ("__init__", "__main__")
TORCH = ("learn/torch_",)
CORE = ("sim/", "learn/native_")
MAX_LINES = 500
DATA = ("starters",)
"""Folders of files that are no modules: runs, with their reward functions."""


def modules(source: Path) -> dict[str, Path]:
    """Dotted name to file; a package is its __init__."""
    names = {}
    for path in sorted(source.rglob("*.py")):
        parts = ("racecraft", *path.relative_to(source).with_suffix("").parts)
        if parts[1] in DATA:
            continue
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return names


def imports(path: Path, name: str, known: dict[str, Path]) -> set[str]:
    """Dotted names of all that a file imports, wherever in it; a name of ours is that of the module that holds it."""
    package = name if path.stem == "__init__" else name.rpartition(".")[0]
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(package.split(".")[: len(package.split(".")) - node.level + 1]) if node.level else ""
            base = ".".join(filter(None, (base, node.module)))
            for alias in node.names:
                inner = f"{base}.{alias.name}"
                found.add(inner if inner in known or alias.name == "_native" else base)
    return found


def layer_of(name: str) -> str:
    return [*name.split("."), "__init__"][1]


def rank(layer: str) -> int:
    """Place in the order of layers."""
    return LAYERS.index(layer) if layer in LAYERS else -1


def violations(source: Path) -> list[str]:
    known = modules(source)
    graph = {name: imports(path, name, known) for name, path in known.items()}
    found = []
    for name, targets in graph.items():
        file, layer = known[name].relative_to(source).as_posix(), layer_of(name)
        lines = len(known[name].read_text(encoding="utf-8").splitlines())
        if lines > MAX_LINES:
            found.append(f"{file} has {lines} lines, more than {MAX_LINES}")
        if layer not in (*LAYERS, *FACADE):
            found.append(f"{file} belongs to no layer")
            continue
        for target in sorted(targets):
            if target.split(".")[0] == "torch" and not file.startswith(TORCH):
                found.append(f"{file} imports torch")
            if target == "racecraft._native":
                if not file.startswith(CORE):
                    found.append(f"{file} imports the native core")
            elif target == "racecraft" and layer not in ("cli", "bench", *FACADE):
                found.append(f"{file} imports the facade")
            elif target.startswith("racecraft.") and layer in LAYERS and rank(layer_of(target)) > rank(layer):
                found.append(f"{file} imports {target}, a layer above its own")
    return found + [f"import cycle: {' -> '.join(cycle)}" for cycle in cycles(graph)]


def console_violations(source: Path) -> list[str]:
    """What a room of the console knows besides the rooms below it; its routes may know every room's messages."""
    known = modules(source)
    found = []
    for name, path in known.items():
        parts, file = name.split("."), path.relative_to(source).as_posix()
        if parts[1:2] != ["serve"] or len(parts) < 3:
            continue
        if parts[2] not in CONSOLE:
            found.append(f"{file} belongs to no room of the console")
            continue
        own = "context" if path.name == "routes.py" or file in ROUTES else parts[2]
        for target in sorted(imports(path, name, known)):
            room = target.split(".")[2] if target.startswith("racecraft.serve.") else own
            if CONSOLE.index(room) > CONSOLE.index(own):
                found.append(f"{file} imports {target}, a room above its own")
    return found


def cycles(graph: dict[str, set[str]]) -> list[list[str]]:
    """One way round for every import that leads back to where it came from."""
    found, done = [], set()

    def visit(name: str, path: list[str]) -> None:
        if name in path:
            found.append([*path[path.index(name) :], name])
        elif name in graph and name not in done:
            for target in sorted(graph[name]):
                visit(target, [*path, name])
            done.add(name)

    for name in graph:
        visit(name, [])
    return found


def test_the_source_keeps_to_the_architecture():
    assert len(modules(SOURCE)) > 50
    assert violations(SOURCE) == []
    assert console_violations(SOURCE) == []


def test_native_files_keep_to_the_size_budget():
    sizes = {path.name: len(path.read_text().splitlines()) for path in NATIVE.glob("**/*.?pp")}
    assert {name: lines for name, lines in sizes.items() if lines > MAX_LINES} == {}


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        ({"sim/a.py": "from racecraft.track.b import c", "track/b.py": "c = 1"}, None),
        ({"track/a.py": "from racecraft.sim.b import c"}, "track/a.py imports racecraft.sim.b, a layer above its own"),
        ({"track/a.py": "def f():\n    import racecraft.race"}, "a layer above its own"),
        ({"track/a.py": "from ..learn import ppo"}, "track/a.py imports racecraft.learn"),
        ({"errors.py": "from racecraft.track.a import b"}, "errors.py imports racecraft.track.a"),
        ({"env/a.py": "from racecraft import train"}, "env/a.py imports the facade"),
        ({"env/a.py": "import racecraft"}, "env/a.py imports the facade"),
        ({"cli/a.py": "import racecraft"}, None),
        ({"run/a.py": "import torch.nn"}, "run/a.py imports torch"),
        ({"learn/torch_a.py": "from torch import nn"}, None),
        ({"race/a.py": "from racecraft import _native"}, "race/a.py imports the native core"),
        ({"race/a.py": "from racecraft._native import Engine"}, "race/a.py imports the native core"),
        ({"sim/a.py": "from racecraft import _native"}, None),
        ({"utils/a.py": ""}, "utils/a.py belongs to no layer"),
        ({"run/a.py": "x = 1\n" * 501}, "run/a.py has 501 lines, more than 500"),
        (
            {"run/a.py": "from racecraft.run.b import x", "run/b.py": "from . import a"},
            "import cycle: racecraft.run.a -> racecraft.run.b -> racecraft.run.a",
        ),
        (
            {"run/__init__.py": "from racecraft.run.a import x", "run/a.py": "from racecraft.run import y"},
            "import cycle: racecraft.run -> racecraft.run.a -> racecraft.run",
        ),
    ],
)
def test_a_made_up_tree_is_judged(tmp_path, files, expected):
    for name, text in files.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    found = violations(tmp_path)
    assert len(found) == (expected is not None), found
    assert expected is None or expected in found[0]


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        ({"serve/races/races.py": "from racecraft.serve.jobs.queue import Q", "serve/jobs/queue.py": ""}, None),
        ({"serve/jobs/queue.py": "from racecraft.serve.races.races import R"}, "serve/jobs/queue.py imports racecraft"),
        ({"serve/jobs/queue.py": "from racecraft.serve.context import C"}, "a room above its own"),
        ({"serve/jobs/routes.py": "from racecraft.serve.context import C"}, None),
        ({"serve/jobs/routes.py": "from racecraft.serve.app import A"}, "a room above its own"),
        ({"serve/loft/attic.py": ""}, "serve/loft/attic.py belongs to no room of the console"),
    ],
)
def test_a_made_up_console_is_judged(tmp_path, files, expected):
    for name, text in files.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    found = console_violations(tmp_path)
    assert len(found) == (expected is not None), found
    assert expected is None or expected in found[0]
