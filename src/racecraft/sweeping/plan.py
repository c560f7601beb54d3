"""The file of a sweep: TOML with what all trainings have, what each setting has besides, and the seeds.

seeds = "1..5"                  # or [1, 2, 3, 4, 5]
goal = "laps"                   # or "lap_time": what the leaderboard is ordered by

[all]
track = "oval"
until = "5 laps or 60000 steps"

[settings.plain]

[settings.bold]
reward = "lap_time"             # words as those of `racecraft train`
numbers = { learning_rate = 0.002 }   # hyperparameters, and constants of the reward, as `racecraft tune` knows them

[vary]                          # besides, every combination of these words and numbers
critic = ["privileged", "camera"]
gamma = [0.95, 0.99]
"""

from __future__ import annotations

import itertools
import math
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, Final

from racecraft.checks import check_choice, check_whole, require
from racecraft.errors import ConfigError, RacecraftError, did_you_mean
from racecraft.reward import load_reward
from racecraft.run.folder import sanitize_name
from racecraft.training.plan import Plan, make_plan
from racecraft.tuning import HYPERPARAMETERS, find_constants, rewrite_constants

GOALS: Final = ("laps", "lap_time")
WORDS: Final = (
    *("track", "reward", "until", "actions", "sensors", "model_metadata", "hyperparameters", "from", "algorithm"),
    *("network", "critic", "vehicle", "camera", "direction", "randomize", "num_envs", "evaluate_every"),
)
"""What a setting may say, as `racecraft train` does."""
TEXTS: Final = ("reward", "actions", "model_metadata", "hyperparameters", "from", "algorithm", "network")
"""Those of them that are a name or a file; a track is one, or a list of them."""
NUMBERS: Final = "numbers"
MAX_SETTINGS: Final = 64
MAX_CHARACTERS: Final = 100_000
"""Of the file: hundreds of settings in full."""
MAX_SEEDS: Final = 100
MAX_TRAININGS: Final = 1000
_SEEDS: Final = re.compile(r"(\d{1,10})\.\.(\d{1,10})")

Source = tuple[str, bool]
"""Text of a reward function, and whether it is somebody else's."""


@dataclass(frozen=True, kw_only=True)
class Setting:
    """One row of the table."""

    name: str
    words: dict[str, Any]
    """As in the file."""
    plan: Plan
    """What its trainings are made of, whatever the seed."""


@dataclass(frozen=True, kw_only=True)
class SweepPlan:
    """A sweep to be made."""

    goal: str
    seeds: tuple[int, ...]
    settings: tuple[Setting, ...]

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences for the user about files and parents: once what is said of all settings, else of which."""
        said: dict[str, list[str]] = {}
        for setting in self.settings:
            for note in dict.fromkeys(setting.plan.notes):
                said.setdefault(note, []).append(setting.name)
        count = len(self.settings)
        return tuple(
            note if len(names) == count else f"Setting {', '.join(map(repr, names))}: {note}"
            for note, names in said.items()
        )


def read_sweep(
    text: str,
    *,
    resolve: Callable[[str, Any], Any] = lambda _, value: value,
    load: Callable[[str], Source] = lambda name: (load_reward(name), False),
) -> SweepPlan:
    """A sweep from its file.

    Args:
        text: Of the file.
        resolve: Is given each word with its value, and says what is meant by it, or refuses it.
        load: A reward function by what the file calls it.

    Raises:
        RacecraftError: The file is not a sweep, or a setting cannot be trained.
    """
    document = _parsed(text)
    _check_names(document, ("seeds", "goal", "all", "settings", "vary"), "a sweep")
    goal = document.get("goal", "laps")
    check_choice("goal", goal, GOALS)
    seeds, rows = _seeds(document.get("seeds", "1..5")), _rows(document)
    if (trainings := len(rows) * len(seeds)) > MAX_TRAININGS:
        raise ConfigError(
            f"A sweep of {trainings} trainings, settings times seeds, is too long; allowed are {MAX_TRAININGS}."
        )
    settings = []
    for name, words in rows.items():
        with faults_of(name):
            settings.append(Setting(name=name, words=words, plan=_plan(words, resolve, load)))
    return SweepPlan(goal=goal, seeds=seeds, settings=tuple(settings))


@contextmanager
def faults_of(setting: str) -> Iterator[None]:
    """Within, every error says which setting of the sweep it is of."""
    try:
        yield
    except RacecraftError as error:
        error.args = (f"Setting {setting!r}: {error}",)
        raise


def _seeds(value: Any) -> tuple[int, ...]:
    match = _SEEDS.fullmatch(value) if isinstance(value, str) else None
    if match is not None and int(match[1]) <= int(match[2]) < int(match[1]) + MAX_SEEDS:
        return tuple(range(int(match[1]), int(match[2]) + 1))
    if not isinstance(value, list) or not 1 <= len(value) <= MAX_SEEDS or len(set(map(str, value))) < len(value):
        raise ConfigError(f"seeds is {value!r}; allowed are '1..5' and a list, of {MAX_SEEDS} different ones at most.")
    for seed in value:
        check_whole("seeds", seed, 0, 2**32 - 1, is_plain=True)
    return tuple(value)


def _parsed(text: str) -> dict[str, Any]:
    if len(text) > MAX_CHARACTERS:
        raise ConfigError(f"The sweep has {len(text):,} characters; allowed are {MAX_CHARACTERS:,}.")
    try:
        document = tomllib.loads(text)
        repr(document)  # which a message may quote
    except RecursionError as error:
        raise ConfigError("The sweep is nested too deeply to be read.") from error
    except ValueError as error:  # among them a number of thousands of digits
        raise ConfigError(f"The sweep is not TOML: {error}.") from error
    if not document:  # such as a file that another program is still writing
        raise ConfigError("The sweep says nothing.", hint="[settings.plain] alone is a setting.")
    return document


def _rows(document: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Every setting with all that it says, by name."""
    common = _table(document, "all")
    named = {name: _checked(words, name) for name, words in _table(document, "settings").items()} or {"": {}}
    vary = _table(document, "vary")
    for name, values in vary.items():
        if not isinstance(values, list) or not values:
            raise ConfigError(f"vary.{name} is {values!r}; allowed is a list of what it may be.")
    count = len(named) * math.prod(map(len, vary.values()))
    if count > MAX_SETTINGS:
        raise ConfigError(f"{count} settings are more than {MAX_SETTINGS}.")
    rows: dict[str, dict[str, Any]] = {}
    for name, words in named.items():
        for choice in itertools.product(*vary.values()):
            varied: dict[str, Any] = {}
            for key, value in zip(vary, choice, strict=True):
                varied |= {key: value} if key in WORDS else {NUMBERS: {**varied.get(NUMBERS, {}), key: value}}
            row = _together(_checked(common, "all"), words, varied)
            full = sanitize_name("-".join(filter(None, (name, *map(_short, choice)))) or "plain")[:40]
            if full in rows:
                raise ConfigError(
                    f"Two settings would be called {full!r}.",
                    hint="Give them names under [settings] that differ in their first 40 characters: letters, digits, "
                    "dots, hyphens and underscores, as they become names of folders.",
                )
            rows[full] = row
    return rows


def _together(*parts: Mapping[str, Any]) -> dict[str, Any]:
    """The later goes before the earlier, number by number."""
    row: dict[str, Any] = {}
    for part in parts:
        numbers = {**row.get(NUMBERS, {}), **part.get(NUMBERS, {})}
        row = {**row, **part, **({NUMBERS: numbers} if numbers else {})}
    return row


def _short(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value).rpartition("/")[2].removesuffix(".py")


def _table(document: Mapping[str, Any], name: str) -> dict[str, Any]:
    value = document.get(name, {})
    if not isinstance(value, dict):
        raise ConfigError(f"{name} is {value!r}; allowed is a table.")
    return value


def _checked(words: Any, name: str) -> dict[str, Any]:
    if not isinstance(words, dict):
        raise ConfigError(f"Setting {name!r} is {words!r}; allowed is a table.")
    _check_names(words, (*WORDS, NUMBERS), f"Setting {name!r}")
    if not isinstance(words.get(NUMBERS, {}), dict):
        raise ConfigError(f"numbers is {words[NUMBERS]!r}; allowed is a table such as {{ learning_rate = 0.001 }}.")
    return words


def _check_texts(words: Mapping[str, Any]) -> None:
    def is_text(value: Any) -> bool:
        return isinstance(value, str) and "\0" not in value

    for name in filter(words.__contains__, TEXTS):
        require(name, words[name], is_text(words[name]), "a text")
    if "track" in words:
        track = words["track"]
        is_list = isinstance(track, list) and len(track) > 0
        require("track", track, all(map(is_text, track)) if is_list else is_text(track), "a text, or a list of them")


def _check_names(table: Mapping[str, Any], known: tuple[str, ...], where: str, *, meant: tuple[str, ...] = ()) -> None:
    for name in table:
        if name not in known:
            hint = did_you_mean(name, (*known, *meant)) or f"There are {', '.join(known)}."
            raise ConfigError(f"{where[0].upper()}{where[1:]} has no {name!r}.", hint=hint)


def _plan(words: Mapping[str, Any], resolve: Callable[[str, Any], Any], load: Callable[[str], Source]) -> Plan:
    _check_texts(words)
    given = {name: resolve(name, value) for name, value in words.items() if name not in (NUMBERS, "reward")}
    if "from" in given:
        given["parent"] = given.pop("from")
    if "sensors" in given:
        given["sensors"] = tuple(name.strip() for name in str(given["sensors"]).split("+"))
    plan = make_plan(**given)
    if "reward" in words:
        source, is_foreign = load(str(words["reward"]))
        plan = replace(plan, reward=source, foreign=is_foreign)
    numbers = words.get(NUMBERS, {})
    constants = find_constants(plan.reward)
    known = (*constants, *HYPERPARAMETERS)
    _check_names(numbers, known, "The list of numbers", meant=WORDS)  # a misspelt word of [vary] is taken for a number
    if (learning := {name: value for name, value in numbers.items() if name not in constants}) and (
        plan.settings.algorithm != "ppo"
    ):
        raise ConfigError(f"{next(iter(learning))} is a number of ppo; the algorithm is {plan.settings.algorithm!r}.")
    return replace(
        plan,
        settings=replace(plan.settings, ppo=replace(plan.settings.ppo, **learning)),
        reward=rewrite_constants(plan.reward, {name: numbers[name] for name in numbers if name in constants}),
    )
