"""What a search may change, and between which bounds."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from typing import Any, Final, Literal, Self

from racecraft.checks import check_type
from racecraft.errors import ConfigError, RunError, did_you_mean
from racecraft.learn import PPOConfig

Kind = Literal["hyperparameter", "constant"]
MAX_CONSTANTS: Final = 8
"""Constants of a reward that are searched when nobody says which: more would need more trials than minutes hold."""
SPREAD: Final = 4.0
"""A constant is searched from a quarter of its value to four times it."""

_NUMBER: Final = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[-+]?[0-9]+)?"
_SEARCH: Final = re.compile(rf"\s*([^\W\d]\w*)\s*(?:=\s*({_NUMBER})\s*\.\.\s*({_NUMBER})\s*)?", re.IGNORECASE)


@dataclass(frozen=True)
class Parameter:
    """One number that is searched."""

    name: str
    """Of a field of `PPOConfig`, or of a constant of the reward function."""
    kind: Kind
    low: float
    high: float
    is_log: bool
    """Whether factors count, not differences."""
    is_whole: bool
    default: float
    """Where the search begins."""

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, document: dict[str, Any]) -> Self:
        """From what `to_dict` gave; RunError where it is not that."""
        try:
            parameter = cls(**document)
            numbers = (parameter.low, parameter.high, parameter.default)
            if not all(isinstance(number, int | float) and math.isfinite(number) for number in numbers):
                raise ValueError("a bound is not a number")
        except (TypeError, ValueError) as error:
            raise RunError(f"The tuning's file names no parameter: {error}.") from error
        return parameter


HYPERPARAMETERS: Final[dict[str, tuple[float, float, bool, bool]]] = {
    "learning_rate": (2e-4, 5e-3, True, False),
    "gamma": (0.9, 0.997, False, False),
    "ent_coef": (1e-4, 0.05, True, False),
    "gae_lambda": (0.8, 0.99, False, False),
    "clip_coef": (0.1, 0.4, False, False),
    "vf_coef": (0.1, 1.0, True, False),
    "max_grad_norm": (0.1, 2.0, True, False),
    "average_share": (0.01, 0.3, True, False),
    "update_epochs": (1, 8, False, True),
    "num_steps": (4, 64, True, True),
    "minibatch_size": (32, 512, True, True),
}
"""Fields of `PPOConfig` that may be searched: lowest, highest, whether factors count, whether whole."""
USUAL: Final = ("learning_rate", "gamma", "ent_coef")
"""Those that are searched when nobody says which."""


def make_space(searches: Iterable[str], *, ppo: PPOConfig, constants: dict[str, float | int]) -> tuple[Parameter, ...]:
    """What is to be searched.

    Args:
        searches: ``NAME`` or ``NAME=LOW..HIGH`` each; none for the usual hyperparameters and the reward's constants.
        ppo: Where hyperparameters begin.
        constants: Of the reward function, from `racecraft.tuning.constants.find_constants`.

    Raises:
        ConfigError: A name means nothing, is said twice, or bounds are none or not for PPO.
    """
    if isinstance(searches, str) or not isinstance(searches, Iterable):
        check_type("search", searches, (), "use a list such as ['gamma', 'learning_rate=0.001..0.01']")
    texts = list(searches)
    for text in texts:
        check_type("search", text, str, "write it like 'gamma' or 'gamma=0.9..0.99'")
    if not texts:
        chosen = [name for name, value in constants.items() if value != 0][:MAX_CONSTANTS]
        texts = [*chosen, *(name for name in USUAL if name not in chosen)]
    found: dict[str, Parameter] = {}
    for text in texts:
        match = _SEARCH.fullmatch(unicodedata.normalize("NFKC", text)) if len(text) <= 200 else None  # as Python reads
        if match is None:
            raise ConfigError(f"search is {text[:200]!r}; write it like 'gamma' or 'gamma=0.9..0.99'.")
        name = match[1]
        bounds = None if match[2] is None else (float(match[2]), float(match[3]))
        if name in found:
            raise ConfigError(f"{name} is to be searched twice; name it once.")
        found[name] = _parameter(name, bounds, ppo=ppo, constants=constants)
    return tuple(found.values())


def _parameter(
    name: str, bounds: tuple[float, float] | None, *, ppo: PPOConfig, constants: dict[str, float | int]
) -> Parameter:
    kind: Kind
    if name in constants:
        default, kind = constants[name], "constant"
        is_whole = isinstance(default, int)
        if bounds is None:
            if default == 0:
                raise ConfigError(
                    f"The constant {name} is 0, which says nothing about its size.",
                    hint=f"Say its bounds: {name}=LOW..HIGH.",
                )
            bounds = _around(default, is_whole=is_whole)
        low, high = bounds
        is_log = low > 0 and high / low >= 10
    elif name in HYPERPARAMETERS:
        low, high, is_log, is_whole = HYPERPARAMETERS[name]
        default, kind = getattr(ppo, name), "hyperparameter"
        if bounds is None:
            low, high = min(low, default) if default > 0 else low, max(high, default)
        else:
            low, high = bounds
            is_log = is_log and low > 0
    else:
        known = [*constants, *HYPERPARAMETERS]
        raise ConfigError(
            f"{name} is neither a constant of the reward function nor a hyperparameter that can be searched.",
            hint=did_you_mean(name, known) or f"There are {', '.join(known)}.",
        )
    if is_whole and not (low == int(low) and high == int(high)):
        raise ConfigError(f"{name} is searched from {low:g} to {high:g}, but it is a whole number.")
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise ConfigError(f"{name} is searched from {low:g} to {high:g}; allowed is a lower and a higher bound.")
    if kind == "hyperparameter":
        for bound in (low, high):
            change: dict[str, Any] = {name: int(bound) if is_whole else bound}
            try:
                replace(ppo, **change)
            except ConfigError as error:
                raise ConfigError(f"{name} is searched from {low:g} to {high:g}, but {error}") from error
    return Parameter(name, kind, low, high, is_log, is_whole, default)


def _around(value: float, *, is_whole: bool) -> tuple[float, float]:
    """Bounds about a constant that nobody gave bounds for."""
    low, high = sorted((value / SPREAD, value * SPREAD))
    if is_whole:
        low, high = math.floor(low), math.ceil(high)
        if value > 0:
            low = max(low, 1)
    return low, high
