"""Numbers that a reward function's file sets at its top level, and where they stand in its text."""

from __future__ import annotations

import ast
from collections import Counter
from typing import NamedTuple

from racecraft.reward.reading import reads


class Literal(NamedTuple):
    """A number on one line."""

    line: int
    """From 1."""
    begin: int
    """Column of its first byte in that line, from 0."""
    end: int
    """Column behind its last byte."""
    value: float | int


@reads
def find_literals(source: str) -> dict[str, Literal]:
    """The numbers behind names that are set once, in the file's order.

    Raises:
        SyntaxError, ValueError, RecursionError, MemoryError: The source is not Python.
    """
    tree = ast.parse(source)
    found: dict[str, ast.expr] = {}
    for statement in tree.body:
        if isinstance(statement, ast.Assign) and len(statement.targets) == 1:
            target, value = statement.targets[0], statement.value
        elif isinstance(statement, ast.AnnAssign) and statement.value is not None:
            target, value = statement.target, statement.value
        else:
            continue
        if isinstance(target, ast.Name) and _is_number(value) and value.lineno == value.end_lineno:
            found[target.id] = value
    nodes = list(ast.walk(tree))
    writes = Counter(node.id for node in nodes if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load))
    shared = {name for node in nodes if isinstance(node, ast.Global | ast.Nonlocal) for name in node.names}
    return {name: _literal(node) for name, node in found.items() if writes[name] == 1 and name not in shared}


def _literal(node: ast.expr) -> Literal:
    value = ast.literal_eval(node)
    assert isinstance(value, float | int)
    assert node.end_col_offset is not None
    return Literal(node.lineno, node.col_offset, node.end_col_offset, value)


def _is_number(node: ast.expr) -> bool:
    inner = node.operand if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub) else node
    if not isinstance(inner, ast.Constant) or isinstance(inner.value, bool):
        return False
    return isinstance(inner.value, int | float) and abs(inner.value) <= 1e12  # 1e999 is infinite
