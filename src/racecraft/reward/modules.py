"""Which modules a source will need, read from it: they are loaded before it runs, as nothing can be afterwards.

Once the worker is locked in no file can be opened, so an ``import`` inside a function, or a part of numpy that it loads
on first use, has to be there already. Only the standard library and the packages that AWS has are looked for.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from typing import Final

from racecraft.reward.reading import reads
from racecraft.reward.worker_process import PACKAGES

_TRACES: Final = ("ast", "linecache", "tokenize", "traceback", "unicodedata")
LOADED_LATE: Final = {
    "Counter": ("copy", "heapq"),
    "fractions": ("decimal",),
    "logging": _TRACES,
    "seed": ("hashlib",),
    "singledispatch": ("types", "typing", "weakref"),
    "singledispatchmethod": ("types", "typing", "weakref"),
    "strptime": ("_strptime",),
    "traceback": _TRACES,
    "warnings": ("re", *_TRACES),
}
"""What the standard library itself imports only when the thing of this name is used."""


@reads
def needed_modules(source: str) -> list[str]:
    """Dotted names of modules to load, the most general first; some may not exist."""
    tree = _parse(source)
    if tree is None:
        return []
    found = [name for node in ast.walk(tree) for name in _imported(node)]
    found += [name for word in _words(tree) for name in LOADED_LATE.get(word, ())]
    if not source.isascii():
        found.append("unicodedata")  # Python's own compiler asks it for names such as ``größe``
    return sorted({name for name in found if name.partition(".")[0] in (*sys.stdlib_module_names, *PACKAGES)})


@reads
def used_words(source: str) -> list[str]:
    """Every name and attribute in the source, and texts that could be one: a part of a package may be among them."""
    tree = _parse(source)
    return [] if tree is None else sorted(_words(tree))


def _parse(source: str) -> ast.Module | None:
    try:
        return ast.parse(source)
    except (SyntaxError, ValueError, RecursionError, MemoryError):  # the worker says it, with its line
        return None


def _imported(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
        yield node.module
        yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _words(tree: ast.Module) -> set[str]:
    words = set()
    for node in ast.walk(tree):
        match node:
            case ast.Name(id=word) | ast.Attribute(attr=word) | ast.alias(name=word):
                words.add(word)
            case ast.Constant(value=str(word)) if word.isidentifier():
                words.add(word)
    return words
