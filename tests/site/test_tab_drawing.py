"""Roads that somebody draws in the page, against those that the console makes of the same drawing."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import pytest
from test_core_bits import in_node

from racecraft.reward import situations
from racecraft.serve.tracks.routes import validate_sketch
from racecraft.serve.tracks.schemas import TrackSketch
from racecraft.sim.columns import STATUS_NAMES
from racecraft.sim.simulation import track_arrays
from racecraft.site.plan import told_road, told_track
from racecraft.track import draw_road, load_track
from racecraft.track.sketch import sketch_of

pytestmark = pytest.mark.slow
OVAL = [(0, -2.2), (3.5, -2.3), (5.2, 0), (3.4, 2.2), (0, 1.7), (-3.4, 2.2), (-5.2, 0), (-3.4, -2.2)]
EIGHT = [(0, 0), (2, 2), (4, 0), (2, -2), (0, 0.3), (-2, 2), (-4, 0), (-2, -2)]


def sketch(points: list[tuple[float, float]], width: float = 0.9, *, is_closed: bool = True) -> dict[str, Any]:
    told = [{"x": x, "y": y, "width": width + 0.05 * (at % 3)} for at, (x, y) in enumerate(points)]
    return {"points": told, "is_closed": is_closed}


def of_library(name: str) -> dict[str, Any]:
    return TrackSketch.of(sketch_of(load_track(name))).model_dump()


GOOD = {
    "oval": sketch(OVAL),
    "clockwise": sketch(OVAL[::-1]),
    "hairpin": of_library("hairpin"),
    "reinvent": of_library("reinvent_2018"),
    "open": sketch([(0, 0), (3, 0.5), (5, 3), (8, 3)], is_closed=False),
}
BAD = {
    "two points": sketch(OVAL[:2]),
    "on one place": sketch([*OVAL, OVAL[-1]]),
    "too narrow": sketch(OVAL, 0.02),
    "too long": sketch([(20 * x, 20 * y) for x, y in OVAL]),
    "crosses itself": sketch(EIGHT),
    "too wide": sketch(OVAL, 6.0),
    "too tight": sketch([(0, 0), (3, 0), (3, 0.5), (0, 0.6)]),
    "open, ends where it began": sketch([*OVAL, (0.1, -2.2)], is_closed=False),
}


def numbers(packed: dict[str, str]) -> np.ndarray[Any, Any]:
    return np.frombuffer(base64.b64decode(packed["data"]), packed["dtype"])


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    case = {"what": "drawings", "statuses": list(STATUS_NAMES), "sketches": {**GOOD, **BAD}}
    results: dict[str, Any] = in_node("core", [case], tmp_path_factory.mktemp("drawn"))["results"][0]
    return results


@pytest.mark.parametrize("name", GOOD)
def test_a_drawn_road_is_the_consoles_and_so_is_all_that_is_told_of_it(found: dict[str, Any], name: str) -> None:
    track = draw_road(TrackSketch(**GOOD[name]).to_sketch(), name="drawing")
    theirs = found[name]["file"]
    assert theirs["digest"] == track.digest
    ours, road = told_track(track_arrays(track)), told_road(track)
    assert numbers(theirs["told"]["lines"]).tobytes() == numbers(ours["lines"]).tobytes()
    assert theirs["told"]["waypoints"] == ours["waypoints"]
    for key in ("count", "isClosed"):
        assert theirs["told"][key] == ours[key]
    assert theirs["told"]["samplesPerMetre"] == pytest.approx(ours["samplesPerMetre"], rel=1e-14)
    np.testing.assert_allclose(numbers(theirs["told"]["tables"]), numbers(ours["tables"]), rtol=1e-6, atol=1e-6)
    for key in ("arcs", "headings"):
        np.testing.assert_allclose(numbers(theirs["road"][key]), numbers(road[key]), rtol=0, atol=1e-12)
    assert theirs["road"]["innerIsLeft"] == road["innerIsLeft"]
    assert theirs["road"]["repeats"] == road["repeats"]
    assert theirs["waypoints"] == [one.waypoints.tolist() for one in (track, track.reversed())]
    for told, situation in zip(theirs["situations"], situations(track), strict=True):
        assert told["name"] == situation.name
        np.testing.assert_allclose(told["row"], situation.row, atol=1e-9, err_msg=situation.name)


@pytest.mark.parametrize("name", [*GOOD, *BAD])
def test_a_drawing_is_judged_as_by_the_console(found: dict[str, Any], name: str) -> None:
    asked = TrackSketch(**{**GOOD, **BAD}[name])
    ours, theirs = validate_sketch(asked).model_dump(), found[name]["verdict"]
    assert theirs["ok"] == ours["ok"] == (name in GOOD)
    if ours["problem"]:
        assert theirs["problem"]["message"] == ours["problem"]["message"]
    if ours["geometry"] is None:
        assert theirs.get("geometry") is None
        return
    for key, value in ours["geometry"].items():
        told = theirs["geometry"][key]
        assert told == value if isinstance(value, str | bool) else np.allclose(told, value, rtol=0, atol=1.01e-4)
    for key in ("min_radius", "mean_width"):
        assert theirs[key] == pytest.approx(ours[key], abs=6e-4)
    assert (theirs["corners"], theirs["direction"]) == (ours["corners"], ours["direction"])
