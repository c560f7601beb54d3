"""The judge's process: ``python -m racecraft.serve.submissions.judge``; every entry is judged by a child of its own.

    standard input    a line of JSON: a submission's folder, the race's document, its commitment, the seeds of its
                      starts and of its hidden frames, its track; no secret, no address
    FOLDER/entry      what drives, read by the child
    FOLDER/judged     what was driven
    standard output   a line of JSON: the child's status, and what it said: how far the model was trained and what it
                      chooses on hidden frames, or why it cannot drive

It has no environment, no database and no key: a file that got the better of a child would find nothing, and dies with
it. A child drives twice, with one thread and with two, and answers only if every bit came out the same. What all of
them need is loaded once; the process ends when nobody is at the other end of its standard input any more.
"""

from __future__ import annotations

import json
import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from racecraft import system
from racecraft.serve.quick import loading

ENTRY: Final = "entry.safetensors"
JUDGED: Final = "judged.replay"
MOST_SAID: Final = 1 << 20  # bytes
MOST_WRITTEN: Final = 1 << 28  # bytes of a file
MOST_CPU: Final = 1200  # s


def main() -> int:
    """Judge what is asked for, until nobody asks any more."""
    with loading():
        import racecraft.contest.contest
        import racecraft.contest.terms
        import racecraft.race.announcement
        import racecraft.race.entry_file
        import racecraft.race.likeness
        import racecraft.replay.replay
        import racecraft.track  # noqa: F401  the children have all of it

    for line in sys.stdin:
        status, said = _by_a_child(json.loads(line))
        sys.stdout.write(json.dumps({"status": status, "said": said}) + "\n")
        sys.stdout.flush()
    return 0


def _by_a_child(told: dict[str, Any]) -> tuple[int, str]:
    """Status and words of a child that judges one submission: 0 with a result, 3 with a sentence, others without."""
    mouth, pen = os.pipe()
    if (child := os.fork()) == 0:
        status = 1
        try:
            status = _judge_alone(told, pen)
        finally:
            os._exit(status)
    os.close(pen)
    with open(mouth, "rb") as pipe:
        said = pipe.read(MOST_SAID)
    _, ended = os.waitpid(child, 0)
    return os.waitstatus_to_exitcode(ended), said.decode(errors="replace")


def _judge_alone(told: dict[str, Any], pen: int) -> int:
    """In the child: nothing is open to it but its folder and its way to answer."""
    from racecraft.errors import RacecraftError

    nothing = os.open(os.devnull, os.O_RDWR)
    for file in (0, 1):
        os.dup2(nothing, file)
    os.chdir(told["folder"])
    system.limit(seconds=MOST_CPU, written=MOST_WRITTEN)
    try:
        said, status = _judge(told), 0
    except RacecraftError as error:
        said, status = {"message": str(error), "hint": error.hint}, 3
    with open(pen, "wb") as pipe:
        pipe.write(json.dumps(said).encode())
    return status


def _judge(told: dict[str, Any]) -> dict[str, Any]:
    from racecraft.contest.contest import hold_race
    from racecraft.contest.terms import RaceTerms
    from racecraft.errors import RunError
    from racecraft.race.announcement import Announcement
    from racecraft.race.entry_file import read_entry_file
    from racecraft.race.likeness import hidden_choices
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
    entry = file.entry(told["name"], num_threads=1)
    return {"step": file.saved.step, "choices": hidden_choices(entry, conditions, seed=told["frames"]).tolist()}


if __name__ == "__main__":
    sys.exit(main())
