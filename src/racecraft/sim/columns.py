"""Names of what a simulation step reports, in the order of the arrays that hold it.

One row is what the rules judged about one car in one step: the pose before the action, with the action's
command. All values are float64 in SI units and radians, booleans are 0 or 1.
"""

from __future__ import annotations

from typing import Final

ROW_COLUMNS: Final = (
    "episode",  # number of the car's episode, from 0
    "steps",  # steps since the reset; the first judged step of an episode is 2
    "x",  # m, point 0.14 m ahead of the car's origin
    "y",  # m
    "heading",  # rad, counter-clockwise from +x
    "steering_angle",  # rad, commanded, left positive
    "speed",  # m/s, commanded
    "progress",  # fraction of the lap since the start, 0 to 1; slightly negative at first, beyond 1 after its last step
    "offset",  # m, signed distance from the centre line, left of the driving direction positive
    "projection_distance",  # m along the centre line
    "track_width",  # m, from border to border where both are nearest to the car's projection on the centre line
    "track_length",  # m
    "closest_prev",  # index of the waypoint behind
    "closest_next",  # index of the waypoint ahead
    "all_wheels_on_track",  # 0 or 1
    "is_offtrack",  # 0 or 1: no wheel is on the track
    "is_crashed",  # 0 or 1
    "is_reversed",  # 0 or 1: the car is to drive against the track's direction
    "status",  # index into STATUS_NAMES
    "time",  # simulated s since the reset
    "track_index",  # index into the simulation's tracks; the reversed twin of track i is i + number of tracks
    "actual_speed",  # m/s
    "actual_steering_angle",  # rad
    "lap",  # completed laps
)

OBJECT_HEADER: Final = (
    "closest_object_prev",  # index of the object behind, along the track
    "closest_object_next",  # and of the one ahead
    "object_in_camera",  # 0 or 1
    "crashed_object",  # index of the object that the car ran into in this step, or -1
)
"""Columns that follow a row's own where there are objects."""

OBJECT_COLUMNS: Final = (
    "object_kind",  # index into racecraft.sim.objects.OBJECT_KINDS
    "object_x",  # m
    "object_y",  # m
    "object_heading",  # rad
    "object_speed",  # m/s
    "object_offset",  # m, from the centre line, left of the driving direction positive
    "object_distance",  # m along the centre line
)
"""Columns of every object, behind those of `OBJECT_HEADER`."""

STATE_COLUMNS: Final = (
    "speed",  # over 4 m/s
    "lateral_speed",  # m/s
    "yaw_rate",  # over 4 rad/s
    "steering",  # of the front wheels, over 30 degrees
    "offset",  # from the centre line over half the track width, left positive
    "sin_heading_error",  # heading of the car against that of the centre line
    "cos_heading_error",
    "half_width",  # m, half the track width at the car
    "curvature_0",  # 1/m, of the centre line at the car, left positive
    "curvature_1",  # and further ahead, at CURVATURE_AHEAD
    "curvature_2",
    "curvature_3",
    "curvature_4",
    "curvature_5",
    "curvature_6",
    "curvature_7",
)

OBJECT_STATE_COLUMNS: Final = tuple(
    f"{name}_{i}"
    for i in range(2)
    for name in (
        "object_closeness",  # of the next object ahead along the track and the one after: 1 / (1 + m ahead), 0 if none
        "object_offset",  # from the centre line over half the track width there
        "object_speed",  # over 4 m/s
    )
)
"""Columns that follow the state's own where there are objects."""

CURVATURE_AHEAD: Final = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0)
"""m ahead of the car where the curvature columns of the state look."""

STATUS_NAMES: Final = (
    "prepare",
    "in_progress",
    "lap_complete",
    "crashed",
    "off_track",
    "immobilized",
    "reversed",
    "time_up",
    "pause",
    "park",
)


def row_width(num_objects: int) -> int:
    """Columns of a judged row with so many objects."""
    more = len(OBJECT_HEADER) + num_objects * len(OBJECT_COLUMNS) if num_objects else 0
    return len(ROW_COLUMNS) + more


def state_width(num_objects: int) -> int:
    """Columns of the state with so many objects."""
    return len(STATE_COLUMNS) + (len(OBJECT_STATE_COLUMNS) if num_objects else 0)
