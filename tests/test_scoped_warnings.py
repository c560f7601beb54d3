"""Warnings within a block: of one thread at a time, and as before afterwards."""

from __future__ import annotations

import sys
import threading
import warnings
from collections.abc import Iterator

import pytest

from racecraft.reward.check import check_reward
from racecraft.scoped_warnings import scoped_warnings

WARNS = 'def reward_function(params):\n    x = "\\d"\n    return 1.0\n'
WARNS_NOT = 'def reward_function(params):\n    return 1.0 if params["speed"] > 1 else 0.5\n'


@pytest.fixture
def switching() -> Iterator[None]:
    """Threads take turns as often as they can."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    yield
    sys.setswitchinterval(before)


def test_rewards_that_are_checked_side_by_side_have_their_own_warnings(switching: None) -> None:
    found: dict[str, set[int]] = {WARNS: set(), WARNS_NOT: set()}
    before = list(warnings.filters)

    def check(source: str) -> None:
        for _ in range(800):
            found[source].add(len(check_reward(source)))

    threads = [threading.Thread(target=check, args=(source,)) for source in found]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == {WARNS: {1}, WARNS_NOT: {0}}
    assert list(warnings.filters) == before


def test_what_is_collected_while_a_reward_is_read_is_no_problem_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    import ast

    parse = ast.parse

    def collecting(*given: object) -> ast.AST:
        warnings.warn("subprocess 4711 is still running", ResourceWarning, stacklevel=1)
        return parse(*given)  # type: ignore[call-overload, no-any-return]

    monkeypatch.setattr("racecraft.reward.check.ast.parse", collecting)
    assert [problem.line for problem in check_reward(WARNS)] == [2]


def test_within_it_is_as_asked_and_afterwards_as_before() -> None:
    before = list(warnings.filters)
    with scoped_warnings("always", UserWarning) as caught:
        for _ in range(2):
            warnings.warn("one", UserWarning, stacklevel=1)
    assert [str(warning.message) for warning in caught] == ["one", "one"]
    with pytest.raises(UserWarning, match="two"), scoped_warnings("error"):
        warnings.warn("two", UserWarning, stacklevel=1)
    with scoped_warnings("always") as outer:
        with scoped_warnings("ignore") as none:
            warnings.warn("three", UserWarning, stacklevel=1)
        warnings.warn("four", UserWarning, stacklevel=1)
    assert none == []
    assert [str(warning.message) for warning in outer] == ["four"]
    assert list(warnings.filters) == before
