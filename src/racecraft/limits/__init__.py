"""How fast a lap can be: the minimum lap time of a car on a track, its line, medals, and the distance from it."""

from racecraft.limits.limit import TrackLimit, compute_limit, known_limit, track_limit
from racecraft.limits.medals import MEDALS, Medals

__all__ = ["MEDALS", "Medals", "TrackLimit", "compute_limit", "known_limit", "track_limit"]
