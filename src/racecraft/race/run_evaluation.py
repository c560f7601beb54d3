"""Evaluate a run: its policy raced by the rules, and everything about it written into the run folder.

evaluation-<time>/evaluation-simtrace/0-iteration.csv   every step                  (AWS)
metrics/EvaluationMetrics-<time>.json                    every lap                   (AWS)
evaluation-<time>/evaluation.json                        the summary with its intervals
evaluation-<time>/racing-line.png                        the best trial's line, coloured by speed
mp4/camera-pip/<n>-video.mp4                             the best trial, filmed
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from racecraft.errors import ConfigError, did_you_mean
from racecraft.race.artifacts import write_metrics, write_simtrace
from racecraft.race.evaluation import evaluate
from racecraft.race.policy import load_policy
from racecraft.race.racing_line import draw_racing_line
from racecraft.race.results import Evaluation
from racecraft.race.rules import RULE_SETS, RaceRules
from racecraft.race.video import film
from racecraft.run.atomic import write_json
from racecraft.run.folder import RunFolder
from racecraft.sim.vehicle import Vehicle, load_vehicle
from racecraft.track import Track, load_track


@dataclass(frozen=True, kw_only=True)
class RunEvaluation:
    """What an evaluation of a run found, and where it is written."""

    run: Path
    """The run folder."""
    step: int
    """Camera steps of training behind the checkpoint."""
    evaluation: Evaluation
    """Laps, trials, statistics."""
    files: dict[str, Path]
    """What was written, by what it is."""

    @property
    def summary(self) -> str:
        """The result in one sentence."""
        found = self.evaluation
        low, high = found.clean_lap_interval
        best = f", best lap {found.best_lap:.2f} s" if found.best_lap is not None else ""
        return (
            f"{found.laps_clean} of {found.laps_begun} laps clean "
            f"(95 % interval {100 * low:.0f} to {100 * high:.0f} %){best}."
        )

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {
            "run": str(self.run),
            "step": self.step,
            **self.evaluation.summary(),
            "lap_seconds": [list(trial.lap_times) for trial in self.evaluation.trials],
            "files": {name: str(path) for name, path in self.files.items()},
        }


def evaluate_run(
    run: str | Path,
    *,
    track: str | Track | None = None,
    laps: int = 3,
    num_trials: int = 5,
    rules: str | RaceRules = "drfc",
    checkpoint: str | int = "best",
    vehicle: str | Vehicle | None = None,
    direction: str = "forward",
    offtrack_penalty: float | None = None,
    max_resets: int | None = None,
    seed: int = 0,
    video: bool = True,
    num_threads: int = 0,
) -> RunEvaluation:
    """Race a run's policy against the clock.

    Args:
        run: The run folder.
        track: Where; by default where it was trained.
        laps: Laps to a trial.
        num_trials: Cars that start side by side, each a little differently.
        rules: A name of `RULE_SETS`, or rules.
        checkpoint: ``best``, ``last`` or a number of steps.
        vehicle: By default the one it was trained with.
        direction: ``forward`` or ``reverse``.
        offtrack_penalty: Seconds; by default the rules'.
        max_resets: By default the rules'.
        seed: Of the starts.
        video: Whether to film the best trial.
        num_threads: 0 takes one per core.

    Raises:
        RacecraftError: The run, its checkpoint, the track or a setting is not usable.
    """
    folder = RunFolder.open(run)
    info = folder.read_info()
    if isinstance(rules, str):
        if rules not in RULE_SETS:
            allowed = ", ".join(RULE_SETS)
            raise ConfigError(
                f"Rules {rules!r} do not exist; allowed are {allowed}.", hint=did_you_mean(rules, RULE_SETS)
            )
        rules = RULE_SETS[rules]
    changes: dict[str, Any] = {"laps": laps, "direction": direction}
    if offtrack_penalty is not None:
        changes["offtrack_penalty"] = offtrack_penalty
    if max_resets is not None:
        changes["max_resets"] = max_resets
    rules = replace(rules, **changes)
    if vehicle is None:
        vehicle = Vehicle(**info.settings["vehicle"]) if "vehicle" in info.settings else Vehicle()
    elif isinstance(vehicle, str):
        vehicle = load_vehicle(vehicle)
    where = track if isinstance(track, Track) else load_track(track or info.track)

    step, policy = load_policy(folder, checkpoint=checkpoint, num_threads=num_threads)
    evaluation = evaluate(
        policy, where, rules=rules, num_trials=num_trials, seed=seed, vehicle=vehicle, num_threads=num_threads
    )
    files = _write(folder, evaluation, policy.action_space, is_filmed=video)
    return RunEvaluation(run=folder.path, step=step, evaluation=evaluation, files=files)


def _write(folder: RunFolder, evaluation: Evaluation, action_space: Any, *, is_filmed: bool) -> dict[str, Path]:
    stamp = _new_stamp(folder)
    inside = folder.evaluation(stamp)
    inside.mkdir(parents=True)
    metrics = folder.evaluation_metrics(stamp)
    metrics.parent.mkdir(exist_ok=True)
    write_metrics(evaluation, metrics)
    write_simtrace(evaluation, inside / "evaluation-simtrace", action_space=action_space)
    write_json(inside / "evaluation.json", json.loads(json.dumps(evaluation.summary())))
    files = {
        "metrics": metrics,
        "sim-trace": inside / "evaluation-simtrace" / "0-iteration.csv",
        "summary": inside / "evaluation.json",
    }
    best = evaluation.best_trial
    files["racing line"] = draw_racing_line(best.recording, inside / "racing-line.png", title=folder.name)
    if is_filmed:
        videos = folder.videos / "camera-pip"
        videos.mkdir(parents=True, exist_ok=True)
        path = videos / f"{len(list(videos.glob('*-video.mp4')))}-video.mp4"
        files["video"] = film(best.recording, path, laps=evaluation.rules.laps, name=folder.name)
    return files


def _new_stamp(folder: RunFolder) -> str:
    """Now, to the second, or a little later where an evaluation of this second exists."""
    stamp = int(datetime.now(UTC).strftime("%Y%m%d%H%M%S"))
    while folder.evaluation(str(stamp)).exists():
        stamp += 1
    return str(stamp)
