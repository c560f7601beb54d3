"""Try a reward function on situations of a real track before training, a row each, start to finish.

`dry_run` calls the function once per situation and hands back its reward, or the error with line and
params. After an error the situations that follow are tried all the same, in a new worker. A function that remembers
may fail only because no car gets from one situation to the next: its error counts if it fails after a drive, too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from racecraft.errors import RewardError, RewardTimeout
from racecraft.reward.params import make_params
from racecraft.reward.rehearsal import FRONT, drive_to
from racecraft.reward.state import keeps_state
from racecraft.reward.worker import RewardWorker, waypoints_of
from racecraft.sim import NO_OBJECTS, Objects, Simulation, Start
from racecraft.sim.columns import OBJECT_COLUMNS, OBJECT_HEADER, ROW_COLUMNS, STATUS_NAMES, row_width

if TYPE_CHECKING:
    from racecraft.track.track import Track

STEP_SECONDS = 1.0 / 15.0  # between two calls for the same car
TYPICAL_SPEED = 1.5  # m/s
HALF_CAR = 0.08  # m from the car's middle line to its wheels
HALF_VIEW = math.radians(60.0)  # of the camera, to each side
MOST_TRACKS = 32  # of several that are tried
BEFORE_LINE = 0.05  # m at most that the last place of a lap is before its end
NEAR = 0.6  # m from an object's middle to the point that x and y mean
_X, _Y, _HEADING, _OFFSET, _DISTANCE = (
    OBJECT_COLUMNS.index(f"object_{name}") for name in ("x", "y", "heading", "offset", "distance")
)


@dataclass(frozen=True, eq=False)
class Situation:
    """A moment that a car can be in, as the row that the simulation would report."""

    name: str
    """Short name, unique among the situations."""
    description: str
    """What the car is doing, in one sentence."""
    row: npt.NDArray[np.float64]
    """The moment, (columns,) in the order of ``ROW_COLUMNS``; among objects their columns follow."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a reward function made of a situation."""

    situation: Situation
    """The situation."""
    params: dict[str, Any]
    """The dict that the function was given."""
    reward: float | None
    """The reward, or None after an error."""
    error: RewardError | None
    """The error, or None."""
    printed: str
    """What the function printed, up to 64 KB."""


def dry_run(
    source: str,
    track: Track,
    *,
    objects: Objects = NO_OBJECTS,
    cars_per_race: int = 1,
    timeout_s: float = 1.0,
    seed: int = 0,
    foreign: bool = False,
) -> list[Outcome]:
    """Call a reward function once in every situation; the rest is left out when a call did not return in its time.

    Args:
        source: Text of the user's ``reward_function.py``.
        track: The track that the situations lie on.
        objects: What stands and drives there: the run's own, as a function may rely on them.
        cars_per_race: Cars that share the track; the others are objects, too.
        timeout_s: How long one call may run, s of a core; see `RewardWorker`.
        seed: Seeds ``random`` and ``numpy.random``.
        foreign: The source is somebody else's; see `RewardWorker`.

    Raises:
        RewardError: The source cannot be loaded at all, or is foreign and cannot be locked in.
    """
    waypoints = waypoints_of([track])
    options: dict[str, Any] = {"seed": seed, "timeout_s": timeout_s, "foreign": foreign}
    options["num_objects"] = objects.count + cars_per_race - 1
    outcomes: list[Outcome] = []
    worker: RewardWorker | None = None
    try:
        for situation in situations(track, objects=objects, cars_per_race=cars_per_race):
            is_led = worker is None and bool(outcomes) and keeps_state(source)
            while True:
                if worker is None:
                    worker = RewardWorker(source, track, **options)
                reward, error = None, None
                try:
                    if is_led and (drive := drive_to(situation.row.tolist(), waypoints)):
                        worker(np.array(drive))
                        worker.read_log()
                    reward = float(worker(situation.row[None])[0])
                except RewardError as caught:
                    error = caught
                printed = worker.read_log()
                if error is None:
                    break
                worker.close()
                worker = None
                if is_led or isinstance(error, RewardTimeout) or not keeps_state(source):
                    break
                is_led = True
            params = make_params(situation.row.tolist(), waypoints)
            outcomes.append(Outcome(situation, params, reward, error, printed))
            if isinstance(error, RewardTimeout):
                break  # the others would most likely take as long
    finally:
        if worker is not None:
            worker.close()
    return outcomes


def dry_run_on(source: str, tracks: Sequence[Track], **options: Any) -> tuple[list[Outcome], RewardError | None]:
    """Call a reward function in every situation of each of a training's tracks, until it fails on one.

    Of more than `MOST_TRACKS` so many are tried, the first and the last among them: each takes its time.

    Args:
        source: Text of the user's ``reward_function.py``.
        tracks: That are learned on.
        options: Of `dry_run`.

    Returns:
        The outcomes on the first track, and the first error, whose hint names its track where there are several.

    Raises:
        RewardError: As for `dry_run`.
    """
    found: list[Outcome] = []
    for index in np.unique(np.linspace(0, len(tracks) - 1, min(len(tracks), MOST_TRACKS)).round().astype(int)):
        outcomes = dry_run(source, tracks[index], **options)
        found = found or outcomes
        for outcome in outcomes:
            if (error := outcome.error) is not None:
                where = f"It failed on the track {tracks[index].name!r}, one of {len(tracks)}."
                error.hint = "\n".join(filter(None, (where if len(tracks) > 1 else "", error.hint)))
                return found, error
    return found, None


def situations(track: Track, *, objects: Objects = NO_OBJECTS, cars_per_race: int = 1) -> list[Situation]:
    """The moments to try, all on the given track, with these objects and so many cars of a race on it."""
    found = _situations(track)
    if not objects.count + cars_per_race - 1:
        return found
    placed = [place_objects(track, objects, cars_per_race, direction) for direction in ("forward", "reverse")]
    track_index = ROW_COLUMNS.index("track_index")
    found = [replace(one, row=among(one.row, placed[int(one.row[track_index])])) for one in found]
    return [*found[:-1], *_beside_objects(track, placed[0]), found[-1]]


def _situations(track: Track) -> list[Situation]:
    # Well inside the lap, in either direction: only an episode's first steps are near its start.
    places = np.linspace(0.1, 0.9, 400) * track.length
    curvature = track.curvature_at(places)
    straight = float(places[np.abs(curvature).argmin()])
    left, right = float(places[curvature.argmax()]), float(places[curvature.argmin()])
    half = 0.5 * float(track.width_at(straight))
    # Between the last two waypoints, beyond which a function that looks ahead finds none.
    before_line = track.length - min(BEFORE_LINE, 0.5 * float(track.length - track.arc_length[-2]))
    other_way = track.reversed()
    return [
        Situation(
            "start",
            "First step of an episode, on the start line.",
            moment(track, FRONT, steps=2, progress=FRONT / track.length),
        ),
        Situation("straight", "Straight ahead on the centre line.", moment(track, straight, steps=40)),
        Situation(
            "bend left",
            "In the tightest bend to the left, steering into it.",
            moment(track, left, steps=60, steering_angle=math.radians(20)),
        ),
        Situation(
            "bend right",
            "In the tightest bend to the right, steering into it.",
            moment(track, right, steps=80, steering_angle=math.radians(-20)),
        ),
        Situation("slow", "On the centre line at half a metre a second.", moment(track, straight, speed=0.5)),
        Situation("fast", "On the centre line at four metres a second.", moment(track, straight, speed=4.0)),
        Situation(
            "left edge",
            "Two wheels over the left border.",
            moment(track, straight, steps=90, offset=half, wheels_on_track=False),
        ),
        Situation(
            "right edge",
            "Inside the right border, by a wheel's width.",
            moment(track, straight, steps=90, offset=-(half - HALF_CAR - 0.03)),
        ),
        Situation(
            "sideways",
            "On the centre line, looking across the track.",
            moment(track, straight, steps=90, heading_error=math.radians(80)),
        ),
        Situation(
            "backwards",
            "On the centre line, looking the wrong way.",
            moment(track, straight, steps=90, heading_error=math.pi),
        ),
        Situation(
            "off track",
            "All wheels beyond the right border, end of the episode.",
            moment(track, straight, steps=95, offset=-(half + 0.2), wheels_on_track=False, status="off_track"),
        ),
        Situation(
            "other way",
            "On the centre line, driving the track in the other direction.",
            moment(other_way, track.length - straight, steps=40, is_reversed=True),
        ),
        Situation(
            "on pace",
            "After exactly 100 steps, two thirds of the lap done.",
            moment(track, track.length * 2 / 3, steps=100, progress=2 / 3),
        ),
        Situation(
            "before the line",
            "On the last stretch of the lap, just before the finish line.",
            moment(track, before_line, steps=195),
        ),
        Situation(
            "finish",
            "The lap is complete.",
            moment(track, track.length, steps=200, progress=1.0, status="lap_complete"),
        ),
    ]


def place_objects(track: Track, objects: Objects, cars_per_race: int, direction: str) -> npt.NDArray[np.float64]:
    """Where the simulation puts objects and other cars at the beginning of an episode  (objects, columns)."""
    simulation = Simulation(
        track,
        num_envs=cars_per_race,
        camera=None,
        start=Start(mode="fixed"),
        direction=direction,
        objects=objects,
        cars_per_race=cars_per_race,
        num_threads=1,
    )
    return simulation.judged[0, row_width(0) + len(OBJECT_HEADER) :].reshape(-1, len(OBJECT_COLUMNS)).copy()


def _beside_objects(track: Track, objects: npt.NDArray[np.float64]) -> list[Situation]:
    """Moments that only a track with objects has, at the one that is nearest to half a lap."""
    objects = objects.copy()
    one = objects[np.abs(objects[:, _DISTANCE] - 0.5 * track.length).argmin()]
    if not 0.1 < one[_DISTANCE] / track.length < 0.9:  # another car, at its start: it has driven on
        place = 0.5 * track.length
        there = moment(track, place, offset=float(one[_OFFSET]))
        one[[_X, _Y, _HEADING, _DISTANCE]] = *there[[ROW_COLUMNS.index(name) for name in ("x", "y", "heading")]], place
    place, offset = float(one[_DISTANCE]), float(one[_OFFSET])
    near = moment(track, place - NEAR, steps=110, offset=offset)
    crash = moment(track, place - 0.5 * NEAR, steps=112, offset=offset, status="crashed")
    return [
        Situation("near an object", "Straight towards an object.", among(near, objects)),
        Situation("crash", "Into an object, end of the episode.", among(crash, objects)),
    ]


def among(rows: npt.NDArray[np.float64], objects: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Rows of a car among objects, as `place_objects` has them  (…, columns with theirs)."""
    values = {name: rows[..., index, None] for index, name in enumerate(ROW_COLUMNS)}
    ahead = (objects[:, _DISTANCE] - values["projection_distance"]) % values["track_length"]
    x, y = objects[:, _X] - values["x"], objects[:, _Y] - values["y"]
    angle = np.arctan2(y, x) - values["heading"]
    header = {
        "closest_object_prev": ahead.argmax(axis=-1),
        "closest_object_next": ahead.argmin(axis=-1),
        "object_in_camera": (np.cos(angle) > math.cos(HALF_VIEW)).any(axis=-1),
        "crashed_object": np.where(values["is_crashed"][..., 0], np.hypot(x, y).argmin(axis=-1), -1),
    }
    told = np.stack([header[name].astype(np.float64) for name in OBJECT_HEADER], axis=-1)
    return np.concatenate((rows, told, np.broadcast_to(objects.ravel(), (*rows.shape[:-1], objects.size))), axis=-1)


def moment(
    track: Track,
    s: float,
    *,
    steps: int = 50,
    speed: float = TYPICAL_SPEED,
    steering_angle: float = 0.0,
    offset: float = 0.0,
    heading_error: float = 0.0,
    progress: float | None = None,
    wheels_on_track: bool = True,
    is_reversed: bool = False,
    status: str = "in_progress",
) -> npt.NDArray[np.float64]:
    """The row of a car ``s`` metres along the track and ``offset`` metres left of its centre line."""
    direction = float(track.heading_at(s))
    center = track.point_at(s)
    place = s % track.length if track.is_closed else min(s, track.length)
    following = int(np.searchsorted(track.arc_length, place, side="right").clip(1, len(track.arc_length) - 1))
    values = {
        "episode": 0,
        "steps": steps,
        "x": center[0] - offset * math.sin(direction),
        "y": center[1] + offset * math.cos(direction),
        "heading": math.remainder(direction + heading_error, math.tau),
        "steering_angle": steering_angle,
        "speed": speed,
        "progress": s / track.length if progress is None else progress,
        "offset": offset,
        "projection_distance": place,
        "track_width": float(track.width_at(s)),
        "track_length": track.length,
        "closest_prev": int(track.waypoint_indices[following - 1]),
        "closest_next": int(track.waypoint_indices[following - 1]) + 1,
        "all_wheels_on_track": wheels_on_track,
        "is_offtrack": status == "off_track",
        "is_crashed": status == "crashed",
        "is_reversed": is_reversed,
        "status": STATUS_NAMES.index(status),
        "time": steps * STEP_SECONDS,
        "track_index": int(is_reversed),
        "actual_speed": speed,
        "actual_steering_angle": steering_angle,
        "lap": int(status == "lap_complete"),
    }
    return np.array([values[column] for column in ROW_COLUMNS], np.float64)
