"""The job of a race: a model drives by the race's terms, and its replay is driven again.

    FOLDER/entry.replay    every trial, to be driven again by anybody
    FOLDER/video.mp4       the trial that counted
    FOLDER/ghosts.json     where its ghosts were; copies of replays of those that drove before lie in FOLDER/ghosts

They show where the race starts, so they lie among the console's own files and not among the model's. What the job
reports may be seen while the race is open, so it holds laps and mistakes and no place.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from racecraft.serve.jobs.task import Task
from racecraft.serve.races.ghosts import named_as_asked, sources_of, write_beside
from racecraft.serve.settings import STATE_FOLDER

FOLDER: Final = "races"
REPLAY, VIDEO = "entry.replay", "video.mp4"


def entry_folder(runs: Path, job_id: str) -> Path:
    """Where the files of an entry lie, by its job."""
    return runs / STATE_FOLDER / FOLDER / job_id


def race(task: Task) -> dict[str, Any]:
    """Drive a model's entry in a race by the race's terms, and drive its replay again."""
    from racecraft.contest.contest import hold_race
    from racecraft.contest.terms import announced_terms
    from racecraft.film.ghost_source import check_sources, load_ghosts
    from racecraft.film.video import film
    from racecraft.race.announcement import Announcement
    from racecraft.race.entry import load_entry
    from racecraft.race.results import Evaluation
    from racecraft.replay.replay import read_replay, write_replay
    from racecraft.replay.verification import verify
    from racecraft.track import load_track

    payload = task.job.payload
    announcement = Announcement.from_dict(payload["announcement"])
    terms = announced_terms(announcement, load_track(payload["track"]))
    entry = load_entry(f"{task.folder.path}@{payload['checkpoint']}")
    folder = entry_folder(task.runs, task.job.id)
    folder.mkdir(parents=True, exist_ok=True)
    asked = payload.get("ghosts", ())
    sources = sources_of(asked, folder=folder, runs=task.runs)
    check_sources(sources, terms.conditions.track, terms.conditions.rules, run=None)
    contest = hold_race([entry], terms)
    ((_, replay),) = contest.replays()
    write_replay(replay, folder / REPLAY)
    found = verify(read_replay(folder / REPLAY), race=announcement)
    (trials,) = contest.trials
    trial = contest.shown_trial
    shown = trials[trial].recording
    ghosts = named_as_asked(load_ghosts(sources, terms.conditions, trial=trial, recordings=[shown]), asked)
    write_beside(ghosts, [shown], folder=folder, trial=trial)
    film(
        shown,
        folder / VIDEO,
        laps=terms.conditions.rules.laps,
        name=task.job.run,
        ghosts=ghosts,
        sensors=entry.sensors,
    )
    return {
        **Evaluation(conditions=terms.conditions, trials=trials).report(),
        "step": entry.step,
        "verification": {"is_genuine": found.is_genuine, "verdict": "" if found.is_genuine else found.sentence},
    }
