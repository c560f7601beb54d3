"""The training job: environment, learner, run folder and evaluation tied together; progress, limits, resume."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.training.progress import (
    EvaluationReport,
    IterationReport,
    Reporter,
    SilentReporter,
    TrainResult,
)
from racecraft.training.stop import Until

if TYPE_CHECKING:
    from collections.abc import Sequence

    from racecraft.agent import ActionSpace

__all__ = [
    "EvaluationReport",
    "IterationReport",
    "Reporter",
    "SilentReporter",
    "TrainResult",
    "Until",
    "resume",
    "train",
]


def train(
    track: str | Path | Sequence[str | Path] = "reinvent_2018",
    *,
    reward: str | Path = "racing",
    until: str | Until = "5 laps",
    actions: ActionSpace | str = "default",
    model_metadata: str | Path | None = None,
    hyperparameters: str | Path | None = None,
    seed: int = 0,
    root: str | Path = "runs",
    name: str | None = None,
    reporter: Reporter | None = None,
    aws_log: str | Path | None = None,
    started: float | None = None,
    **settings: Any,
) -> TrainResult:
    """Train a car from camera pixels with a reward function.

    Args:
        track: Name of a track, or path of a track file; or several, as `racecraft.track.load_tracks` reads them.
        reward: Name of a preset, or path of a ``reward_function.py``.
        until: When to stop: ``"5 laps"``, ``"8.8 s lap"``, ``"10 minutes"``, ``"200000 steps"``, or several joined by
            ``or``.
        actions: Action space or name of a preset, where no `model_metadata` is given.
        model_metadata: AWS's file: action space, network, version.
        hyperparameters: AWS's file; by default Racecraft's own settings, tuned for speed.
        seed: The same seed repeats a run exactly on the same machine.
        root: Where run folders lie.
        name: Name of the run; by default a new one.
        reporter: Is told how it goes.
        aws_log: File for the log lines that AWS's tools read, ``-`` for stdout.
        started: `time.monotonic()` of when the clock began to run; by default now.
        settings: Other fields of `racecraft.training.settings.TrainSettings`, and ``num_envs``.

    Raises:
        RacecraftError: An input is wrong, or training cannot go on.
    """
    import time

    from racecraft.agent import Hyperparameters, ModelMetadata, action_space
    from racecraft.reward import load_reward
    from racecraft.training.job import Training
    from racecraft.training.settings import make_settings
    from racecraft.training.start import start_run

    started = time.monotonic() if started is None else started
    source = load_reward(reward)
    if model_metadata is None:
        space = action_space(actions) if isinstance(actions, str) else actions
        metadata = ModelMetadata(action_space=space, neural_network="RACECRAFT_SMALL")
    else:
        metadata = ModelMetadata.load(model_metadata)
    parameters = None if hyperparameters is None else Hyperparameters.load(hyperparameters)
    if isinstance(until, str):
        until = Until.parse(until)
    chosen = make_settings(
        metadata=metadata, hyperparameters=parameters, track=track, until=until, seed=seed, **settings
    )
    run = start_run(chosen, reward=source, metadata=metadata, hyperparameters=parameters, root=root, name=name)
    if reporter is not None:
        for note in (*metadata.notes, *(parameters.notes if parameters is not None else ())):
            reporter.note(note)
    return Training(run, reporter=reporter, aws_log=aws_log, started=started, is_checked=True).run()


def resume(
    run: str | Path,
    *,
    until: str | Until | None = None,
    reporter: Reporter | None = None,
    aws_log: str | Path | None = None,
    started: float | None = None,
) -> TrainResult:
    """Continue a run from its last checkpoint, as if it had never stopped.

    Args:
        run: The run folder.
        until: A new limit; by default the one it was started with. Seconds count from the run's first start.
        reporter: Is told how it goes.
        aws_log: File for the log lines that AWS's tools read, ``-`` for stdout.
        started: `time.monotonic()` of when the clock began to run; by default now.

    Raises:
        RacecraftError: There is no such run, it is in use, or training cannot go on.
    """
    from racecraft.run import RunFolder
    from racecraft.training.job import Training

    if isinstance(until, str):
        until = Until.parse(until)
    return Training(RunFolder.open(run), until=until, reporter=reporter, aws_log=aws_log, started=started).run()
