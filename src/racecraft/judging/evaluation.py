"""Evaluate a run: its policy raced by the rules, and everything about it written into the run folder.

evaluation-<time>/evaluation-simtrace/0-iteration.csv   every step                  (AWS)
metrics/EvaluationMetrics-<time>.json                    every lap                   (AWS)
evaluation-<time>/evaluation.json                        the summary with its intervals
evaluation-<time>/evaluation.replay                      every trial, to be shown and driven again
evaluation-<time>/racing-line.png                        the best trial's line, coloured by speed
mp4/camera-pip/<n>-video.mp4                             the best trial, filmed
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol

from racecraft.checks import check_path
from racecraft.errors import ConfigError, RunError
from racecraft.film.ghost import Ghost
from racecraft.film.ghost_source import check_sources, load_ghosts
from racecraft.film.racing_line import draw_racing_line
from racecraft.film.video import film
from racecraft.json_file import read_json_object
from racecraft.judging.trained import trained_camera, trained_objects, trained_track, trained_vehicle
from racecraft.limits import TrackLimit, known_limit
from racecraft.race.artifacts import write_metrics, write_simtrace
from racecraft.race.evaluation import evaluate
from racecraft.race.placement import driven_track
from racecraft.race.policy import NetworkPolicy, load_policy
from racecraft.race.provenance import Provenance, provenance, vehicle_note
from racecraft.race.results import Evaluation
from racecraft.race.rules import RaceRules, rules_by_name
from racecraft.race.yardstick import Placing, placings
from racecraft.replay.header import header_of
from racecraft.replay.replay import Replay, write_replay
from racecraft.run.atomic import write_json
from racecraft.run.aws_log import AwsLog
from racecraft.run.folder import RunFolder
from racecraft.sim.camera import CameraSpec
from racecraft.sim.objects import Objects
from racecraft.sim.randomization import Randomization, load_randomization
from racecraft.sim.vehicle import Vehicle, load_vehicle
from racecraft.track import Track, load_track


class PolicyLoader(Protocol):
    """What takes a policy from a run, as `load_policy` does."""

    def __call__(self, run: RunFolder, /, *, checkpoint: str | int, num_threads: int) -> tuple[int, NetworkPolicy]:
        """Steps of training behind it, and the policy."""


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
    limit: TrackLimit | None = None
    """The least a lap takes with this vehicle, where that is known without computing it and the car was no other."""
    about: Mapping[str, Any] = field(default_factory=dict)
    """What else stands in ``evaluation.json``: how it was driven."""

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

    @property
    def provenance(self) -> Provenance:
        """By whose rules, in whose car and on whose track."""
        return provenance(self.evaluation.conditions)

    @property
    def placings(self) -> list[Placing]:
        """Where it would have placed in the official races on this track, most entrants first."""
        return placings(self.evaluation)

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {
            "run": str(self.run),
            "step": self.step,
            **self.evaluation.summary(),
            **self.about,
            "driven": self.provenance.to_dict(),
            "lap_seconds": [list(trial.lap_times) for trial in self.evaluation.trials],
            "limit": self._against_limit(),
            "official_races": [placing.to_dict() for placing in self.placings],
            "files": {name: str(path) for name, path in self.files.items()},
        }

    def _against_limit(self) -> dict[str, Any] | None:
        if self.limit is None:
            return None
        best = self.evaluation.best_lap
        return {
            **self.limit.to_dict(),
            "best_lap_above_limit": self.limit.above(best) if best is not None else None,
            "medal": self.limit.medals.won_by(best) if best is not None else "",
        }


def evaluate_run(
    run: str | Path,
    *,
    track: str | Track | None = None,
    laps: int | None = None,
    num_trials: int = 5,
    rules: str | RaceRules | None = None,
    checkpoint: str | int = "best",
    vehicle: str | Vehicle | None = None,
    direction: str | None = None,
    randomize: Randomization | str | Path = "none",
    offtrack_penalty: float | None = None,
    max_resets: int | None = None,
    collision_penalty: float | None = None,
    objects: Objects | None = None,
    seed: int = 0,
    video: bool = True,
    aws_log: str | Path | None = None,
    ghosts: Sequence[str] = (),
    job: str = "",
    num_threads: int = 0,
    load: PolicyLoader = load_policy,
    camera: CameraSpec | None = None,
    about: Mapping[str, Any] = MappingProxyType({}),
) -> RunEvaluation:
    """Race a run's policy against the clock.

    Args:
        run: The run folder.
        track: Where; by default where it was trained, the first of several.
        laps: Laps to a trial; by default the rules'.
        num_trials: Cars that start side by side, each a little differently.
        rules: A name of `RULE_SETS`, or rules; by default the run's own, where it has some, else ``drfc``.
        checkpoint: ``best``, ``last`` or a number of steps.
        vehicle: By default the one it was trained with.
        direction: ``forward`` or ``reverse``; by default that of the run's own rules, else the one it was trained in,
            ``forward`` if in both.
        randomize: Preset, file or ranges of what differs between the trials.
        offtrack_penalty: Seconds; by default the rules'.
        max_resets: By default the rules'.
        collision_penalty: Seconds; by default the rules'.
        objects: On the track; by default those it was trained with.
        seed: Of the starts.
        video: Whether to film the best trial.
        aws_log: File for the log lines that AWS's tools read, ``-`` for stdout.
        ghosts: Translucent cars in the film: replay files, ``RUN``, ``RUN@CHECKPOINT``, ``@CHECKPOINT`` of this run,
            ``best-lap``.
        job: Written into ``evaluation.json``, by which whoever asked for the evaluation finds it again.
        num_threads: 0 takes one per core.
        load: Takes the policy from the run.
        camera: What the policy sees with; by default what it was trained with.
        about: Written into ``evaluation.json``, too: how it was driven.

    Raises:
        RacecraftError: The run, its checkpoint, the track or a setting is not usable.
    """
    if aws_log is not None:
        check_path("aws_log", aws_log, "use a file's path, or '-'")
    folder = RunFolder.open(run)
    info = folder.read_info()
    if rules is None and folder.race_rules.exists():
        rules = _own_rules(folder)
    elif direction is None:
        direction = "reverse" if info.settings.get("direction") == "reverse" else "forward"
    changes: dict[str, Any] = {
        "laps": laps,
        "direction": direction,
        "offtrack_penalty": offtrack_penalty,
        "collision_penalty": collision_penalty,
        "max_resets": max_resets,
    }
    rules = rules_by_name(rules or "drfc", {name: value for name, value in changes.items() if value is not None})
    if not isinstance(vehicle, Vehicle):
        vehicle = load_vehicle(vehicle) if vehicle else trained_vehicle(info)
    if not isinstance(randomize, Randomization):
        randomize = load_randomization(randomize)
    where = track if isinstance(track, Track) else load_track(track) if track else trained_track(info)

    check_sources(ghosts, where, rules, run=folder.path)
    step, policy = load(folder, checkpoint=checkpoint, num_threads=num_threads)
    evaluation = evaluate(
        policy,
        where,
        rules=rules,
        num_trials=num_trials,
        seed=seed,
        vehicle=vehicle,
        camera=trained_camera(info) if camera is None else camera,
        randomize=randomize,
        objects=trained_objects(info) if objects is None else objects,
        num_threads=num_threads,
    )
    recordings = [trial.recording for trial in evaluation.trials]
    shown = (
        load_ghosts(ghosts, evaluation.conditions, run=folder.path, recordings=recordings) if video and ghosts else []
    )
    try:
        files = _write(
            folder,
            evaluation,
            policy,
            step=step,
            is_filmed=video,
            aws_log=aws_log,
            ghosts=shown,
            about={**about, **({"job": job} if job else {})},
        )
    except OSError as error:
        raise RunError(f"{error.filename or folder.path} cannot be written: {error.strerror or error}.") from error
    limit = None if randomize.changes_car else known_limit(driven_track(where, rules), vehicle)
    return RunEvaluation(run=folder.path, step=step, evaluation=evaluation, files=files, limit=limit, about=about)


def _own_rules(folder: RunFolder) -> RaceRules:
    try:
        return RaceRules.from_dict(read_json_object(folder.race_rules))
    except ConfigError as error:
        raise ConfigError(f"{folder.race_rules.name}: {error}", hint=error.hint) from error


def _write(
    folder: RunFolder,
    evaluation: Evaluation,
    policy: NetworkPolicy,
    *,
    step: int,
    is_filmed: bool,
    aws_log: str | Path | None,
    about: Mapping[str, Any],
    ghosts: Sequence[Ghost] = (),
) -> dict[str, Path]:
    stamp, inside = folder.new_evaluation()
    metrics = folder.evaluation_metrics(stamp)
    metrics.parent.mkdir(exist_ok=True)
    write_metrics(evaluation, metrics)
    with ExitStack() as stack:
        log = None if aws_log is None else stack.enter_context(AwsLog(aws_log, phase="Testing"))
        if log is not None:
            log.write_settings(
                world=evaluation.track.name,
                metadata=folder.read_model_metadata(),
                hyperparameters=folder.read_aws_hyperparameters(),
            )
        write_simtrace(evaluation, inside / "evaluation-simtrace", action_space=policy.action_space, log=log)
    best = evaluation.best_trial
    files = {
        "metrics": metrics,
        "sim-trace": inside / "evaluation-simtrace" / "0-iteration.csv",
        "summary": inside / "evaluation.json",
        "replay": inside / "evaluation.replay",
        "racing line": draw_racing_line(best.recording, inside / "racing-line.png", subtitle=folder.name),
    }
    write_replay(Replay.of(evaluation, title=folder.name), files["replay"])
    driven = provenance(evaluation.conditions).to_dict()
    told = {
        "track_digest": evaluation.track.digest,
        "vehicle": vehicle_note(evaluation.conditions.vehicle),
        "driven": driven,
        "conditions": header_of(evaluation.conditions),
        "step": step,
        "video": None,
    }
    try:
        if is_filmed:
            with _new_video(folder.videos / "camera-pip") as path:
                files["video"] = film(
                    best.recording,
                    path,
                    laps=evaluation.rules.laps,
                    name=folder.name,
                    camera=evaluation.conditions.camera,
                    ghosts=ghosts,
                    sensors=policy.sensors,
                )
            told["video"] = path.relative_to(folder.path).as_posix()
    finally:  # what was driven counts without its film, too
        write_json(inside / "evaluation.json", {**evaluation.summary(), **told, **about})
    return files


@contextmanager
def _new_video(videos: Path) -> Iterator[Path]:
    """The next free name, which an empty file holds against another evaluation until the video is in its place.

    Raises:
        RunError: The folder cannot be written.
    """
    try:
        videos.mkdir(parents=True, exist_ok=True)
        for number in range(10**6):
            path = videos / f"{number}-video.mp4"
            with suppress(FileExistsError):
                path.touch(exist_ok=False)
                break
    except OSError as error:
        raise RunError(f"{videos} cannot be written: {error.strerror or error}.") from error
    try:
        yield path
    except BaseException:
        path.unlink(missing_ok=True)
        raise
