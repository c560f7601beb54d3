"""Where ghosts come from: a replay file, another model, an earlier checkpoint of the same run, the best lap.

FILE.replay        its best car
RUN, RUN@STEP      that model drives the same race, alone
@STEP              the same run's checkpoint does
best-lap           the fastest lap of what is filmed, from the start of every lap
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from racecraft.checks import check_type
from racecraft.errors import ConfigError
from racecraft.film.ghost import LIVERY, MAX_GHOSTS, Ghost, best_lap_ghost, ghost_of
from racecraft.race.conditions import Conditions
from racecraft.race.entry import load_entry
from racecraft.race.evaluation import evaluate
from racecraft.race.placement import driven_track
from racecraft.race.recording import Recording
from racecraft.race.rules import RaceRules
from racecraft.replay.replay import MAX_CELLS, read_replay
from racecraft.track.canvas import Color
from racecraft.track.track import Track

BEST_LAP: Final = "best-lap"


def load_ghosts(
    sources: Sequence[str],
    conditions: Conditions,
    *,
    run: Path | None = None,
    trial: int = 0,
    recordings: Sequence[Recording] = (),
    colors: Sequence[Color] = LIVERY[1:],
) -> list[Ghost]:
    """The ghosts that somebody asks for.

    Args:
        sources: As above.
        conditions: Of the race that they accompany: models drive by these, a replay must be of the same road.
        run: What ``@STEP`` is a checkpoint of.
        trial: Which is filmed, from 0, of a race whose trials start all over the lap: models drive the same one.
        recordings: What ``best-lap`` is taken from.
        colors: Of the ghosts, in order.

    Raises:
        ConfigError: A source means nothing here, or a replay is of another road.
        RacecraftError: A replay or a model cannot be read.
    """
    _check_number(sources)
    found = []
    for index, source in enumerate(sources):
        color = (colors or LIVERY)[index % len(colors or LIVERY)]
        if source == BEST_LAP:
            if (ghost := best_lap_ghost(recordings, color=color)) is not None:
                found.append(ghost)
        elif Path(source).is_file():
            found.append(_from_replay(Path(source), conditions.track, conditions.rules, color))
        else:
            found.append(_from_model(source, conditions, color, run=run, trial=trial))
    return found


def check_sources(
    sources: Sequence[str], track: Track, rules: RaceRules, *, run: Path | None, max_numbers: int = MAX_CELLS
) -> None:
    """Refuse before a race what `load_ghosts` would refuse after it, and replays of more than `max_numbers` numbers.

    Raises:
        ConfigError: A source means nothing here, or a replay is of another road.
        RacecraftError: A replay or a model cannot be read.
    """
    _check_number(sources)
    for source in sources:
        if source == BEST_LAP:
            continue
        if Path(source).is_file():
            _from_replay(Path(source), track, rules, LIVERY[0], max_numbers)
        else:
            load_entry(_model(source, run))


def _check_number(sources: Sequence[str]) -> None:
    is_list = isinstance(sources, Sequence) and not isinstance(sources, str | bytes)
    if not is_list or not all(isinstance(source, str) for source in sources):
        check_type("ghosts", sources, (), f"use a list such as [{BEST_LAP!r}]")
    if len(sources) > MAX_GHOSTS:
        raise ConfigError(f"There are {len(sources)} ghosts; allowed are up to {MAX_GHOSTS}.")


def _from_replay(path: Path, track: Track, rules: RaceRules, color: Color, max_numbers: int = MAX_CELLS) -> Ghost:
    replay = read_replay(path, max_numbers=max_numbers)
    best = replay.evaluation.best_trial
    driver = replay.names[best.index]
    name = driver if replay.race else replay.title or driver  # of an evaluation only its title says who drove
    theirs, ours = driven_track(replay.conditions.track, replay.conditions.rules), driven_track(track, rules)
    if theirs.digest != ours.digest:
        raise ConfigError(
            f"The ghost {name!r} drove on {theirs.name}, in another direction or of another form than {ours.name}.",
            hint="Choose a replay of the same track and direction.",
        )
    return ghost_of(best.recording, name=name, color=color)


def _from_model(source: str, conditions: Conditions, color: Color, *, run: Path | None, trial: int) -> Ghost:
    entry, rules = load_entry(_model(source, run)), conditions.rules
    is_from_line = rules.starts == "line"
    evaluation = evaluate(
        entry,
        conditions.track,
        rules=replace(rules, lateral_jitter=0.0, heading_jitter=0.0) if is_from_line else rules,
        num_trials=1 if is_from_line else trial + 1,
        seed=conditions.seed,
        vehicle=conditions.vehicle,
        objects=conditions.objects,
        randomize=conditions.randomize,
    )
    return ghost_of(evaluation.trials[-1].recording, name=entry.name, color=color)


def _model(source: str, run: Path | None) -> str:
    if not source.startswith("@"):
        return source
    if run is None:
        raise ConfigError(f"The ghost {source!r} is a checkpoint of no run; name it as RUN{source}.")
    return f"{run}{source}"
