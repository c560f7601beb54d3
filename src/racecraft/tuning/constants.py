"""Numeric constants at the top of a reward function's file, found and rewritten without running it.

    OFF_TRACK_PENALTY = -1.0        ->   {"OFF_TRACK_PENALTY": -1.0}
    STEP_SECONDS = 1.0 / 15.0       not a constant: an expression, and seldom meant to be changed

Only the number itself is replaced in the text; comments and everything else stay as they are.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from numbers import Real

from racecraft.checks import require
from racecraft.errors import ConfigError, RewardError, did_you_mean
from racecraft.reward.literals import Literal, find_literals


def find_constants(source: str) -> dict[str, float | int]:
    """Names that the file sets once, at its top level, to a finite number, in the file's order.

    Raises:
        RewardError: The file is not Python.
    """
    return {name: literal.value for name, literal in _literals(source).items()}


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
        is_whole = isinstance(literals[name].value, int)
        require(
            name, value, not is_whole or value == int(value), "a whole number, as the reward function has one there"
        )
    # from the last to the first, so that places further up stay right
    for name, literal in sorted(literals.items(), key=lambda item: (item[1].line, item[1].begin), reverse=True):
        if name in values:
            line = lines[literal.line - 1]
            text = repr(int(values[name]) if isinstance(literal.value, int) else float(values[name]))
            lines[literal.line - 1] = line[: literal.begin] + text.encode() + line[literal.end :]
    return b"".join(lines).decode()


def _literals(source: str) -> dict[str, Literal]:
    """The numbers behind the names."""
    try:
        return find_literals(source)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise RewardError(f"The reward function is not Python: {error}.") from error
