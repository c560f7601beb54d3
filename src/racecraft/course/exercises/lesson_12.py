"""Ranges to draw a simulator's worlds from, so that the cars that were measured are among them."""

from __future__ import annotations

from typing import Any, Final

from racecraft.course.verdict import Verdict, right, wrong

MEASURED: Final = {
    "friction": (0.71, 0.95, 0.83, 1.08, 0.77),
    "light": (0.62, 1.35, 0.9, 1.1, 0.75),
    "latency": (0.1, 0.6, 0.4, 0.2, 0.9),
    "steering_bias": (-0.03, 0.02, 0.04, -0.01, 0.0),
}
"""Of five cars, in the units of `racecraft.sim.Randomization`."""
WIDEST: Final = 3.0
"""Times the spread that was measured."""


def check_ranges(ranges: Any) -> Verdict:
    """All five cars inside, and not the whole world."""
    if not isinstance(ranges, dict) or set(ranges) != set(MEASURED):
        return wrong(f"It must be a dictionary with the keys {', '.join(MEASURED)}.")
    for name, cars in MEASURED.items():
        ends = ranges[name]
        if not isinstance(ends, tuple | list) or len(ends) != 2:
            return wrong(f"{name} is {ends!r}; it must be two numbers, the lowest and the highest.")
        low, high = map(float, ends)
        least, most = min(cars), max(cars)
        if not low <= high:
            return wrong(f"{name} goes from {low:g} to {high:g}: write the lower end first.")
        if low == high:
            return wrong(
                f"{name} is always {low:g}: that is one world, however well it was measured, and no car is like it. A "
                "range must hold all five."
            )
        if low > least or high < most:
            outside = least if low > least else most
            return wrong(
                f"A car with {name} {outside:g} was measured, and {low:g} to {high:g} leaves it out: it would meet "
                "something there that it never saw."
            )
        if low < 0.0 < least:
            return wrong(f"{name} begins at {low:g}, and no car has less than nothing of it.")
        if high - low > WIDEST * (most - least):
            return wrong(
                f"{name} from {low:g} to {high:g} holds all five, and much that no car is like: a driver that is ready "
                f"for everything drives slowly. They spread over {most - least:.2g}; take at most {WIDEST:g} times "
                "that."
            )
    return right("All five are in it, with some room for the sixth.")


CHECKS = {"ranges": check_ranges}
