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
    from racecraft.training.opponents import Opponents

__all__ = [
    "EvaluationReport",
    "IterationReport",
    "Opponents",
    "Reporter",
    "SilentReporter",
    "TrainResult",
    "Until",
    "resume",
    "train",
]


def __getattr__(name: str) -> Any:
    """Import what few trainings need on first use."""
    if name == "Opponents":
        from racecraft.training.opponents import Opponents

        return Opponents
    raise AttributeError(f"module 'racecraft.training' has no attribute {name!r}")


def train(
    track: str | Path | Sequence[str | Path] | None = None,
    *,
    reward: str | Path | None = None,
    until: str | Until = "",
    actions: ActionSpace | str | None = None,
    sensors: Sequence[str] = (),
    model_metadata: str | Path | None = None,
    hyperparameters: str | Path | None = None,
    seed: int = 0,
    parent: str | Path | None = None,
    root: str | Path = "runs",
    name: str | None = None,
    reporter: Reporter | None = None,
    aws_log: str | Path | None = None,
    started: float | None = None,
    recipe: str = "",
    **settings: Any,
) -> TrainResult:
    """Train a car from camera pixels with a reward function.

    Args:
        track: Name of a track, or path of a track file; or several, as `racecraft.track.load_tracks` reads them; by
            default ``reinvent_2018``.
        reward: Name of a preset, or path of a ``reward_function.py``; by default ``racing``, among objects ``dodge``,
            with actions above 1 m/s ``slalom``, against opponents ``duel``.
        until: When to stop: ``"5 laps"`` (the default), ``"8.8 s lap"``, ``"no better lap"``, ``"10 minutes"``,
            ``"200000 steps"``, or several joined by ``or``; by default among objects ``"20 laps or 10 minutes"``,
            against opponents ``"10 minutes"``, and for who is taught to be fast ``"no better lap or 10 minutes"``.
        actions: Action space or name of a preset, where no `model_metadata` is given; by default ``default``, among
            objects ``steady``, against opponents ``continuous``.
        sensors: AWS's names, one camera and at most one LIDAR, where no `model_metadata` is given; by default the front
            camera, among objects with a ``LIDAR``.
        model_metadata: AWS's file: action space, sensors, network, version.
        hyperparameters: AWS's file; by default Racecraft's own settings, tuned for speed.
        seed: The same seed repeats a run exactly on the same machine.
        parent: Run whose weights it begins with, ``RUN`` or ``RUN@checkpoint`` (``best``, ``last`` or steps); what is
            not given here is then as it is there, except `until` and `seed`.
        root: Where run folders lie.
        name: Name of the run; by default a new one.
        reporter: Is told how it goes.
        aws_log: File for the log lines that AWS's tools read, ``-`` for stdout.
        started: `time.monotonic()` of when the clock began to run; by default now.
        recipe: Name of several of these arguments together, one of `racecraft.training.recipes.RECIPES`; what is given
            besides goes before it.
        settings: Other fields of `racecraft.training.settings.TrainSettings`, and ``num_envs``.

    Raises:
        RacecraftError: An input is wrong, or training cannot go on.
    """
    import time

    from racecraft.training.job import Training, check_listeners
    from racecraft.training.plan import make_plan
    from racecraft.training.recipes import with_recipe

    check_listeners(reporter, aws_log, started)
    started = time.monotonic() if started is None else started
    given = {"track": track, "reward": reward, "until": until, "actions": actions, **settings}
    chosen = with_recipe(recipe, given)
    if model_metadata is not None:
        chosen["actions"] = actions  # the file goes before a recipe's
    plan = make_plan(
        **chosen,
        sensors=sensors,
        model_metadata=model_metadata,
        hyperparameters=hyperparameters,
        seed=seed,
        parent=parent,
    )
    if plan.settings.device != "cpu":
        from racecraft.gpu import open_device

        open_device(plan.settings.device)  # before anything is written
    run = plan.start(root=root, name=name)
    if reporter is not None:
        for note in plan.notes:
            reporter.note(note)
    metadata = plan.metadata.as_filed
    return Training(run, reporter=reporter, aws_log=aws_log, started=started, is_checked=True, metadata=metadata).run()


def resume(
    run: str | Path,
    *,
    until: str | Until | None = None,
    reward: str | Path | None = None,
    reporter: Reporter | None = None,
    aws_log: str | Path | None = None,
    started: float | None = None,
) -> TrainResult:
    """Continue a run from its last checkpoint, as if it had never stopped.

    What was changed in its files since is a new stretch of it, see `racecraft.run.stretches`.

    Args:
        run: The run folder.
        until: A new limit; by default the one it was started with. Seconds count from the run's first start.
        reward: Preset or path of another reward function, from here on.
        reporter: Is told how it goes.
        aws_log: File for the log lines that AWS's tools read, ``-`` for stdout.
        started: `time.monotonic()` of when the clock began to run; by default now.

    Raises:
        RacecraftError: There is no such run, it is in use, or training cannot go on.
    """
    from racecraft.reward import load_reward
    from racecraft.run import RunFolder
    from racecraft.training.job import Training, check_listeners

    check_listeners(reporter, aws_log, started)
    if isinstance(until, str):
        until = Until.parse(until)
    folder = RunFolder.open(run)
    if reward is not None:
        from racecraft.training.start import replace_reward

        replace_reward(folder, load_reward(reward))
    return Training(folder, until=until, reporter=reporter, aws_log=aws_log, started=started).run()
