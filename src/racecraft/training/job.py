"""The training job: environment, learner, run folder and evaluation, tied together.

    while not done:  iterate (PPO) -> every few thousand steps: evaluate -> checkpoint

Given the same settings, seed and number of threads a run repeats exactly on the same machine: nothing but the
limits of wall clock depends on time. A checkpoint holds all that the next step depends on, cars included.
"""

from __future__ import annotations

import signal
import threading
import time
from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft.agent import Hyperparameters, ModelMetadata, check_simulated
from racecraft.errors import CheckpointError, ConfigError, RacecraftError
from racecraft.learn import PPO, Learner, make_learner
from racecraft.race.evaluation import completion, trial_simulation
from racecraft.race.policy import NetworkPolicy
from racecraft.race.rules import RULE_SETS
from racecraft.reward import RewardWorker, dry_run, keeps_state, validate_reward
from racecraft.run import (
    Episode,
    EpisodeCounter,
    EventWriter,
    RunFolder,
    RunInfo,
    SimTraceWriter,
    TrainingMetrics,
)
from racecraft.run.training_params import TrainingParams
from racecraft.sim import CONTROL_DT, Simulation
from racecraft.track import Track, load_track
from racecraft.training.environment import TrainingEnvironment
from racecraft.training.progress import (
    EvaluationReport,
    IterationReport,
    Reporter,
    SilentReporter,
    TrainResult,
)
from racecraft.training.settings import TrainSettings
from racecraft.training.stop import Until

RECENT_EPISODES = 100  # that training's own curves average over
SLOWEST_EVALUATED = 0.3  # m/s; an evaluation does not wait for a car that needs longer for its lap
EVALUATION_SEED = 0x6576616C  # evaluation starts never coincide with training's


def start_run(
    settings: TrainSettings,
    *,
    reward: str,
    metadata: ModelMetadata,
    hyperparameters: Hyperparameters | None = None,
    root: str | Path = "runs",
    name: str | None = None,
) -> RunFolder:
    """Make a run folder that `Training` can train: everything checked, nothing trained yet.

    Args:
        settings: How to train.
        reward: Source of the reward function.
        metadata: Action space, sensors, network.
        hyperparameters: AWS's, when the run follows them.
        root: Where runs lie.
        name: Name of the run; by default a new one.

    Raises:
        RewardError: The reward function has a mistake that can be seen before training.
        ConfigError: A setting is not allowed, or two do not go together.
        TrackNotFound: No such track.
    """
    check_simulated(metadata.sensors)
    if metadata.training_algorithm != "clipped_ppo":
        raise ConfigError(
            f"training_algorithm is {metadata.training_algorithm!r}; this version trains 'clipped_ppo' only."
        )
    track = load_track(settings.track)
    _require_valid(reward, track)
    folder = RunFolder.create(root, name=name, prefix=track.name)
    folder.write_inputs(
        reward_function=reward,
        model_metadata=metadata,
        hyperparameters=hyperparameters,
        training_params=TrainingParams(
            world_name=track.name,
            reverse_dir=settings.direction == "reverse",
            alternate_driving_direction=settings.direction == "alternate",
            change_start_position=settings.start.mode != "fixed",
            round_robin_advance_dist=settings.start.advance,
            start_position_offset=settings.start.offset % 1.0,
            min_eval_trials=settings.evaluation_trials,
        ),
    )
    document = settings.to_dict()
    document.pop("seed")
    document.pop("track")
    folder.write_info(RunInfo(seed=settings.seed, track=settings.track, track_digest=track.digest, settings=document))
    return folder


def read_settings(folder: RunFolder) -> TrainSettings:
    """The settings a run was started with."""
    info = folder.read_info()
    return TrainSettings.from_dict({**info.settings, "seed": info.seed, "track": info.track})


class Training:
    """One run being trained, from its folder: fresh, or from its last checkpoint.

    Args:
        folder: The run.
        until: When to stop; by default what the run was started with.
        reporter: Is told how it goes.
        started: When this training began, in `time.monotonic()` seconds; a command gives its process's start.
    """

    def __init__(
        self,
        folder: RunFolder,
        *,
        until: Until | None = None,
        reporter: Reporter | None = None,
        started: float | None = None,
    ) -> None:
        self.folder = folder
        self.reporter = reporter or SilentReporter()
        self.started = time.monotonic() if started is None else started
        self.settings = read_settings(folder)
        self.until = until or self.settings.until
        self.parts = dict.fromkeys(
            ("start", "simulator", "reward", "log", "policy", "learner", "evaluation", "checkpoint"), 0.0
        )
        self._stop = threading.Event()
        self._recent: deque[Episode] = deque(maxlen=RECENT_EPISODES)
        self._last: EvaluationReport | None = None
        self._best_score: tuple[float, ...] | None = None
        self._best_lap: float | None = None
        self._seconds_before = 0.0  # wall clock of earlier sessions of a resumed run
        self._evaluated_at = 0
        self._rules = RULE_SETS["first_lap"]
        self._patience = 0.0  # simulated seconds after which an evaluation stops a slow car
        self._pace: deque[tuple[float, int]] = deque(maxlen=20)

    def run(self) -> TrainResult:
        """Train until a limit is reached or somebody interrupts; the run can always be resumed.

        Raises:
            RacecraftError: Training cannot go on; the last checkpoint is good.
        """
        with self.folder.lock(), self._interruptible():
            try:
                return self._run()
            except RacecraftError as error:
                if not error.hint and self.folder.checkpoints.last is not None:
                    error.hint = f"The last checkpoint is good: racecraft train --resume {self.folder.path}"
                raise

    def stop(self) -> None:
        """Ask the training to end after the iteration under way; safe from any thread."""
        self._stop.set()

    # ---- the run, top to bottom

    def _run(self) -> TrainResult:
        settings, folder = self.settings, self.folder
        metadata = folder.read_model_metadata()
        saved = folder.checkpoints.load("last") if folder.checkpoints.last is not None else None
        resumed = saved.metadata if saved is not None else {}

        # The learner's backend takes longest to import, so it starts first, beside everything else.
        with ThreadPoolExecutor(1) as pool:
            spec = settings.network_spec(metadata)
            future = pool.submit(make_learner, spec, seed=settings.seed, num_threads=settings.num_threads)
            track = self._load_track()
            simulation = self._simulation(track, metadata)
            source = folder.read_reward_function()
            _require_valid(source, track)
            learner: Learner = future.result()

        # A function that remembers something gets a memory for each car: on AWS one process drove one car.
        copies = settings.ppo.num_envs if keeps_state(source) else 1
        episodes = int(resumed.get("episodes", 0))
        with (
            RewardWorker(source, [track], seed=settings.seed, num_cars=copies) as worker,
            EventWriter(folder.events) as events,
        ):
            counter = EpisodeCounter(settings.ppo.num_envs, number=episodes, clock=float(resumed.get("clock", 0.0)))
            trace = SimTraceWriter(
                folder.training_simtrace,
                num_envs=settings.ppo.num_envs,
                tracks=[track],
                action_space=metadata.action_space,
                iteration=int(resumed.get("trace_iteration", 0)),
            )
            metrics = TrainingMetrics(
                folder.training_metrics,
                episodes_per_iteration=settings.ppo.episodes_per_iteration or 20,
                episodes=episodes,
            )
            environment = TrainingEnvironment(simulation, worker, metadata.action_space, counter=counter, trace=trace)
            ppo = PPO(settings.ppo, learner, environment, seed=settings.seed)
            self._patience = track.length / SLOWEST_EVALUATED
            self._rules = replace(
                RULE_SETS["first_lap"], direction="reverse" if settings.direction == "reverse" else "forward"
            )
            trials = trial_simulation(
                track,
                rules=self._rules,
                num_trials=settings.evaluation_trials,
                vehicle=settings.vehicle,
                num_threads=settings.num_threads,
            )
            policy = NetworkPolicy(learner, metadata.action_space)
            if saved is not None:
                self._resume(saved.arrays, resumed, ppo, simulation)
            hyperparameters = folder.read_hyperparameters()
            self.parts["start"] = time.monotonic() - self.started

            reason = self._limit_reached(ppo, counter, hyperparameters)
            while not reason:
                stats = ppo.iterate()
                self._account(stats.environment_seconds, stats.policy_seconds, stats.update_seconds, environment)
                for episode in environment.take_finished():
                    self._recent.append(episode)
                    metrics.add(episode)
                report = self._iteration_report(stats, counter)
                self.reporter.iteration(report)
                _write_iteration(events, report)

                reason = self._limit_reached(ppo, counter, hyperparameters)
                if reason or ppo.total_steps - self._evaluated_at >= settings.evaluate_every:
                    self._evaluate(ppo, trials, policy, counter, metrics, events)
                    reason = reason or self._limit_reached(ppo, counter, hyperparameters)
                    trace.next_iteration()
                    self._checkpoint(ppo, simulation, counter, trace, metrics)
            trace.close()
            metrics.write()
        return self._result(reason, ppo)

    def _load_track(self) -> Track:
        track = load_track(self.settings.track)
        digest = self.folder.read_info().track_digest
        if track.digest != digest:
            raise ConfigError(
                f"Track {self.settings.track!r} is not the one this run was started on: its digest is "
                f"{track.digest[:12]}, it was {digest[:12]}.",
                hint="Start a new run on the changed track.",
            )
        return track

    def _simulation(self, track: Track, metadata: ModelMetadata) -> Simulation:
        check_simulated(metadata.sensors)
        settings = self.settings
        return Simulation(
            track,
            num_envs=settings.ppo.num_envs,
            seed=settings.seed,
            vehicle=settings.vehicle,
            start=settings.start,
            direction=settings.direction,
            num_threads=settings.num_threads,
        )

    def _limit_reached(self, ppo: PPO, counter: EpisodeCounter, hyperparameters: Hyperparameters | None) -> str:
        """Why training is to end now, or an empty string."""
        until = self.until
        if self._stop.is_set():
            return "interrupted"
        if until.laps and self._last is not None and self._last.laps_completed >= until.laps:
            return "laps"
        if until.steps and ppo.total_steps >= until.steps:
            return "steps"
        if until.seconds and self._seconds_before + time.monotonic() - self.started >= until.seconds:
            return "seconds"
        if hyperparameters is not None:
            if counter.number >= hyperparameters.term_cond_max_episodes:
                return "episodes"
            scores = [episode.reward for episode in self._recent]
            if scores and float(np.mean(scores)) >= hyperparameters.term_cond_avg_score:
                return "score"
        return ""

    # ---- evaluate and save

    def _evaluate(
        self,
        ppo: PPO,
        trials: Simulation,
        policy: NetworkPolicy,
        counter: EpisodeCounter,
        metrics: TrainingMetrics,
        events: EventWriter,
    ) -> None:
        begun = time.perf_counter()
        seed = (self.settings.seed + EVALUATION_SEED) % 2**32
        outcome = completion(policy, trials, rules=self._rules, seed=seed, max_seconds=self._patience)
        lap_times = tuple(outcome.lap_times[np.isfinite(outcome.lap_times)].tolist())
        score = (outcome.mean_completion, -min(lap_times, default=1e6))
        is_best = self._best_score is None or score >= self._best_score
        report = EvaluationReport(
            step=ppo.total_steps,
            seconds=self._seconds_before + time.monotonic() - self.started,
            completions=tuple(outcome.completions.tolist()),
            lap_times=lap_times,
            is_best=is_best,
        )
        if is_best:
            self._best_score = score
        if report.best_lap is not None:
            self._best_lap = min(report.best_lap, self._best_lap or report.best_lap)
        self._last = report
        self._evaluated_at = ppo.total_steps
        for trial, duration in enumerate(trials.column("time").tolist()):
            metrics.add(
                Episode(
                    number=counter.number,
                    env=trial,
                    steps=round(duration / CONTROL_DT),
                    reward=float(outcome.rewards[trial]),
                    progress=float(outcome.completions[trial]),
                    status=outcome.statuses[trial],
                    start_time=counter.place(duration),
                    duration=duration,
                ),
                phase="evaluation",
            )
        scalars = {
            "evaluation/completion": report.completion,
            "evaluation/laps": float(report.laps_completed),
        }
        if report.best_lap is not None:
            scalars["evaluation/best_lap_s"] = report.best_lap
        events.add_scalars(scalars, step=ppo.total_steps)
        self.reporter.evaluation(report)
        self.parts["evaluation"] += time.perf_counter() - begun

    def _checkpoint(
        self,
        ppo: PPO,
        simulation: Simulation,
        counter: EpisodeCounter,
        trace: SimTraceWriter,
        metrics: TrainingMetrics,
    ) -> None:
        begun = time.perf_counter()
        assert self._last is not None
        self.folder.checkpoints.save(
            ppo.total_steps,
            {**ppo.state(), "simulation": simulation.save(), "episode_rewards": counter.rewards},
            metadata={
                "network": asdict(ppo.learner.spec),
                "episodes": counter.number,
                "clock": counter.clock,
                "trace_iteration": trace.iteration,
                "seconds": self._seconds_before + time.monotonic() - self.started,
                "evaluated_at": self._evaluated_at,
                "best_score": self._best_score,
                "best_lap": self._best_lap,
                "last": asdict(self._last),
            },
            metrics={
                "completion": self._last.completion,
                "laps": self._last.laps_completed,
                "best_lap_s": self._last.best_lap if self._last.best_lap is not None else float("nan"),
            },
            score=(self._last.completion, -(self._last.best_lap or 1e6)),
        )
        metrics.write()
        self.parts["checkpoint"] += time.perf_counter() - begun

    def _resume(
        self, arrays: dict[str, NDArray[Any]], metadata: dict[str, Any], ppo: PPO, simulation: Simulation
    ) -> None:
        try:
            ppo.load_state(arrays)
            simulation.load(arrays["simulation"])
            environment = ppo.environment
            assert isinstance(environment, TrainingEnvironment)
            environment.counter.rewards[:] = arrays["episode_rewards"]
            self._seconds_before = float(metadata["seconds"])
            self._evaluated_at = int(metadata["evaluated_at"])
            self._best_score = tuple(metadata["best_score"])
            self._best_lap = metadata["best_lap"]
            last = metadata["last"]
            self._last = EvaluationReport(
                **{**last, "completions": tuple(last["completions"]), "lap_times": tuple(last["lap_times"])}
            )
        except (KeyError, TypeError, ValueError) as error:
            if isinstance(error, RacecraftError):
                raise
            raise CheckpointError(f"The checkpoint of {self.folder.path} cannot be resumed: {error}.") from error
        self.reporter.note(f"Resumed at step {ppo.total_steps:,}.")

    # ---- tell

    def _account(
        self,
        environment_seconds: float,
        policy_seconds: float,
        update_seconds: float,
        environment: TrainingEnvironment,
    ) -> None:
        reward, log = environment.reward_seconds, environment.trace_seconds
        environment.reward_seconds = environment.trace_seconds = 0.0
        self.parts["simulator"] += environment_seconds - reward - log
        self.parts["reward"] += reward
        self.parts["log"] += log
        self.parts["policy"] += policy_seconds
        self.parts["learner"] += update_seconds

    def _iteration_report(self, stats: Any, counter: EpisodeCounter) -> IterationReport:
        now = time.monotonic()
        self._pace.append((now, stats.total_steps))
        (then, steps_then), seconds = self._pace[0], self._seconds_before + now - self.started
        speed = (stats.total_steps - steps_then) / (now - then) if now > then else float("nan")
        remaining = []
        if self.until.seconds:
            remaining.append(self.until.seconds - seconds)
        if self.until.steps and speed > 0:
            remaining.append((self.until.steps - stats.total_steps) / speed)
        recent = self._recent
        return IterationReport(
            stats=stats,
            seconds=seconds,
            steps_per_second=speed,
            episodes=counter.number,
            mean_reward=float(np.mean([e.reward for e in recent])) if recent else float("nan"),
            completion=float(np.mean([min(max(e.progress, 0.0), 1.0) for e in recent])) if recent else float("nan"),
            remaining=max(0.0, min(remaining)) if remaining else None,
        )

    def _result(self, reason: str, ppo: PPO) -> TrainResult:
        return TrainResult(
            run=self.folder.path,
            reason=reason,
            wall_seconds=time.monotonic() - self.started,
            steps=ppo.total_steps,
            laps_completed=self._last.laps_completed if self._last else 0,
            evaluation_trials=self.settings.evaluation_trials,
            best_lap_seconds=self._best_lap,
            parts=self.parts,
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
            self.reporter.note("Stopping after this iteration; a checkpoint is saved. Ctrl-C again stops at once.")

        before = {number: signal.signal(number, handle) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


def _require_valid(source: str, track: Track) -> None:
    """Refuse a reward function that cannot be right, before anything is trained with it."""
    validate_reward(source)
    for outcome in dry_run(source, track):
        if outcome.error is not None:
            raise outcome.error


def _write_iteration(events: EventWriter, report: IterationReport) -> None:
    stats = report.stats
    scalars = {
        "training/reward": report.mean_reward,
        "training/completion": report.completion,
        "training/steps_per_second": report.steps_per_second,
        "training/episode_length": stats.mean_length,
        "losses/policy": stats.losses.policy_loss,
        "losses/value": stats.losses.value_loss,
        "losses/entropy": stats.losses.entropy,
        "losses/approx_kl": stats.losses.approx_kl,
        "losses/clip_fraction": stats.losses.clip_fraction,
        "losses/explained_variance": stats.explained_variance,
    }
    events.add_scalars({tag: value for tag, value in scalars.items() if np.isfinite(value)}, step=stats.total_steps)
