"""One row of the simulation becomes the ``params`` dict of AWS DeepRacer: here and nowhere else.

The worker process loads this file by its path, without the rest of Racecraft, so it imports nothing.
It runs once per car and step: a copy of a template and plain assignments were the fastest form measured,
ahead of a dict literal (which CPython merges from pieces) and ``zip``.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    Waypoints = list[tuple[float, float]]

DEGREES = 57.29577951308232  # degrees in one radian; the same product as math.degrees

# A row has commands in float32, and angles in radians: 1.2999999523162842 where the action space says 1.3. The function
# gets the nearest decimal of as many digits as float32 holds there: the action space's own number, to the bit.
# `numeric.py` and `site/javascript.py` compute the same; tests compare them.
SPEED_PARTS = 1e6  # of 1 m/s
ANGLE_PARTS = 1e5  # of a degree
ANGLE_PARTS_OF_RADIAN = 5729577.951308232
WHOLE = 6755399441055744.0  # 1.5 * 2**52: added and taken off again it leaves a whole number, sooner than round()

# Layout of the columns, see racecraft.sim.columns; a test compares them.
ROW_SIZE = 24  # and behind it what is about objects
OBJECT_HEADER_SIZE = 4
OBJECT_SIZE = 7
FIRST_MOVING_KIND = 2.0  # boxes and parked cars have the heading 0 at AWS, whichever way they stand

TEMPLATE: dict[str, Any] = {
    "all_wheels_on_track": False,  # bool: all four wheel centres are on the road
    "x": 0.0,  # float, m: point 0.14 m ahead of the car's origin
    "y": 0.0,  # float, m
    "heading": 0.0,  # float, degrees: -180 to 180, 0 is +x, counter-clockwise positive
    "distance_from_center": 0.0,  # float, m: at least 0
    "projection_distance": 0.0,  # float, m along the centre line
    "progress": 0.0,  # float, percent of the lap since the start of the episode; 100 exactly where it is complete
    "steps": 0.0,  # float: the first call of an episode sees 2.0
    "speed": 0.0,  # float, m/s: commanded
    "steering_angle": 0.0,  # float, degrees: commanded, left positive
    "track_width": 0.0,  # float, m: beside the car's projection on the centre line
    "track_length": 0.0,  # float, m
    "waypoints": [],  # list of (x, y) in m, in the driving direction; first == last on a closed track
    "closest_waypoints": [0, 0],  # [int, int]: indices of the waypoint behind and the one ahead
    "is_left_of_center": False,  # bool: relative to the driving direction
    "is_reversed": False,  # bool: the driving direction is against the track's, not "the car is backwards"
    "closest_objects": [0, 0],  # [int, int]; the objects' keys have these values when there are none
    "objects_location": [],  # list of (x, y), m
    "objects_left_of_center": [],  # list of bool
    "object_in_camera": False,  # bool
    "objects_speed": [],  # list of float, m/s
    "objects_heading": [],  # list of float, rad (AWS's documentation says degrees, its code gives radians)
    "objects_distance_from_center": [],  # list of float, m
    "objects_distance": [],  # list of float, m along the centre line
    "is_crashed": False,  # bool
    "is_offtrack": False,  # bool: no wheel is on the road
    "sim_time": 0.0,  # float, simulated s since the reset
}


def make_params(row: Sequence[float], waypoints: Sequence[Waypoints]) -> dict[str, Any]:
    """The dict that ``reward_function`` receives.

    Every mutable value is fresh, as AWS makes a deep copy: nothing a function does to it reaches the next
    call.

    Args:
        row: One row of the simulation, its values in the order of ``racecraft.sim.columns.ROW_COLUMNS``; with
            objects followed by ``OBJECT_HEADER`` and ``OBJECT_COLUMNS`` of each.
        waypoints: For every track index, the centre line in the driving direction.
    """
    (
        _episode,
        steps,
        x,
        y,
        heading,
        steering_angle,
        speed,
        progress,
        offset,
        projection_distance,
        track_width,
        track_length,
        closest_prev,
        closest_next,
        all_wheels_on_track,
        is_offtrack,
        is_crashed,
        is_reversed,
        _status,
        time,
        track_index,
        _actual_speed,
        _actual_steering_angle,
        _lap,
    ) = row if len(row) == ROW_SIZE else row[:ROW_SIZE]  # a starred name at the end is slower
    heading_deg = heading * DEGREES
    if not -180.0 <= heading_deg <= 180.0:
        heading_deg = (heading_deg + 180.0) % 360.0 - 180.0

    params = TEMPLATE.copy()
    params["all_wheels_on_track"] = all_wheels_on_track != 0.0
    params["x"] = x
    params["y"] = y
    params["heading"] = heading_deg
    params["distance_from_center"] = abs(offset)
    params["projection_distance"] = projection_distance
    params["progress"] = progress * 100.0 if progress < 1.0 else 100.0  # however far a lap's last step leads
    params["steps"] = steps
    params["speed"] = (speed * SPEED_PARTS + WHOLE - WHOLE) / SPEED_PARTS
    params["steering_angle"] = (steering_angle * ANGLE_PARTS_OF_RADIAN + WHOLE - WHOLE) / ANGLE_PARTS
    params["track_width"] = track_width
    params["track_length"] = track_length
    params["waypoints"] = waypoints[int(track_index)].copy()
    params["closest_waypoints"] = [int(closest_prev), int(closest_next)]
    params["is_left_of_center"] = offset > 0.0
    params["is_reversed"] = is_reversed != 0.0
    params["closest_objects"] = [0, 0]
    params["objects_location"] = []
    params["objects_left_of_center"] = []
    params["objects_speed"] = []
    params["objects_heading"] = []
    params["objects_distance_from_center"] = []
    params["objects_distance"] = []
    params["is_crashed"] = is_crashed != 0.0
    params["is_offtrack"] = is_offtrack != 0.0
    params["sim_time"] = time
    if len(row) > ROW_SIZE:
        tell_objects(params, row[ROW_SIZE:])
    return params


def tell_objects(params: dict[str, Any], columns: Sequence[float]) -> None:
    """The keys about objects, from the columns behind a row's own."""
    prev, following, in_camera = columns[:3]
    offsets = columns[OBJECT_HEADER_SIZE + 5 :: OBJECT_SIZE]
    kinds = columns[OBJECT_HEADER_SIZE::OBJECT_SIZE]
    headings = columns[OBJECT_HEADER_SIZE + 3 :: OBJECT_SIZE]
    params["closest_objects"] = [int(prev), int(following)]
    params["object_in_camera"] = in_camera != 0.0
    params["objects_location"] = list(
        zip(
            columns[OBJECT_HEADER_SIZE + 1 :: OBJECT_SIZE],
            columns[OBJECT_HEADER_SIZE + 2 :: OBJECT_SIZE],
            strict=True,
        )
    )
    params["objects_left_of_center"] = [offset > 0.0 for offset in offsets]
    params["objects_speed"] = list(columns[OBJECT_HEADER_SIZE + 4 :: OBJECT_SIZE])
    params["objects_heading"] = [
        heading if kind >= FIRST_MOVING_KIND else 0.0 for heading, kind in zip(headings, kinds, strict=True)
    ]
    params["objects_distance_from_center"] = [abs(offset) for offset in offsets]
    params["objects_distance"] = list(columns[OBJECT_HEADER_SIZE + 6 :: OBJECT_SIZE])


def format_params(params: dict[str, Any]) -> str:
    """The dict as an error shows it: six digits, waypoints only counted, no keys of missing objects."""
    parts = []
    for key, value in params.items():
        if "object" in key and not params["objects_location"]:
            continue
        if key == "waypoints" and isinstance(value, list) and value:
            text = f"<{len(value)} points from {format_value(value[0])}>"
        else:
            text = format_value(value)
        parts.append(f"'{key}': {text}")
    return "{" + ", ".join(parts) + "}"


def format_value(value: object) -> str:
    """A number, or a list or tuple of numbers, to six significant digits."""
    if isinstance(value, float):
        text = f"{value:.6g}"
        return text if any(mark in text for mark in ".en") else text + ".0"
    if isinstance(value, list):
        return "[" + ", ".join(map(format_value, value)) + "]"
    if isinstance(value, tuple):
        return "(" + ", ".join(map(format_value, value)) + ")"
    return repr(value)
