"""Draws a new closed track from a seed: always drivable, never twice the same, the same on every machine.

Two kinds of layout, as the seed has it, and one on demand, all rounded by `curve.trace_corners`:

    street    the outline of random squares that hang together, shaken: parallel roads, right angles, hairpins
    country   points around a middle, some pulled in: sweepers, long bends, open radii
    folded    a street whose squares branch like a tree: hairpins to either side, one behind the other

A draft that comes too close to itself or bends too tightly is thrown away; after many of them, an oval.
"""

from __future__ import annotations

import math
import random

import numpy as np

from racecraft.checks import is_number
from racecraft.errors import TrackError
from racecraft.track.curve import Corner, road_along, trace_corners
from racecraft.track.polyline import Floats, arc_length, resample, signed_area, wrap_angle
from racecraft.track.track import Track

MIN_LENGTH, MAX_LENGTH = 12.0, 200.0  # metres
MIN_WIDTH, MAX_WIDTH = 0.5, 2.0  # metres
SHORTEST_LAP = 14.0  # times the width; shorter, no bend is both inside the lap and wide enough
TIGHTEST_RADIUS = 0.7  # metres; a DeepRacer turns on about 0.3 m at full lock, slowly
VERGE = 0.3  # metres of ground between two stretches of road, at least
NARROW_VERGE = 0.1  # metres; the same where a radius is asked for, as some official tracks have it
MIN_VERGE, MAX_VERGE = 0.1, 1.0  # metres, where a road is to fold; an oval has more
MIN_RADIUS, MAX_RADIUS = 0.35, 5.0  # metres
_DRAFTS = 300


def generate_track(
    seed: int,
    *,
    length: float | None = None,
    width: float | None = None,
    difficulty: float = 0.5,
    radius: float | None = None,
    verge: float | None = None,
) -> Track:
    """A new closed track, the same for the same arguments everywhere.

    Args:
        seed: Any integer from 0.
        length: Length of a lap, metres, 12 to 200 and at least 14 times the width; met to 1 %. Default: 16
            to 45, by seed.
        width: Width of the road, metres, 0.5 to 2. Default: 0.7 to 1.1, by seed.
        difficulty: 0 (few, wide bends) to 1 (many, tight ones).
        radius: Tightest bend of the centre line, metres, 0.35 to 5, but at least 0.52 times the width; roads may
            then come as close as 0.1 m. Default: 0.7, and more for a wide road; official tracks go down to 0.4.
        verge: Least ground between two stretches of road, metres, 0.1 to 1; with it the road folds into hairpins to
            either side, the closer the higher the difficulty. Default: it need not fold, and leaves 0.3.

    Returns:
        A track whose name, given to `load_track`, brings it back.

    Raises:
        TrackError: An argument is out of range.
    """
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or not 0 <= seed < 2**63:
        raise TrackError(f"seed is {seed!r}; allowed are integers from 0.")
    options = {"length": length, "width": width, "difficulty": difficulty, "radius": radius, "verge": verge}
    ranges = {
        "length": (MIN_LENGTH, MAX_LENGTH),
        "width": (MIN_WIDTH, MAX_WIDTH),
        "difficulty": (0.0, 1.0),
        "radius": (MIN_RADIUS, MAX_RADIUS),
        "verge": (MIN_VERGE, MAX_VERGE),
    }
    for key, value in options.items():
        lowest, highest = ranges[key]
        if value is None and key != "difficulty":
            continue
        if value is None or not is_number(value, is_plain=False) or not lowest <= value <= highest:
            raise TrackError(f"{key} is {value!r}; allowed are {lowest:g} to {highest:g}.")
    if difficulty == 0.5:
        del options["difficulty"]  # which the name need not say
    rng = random.Random(int(seed))  # only its random(), whose sequence Python promises to keep
    road_width = _between(rng, 0.7, 1.1) if width is None else float(width)
    lap = max(_between(rng, 16.0, 45.0) + 12.0 * difficulty * rng.random(), 1.2 * SHORTEST_LAP * road_width)
    lap = lap if length is None else float(length)
    if lap < SHORTEST_LAP * road_width:
        raise TrackError(
            f"length is {lap:g} m at a width of {road_width:g} m; a lap is at least {SHORTEST_LAP:g} times the width."
        )
    given = "".join(f",{key}={_plain(value)}" for key, value in options.items() if value is not None)
    name = f"generated:{int(seed)}{given}"
    is_clockwise = rng.random() < 0.5
    is_street = rng.random() < 0.5 or verge is not None
    roundness = (0.05 if is_street else 0.13) * lap  # metres of radius that chance may add to the tightest
    room = _Room(road_width, radius, verge)
    for draft in range(_DRAFTS):
        # a draft that fails too often was too ambitious: become simpler
        ambition = difficulty * (1.0 - draft / _DRAFTS)
        corners = (_street if is_street else _country)(rng, lap, room, ambition)
        line = None if corners is None else _fit(corners, lap, room, rng, roundness * (1.0 - 0.8 * ambition))
        if line is not None and _is_clear(line, room):
            break
    else:
        line = _oval(lap, room)
    line = _from_longest_straight(line)
    if is_clockwise:
        line = line[::-1]
    return road_along(line, road_width, name=name, is_clockwise=is_clockwise)


def parse_generated(name: str) -> Track:
    """The track that a name such as ``generated:7,length=40`` describes.

    Raises:
        TrackError: The seed or an option cannot be read, or is out of range.
    """
    seed, *options = name.removeprefix("generated:").split(",")
    values: dict[str, float] = {}
    for option in options:
        key, _, value = option.partition("=")
        try:
            values[key] = float(value)
        except ValueError:
            values[key] = math.nan
        if key not in {"length", "width", "difficulty", "radius", "verge"} or math.isnan(values[key]):
            allowed = "length=, width=, difficulty=, radius= and verge="
            raise TrackError(f"{option!r} in {name[:80]!r} is no option; allowed are {allowed}.")
    if not (seed.isascii() and seed.isdigit() and len(seed) < 20):
        raise TrackError(f"{name[:80]!r} has no seed; write an integer after the colon, as in 'generated:7'.")
    return generate_track(int(seed), **values)


class _Room:
    """What a road of some width needs around it, metres."""

    def __init__(self, width: float, radius: float | None, verge: float | None) -> None:
        self.width = width
        self.is_folded = verge is not None
        self.verge = verge if verge is not None else VERGE if radius is None else NARROW_VERGE
        self.sharpest = max(TIGHTEST_RADIUS, width / 2 + VERGE / 2) if radius is None else max(radius, 0.52 * width)
        # smallest radius to draw: room for a verge inside a hairpin
        self.tightest = 1.02 * (
            max(TIGHTEST_RADIUS, 0.54 * (width + VERGE)) if radius is None else max(radius, 0.52 * width)
        )

    @property
    def side(self) -> float:
        """Of a street's squares: neighbouring roads are one apart, before they are shaken."""
        if self.is_folded:
            return max(self.width + self.verge, 2 * self.tightest) * 1.04
        return max(self.width + self.verge + 0.4, 2 * self.tightest + 0.2) * 1.12


# --- layouts: corner points of a counter-clockwise polygon, of any scale


def _street(rng: random.Random, lap: float, room: _Room, difficulty: float) -> Floats | None:
    """The outline of random squares grown from one, without a hole, its corners shaken."""
    # each square beyond the first adds two sides to the lap
    most = int((lap / room.side * 1.12 - 2) / 2)
    if most < 2:
        return None
    num_squares = max(2, min(most, round(2 + 9 * difficulty + 2 * rng.random()), 26))
    squares = {(0, 0)}
    for _ in range(200):
        if len(squares) == num_squares:
            break
        x, y = sorted(squares)[_pick(rng, len(squares))]
        dx, dy = ((1, 0), (0, 1), (-1, 0), (0, -1))[_pick(rng, 4)]
        square = (x + dx, y + dy)
        if room.is_folded and _num_beside(squares, square) > 1:
            continue
        if square not in squares and _keeps_one_outline(squares, square):
            squares.add(square)
    points = _outline(squares)
    stretch, angle = _between(rng, 1.0, 1.45), _between(rng, 0.0, 2 * math.pi) if rng.random() < 0.5 else 0.0
    shake = _between(rng, 0.0, 0.16)
    points = points + np.array([[_between(rng, -shake, shake), _between(rng, -shake, shake)] for _ in points])
    points = points * np.array([stretch, 1.0])
    cos, sin = math.cos(angle), math.sin(angle)
    turned: Floats = points @ np.array([[cos, sin], [-sin, cos]])
    return turned


def _country(rng: random.Random, lap: float, room: _Room, difficulty: float) -> Floats | None:
    """Points round a middle at uneven angles, some of them pulled in."""
    most = max(4, int(lap / (3.2 * room.tightest)))
    num_points = max(4, min(most, round(5 + 8 * difficulty + 2 * rng.random())))
    stretch = _between(rng, 1.0, 1.9)
    phase = _between(rng, 0.0, 2 * math.pi)
    points = []
    for index in range(num_points):
        angle = phase + 2 * math.pi * (index + _between(rng, -0.28, 0.28)) / num_points
        is_pulled = rng.random() < 0.2 + 0.3 * difficulty
        distance = _between(rng, 0.42, 0.7) if is_pulled else _between(rng, 0.85, 1.15)
        points.append((stretch * distance * math.cos(angle), distance * math.sin(angle)))
    return np.array(points)


def _fit(points: Floats, lap: float, room: _Room, rng: random.Random, roundness: float) -> Floats | None:
    """The rounded line through a polygon, scaled to the length of the lap; none if a bend gets too tight."""
    tightest = room.tightest
    wanted = [1.05 * tightest + (0.3 * tightest + roundness) * rng.random() for _ in points]
    scale = 1.1 * lap / float(arc_length(np.concatenate((points, points[:1])))[-1])
    for _ in range(4):
        corners = _rounded(points * scale, wanted, tightest)
        if corners is None:
            return None
        line = trace_corners(corners, ease=0.5)
        length = float(arc_length(line)[-1])
        if abs(length - lap) < 0.003 * lap:
            return line
        scale *= lap / length
    return line * (lap / length)


def _rounded(points: Floats, wanted: list[float], tightest: float) -> list[Corner] | None:
    """Each point with the largest radius up to the wanted one that leaves its neighbours room for theirs."""
    into = points - np.roll(points, 1, axis=0)
    out = np.roll(into, -1, axis=0)
    cross, dot = into[:, 0] * out[:, 1] - into[:, 1] * out[:, 0], (into * out).sum(axis=1)
    half_tangent = np.tan(np.abs(np.arctan2(cross, dot)) / 2)
    sides = np.hypot(*into.T)
    radius = np.array(wanted)
    for _ in range(12):
        reach = radius * half_tangent
        # how far both arcs of a side overshoot it, shared in proportion
        share = np.minimum(1.0, 0.97 * sides / np.maximum(reach + np.roll(reach, 1), 1e-9))
        radius = radius * np.minimum(share, np.roll(share, -1))
    if (radius < tightest)[half_tangent > 0.12].any():
        return None
    return [(float(x), float(y), float(r)) for (x, y), r in zip(points, radius, strict=True)]


def _is_clear(line: Floats, room: _Room) -> bool:
    """True when no two stretches of road come close and no bend is tighter than allowed."""
    length = float(arc_length(line)[-1])
    coarse = resample(line, max(24, round(length / 0.2)) + 1)[:-1]
    step = length / len(coarse)
    before, after = np.roll(coarse, 1, axis=0), np.roll(coarse, -1, axis=0)
    turn = np.abs(wrap_angle(_heading(after - coarse) - _heading(coarse - before)))
    if turn.max() > step / room.sharpest:
        return False
    distance = np.hypot(*(coarse[:, None] - coarse[None]).transpose(2, 0, 1))
    apart = np.abs(np.arange(len(coarse))[:, None] - np.arange(len(coarse)))
    along = np.minimum(apart, len(coarse) - apart) * step
    # on a half circle of the tightest radius, places this far along the road are a full diameter apart
    apart_at_least = room.width + room.verge
    is_elsewhere = along > math.pi / 2 * apart_at_least + step
    return signed_area(np.concatenate((coarse, coarse[:1]))) > 0.0 and bool(
        (distance[is_elsewhere] > apart_at_least).all()
    )


def _oval(lap: float, room: _Room) -> Floats:
    radius = max(0.1 * lap, 1.1 * room.tightest)
    straight = lap / 2 - math.pi * radius
    x, y = straight + 2 * radius, 2 * radius
    line = trace_corners([(x, 0, radius), (x, y, radius), (0, y, radius), (0, 0, radius)], ease=0.5)
    return line * (lap / float(arc_length(line)[-1]))


def _from_longest_straight(line: Floats) -> Floats:
    """The same closed line, begun in the middle of its longest straight."""
    body = line[:-1]
    ahead, back = np.roll(body, -5, axis=0), np.roll(body, 5, axis=0)
    is_bent = np.abs(wrap_angle(_heading(ahead - body) - _heading(body - back))) > 0.01
    if not is_bent.any():
        return line
    first = int(np.flatnonzero(is_bent)[0])
    is_bent = np.roll(is_bent, -first)
    edges = np.concatenate((np.flatnonzero(is_bent), [len(body)]))
    longest = int(np.diff(edges).argmax())
    begin = (first + int(edges[longest] + edges[longest + 1]) // 2) % len(body)
    rolled = np.roll(body, -begin, axis=0)
    return np.concatenate((rolled, rolled[:1]))


# --- squares of a grid


def _keeps_one_outline(squares: set[tuple[int, int]], square: tuple[int, int]) -> bool:
    """True when adding a square beside others leaves one outline that touches itself nowhere."""
    x, y = square
    ring = ((1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1))
    taken = [(x + dx, y + dy) in squares for dx, dy in ring]
    return sum(taken[index] != taken[index - 1] for index in range(8)) == 2


def _num_beside(squares: set[tuple[int, int]], square: tuple[int, int]) -> int:
    """How many of its four sides a square shares."""
    x, y = square
    return sum(beside in squares for beside in ((x + 1, y), (x, y + 1), (x - 1, y), (x, y - 1)))


def _outline(squares: set[tuple[int, int]]) -> Floats:
    """The corners of the squares' common outline, counter-clockwise, from the lowest of the leftmost ones."""
    step: dict[tuple[int, int], tuple[int, int]] = {}
    for x, y in squares:
        sides = (((x, y), (1, 0)), ((x + 1, y), (0, 1)), ((x + 1, y + 1), (-1, 0)), ((x, y + 1), (0, -1)))
        for (corner, (dx, dy)), (nx, ny) in zip(sides, ((0, -1), (1, 0), (0, 1), (-1, 0)), strict=True):
            if (x + nx, y + ny) not in squares:
                step[corner] = (corner[0] + dx, corner[1] + dy)
    start = min(step)
    path = [start]
    while step[path[-1]] != start:
        path.append(step[path[-1]])
    points = np.array(path, dtype=np.float64)
    is_corner = ((np.roll(points, -1, axis=0) - points) != (points - np.roll(points, 1, axis=0))).any(axis=1)
    corners: Floats = points[is_corner]
    return corners


# --- small words


def _heading(vectors: Floats) -> Floats:
    return np.asarray(np.arctan2(vectors[:, 1], vectors[:, 0]))


def _between(rng: random.Random, low: float, high: float) -> float:
    return low + (high - low) * rng.random()


def _pick(rng: random.Random, count: int) -> int:
    return min(count - 1, int(rng.random() * count))


def _plain(value: float) -> str:
    return repr(float(value)).removesuffix(".0")
