"""A sweep: runs like all others, and a file that says which belong together.

runs/.sweeps/NAME.json          settings, seeds, goal
runs/NAME-SETTING-SEED/         a run for each setting and seed

`racecraft sweep` trains the runs here, several at once; the console puts
them into its queue. Killed at any moment it goes on, and every run ends in the bits that it would have alone.
"""

from __future__ import annotations

import os
import queue
import shutil
import threading
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from racecraft.checks import check_type, check_whole
from racecraft.errors import ConfigError, RacecraftError, RunError
from racecraft.json_file import read_json_object
from racecraft.run import RunFolder
from racecraft.run.atomic import write_json
from racecraft.run.folder import MAX_NAME, checked_name
from racecraft.run.lock import exclusive_lock
from racecraft.sweeping.board import Board, Outcome, board_of, outcome_of
from racecraft.sweeping.plan import SweepPlan, faults_of
from racecraft.system import num_cores
from racecraft.training.interruption import interruptible
from racecraft.tuning.seats import HereSeat, ProcessSeat, Seat, SeatLost
from racecraft.tuning.trial import Order, Report

FOLDER: Final = ".sweeps"
FORMAT: Final = 1
MAX_LOSSES: Final = 3
"""How often what makes a training may die before it is given up."""
MAX_BYTES: Final = 1 << 22


def sweep_names(runs: Path) -> list[str]:
    """The sweeps of a folder of runs, newest first."""
    ages: dict[str, int] = {}
    for path in sorted((runs / FOLDER).glob("*.json")):
        with suppress(FileNotFoundError):  # removed meanwhile
            ages[path.stem] = path.stat().st_mtime_ns
    return sorted(ages, key=ages.__getitem__, reverse=True)


def make_sweep(plan: SweepPlan, *, runs: str | Path = "runs", name: str | None = None) -> Sweep:
    """Make the runs of a sweep, untrained: all of them, or none.

    Args:
        plan: What is to be trained.
        runs: Folder of the runs.
        name: Of the sweep; by default a new one.

    Raises:
        RacecraftError: The name is taken or too long, or a run cannot be made.
    """
    runs = Path(runs)
    name = checked_name(name) if name is not None else f"sweep-{time.strftime('%Y%m%d-%H%M%S')}"
    file = runs / FOLDER / f"{name}.json"
    longest = max(len(_run(name, setting.name, seed)) for setting in plan.settings for seed in plan.seeds)
    if longest > MAX_NAME:
        raise RunError(f"Runs of the sweep {name!r} would have names of {longest} characters; {MAX_NAME} are allowed.")
    if file.exists():
        raise RunError(f"There is a sweep {name!r} already.", hint="Choose another --name, or go on with --resume.")
    document = {
        "format": FORMAT,
        "goal": plan.goal,
        "seeds": list(plan.seeds),
        "settings": {setting.name: setting.words for setting in plan.settings},
        "notes": list(plan.notes),
    }
    made: list[RunFolder] = []
    try:
        for setting in plan.settings:
            for seed in plan.seeds:
                seeded = replace(setting.plan, settings=replace(setting.plan.settings, seed=seed))
                with faults_of(setting.name):
                    made.append(seeded.start(root=runs, name=_run(name, setting.name, seed)))
        file.parent.mkdir(parents=True, exist_ok=True)
        write_json(file, document)
    except BaseException as error:
        for folder in made:
            shutil.rmtree(folder.path, ignore_errors=True)
        if isinstance(error, OSError):
            raise RunError(f"{file} cannot be written: {error.strerror or error}.") from error
        raise
    return Sweep(runs, name)


class Sweep:
    """A sweep that was made.

    Args:
        runs: Folder of the runs.
        name: Of the sweep.

    Raises:
        RunError: There is none of this name, or its file is not what it was.
    """

    def __init__(self, runs: str | Path, name: str) -> None:
        check_type("name", name, str, "use that of a sweep")
        self.runs, self.name = Path(runs), name
        self.file = self.runs / FOLDER / f"{name}.json"
        if not os.path.isfile(self.file):  # False of names too long for one, too
            raise RunError(f"There is no sweep {name[:80]!r} in {self.runs}.")
        try:
            document = read_json_object(self.file, max_bytes=MAX_BYTES)
            if document["format"] != FORMAT:
                raise RunError(f"{self.file} was written by another version of Racecraft.", hint="Update Racecraft.")
            self.goal, self.seeds = str(document["goal"]), tuple(int(seed) for seed in document["seeds"])
            self.settings: dict[str, dict[str, Any]] = {
                str(setting): dict(words) for setting, words in document["settings"].items()
            }
            self.notes = tuple(str(note) for note in document.get("notes", ()))  # older ones have none
        except (ConfigError, KeyError, TypeError, ValueError, AttributeError) as error:
            raise RunError(f"{self.file} cannot be read: {error}") from error
        self._stop = threading.Event()
        self._seats: list[Seat] = []

    def run_of(self, setting: str, seed: int) -> RunFolder:
        """The run of a setting with a seed, which may have been removed."""
        return RunFolder(self.runs / _run(self.name, setting, seed))

    def names(self) -> Iterator[str]:
        """Its runs, one seed of all settings after the other."""
        for seed in self.seeds:
            for setting in self.settings:
                yield _run(self.name, setting, seed)

    def board(self) -> Board:
        """The leaderboard so far, without runs that are gone or have not begun; of a damaged one it warns."""
        outcomes: dict[str, dict[int, Outcome]] = {}
        for setting in self.settings:
            for seed in self.seeds:
                folder = self.run_of(setting, seed)
                if not (folder.path / "run.json").is_file():
                    continue
                try:
                    outcome = outcome_of(folder)
                except RunError as error:
                    warnings.warn(f"The board is without {folder.name}: {error}", stacklevel=2)
                    continue
                if outcome.steps:
                    outcomes.setdefault(setting, {})[seed] = outcome
        return board_of(self.goal, self.settings, outcomes)

    def train(
        self,
        *,
        processes: int = 0,
        cluster: str = "",
        on_end: Callable[[str, Report | Exception], None] = lambda *_: None,
    ) -> bool:
        """Train all of its runs here, one seed of all settings after the other; whether that was interrupted.

        A run that cannot be trained is told, and the others go on. What was trained before is not trained again.

        Args:
            processes: Trainings at once; 0 takes one per core. The runs are the same for any number.
            cluster: Address of a cluster of Ray that trains instead, see `racecraft.tuning.cluster`.
            on_end: Is told each run that ended, and how.

        Raises:
            ConfigError: The number of processes is not allowed.
            RunError: It is being trained already.
        """
        check_whole("processes", processes, 0, 256)
        names = [name for name in self.names() if (self.runs / name / "run.json").is_file()]
        count = max(1, min(processes or num_cores(), len(names)))
        if cluster:
            from racecraft.tuning.cluster import cluster_seats

            self._seats = cluster_seats(cluster, min(processes or len(names), len(names)))
        else:
            self._seats = [HereSeat()] if count == 1 else [ProcessSeat() for _ in range(count)]
        call = _Call(num_threads=max(1, num_cores() // count), on_end=on_end)
        for name in names:
            call.waiting.put(name)
        lock = exclusive_lock(self.file.with_suffix(".lock"), of=f"Sweep {self.name!r}")
        with lock, interruptible(self._stop, self.stop):
            workers = [threading.Thread(target=self._work, args=(seat, call), daemon=True) for seat in self._seats]
            for worker in workers:
                worker.start()
            try:
                for worker in workers:
                    while worker.is_alive():  # a wait without end would let no signal in on some systems
                        worker.join(0.5)
            finally:
                for seat in self._seats:
                    seat.close()
        if call.failures:
            raise call.failures[0]
        return self._stop.is_set()

    def stop(self) -> None:
        """Ask `train` to end; what is under way is saved. Safe from any thread."""
        self._stop.set()
        for seat in self._seats:
            seat.stop()

    def _work(self, seat: Seat, call: _Call) -> None:
        """Train one waiting run after the other at a seat."""
        try:
            while not self._stop.is_set():
                self._train_next(seat, call)
        except queue.Empty:
            return
        except BaseException as error:  # told to who waits for it
            call.failures.append(error)
            self.stop()

    def _train_next(self, seat: Seat, call: _Call) -> None:
        name = call.waiting.get_nowait()
        order = Order(
            run=str((self.runs / name).resolve()),
            goal="laps",
            trial_steps=1,
            is_checked=False,  # it may have been edited
            num_threads=call.num_threads,
        )
        try:
            call.on_end(name, seat.run(order))
        except SeatLost as error:
            call.losses[name] += 1
            if not self._stop.is_set() and call.losses[name] < MAX_LOSSES:
                call.waiting.put(name)
            elif not self._stop.is_set():
                call.on_end(name, error)
        except RacecraftError as error:
            call.on_end(name, error)


@dataclass
class _Call:
    """What one call of `Sweep.train` has under way."""

    num_threads: int
    """Of each training."""
    on_end: Callable[[str, Report | Exception], None]
    waiting: queue.SimpleQueue[str] = field(default_factory=queue.SimpleQueue)
    """Names of the runs that are not given to a seat."""
    losses: Counter[str] = field(default_factory=Counter)
    """How often what made a run died."""
    failures: list[BaseException] = field(default_factory=list)
    """What ends the whole of it, the first one first."""


def _run(sweep: str, setting: str, seed: int) -> str:
    return f"{sweep}-{setting}-{seed}"
