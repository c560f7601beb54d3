"""What a training works with while it runs, made part by part and brought to where the last checkpoint was.

    run folder -> learner, cars -> reward worker, logs -> environment -> algorithm, evaluator -> checkpoint

`Session` is what comes of it; every part has a function of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.agent import Hyperparameters, ModelMetadata
from racecraft.errors import CheckpointError, ConfigError, RacecraftError, RunError, typed
from racecraft.learn import Algorithm, Distill, Learner, NetworkSpec
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
from racecraft.scoped_warnings import scoped_warnings
from racecraft.sim import CudaSimulation, Simulation
from racecraft.track import Track, joint_digest, load_tracks
from racecraft.training.environment import TrainingEnvironment, open_simulation
from racecraft.training.meter import Meter
from racecraft.training.parent import begin_from, is_weights_only, origin_of
from racecraft.training.settings import TrainSettings
from racecraft.training.start import aws_hyperparameters, require_trainable, require_valid_reward
from racecraft.training.taught import begin_taught

if TYPE_CHECKING:
    from racecraft.race.policy import NetworkPolicy
    from racecraft.training.cuda_environment import CudaTrainingEnvironment
    from racecraft.training.evaluator import Evaluator
    from racecraft.training.opponent_pool import OpponentPool
    from racecraft.training.teacher import TeachersEnvironment

    Environment = TrainingEnvironment | CudaTrainingEnvironment

AWS_EPISODES = 20  # between two trainings at AWS; its metrics and sim-traces are numbered by it

Note = Callable[[str], None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Logs:
    """The files that a training writes while it runs."""

    counter: EpisodeCounter
    trace: SimTraceWriter
    metrics: TrainingMetrics
    events: EventWriter
    history: HistoryWriter
    evolution: HistoryWriter
    prints: PrintLog
    aws: AwsLog | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Session:
    """Everything that drives, learns, judges and is written."""

    environment: Environment
    algorithm: Algorithm
    evaluator: Evaluator
    logs: Logs
    hyperparameters: Hyperparameters | None
    opponents: OpponentPool | None
    meter: Meter
    since: int
    """Step that the stretch under way began at."""
    begun: dict[str, Any] | None
    """Where the weights that it begins with came from; None where they are random, or training goes on."""

    def state(self) -> dict[str, Any]:
        """The arrays that the next step depends on, by name."""
        return {
            **self.algorithm.state(),
            **self.logs.trace.state(),
            **(self.opponents.state() if self.opponents is not None else {}),
            "simulation": self.environment.simulation.save(),
            "episode_rewards": self.logs.counter.rewards,
            "recent_episodes": self.meter.state(),
        }

    def metadata(self) -> dict[str, Any]:
        """What belongs to the arrays, as JSON."""
        return {
            "network": asdict(self.algorithm.spec),
            "episodes": self.logs.counter.number,
            "clock": self.logs.counter.clock,
            "seconds": self.meter.seconds,
            "evaluator": self.evaluator.state(),
        }

    def load(self, saved: Checkpoint) -> None:
        """Go to where a checkpoint was; the counter's number and clock and the logs are there already.

        Raises:
            CheckpointError: It is not of this run.
        """
        arrays, metadata = saved.arrays, saved.metadata
        saved.check_arrays(self.state())
        try:
            self.algorithm.load_state(arrays)
            if self.algorithm.total_steps != saved.step:
                raise ValueError(f"it counts {self.algorithm.total_steps:,} steps")
            self.environment.simulation.load(arrays["simulation"])
            self.logs.counter.rewards[:] = arrays["episode_rewards"]
            if self.opponents is not None:
                self.opponents.load_state(arrays)
            self.logs.trace.load_state(arrays)
            self.evaluator.load_state(metadata["evaluator"])
            self.algorithm.prefers_average = self.evaluator.was_good
            self.meter.load_state(arrays["recent_episodes"], seconds=float(metadata["seconds"]))
        except RacecraftError:
            raise
        except (KeyError, TypeError, ValueError) as error:
            raise CheckpointError(f"{saved.path} cannot be resumed: {error!r}.") from error


@dataclass(frozen=True, kw_only=True, eq=False)
class _Run:
    """What a run folder says of the training to come."""

    folder: RunFolder
    settings: TrainSettings
    metadata: ModelMetadata
    hyperparameters: Hyperparameters | None
    source: str
    is_foreign: bool
    tracks: tuple[Track, ...]
    saved: Checkpoint | None
    """To go on from; None at the beginning."""

    @property
    def copies(self) -> int:
        """Of the reward function: one that remembers gets a memory for each car, as AWS drove one car to a process."""
        return self.settings.num_envs if keeps_state(self.source) else 1


@contextmanager
def open_session(
    folder: RunFolder,
    settings: TrainSettings,
    meter: Meter,
    *,
    aws_log: str | Path | None,
    is_checked: bool,
    metadata: ModelMetadata | None,
    note: Note,
    on_step: Callable[[], None],
) -> Iterator[Session]:
    """Everything made, and brought to where the last checkpoint was; closed at the end, however that comes.

    The arguments are those of `racecraft.training.job.Training`; `note` is told what the user should know, `on_step`
    that the cars drove a step.

    Raises:
        RacecraftError: The training cannot begin.
    """
    metadata = metadata or folder.read_model_metadata()
    require_trainable(settings, metadata)
    saved, begun = _beginning(folder, note)
    if saved is not None:
        _require_its_network(saved, settings.network_spec(metadata), folder)

    with ExitStack() as stack:
        run = _Run(
            folder=folder,
            settings=settings,
            metadata=metadata,
            hyperparameters=folder.read_hyperparameters(),
            source=folder.read_reward_function(),
            is_foreign=folder.read_info().foreign,
            tracks=_load_tracks(folder, settings),
            saved=saved,
        )
        if not is_checked:
            require_valid_reward(run.source, settings, run.tracks, foreign=run.is_foreign)
        # The reward's process takes longest to come up, and then the ground to be painted, each on a core of its own.
        # What is not needed before is imported meanwhile.
        worker = _open_worker(run, stack)
        with ThreadPoolExecutor(1) as pool:
            open_cars = partial(open_simulation, settings, run.tracks, metadata.suite)
            cars_to_be = pool.submit(open_cars) if settings.device == "cpu" else None  # a GPU stays with its thread
            from racecraft.race.seeing import learner_of

            learner = learner_of(
                settings.network_spec(metadata),
                seed=settings.seed,
                initial_weights=settings.initial_weights,
                num_threads=settings.num_threads,
                device=settings.device,
            )
            from racecraft.training.algorithms import make_algorithm
            from racecraft.training.evaluator import Evaluator

            simulation = open_cars() if cars_to_be is None else cars_to_be.result()
        if begun is not None:
            begin_from(learner, begun, has_lessons=settings.algorithm == "distill")
        worker.wait()

        since = _begin_stretch(run, note)
        logs = _open_logs(run, stack, aws_log=aws_log)
        environment = _make_environment(run, simulation, learner, worker, logs, note, on_step)
        session = Session(
            environment=environment,
            algorithm=make_algorithm(
                settings,
                learner,
                environment,
                open_teacher=partial(_open_teacher, run, stack),
            ),
            evaluator=Evaluator(_policy(run, learner), run.tracks, settings),
            logs=logs,
            hyperparameters=run.hyperparameters,
            opponents=environment.opponents if isinstance(environment, TrainingEnvironment) else None,
            meter=meter,
            since=since,
            begun=None if begun is None else origin_of(begun),
        )
        if saved is None and isinstance(session.algorithm, Distill):
            is_taught = begun is not None and begin_taught(session.algorithm, begun)
            before = " It begins with what an earlier one knew." if is_taught else ""
            steps = settings.distill.teacher_steps
            note(f"A teacher, told where everything is, learns first: {steps:,} steps without a camera.{before}")
        if saved is not None:
            session.load(saved)
            forgotten = "; what the reward function remembered begins anew" if run.copies > 1 else ""
            note(f"Resumed at step {session.algorithm.total_steps:,}{forgotten}.")
        try:
            yield session
        except BaseException:
            with suppress(RunError):  # the first error is the one to tell
                logs.trace.close()
                logs.metrics.write()
            raise
        logs.trace.close()
        logs.metrics.write()


def _beginning(folder: RunFolder, note: Note) -> tuple[Checkpoint | None, Checkpoint | None]:
    """The checkpoint to resume from, or else the weights to begin with: imported ones, or a parent's.

    A damaged checkpoint is passed over with a note.
    """
    store = folder.checkpoints
    with scoped_warnings("always", CheckpointWarning) as caught:
        saved = store.load("last") if store.entries() else None
    told = [warning for warning in caught if issubclass(warning.category, CheckpointWarning)]
    for text in dict.fromkeys(str(warning.message) for warning in told):
        note(text)
    if saved is None and folder.read_info().parent is not None:
        return None, folder.parent_checkpoint.load()
    return (None, saved) if saved is not None and is_weights_only(saved) else (saved, None)


def _require_its_network(saved: Checkpoint, asked: NetworkSpec, folder: RunFolder) -> None:
    """Refuse files of a run that ask for another network than it has been training."""
    described = saved.metadata.get("network")
    if not isinstance(described, dict):
        return
    for name, value in asdict(asked).items():
        had = described.get(name, value)
        if had != (list(value) if isinstance(value, tuple) else value):
            raise ConfigError(
                f"The run's network has {name} {str(had)[:60]}, and its files now ask for {str(value)[:60]}.",
                hint="Undo the change. With other actions "
                f"racecraft train --from {typed(folder.path)} --model-metadata FILE begins a new run "
                "with these weights.",
            )


def _load_tracks(folder: RunFolder, settings: TrainSettings) -> tuple[Track, ...]:
    tracks = load_tracks(settings.track)
    digest, before = joint_digest(tracks), folder.read_info().track_digest
    if digest != before:
        raise ConfigError(
            f"Track {settings.track!r} is not the one this run was started on: its digest is "
            f"{digest[:12]}, it was {before[:12]}.",
            hint="Start a new run on the changed track.",
        )
    return tracks


def _open_worker(run: _Run, stack: ExitStack) -> RewardWorker:
    worker = RewardWorker(
        run.source,
        list(run.tracks),
        seed=run.settings.seed,
        num_cars=run.copies,
        num_objects=run.settings.num_objects,
        foreign=run.is_foreign,
        waits=False,
    )
    return stack.enter_context(worker)


def _begin_stretch(run: _Run, note: Note) -> int:
    """The step that the stretch under way began at: now, where the run's files changed since the last one."""
    kept = run.saved.step if run.saved is not None else 0
    stretch = begin_stretch(run.folder, step=kept)
    if kept and stretch.step == kept:
        before = read_stretches(run.folder)[-2]
        note(f"From here on with other {', '.join(stretch.changes(before))}.".replace("_", " "))
    return stretch.step


def _open_logs(run: _Run, stack: ExitStack, *, aws_log: str | Path | None) -> Logs:
    """The files, going on behind the last checkpoint."""
    folder, settings, saved = run.folder, run.settings, run.saved
    kept, resumed = (saved.step, saved.metadata) if saved is not None else (0, {})
    episodes, clock = int(resumed.get("episodes", 0)), float(resumed.get("clock", 0.0))
    per_iteration = settings.ppo.episodes_per_iteration or AWS_EPISODES
    events = stack.enter_context(EventWriter(folder.events, after_step=kept if saved is not None else -1))
    history = stack.enter_context(HistoryWriter(folder.history, step=kept))
    evolution = stack.enter_context(HistoryWriter(folder.evolution, step=kept))
    aws = None
    if aws_log is not None:
        aws = stack.enter_context(AwsLog(aws_log, steps=kept))
        aws.write_settings(
            world=run.tracks[0].name,
            metadata=run.metadata,
            hyperparameters=aws_hyperparameters(settings.learning, run.hyperparameters),
        )
    return Logs(
        counter=EpisodeCounter(settings.num_envs, number=episodes, clock=clock),
        trace=SimTraceWriter(
            folder.training_simtrace,
            num_envs=settings.num_envs,
            tracks=list(run.tracks),
            action_space=run.metadata.action_space,
            episodes_per_iteration=per_iteration,
            episodes=episodes,
            log=aws,
        ),
        metrics=TrainingMetrics(
            folder.training_metrics, episodes_per_iteration=per_iteration, episodes=episodes, clock=clock
        ),
        events=events,
        history=history,
        evolution=evolution,
        prints=stack.enter_context(PrintLog(folder.reward_log)),
        aws=aws,
    )


def _open_teacher(run: _Run, stack: ExitStack, teacher: Learner) -> TeachersEnvironment:
    from racecraft.training.teacher import teacher_environment  # few trainings have one

    space = run.metadata.action_space
    return teacher_environment(run.settings, run.source, run.tracks, space, stack, teacher, foreign=run.is_foreign)


def _policy(run: _Run, learner: Learner) -> NetworkPolicy:
    from racecraft.race.policy import NetworkPolicy

    return NetworkPolicy(learner, run.metadata.action_space, sensors=run.metadata.suite)


def _make_environment(
    run: _Run,
    simulation: Simulation | CudaSimulation,
    learner: Learner,
    worker: RewardWorker,
    logs: Logs,
    note: Note,
    on_step: Callable[[], None],
) -> Environment:
    settings, metadata = run.settings, run.metadata
    if not isinstance(simulation, Simulation):
        from racecraft.training.cuda_environment import CudaTrainingEnvironment

        space = metadata.action_space
        return CudaTrainingEnvironment(simulation, worker, run.source, space, counter=logs.counter, note=note)
    opponents = None
    if settings.opponents is not None:
        from racecraft.training.opponent_pool import OpponentPool

        own, threads = _policy(run, learner), settings.num_threads
        opponents = OpponentPool(settings.opponents, simulation, own, seed=settings.seed, num_threads=threads)
    return TrainingEnvironment(
        simulation,
        worker,
        metadata.action_space,
        counter=logs.counter,
        sensors=metadata.suite,
        trace=logs.trace,
        prints=logs.prints,
        opponents=opponents,
        goes_on=settings.algorithm == "distill" or opponents is not None,
        lap_view=settings.lap_view,
        tells_nearby=settings.tells_nearby,
        tells_rivals=settings.tells_rivals,
        on_step=on_step,
    )
