"""The trials of a search in Optuna's storage, by place.

A trial that was cut or lost begins again at the same place with the same numbers, so what is drawn at the places after
it does not depend on how often anything was killed.
"""

from __future__ import annotations

import sqlite3
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from racecraft.errors import RunError
from racecraft.extras import needed_for
from racecraft.tuning.drawing import bars, draw, seed_of, suggest
from racecraft.tuning.outcome import TrialOutcome
from racecraft.tuning.space import Parameter
from racecraft.tuning.trial import Report

if TYPE_CHECKING:
    import optuna

STUDY: Final = "study.sqlite"
MAX_LOSSES: Final = 3
"""How often what makes a trial may die before the trial has failed."""


@contextmanager
def study_of(folder: Path, *kinds: type[Exception]) -> Iterator[None]:
    """What goes wrong with a search's study, said in a sentence.

    Args:
        folder: Of the search.
        kinds: Errors that can mean nothing else here, besides those of Optuna and its database.

    Raises:
        RunError: It is damaged, or cannot be read or written.
    """
    library = _optuna()
    from sqlalchemy.exc import SQLAlchemyError

    try:
        yield
    except (library.exceptions.OptunaError, SQLAlchemyError, *kinds) as error:
        cause = error.__cause__ or error  # which says more than Optuna does
        reason = str(getattr(cause, "orig", None) or cause) or type(cause).__name__
        raise RunError(
            f"{folder / STUDY} cannot be used: {reason.splitlines()[0].rstrip('.')}.",
            hint="Make room and go on with --resume, or start a new tuning where it is damaged.",
        ) from error


class Record:
    """The study in a search's folder, made where there is none. For one thread of one process.

    Args:
        folder: Of the search.
        space: What is searched.
        seed: Of the search.
        window: How many trials may be under way at once.

    Raises:
        ConfigError: Optuna is not installed.
        RunError: The storage is damaged.
    """

    def __init__(self, folder: Path, space: Sequence[Parameter], *, seed: int, window: int) -> None:
        self._folder, self._space, self._seed, self._window = folder, space, seed, window
        self._library = _optuna()
        self._states = self._library.trial.TrialState
        file = folder / STUDY
        with study_of(folder, Exception):
            storage = self._library.storages.RDBStorage(  # by its path: an address takes some characters for its own
                f"sqlite:///{file.name}",
                engine_kwargs={"creator": lambda: sqlite3.connect(file.resolve(), check_same_thread=False)},
            )
            self._study: optuna.Study = self._library.create_study(
                study_name="racecraft", storage=storage, load_if_exists=True, direction="minimize"
            )

    @property
    def seconds(self) -> float:
        """Wall clock of all calls so far."""
        before = self._study.user_attrs.get("seconds")
        if before is None:  # an earlier version's, which made one trial after another
            return sum(trial.seconds or 0.0 for trial in self.trials())
        return float(before)

    @seconds.setter
    def seconds(self, seconds: float) -> None:
        self._study.set_user_attr("seconds", seconds)

    def take_up(self) -> None:
        """What a killed call left running was cut."""
        for trial in self._study.trials:
            if trial.state == self._states.RUNNING:
                self._study._storage.set_trial_user_attr(trial._trial_id, "cut", True)
                self._study.tell(trial.number, state=self._states.FAIL)

    def next_place(self, busy: Sequence[int]) -> int | None:
        """The first place with nothing to show that nobody is at; None while too much before it is not known."""
        settled = self._settled()
        place = next(
            place for place in range(len(settled) + len(busy) + 1) if place not in settled and place not in busy
        )
        return place if all(before in settled for before in range(place - self._window + 1)) else None

    def begin(self, place: int) -> tuple[int, dict[str, float | int], tuple[float, ...]]:
        """A new trial at a place: its number, what it is given, and what it has to reach."""
        settled = self._settled()
        known = [settled[before] for before in range(place - self._window + 1)]
        if not self._study.get_trials(deepcopy=False, states=(self._states.WAITING,)):  # one that a kill left waits
            self._study.enqueue_trial(self._numbers(place, known))
        trial = self._study.ask()
        trial.set_user_attr("place", place)
        return trial.number, {one.name: suggest(trial, one) for one in self._space}, bars(self._library, known)

    def _numbers(self, place: int, known: Sequence[optuna.trial.FrozenTrial]) -> dict[str, float | int]:
        params = {_place(trial): trial.params for trial in self._study.trials}
        if place in params:  # it was cut
            return params[place]
        if place == 0:
            return {parameter.name: parameter.default for parameter in self._space}
        pending = [params[before] for before in range(len(known), place)]
        return draw(self._library, self._space, seed=seed_of(self._seed, place), known=known, pending=pending)

    def tell(self, number: int, report: Report) -> None:
        """A trial ended by itself."""
        trial = self._study.trials[number]
        for step, mark in enumerate(report.marks):
            self._study._storage.set_trial_intermediate_value(trial._trial_id, step, mark)
        self._set(
            number, completion=report.completion, best_lap=report.best_lap, steps=report.steps, seconds=report.seconds
        )
        if report.reason == "pruned":
            self._study.tell(number, state=self._states.PRUNED)
        else:
            self._study.tell(number, report.value)

    def tell_cut(self, number: int, report: Report | None = None, *, is_lost: bool = False) -> None:
        """A trial was ended and is to begin again; after too many losses it has failed."""
        losses = 1 + sum(bool(other.user_attrs.get("lost")) for other in self._at(self._study.trials[number]))
        if is_lost and losses >= MAX_LOSSES:
            self.tell_failed(number, f"What trained it died {losses} times.")
            return
        if report is not None:
            self._set(
                number,
                completion=report.completion,
                best_lap=report.best_lap,
                steps=report.steps,
                seconds=report.seconds,
            )
        self._set(number, cut=True, **({"lost": True} if is_lost else {}))
        self._study.tell(number, state=self._states.FAIL)

    def tell_failed(self, number: int, error: str) -> None:
        """A trial cannot be trained."""
        self._set(number, error=error)
        self._study.tell(number, state=self._states.FAIL)

    def trial(self, number: int) -> TrialOutcome:
        """One trial."""
        return self._seen(self._study.trials[number])

    def trials(self) -> tuple[TrialOutcome, ...]:
        """All that began, in that order."""
        return tuple(self._seen(trial) for trial in self._study.trials if trial.state != self._states.WAITING)

    def importances(self) -> dict[str, float]:
        """How much each number mattered, adding up to 1; empty while there are too few trials to say."""
        done = [trial for trial in self._study.trials if trial.value is not None]
        if len(done) < 4 or len({trial.value for trial in done}) < 2:
            return {}
        importance = self._library.importance
        try:
            found = importance.get_param_importances(self._study, evaluator=importance.PedAnovaImportanceEvaluator())
        except (ImportError, ValueError, RuntimeError):
            return {}
        return {name: float(share) for name, share in found.items()}

    def _settled(self) -> dict[int, optuna.trial.FrozenTrial]:
        """By place, the trial that has a result."""
        return {
            _place(trial): trial
            for trial in self._study.trials
            if trial.state.is_finished() and trial.user_attrs.get("cut") is not True
        }

    def _at(self, trial: optuna.trial.FrozenTrial) -> list[optuna.trial.FrozenTrial]:
        """The other trials at a trial's place."""
        place = _place(trial)
        return [other for other in self._study.trials if other.number != trial.number and _place(other) == place]

    def _set(self, number: int, **attributes: Any) -> None:
        trial = self._study.trials[number]
        for name, value in attributes.items():
            self._study._storage.set_trial_user_attr(trial._trial_id, name, value)

    def _seen(self, trial: optuna.trial.FrozenTrial) -> TrialOutcome:
        attributes = trial.user_attrs
        return TrialOutcome(
            number=trial.number,
            state="out of time" if attributes.get("cut") is True else trial.state.name.lower(),
            value=trial.value,
            params=dict(trial.params),
            run=str(self._folder / name_of(trial.number)),
            completion=attributes.get("completion"),
            best_lap_seconds=attributes.get("best_lap"),
            steps=attributes.get("steps"),
            seconds=attributes.get("seconds"),
            error=str(attributes.get("error", "")),
        )


def name_of(number: int) -> str:
    """A trial's run folder."""
    return f"trial-{number:04d}"


def _place(trial: optuna.trial.FrozenTrial) -> int:
    """Earlier versions counted trials alone."""
    return int(trial.user_attrs.get("place", trial.number))


def _optuna() -> Any:
    with needed_for("racecraft tune"):
        import optuna
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    warnings.filterwarnings("ignore", "Fixed parameter .* is out of range")  # the numbers of now may be
    return optuna
