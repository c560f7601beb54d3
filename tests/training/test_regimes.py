"""The table of the kinds of training: which row decides, and what it refuses."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import pytest

from racecraft.errors import ConfigError
from racecraft.learn import PPOConfig
from racecraft.sim import Bots, Objects
from racecraft.training.opponents import Opponents
from racecraft.training.regimes import (
    BRISK_FAST_DISTILL,
    CUDA,
    DUEL,
    FAST_DISTILL,
    FAST_OBJECTS,
    LONG_FAST_DISTILL,
    MANY_TRACKS,
    METHODS,
    OBJECTS,
    TIME_TRIAL,
    Regime,
    regime_of,
)
from racecraft.training.settings import TrainSettings

BOTS, RIVALS = Objects(bots=Bots(count=1)), Opponents()


def test_the_last_row_decides_everything() -> None:
    assert all(getattr(TIME_TRIAL, setting.name) for setting in fields(Regime) if setting.name != "only")
    assert regime_of() == TIME_TRIAL


@pytest.mark.parametrize(
    ("circumstances", "expected"),
    [
        ({"objects": BOTS}, {"reward": OBJECTS, "start": TIME_TRIAL, "ppo": OBJECTS, "good": OBJECTS}),
        ({"objects": BOTS, "most_speed": 1.0}, {"distill": OBJECTS, "ppo": OBJECTS}),
        (
            {"objects": BOTS, "most_speed": 1.4},
            {"reward": FAST_OBJECTS, "distill": FAST_OBJECTS, "ppo": OBJECTS, "good": OBJECTS},
        ),
        ({"opponents": RIVALS}, {"reward": DUEL, "start": DUEL, "distill": DUEL, "critic": DUEL, "good": TIME_TRIAL}),
        ({"objects": BOTS, "opponents": RIVALS}, {"reward": OBJECTS, "start": DUEL, "ppo": OBJECTS, "critic": DUEL}),
        ({"num_tracks": 2}, {"reward": TIME_TRIAL, "start": MANY_TRACKS, "evaluation_trials": MANY_TRACKS}),
        ({"num_tracks": 2, "objects": BOTS}, {"reward": OBJECTS, "ppo": MANY_TRACKS, "evaluate_every": MANY_TRACKS}),
        ({"num_tracks": 2, "opponents": RIVALS}, {"until": DUEL, "start": MANY_TRACKS, "critic": MANY_TRACKS}),
        ({"device": "cuda:1"}, {"ppo": CUDA, "evaluate_every": CUDA, "most_envs": CUDA, "start": TIME_TRIAL}),
        ({"device": "cuda", "num_tracks": 2}, {"ppo": CUDA, "evaluate_every": CUDA, "start": MANY_TRACKS}),
        ({"is_fast_distill": True}, {"distill": FAST_DISTILL, "start": FAST_DISTILL, "ppo": TIME_TRIAL}),
        ({"is_fast_distill": True, "lessons": "long"}, {"distill": LONG_FAST_DISTILL, "start": FAST_DISTILL}),
        ({"is_fast_distill": True, "lessons": "brisk"}, {"distill": BRISK_FAST_DISTILL, "critic": BRISK_FAST_DISTILL}),
        ({"lessons": "long"}, {"distill": TIME_TRIAL, "critic": TIME_TRIAL}),
        ({"is_fast_distill": True, "num_tracks": 2}, {"distill": FAST_DISTILL, "start": MANY_TRACKS}),
    ],
)
def test_the_most_particular_row_decides(circumstances: dict[str, Any], expected: dict[str, Regime]) -> None:
    chosen = regime_of(**circumstances)
    for name, row in expected.items():
        assert getattr(chosen, name) == getattr(row, name), name


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"device": "cuda:1", "algorithm": "sac"}, "algorithm is 'sac'; device 'cuda:1' trains 'ppo' only."),
        ({"opponents": RIVALS, "algorithm": "sac"}, "algorithm is 'sac'; among other cars only ppo and distill learn"),
        ({"opponents": RIVALS, "device": "cuda"}, "device is 'cuda'; races of several cars are driven on the cpu."),
    ],
)
def test_what_does_not_go_together_is_refused(settings: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ConfigError) as caught:
        TrainSettings(**settings)
    assert str(caught.value).startswith(sentence)


def test_every_algorithm_has_settings_of_its_kind() -> None:
    settings = TrainSettings()
    assert isinstance(settings.learning, PPOConfig)
    for name, method in METHODS.items():
        assert type(getattr(settings, method.settings)) is method.config
        assert set(method.actions) <= {"discrete", "continuous"}
        assert (method.actions == ("continuous",)) >= method.is_squashed, name
    assert METHODS["sb3:dqn"].actions == ("discrete",)
    assert METHODS["sb3:td3"].actions == METHODS["sac"].actions == ("continuous",)
