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
    "progress",  # fraction of the lap since the start, 0 to 1; may be slightly negative
    "offset",  # m, signed distance from the centre line, left of the driving direction positive
    "projection_distance",  # m along the centre line
    "track_width",  # m, at the car
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
