"""The standings of a console's race: each model's best entry, by the rules of `racecraft.contest.standings`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from racecraft.contest import Key, median_score, places, ranking_key, ranking_score
from racecraft.serve.races.schemas import Standing
from racecraft.serve.races.tasks import REPLAY, VIDEO, entry_folder
from racecraft.serve.store.tables import Entry, Job, Race

Entered = tuple[Entry, Job, str]
"""An entry, its job and its user's name."""


def lap_times(job: Job) -> list[list[float]]:
    """S of the completed laps of each trial."""
    trials = (job.result or {}).get("lap_seconds") or [[]]
    return [[float(seconds) for seconds in trial] for trial in trials]


def trial_scores(race: Race, job: Job) -> list[float]:
    """What each trial is ranked by, s; infinite for one with too few laps."""
    return [ranking_score(laps, ranking=race.ranking, minimum_laps=race.minimum_laps) for laps in lap_times(job)]


def score_of(race: Race, job: Job) -> float:
    """What an entry is ranked by, s; infinite while it is not decided, or has no score."""
    return median_score(trial_scores(race, job)) if job.state == "done" else math.inf


def key_of(race: Race, job: Job) -> Key:
    """What the place of a decided entry is decided by."""
    result: dict[str, Any] = job.result or {}
    return ranking_key(
        score_of(race, job),
        lap_times=[seconds for laps in lap_times(job) for seconds in laps],
        completion=float(result.get("mean_completion") or 0.0),
        resets=int(result.get("resets") or 0),
    )


def standings_of(race: Race, entries: list[Entered], *, runs: Path, is_withheld: bool) -> list[Standing]:
    """Each model's best entry, in the order of their places; of equals, who was first.

    Args:
        race: Whose.
        entries: Its entries.
        runs: Folder of the runs.
        is_withheld: Whether nobody may see yet where it starts.
    """
    best: dict[tuple[int, str], tuple[tuple[Key, int], Entered]] = {}
    attempts: dict[tuple[int, str], int] = {}
    for entered in entries:
        entry, job, _ = entered
        if job.state != "done" or job.result is None:
            continue
        who = (entry.user_id, job.run)
        attempts[who] = attempts.get(who, 0) + 1
        rank = (key_of(race, job), entry.id)
        if who not in best or rank < best[who][0]:
            best[who] = (rank, entered)
    ordered = sorted(best.values(), key=lambda found: found[0])
    scores = [score_of(race, job) for _, (_, job, _) in ordered]
    first = min(scores, default=math.inf)
    found = []
    for (_, entered), place, score in zip(ordered, places([rank[0] for rank, _ in ordered]), scores, strict=True):
        tries = attempts[entered[0].user_id, entered[1].run]
        row = _standing(race, entered, place=place, score=score, first=first, attempts=tries)
        found.append(row if is_withheld else _with_files(row, race, entered, runs=runs))
    return found


def replay_trace(job: Job, *, runs: Path) -> Path | None:
    """Where an old entry's steps are: AWS's file of an evaluation in the model's run folder."""
    place = _relative(job.result or {}, "summary") if job.state == "done" else None
    path = None if place is None else (runs / job.run / place).parent / "evaluation-simtrace" / "0-iteration.csv"
    return path if path is not None and path.is_file() else None


def _standing(race: Race, entered: Entered, *, place: int, score: float, first: float, attempts: int) -> Standing:
    entry, job, user = entered
    result: dict[str, Any] = job.result or {}
    is_ranked = math.isfinite(score)
    times = [seconds for laps in lap_times(job) for seconds in laps]
    verification = result.get("verification")
    return Standing(
        place=place if is_ranked else None,
        entry=entry.id,
        model=job.run,
        user=user,
        score=score if is_ranked else None,
        gap=score - first if is_ranked else None,
        scores=[one if math.isfinite(one) else None for one in trial_scores(race, job)],
        lap_times=lap_times(job),
        best_lap=min(times, default=None),
        laps=len(times),
        completion=float(result.get("mean_completion") or 0.0),
        off_tracks=int(result.get("off_track_count") or 0),
        crashes=int(result.get("crash_count") or 0),
        resets=int(result.get("resets") or 0),
        penalty=float(result.get("penalty_seconds") or 0.0),
        attempts=attempts,
        entered=entry.created,
        video=None,
        has_replay=False,
        is_verified=None if not isinstance(verification, dict) else bool(verification.get("is_genuine")),
        verdict=str(verification.get("verdict", "")) if isinstance(verification, dict) else "",
    )


def _with_files(row: Standing, race: Race, entered: Entered, *, runs: Path) -> Standing:
    """The same with what there is to see."""
    entry, job, _ = entered
    if not race.commitment:
        place = _relative(job.result or {}, "video")
        is_there = place is not None and (runs / job.run / place).is_file()
        video = f"/api/models/{job.run}/files/{place.as_posix()}" if place is not None and is_there else None
        return row.model_copy(update={"video": video, "has_replay": replay_trace(job, runs=runs) is not None})
    folder = entry_folder(runs, job.id)
    video = f"/api/races/{race.id}/entries/{entry.id}/video" if (folder / VIDEO).is_file() else None
    return row.model_copy(update={"video": video, "has_replay": (folder / REPLAY).is_file()})


def _relative(result: dict[str, Any], name: str) -> Path | None:
    """A file's place inside its run, which may have been renamed since."""
    try:
        return Path(result["files"][name]).relative_to(result["run"])
    except (KeyError, TypeError, ValueError):
        return None
