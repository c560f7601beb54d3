"""The judge's process: ``python -m racecraft.serve.submissions.judge``, alone in the folder of a submission.

    standard input    the race's document, its commitment, the seed of its starts, its track; no secret, no address
    entry             what drives, read from the folder
    judged.replay     what was driven
    standard output   how far the model was trained, or why it cannot drive

It has no environment, no database and no key: a file that got the better of it would find nothing. It drives twice,
with one thread and with two, and answers only if every bit came out the same.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

ENTRY: Final = "entry.safetensors"
JUDGED: Final = "judged.replay"


def main() -> int:
    """Judge one submission; 0 if there is a result, 3 if a sentence on standard output says why there is none."""
    from racecraft.errors import RacecraftError

    try:
        json.dump(_judge(json.load(sys.stdin)), sys.stdout)
        return 0
    except RacecraftError as error:
        json.dump({"message": str(error), "hint": error.hint}, sys.stdout)
        return 3


def _judge(told: dict[str, Any]) -> dict[str, Any]:
    from racecraft.contest.contest import hold_race
    from racecraft.contest.terms import RaceTerms
    from racecraft.errors import RunError
    from racecraft.race.announcement import Announcement
    from racecraft.race.entry_file import read_entry_file
    from racecraft.replay.replay import write_replay
    from racecraft.track import load_track

    document = told["document"]
    announcement = Announcement(document=document, commitment=told["commitment"])
    conditions = replace(announcement.conditions(load_track(told["track"])), seed=told["seed"])
    terms = RaceTerms(
        kind=document["kind"],
        conditions=conditions,
        ranking=document["ranking"],
        minimum_laps=document["minimum_laps"],
        num_trials=document["trials"],
        announcement=announcement,
    )
    file, written = read_entry_file(Path(ENTRY)), []
    for number, threads in ((1, 1), (2, 2)):
        contest = hold_race([file.entry(told["name"], num_threads=threads)], terms, num_threads=threads)
        ((_, replay),) = contest.replays()
        path = Path(JUDGED if number == 1 else f"again-{JUDGED}")
        write_replay(replay, path)
        written.append(path.read_bytes())
    path.unlink()
    if written[0] != written[1]:
        raise RunError("It drove differently the second time.", hint="This is a bug in Racecraft; please report it.")
    return {"step": file.saved.step}


if __name__ == "__main__":
    sys.exit(main())
