"""`share`: an evaluation's best lap on one HTML page to be sent around: it opens offline, and the replay is inside.

    evaluation.replay -> best lap -> figures and medal, the lap (share.js), racing line, reward, the file itself

Who gets it can watch the lap, read the reward, and check every bit of it with `racecraft verify`.
"""

from __future__ import annotations

from html import escape
from pathlib import Path

from racecraft.analysis.report_page import page, section
from racecraft.analysis.share_page import LANGUAGES, Shown, line_of, number, proof, script, stage, words_of
from racecraft.analysis.share_picture import draw_line, finish_picture
from racecraft.errors import RunError, typed
from racecraft.json_file import read_json_object
from racecraft.limits import known_limit
from racecraft.race.recording import Recording
from racecraft.replay.replay import MAX_CELLS, Replay, read_replay
from racecraft.run import RunFolder, read_stretches, stretch_at
from racecraft.run.atomic import write_file
from racecraft.track.picture import describe


def write_share(run: str | Path, path: str | Path | None = None, *, stamp: str = "", language: str = "en") -> Path:
    """Write the page of a run's evaluation.

    Args:
        run: The run folder.
        path: Where to; by default ``share.html`` in the run folder.
        stamp: Of the evaluation; by default the newest that has a replay.
        language: ``en`` or ``de``.

    Raises:
        RunError: There is no evaluation with a replay, or the file cannot be written.
    """
    folder = RunFolder.open(run)
    if not stamp:
        found = [
            path
            for path in sorted(folder.path.glob("evaluation-*/evaluation.json"))
            if path.with_suffix(".replay").is_file()  # a very long race has none
        ]
        if not found:
            raise RunError(
                f"{folder.name} has no evaluation to share.", hint=f"racecraft evaluate {typed(folder.path)}"
            )
        stamp = found[-1].parent.name.removeprefix("evaluation-")
    target = Path(path) if path is not None else folder.path / "share.html"
    text = share(folder, stamp, language=language)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        write_file(target, text.encode())
    except OSError as error:
        raise RunError(f"{target} cannot be written: {error.strerror or error}.") from error
    return target


def share(folder: RunFolder, stamp: str, *, language: str = "en", max_numbers: int = MAX_CELLS) -> str:
    """The best lap of an evaluation as one HTML text; without a whole lap, the drive that came furthest.

    Args:
        folder: The run.
        stamp: Of the evaluation.
        language: ``en`` or ``de``.
        max_numbers: As for `read_replay`.

    Raises:
        RacecraftError: There is no such evaluation, or its files cannot be read.
    """
    replay, lap = _driven(folder, stamp, max_numbers)
    words = words_of(language)
    track, step = lap.track, _step(folder, stamp)
    title, _ = describe(track)
    figures = [(what, value, "") for what, value in _figures(replay, lap, words)]
    if step:
        figures.append((words["trained"], f"{number(step, 0, words)} {words['steps']}", ""))
    sections = [
        section(words["line"], line_of(lap, words)),
        section(words["reward"], f"<pre>{escape(_reward(folder, step))}</pre>"),
        section(words["proof"], proof(_file(folder, stamp), f"{folder.name}.replay", words["proof_lead"], words)),
    ]
    return page(
        folder.name,
        f"{escape(title)} · {escape(words['made'])}",
        figures,
        stage([Shown("", lap)], words, heading=words["replay"]),
        sections,
        versions=folder.read_info().versions,
        script=script(),
        language=language if language in LANGUAGES else "en",
    )


def draw_share(
    folder: RunFolder, stamp: str, path: Path, *, language: str = "en", max_numbers: int = MAX_CELLS
) -> Path:
    """The same lap as a picture: racing line, time, medal and reward, with the replay file inside; else as `share`.

    Raises:
        RacecraftError: There is no such evaluation, or the picture cannot be written.
    """
    replay, lap = _driven(folder, stamp, max_numbers)
    words = words_of(language)
    title, _ = describe(lap.track)
    figures = [(what.upper(), value) for what, value in _figures(replay, lap, words)]
    draw_line(lap, path, title=folder.name, subtitle=title, figures=figures, words=words)
    reward = _reward(folder, _step(folder, stamp))
    return finish_picture(path, words["reward"], reward, replay=_file(folder, stamp))


def _driven(folder: RunFolder, stamp: str, max_numbers: int) -> tuple[Replay, Recording]:
    path = folder.evaluation_replay(stamp)
    if not (stamp.isascii() and stamp.isdigit()) or not path.is_file():
        raise RunError(f"{folder.name} has no evaluation {stamp[:40]!r} with a replay.", hint="Evaluate it once more.")
    replay = read_replay(path, max_numbers=max_numbers)
    whole = [
        (seconds, index, number)
        for index, car in enumerate(replay.cars)
        for number, seconds in car.recording.lap_times.items()
    ]
    if whole:
        _, index, number = min(whole)
        return replay, replay.cars[index].recording.lap(number)
    return replay, replay.evaluation.best_trial.recording


def _figures(replay: Replay, lap: Recording, words: dict[str, str]) -> list[tuple[str, str]]:
    times = list(lap.lap_times.values())
    if not times:
        found = [(words["part"], f"{number(100 * float(lap.column('progress').max(initial=0.0)), 0, words)} %")]
    else:
        found = [(words["lap"], f"{number(times[0], 3, words)} s")]
        if medal := _medal(replay, lap):
            found.append((words["medal"], words[medal]))
    return [*found, (words["top"], f"{number(float(lap.column('actual_speed').max()), 2, words)} m/s")]


def _medal(replay: Replay, lap: Recording) -> str:
    if replay.conditions.randomize.changes_car:  # medals are those of its parameters' car
        return ""
    limit, times = known_limit(lap.track, replay.conditions.vehicle), list(lap.lap_times.values())
    return limit.medals.won_by(times[0]) if limit is not None and times else ""


def _step(folder: RunFolder, stamp: str) -> int:
    step = read_json_object(folder.evaluation(stamp) / "evaluation.json").get("step")
    return step if isinstance(step, int) and not isinstance(step, bool) else 0


def _reward(folder: RunFolder, step: int) -> str:
    """What the policy that drove had learned with last."""
    stretches = read_stretches(folder)
    return stretch_at(stretches, step).reward_function if stretches else folder.read_reward_function()


def _file(folder: RunFolder, stamp: str) -> bytes:
    return folder.evaluation_replay(stamp).read_bytes()
