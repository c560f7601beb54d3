from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecraft.errors import ConfigError
from racecraft.training import Until


@pytest.mark.parametrize(
    ("text", "limits"),
    [
        ("5 laps", Until(laps=5)),
        ("1 lap", Until(laps=1)),
        ("5laps", Until(laps=5)),
        ("  5 LAPS  ", Until(laps=5)),
        ("100 laps", Until(laps=100)),
        ("10 minutes", Until(seconds=600)),
        ("1.5 minutes", Until(seconds=90)),
        ("90 s", Until(seconds=90)),
        ("90s", Until(seconds=90)),
        ("0.25 seconds", Until(seconds=0.25)),
        ("2 mins", Until(seconds=120)),
        ("1 h", Until(seconds=3600)),
        ("720 hours", Until(seconds=30 * 86400)),
        ("200000 steps", Until(steps=200_000)),
        ("200,000 steps", Until(steps=200_000)),
        ("1_000_000 steps", Until(steps=1_000_000)),
        ("5.0 laps", Until(laps=5)),
        ("5 laps or 10 minutes", Until(laps=5, seconds=600)),
        ("10 min or 5 laps or 3 steps", Until(laps=5, seconds=600, steps=3)),
        ("0 laps or 9 steps", Until(steps=9)),
        ("8.8 s lap", Until(lap_time=8.8)),
        ("9 seconds  lap or 90 s", Until(lap_time=9, seconds=90)),
        ("5 laps or 8.25s lap", Until(laps=5, lap_time=8.25)),
        ("no better lap", Until(no_better_lap=True)),
        (" No  better lap or 10 minutes", Until(no_better_lap=True, seconds=600)),
    ],
)
def test_a_text_is_read(text: str, limits: Until) -> None:
    assert Until.parse(text) == limits


@pytest.mark.parametrize(
    "text",
    [
        "",
        " ",
        "or",
        "5",
        "laps",
        "five laps",
        "5 lap s",
        "5 lapss",
        "8.8 lap",
        "9 steps lap",
        "9 s lap or 8 s lap",
        "no better lap or no better lap",
        "no better laps",
        "5 no better lap",
        "better lap",
        "3601 s lap",
        "5 rounds",
        "-5 laps",
        "+5 laps",
        "1.5 laps",
        "0.5 steps",
        ".5 minutes",
        "1,5 minutes",
        "1e6 steps",
        "nan s",
        "inf s",
        "20,00 steps",
        "٣ laps",
        "5 laps, 10 minutes",
        "5 laps and 10 minutes",
        "5 laps or",
        "or 5 laps",
        "5 laps or 3 laps",
        "10 minutes or 30 s",
        "0 laps",
        "0 s",
        "101 laps",
        "721 hours",
        "9" * 150 + " steps",
        "9" * 10_000 + " steps",
        "5 laps; rm -rf /",
        "5 laps\x00",
        None,
        5,
        b"5 laps",
    ],
)
def test_anything_else_is_refused_with_what_is_allowed(text: str) -> None:
    with pytest.raises(ConfigError, match="until") as caught:
        Until.parse(text)
    assert len(str(caught.value)) < 600


@pytest.mark.parametrize(
    "limits",
    [
        {},
        {"laps": -1},
        {"laps": 2.5},
        {"laps": True},
        {"steps": -1},
        {"steps": 1.5},
        {"seconds": float("nan")},
        {"seconds": float("inf")},
        {"seconds": -1.0},
        {"no_better_lap": 1},
    ],
)
def test_limits_out_of_range_are_refused(limits: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match="until"):
        Until(**limits)  # type: ignore[arg-type]


@given(
    laps=st.integers(0, 100),
    seconds=st.floats(0, 30 * 86400) | st.integers(0, 43_200).map(lambda minutes: 60.0 * minutes),
    steps=st.integers(0, 10**12),
    no_better_lap=st.booleans(),
)
def test_its_own_text_means_the_same_to_the_bit(laps: int, seconds: float, steps: int, no_better_lap: bool) -> None:
    if laps or seconds or steps or no_better_lap:
        limits = Until(laps=laps, seconds=seconds, steps=steps, no_better_lap=no_better_lap)
        assert Until.parse(str(limits)) == limits
