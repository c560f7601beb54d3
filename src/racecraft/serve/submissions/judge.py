"""The judge's process: ``python -m racecraft.serve.submissions.judge``; every entry is driven by children of its own.

    standard input    a line of JSON: a submission's folder, that of its results, the race's document, its commitment,
                      the seeds of its starts and of its hidden frames, its track; no secret, no address
    FOLDER/entry      what drives, read by the children
                      of a heat of a final instead the files of both who drive, and their names, who is in front first
    RESULTS/judged    what was driven
    standard output   a line of JSON: how the judging ended, and what was said: how far the model was trained and what
                      it chooses on hidden frames, or why it cannot drive

It has no environment, no database and no key, and never reads an entry itself. Two children drive it, one with one
thread and one with two, each within walls (`racecraft.serve.submissions.walls`): a file that got the better of one
would find nothing, and die with it. The judge compares what they drove, to the bit. What all of them need is loaded
once. When nobody is at the other end of its standard input any more, the process ends, and the child that drives with
it: whoever asked is gone, and another worker may have the same entry judged by now. A judge that is killed takes its
child along, too.
"""

from __future__ import annotations

import filecmp
import json
import os
import select
import sys
import traceback
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from racecraft import system
from racecraft.reward.worker_process import end_with
from racecraft.serve.quick import loading

ENTRY: Final = "entry.safetensors"
JUDGED: Final = "judged.replay"
AGAIN: Final = "again-judged.replay"
DROVE, REFUSED, DIFFERED, FAILED = 0, 3, 4, 1
"""How a judging ended: with a result, with a sentence, with two results, or not at all."""
MOST_SAID: Final = 1 << 20  # bytes
MOST_LOGGED: Final = 2000  # characters of a child's last words
MOST_WRITTEN: Final = 1 << 28  # bytes of a file
MOST_CPU: Final = 1200  # s
LEAVING: Final = 5  # ms between two looks at a child that has said all, and ends at once as a rule


def main() -> int:
    """Judge what is asked for, until nobody asks any more."""
    with loading():
        import numpy.random  # noqa: F401  the children have all of it
        import safetensors  # noqa: F401

        import racecraft.contest.contest
        import racecraft.contest.terms
        import racecraft.race.announcement
        import racecraft.race.entry_file
        import racecraft.race.likeness
        import racecraft.replay.replay
        import racecraft.track  # noqa: F401
        from racecraft.serve.submissions.walls import missing_walls

    if lacks := missing_walls():
        _log(f"Entries are judged behind fewer walls: the system has no {lacks}.")
    for line in sys.stdin:
        status, said = judge(json.loads(line), asker=sys.stdin.fileno())
        sys.stdout.write(json.dumps({"status": status, "said": said}) + "\n")
        sys.stdout.flush()
    return 0


def judge(told: dict[str, Any], *, asker: int | None = None) -> tuple[int, str]:
    """How the judging of a submission ended, and what its first child said.

    Args:
        told: The line of standard input.
        asker: A pipe whose other end is closed when nobody waits for this any more; the process then ends.
    """
    results = Path(told["results"])
    status, said = _by_a_child(told, number=1, asker=asker)
    if status != DROVE:
        return status, said
    status, _ = _by_a_child(told, number=2, asker=asker)
    if status == FAILED:
        return FAILED, ""
    is_same = status == DROVE and filecmp.cmp(results / JUDGED, results / AGAIN, shallow=False)
    (results / AGAIN).unlink(missing_ok=True)
    return (DROVE, said) if is_same else (DIFFERED, "")


def _by_a_child(told: dict[str, Any], *, number: int, asker: int | None = None) -> tuple[int, str]:
    """How the first or second child ended, which drives a submission, and what it said; `FAILED` where it was ended."""
    mouth, pen = os.pipe()
    lifeline, held = os.pipe()
    if (child := os.fork()) == 0:
        status = FAILED
        try:
            os.close(held)
            end_with(lifeline)
            if not system.can_be_read(lifeline, 0.0):  # or the judge was gone before
                status = _drive_alone(told, pen, lifeline, number=number)
        finally:
            os._exit(status)
    for file in (pen, lifeline):
        os.close(file)
    heard = b""
    with open(mouth, "rb", buffering=0) as pipe, open(held, "wb", buffering=0):  # the child ends with the second
        while len(heard) < MOST_SAID:
            _wait(child, asker, mouth=mouth)
            if not (part := pipe.read(MOST_SAID - len(heard))):
                break
            heard += part
        while not (gone := os.waitpid(child, os.WNOHANG))[0]:  # it may drive on, having closed its pipe
            _wait(child, asker)
    said, status = heard.decode(errors="replace"), os.waitstatus_to_exitcode(gone[1])
    if status not in (DROVE, REFUSED):
        why = system.end_of(status) or "an error"
        _log(f"A judge's child was ended by {why}. {said[-MOST_LOGGED:]}")
        return FAILED, ""
    return status, said


def _wait(child: int, asker: int | None, *, mouth: int | None = None) -> None:
    """Until a child says something, or for a moment; where nobody asks any more, it ends and this process, too."""
    watch = select.poll()
    if mouth is not None:
        watch.register(mouth, select.POLLIN)
    if asker is not None:
        watch.register(asker, select.POLLHUP)
    if any(file == asker for file, _ in watch.poll(LEAVING if mouth is None else None)):
        system.end(child)
        os.waitpid(child, 0)
        sys.exit(FAILED)


def _drive_alone(told: dict[str, Any], pen: int, lifeline: int, *, number: int) -> int:
    """In the child: nothing is open to it but its way to answer, the entry to read, and a file for what it drove."""
    from racecraft.errors import RacecraftError
    from racecraft.serve.submissions.walls import lock_in

    try:
        result = Path(told["results"]) / (JUDGED if number == 1 else AGAIN)
        written = os.open(result, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o644)
        nothing = os.open(os.devnull, os.O_RDWR)
        for file in (0, 1, 2):
            os.dup2(nothing, file)
        os.chdir("/")
        system.limit(seconds=MOST_CPU, written=MOST_WRITTEN)
        terms, grid = _terms(told), _grid(told)
        lock_in(entries=[path for path, _ in grid], kept=(0, 1, 2, pen, lifeline, written), written=MOST_WRITTEN)
        try:
            said, driven = _drive(told, grid, terms, number=number)
        except RacecraftError as error:
            _write(pen, json.dumps({"message": str(error), "hint": error.hint}).encode())
            return REFUSED
        _write(written, driven)
        _write(pen, json.dumps(said).encode())
    except Exception:
        _write(pen, traceback.format_exc().encode())
        return FAILED
    return DROVE


def _grid(told: dict[str, Any]) -> list[tuple[Path, str]]:
    """What drives and what it is called: an entry alone, or both of a heat."""
    folder = Path(told["folder"])
    if "grid" in told:
        return [(folder / one["file"], one["name"]) for one in told["grid"]]
    return [(folder / ENTRY, told["name"])]


def _terms(told: dict[str, Any]) -> Any:
    """What the race is held by."""
    from racecraft.contest.terms import RaceTerms
    from racecraft.race.announcement import Announcement
    from racecraft.sim.camera import CameraSpec
    from racecraft.track import load_track

    document = told["document"]
    announcement = Announcement(document=document, commitment=told["commitment"])
    camera = CameraSpec() if "grid" in told else None  # what a road that several share is told of
    return RaceTerms(
        kind=document["kind"],
        conditions=replace(announcement.conditions(load_track(told["track"])), seed=told["seed"], camera=camera),
        ranking=document["ranking"],
        minimum_laps=document["minimum_laps"],
        num_trials=document["trials"],
        announcement=announcement,
    )


def _drive(
    told: dict[str, Any], grid: list[tuple[Path, str]], terms: Any, *, number: int
) -> tuple[dict[str, Any], bytes]:
    """What the first child says of what drives, and the replay's file."""
    from racecraft.contest.contest import hold_race
    from racecraft.race.entry_file import read_entry_file
    from racecraft.race.likeness import hidden_choices
    from racecraft.replay.replay import pack_replay

    files = [(read_entry_file(path), name) for path, name in grid]
    entries = [file.entry(name, num_threads=number) for file, name in files]
    ((_, replay),) = hold_race(entries, terms, num_threads=number).replays()
    said: dict[str, Any] = {"steps": [entry.step for entry in entries]} if number == 1 else {}
    if number == 1 and "grid" not in told:
        choices = hidden_choices(entries[0], terms.conditions, seed=told["frames"])
        said = {"step": entries[0].step, "choices": choices.tolist()}
    return said, pack_replay(replay)


def _write(file: int, data: bytes) -> None:
    rest = memoryview(data)
    while rest:
        rest = rest[os.write(file, rest) :]


def _log(text: str) -> None:
    """A line for the operator; what a child says has no line of its own, and no control characters."""
    lines = "\n    ".join(text.splitlines())
    sys.stderr.write("".join(sign if sign.isprintable() or sign == "\n" else "?" for sign in lines) + "\n")
    sys.stderr.flush()


if __name__ == "__main__":
    sys.exit(main())
