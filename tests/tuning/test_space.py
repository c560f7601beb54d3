from __future__ import annotations

from typing import Any

import pytest

from racecraft.errors import ConfigError, RunError
from racecraft.learn import PPOConfig
from racecraft.tuning import HYPERPARAMETERS, Parameter, check_limits, make_space


def space(*searches: str, constants: dict[str, float | int] | None = None) -> dict[str, Parameter]:
    found = make_space(searches, ppo=PPOConfig(), constants={} if constants is None else constants)
    return {parameter.name: parameter for parameter in found}


def test_without_a_wish_the_rewards_constants_and_the_usual_hyperparameters_are_searched() -> None:
    found = space(constants={"PENALTY": -1.0, "STEPS": 2, "OFF": 0.0})
    assert list(found) == ["PENALTY", "STEPS", "learning_rate", "gamma", "ent_coef"]
    assert (found["PENALTY"].low, found["PENALTY"].high, found["PENALTY"].is_log) == (-4.0, -0.25, False)
    assert (found["STEPS"].low, found["STEPS"].high, found["STEPS"].is_whole) == (1, 8, True)


def test_bounds_are_taken_as_said() -> None:
    found = space("gamma=.9..0.95", "K = 1e-3 .. 10", constants={"K": 0.0})
    assert (found["gamma"].low, found["gamma"].high) == (0.9, 0.95)
    assert (found["K"].low, found["K"].high, found["K"].is_log) == (0.001, 10.0, True)


def test_names_may_have_letters_of_any_language() -> None:
    assert list(space(constants={"GRÖSSE": 2.0, "速度": 1.0}))[:2] == ["GRÖSSE", "速度"]
    decomposed = space("GRO\u0308SSE=1..4", constants={"GRÖSSE": 2.0})  # as a terminal of macOS may hand it on
    assert (decomposed["GRÖSSE"].low, decomposed["GRÖSSE"].high) == (1.0, 4.0)


def test_every_hyperparameter_that_may_be_searched_is_one_and_its_default_is_within_reach() -> None:
    for name in HYPERPARAMETERS:
        parameter = space(name)[name]
        assert parameter.low <= parameter.default == getattr(PPOConfig(), name) <= parameter.high
        for value in (parameter.low, parameter.high):
            PPOConfig(**{name: int(value) if parameter.is_whole else value})  # within what PPO takes


@pytest.mark.parametrize(
    ("search", "match"),
    [
        ("gama", "neither a constant"),
        ("gamma=0.9", "write it like"),
        ("gamma=0.99..0.9", r"from 0\.99 to 0\.9; allowed"),
        ("gamma=1e400..1e500", "allowed is a lower"),
        ("gamma=2..3", r"gamma is searched from 2 to 3, but gamma is 2\.0; allowed is"),
        ("gamma=0.9..3", r"but gamma is 3\.0; allowed is"),
        ("minibatch_size=0..3", r"but minibatch_size is 0; allowed is"),
        ("clip_coef=0.1..1", "but clip_coef is"),
        ("update_epochs=1..2.5", "whole number"),
        ("ZERO", "says nothing about its size"),
        ("", "write it like"),
        ("x" * 300, "write it like"),
        ("gamma; import os", "write it like"),
    ],
)
def test_what_cannot_be_searched_is_refused(search: str, match: str) -> None:
    with pytest.raises(ConfigError, match=match):
        space(search, constants={"ZERO": 0})


@pytest.mark.parametrize("search", ["gamma", None, 5, [5], ["gamma", None]])
def test_what_is_no_list_of_searches_is_told(search: Any) -> None:
    with pytest.raises(ConfigError, match=r"search is .*; (use a list|write it) "):
        make_space(search, ppo=PPOConfig(), constants={})


@pytest.mark.parametrize("minutes", [0, -1.0, float("nan"), float("inf"), "5", None, 50_000])
def test_minutes_that_are_none_are_told(minutes: Any) -> None:
    with pytest.raises(ConfigError, match="minutes is"):
        check_limits(minutes=minutes, max_trials=0, processes=1)


def test_a_name_said_twice_is_refused() -> None:
    with pytest.raises(ConfigError, match="gamma is to be searched twice"):
        space("gamma", "gamma=0.9..0.95")


@pytest.mark.costly
def test_a_parameter_survives_its_file() -> None:
    parameter = space("gamma")["gamma"]
    assert Parameter.from_dict(parameter.to_dict()) == parameter
    with pytest.raises(RunError, match="names no parameter"):
        Parameter.from_dict({"name": "gamma"})
    with pytest.raises(RunError, match="names no parameter"):
        Parameter.from_dict({**parameter.to_dict(), "low": "0"})
