from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pytest

from racecraft.errors import ConfigError, TrackError
from racecraft.film.limit_picture import draw_limit
from racecraft.limits import MEDALS, Medals, TrackLimit, compute_limit, known_limit, track_limit
from racecraft.limits import limit as limits
from racecraft.limits.car import body_rates, load_casadi
from racecraft.limits.ideal import smooth_lap
from racecraft.limits.road import smooth_road
from racecraft.sim import Simulation, Start, Vehicle, load_vehicle
from racecraft.track import Track, load_track

OVAL = load_track("oval")
V5 = Vehicle()


def ring(radius: float, width: float = 1.0) -> Track:
    angle = np.linspace(0.0, 2 * np.pi, 201)
    unit = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    unit[-1] = unit[0]
    lines = [unit * (radius + offset) for offset in (0.0, -width / 2, width / 2)]
    return Track("ring", *lines)


@pytest.mark.costly
@pytest.mark.parametrize("name", ["v4", "v5", "v6"])
def test_the_symbolic_car_is_the_simulators(name: str) -> None:
    ca, car = load_casadi(), load_vehicle(name)
    body, command = ca.SX.sym("body", 4), ca.SX.sym("command", 2)
    rates = ca.vertcat(
        *body_rates(ca, car, tuple(body[i] for i in range(4)), command[1]),
        (command[0] + car.steering_bias - body[3]) / car.steering_time_constant,
    )
    change = ca.Function("change", [body, command], [rates])
    simulation = Simulation(OVAL, camera=None, start=Start(mode="fixed"), vehicle=car)
    num = 128
    dt = 1 / 15 / num
    for given in ((0.2, 2.0), (0.4, 3.5), (-0.3, 4.0), (0.1, 1.0), (0.0, 0.5)):
        state = simulation.vehicles[3:, 0].astype(float)
        for _ in range(num):
            k1 = np.array(change(state, given)).ravel()
            k2 = np.array(change(state + dt / 2 * k1, given)).ravel()
            k3 = np.array(change(state + dt / 2 * k2, given)).ravel()
            k4 = np.array(change(state + dt * k3, given)).ravel()
            state = state + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        simulation.step([given])
        assert simulation.vehicles[3:, 0] == pytest.approx(state, abs=0.02)


def test_a_round_road_is_round() -> None:
    road = smooth_road(ring(3.0), spacing=0.05)
    assert road.curvature == pytest.approx(np.full(len(road.s), 1 / 3), rel=0.02)
    assert road.left == pytest.approx(np.full(len(road.s), 0.5), abs=0.02)
    assert road.right == pytest.approx(np.full(len(road.s), 0.5), abs=0.02)
    assert road.at(road.length + 1.0, road.left) == pytest.approx(road.at(1.0, road.left))
    places = road.at(np.array([0.0, 1.0, 2.0]), road.places)
    assert places.shape == (3, 2)
    assert np.hypot(*places.T) == pytest.approx([3.0] * 3, abs=0.02)


def test_a_narrowed_road_has_lost_the_same_strip_on_both_sides() -> None:
    angle = np.linspace(0.0, 2 * np.pi, 201)
    unit = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    unit[-1] = unit[0]
    road = smooth_road(Track("uneven", *(unit * radius for radius in (3.0, 2.6, 3.3))), spacing=0.05)  # left is inside
    narrow = road.narrowed(0.1)
    assert narrow.left == pytest.approx(np.full(len(road.s), 0.3), abs=0.02)
    assert narrow.right == pytest.approx(np.full(len(road.s), 0.2), abs=0.02)
    np.testing.assert_array_equal(narrow.places, road.places)


@pytest.mark.slow
def test_the_smooth_lap_keeps_its_wheels_on_the_road_and_obeys_the_car() -> None:
    road = smooth_road(OVAL, spacing=0.05)
    lap = smooth_lap(road, V5)
    half = OVAL.width_at(OVAL.project(lap.places)[0]) / 2
    assert (np.abs(OVAL.project(lap.places)[1]) < half - 0.06).all()
    assert lap.speeds.max() < 4.0 * V5.speed_gain * 1.05
    assert lap.states[0] == pytest.approx(lap.states[-1], abs=1e-4)
    steps = np.hypot(*np.diff(lap.places, axis=0).T) / ((lap.speeds[1:] + lap.speeds[:-1]) / 2)
    assert steps.sum() == pytest.approx(lap.time, rel=0.01)
    # more grip is never slower
    more = replace(V5, front_friction=1.1 * V5.front_friction, rear_friction=1.1 * V5.rear_friction)
    assert smooth_lap(road, more, start=lap).time < lap.time


@pytest.mark.slow
def test_the_table_is_what_comes_out_and_the_line_can_be_driven(tmp_path) -> None:
    limit, known = compute_limit(OVAL, V5), known_limit(OVAL, V5)
    assert known is not None
    assert limit.ideal == pytest.approx(known.ideal, rel=0.01)
    assert limit.driven == pytest.approx(known.driven, rel=0.02)
    assert limit.ideal < limit.driven < 1.1 * limit.ideal
    assert limit.lap is not None
    s, _ = OVAL.project(limit.lap.places)
    assert np.ptp(s) > 0.95 * OVAL.length
    assert draw_limit(OVAL, limit, tmp_path / "limit.png").stat().st_size > 10_000


def test_the_table_holds_the_library() -> None:
    with limits.TABLE.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) >= 11
    for row in rows:
        track = load_track(row["track"])
        road = track.reversed() if row["direction"] == "reverse" else track
        assert row["key"] == limits.limit_key(road, load_vehicle(row["vehicle"]))
        shortest = track.length - np.pi * track.mean_width  # along the inner border
        assert shortest / 4.2 < float(row["ideal"]) < float(row["driven"]) < 1.15 * float(row["ideal"])


def test_medals() -> None:
    medals = Medals.from_author(10.0)
    assert [medals.won_by(seconds) for seconds in (9.9, 10.0, 10.5, 11.0, 14.0, 16.0)] == [
        *("author", "author", "gold", "silver", "bronze", ""),
    ]
    assert [medals.next_after(seconds) for seconds in (9.9, 10.5, 11.0, 14.0, 16.0)] == [
        *("", "author", "gold", "silver", "bronze"),
    ]
    assert list(MEDALS.values()) == sorted(MEDALS.values())


def test_sentences() -> None:
    limit = TrackLimit(ideal=5.0, driven=5.2)
    assert limit.sentence(5.5) == "5.50 s is 10 % above the limit of 5.00 s: gold medal; author takes 5.20 s."
    assert limit.sentence(9.0) == "9.00 s is 80 % above the limit of 5.00 s: no medal yet; bronze takes 7.80 s."
    assert "corners were cut" in limit.sentence(4.9)


def test_what_was_computed_is_remembered(monkeypatch, tmp_path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    found = []

    def compute(track: Track, vehicle: Vehicle) -> TrackLimit:
        found.append(track.name)
        return TrackLimit(ideal=7.0, driven=7.5)

    monkeypatch.setattr(limits, "compute_limit", compute)
    track = ring(2.5)
    assert known_limit(track, V5) is None
    assert [track_limit(track, V5).ideal for _ in range(2)] == [7.0, 7.0]
    assert found == ["ring"]
    (file,) = tmp_path.rglob("*.json")
    for damage in ("", "{", "[]", '{"ideal": -1, "driven": 2}', '{"ideal": NaN, "driven": 2}', "9" * 20_000):
        file.write_text(damage)
        assert known_limit(track, V5) is None


def test_open_tracks_and_narrow_roads_are_refused() -> None:
    with pytest.raises(TrackError, match="open"):
        compute_limit(load_track("straight"), V5)


def test_without_the_solver_it_says_what_to_install(monkeypatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "casadi", None)
    with pytest.raises(ConfigError, match="casadi") as error:
        smooth_lap(smooth_road(OVAL, spacing=0.1), V5)
    assert "racecraft[limit]" in error.value.hint
