"""What a reward function may import and call: AWS's rules, applied to a name's meaning, not its spelling.

They are habits, no wall: that is the worker's (`racecraft.reward.sandbox`). So what the standard library offers and the
wall permits is allowed, with a warning where AWS refuses it.
"""

from __future__ import annotations

import ast
import importlib.util
import sys
from collections.abc import Iterator
from typing import Final, Literal

from racecraft.errors import did_you_mean
from racecraft.reward.names import bound_names
from racecraft.reward.worker_process import PACKAGES

INSTALLING: Final = (
    "Install it: pip install {}"
    if sys.platform != "emscripten"
    else "A page has Python alone; the installed program, Racecraft, trains with {}."
)
Severity = Literal["error", "warning"]
Finding = tuple[ast.expr | ast.stmt, str, str, Severity]  # where, message, hint, severity

AWS_MODULES: Final = ("math", "random", *PACKAGES)
PLAIN_MODULES: Final = (  # of the standard library: they compute and reach no files, network or processes
    *(
        "__future__",
        "abc",
        "array",
        "bisect",
        "cmath",
        "collections",
        "copy",
        "dataclasses",
        "datetime",
        "decimal",
    ),
    *(
        "enum",
        "fractions",
        "functools",
        "heapq",
        "itertools",
        "json",
        "numbers",
        "operator",
        "re",
        "statistics",
    ),
    *("contextlib", "pprint", "string", "textwrap", "time", "traceback", "types", "typing", "warnings"),
)
USELESS_MODULES: Final = frozenset(  # of the standard library: all that they are for is refused in the worker
    (
        *("aifc", "asynchat", "asyncio", "asyncore", "cgi", "cgitb", "ftplib", "http", "imaplib", "mailbox", "nntplib"),
        *("poplib", "select", "selectors", "smtpd", "smtplib", "socket", "socketserver", "ssl", "telnetlib", "urllib"),
        *("webbrowser", "wsgiref", "xmlrpc"),
        *("concurrent", "fcntl", "getpass", "grp", "multiprocessing", "nt", "pipes", "posix", "pty", "pwd", "resource"),
        *("signal", "spwd", "subprocess", "syslog", "termios", "tty"),
        *("dbm", "filecmp", "fileinput", "glob", "shelve", "shutil", "sqlite3", "tarfile", "tempfile", "zipfile"),
        *("antigravity", "curses", "idlelib", "readline", "rlcompleter", "tkinter", "turtle", "turtledemo"),
        *("atexit", "bdb", "code", "codeop", "compileall", "ctypes", "distutils", "ensurepip", "faulthandler", "gc"),
        *("imp", "importlib", "lib2to3", "mmap", "modulefinder", "pdb", "pkgutil", "py_compile", "runpy", "site"),
        *("venv", "zipapp", "zipimport"),
    )
)
LOG_FILES: Final = (
    "logging.FileHandler",
    "logging.handlers.RotatingFileHandler",
    "logging.handlers.TimedRotatingFileHandler",
)
SEEDED: Final = (  # by what they are given; without it by the system, and so otherwise in every run
    *("random.seed", "random.Random"),
    *(
        f"numpy.random.{name}"
        for name in ("seed", "default_rng", "RandomState", "SeedSequence", "PCG64", "MT19937", "Philox", "SFC64")
    ),
)
FORBIDDEN_MODULES: Final = (  # parts of allowed packages that read or write files, or load foreign code
    *(
        "numpy.ctypeslib",
        "numpy.f2py",
        "numpy.distutils",
        "numpy.testing",
        "numpy.lib.format",
        "numpy.lib.npyio",
    ),
    *("scipy.io", "scipy.datasets", "shapely.plotting"),
)
FILE_FUNCTIONS: Final = frozenset(  # of numpy and scipy
    (
        *("DataSource", "fromfile", "fromregex", "genfromtxt", "load", "loadtxt", "memmap", "open_memmap"),
        *("save", "savetxt", "savez", "savez_compressed"),
    )
)
FORBIDDEN_NAMES: Final = frozenset(
    (
        *("open", "exec", "eval", "compile", "input", "breakpoint", "exit", "quit"),
        *("__import__", "__builtins__", "__loader__", "__spec__"),
    )
)
FORBIDDEN_ATTRIBUTES: Final = frozenset(  # ways from any object to the interpreter's inside
    (
        *("__bases__", "__base__", "__mro__", "__subclasses__", "__globals__", "__builtins__", "__code__"),
        *(
            "__closure__",
            "__getattribute__",
            "__import__",
            "__loader__",
            "__spec__",
            "__reduce__",
            "__reduce_ex__",
        ),
        *("f_back", "f_globals", "f_builtins", "f_locals", "gi_frame", "tb_frame"),
    )
)


class ImportRules:
    """Follows every imported name through the source."""

    def __init__(self, tree: ast.Module) -> None:
        self._tree = tree
        self._bound = bound_names(tree)
        self._meaning: dict[str, str] = {}  # local name -> dotted name of what was imported under it
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                for alias in node.names:
                    self._meaning[alias.asname or alias.name.split(".")[0]] = (
                        alias.name if alias.asname else alias.name.split(".")[0]
                    )
            elif isinstance(node, ast.ImportFrom) and node.module:
                for alias in node.names:
                    self._meaning[alias.asname or alias.name] = f"{node.module}.{alias.name}"

    def findings(self) -> Iterator[Finding]:
        """Everything imported, called or reached that is not allowed."""
        guarded = {id(inner) for node in ast.walk(self._tree) if isinstance(node, ast.Try) for inner in ast.walk(node)}
        for node in ast.walk(self._tree):
            if isinstance(node, ast.Import):
                for alias in node.names:
                    yield from _check_module(node, alias.name)
                    yield from _check_installed(node, alias.name, is_guarded=id(node) in guarded)
            elif isinstance(node, ast.ImportFrom):
                yield from _check_import_from(node)
                yield from _check_installed(node, node.module or "", is_guarded=id(node) in guarded)
            elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
                yield from self._check_name(node)
            elif isinstance(node, ast.Attribute):
                yield from self._check_attribute(node)
            elif isinstance(node, ast.Call):
                yield from self._check_call(node)

    def _check_name(self, node: ast.Name) -> Iterator[Finding]:
        if node.id in FORBIDDEN_NAMES and node.id not in self._bound:
            yield node, f"'{node.id}' is not allowed in a reward function.", "", "error"

    def _check_attribute(self, node: ast.Attribute) -> Iterator[Finding]:
        if node.attr in FORBIDDEN_ATTRIBUTES:
            yield node, f"'.{node.attr}' is not allowed in a reward function.", "", "error"
            return
        meaning = self._resolve(node)
        if meaning is None:
            return
        if _is_file_function(meaning):
            hint = "Write the numbers into the source, for example as a list."
            yield node, f"'{meaning}' reads or writes files, which is not allowed.", hint, "error"
        elif meaning in FORBIDDEN_MODULES or (node.attr.startswith("_") and not node.attr.startswith("__")):
            yield node, f"'{meaning}' is not allowed in a reward function.", "", "error"

    def _check_call(self, node: ast.Call) -> Iterator[Finding]:
        function = node.func
        meaning = self._resolve(function)
        if isinstance(function, ast.Attribute) and function.attr == "tofile" and "tofile" not in self._bound:
            yield node, "'.tofile()' writes a file, which is not allowed.", "", "error"
        elif meaning in ("time.time", "time.perf_counter", "time.monotonic", "datetime.datetime.now"):
            hint = "Simulated time is params['sim_time'], or params['steps'] / 15."
            message = f"'{meaning}' is the clock on the wall, and the simulator is hundreds of times faster."
            yield node, message, hint, "warning"
        elif meaning in LOG_FILES or (meaning == "logging.basicConfig" and "filename" in _keywords(node)):
            yield node, "No log file is written.", "Its lines are kept with what the function prints.", "warning"
        elif meaning in SEEDED and not node.args + node.keywords:
            yield (
                node,
                f"'{meaning}()' without a seed makes runs that cannot be repeated.",
                "Give it a seed.",
                "warning",
            )
        elif isinstance(function, ast.Name) and function.id in ("getattr", "setattr") and len(node.args) > 1:
            name = node.args[1]
            if isinstance(name, ast.Constant) and name.value in FORBIDDEN_ATTRIBUTES:
                yield node, f"'.{name.value}' is not allowed in a reward function.", "", "error"

    def _resolve(self, node: ast.expr) -> str | None:
        """The dotted name behind an expression such as ``np.linalg.norm``, or None without an import."""
        parts: list[str] = []
        while isinstance(node, ast.Attribute):
            parts.append(node.attr)
            node = node.value
        if not isinstance(node, ast.Name) or node.id not in self._meaning:
            return None
        return ".".join([self._meaning[node.id], *reversed(parts)])


def _check_import_from(node: ast.ImportFrom) -> Iterator[Finding]:
    if node.level or not node.module:
        yield node, "A reward function is one file; relative imports are not allowed.", "", "error"
        return
    problems = list(_check_module(node, node.module))
    yield from problems
    if any(severity == "error" for *_, severity in problems):
        return
    for alias in node.names:
        meaning = f"{node.module}.{alias.name}"
        if _is_file_function(meaning):
            yield node, f"'{meaning}' reads or writes files, which is not allowed.", "", "error"
        elif meaning in FORBIDDEN_MODULES or (alias.name.startswith("_") and node.module != "__future__"):
            yield node, f"'{meaning}' is not allowed in a reward function.", "", "error"


def _check_module(node: ast.stmt, module: str) -> Iterator[Finding]:
    top = module.split(".")[0]
    if top in AWS_MODULES + PLAIN_MODULES:
        pass
    elif top in sys.stdlib_module_names and top not in USELESS_MODULES:
        hint = "Leave it out if the function is to run there, too."
        yield node, f"'import {module}' is refused by AWS; here it is allowed.", hint, "warning"
    else:
        modules = ", ".join(AWS_MODULES)
        allowed = f"Allowed are {modules}, and of the standard library what needs no files, networks or processes."
        hint = did_you_mean(top, AWS_MODULES) or allowed
        yield node, f"'import {module}' is not allowed in a reward function.", hint, "error"
        return
    if any(f"{module}.".startswith(f"{forbidden}.") for forbidden in FORBIDDEN_MODULES):
        yield node, f"'import {module}' is not allowed: it reads or writes files.", "", "error"


def _check_installed(node: ast.stmt, module: str, *, is_guarded: bool) -> Iterator[Finding]:
    """A package that is allowed but missing; an error, unless the import stands in a ``try``."""
    top = module.split(".")[0]
    if top in PACKAGES and importlib.util.find_spec(top) is None:
        message = f"'import {module}' is allowed, but {top} is not installed here."
        yield node, message, INSTALLING.format(top), "warning" if is_guarded else "error"


def _keywords(node: ast.Call) -> set[str | None]:
    return {keyword.arg for keyword in node.keywords}


def _is_file_function(meaning: str) -> bool:
    package, _, name = meaning.partition(".")
    return package in ("numpy", "scipy") and name.rpartition(".")[2] in FILE_FUNCTIONS
