"""Finals in which two meet at a time: who meets whom, and what places come of it. Pure functions of seeds and winners.

    head-to-head   everyone meets everyone once; places by duels won
    bracket        knock-out: the first against the last, so that the two best can only meet at the end

    a bracket of 6:  1 ─────────┐
                     4 ┐        ├ winner ┐
                     5 ┴ winner ┘        ├ winner     the losers of both semi-finals race for the third place,
                     2 ─────────┐        │            who loses earlier shares one with those who lose as early
                     3 ┐        ├ winner ┘
                     6 ┴ winner ┘

Seeds count from 1, the best in qualifying, whose order also decides what is equal in everything else.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, NamedTuple

from racecraft.checks import check_choice
from racecraft.contest.classification import Standing, classify
from racecraft.contest.schedule import round_robin
from racecraft.errors import ConfigError
from racecraft.race.results import Trial

FORMS: Final = ("head-to-head", "bracket")
MAX_FINALISTS: Final[Mapping[str, int]] = {"head-to-head": 8, "bracket": 32}
HEATS: Final = 2
"""Of a duel, from the same place and among the same objects: each of the two is in front once."""

Seats = tuple[int | None, int | None]
"""Seeds of who meets; None for whom an earlier duel has yet to find."""


@dataclass(frozen=True, kw_only=True)
class FinalTerms:
    """What is announced of a final besides what every race is held by."""

    form: str
    """Of `FORMS`."""
    best: int
    """How many of the first of qualifying drive, at most."""
    qualifying: str
    """Commitment of the race that they come from."""

    def __post_init__(self) -> None:
        """Refuse what is no final.

        Raises:
            ConfigError: Says what is allowed.
        """
        check_choice("form of a final", self.form, FORMS)
        if not 2 <= self.best <= MAX_FINALISTS[self.form]:
            raise ConfigError(
                f"A {self.form} final is one of {self.best}; allowed are 2 to {MAX_FINALISTS[self.form]}."
            )

    def to_dict(self) -> dict[str, Any]:
        """As a race's document has it."""
        return {"form": self.form, "best": self.best, "qualifying": self.qualifying}

    @classmethod
    def of(cls, document: Mapping[str, Any]) -> FinalTerms | None:
        """That a race's document has; None where everybody drives alone.

        Raises:
            ConfigError: A stranger wrote it, and it is none.
        """
        found = document.get("final")
        if found is None:
            return None
        fields = {"form": str, "best": int, "qualifying": str}
        if not isinstance(found, Mapping) or {name: type(one) for name, one in found.items()} != fields:
            raise ConfigError(f"The race's document has the final {str(found)[:80]!r}, which is none.")
        return cls(**found)


class Source(NamedTuple):
    """Where one of a duel's two comes from."""

    kind: Literal["seed", "winner", "loser"]
    number: int
    """The seed, or the duel that they won or lost."""


@dataclass(frozen=True, kw_only=True)
class PlannedDuel:
    """Two who meet."""

    number: int
    """From 0, in the order in which they are driven."""
    round: int
    """From 0."""
    sources: tuple[Source, Source]

    @property
    def is_for_third(self) -> bool:
        """Whether it is between the losers of both semi-finals."""
        return self.sources[0].kind == "loser"


def plan_final(form: str, num_finalists: int) -> list[PlannedDuel]:
    """All duels, each after those that its racers come from.

    Raises:
        ConfigError: No such form, or more or fewer than it allows.
    """
    FinalTerms(form=form, best=num_finalists, qualifying="")
    if form == "bracket":
        return _bracket(num_finalists)
    pairs = [(turn, sorted(pair)) for turn, pairs in enumerate(round_robin(num_finalists)) for pair in sorted(pairs)]
    return [
        PlannedDuel(number=number, round=turn, sources=(Source("seed", first + 1), Source("seed", second + 1)))
        for number, (turn, (first, second)) in enumerate(pairs)
    ]


def _bracket(num_finalists: int) -> list[PlannedDuel]:
    order = [1]
    while len(order) < num_finalists:
        order = [seed for one in order for seed in (one, 2 * len(order) + 1 - one)]
    racers = [Source("seed", seed) if seed <= num_finalists else None for seed in order]
    plan: list[PlannedDuel] = []

    def meet(turn: int, first: Source, second: Source) -> Source:
        plan.append(PlannedDuel(number=len(plan), round=turn, sources=(first, second)))
        return Source("winner", plan[-1].number)

    turn = 0
    while len(racers) > 1:
        if len(racers) == 2 and all(one is not None and one.kind == "winner" for one in racers):
            meet(turn, *(Source("loser", one.number) for one in racers if one is not None))
        pairs = zip(racers[::2], racers[1::2], strict=True)
        racers = [meet(turn, one, other) if one and other else one or other for one, other in pairs]
        turn += 1
    return plan


def seats_of(plan: Sequence[PlannedDuel], winners: Mapping[int, int]) -> list[Seats]:
    """Who meets in each duel, as far as those before are decided.

    Args:
        plan: From `plan_final`.
        winners: Seeds of who won, by duel.
    """
    found: list[Seats] = []

    def racer(source: Source) -> int | None:
        if source.kind == "seed":
            return source.number
        winner = winners.get(source.number)
        if winner is None or source.kind == "winner":
            return winner
        one, other = found[source.number]
        return other if one == winner else one

    for duel in plan:
        one, other = duel.sources
        found.append((racer(one), racer(other)))
    return found


def final_places(form: str, num_finalists: int, winners: Mapping[int, int]) -> dict[int, int]:
    """Everybody's place by seed, once all duels are decided; who lost as early as others shares one with them.

    Head to head more duels won are better; of equals, more won among themselves; then the better seed.
    """
    plan = plan_final(form, num_finalists)
    duels = list(zip(plan, seats_of(plan, winners), strict=True))
    if form == "head-to-head":
        order = _by_wins(list(range(1, num_finalists + 1)), [(winners[duel.number], seats) for duel, seats in duels])
        return {seed: place for place, seed in enumerate(order, start=1)}
    found, left = {winners[plan[-1].number]: 1}, num_finalists
    for turn in range(plan[-1].round + 1):
        lost = {
            _loser(seats, winners[duel.number]) for duel, seats in duels if duel.round == turn and not duel.is_for_third
        }
        left -= len(lost)
        found |= dict.fromkeys(lost, left + 1)
    for duel, seats in duels:
        if duel.is_for_third:
            found |= {winners[duel.number]: 3, _loser(seats, winners[duel.number]): 4}
    return found


def _loser(seats: Seats, winner: int) -> int:
    one, other = seats
    assert one is not None
    assert other is not None
    return other if one == winner else one


def _by_wins(seeds: list[int], duels: list[tuple[int, Seats]]) -> list[int]:
    """Seeds by duels won among themselves, the best first."""
    among = [winner for winner, seats in duels if set(seats) <= set(seeds)]
    wins = {seed: among.count(seed) for seed in seeds}
    if len(set(wins.values())) == 1:
        return sorted(seeds)
    levels = sorted(set(wins.values()), reverse=True)
    return [seed for level in levels for seed in _by_wins([one for one in seeds if wins[one] == level], duels)]


def duel_result(
    first: Sequence[Trial], second: Sequence[Trial], *, ranking: str, minimum_laps: int
) -> tuple[tuple[Standing, Standing], bool]:
    """How two stand after their heats, and whether the first has won.

    Args:
        first: What the better seed did, heat by heat; it wins what is equal in everything.
        second: What the other one did.
        ranking: What a heat is ranked by, as for `classify`.
        minimum_laps: Completed laps that a heat must have for a score.
    """
    found = classify([first, second], ranking=ranking, minimum_laps=minimum_laps, ranks_all=True)
    one, other = sorted(found, key=lambda standing: standing.car)
    assert one.place is not None
    assert other.place is not None
    return (one, other), one.place <= other.place
