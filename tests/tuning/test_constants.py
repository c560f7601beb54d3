from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecraft.errors import ConfigError, RewardError
from racecraft.reward import load_reward, preset_names
from racecraft.tuning import find_constants, rewrite_constants

SOURCE = '''"""ä: columns of the tree count bytes."""
A = 1.5  # stays
N: int = 3; B = -2e-3
LIST = [1, 2]
C = 1 / 3
FLAG = True
TWICE = 1
TWICE = 2
ADDED = 1
ADDED += 1
SHARED = 7


def reward_function(params):
    global SHARED
    A2 = 5
    return A * params["speed"] + N
'''


def test_only_numbers_that_are_set_once_at_the_top_are_constants() -> None:
    assert find_constants(SOURCE) == {"A": 1.5, "N": 3, "B": -0.002}


def test_only_the_number_changes() -> None:
    changed = rewrite_constants(SOURCE, {"A": -0.25, "N": 40, "B": 12.0})
    assert find_constants(changed) == {"A": -0.25, "N": 40, "B": 12.0}
    expected = SOURCE.replace("A = 1.5", "A = -0.25").replace("N: int = 3; B = -2e-3", "N: int = 40; B = 12.0")
    assert changed == expected


@given(st.floats(allow_nan=False, allow_infinity=False, min_value=-1e12, max_value=1e12))
def test_a_number_is_written_to_the_bit(value: float) -> None:
    assert find_constants(rewrite_constants("é = 'é'; K = 2.0\n", {"K": value})) == {"K": value}


@pytest.mark.parametrize("name", preset_names())
def test_presets_rewritten_with_their_own_numbers_mean_the_same(name: str) -> None:
    source = load_reward(name)
    constants = find_constants(source)
    assert find_constants(rewrite_constants(source, constants)) == constants
    compile(rewrite_constants(source, constants), name, "exec")


def test_nothing_of_it_is_run(tmp_path: Path) -> None:
    trap = f"K = 1.0\nopen({str(tmp_path / 'trap')!r}, 'w')\nraise SystemExit\n"
    assert rewrite_constants(trap, {"K": 2.0}).startswith("K = 2.0\nopen")
    assert not (tmp_path / "trap").exists()


def test_what_is_no_constant_is_refused() -> None:
    with pytest.raises(ConfigError, match="no constant 'C'"):
        rewrite_constants(SOURCE, {"C": 1.0})
    with pytest.raises(ConfigError, match="K is inf"):
        rewrite_constants("K = 1.0", {"K": float("inf")})
    with pytest.raises(
        ConfigError, match=r"K is 2\.5; allowed is a whole number, as the reward function has one there"
    ):
        rewrite_constants("K = 1", {"K": 2.5})
    with pytest.raises(RewardError, match="not Python"):
        find_constants("def reward_function(params:")
    with pytest.raises(RewardError, match="not Python"):
        find_constants("K = 1\0")
    assert find_constants("K = 1e999\nJ = (1.0\n)\n") == {"J": 1.0}
