"""What the lessons' text says of what their code prints, each with how to find out whether it is so.

A `Figure` is copied from a run: the page shows both, so they must agree to the digit. A `Statement` must hold for every
run, whatever machine it runs on.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final


@dataclass(frozen=True)
class Figure:
    """Numbers in the text of a lesson, and where its output has the same ones."""

    lesson: int
    text: str
    """Of the lesson, as a pattern; its groups are the numbers."""
    printed: str
    """The same of what it prints."""


@dataclass(frozen=True)
class Statement:
    """Something that the text of a lesson says about what comes out."""

    lesson: int
    text: str
    """As it stands there."""
    holds: Callable[[str], Any]
    """Whether what the lesson printed bears it out."""


def numbers(output: str, pattern: str) -> list[float]:
    """All numbers in what a pattern's only group matches.

    Raises:
        LookupError: Nothing does.
    """
    found = re.search(pattern, output, re.MULTILINE)
    if found is None:
        raise LookupError(f"Nothing is printed that looks like {pattern!r}.")
    return [float(one) for one in re.findall(r"-?\d+(?:\.\d+)?", found[1].replace(",", ""))]


def number(output: str, pattern: str) -> float:
    """The first of them."""
    return numbers(output, pattern)[0]


def literal(output: str, pattern: str) -> Any:
    """What was printed of a list or a dictionary."""
    found = re.search(pattern, output, re.MULTILINE)
    if found is None:
        raise LookupError(f"Nothing is printed that looks like {pattern!r}.")
    return ast.literal_eval(found[0])


def _loses(output: str, epsilon: str) -> float:
    return number(output, rf"^ε = {re.escape(epsilon)}\b\D*([\d,]+)$")


def _lesson_7(output: str) -> dict[str, list[float]]:
    return dict(literal(output, r"^\{'.*without target.*\}$"))


def _lesson_9(output: str, lam: str) -> list[float]:
    return numbers(output, rf"^λ = +{re.escape(lam)}: after 20,000 steps \[(.*)\]$")


def _lesson_11(output: str) -> dict[str, list[int]]:
    return dict(literal(output, r"^\{'end to end'.*\}$"))


_OF_THREE: Final = r"(\d+), (\d+), (\d+)"

FIGURES: Final = (
    Figure(9, rf"{_OF_THREE} against", rf"λ = 0\.95: after 20,000 steps \[{_OF_THREE}\]"),
    Figure(9, rf"against {_OF_THREE} at the end", rf"λ = +1: after 20,000 steps \[{_OF_THREE}\]"),
    Figure(10, r"no evaluation fell below (\d+) of 500", r"with clip, ε = 0\.2 +lowest of all evaluations: (\d+)"),
    Figure(10, r"then at \*\*(\d+)\*\*", r"hardly any, ε = 1 +lowest of all evaluations: (\d+)"),
    Figure(12, r"\| one track \| (\d+),", r"one track +(\d+) of 12 laps"),
    Figure(12, r"\| many tracks \| (\d+),", r"many tracks +(\d+) of 12 laps"),
    Figure(12, r"\| many worlds \| (\d+),", r"many worlds +(\d+) of 12 laps"),
)

STATEMENTS: Final = (
    Statement(1, "it drives laps", lambda out: number(out, r"^(\d+) of 12 laps") >= 11),
    Statement(2, "Four numbers drive a car", lambda out: number(out, r"^It drives: (\d+) of 20 laps") >= 18),
    Statement(
        3,
        "**ε = 0.1** is the best of these *after a thousand pulls*",
        lambda out: _loses(out, "0.1") == min(_loses(out, one) for one in ("0", "0.01", "0.1", "0.5")),
    ),
    Statement(
        3,
        "good learners let exploration **fade**",
        lambda out: number(out, r"10 / \(10 \+ pulls\), loses (\d+)") < number(out, r"constant ε loses (\d+)"),
    ),
    Statement(
        4,
        "comes close to the exact worths",
        lambda out: number(out, r"table and truth: ([\d.]+);") < 0.03,
    ),
    Statement(4, "13 steps, the shortest way", lambda out: number(out, r"^Q-learning .*stumbling +(-[\d.]+)$") == -13),
    Statement(
        4,
        "While it learns, SARSA gets more",
        lambda out: (
            number(out, r"^SARSA +while learning +(-[\d.]+)") > number(out, r"^Q-learning +while learning +(-[\d.]+)")
        ),
    ),
    Statement(5, "7 × 7 × 3 = 147 cells", lambda out: out.count("cut at") == 3 and 7 * 7 * 3 == 147),
    Statement(5, "147 × 5 = 735 numbers", lambda out: number(out, r"in [\d.]+ s: (\d+) of 20 laps") == 20),
    Statement(
        5, "for bends to the right, is empty", lambda out: numbers(out, r"straight, left\): \[(.*)\] of 49")[0] == 49
    ),
    Statement(
        5,
        "on another track it leaves the road",
        lambda out: number(out, r"^On another track.*: (\d+) of 20 laps") <= 2,
    ),
    Statement(
        6,
        "Every step pays **-1, the one to the flag included**",
        lambda out: numbers(out, r"All rewards that came: (.*)$") == [-1, -1],
    ),
    Statement(6, "**12 × 12** finds the flag", lambda out: number(out, r"^ 12 x 12 .*return +(-[\d.]+)$") > -195),
    Statement(
        6,
        "**48 × 48** could represent everything, and knows nothing: each of its 2,304 cells",
        lambda out: number(out, r"^ 48 x 48 .*return +(-[\d.]+)$") == -200,
    ),
    Statement(6, "**3 × 3** is too coarse", lambda out: number(out, r"^  3 x 3 .*return +(-[\d.]+)$") == -200),
    Statement(
        7,
        "the pole falls after 9 or 10 steps, with each of the three seeds",
        lambda out: set(_lesson_7(out)["without target"]) <= {9, 10},
    ),
    Statement(
        7,
        "**Without replay: no difference to be seen here.**",
        lambda out: min(_lesson_7(out)["without replay"]) > 100,
    ),
    Statement(
        8,
        "What took away ninety parts of the noise",
        lambda out: (
            80
            < number(out, r"^without baseline.*variance +([\d.]+)$") / number(out, r"^baseline 11.*variance +([\d.]+)$")
            < 100
        ),
    ),
    Statement(
        8,
        "most players get stuck",
        lambda out: literal(out, r"^\{'with baseline'.*\}$")["without"] < 0.5,
    ),
    Statement(
        8,
        "after 15,000 steps all of them balance the pole for all 500 steps",
        lambda out: (
            {
                *numbers(out, r"^with a baseline network +after 15,000 steps (.*)$"),
                *numbers(out, r"^with the mean only +after 15,000 steps (.*)$"),
            }
            == {500.0}
        ),
    ),
    Statement(
        9,
        "the pole falls after 9 to 15 steps even after 20,000 steps",
        lambda out: (min(_lesson_9(out, "0")), max(_lesson_9(out, "0"))) >= (9, 9) and max(_lesson_9(out, "0")) <= 15,
    ),
    Statement(
        9,
        "With 0.95 and with 1 it stands for more than a hundred",
        lambda out: min(_lesson_9(out, "0.95") + _lesson_9(out, "1")) > 100,
    ),
    Statement(
        9,
        "A2C repeats itself to the last bit",
        lambda out: len(set(numbers(out, r"^a2c: (\d+ and \d+ episodes, of which \d+ of the first \d+)"))) == 1,
    ),
    Statement(
        9,
        "Up to a certain age it does nothing, then the ball swings, and then it flies out of the valley",
        lambda out: [value > 1.0 for value in literal(out, r"^\{0: .*\}$").values()] == [False, False, False, True],
    ),
    Statement(
        10,
        "With a small α it has decided, with a large one it keeps both ways open",
        lambda out: (
            number(out, r"α = 0\.02: goes right in (\d+)") < 10 < 45 < number(out, r"0\.5: goes right in (\d+)")
        ),
    ),
    Statement(
        11,
        "A convolutional network, PPO (lesson 10), a reward, a few seconds",
        lambda out: number(out, r"^End to end: (\d+) of 10") == 10,
    ),
    Statement(
        11,
        "At 0.55 and darker the modules do not get round **once**",
        lambda out: _lesson_11(out)["modules"][:2] == [0, 0],
    ),
    Statement(
        11,
        "mends the modules, 10 of 10 everywhere",
        lambda out: set(_lesson_11(out)["modules, brightness evened"]) == {10},
    ),
    Statement(
        11,
        "the network that was taught by reward drives 10 of 10 at every brightness",
        lambda out: set(_lesson_11(out)["end to end"]) == {10},
    ),
)
