"""The process that reads one source for `racecraft.reward.aside`; it runs nothing of it.

    argument          seconds of a core that it may take
    standard input    the source as a text of JSON
    standard output   an object of JSON: what each function finds, by its name; without those that found no Python

It gets by without the packages that a reward function may use, so that it is there at once.
"""

from __future__ import annotations

import json
import sys
from contextlib import suppress
from pathlib import Path
from types import ModuleType
from typing import Any, Final

MOST_MEMORY: Final = 1 << 30  # bytes


def read(source: str) -> dict[str, Any]:
    """What is found, as JSON has it."""
    from dataclasses import astuple

    from racecraft.reward.check import check_reward
    from racecraft.reward.literals import find_literals
    from racecraft.reward.modules import needed_modules, used_words
    from racecraft.reward.state import keeps_state

    found: dict[str, Any] = {"check_reward": [astuple(problem) for problem in check_reward(source)]}
    for function in (keeps_state, needed_modules, used_words, find_literals):
        with suppress(SyntaxError, ValueError, RecursionError, MemoryError):
            found[function.__name__] = function(source)
    return found


def main() -> None:
    """Read the source that waits."""
    here = Path(__file__).resolve().parent
    sys.path.insert(0, str(here.parents[1]))
    from racecraft import system
    from racecraft.errors import RacecraftError

    with suppress(
        RacecraftError, ValueError, OSError
    ):  # where the system limits nothing, whoever asks waits only so long
        system.limit(seconds=int(sys.argv[1]), written=0, memory=MOST_MEMORY)
    package = ModuleType("racecraft.reward")  # its own beginning loads NumPy and the simulator
    package.__path__ = [str(here)]
    sys.modules[package.__name__] = package
    sys.stdout.write(json.dumps(read(json.load(sys.stdin))))


if __name__ == "__main__":
    main()
