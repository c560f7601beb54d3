"""Tracks: geometry, a library of our own, files of others, a generator, pictures.

The first word of the data-flow line: track -> simulation -> observation -> policy -> action
"""

from racecraft.track.corners import TrackCorner, find_corners
from racecraft.track.generator import generate_track
from racecraft.track.library import Course, course, track_names
from racecraft.track.load import load_track
from racecraft.track.picture import TrackPicture, describe, draw_contact_sheet, draw_track
from racecraft.track.readers import read_centerline_csv, read_route, read_track, save_route
from racecraft.track.selection import join_names, joint_digest, load_tracks, single_names
from racecraft.track.sketch import Sketch, draw_road, sketch_of
from racecraft.track.track import Track
from racecraft.track.validate import validate

__all__ = [
    "Course",
    "Sketch",
    "Track",
    "TrackCorner",
    "TrackPicture",
    "course",
    "describe",
    "draw_contact_sheet",
    "draw_road",
    "draw_track",
    "find_corners",
    "generate_track",
    "join_names",
    "joint_digest",
    "load_track",
    "load_tracks",
    "read_centerline_csv",
    "read_route",
    "read_track",
    "save_route",
    "single_names",
    "sketch_of",
    "track_names",
    "validate",
]
