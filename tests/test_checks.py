"""One wording for every setting that is refused: name, value, what is allowed, what was perhaps meant."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from racecraft.checks import (
    check_choice,
    check_flag,
    check_number,
    check_path,
    check_type,
    check_whole,
    is_number,
    require,
)
from racecraft.errors import ConfigError, did_you_mean

COLOURS = ("red", "green")


@pytest.mark.parametrize("value", [2, 5, np.int64(3), np.uint8(5)])
def test_whole_numbers_from_low_to_high_pass(value: object) -> None:
    check_whole("cars", value, 2, 5)


@pytest.mark.parametrize("value", [1, 6, 3.0, True, "3", None, math.nan, np.float64(3), 10**400])
def test_other_than_whole_numbers_are_refused(value: object) -> None:
    with pytest.raises(ConfigError) as error:
        check_whole("cars", value, 2, 5)
    assert str(error.value) == f"cars is {value!r}; allowed is a whole number from 2 to 5."


@pytest.mark.parametrize("value", [0, 0.5, 1, np.float32(0.25), np.int64(1)])
def test_numbers_from_low_to_high_pass(value: object) -> None:
    check_number("share", value, 0.0, 1.0)


@pytest.mark.parametrize("value", [-1e-9, 1.0000001, False, "0.5", None, math.nan, math.inf, 10**400])
def test_other_than_numbers_are_refused(value: object) -> None:
    with pytest.raises(ConfigError) as error:
        check_number("share", value, 0.0, 1.0)
    assert str(error.value) == f"share is {value!r}; allowed is a number from 0 to 1."


def test_what_a_finite_number_is() -> None:
    numbers, others = [0, -1, 0.5, -1e308, 10**300], [True, "1", None, math.nan, math.inf, -math.inf, 10**400, 1j, [1]]
    assert all(map(is_number, numbers))
    assert not any(map(is_number, [*others, np.int64(1), np.float32(1.0)]))
    assert all(is_number(value, is_plain=False) for value in [*numbers, np.int64(1), np.float32(1.0)])
    assert not any(is_number(value, is_plain=False) for value in [*others, np.float32(math.inf), np.bool_(True)])


@pytest.mark.parametrize("value", [-0.5, math.nan, math.inf, 10**400])
def test_a_number_without_a_highest_is_finite(value: object) -> None:
    check_number("rate", 1e300, 0.0)
    with pytest.raises(ConfigError, match=r"; allowed is a number from 0\.$"):
        check_number("rate", value, 0.0)


@pytest.mark.parametrize(("check", "value"), [(check_whole, np.int64(1)), (check_number, np.float32(1.0))])
def test_numbers_of_numpy_are_refused_where_json_is_written(check: Callable[..., None], value: object) -> None:
    check("share", value, 0, 1)
    with pytest.raises(ConfigError, match="share is"):
        check("share", value, 0, 1, is_plain=True)
    check("share", 1, 0, 1, is_plain=True)


def test_a_misspelt_choice_is_guessed() -> None:
    check_choice("colour", "green", COLOURS)
    with pytest.raises(ConfigError) as error:
        check_choice("colour", "grren", COLOURS)
    assert str(error.value) == "colour is 'grren'; allowed are red, green."
    assert error.value.hint == "Did you mean 'green'?"
    assert did_you_mean("FRONT", ["Front", "front_left"]) == "Did you mean 'Front'?"
    assert did_you_mean("ovl", ["OVAL", "oval"]) == "Did you mean 'OVAL'?"  # the first of two that are alike
    for value in (None, 3, ["red"], np.array(["red", "green"])):
        with pytest.raises(ConfigError, match="allowed are red, green"):
            check_choice("colour", value, COLOURS)


def test_flags_and_types_are_refused_with_what_to_give() -> None:
    check_flag("spread", False)
    with pytest.raises(ConfigError, match="spread is 1; allowed are True and False"):
        check_flag("spread", 1)
    with pytest.raises(ConfigError, match="road is 'oval'; give a number"):
        check_type("road", "oval", (int, float), "give a number")


def test_anything_else_says_itself_what_is_allowed() -> None:
    require("laps", 3, True, "more than 2")
    with pytest.raises(ConfigError) as error:
        require("laps", 2, False, "more than 2")
    assert str(error.value) == "laps is 2; allowed is more than 2."


def test_a_long_value_is_cut_in_the_message() -> None:
    for check in (
        lambda: check_number("share", "x" * 10**6, 0.0),
        lambda: check_choice("colour", "x" * 10**6, COLOURS),
    ):
        with pytest.raises(ConfigError) as error:
            check()
        assert "xxx…" in str(error.value)
        assert len(str(error.value)) < 700


@pytest.mark.parametrize("value", [None, 5, b"file", "a\0b", "half of \ud800 a pair"])
def test_what_no_file_is_called_is_no_path(value: object) -> None:
    check_path("output", "file", "use a file's path")
    check_path("output", Path("file"), "use a file's path")
    with pytest.raises(ConfigError) as error:
        check_path("output", value, "use a file's path")
    assert str(error.value) == f"output is {value!r}; use a file's path."
