"""A search for better numbers: trials that are runs, in a study that can be killed and goes on.

    tuning/<name>/tuning.json      what is searched, and everything else a trial needs
                  reward_function.py  model_metadata.json
                  study.sqlite     Optuna's storage
                  trial-0000/ ...  run folders
                  result.json      the outcome so far

Optuna chooses (a tree-structured Parzen estimator, https://papers.nips.cc/paper/4443), a trial trains for at most
so many camera steps, and one whose evaluations lag behind the median of those before it is ended. Several are made at
once, each at a seat; which numbers they get does not depend on that, see `racecraft.tuning.drawing`.
"""

from __future__ import annotations

import os
import queue
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from racecraft.agent import ModelMetadata
from racecraft.checks import check_number, check_path, check_whole, require
from racecraft.errors import CheckpointError, ConfigError, RacecraftError, RunError
from racecraft.extras import check_installed
from racecraft.json_file import read_json_object
from racecraft.run.atomic import write_json
from racecraft.run.lock import exclusive_lock
from racecraft.system import num_cores
from racecraft.training import Until
from racecraft.training.interruption import interruptible
from racecraft.training.parent import open_parent
from racecraft.training.plan import Plan
from racecraft.training.settings import TrainSettings
from racecraft.tuning.constants import rewrite_constants
from racecraft.tuning.outcome import Outcome, TrialOutcome
from racecraft.tuning.record import Record, name_of, study_of
from racecraft.tuning.seats import HereSeat, ProcessSeat, Seat, SeatLost
from racecraft.tuning.space import Parameter
from racecraft.tuning.trial import Order, Report

GOALS: Final = ("laps", "lap_time")
FORMAT: Final = 1
WINDOW: Final = 4
"""Trials that may be under way at once, unless a search says otherwise."""
MAX_WINDOW: Final = 256


class Tuning:
    """One search, from its folder.

    Args:
        folder: Made by `start_tuning`.
        on_trial: Is told every trial that ended.
        foreign: The reward function is somebody else's, whatever the folder says.
        parents: Folder in which the run that trials begin from has to lie; by default any.

    Raises:
        RunError: There is no such folder, its files are not what they were, or the run that trials begin from is gone
            or lies elsewhere.
        ConfigError: Optuna is not installed.
    """

    def __init__(
        self,
        folder: str | Path,
        *,
        on_trial: Callable[[TrialOutcome], None] | None = None,
        foreign: bool = False,
        parents: Path | None = None,
    ) -> None:
        check_path("tuning", folder, "use the path of a search's folder, such as 'tuning/NAME'")
        self.folder = Path(folder)
        if not os.path.isfile(self.folder / "tuning.json"):  # False of names too long for one, too
            raise RunError(f"{str(self.folder)[:200]} holds no tuning: tuning.json is missing.")
        try:
            document = read_json_object(self.folder / "tuning.json")
            if document["format"] != FORMAT:
                raise RunError(f"{self.folder} was written by another version of Racecraft.", hint="Update Racecraft.")
            self.goal, self.trial_steps = str(document["goal"]), int(document["trial_steps"])
            self.window = int(document.get("window", 1))
            self.space = tuple(Parameter.from_dict(dict(parameter)) for parameter in document["space"])
            settings = TrainSettings.from_dict(dict(document["settings"]))
            reward = (self.folder / "reward_function.py").read_text(encoding="utf-8")
            metadata = ModelMetadata.load(self.folder / "model_metadata.json")
            name, is_foreign = document.get("parent"), foreign or bool(document.get("foreign", False))
        except (ConfigError, KeyError, TypeError, ValueError, OSError) as error:
            raise RunError(f"{self.folder} cannot be opened: {error}") from error
        check_installed("optuna", "racecraft tune")
        parent = None if name is None else open_parent(str(name))
        if parent is not None and parents is not None and parent.folder.path.resolve().parent != parents.resolve():
            raise RunError(f"{self.folder} begins from {parent.name}, which does not lie in {parents}.")
        self.plan = Plan(
            settings=settings,
            reward=reward,
            metadata=metadata,
            hyperparameters=None,  # they are in the settings, where trials change them
            parent=parent,
            foreign=is_foreign,
        )
        self._on_trial = on_trial
        self._stop = threading.Event()
        self._news: queue.SimpleQueue[tuple[Seat, Report | BaseException] | None] = queue.SimpleQueue()

    def run(self, *, minutes: float = 10.0, max_trials: int = 0, processes: int = 1) -> Outcome:
        """Search until the time is up.

        Args:
            minutes: Wall clock of this call; trials under way then are ended, and begun again by the next call.
            max_trials: Trials of this call; 0 sets no limit.
            processes: Trials at once, at most as many as the search's window; 1 trains in this process, 0 takes
                one per core, on a GPU just one. The trials are the same for any number.

        Raises:
            ConfigError: A limit is not allowed.
            RunError: The tuning is in use, its storage is damaged, or the folder takes nothing more.
            CheckpointError: The folder takes nothing more.
            RacecraftError: The very first trial, which is what the user has now, cannot be trained.
        """
        check_limits(minutes=minutes, max_trials=max_trials, processes=processes)
        most = processes or (num_cores() if self.plan.settings.device == "cpu" else 1)
        count = min(most, self.window)
        seats: list[Seat] = [HereSeat()] if count == 1 else [ProcessSeat() for _ in range(count)]
        with exclusive_lock(self.folder / ".lock"), study_of(self.folder):
            record = self._record()
            record.take_up()
            call = _Call(record, seats, deadline=time.monotonic() + 60.0 * minutes, max_trials=max_trials)
            try:
                with interruptible(self._stop, self.stop):
                    self._search(call)
            finally:
                for seat in seats:
                    seat.close()
                for number, _ in call.busy.values():
                    record.tell_cut(number)
            is_interrupted = self._stop.is_set() and not call.is_full
            return self._write(record, is_interrupted=is_interrupted)

    def past(self) -> tuple[TrialOutcome, ...]:
        """The trials so far.

        Raises:
            RunError: The storage is damaged.
        """
        with study_of(self.folder):
            return self._record().trials()

    def seconds(self) -> float:
        """Wall clock of all calls so far.

        Raises:
            RunError: The storage is damaged.
        """
        with study_of(self.folder):
            return self._record().seconds

    def stop(self) -> None:
        """Ask the search to end; trials under way are begun again by the next `run`. Safe from any thread."""
        self._stop.set()
        self._news.put(None)

    # ---- the search

    def _search(self, call: _Call) -> None:
        """Give trials to seats and take what comes of them, until there is nothing more to do."""
        is_told = False
        while True:
            is_over = self._stop.is_set() or call.failure is not None or time.monotonic() >= call.deadline
            if is_over and not is_told:
                is_told = True
                for seat in call.busy:
                    seat.stop()
            while not is_over and (given := call.next_place()) is not None:
                self._begin(call, *given)
            if not call.busy:
                break
            try:
                news = self._news.get(timeout=None if is_told else max(call.deadline - time.monotonic(), 0.0))
            except queue.Empty:
                continue  # the time is up
            if news is not None:
                self._end(call, *news)
        if call.failure is not None:
            raise call.failure

    def _begin(self, call: _Call, seat: Seat, place: int) -> None:
        number, values, bars = call.record.begin(place)
        call.busy[seat] = number, place
        try:
            run = self.plan_of_trial(values).start(root=self.folder, name=name_of(number))
        except RacecraftError as error:
            self._news.put((seat, error))
            return
        order = Order(
            run=str(run.path.resolve()),
            goal=self.goal,
            trial_steps=self.trial_steps,
            bars=bars,
            num_threads=0 if len(call.seats) == 1 else max(1, num_cores() // len(call.seats)),
        )

        def work() -> None:
            outcome: Report | BaseException
            try:
                outcome = seat.run(order)
            except BaseException as error:  # told to who waits for it
                outcome = error
            self._news.put((seat, outcome))

        self._write(call.record)
        threading.Thread(target=work, name=run.name, daemon=True).start()

    def _end(self, call: _Call, seat: Seat, outcome: Report | BaseException) -> None:
        record, (number, place) = call.record, call.busy[seat]
        if isinstance(outcome, RunError | CheckpointError):  # of the folder, whatever a trial's numbers are
            call.failure = outcome
            record.tell_cut(number)
        elif isinstance(outcome, RacecraftError):
            record.tell_failed(number, f"{type(outcome).__name__}: {outcome}")
            if place == 0:
                call.failure = outcome  # what the user has now does not train: nothing to search around
        elif isinstance(outcome, SeatLost):
            record.tell_cut(number, is_lost=not self._stop.is_set() and time.monotonic() < call.deadline)
        elif isinstance(outcome, BaseException):
            record.tell_cut(number)
            call.failure = outcome
        elif outcome.reason == "interrupted":
            record.tell_cut(number, outcome)
        else:
            record.tell(number, outcome)
        del call.busy[seat]
        trial = record.trial(number)
        call.num_settled += trial.state != "out of time"
        now = time.monotonic()
        record.seconds, call.counted = record.seconds + now - call.counted, now
        if self._on_trial is not None:
            self._on_trial(trial)
        self._write(record)

    def plan_of_trial(self, values: Mapping[str, float | int]) -> Plan:
        """What a trial with such numbers is made of.

        Raises:
            RacecraftError: They are not of this search.
        """
        plan, kinds = self.plan, {parameter.name: parameter.kind for parameter in self.space}
        require("numbers", sorted(values), values.keys() <= kinds.keys(), f"those of {', '.join(kinds)}")
        constants = {name: value for name, value in values.items() if kinds[name] == "constant"}
        learning: dict[str, Any] = {name: value for name, value in values.items() if kinds[name] == "hyperparameter"}
        ppo = replace(plan.settings.ppo, **learning)
        ppo = replace(ppo, minibatch_size=min(ppo.minibatch_size, ppo.num_envs * ppo.num_steps))
        until = Until(laps=plan.settings.evaluation_trials if self.goal == "laps" else 0, steps=self.trial_steps)
        return replace(
            plan,
            settings=replace(plan.settings, ppo=ppo, until=until),
            reward=rewrite_constants(plan.reward, constants),
        )

    # ---- the study

    def _record(self) -> Record:
        return Record(self.folder, self.space, seed=self.plan.settings.seed, window=self.window)

    def _write(self, record: Record, *, is_interrupted: bool = False) -> Outcome:
        """The outcome so far, in its file."""
        outcome = Outcome(
            folder=self.folder,
            goal=self.goal,
            space=self.space,
            trials=record.trials(),
            importances=record.importances(),
            is_interrupted=is_interrupted,
        )
        try:
            write_json(self.folder / "result.json", outcome.to_dict())
        except OSError as error:
            raise RunError(f"{self.folder / 'result.json'} cannot be written: {error.strerror or error}.") from error
        return outcome


def check_limits(*, minutes: float, max_trials: int, processes: int) -> None:
    """Refuse what `Tuning.run` would, before there is a search.

    Raises:
        ConfigError: A limit is not allowed.
    """
    check_number("minutes", minutes, 0)
    require("minutes", minutes, 0 < minutes <= 30 * 24 * 60, "a number above 0, up to 43,200")
    check_whole("trials", max_trials, 0, 100_000)
    check_whole("processes", processes, 0, MAX_WINDOW)


@dataclass
class _Call:
    """What one call of `Tuning.run` has under way."""

    record: Record
    seats: list[Seat]
    deadline: float
    max_trials: int
    busy: dict[Seat, tuple[int, int]] = field(default_factory=dict)
    """Number and place of the trial at a seat."""
    num_settled: int = 0
    failure: BaseException | None = None
    counted: float = field(default_factory=time.monotonic)
    """Until when the record has the seconds."""

    @property
    def is_full(self) -> bool:
        """Whether all trials that were wanted have ended."""
        return 0 < self.max_trials <= self.num_settled

    def next_place(self) -> tuple[Seat, int] | None:
        """A free seat and what is to be done there; None when there is no such."""
        free = next((seat for seat in self.seats if seat not in self.busy), None)
        if free is None or (self.max_trials and self.num_settled + len(self.busy) >= self.max_trials):
            return None
        place = self.record.next_place([place for _, place in self.busy.values()])
        return None if place is None else (free, place)
