"""Refuses a track that cannot be driven, with the reason and the place. Bounded in time for any input.

Foreign files go through here; the library's own tracks are validated by the tests instead, so loading one
stays free of shapely. Each check below assumes the ones before it, and the first that fails speaks.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from racecraft.errors import TrackError
from racecraft.track.polyline import Floats, signed_area, wrap_angle
from racecraft.track.track import SAME_POINT, Track

MIN_WAYPOINTS = 4  # different ones; a triangle is no circuit
MAX_WAYPOINTS = 10_000  # AWS's longest route has 401, TUM's longest circuit about 2,500
MAX_COORDINATE = 10_000.0  # metres from the origin; beyond, the file is in other units or another frame
MIN_WIDTH = 0.1  # metres; a DeepRacer is 0.2 m wide
MAX_WIDTH = 100.0  # metres
MIN_LENGTH = 1.0  # metres
MAX_TURN = np.radians(135.0)  # between two pieces of centre line; AWS's sharpest kink is 85 degrees
MAX_DETOUR = 1.5  # inner to centre to outer, over inner to outer; AWS's worst is 1.13


def check_rows(lines: dict[str, Floats], *, name: str) -> None:
    """Refuses coordinates that no `Track` should be built from; for readers, before construction.

    Args:
        lines: Name and points (W, 2) of each line, centre line first.
        name: The track's name, for the message.

    Raises:
        TrackError: Too few or too many points, not finite, absurdly far away, or many duplicates.
    """
    centerline = next(iter(lines.values()))
    num_points = len(centerline)
    if num_points < MIN_WAYPOINTS:
        raise TrackError(f"Track {name!r} has {num_points} waypoints; at least {MIN_WAYPOINTS} are needed.")
    if num_points > MAX_WAYPOINTS:
        raise TrackError(
            f"Track {name!r} has {num_points:,} waypoints; at most {MAX_WAYPOINTS:,} are allowed.",
            hint="Resample it: a waypoint every 0.1 to 0.3 m is plenty.",
        )
    for line_name, line in lines.items():
        bad = np.flatnonzero(~(np.abs(line) <= MAX_COORDINATE).all(axis=1))
        if bad.size:
            x, y = line[bad[0]]
            raise TrackError(
                f"Track {name!r}: {line_name}[{bad[0]}] is ({x:g}, {y:g}); coordinates are metres, "
                f"finite and within {MAX_COORDINATE:,.0f} of the origin."
            )
    repeated = np.flatnonzero(np.hypot(*np.diff(centerline, axis=0).T) <= SAME_POINT)
    allowed = max(2, num_points // 50)
    if repeated.size > allowed:
        raise TrackError(
            f"Track {name!r} repeats {repeated.size} of its {num_points} waypoints, "
            f"the first at row {repeated[0] + 1}; at most {allowed} repeats are taken as harmless.",
            hint="Remove consecutive duplicates.",
        )


def validate(track: Track) -> None:
    """Refuses a track that cannot be driven.

    A good track has a centre line and borders that cross neither themselves nor each other, a width of at
    least 0.1 m everywhere, borders that run along the centre line, and, if closed, an inner border inside
    the outer one.

    Raises:
        TrackError: With the first reason found and, where there is one, the place.
    """
    lines = {"centerline": track.centerline, "inner": track.inner, "outer": track.outer}
    check_rows(lines, name=track.name)
    _check_centerline(track)
    _check_widths(track)
    _check_crossings(track)


def _check_centerline(track: Track) -> None:
    name = track.name
    num_different = len(track.centerline) - track.is_closed
    if num_different < MIN_WAYPOINTS:
        raise TrackError(f"Track {name!r} has {num_different} different waypoints; it needs {MIN_WAYPOINTS} or more.")
    if track.length < MIN_LENGTH:
        raise TrackError(f"Track {name!r} is {track.length:.3g} m long; at least {MIN_LENGTH:g} m are needed.")
    steps = np.diff(track.centerline, axis=0)
    gap = float(np.hypot(*(track.centerline[-1] - track.centerline[0])))
    longest = float(np.hypot(*steps.T).max())
    if not track.is_closed and gap <= 2.0 * longest:
        raise TrackError(
            f"Track {name!r} ends {gap:.3g} m from where it begins, neither open nor closed.",
            hint="Repeat the first row as the last one to close it.",
        )
    if track.is_closed and not (_is_ring(track.inner) and _is_ring(track.outer)):
        raise TrackError(
            f"Track {name!r} has a closed centre line, but a border that does not end where it begins.",
            hint="Repeat the whole first row, borders included, as the last one.",
        )
    heading = np.arctan2(steps[:, 1], steps[:, 0])
    turn = np.abs(wrap_angle(np.diff(heading, append=heading[:1] if track.is_closed else heading[-1:])))
    sharpest = int(turn.argmax())
    if turn[sharpest] > MAX_TURN:
        x, y = steps[: sharpest + 1].sum(axis=0) + track.centerline[0]
        raise TrackError(
            f"Track {name!r} turns by {np.degrees(turn[sharpest]):.0f} degrees at one waypoint, "
            f"near ({x:.2f}, {y:.2f}); at most {np.degrees(MAX_TURN):.0f} are allowed."
        )


def _check_widths(track: Track) -> None:
    name, widths = track.name, np.hypot(*(track.inner - track.outer).T)  # of the rows, which may be slanted
    for row, is_bad, limit in (
        (int(widths.argmin()), widths.min() < MIN_WIDTH, f"at least {MIN_WIDTH:g}"),
        (int(widths.argmax()), widths.max() > MAX_WIDTH, f"at most {MAX_WIDTH:g}"),
    ):
        if is_bad:
            raise TrackError(f"Track {name!r} is {widths[row]:.3g} m wide at waypoint {row}; {limit} m is allowed.")
    detour = np.hypot(*(track.centerline - track.inner).T) + np.hypot(*(track.centerline - track.outer).T)
    row = int((detour / widths).argmax())
    if detour[row] > MAX_DETOUR * widths[row]:
        raise TrackError(
            f"Track {name!r}: at waypoint {row} the centre line is not between its borders; "
            "row by row, inner and outer point must face each other across the centre.",
            hint="Do the borders start at the same place and run the same way as the centre line?",
        )


def _check_crossings(track: Track) -> None:
    import shapely

    name = track.name
    points = {"centre line": track.centerline, "inner border": track.inner, "outer border": track.outer}
    lines = {line_name: shapely.LineString(line) for line_name, line in points.items()}
    for line_name, line in lines.items():
        if not line.is_simple:
            place = _where(points[line_name], points[line_name])
            raise TrackError(f"Track {name!r}: its {line_name} crosses or touches itself{place}.")
    for first, second in combinations(points, 2):
        if lines[first].intersects(lines[second]):
            place = _where(points[first], points[second])
            raise TrackError(f"Track {name!r}: its {first} crosses its {second}{place}.")
    if track.is_closed:
        inside, outside = shapely.Polygon(track.inner), shapely.Polygon(track.outer)
        centre = lines["centre line"]
        if not outside.contains(inside) or not outside.contains(centre) or inside.contains(centre):
            raise TrackError(
                f"Track {name!r}: its inner border does not lie inside its outer one, with the centre line between.",
                hint="Columns 3 and 4 are the inner border, 5 and 6 the outer one.",
            )
        if (signed_area(track.inner) > 0) != (signed_area(track.outer) > 0):
            raise TrackError(f"Track {name!r}: its borders run round it in opposite directions.")
    elif not shapely.Polygon(np.concatenate((track.inner, track.outer[::-1]))).is_valid:
        raise TrackError(f"Track {name!r}: its borders do not bound one stretch of road; its ends cross.")


def _is_ring(line: Floats) -> bool:
    return bool((line[0] == line[-1]).all())


def _where(first: Floats, second: Floats) -> str:
    """The first place where two lines meet, for the message; joints within one line do not count."""
    import shapely

    others = np.asarray(shapely.linestrings(np.stack((second[:-1], second[1:]), axis=1)))
    tree = shapely.STRtree(others)
    pieces = np.asarray(shapely.linestrings(np.stack((first[:-1], first[1:]), axis=1)))
    for start in range(0, len(pieces), 64):
        index, other = tree.query(pieces[start : start + 64], predicate="intersects")
        index = index + start
        if first is second:
            apart = np.abs(index - other)
            index = index[(apart > 1) & (apart < len(pieces) - 1)]
        if index.size:
            x, y = first[index.min()]
            return f" near ({x:.2f}, {y:.2f})"
    return ""
