"""What the next trial is given, and what it has to reach: functions of the seed and of the trials before it alone.

Trial n knows the trials up to n - window, however many more have ended by then. So the same search gives the same
trials, whatever runs them and whoever is ready first.
"""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from racecraft.tuning.space import Parameter

if TYPE_CHECKING:
    import optuna

BEGINNERS: Final = 6
"""Trials that must be known before the estimator has something to go by; until then numbers are drawn at random."""
JUDGES: Final = 4
"""Completed trials that must be known before one is ended for lagging behind them."""


def draw(
    library: Any,
    space: Sequence[Parameter],
    *,
    seed: int,
    known: Sequence[optuna.trial.FrozenTrial],
    pending: Sequence[dict[str, Any]],
) -> dict[str, float | int]:
    """Numbers of a new trial.

    Args:
        library: Optuna.
        space: What is searched.
        seed: Of this trial.
        known: Trials with their results.
        pending: Numbers of trials whose results are not known; they are taken for bad, so that others are tried.

    The first trial may lie outside the space, as the numbers of now may; the estimator knows nothing of such ones.
    """
    states = library.trial.TrialState
    pending = [params for params in pending if _is_inside(params, space)]
    ended = [
        trial for trial in known if trial.state in (states.COMPLETE, states.PRUNED) and _is_inside(trial.params, space)
    ]
    values = [trial.value for trial in ended if trial.state == states.COMPLETE and trial.value is not None]
    sampler = library.samplers.TPESampler(seed=seed, n_startup_trials=BEGINNERS + len(pending))
    study = library.create_study(direction="minimize", sampler=sampler)
    study.add_trials(ended)
    distributions = {parameter.name: _distribution(library, parameter) for parameter in space}
    for params in pending if values else ():
        study.add_trial(library.create_trial(params=params, distributions=distributions, value=max(values)))
    return dict(study.ask(distributions).params)


def seed_of(seed: int, place: int) -> int:
    """Of one trial of a search."""
    return int(np.random.SeedSequence([seed, place]).generate_state(1)[0])


def bars(library: Any, known: Sequence[optuna.trial.FrozenTrial]) -> tuple[float, ...]:
    """By evaluation, the median of the completed trials that were evaluated so often."""
    complete = library.trial.TrialState.COMPLETE
    marks = [trial.intermediate_values for trial in known if trial.state == complete]
    if len(marks) < JUDGES:
        return ()
    count = max(len(one) for one in marks)
    return tuple(statistics.median(one[number] for one in marks if number in one) for number in range(count))


def suggest(trial: optuna.Trial, parameter: Parameter) -> float | int:
    """A parameter's number in a trial, as the study has it."""
    if parameter.is_whole:
        return trial.suggest_int(parameter.name, int(parameter.low), int(parameter.high), log=parameter.is_log)
    return trial.suggest_float(parameter.name, parameter.low, parameter.high, log=parameter.is_log)


def _is_inside(params: Mapping[str, Any], space: Sequence[Parameter]) -> bool:
    """Whether all numbers of a trial lie between the bounds."""
    return all(one.low <= params[one.name] <= one.high for one in space if one.name in params)


def _distribution(library: Any, parameter: Parameter) -> Any:
    if parameter.is_whole:
        return library.distributions.IntDistribution(int(parameter.low), int(parameter.high), log=parameter.is_log)
    return library.distributions.FloatDistribution(parameter.low, parameter.high, log=parameter.is_log)
