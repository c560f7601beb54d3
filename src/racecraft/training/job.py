"""The training job: what `session` has made, driven until a limit is reached.

    while not done:  iterate (PPO) -> every few thousand steps: evaluate -> checkpoint

Given the same settings and seed a run repeats to the bit, for any number of threads: nothing but the limits of
wall clock depends on time. A checkpoint holds all that the next step depends on, cars included, so a
run that was killed and resumed ends in the same weights and logs. (Only what a reward function remembers between
calls, or draws at random, begins anew.)
"""

from __future__ import annotations

import threading
import time
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from racecraft.agent import ModelMetadata
from racecraft.checks import check_path, is_number, require, shown
from racecraft.errors import CheckpointError, ConfigError, RacecraftError, RewardError, typed
from racecraft.learn import Algorithm, Distill, IterationStats
from racecraft.run import CheckpointWarning, RunFolder
from racecraft.scoped_warnings import scoped_warnings
from racecraft.training.interruption import interruptible
from racecraft.training.meter import Meter
from racecraft.training.parent import WEIGHTS
from racecraft.training.progress import Reporter, SilentReporter, TrainResult
from racecraft.training.session import Session, open_session
from racecraft.training.start import read_settings
from racecraft.training.stop import Until


def check_listeners(reporter: Reporter | None, aws_log: str | Path | None, started: float | None) -> None:
    """Refuse what cannot be told how a training goes, and a beginning that is no time.

    Raises:
        ConfigError: It cannot; the arguments are those of `racecraft.train`.
    """
    told = [name for name, method in vars(Reporter).items() if not name.startswith("_") and callable(method)]
    if reporter is not None and not all(callable(getattr(reporter, name, None)) for name in told):
        advice = f"use an object with the methods {', '.join(told)}, such as a racecraft.training.SilentReporter()"
        raise ConfigError(f"reporter is {shown(reporter)}; {advice}.")
    if aws_log is not None:
        check_path("aws_log", aws_log, "use a file's path, or '-'")
    if started is not None:
        require("started", started, is_number(started), "a time of time.monotonic(), in seconds")


class Training:
    """One run being trained, from its folder: fresh, or from its last checkpoint.

    Args:
        folder: The run.
        until: When to stop; by default what the run was started with.
        reporter: Is told how it goes.
        aws_log: File for the log lines that AWS's tools read, ``-`` for stdout; none without it.
        started: When this training began, in `time.monotonic()` seconds; a command gives its process's start.
        is_checked: The reward function has just been checked and tried; otherwise that comes first, as the user may
            have edited it, or the run was imported.
        metadata: What the folder's file says, where that is known; it takes pydantic, a sixth of a start, to read it.
    """

    looks_on = False
    """Whether a lap of a car alone is driven between evaluations, too, for the film of how it learned."""

    def __init__(
        self,
        folder: RunFolder,
        *,
        until: Until | None = None,
        reporter: Reporter | None = None,
        aws_log: str | Path | None = None,
        started: float | None = None,
        is_checked: bool = False,
        metadata: ModelMetadata | None = None,
    ) -> None:
        self.aws_log = aws_log
        self.folder = folder
        self.is_checked = is_checked
        self.metadata = metadata
        self.reporter = reporter or SilentReporter()
        settings = read_settings(folder)
        self.settings = settings if until is None else replace(settings, until=until)
        self.meter = Meter(self.settings.until, started=time.monotonic() if started is None else started)
        self._stop = threading.Event()

    def run(self) -> TrainResult:
        """Train until a limit is reached or somebody interrupts; the run can always be resumed.

        Raises:
            RacecraftError: Training cannot go on; the last checkpoint is good.
        """
        with self.folder.lock(), interruptible(self._stop, self._end_soon):
            try:
                with open_session(
                    self.folder,
                    self.settings,
                    self.meter,
                    aws_log=self.aws_log,
                    is_checked=self.is_checked,
                    metadata=self.metadata,
                    note=self.reporter.note,
                    on_step=self.reporter.step,
                ) as session:
                    reason = self._train(session)
                return self._result(reason, session)
            except RacecraftError as error:
                if not error.hint or isinstance(error, RewardError):  # of which a hint says why, not how to go on
                    error.hint = " ".join(filter(None, (error.hint, self.way_on(error))))
                raise
            except KeyboardInterrupt:
                self.reporter.note(
                    f"Stopped at once. Continue with: racecraft train --resume {typed(self.folder.path)}"
                )
                raise

    def stop(self) -> None:
        """Ask the training to end after the iteration under way; safe from any thread."""
        self._stop.set()

    # ---- the run, top to bottom

    def _train(self, session: Session) -> str:
        """Train until a limit is reached; its name."""
        algorithm, meter = session.algorithm, self.meter
        meter.begin(steps=algorithm.total_steps)
        self.reporter.begin(session.environment.shown, session.evaluator.policy)
        reason = self._limit_reached(session)
        if reason in ("laps", "lap_time", "no_better_lap", "seconds", "steps"):
            self.reporter.note(f"The limit of {self.settings.until} was reached before; --until sets another.")
        if session.begun is not None and not reason:
            self._judge_beginning(session, session.begun)
        while not reason:
            stats = algorithm.iterate()
            if session.opponents is not None:
                session.opponents.learn_from(algorithm, step=algorithm.total_steps)
            self._account(session, stats.environment_seconds, stats.policy_seconds, stats.update_seconds)
            for episode in (finished := session.environment.take_finished()):
                session.logs.metrics.add(episode)
            meter.add(finished)
            report = meter.report(stats, episodes=session.logs.counter.number, taught=_taught(algorithm, stats))
            self.reporter.iteration(report)
            session.logs.events.add_scalars(report.scalars(), step=algorithm.total_steps)
            session.logs.history.add_iteration(report.point())
            if session.logs.aws is not None:
                session.logs.aws.write_policy(
                    surrogate_loss=stats.losses.policy_loss,
                    kl_divergence=stats.losses.approx_kl,
                    entropy=stats.losses.entropy,
                    epoch=self.settings.ppo.update_epochs - 1,
                    learning_rate=self.settings.ppo.learning_rate,
                )
                session.logs.aws.flush()

            reason = self._limit_reached(session)
            is_due = algorithm.total_steps - session.evaluator.evaluated_at >= self.settings.evaluate_every
            if (is_due or reason) and reason != "interrupted":  # whoever interrupts does not want to wait
                self._evaluate(session)
                reason = reason or self._limit_reached(session)
            elif self.looks_on and not reason:
                self._look(session)
            if is_due or reason:
                self._checkpoint(session)
        return reason

    def _limit_reached(self, session: Session) -> str:
        """Why training is to end now, or an empty string."""
        until, steps, last = self.settings.until, session.algorithm.total_steps, session.evaluator.last
        if last is not None and last.step <= session.since:
            last = None  # what was driven before something changed is no end of what comes after
        if self._stop.is_set():
            return "interrupted"
        has_settled = session.evaluator.has_settled
        if reached := until.reached(steps=steps, seconds=self.meter.seconds, last=last, has_settled=has_settled):
            return reached
        if session.hyperparameters is not None:
            if session.logs.counter.number >= session.hyperparameters.term_cond_max_episodes:
                return "episodes"
            if self.meter.mean_reward >= session.hyperparameters.term_cond_avg_score:  # never, while it is NaN
                return "score"
        return ""

    # ---- evaluate and save

    def _evaluate(self, session: Session) -> None:
        begun = time.perf_counter()
        evaluator = session.evaluator
        algorithm, counter = session.algorithm, session.logs.counter
        algorithm.prefers_average = evaluator.was_good
        with algorithm.driving():
            trials = evaluator.evaluate(step=algorithm.total_steps, seconds=self.meter.seconds, counter=counter)
        for trial in trials:
            session.logs.metrics.add(trial, phase="evaluation")
        assert evaluator.last is not None
        session.logs.events.add_scalars(evaluator.last.scalars(), step=session.algorithm.total_steps)
        session.logs.history.add("evaluation", evaluator.last.point())
        self._keep_drive(session)
        self.reporter.evaluation(evaluator.last)
        self.meter.parts["evaluation"] += time.perf_counter() - begun

    def _judge_beginning(self, session: Session, origin: dict[str, Any]) -> None:
        """Weights from elsewhere are a checkpoint like those that come of them: the best may be it."""
        learner = session.evaluator.policy.learner
        arrays = {f"{WEIGHTS}{name}": array for name, array in learner.weights().items()}
        self._evaluate(session)
        self._save(session, arrays, {"network": asdict(session.algorithm.spec), "origin": origin})

    def _look(self, session: Session) -> None:
        begun = time.perf_counter()
        with session.algorithm.driving():
            session.evaluator.look(session.algorithm.total_steps)
        self._keep_drive(session)
        self.meter.parts["evaluation"] += time.perf_counter() - begun

    def _keep_drive(self, session: Session) -> None:
        if session.evaluator.drive is not None:
            session.logs.evolution.add("lap", session.evaluator.drive.point())

    def _checkpoint(self, session: Session) -> None:
        """Logs first: what a checkpoint counts is then on disk, whatever happens in between."""
        begun = time.perf_counter()
        session.logs.trace.flush()
        session.logs.metrics.write()
        self._save(session, session.state(), session.metadata())
        self.meter.parts["checkpoint"] += time.perf_counter() - begun

    def _save(self, session: Session, arrays: dict[str, Any], metadata: dict[str, Any]) -> None:
        """A checkpoint with the evaluation of the same step, where there was one."""
        algorithm, evaluator = session.algorithm, session.evaluator
        last = evaluator.last
        is_judged = last is not None and last.step == algorithm.total_steps
        lap = last.best_lap if last is not None else None
        self.folder.checkpoints.save(
            algorithm.total_steps,
            arrays,
            metadata=metadata,
            metrics={
                "completion": last.completion,
                "laps": last.laps_completed,
                "best_lap_s": float("nan") if lap is None else lap,
            }
            if last is not None and is_judged
            else {},
            score=evaluator.rank if is_judged else None,
        )

    def way_on(self, error: RacecraftError) -> str:
        """What to do after an error, as a hint for the command line; who trains otherwise says something else."""
        resume = f"racecraft train --resume {typed(self.folder.path)}"
        repair = f"Correct {self.folder.reward_function}, then: " if isinstance(error, RewardError) else ""
        with scoped_warnings("ignore", CheckpointWarning), suppress(CheckpointError):
            if self.folder.checkpoints.last is not None:
                return f"The last checkpoint is good. {repair}{resume}"
        return f"{repair}{resume}" if repair else ""

    # ---- tell

    def _account(
        self, session: Session, environment_seconds: float, policy_seconds: float, update_seconds: float
    ) -> None:
        environment, parts = session.environment, self.meter.parts
        reward, log = environment.reward_seconds, environment.trace_seconds
        environment.reward_seconds = environment.trace_seconds = 0.0
        parts["simulator"] += environment_seconds - reward - log
        parts["reward"] += reward
        parts["log"] += log
        parts["policy"] += policy_seconds
        parts["learner"] += update_seconds

    def _result(self, reason: str, session: Session) -> TrainResult:
        last = session.evaluator.last
        return TrainResult(
            run=self.folder.path,
            reason=reason,
            wall_seconds=time.monotonic() - self.meter.started,
            steps=session.algorithm.total_steps,
            laps_completed=last.laps_completed if last is not None else 0,
            evaluation_trials=self.settings.evaluation_trials,
            best_lap_seconds=session.evaluator.best_lap,
            parts=self.meter.parts,
        )

    def _end_soon(self) -> None:
        """What the first Ctrl-C asks for."""
        self._stop.set()
        # The signal may have come in the middle of a line that this thread is printing.
        text = "Stopping after this iteration; a checkpoint is saved. Ctrl-C again stops at once."
        threading.Thread(target=self.reporter.note, args=(text,), daemon=True).start()


def _taught(algorithm: Algorithm, stats: IterationStats) -> tuple[int, int] | None:
    """Where an iteration was a teacher's, its steps so far, and how many it is to have."""
    if not isinstance(algorithm, Distill) or stats.num_steps:
        return None
    return algorithm.teacher.total_steps, algorithm.config.teacher_steps
