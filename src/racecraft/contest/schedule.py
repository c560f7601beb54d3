"""Who races whom: a round-robin, or a Swiss tournament that pairs equals. Pure functions.

round-robin of 4:  0-3 1-2 | 2-0 3-1 | 0-1 2-3      everyone meets everyone once
Swiss:             sorted by points, neighbours that have not met yet
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

Pair = tuple[int, int]
"""Two different entries, the one that starts in front first."""


def round_robin(num_entries: int) -> list[list[Pair]]:
    """Rounds in which everyone meets everyone once, nobody twice in a round; with odd numbers one rests in each.

    By the circle method: the first stays, the others move on by one place from round to round. Everyone
    starts in front in half of its races.
    """
    if num_entries < 2:
        return []
    seats: list[int | None] = [*range(num_entries)] + [None] * (num_entries % 2)
    rounds = []
    for _ in range(len(seats) - 1):
        pairs = []
        for i in range(len(seats) // 2):
            one, other = seats[i], seats[-1 - i]
            if one is not None and other is not None:
                first, second = min(one, other), max(one, other)
                pairs.append((first, second) if (second - first) % 2 else (second, first))
        rounds.append(pairs)
        seats = [seats[0], seats[-1], *seats[1:-1]]
    return rounds


def swiss_round(points: Sequence[float], met: Collection[Pair], rested: Collection[int] = ()) -> list[Pair]:
    """The pairs of one round: from the top of the table on, each with the next one it has not met yet.

    Where everybody left was met already, the next in the table is met again. With an odd number the lowest that has
    not rested yet rests.

    Args:
        points: So far, of every entry.
        met: Pairs of earlier rounds, in either order.
        rested: Entries that had no opponent in an earlier round.
    """
    known = {frozenset(pair) for pair in met}
    table = sorted(range(len(points)), key=lambda entry: (-points[entry], entry))
    if len(table) % 2:
        resting = next((entry for entry in reversed(table) if entry not in rested), table[-1])
        table.remove(resting)
    pairs = _pairing(table, known) or _pairing(table, set())
    started = {entry: sum(pair[0] == entry for pair in met) for entry in range(len(points))}
    return [(a, b) if started[a] <= started[b] else (b, a) for a, b in pairs or []]


def _pairing(table: list[int], met: set[frozenset[int]], budget: int = 10_000) -> list[Pair] | None:
    """Pairs without repetition, found by trying; None if there are none, or not within so many tries."""
    tries = 0

    def pair_up(rest: list[int]) -> list[Pair] | None:
        nonlocal tries
        if not rest:
            return []
        first = rest[0]
        for index in range(1, len(rest)):
            tries += 1
            if tries > budget:
                return None
            if frozenset((first, rest[index])) in met:
                continue
            others = pair_up(rest[1:index] + rest[index + 1 :])
            if others is not None:
                return [(first, rest[index]), *others]
        return None

    return pair_up(table)
