"""Which names a source binds, and which it uses without binding them."""

from __future__ import annotations

import ast
import builtins
import symtable
from collections.abc import Iterator

# The worker's interpreter starts without 'site', which would add exit, quit, help and others.
BUILTIN_NAMES = frozenset(dir(builtins)) - {"exit", "quit", "help", "copyright", "credits", "license"}
GUESSED = 10  # undefined names that a meaning is looked for; each is compared with every other name of the source
MODULE_NAMES = frozenset(("__name__", "__doc__", "__annotations__", "__class__"))


def bound_names(tree: ast.AST, *, into_functions: bool = True) -> set[str]:
    """Every name that is assigned, defined, imported or a parameter somewhere in the tree."""
    names = set()
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            names.add(node.id)
        elif isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            names.add(node.name)
            if not into_functions:
                continue
        elif isinstance(node, ast.arg):
            names.add(node.arg)
        elif isinstance(node, ast.alias):
            names.add(node.asname or node.name.split(".")[0])
        elif (isinstance(node, ast.ExceptHandler) and node.name) or (
            isinstance(node, (ast.MatchAs, ast.MatchStar)) and node.name
        ):
            names.add(node.name)
        waiting.extend(ast.iter_child_nodes(node))
    return names


def undefined_names(source: str, tree: ast.Module) -> Iterator[tuple[ast.Name, str, list[str]]]:
    """Names that no scope binds: where each is used first, the name, and for the first few what it could mean."""
    nodes = list(ast.walk(tree))
    if any(isinstance(node, ast.ImportFrom) and node.names[0].name == "*" for node in nodes):
        return
    if any(isinstance(node, ast.Name) and node.id == "globals" for node in nodes):  # binds names that are not seen
        return
    scopes = list(_scopes(symtable.symtable(source, "reward_function.py", "exec")))
    module, *inner = scopes
    known = {symbol.get_name() for symbol in module.get_symbols() if symbol.is_assigned() or symbol.is_imported()}
    known |= {
        symbol.get_name()
        for scope in inner
        for symbol in scope.get_symbols()
        if symbol.is_declared_global() and (symbol.is_assigned() or symbol.is_imported())
    }
    missing = {
        symbol.get_name()
        for scope in scopes
        for symbol in scope.get_symbols()
        if symbol.is_referenced() and (symbol.is_global() or scope is module)
    }
    missing -= known | BUILTIN_NAMES | MODULE_NAMES
    if not missing:
        return
    candidates = sorted(bound_names(tree) | {name for name in BUILTIN_NAMES if name.islower()})
    num_missing = len(missing)
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id in missing:
            missing.remove(node.id)
            is_guessed = num_missing - len(missing) <= GUESSED
            others = (name for name in candidates if is_guessed and name != node.id)  # a name of another function
            yield node, node.id, list(others)


def _scopes(table: symtable.SymbolTable) -> Iterator[symtable.SymbolTable]:
    waiting = [table]
    while waiting:
        scope = waiting.pop()
        yield scope
        waiting.extend(scope.get_children())
