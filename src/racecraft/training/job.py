"""The training job: environment, learner, run folder and evaluation, tied together.

    while not done:  iterate (PPO) -> every few thousand steps: evaluate -> checkpoint

Given the same settings and seed a run repeats to the bit, for any number of threads: nothing but the limits of
wall clock depends on time. A checkpoint holds all that the next step depends on, cars included, so a
run that was killed and resumed ends in the same weights and logs. (Only what a reward function remembers between
calls, or draws at random, begins anew.)
"""

from __future__ import annotations

import signal
import threading
import time
import warnings
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from types import FrameType

from racecraft.agent import Hyperparameters
from racecraft.errors import CheckpointError, ConfigError, RacecraftError, RewardError, RunError
from racecraft.learn import Algorithm, make_learner
from racecraft.race.policy import NetworkPolicy
from racecraft.reward import RewardWorker, keeps_state
from racecraft.run import (
    AwsLog,
    Checkpoint,
    CheckpointWarning,
    EpisodeCounter,
    EventWriter,
    PrintLog,
    RunFolder,
    SimTraceWriter,
    TrainingMetrics,
    begin_stretch,
    read_stretches,
)
from racecraft.run.history import HistoryWriter
from racecraft.sim import Simulation
from racecraft.track import Track, joint_digest, load_tracks
from racecraft.training.algorithms import make_algorithm, teacher_environment
from racecraft.training.cuda_environment import CudaTrainingEnvironment
from racecraft.training.environment import TrainingEnvironment, open_simulation
from racecraft.training.evaluator import Evaluator
from racecraft.training.meter import Meter
from racecraft.training.opponents import OpponentPool
from racecraft.training.parent import begin_from, is_weights_only
from racecraft.training.progress import Reporter, SilentReporter, TrainResult
from racecraft.training.start import aws_hyperparameters, read_settings, require_trainable, require_valid_reward
from racecraft.training.stop import Until

AWS_EPISODES = 20  # between two trainings at AWS; its metrics and sim-traces are numbered by it


@dataclass(frozen=True, kw_only=True, eq=False)
class _Session:
    """What a training works with while it runs."""

    environment: TrainingEnvironment | CudaTrainingEnvironment
    algorithm: Algorithm
    evaluator: Evaluator
    trace: SimTraceWriter
    metrics: TrainingMetrics
    events: EventWriter
    history: HistoryWriter
    hyperparameters: Hyperparameters | None
    aws_log: AwsLog | None
    opponents: OpponentPool | None

    @property
    def counter(self) -> EpisodeCounter:
        return self.environment.counter


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
    """

    def __init__(
        self,
        folder: RunFolder,
        *,
        until: Until | None = None,
        reporter: Reporter | None = None,
        aws_log: str | Path | None = None,
        started: float | None = None,
        is_checked: bool = False,
    ) -> None:
        self.aws_log = aws_log
        self.folder = folder
        self.is_checked = is_checked
        self.reporter = reporter or SilentReporter()
        settings = read_settings(folder)
        self.settings = settings if until is None else replace(settings, until=until)
        self.meter = Meter(self.settings.until, started=time.monotonic() if started is None else started)
        self._stop = threading.Event()
        self._since = -1  # step that the stretch under way began at

    def run(self) -> TrainResult:
        """Train until a limit is reached or somebody interrupts; the run can always be resumed.

        Raises:
            RacecraftError: Training cannot go on; the last checkpoint is good.
        """
        with self.folder.lock(), self._interruptible():
            try:
                with self._session() as session:
                    reason = self._train(session)
                return self._result(reason, session)
            except RacecraftError as error:
                error.hint = error.hint or self._way_on(error)
                raise
            except KeyboardInterrupt:
                self.reporter.note(f"Stopped at once. Continue with: racecraft train --resume {self.folder.path}")
                raise

    def stop(self) -> None:
        """Ask the training to end after the iteration under way; safe from any thread."""
        self._stop.set()

    # ---- the run, top to bottom

    @contextmanager
    def _session(self) -> Iterator[_Session]:
        """Everything made, and brought to where the last checkpoint was; closed at the end, however that comes."""
        settings, folder = self.settings, self.folder
        metadata = folder.read_model_metadata()
        require_trainable(settings, metadata)
        saved, begun = self._beginning()
        resumed = saved.metadata if saved is not None else {}
        source, is_foreign = folder.read_reward_function(), folder.read_info().foreign

        # The learner's backend takes longest to import, so it starts first, beside everything else.
        with ThreadPoolExecutor(1) as pool:
            spec = settings.network_spec(metadata)
            future = pool.submit(
                make_learner, spec, seed=settings.seed, num_threads=settings.num_threads, device=settings.device
            )
            tracks = self._load_tracks()
            simulation = open_simulation(settings, tracks, metadata.suite)
            if not self.is_checked:
                require_valid_reward(source, tracks[0], foreign=is_foreign)
            learner = future.result()
            if begun is not None:
                begin_from(learner, begun)

        with ExitStack() as stack:
            # A function that remembers something gets a memory for each car: on AWS one process drove one car.
            copies = settings.num_envs if keeps_state(source) else 1
            worker = stack.enter_context(
                RewardWorker(
                    source,
                    list(tracks),
                    seed=settings.seed,
                    num_cars=copies,
                    num_objects=settings.num_objects,
                    foreign=is_foreign,
                )
            )
            kept = saved.step if saved is not None else 0
            stretch = begin_stretch(folder, step=kept)
            self._since = stretch.step
            if kept and stretch.step == kept:
                before = read_stretches(folder)[-2]
                self.reporter.note(f"From here on with other {', '.join(stretch.changes(before))}.".replace("_", " "))
            after = kept if saved is not None else -1
            events = stack.enter_context(EventWriter(folder.events, after_step=after))
            history = stack.enter_context(HistoryWriter(folder.history, step=kept))
            episodes = int(resumed.get("episodes", 0))
            counter = EpisodeCounter(settings.num_envs, number=episodes, clock=float(resumed.get("clock", 0.0)))
            hyperparameters = folder.read_hyperparameters()
            log = None
            if self.aws_log is not None:
                log = stack.enter_context(AwsLog(self.aws_log, steps=kept))
                log.write_settings(
                    world=tracks[0].name,
                    metadata=metadata,
                    hyperparameters=aws_hyperparameters(settings.learning, hyperparameters),
                )
            per_iteration = settings.ppo.episodes_per_iteration or AWS_EPISODES
            trace = SimTraceWriter(
                folder.training_simtrace,
                num_envs=settings.num_envs,
                tracks=list(tracks),
                action_space=metadata.action_space,
                episodes_per_iteration=per_iteration,
                episodes=episodes,
                log=log,
            )
            metrics = TrainingMetrics(
                folder.training_metrics,
                episodes_per_iteration=per_iteration,
                episodes=episodes,
                clock=counter.clock,
            )
            prints = stack.enter_context(PrintLog(folder.reward_log))
            environment: TrainingEnvironment | CudaTrainingEnvironment
            opponents = None
            if isinstance(simulation, Simulation):
                if settings.opponents is not None:
                    own = NetworkPolicy(learner, metadata.action_space, sensors=metadata.suite)
                    opponents = OpponentPool(
                        settings.opponents, simulation, own, seed=settings.seed, num_threads=settings.num_threads
                    )
                environment = TrainingEnvironment(
                    simulation,
                    worker,
                    metadata.action_space,
                    counter=counter,
                    sensors=metadata.suite,
                    trace=trace,
                    prints=prints,
                    opponents=opponents,
                    goes_on=settings.algorithm == "distill" or opponents is not None,
                    tells_place=settings.critic == "lap",
                )
            else:
                environment = CudaTrainingEnvironment(
                    simulation, worker, source, metadata.action_space, counter=counter, note=self.reporter.note
                )

            def open_teacher() -> TrainingEnvironment:
                return teacher_environment(settings, source, tracks, metadata.action_space, stack, foreign=is_foreign)

            session = _Session(
                environment=environment,
                algorithm=make_algorithm(settings, learner, environment, open_teacher=open_teacher),
                evaluator=Evaluator(
                    NetworkPolicy(learner, metadata.action_space, sensors=metadata.suite), tracks, settings
                ),
                trace=trace,
                metrics=metrics,
                events=events,
                history=history,
                hyperparameters=hyperparameters,
                aws_log=log,
                opponents=opponents,
            )
            if saved is not None:
                self._load_state(session, saved)
                forgotten = "; what the reward function remembered begins anew" if copies > 1 else ""
                self.reporter.note(f"Resumed at step {session.algorithm.total_steps:,}{forgotten}.")
            try:
                yield session
            except BaseException:
                with suppress(RunError):  # the first error is the one to tell
                    trace.close()
                    metrics.write()
                raise
            trace.close()
            metrics.write()

    def _train(self, session: _Session) -> str:
        """Train until a limit is reached; its name."""
        algorithm, meter = session.algorithm, self.meter
        meter.begin(steps=algorithm.total_steps)
        self.reporter.begin(session.environment.shown, session.evaluator.policy)
        reason = self._limit_reached(session)
        if reason in ("laps", "lap_time", "seconds", "steps"):
            self.reporter.note(f"The limit of {self.settings.until} was reached before; --until sets another.")
        while not reason:
            stats = algorithm.iterate()
            if session.opponents is not None:
                session.opponents.learn_from(algorithm, step=algorithm.total_steps)
            self._account(session, stats.environment_seconds, stats.policy_seconds, stats.update_seconds)
            for episode in (finished := session.environment.take_finished()):
                session.metrics.add(episode)
            meter.add(finished)
            report = meter.report(stats, episodes=session.counter.number)
            self.reporter.iteration(report)
            session.events.add_scalars(report.scalars(), step=algorithm.total_steps)
            session.history.add_iteration(report.point())
            if session.aws_log is not None:
                session.aws_log.write_policy(
                    surrogate_loss=stats.losses.policy_loss,
                    kl_divergence=stats.losses.approx_kl,
                    entropy=stats.losses.entropy,
                    epoch=self.settings.ppo.update_epochs - 1,
                    learning_rate=self.settings.ppo.learning_rate,
                )
                session.aws_log.flush()

            reason = self._limit_reached(session)
            is_due = algorithm.total_steps - session.evaluator.evaluated_at >= self.settings.evaluate_every
            if (is_due or reason) and reason != "interrupted":  # whoever interrupts does not want to wait
                self._evaluate(session)
                reason = reason or self._limit_reached(session)
            if is_due or reason:
                self._checkpoint(session)
        return reason

    def _limit_reached(self, session: _Session) -> str:
        """Why training is to end now, or an empty string."""
        until, steps, last = self.settings.until, session.algorithm.total_steps, session.evaluator.last
        if last is not None and last.step <= self._since:
            last = None  # what was driven before something changed is no end of what comes after
        if self._stop.is_set():
            return "interrupted"
        if until.laps and last is not None and last.laps_completed >= until.laps:
            return "laps"
        if until.lap_time and last is not None and last.best_lap is not None and last.best_lap <= until.lap_time:
            return "lap_time"
        if until.steps and steps >= until.steps:
            return "steps"
        if until.seconds and self.meter.seconds >= until.seconds:
            return "seconds"
        if session.hyperparameters is not None:
            if session.counter.number >= session.hyperparameters.term_cond_max_episodes:
                return "episodes"
            if self.meter.mean_reward >= session.hyperparameters.term_cond_avg_score:  # never, while it is NaN
                return "score"
        return ""

    def _load_tracks(self) -> tuple[Track, ...]:
        tracks = load_tracks(self.settings.track)
        digest, before = joint_digest(tracks), self.folder.read_info().track_digest
        if digest != before:
            raise ConfigError(
                f"Track {self.settings.track!r} is not the one this run was started on: its digest is "
                f"{digest[:12]}, it was {before[:12]}.",
                hint="Start a new run on the changed track.",
            )
        return tracks

    # ---- evaluate, save, resume

    def _evaluate(self, session: _Session) -> None:
        begun = time.perf_counter()
        evaluator = session.evaluator
        algorithm, counter = session.algorithm, session.counter
        algorithm.prefers_average = evaluator.was_good
        with algorithm.driving():
            trials = evaluator.evaluate(step=algorithm.total_steps, seconds=self.meter.seconds, counter=counter)
        for trial in trials:
            session.metrics.add(trial, phase="evaluation")
        assert evaluator.last is not None
        session.events.add_scalars(evaluator.last.scalars(), step=session.algorithm.total_steps)
        session.history.add("evaluation", evaluator.last.point())
        self.reporter.evaluation(evaluator.last)
        self.meter.parts["evaluation"] += time.perf_counter() - begun

    def _checkpoint(self, session: _Session) -> None:
        """Logs first: what a checkpoint counts is then on disk, whatever happens in between."""
        begun = time.perf_counter()
        algorithm, evaluator, counter = session.algorithm, session.evaluator, session.counter
        session.trace.flush()
        session.metrics.write()
        last = evaluator.last
        is_judged = last is not None and last.step == algorithm.total_steps
        lap = last.best_lap if last is not None else None
        self.folder.checkpoints.save(
            algorithm.total_steps,
            {
                **algorithm.state(),
                **session.trace.state(),
                **(session.opponents.state() if session.opponents is not None else {}),
                "simulation": session.environment.simulation.save(),
                "episode_rewards": counter.rewards,
                "recent_episodes": self.meter.state(),
            },
            metadata={
                "network": asdict(algorithm.spec),
                "episodes": counter.number,
                "clock": counter.clock,
                "seconds": self.meter.seconds,
                "evaluator": evaluator.state(),
            },
            metrics={
                "completion": last.completion,
                "laps": last.laps_completed,
                "best_lap_s": float("nan") if lap is None else lap,
            }
            if last is not None and is_judged
            else {},
            score=evaluator.score if is_judged else None,
        )
        self.meter.parts["checkpoint"] += time.perf_counter() - begun

    def _last_checkpoint(self) -> Checkpoint | None:
        """Where to continue; a damaged checkpoint is passed over with a note."""
        store = self.folder.checkpoints
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", CheckpointWarning)
            saved = store.load("last") if store.entries() else None
        for text in dict.fromkeys(str(warning.message) for warning in caught):
            self.reporter.note(text)
        return saved

    def _beginning(self) -> tuple[Checkpoint | None, Checkpoint | None]:
        """The checkpoint to resume from, or else the weights to begin with: imported ones, or a parent's."""
        saved = self._last_checkpoint()
        if saved is None and self.folder.read_info().parent is not None:
            return None, self.folder.parent_checkpoint.load()
        return (None, saved) if saved is not None and is_weights_only(saved) else (saved, None)

    def _load_state(self, session: _Session, saved: Checkpoint) -> None:
        arrays, metadata = saved.arrays, saved.metadata
        try:
            session.algorithm.load_state(arrays)
            session.environment.simulation.load(arrays["simulation"])
            session.counter.rewards[:] = arrays["episode_rewards"]
            if session.opponents is not None:
                session.opponents.load_state(arrays)
            session.trace.load_state(arrays)
            session.evaluator.load_state(metadata["evaluator"])
            session.algorithm.prefers_average = session.evaluator.was_good
            self.meter.load_state(arrays["recent_episodes"], seconds=float(metadata["seconds"]))
        except RacecraftError:
            raise
        except (KeyError, TypeError, ValueError) as error:
            raise CheckpointError(f"{saved.path} cannot be resumed: {error!r}.") from error

    def _way_on(self, error: RacecraftError) -> str:
        """What to do after an error, as a hint."""
        resume = f"racecraft train --resume {self.folder.path}"
        repair = f"Correct {self.folder.reward_function}, then: " if isinstance(error, RewardError) else ""
        with warnings.catch_warnings(), suppress(CheckpointError):
            warnings.simplefilter("ignore", CheckpointWarning)
            if self.folder.checkpoints.last is not None:
                return f"The last checkpoint is good. {repair}{resume}"
        return f"{repair}{resume}" if repair else ""

    # ---- tell

    def _account(
        self, session: _Session, environment_seconds: float, policy_seconds: float, update_seconds: float
    ) -> None:
        environment, parts = session.environment, self.meter.parts
        reward, log = environment.reward_seconds, environment.trace_seconds
        environment.reward_seconds = environment.trace_seconds = 0.0
        parts["simulator"] += environment_seconds - reward - log
        parts["reward"] += reward
        parts["log"] += log
        parts["policy"] += policy_seconds
        parts["learner"] += update_seconds

    def _result(self, reason: str, session: _Session) -> TrainResult:
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

    @contextmanager
    def _interruptible(self) -> Iterator[None]:
        """Turn the first Ctrl-C or SIGTERM into a clean end; a second Ctrl-C interrupts at once."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return

        def handle(number: int, frame: FrameType | None) -> None:
            if self._stop.is_set() and number == signal.SIGINT:
                raise KeyboardInterrupt
            self._stop.set()
            # The signal may have come in the middle of a line that this thread is printing.
            text = "Stopping after this iteration; a checkpoint is saved. Ctrl-C again stops at once."
            threading.Thread(target=self.reporter.note, args=(text,), daemon=True).start()

        before = {number: signal.signal(number, handle) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)
