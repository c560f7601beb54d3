"""`film_replay`: a film of a replay file, of any of its cars, with any ghosts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from racecraft.errors import ConfigError
from racecraft.film.ghost import LIVERY, Ghost, Rival
from racecraft.film.ghost_source import load_ghosts
from racecraft.film.video import film
from racecraft.replay.replay import Replay, read_replay


def film_replay(
    source: str | Path, path: str | Path | None = None, *, car: int = 0, ghosts: Sequence[str] = ()
) -> Path:
    """Film one car of a replay; the others of its race are in the picture, those of other races are not.

    Args:
        source: Replay file.
        path: Where to, ending in ``.mp4``; by default beside the replay.
        car: Number of the car, from 1; 0 for the best.
        ghosts: As for `load_ghosts`; ``best-lap`` is the fastest lap of any of its cars.

    Raises:
        RacecraftError: The replay or a ghost cannot be read, there is no such car, or the film cannot be written.
    """
    replay = read_replay(source)
    if not 0 <= car <= len(replay.cars):
        raise ConfigError(f"Car {car} is not in the replay; allowed are 1 to {len(replay.cars)}, and 0 for the best.")
    index = car - 1 if car else replay.cars.index(replay.evaluation.best_trial)
    rivals = rivals_in(replay, index)
    shown: list[Ghost] = load_ghosts(
        ghosts,
        replay.conditions,
        recordings=[one.recording for one in replay.cars],
        colors=LIVERY[(1 + len(rivals)) % len(LIVERY) :],
    )
    size = replay.conditions.cars_per_race
    return film(
        replay.cars[index].recording,
        path or Path(source).with_suffix(".mp4"),
        name=replay.names[index],
        laps=replay.conditions.rules.laps,
        color=LIVERY[index % size % len(LIVERY)],
        camera=replay.conditions.camera,
        ghosts=shown,
        rivals=rivals,
    )


def rivals_in(replay: Replay, index: int) -> list[Rival]:
    """The other cars of a car's race."""
    size = replay.conditions.cars_per_race
    first = index // size * size
    return [
        Rival(replay.names[other], LIVERY[other % size % len(LIVERY)], replay.cars[other].recording)
        for other in range(first, first + size)
        if other != index
    ]
