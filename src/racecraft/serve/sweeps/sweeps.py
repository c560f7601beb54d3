"""The sweeps of a console: models like all others, trained by the queue, and read together."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, Literal

from racecraft.errors import ConfigError, RunError
from racecraft.reward import load_preset, preset_names
from racecraft.run import RunFolder
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.models.garage import Garage
from racecraft.serve.models.mirror import Mirror
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.store.tables import Job
from racecraft.serve.sweeps.schemas import NewSweep, SweepCard, SweepDetail, SweepPlace, SweepRun
from racecraft.serve.tracks.courses import Courses
from racecraft.sim.randomization import PRESETS as RANDOMIZATIONS
from racecraft.sim.vehicle import PRESETS as VEHICLES

if TYPE_CHECKING:  # a console's start does without
    from racecraft.sweeping import Sweep

State = Literal["waiting", "queued", "running", "done", "stopped", "failed"]
MAX_RUNS: Final = 200
"""Trainings of one sweep."""
MAX_SWEEPS: Final = 200
NAMED: Final[dict[str, tuple[str, ...]]] = {"vehicle": tuple(VEHICLES), "randomize": tuple(RANDOMIZATIONS)}
"""Words that are files on the command line, and what they may be here."""
FILES: Final = ("model_metadata", "hyperparameters", "from")
"""Words that are nothing but files."""


class Sweeps:
    """Somebody's sweeps.

    Args:
        queue: Of jobs.
        garage: Of models.
        courses: Of tracks.
        mirror: Has the object store hold what a training needs.
        see: Is given each training's job before somebody hears of it.
    """

    def __init__(
        self, queue: JobQueue, garage: Garage, courses: Courses, *, mirror: Mirror, see: Callable[[Job], Job]
    ) -> None:
        self._queue, self._garage, self._courses = queue, garage, courses
        self._mirror, self._see = mirror, see

    def start(self, request: NewSweep, *, allow: Callable[[int], None]) -> SweepDetail:
        """Make the models of a sweep and queue their trainings.

        Args:
            request: What is asked for.
            allow: Is told how many models and trainings that is before there is any, and may refuse it.

        Raises:
            RacecraftError: It is none, or a setting cannot be trained.
            Conflict: There are too many, or the name is taken.
        """
        from racecraft.sweeping import make_sweep, read_sweep, sweep_names

        runs, names = self._garage.runs, sweep_names(self._garage.runs)
        if request.name in names:
            raise Conflict(f"There is a sweep {request.name!r} already.", hint="Choose another name.")
        if len(names) >= MAX_SWEEPS:
            raise Conflict(f"There are {MAX_SWEEPS} sweeps already.", hint="Delete some first.")
        plan = read_sweep(request.text, resolve=self._resolve, load=self._load)
        if len(plan.settings) * len(plan.seeds) > MAX_RUNS:
            raise ConfigError(f"A sweep has at most {MAX_RUNS} trainings here.", hint="Take fewer settings or seeds.")
        allow(len(plan.settings) * len(plan.seeds))
        sweep = make_sweep(plan, runs=runs, name=request.name)
        self._queue_trainings(sweep)
        return self.get(request.name)

    def go_on(self, name: str, *, allow: Callable[[int], None]) -> SweepDetail:
        """Queue what is neither under way nor done, of which `allow` is told how much it is."""
        sweep = self._sweep(name)
        if left := self._left(sweep):
            allow(len(left))
        self._queue_trainings(sweep)
        return self.get(name)

    def stop(self, name: str) -> SweepDetail:
        """End what is under way; it is saved."""
        for model, job in self._jobs(self._sweep(name)).items():
            if self._state(model, job) in ("queued", "running"):
                active = self._queue.active(model)
                if active is not None:
                    self._queue.cancel(active.id)
        return self.get(name)

    def remove(self, name: str) -> None:
        """Forget that the models belong together; they stay."""
        self._sweep(name).file.unlink(missing_ok=True)

    def cards(self) -> list[SweepCard]:
        """All of them, newest first; a damaged one is left out."""
        from racecraft.sweeping import Sweep, sweep_names

        found = []
        for name in sweep_names(self._garage.runs):
            try:
                sweep = Sweep(self._garage.runs, name)
            except RunError:
                continue
            found.append(self._card(sweep, self._jobs(sweep)))
        return found

    def get(self, name: str) -> SweepDetail:
        """A sweep with its leaderboard.

        Raises:
            NotFound: There is none of this name.
        """
        sweep = self._sweep(name)
        jobs = self._jobs(sweep)
        runs = []
        for setting in sweep.settings:
            for seed in sweep.seeds:
                model = sweep.run_of(setting, seed).name
                if model in jobs:
                    job = jobs[model]
                    machine = job.machine if job is not None and job.travels else ""
                    runs.append(
                        SweepRun(
                            model=model, setting=setting, seed=seed, state=self._state(model, job), machine=machine
                        )
                    )
        places = [SweepPlace.model_validate(place) for place in sweep.board().to_dict()["places"]]
        return SweepDetail(**self._card(sweep, jobs).model_dump(), places=places, runs=runs, notes=list(sweep.notes))

    def _sweep(self, name: str) -> Sweep:
        from racecraft.sweeping import Sweep, sweep_names

        if name not in sweep_names(self._garage.runs):
            raise NotFound(f"There is no sweep {name[:80]!r}.")
        return Sweep(self._garage.runs, name)

    def _jobs(self, sweep: Sweep) -> dict[str, Job | None]:
        """The newest training of each of its models that is still there."""
        there = [name for name in sweep.names() if (self._garage.runs / name / "run.json").is_file()]
        newest = self._queue.newest("train", there)
        return {name: self._see(newest[name]) if name in newest else None for name in there}

    def _queue_trainings(self, sweep: Sweep) -> None:
        for model in self._left(sweep):
            cargo = self._mirror.share_training(RunFolder(self._garage.runs / model))
            self._queue.add("train", model, {"until": None}, cargo=cargo)

    def _left(self, sweep: Sweep) -> list[str]:
        """What is neither under way nor done."""
        jobs = self._jobs(sweep)
        return [model for model, job in jobs.items() if self._state(model, job) not in ("queued", "running", "done")]

    def _resolve(self, word: str, value: Any) -> Any:
        """What is meant by a word of the file; files of the server's machine are nobody's business."""
        if word in FILES:
            raise ConfigError(f"{word} names a file, which only 'racecraft sweep' reads.", hint="Leave it out here.")
        if word == "track":
            return self._courses.path_or_name(str(value))
        if word in NAMED and value not in NAMED[word]:
            raise ConfigError(f"{word} is {str(value)[:40]!r}; allowed are {', '.join(NAMED[word])}.")
        return value

    def _load(self, name: str) -> tuple[str, bool]:
        """The reward function of a preset or of a model, and whether it is somebody else's."""
        source = load_preset(name) if name in preset_names() else self._garage.folder(name).read_reward_function()
        return source, self._garage.is_foreign(source)

    def _state(self, model: str, job: Job | None) -> State:
        """Of a training; without a job it was trained by the command line, or not yet."""
        if job is None:
            return "waiting" if RunFolder(self._garage.runs / model).checkpoints.last is None else "done"
        if job.state == "done":
            return "stopped" if (job.result or {}).get("reason") == "interrupted" else "done"
        states: dict[str, State] = {"queued": "queued", "running": "running", "failed": "failed"}
        return states.get(job.state, "stopped")

    def _card(self, sweep: Sweep, jobs: dict[str, Job | None]) -> SweepCard:
        states = [self._state(model, job) for model, job in jobs.items()]
        return SweepCard(
            name=sweep.name,
            goal="lap_time" if sweep.goal == "lap_time" else "laps",
            settings=len(sweep.settings),
            seeds=len(sweep.seeds),
            done=states.count("done"),
            under_way=states.count("queued") + states.count("running"),
        )
