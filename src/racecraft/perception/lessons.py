"""How much perception learns, and how."""

from __future__ import annotations

from dataclasses import dataclass

from racecraft.checks import check_number, check_whole


@dataclass(frozen=True, kw_only=True)
class Lessons:
    """How much is learned, and how."""

    updates: int = 20_000
    """Gradient steps of the network."""
    minibatch_size: int = 128
    """Pictures to each of them."""
    learning_rate: float = 6e-3
    """Adam's step size after its first steps; it falls to nothing along a cosine."""
    store: int = 24_576
    """Pictures that are remembered, so that those of a minibatch have nothing to do with each other."""
    fresh: float = 0.25
    """New pictures to one of a minibatch; half of a minibatch is looked at in a mirror."""
    roads: int = 60
    """Generated roads to learn on, beside three of the library; a quarter of them with tight bends."""
    seed: int = 1
    """Decides everything."""

    @property
    def memory_updates(self) -> int:
        """Gradient steps of the memory, which learns once the network has."""
        return max(1, self.updates // 8)

    @property
    def all_updates(self) -> int:
        """Of the network and of its memory."""
        return self.updates + self.memory_updates

    @property
    def remembered(self) -> int:
        """Pictures of drives that memory learns from, at least."""
        return 8 * self.store

    def __post_init__(self) -> None:
        check_whole("updates", self.updates, 1, 10_000_000)
        check_whole("minibatch_size", self.minibatch_size, 1, 65_536)
        check_whole("store", self.store, self.minibatch_size, 1_000_000)
        check_whole("roads", self.roads, 1, 90)
        check_number("learning_rate", self.learning_rate, 0.0, 1.0)
        check_number("fresh", self.fresh, 0.01, 10.0)
        check_whole("seed", self.seed, 0, 2**32 - 1)
