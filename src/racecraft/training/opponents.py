"""Who is to drive the other cars of a race while a policy learns, as a run's settings say it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from racecraft.checks import check_number, check_whole
from racecraft.errors import ConfigError

SELF: Final = "self"
MAX_CARS: Final = 8
MAX_POOL: Final = 32


@dataclass(frozen=True, kw_only=True)
class Opponents:
    """The other cars of every race of a training."""

    drivers: tuple[str, ...] = (SELF,)
    """``("self",)``: the policy as it is and as it was; or the run folders whose policies drive."""
    cars: int = 2
    """To a race, the learner's included: 2 to 8."""
    current_share: float = 0.5
    """How often a past self gives way to the present one."""
    beside_share: float = 0.5
    """How often a race of two begins rolling, side by side: amid a pass, which nobody comes to by chance."""
    pool_size: int = 8
    """Past selves that are kept: from the beginning to now, evenly."""
    snapshot_every: int = 25_000
    """Camera steps between two snapshots at first; when the pool is full, every second goes and the time doubles."""

    def __post_init__(self) -> None:
        names = self.drivers
        if isinstance(names, str) or not isinstance(names, Sequence) or not names:
            raise ConfigError(f"opponents are {names!r}; allowed are 'self' or run folders.")
        if any(not isinstance(name, str) or not name for name in names):
            raise ConfigError(f"opponents are {names!r}; allowed are 'self' or run folders.")
        if SELF in names and len(names) > 1:
            raise ConfigError("opponents are 'self' and others; allowed is 'self' alone, or run folders.")
        object.__setattr__(self, "drivers", tuple(names))
        for name, value, low, high in (
            ("cars", self.cars, 2, MAX_CARS),
            ("pool_size", self.pool_size, 2, MAX_POOL),
            ("snapshot_every", self.snapshot_every, 1, 10**9),
        ):
            check_whole(f"{name} of opponents", value, low, high, is_plain=True)
        for name, share in (("current_share", self.current_share), ("beside_share", self.beside_share)):
            check_number(f"{name} of opponents", share, 0.0, 1.0, is_plain=True)

    @property
    def is_self(self) -> bool:
        """Whether the policy races against itself."""
        return self.drivers == (SELF,)

    @classmethod
    def from_dict(cls, document: Mapping[str, Any] | None) -> Opponents | None:
        """From what `dataclasses.asdict` gave; TypeError where a field is unknown."""
        return None if document is None else cls(**{**document, "drivers": tuple(document.get("drivers", (SELF,)))})
