"""Numeric constants at the top of a reward function's file, found and rewritten without running it.

    OFF_TRACK_PENALTY = -1.0        ->   {"OFF_TRACK_PENALTY": -1.0}
    STEP_SECONDS = 1.0 / 15.0       not a constant: an expression, and seldom meant to be changed

Only the number itself is replaced in the text; comments and everything else stay as they are.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping
from numbers import Real

from racecraft.checks import require
from racecraft.errors import ConfigError, RewardError, did_you_mean


def find_constants(source: str) -> dict[str, float | int]:
    """Names that the file sets once, at its top level, to a finite number, in the file's order.

    Raises:
        RewardError: The file is not Python.
    """
    return {name: _value(node) for name, node in _literals(source).items()}


def rewrite_constants(source: str, values: Mapping[str, float | int]) -> str:
    """The same file with other numbers.

    Args:
        source: Text of a reward function.
        values: New numbers of some of `find_constants`.

    Raises:
        ConfigError: There is no such constant, or it cannot be this number.
        RewardError: The file is not Python.
    """
    literals = _literals(source)
    lines = source.encode().splitlines(keepends=True)  # columns of the syntax tree count bytes
    for name, value in values.items():
        if name not in literals:
            raise ConfigError(
                f"The reward function has no constant {name!r} at its top level that is set once, to a number.",
                hint=did_you_mean(name, literals),
            )
        is_number = isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
        require(name, value, is_number, "a finite number")
        is_whole = isinstance(_value(literals[name]), int)
        require(
            name, value, not is_whole or value == int(value), "a whole number, as the reward function has one there"
        )
    # from the last to the first, so that places further up stay right
    for name, node in sorted(literals.items(), key=lambda item: (item[1].lineno, item[1].col_offset), reverse=True):
        if name in values:
            line = lines[node.lineno - 1]
            text = repr(int(values[name]) if isinstance(_value(node), int) else float(values[name]))
            lines[node.lineno - 1] = line[: node.col_offset] + text.encode() + line[node.end_col_offset :]
    return b"".join(lines).decode()


def _literals(source: str) -> dict[str, ast.expr]:
    """The numbers behind the names, each on one line."""
    try:
        tree = ast.parse(source)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise RewardError(f"The reward function is not Python: {error}.") from error
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
    writes = [node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load)]
    shared = {name for node in ast.walk(tree) if isinstance(node, ast.Global | ast.Nonlocal) for name in node.names}
    return {name: node for name, node in found.items() if writes.count(name) == 1 and name not in shared}


def _is_number(node: ast.expr) -> bool:
    inner = node.operand if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub) else node
    if not isinstance(inner, ast.Constant) or isinstance(inner.value, bool):
        return False
    return isinstance(inner.value, int | float) and abs(inner.value) <= 1e12  # 1e999 is infinite


def _value(node: ast.expr) -> float | int:
    value = ast.literal_eval(node)
    assert isinstance(value, float | int)
    return value
