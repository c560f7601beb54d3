"""The beginning of a search: everything checked, written into a new folder, and nothing tried yet."""

from __future__ import annotations

import shutil
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from racecraft.checks import check_choice, check_path, check_type, check_whole
from racecraft.errors import ConfigError, RunError
from racecraft.extras import check_installed
from racecraft.run import RunFolder
from racecraft.run.atomic import write_file, write_json
from racecraft.run.folder import sanitize_name
from racecraft.training.plan import Plan, make_plan
from racecraft.training.start import read_settings
from racecraft.tuning.constants import find_constants
from racecraft.tuning.space import Parameter, make_space
from racecraft.tuning.study import FORMAT, GOALS, MAX_WINDOW, WINDOW


def start_tuning(
    track: str | Path | Sequence[str | Path] | None = None,
    *,
    search: Sequence[str] = (),
    goal: str = "laps",
    trial_steps: int = 40_000,
    window: int = WINDOW,
    root: str | Path = "tuning",
    name: str | None = None,
    **settings: Any,
) -> Path:
    """Make the folder of a search; `Tuning` runs it.

    Args:
        track: As of `racecraft.training.train`.
        search: ``NAME`` or ``NAME=LOW..HIGH`` of hyperparameters and of constants of the reward function; by default
            all such constants, and the usual hyperparameters.
        goal: ``laps`` (fewest camera steps until every evaluation lap is completed) or ``lap_time`` (the fastest lap).
        trial_steps: Camera steps after which a trial ends.
        window: How many trials may be under way at once: trial n is chosen by the results up to trial n - window.
        root: Where such folders lie.
        name: Of the folder; by default a new one.
        settings: Others of `racecraft.training.train`; with a ``parent`` every trial begins with its weights as they
            are now.

    Raises:
        RacecraftError: An input is wrong.
    """
    return make_tuning(
        make_plan(track, **settings),
        search=search,
        goal=goal,
        trial_steps=trial_steps,
        window=window,
        root=root,
        name=name,
    )


def plan_of(run: RunFolder) -> Plan:
    """A run's own settings and reward, to be searched around; the weights begin anew.

    Raises:
        RacecraftError: The run cannot be read.
    """
    return Plan(
        settings=read_settings(run),
        reward=run.read_reward_function(),
        metadata=run.read_model_metadata(),
        hyperparameters=None,  # they are among the settings, and trials have others
        parent=None,
        foreign=run.read_info().foreign,
    )


def space_of(plan: Plan, search: Sequence[str] = ()) -> tuple[Parameter, ...]:
    """What is to be searched around a plan; the search is that of `start_tuning`.

    Raises:
        RacecraftError: A name means nothing here, or the bounds are none.
    """
    constants = find_constants(plan.reward)
    space = make_space(search, ppo=plan.settings.ppo, constants=constants)
    if plan.settings.algorithm == "ppo":
        return space
    left = tuple(parameter for parameter in space if parameter.kind == "constant")
    if (search and len(left) < len(space)) or not left:
        raise ConfigError(
            f"Hyperparameters can be searched for ppo only; the algorithm is {plan.settings.algorithm}.",
            hint="Search constants of the reward function.",
        )
    return left


def make_tuning(
    plan: Plan,
    *,
    search: Sequence[str] = (),
    goal: str = "laps",
    trial_steps: int = 40_000,
    window: int = WINDOW,
    root: str | Path = "tuning",
    name: str | None = None,
) -> Path:
    """Make the folder of a search around a plan; the other arguments are those of `start_tuning`.

    Raises:
        RacecraftError: An input is wrong.
    """
    check_installed("optuna", "racecraft tune")  # importing it takes a second, which a server does not have
    check_choice("goal", goal, GOALS)
    check_whole("trial_steps", trial_steps, 1, is_plain=True)
    check_whole("window", window, 1, MAX_WINDOW, is_plain=True)
    space = space_of(plan, search)
    check_path("root", root, "use a folder's path")
    folder = Path(root) / (_checked(name) if name is not None else f"tuning-{time.strftime('%Y%m%d-%H%M%S')}")
    try:
        folder.mkdir(parents=True)
    except FileExistsError as error:
        raise RunError(f"{folder} exists.", hint="Choose another --name, or continue it with --resume.") from error
    except OSError as error:
        raise RunError(f"{folder} cannot be made: {error.strerror or error}.") from error
    try:
        write_file(folder / "reward_function.py", plan.reward.encode())
        write_json(folder / "model_metadata.json", plan.metadata.to_dict())
        write_json(
            folder / "tuning.json",
            {
                "format": FORMAT,
                "goal": goal,
                "trial_steps": trial_steps,
                "window": window,
                "space": [parameter.to_dict() for parameter in space],
                "settings": plan.settings.to_dict(),
                "parent": None if plan.parent is None else plan.parent.address,
                "foreign": plan.foreign,
                "notes": list(plan.notes),
            },
        )
    except BaseException as error:
        shutil.rmtree(folder, ignore_errors=True)  # half of one can neither be continued nor made again
        if isinstance(error, OSError):
            raise RunError(f"{folder} cannot be made: {error.strerror or error}.") from error
        raise
    return folder


def _checked(name: str) -> str:
    check_type("name", name, str, "use a text")
    if sanitize_name(name) != name:
        raise RunError(f"Name {name!r} is not allowed.", hint=f"Use '{sanitize_name(name)}'.")
    return name
