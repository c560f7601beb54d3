"""Five rewards to repair: whom they like best among drivers of known habits decides."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

from racecraft.course.drivers import earnings
from racecraft.course.verdict import Verdict, right, wrong

Reward = Callable[[dict[str, Any]], float]


def check_inside(reward: Reward) -> Verdict:
    """It paid for nothing but staying inside: the slow earned as much as the quick."""
    paid = earnings(reward)
    if paid["quick"] < 1.2 * paid["slow"]:
        return wrong(
            f"At 2 m/s it still pays {_says(paid, 'quick')} and at half a metre per second {_says(paid, 'slow')}: "
            "why should a car hurry? Let params['speed'] or the progress made count."
        )
    if paid["on the border"] > 0.8 * paid["brisk"]:
        return wrong(
            f"Now it pays for speed, but with two wheels outside {_says(paid, 'on the border')}, as much as inside: "
            "keep what was good about the old reward, params['all_wheels_on_track']."
        )
    return _in_the_right_direction(paid) or right("The quick earn more than the slow, and only inside.")


def check_overwritten(reward: Reward) -> Verdict:
    """The last line overwrote what was paid for the middle of the road."""
    paid = earnings(reward)
    if paid["on the border"] > 0.8 * paid["brisk"]:
        return wrong(
            f"On the border it pays {_says(paid, 'on the border')}, in the middle {_says(paid, 'brisk')}, at the same "
            "speed: a later line still overwrites what was paid for the middle. Look for '=' where '*=' is meant."
        )
    if paid["quick"] < 1.2 * paid["slow"]:
        return wrong(
            f"The middle counts now, but speed does not any more: {_says(paid, 'slow')} when slow, "
            f"{_says(paid, 'quick')} when quick. Both are to count, so multiply or add them."
        )
    return _in_the_right_direction(paid) or right("Both count: the middle of the road, and speed.")


def check_zigzag(reward: Reward) -> Verdict:
    """It paid for turning the wheel."""
    paid = earnings(reward)
    if paid["weaving"] > 1.05 * paid["brisk"]:
        return wrong(
            f"Who weaves earns {_says(paid, 'weaving')}, who drives straight on {_says(paid, 'brisk')}: it still pays "
            "for the steering angle itself. Pay for what good steering leads to."
        )
    if paid["weaving"] > 0.8 * paid["brisk"]:
        return wrong(
            f"Weaving earns {_says(paid, 'weaving')} and a calm hand {_says(paid, 'brisk')}: hardly more. Take "
            "something off where abs(params['steering_angle']) is large."
        )
    if paid["quick"] < 1.2 * paid["slow"]:
        return wrong("Calm it is, but a slow car earns as much as a quick one: let speed count as well.")
    return _in_the_right_direction(paid) or right("A calm hand earns more than a restless one.")


def check_backwards(reward: Reward) -> Verdict:
    """It paid for being parallel to the road, whichever way the car faces."""
    paid = earnings(reward)
    if paid["wrong way"] > 0.9 * paid["brisk"]:
        return wrong(
            f"The wrong way still earns {_says(paid, 'wrong way')}, the right way {_says(paid, 'brisk')}: abs() makes "
            "both ends of the car alike. The cosine of the angle knows the difference, if one lets it."
        )
    if paid["wrong way"] > 0.1 * abs(paid["brisk"]):
        return wrong(
            f"The wrong way earns less, but still {_says(paid, 'wrong way')}: a learner takes what it can get. It must "
            "earn nothing, or pay."
        )
    if paid["brisk"] <= 0.0:
        return wrong(f"Now the right way earns {_says(paid, 'brisk')}, too: nothing is left to drive for.")
    return right("Only the right way pays.")


def check_cliff(reward: Reward) -> Verdict:
    """It paid all or nothing, at a speed that no beginner survives."""
    paid = earnings(reward)
    steps = [paid["slow"], paid["steady"], paid["brisk"], paid["quick"]]
    rise = steps[-1] - steps[0]
    if rise <= 0.05 * max(abs(steps[0]), 1e-6):
        return wrong(
            f"From 0.5 to 2 m/s it pays {', '.join(f'{step:.2f}' for step in steps)} a second: nobody who drives like "
            "this feels that faster is better. Pay something for every bit of speed."
        )
    gains = [after - before for before, after in pairwise(steps)]
    if max(gains) > 0.7 * rise:
        return wrong(
            f"The cliff has moved, but it is one: {', '.join(f'{step:.2f}' for step in steps)} a second at 0.5, 1, 1.5 "
            "and 2 m/s. Let the pay grow with the speed, without an if."
        )
    if paid["on the border"] > 0.8 * paid["brisk"]:
        return wrong(
            "A slope instead of a cliff: good. But on the border it pays as much as on the road, so the fastest "
            "way off the track wins. Let the pay depend on params['all_wheels_on_track'], too."
        )
    return _in_the_right_direction(paid) or right("Every bit of speed is worth something, so there is a way up.")


def _in_the_right_direction(paid: dict[str, float]) -> Verdict | None:
    """What every reward must know: numbers, and which driver is worth most."""
    if not all(math.isfinite(value) for value in paid.values()):
        return wrong("It pays amounts that are no numbers.")
    if paid["brisk"] <= 0.0:
        return wrong(f"A good driver earns {_says(paid, 'brisk')}: whoever must pay for driving stops soon.")
    return None


def _says(paid: dict[str, float], name: str) -> str:
    return f"{paid[name]:.2f} a second"


CHECKS = {
    "inside": check_inside,
    "overwritten": check_overwritten,
    "zigzag": check_zigzag,
    "backwards": check_backwards,
    "cliff": check_cliff,
}
