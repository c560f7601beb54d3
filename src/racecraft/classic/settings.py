"""Settings that all algorithms have, and how they are checked and changed by name."""

from __future__ import annotations

import typing
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, Final, Self

from racecraft.checks import MAX_COUNT, check_number, check_whole
from racecraft.errors import ConfigError, did_you_mean

SHARES: Final = {
    "gamma", "gae_lambda", "epsilon", "final_epsilon", "exploration", "smoothing", "clip",
    "learning_rate", "final_learning_rate", "critic_learning_rate",
}  # fmt: skip
"""From 0 to 1."""
MOST: Final = {"steps": 10**12, "num_envs": 4096, "processes": 64}
"""Of what is counted."""


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What every algorithm is told."""

    steps: int = 100_000
    """Steps of all worlds together after which learning ends; what falls with time has fallen by then."""
    num_envs: int = 1
    """Worlds that are played at once."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value, kind = getattr(self, field.name), typing.get_type_hints(type(self))[field.name]
            if kind is int:
                check_whole(field.name, value, 1, MOST.get(field.name, MAX_COUNT), is_plain=True)
            elif kind is float:
                low = 0.0 if field.name not in ("initial", "reward_shift") else -1e6
                check_number(field.name, value, low, 1.0 if field.name in SHARES else 1e6, is_plain=True)
            elif field.name == "hidden":
                is_list = isinstance(value, tuple) and len(value) <= 8
                if not is_list:
                    raise ConfigError(f"hidden is {value!r}; allowed is a list of units, such as [64, 64].")
                for units in value:
                    check_whole("hidden", units, 1, 4096, is_plain=True)

    def changed(self, values: Mapping[str, Any]) -> Self:
        """The same with other values.

        Raises:
            ConfigError: A name is not known, or a value not allowed.
        """
        known = sorted({field.name for field in fields(self)} - {"cuts"})
        for name in values:
            if name not in known:
                raise ConfigError(
                    f"There is no setting {name!r}; there are {', '.join(known)}.", hint=did_you_mean(name, known)
                )
        kinds = typing.get_type_hints(type(self))
        plain: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else float(value) if _is_whole(value, kinds[name]) else value
            for name, value in values.items()
        }
        return replace(self, **plain)


def _is_whole(value: Any, kind: Any) -> bool:
    """Whether a number is meant that was written without a point."""
    return kind is float and isinstance(value, int) and not isinstance(value, bool)
