"""A reward function in the page's own Python: checked, tried, and called for every row.

It runs in the browser, beside the files of `racecraft.reward` that need Python alone (`SHIPPED`), and does what
`RewardWorker` does for an installed program. Texts cross the border as JSON, numbers through two arrays of doubles;
web/src/tab/python.ts is the other side.
"""

from __future__ import annotations

import json
import random  # noqa: F401  # what is there is seeded
import sys
from array import array
from contextlib import redirect_stderr, redirect_stdout
from struct import Struct
from typing import Any, Final

from racecraft.errors import printable
from racecraft.reward.check import check_reward
from racecraft.reward.failure import SHOWN_BYTES, hint_about, kept_prints, told
from racecraft.reward.params import make_params
from racecraft.reward.rehearsal import drive_to
from racecraft.reward.state import keeps_state
from racecraft.reward.worker_process import (
    REWARD_LIMIT,
    SIZE,
    STEPS,
    BadRewardError,
    PrintRing,
    describe,
    line_of,
    line_of_return,
    load_functions,
    to_float,
)

SHIPPED: Final = (
    "errors.py",
    "scoped_warnings.py",
    *(f"reward/{name}.py" for name in ("check", "failure", "imports", "keys", "names", "params", "rehearsal")),
    *(f"reward/{name}.py" for name in ("reading", "source", "state", "worker_process")),
    "site/calls.py",
)
"""Files below `racecraft` that the page brings."""
LOG_BYTES: Final = 64 * 1024  # how much of the last printed text is kept


class Failed(Exception):
    """A reward function failed; the text says all."""

    def __init__(self, text: str, line: int) -> None:
        super().__init__(text)
        self.line = line


class Calls:
    """A source that was loaded, its cars, and what it printed."""

    def __init__(self, source: str, waypoints: list[list[list[float]]], *, num_cars: int, seed: int) -> None:
        self._source = source
        self._waypoints = [[(float(x), float(y)) for x, y in line] for line in waypoints]
        self._log = memoryview(bytearray(SIZE.size + LOG_BYTES))
        self._prints = PrintRing(self._log)
        self._num_read = 0
        try:
            with redirect_stdout(self._prints), redirect_stderr(self._prints):
                self._functions = load_functions(source, seed=seed, num_cars=num_cars if keeps_state(source) else 1)
        except BaseException as error:
            raise self._failed(error, line_of(error), None) from None

    def pay(self, rows: array[float], rewards: array[float]) -> None:
        """Fill the rewards of a batch of rows, one a car."""
        row_of = Struct(f"{len(rows) // len(rewards)}d")
        num_functions = len(self._functions)
        with redirect_stdout(self._prints), redirect_stderr(self._prints):
            for car, row in enumerate(row_of.iter_unpack(rows)):
                rewards[car] = 0.0 if row[STEPS] == 1.0 else self._call(car % num_functions, row)

    def _call(self, number: int, row: tuple[float, ...]) -> float:
        function = self._functions[number]
        try:
            reward: Any = function(make_params(row, self._waypoints))
            if type(reward) is not float:
                reward = to_float(reward)
            if not -REWARD_LIMIT <= reward <= REWARD_LIMIT:
                raise BadRewardError(f"returned {reward!r}; a reward is a finite number within ±100000")
        except BadRewardError as error:
            line = line_of_return(function, make_params(row, self._waypoints))
            raise self._failed(error, line, row) from None
        except BaseException as error:
            raise self._failed(error, line_of(error), row) from None
        return float(reward)

    def _failed(self, error: BaseException, line: int, row: tuple[float, ...] | None) -> Failed:
        text = told(
            printable(describe(error).decode()),
            self._source,
            line=line,
            is_loading=row is None,
            params=None if row is None else make_params(row, self._waypoints),
            printed=kept_prints(self._log, SHOWN_BYTES),
        )
        return Failed(text, line)

    def read_log(self) -> str:
        """What was printed since the last call of this, or the end of it."""
        (written,) = SIZE.unpack_from(self._log)
        since, self._num_read = written - self._num_read, written
        return kept_prints(self._log, since)


def check(question: str) -> str:
    """Problems of a source and what it pays in situations, as the console's server answers.

    Args:
        question: ``source``, ``waypoints``, and ``situations`` with name, description and row of each.
    """
    asked = json.loads(question)
    source = asked["source"]
    problems = [
        {
            "line": problem.line,
            "column": problem.column,
            "severity": problem.severity,
            "message": problem.message,
            "hint": problem.hint,
        }
        for problem in check_reward(source)
    ]
    situations: list[dict[str, Any]] = []
    try:
        if not any(problem["severity"] == "error" for problem in problems):
            calls = Calls(source, asked["waypoints"], num_cars=1, seed=0)
            for situation in asked["situations"]:
                try:
                    situations.append(_try(calls, situation))
                except Failed:
                    if not keeps_state(source):
                        raise
                    # No car gets there from the situation before: what it remembers may be to blame.
                    calls = Calls(source, asked["waypoints"], num_cars=1, seed=0)
                    for row in drive_to(situation["row"], asked["waypoints"]):
                        calls.pay(array("d", row), array("d", [0.0]))
                    calls.read_log()
                    situations.append(_try(calls, situation))
    except Failed as failed:
        text = str(failed)
        about = {"severity": "error", "message": text, "hint": hint_about(text)}
        problems.append({"line": max(failed.line, 1), "column": 1, **about})
    is_ok = not any(problem["severity"] == "error" for problem in problems)
    return json.dumps({"ok": is_ok, "problems": problems, "situations": situations, "painting": None, "laps": []})


def _try(calls: Calls, situation: dict[str, Any]) -> dict[str, Any]:
    rewards = array("d", [0.0])
    calls.pay(array("d", situation["row"]), rewards)
    about = {name: situation[name] for name in ("name", "description")}
    return {**about, "reward": rewards[0], "error": None, "printed": calls.read_log()}


class Paying:
    """The function of a training, and the memory through which it is asked."""

    def __init__(self, question: str) -> None:
        asked = json.loads(question)
        count, width = asked["numCars"], asked["numColumns"]
        self.rows = array("d", bytes(8 * count * width))
        self.rewards = array("d", bytes(8 * count))
        self.failure = ""
        try:
            self._calls = Calls(asked["source"], asked["waypoints"], num_cars=count, seed=asked["seed"])
        except Failed as failed:
            self.failure = str(failed)
        self.remembers = not self.failure and keeps_state(asked["source"])

    def pay(self) -> str:
        """Rewards of the rows; a failure's text, or nothing."""
        try:
            self._calls.pay(self.rows, self.rewards)
        except Failed as failed:
            return str(failed)
        return ""

    def printed(self) -> str:
        """What the function printed since this was asked last."""
        return self._calls.read_log()


def close_doors() -> None:
    """Forget the names under which Python finds the page around it: no reward function has any business there."""
    for name in [name for name in sys.modules if name.partition(".")[0] in ("js", "pyodide_js", "pyodide")]:
        del sys.modules[name]
