"""Sources that are read by another process: what is found is the same, and who waits meanwhile does not wait long."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from racecraft.errors import RewardError
from racecraft.reward import aside as aside_module
from racecraft.reward import check_reward, keeps_state, load_preset
from racecraft.reward.aside import Aside
from racecraft.reward.literals import find_literals
from racecraft.reward.modules import needed_modules, used_words
from racecraft.reward.reading import read_by
from racecraft.tuning import find_constants, rewrite_constants

SOURCE = """import math, random
COSTS = -1.5; LAPS = 3
seen = []
def reward_function(params):
    seen.append(params["sped"] + größe)
    return math.sin(COSTS) * random.random()
"""
RETURN = "def reward_function(params):\n    return 1.0\n"
READ: list[Callable[[str], Any]] = [check_reward, keeps_state, needed_modules, used_words, find_literals]


def nested(depth: int) -> str:
    """Blocks that Python's compiler writes twice each, one inside of the other."""
    blocks = (f"{' ' * level}try: 0\n{' ' * level}finally:\n" for level in range(1, depth + 1))
    return f"{RETURN}def nest():\n{''.join(blocks)}{' ' * (depth + 1)}0\n"


@pytest.fixture
def aside() -> Iterator[None]:
    with read_by(Aside(seconds=1)):
        yield


@pytest.mark.parametrize("source", [SOURCE, load_preset("racing"), "def reward_function(", "\ud800", ""])
def test_a_child_finds_what_is_found_here(source: str) -> None:
    def found() -> list[Any]:
        values = []
        for function in READ:
            try:
                values.append(function(source))
            except (SyntaxError, ValueError):
                values.append(SyntaxError)
        return values

    here = found()
    with read_by(Aside()):
        assert found() == here
    assert found() == here


@pytest.mark.usefixtures("aside")
def test_constants_are_found_and_rewritten_by_what_a_child_says() -> None:
    assert find_constants(SOURCE) == {"COSTS": -1.5, "LAPS": 3}
    assert "COSTS = -2.25; LAPS = 4" in rewrite_constants(SOURCE, {"COSTS": -2.25, "LAPS": 4})
    with pytest.raises(RewardError, match="is not Python"):
        find_constants("def")


@pytest.mark.costly
@pytest.mark.usefixtures("aside")
def test_seven_hundred_characters_that_keep_the_compiler_for_hours_keep_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    """A child is over its time or its memory, whichever comes first; what is asked later needs no other child."""
    begun = time.thread_time()
    (problem,) = check_reward(nested(19))
    assert re.search("more than 1 s|nested too deeply", problem.message)
    assert problem.severity == "error"
    monkeypatch.delattr(aside_module, "_read")
    assert check_reward(nested(19)) == [problem]
    keeps_state(nested(19))  # says either, as the child said more or less before its end
    assert needed_modules(nested(19)) == []
    assert time.thread_time() - begun < 2.0, "this process has read it itself, which takes seven seconds"


@pytest.mark.costly
@pytest.mark.usefixtures("aside")
def test_a_source_that_takes_too_much_memory_is_refused() -> None:
    tests = "".join("  if p: return 0\n" for _ in range(4000))
    ends = "".join("  q = p, p, p\n" for _ in range(4000))
    (problem,) = check_reward(f"{RETURN}def f(p):\n try:\n{tests} finally:\n{ends}")
    assert "memory" in problem.message


def test_a_long_honest_source_is_read_in_time() -> None:
    """As racers write them: a racing line point by point."""
    points = "".join(
        f"    [{i / 700:.5f}, {i / 300:.5f}, {1 + i % 40 / 13:.2f}, 0.0{i % 90 + 10}],  # {i}\n" for i in range(1500)
    )
    source = f"LINE = [\n{points}]\n" + load_preset("racing")
    assert 60_000 < len(source) < 140_000
    begun = time.monotonic()
    with read_by(Aside()):
        assert check_reward(source) == []
    assert time.monotonic() - begun < 30.0  # the machine may be busy
