"""A search for better numbers: trials that are runs, in a study that can be killed and goes on.

    tuning/<name>/tuning.json      what is searched, and everything else a trial needs
                  reward_function.py  model_metadata.json
                  study.sqlite     Optuna's storage
                  trial-0000/ ...  run folders
                  result.json      the outcome so far

Optuna chooses (a tree-structured Parzen estimator, https://papers.nips.cc/paper/4443), a trial trains for at most
so many camera steps, and one whose evaluations lag behind the median of those before it at the same step is ended.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from racecraft.agent import ModelMetadata
from racecraft.checks import check_whole, require
from racecraft.errors import ConfigError, RacecraftError, RunError
from racecraft.extras import needed_for
from racecraft.json_file import read_json_object
from racecraft.run import RunFolder
from racecraft.run.atomic import write_json
from racecraft.run.lock import exclusive_lock
from racecraft.training import EvaluationReport, SilentReporter, TrainResult, Until
from racecraft.training.job import Training
from racecraft.training.parent import open_parent
from racecraft.training.plan import Plan
from racecraft.training.settings import TrainSettings
from racecraft.tuning.constants import rewrite_constants
from racecraft.tuning.outcome import Outcome, TrialOutcome
from racecraft.tuning.space import Parameter

if TYPE_CHECKING:
    import optuna

GOALS: Final = ("laps", "lap_time")
FORMAT: Final = 1
BEGINNERS: Final = 6
"""Trials drawn at random before the estimator has something to go by; the first one is what the user has now."""
_NO_LAP: Final = 1000.0  # s, of a trial that completed no lap


class Tuning:
    """One search, from its folder.

    Args:
        folder: Made by `start_tuning`.
        on_trial: Is told every trial that ended.

    Raises:
        RunError: There is no such folder, its files are not what they were, or the run that trials begin from is gone.
        ConfigError: Optuna is not installed.
    """

    def __init__(self, folder: str | Path, *, on_trial: Callable[[TrialOutcome], None] | None = None) -> None:
        self.folder = Path(folder)
        if not (self.folder / "tuning.json").is_file():
            raise RunError(f"{self.folder} holds no tuning: tuning.json is missing.")
        try:
            document = read_json_object(self.folder / "tuning.json")
            if document["format"] != FORMAT:
                raise RunError(f"{self.folder} was written by another version of Racecraft.", hint="Update Racecraft.")
            self.goal, self.trial_steps = str(document["goal"]), int(document["trial_steps"])
            self.space = tuple(Parameter.from_dict(dict(parameter)) for parameter in document["space"])
            settings = TrainSettings.from_dict(dict(document["settings"]))
            reward = (self.folder / "reward_function.py").read_text(encoding="utf-8")
            metadata = ModelMetadata.load(self.folder / "model_metadata.json")
            parent, foreign = document.get("parent"), bool(document.get("foreign", False))
        except (ConfigError, KeyError, TypeError, ValueError, OSError) as error:
            raise RunError(f"{self.folder} cannot be opened: {error}") from error
        self.plan = Plan(
            settings=settings,
            reward=reward,
            metadata=metadata,
            hyperparameters=None,  # they are in the settings, where trials change them
            parent=None if parent is None else open_parent(str(parent)),
            foreign=foreign,
        )
        self._on_trial = on_trial
        self._optuna = _optuna()
        self._stop = threading.Event()
        self._training: Training | None = None

    def run(self, *, minutes: float = 10.0, max_trials: int = 0) -> Outcome:
        """Search until the time is up.

        Args:
            minutes: Wall clock of this call; a trial under way then is ended, and begun again by the next call.
            max_trials: Trials of this call; 0 sets no limit.

        Raises:
            ConfigError: A limit is not allowed.
            RunError: The tuning is in use, or its storage is damaged.
            RacecraftError: The very first trial, which is what the user has now, cannot be trained.
        """
        require("minutes", minutes, 0 < minutes <= 30 * 24 * 60, "a number above 0, up to 43,200")
        check_whole("trials", max_trials, 0, 100_000)
        with exclusive_lock(self.folder / ".lock"):
            study = self._study()
            self._take_up(study)
            deadline = time.monotonic() + 60.0 * minutes  # however long a storage takes to open
            done, is_interrupted = 0, False
            while time.monotonic() < deadline and not is_interrupted and (not max_trials or done < max_trials):
                if self._stop.is_set():
                    is_interrupted = True
                    break
                is_interrupted = self._trial(study, deadline)
                done += 1
                self._write(self._outcome(study, is_interrupted=is_interrupted))
            outcome = self._outcome(study, is_interrupted=is_interrupted)
            self._write(outcome)
        return outcome

    def past(self) -> tuple[TrialOutcome, ...]:
        """The trials so far.

        Raises:
            RunError: The storage is damaged.
        """
        states = self._optuna.trial.TrialState
        return tuple(self._seen(trial) for trial in self._study().trials if trial.state != states.WAITING)

    def stop(self) -> None:
        """Ask the search to end; the trial under way is begun again by the next `run`. Safe from any thread."""
        self._stop.set()
        training = self._training
        if training is not None:
            training.stop()

    # ---- one trial

    def _trial(self, study: optuna.Study, deadline: float) -> bool:
        """Ask, train, tell; whether the user interrupted it."""
        states = self._optuna.trial.TrialState
        trial = study.ask()
        values = {parameter.name: _suggest(trial, parameter) for parameter in self.space}
        name = f"trial-{trial.number:04d}"
        begun = time.monotonic()
        trial.set_user_attr("run", name)
        judge = _Judge(trial, goal=self.goal)
        try:
            run = self._start(values, name)
            training = Training(run, reporter=judge, is_checked=True)
            judge.training = self._training = training
            if self._stop.is_set():  # between the look and the trial
                training.stop()
            timer = threading.Timer(max(deadline - begun, 0.0), training.stop)
            timer.daemon = True
            timer.start()
            try:
                result = training.run()
            finally:
                timer.cancel()
        except RacecraftError as error:
            trial.set_user_attr("error", f"{type(error).__name__}: {error}")
            study.tell(trial, state=states.FAIL)
            if trial.number == 0:
                raise  # what the user has now does not train: nothing to search around
            result = None
        except BaseException:
            trial.set_user_attr("cut", True)  # the next call begins it again
            study.tell(trial, state=states.FAIL)
            raise
        if result is not None:
            for attribute, value in judge.attributes(result).items():
                trial.set_user_attr(attribute, value)
            trial.set_user_attr("seconds", time.monotonic() - begun)
            if judge.is_pruned:
                study.tell(trial, state=states.PRUNED)
            elif result.reason == "interrupted":
                trial.set_user_attr("cut", True)
                study.tell(trial, state=states.FAIL)
            else:
                study.tell(trial, judge.score(result, self.trial_steps))
        if self._on_trial is not None:
            self._on_trial(self._seen(study.trials[trial.number]))
        is_cut = result is not None and result.reason == "interrupted" and not judge.is_pruned
        return is_cut and time.monotonic() < deadline

    def _start(self, values: dict[str, float | int], name: str) -> RunFolder:
        """The run folder of a trial."""
        plan, kinds = self.plan, {parameter.name: parameter.kind for parameter in self.space}
        constants = {name: value for name, value in values.items() if kinds[name] == "constant"}
        learning: dict[str, Any] = {name: value for name, value in values.items() if kinds[name] == "hyperparameter"}
        ppo = replace(plan.settings.ppo, **learning)
        ppo = replace(ppo, minibatch_size=min(ppo.minibatch_size, ppo.num_envs * ppo.num_steps))
        until = Until(laps=plan.settings.evaluation_trials if self.goal == "laps" else 0, steps=self.trial_steps)
        plan = replace(
            plan,
            settings=replace(plan.settings, ppo=ppo, until=until),
            reward=rewrite_constants(plan.reward, constants),
        )
        return plan.start(root=self.folder, name=name)

    # ---- the study

    def _study(self) -> optuna.Study:
        """The study in the folder's database, made where there is none."""
        library = self._optuna
        file = self.folder / "study.sqlite"
        try:
            storage = library.storages.RDBStorage(f"sqlite:///{file.resolve()}")
            study: optuna.Study = library.create_study(
                study_name="racecraft",
                storage=storage,
                load_if_exists=True,
                direction="minimize",
                pruner=library.pruners.MedianPruner(n_startup_trials=4, n_warmup_steps=1),
            )
        except Exception as error:
            message = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise RunError(f"{file} cannot be used: {message}.", hint="Start a new tuning.") from error
        if not study.trials:
            study.enqueue_trial({parameter.name: parameter.default for parameter in self.space})
        # Drawn anew by each call, or a call would repeat the random trials of the one before.
        seed = self.plan.settings.seed + len(study.trials)
        study.sampler = library.samplers.TPESampler(seed=seed, n_startup_trials=BEGINNERS)
        return study

    def _take_up(self, study: optuna.Study) -> None:
        """Trials that a kill or the end of the time cut are to begin again."""
        states = self._optuna.trial.TrialState
        for trial in study.trials:
            is_killed = trial.state == states.RUNNING
            if is_killed:
                study.tell(trial.number, state=states.FAIL)
            is_cut = is_killed or (trial.state == states.FAIL and trial.user_attrs.get("cut") is True)
            if is_cut and not any(_params(other) == trial.params for other in study.trials[trial.number + 1 :]):
                study.enqueue_trial(trial.params)

    # ---- tell

    def _seen(self, trial: optuna.trial.FrozenTrial) -> TrialOutcome:
        attributes = trial.user_attrs
        state = "out of time" if attributes.get("cut") is True else trial.state.name.lower()
        return TrialOutcome(
            number=trial.number,
            state=state,
            value=trial.value,
            params=dict(trial.params),
            run=str(self.folder / str(attributes.get("run", f"trial-{trial.number:04d}"))),
            completion=attributes.get("completion"),
            best_lap_seconds=attributes.get("best_lap"),
            steps=attributes.get("steps"),
            seconds=attributes.get("seconds"),
            error=str(attributes.get("error", "")),
        )

    def _outcome(self, study: optuna.Study, *, is_interrupted: bool) -> Outcome:
        states = self._optuna.trial.TrialState
        trials = [trial for trial in study.trials if trial.state != states.WAITING]
        return Outcome(
            folder=self.folder,
            goal=self.goal,
            space=self.space,
            trials=tuple(self._seen(trial) for trial in trials),
            importances=_importances(self._optuna, study),
            is_interrupted=is_interrupted,
        )

    def _write(self, outcome: Outcome) -> None:
        try:
            write_json(self.folder / "result.json", outcome.to_dict())
        except OSError as error:
            raise RunError(f"{self.folder / 'result.json'} cannot be written: {error.strerror or error}.") from error


class _Judge(SilentReporter):
    """Follows a trial's evaluations, and ends it when it lags behind."""

    def __init__(self, trial: optuna.Trial, *, goal: str) -> None:
        self.training: Training | None = None
        self.is_pruned = False
        self._trial, self._goal = trial, goal
        self._best = 0.0
        self._count = 0

    def evaluation(self, report: EvaluationReport) -> None:
        """Compare with the trials before at the same evaluation: completion, then the lap time; less is better."""
        self._best = max(self._best, report.completion)
        lap = report.best_lap if self._goal == "lap_time" and report.best_lap is not None else _NO_LAP
        self._trial.report(1.0 - report.completion + lap / _NO_LAP, step=self._count)
        self._count += 1
        if self.training is not None and self._trial.should_prune():
            self.is_pruned = True
            self.training.stop()

    def score(self, result: TrainResult, trial_steps: int) -> float:
        """The trial's value, less is better: camera steps, or seconds."""
        if self._goal == "lap_time":
            if result.best_lap_seconds is not None:
                return result.best_lap_seconds
            return _NO_LAP * (2.0 - self._best)
        return float(result.steps) if result.reason == "laps" else trial_steps * (2.0 - self._best)

    def attributes(self, result: TrainResult) -> dict[str, Any]:
        """What the table shows of a trial."""
        return {"completion": self._best, "best_lap": result.best_lap_seconds, "steps": result.steps}


def _suggest(trial: optuna.Trial, parameter: Parameter) -> float | int:
    if parameter.is_whole:
        return trial.suggest_int(parameter.name, int(parameter.low), int(parameter.high), log=parameter.is_log)
    return trial.suggest_float(parameter.name, parameter.low, parameter.high, log=parameter.is_log)


def _params(trial: optuna.trial.FrozenTrial) -> dict[str, Any]:
    """A trial's numbers, also of one that only waits."""
    return dict(trial.params or trial.system_attrs.get("fixed_params", {}))


def _importances(optuna: Any, study: optuna.Study) -> dict[str, float]:
    """How much each number mattered, adding up to 1; empty while there are too few trials to say."""
    done = [trial for trial in study.trials if trial.value is not None]
    if len(done) < 4 or len({trial.value for trial in done}) < 2:
        return {}
    try:
        found = optuna.importance.get_param_importances(
            study, evaluator=optuna.importance.PedAnovaImportanceEvaluator()
        )
    except (ImportError, ValueError, RuntimeError):
        return {}
    return {name: float(share) for name, share in found.items()}


def _optuna() -> Any:
    with needed_for("racecraft tune"):
        import optuna
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    return optuna
