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
