"""Races among objects: crashes counted and paid for, cars put behind what they hit, mercy, and the whole line."""

from __future__ import annotations

import numpy as np
import pytest

from racecraft.race import RaceRules, Recording, evaluate
from racecraft.race.placement import avoiding_pose, reset_pose
from racecraft.sim import OBJECT_COLUMNS, OBJECT_HEADER, ROW_COLUMNS, Bots, Objects, Obstacles
from racecraft.sim.columns import row_width
from racecraft.sim.objects import OBJECT_KINDS
from racecraft.sim.views import BoxView
from racecraft.track import Track, load_track

RING = load_track("oval")
BOX = Objects(obstacles=Obstacles(count=1, placement="fixed", positions=((0.3, 1),)))


def centerline_driver(track: Track, *, lane: float = 0.0):
    """Steers by the state: towards the centre line, or a place across the road in halves of its width."""

    def drive(state):
        offset, sine = state[:, 4] - lane, state[:, 5]
        steering = np.clip(-0.6 * offset - 1.2 * sine + 0.3 * state[:, 10], -0.5, 0.5)
        return np.column_stack([steering, np.full(len(state), 1.0)]).astype(np.float32)

    return drive


def row(distance: float, offset: float, objects: list[tuple[float, float]]) -> np.ndarray:
    """A judged row with a car and objects, each at a distance along the track and an offset."""
    values = np.zeros(row_width(len(objects)))
    values[ROW_COLUMNS.index("projection_distance")] = distance
    values[ROW_COLUMNS.index("offset")] = offset
    for i, (place, across) in enumerate(objects):
        begin = len(ROW_COLUMNS) + len(OBJECT_HEADER) + i * len(OBJECT_COLUMNS)
        values[begin + OBJECT_COLUMNS.index("object_distance")] = place
        values[begin + OBJECT_COLUMNS.index("object_offset")] = across
    return values


LENGTH = RING.length


@pytest.mark.parametrize(
    ("place", "offset", "objects", "settings", "expected", "side"),
    [
        # where, what is around, where the car is put: distance along the track, side
        (5.0, 0.1, [(8.0, 0.2)], {}, 5.0, 1),  # far from everything: as without objects
        (5.0, 0.1, [(5.9, 0.2)], {}, 4.9, -1),  # an object ahead: 1 m behind it, in the other lane
        (5.0, -0.1, [(5.9, -0.2)], {}, 4.9, 1),
        (5.0, 0.1, [(9.0, -0.2), (5.9, 0.2)], {}, 4.9, -1),  # the nearest one counts
        (5.0, 0.1, [(4.5, 0.2)], {}, 3.5, -1),  # and the same where it is just behind
        (5.0, 0.1, [(6.2, -0.2)], {"crashed": 0}, 5.2, 1),  # what it ran into counts, however far
        (5.0, 0.1, [(5.3, -0.2)], {"crashed": 0, "mercy": True}, 6.3, 1),  # mercy: past it
        (0.2, 0.1, [(0.4, 0.2)], {}, LENGTH - 0.6, -1),  # over the start line
        (LENGTH - 0.1, 0.1, [(0.4, 0.2)], {}, LENGTH - 0.6, -1),
        (
            5.0,
            0.1,
            [(5.9, 0.2), (4.8, -0.2)],
            {"crashed": 0},
            4.9,
            1,
        ),  # the other lane is taken, too: the one with more room
    ],
)
def test_where_a_car_is_put_back(place, offset, objects, settings, expected, side):
    pose = avoiding_pose(RING, row(place, offset, objects), **settings)
    assert pose == reset_pose(RING, row(expected, float(side), []))


def test_on_an_open_road_nobody_is_put_before_the_start():
    x = np.linspace(0.0, 10.0, 41)
    road = Track("road", *(np.stack((x, np.full_like(x, y)), axis=1) for y in (0.0, 0.5, -0.5)))
    pose = avoiding_pose(road, row(0.3, 0.1, [(0.6, 0.2)]))
    assert (pose.x, pose.y) == (0.0, -0.25)


def test_a_crash_costs_its_penalty_and_the_car_goes_on_in_the_other_lane():
    rules = RaceRules(laps=1, is_continuous=False, collision_penalty=3.0, lateral_jitter=0.0, heading_jitter=0.0)
    side = 1.0 if np.allclose(RING.left, RING.inner) else -1.0
    driver = centerline_driver(RING, lane=0.5 * side)
    free = evaluate(driver, RING, rules=rules, num_trials=1, sees="state")
    assert free.laps_clean == 1
    found = evaluate(driver, RING, rules=rules, num_trials=1, sees="state", objects=BOX)
    (lap,) = found.trials[0].laps
    assert lap.is_complete
    assert 1 <= lap.crash_count <= 3  # it steers back to its lane, until mercy puts it past the box
    assert lap.penalty_seconds == pytest.approx(3.0 * lap.crash_count)
    recording = found.trials[0].recording
    crash = recording.statuses.index("crashed")
    assert recording.statuses[crash + 1] == "pause"
    assert recording.rows[crash, len(ROW_COLUMNS) + OBJECT_HEADER.index("crashed_object")] == 0.0
    assert -side * recording.column("offset")[crash + 1] > 0.1
    assert [type(view) for view in recording.objects(0)] == [BoxView]
    assert found.summary()["crash_count"] == lap.crash_count


def test_cars_that_stand_are_shown_as_solid_as_the_picture_asks_and_else_solid():
    rows = np.zeros((1, row_width(2)))
    for i, kind in enumerate(("frozen_racer", "racer")):
        rows[0, len(ROW_COLUMNS) + len(OBJECT_HEADER) + i * len(OBJECT_COLUMNS)] = OBJECT_KINDS.index(kind)
    recording = Recording(RING, rows, np.zeros(1), np.zeros((1, 2), np.float32))
    assert [view.alpha for view in recording.objects(0)] == [1.0, 1.0]
    assert [view.alpha for view in recording.objects(0, alpha=0.3)] == [0.3, 1.0]


def test_mercy_comes_after_so_many_crashes_and_can_be_refused():
    side = 1.0 if np.allclose(RING.left, RING.inner) else -1.0
    driver = centerline_driver(RING, lane=0.5 * side)
    counts = []
    for mercy_after in (1, 2):
        rules = RaceRules(laps=1, is_continuous=False, max_resets=20, collision_penalty=0.2, mercy_after=mercy_after)
        found = evaluate(driver, RING, rules=rules, num_trials=1, sees="state", objects=BOX)
        counts.append(found.trials[0].laps[0].crash_count)
        assert found.trials[0].is_finished
    assert counts == [1, 2]


def test_after_mercy_crashes_are_counted_anew_and_every_lap_has_its_own_penalties():
    """It hits the same box in every lap, and is put past it by the second crash each time."""
    side = 1.0 if np.allclose(RING.left, RING.inner) else -1.0
    driver = centerline_driver(RING, lane=0.5 * side)
    rules = RaceRules(laps=3, max_resets=20, collision_penalty=0.2, mercy_after=2, lateral_jitter=0.0)
    (trial,) = evaluate(driver, RING, rules=rules, num_trials=1, sees="state", objects=BOX).trials
    assert trial.is_finished
    assert [(lap.crash_count, lap.resets) for lap in trial.laps] == [(2, 2)] * 3
    assert [lap.penalty_seconds for lap in trial.laps] == pytest.approx([0.4] * 3)


def test_a_trial_ends_with_the_crash_when_no_resets_are_left():
    rules = RaceRules(laps=1, is_continuous=False, max_resets=0)
    side = 1.0 if np.allclose(RING.left, RING.inner) else -1.0
    found = evaluate(
        centerline_driver(RING, lane=0.5 * side), RING, rules=rules, num_trials=2, sees="state", objects=BOX
    )
    assert [trial.status for trial in found.trials] == ["crashed", "crashed"]


def test_trials_start_in_the_lane_that_is_free():
    near = Objects(obstacles=Obstacles(count=1, placement="fixed", positions=((0.02, 1),)))
    rules = RaceRules(laps=1, is_continuous=False, max_resets=0)
    found = evaluate(centerline_driver(RING, lane=0.0), RING, rules=rules, num_trials=3, sees="state", objects=near)
    side = 1.0 if np.allclose(RING.left, RING.inner) else -1.0
    for trial in found.trials:
        assert -side * trial.recording.column("offset")[0] > 0.1


def test_bots_ahead_are_hit_and_bots_behind_wait():
    slow = Objects(bots=Bots(count=1, speed=0.3, placement="fixed", positions=((0.2, 1),)))
    fast = Objects(bots=Bots(count=1, speed=2.0, placement="fixed", positions=((0.8, 1),)))
    rules = RaceRules(laps=1, is_continuous=False, max_resets=0)
    side = 1.0 if np.allclose(RING.left, RING.inner) else -1.0
    driver = centerline_driver(RING, lane=0.5 * side)
    assert evaluate(driver, RING, rules=rules, num_trials=1, sees="state", objects=slow).trials[0].status == "crashed"
    found = evaluate(driver, RING, rules=rules, num_trials=1, sees="state", objects=fast)
    assert found.trials[0].status == "lap_complete"


def test_a_trial_does_not_depend_on_how_many_others_there_are():
    objects = Objects(
        obstacles=Obstacles(count=3, placement="random"), bots=Bots(count=2, placement="random", speed=0.5)
    )
    rules = RaceRules(laps=1, max_resets=5, collision_penalty=1.0)
    few, many = (
        evaluate(centerline_driver(RING), RING, rules=rules, num_trials=n, sees="state", objects=objects, seed=3)
        for n in (2, 5)
    )
    for one, other in zip(few.trials, many.trials, strict=False):
        assert one.recording.rows.tobytes() == other.recording.rows.tobytes()
    places = {trial.recording.rows[0, len(ROW_COLUMNS) + 5] for trial in many.trials}
    assert len(places) == 5
