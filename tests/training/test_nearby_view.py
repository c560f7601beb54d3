"""What a teacher is told of the box or bot that is nearest: beside it, behind it, and where it is drifting."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from racecraft.learn import DistillConfig
from racecraft.run import RunFolder
from racecraft.sim import Bots, Objects, Obstacles, Simulation
from racecraft.sim.objects import OBJECT_KINDS
from racecraft.track import Sketch, draw_road, load_track
from racecraft.training import train
from racecraft.training.nearby_view import DRIFT, NEARBY_COLUMNS, REACH, NearbyTeller
from racecraft.training.plan import make_plan
from racecraft.training.regimes import FAST_OBJECTS, OBJECTS
from racecraft.training.settings import TrainSettings
from racecraft.training.start import read_settings

CLOSENESS, PLACE, OFFSET, DRIFTING = range(len(NEARBY_COLUMNS))
BOTS = Objects(bots=Bots(count=1, speed=1.0, placement="fixed", positions=((0.5, 1),), changes_lane=True))


def boxes(*positions: tuple[float, int]) -> Objects:
    return Objects(obstacles=Obstacles(count=len(positions), placement="fixed", positions=positions))


def told(simulation: Simulation) -> NDArray[np.float32]:
    simulation.step(np.zeros((simulation.num_envs, 2), np.float32))  # rows are of the poses before
    return NearbyTeller(simulation)()


def test_it_is_the_nearest_one_in_front_or_behind() -> None:
    track = load_track("oval")
    cars = Simulation(track, num_envs=4, objects=boxes((0.1, 1), (0.5, -1)))
    cars.step(np.zeros((4, 2), np.float32))
    first, second = cars.object_column("object_distance")[0]
    lanes = cars.object_column("object_offset")[0]
    places = ((first - 0.5, 0.1), (first + 0.2, -0.2), (second + 0.3, 0.0), (first - 0.4 + track.length, 0.0))
    for car, (place, offset) in enumerate(places):
        cars.place(car, place % track.length, offset=offset)
    columns = told(cars)
    widths = cars.column("track_width")
    # A row speaks of the point 0.14 m before the car's origin.
    for car, (gap, left) in enumerate(
        ((0.36, lanes[0] - 0.1), (-0.34, lanes[0] + 0.2), (-0.44, lanes[1]), (0.26, lanes[0]))
    ):
        closeness = np.exp(-abs(gap) / REACH)
        assert columns[car, CLOSENESS] == pytest.approx(closeness, abs=0.02)
        assert columns[car, PLACE] == pytest.approx(np.tanh(gap / 0.4), abs=0.04)
        assert columns[car, OFFSET] == pytest.approx(closeness * left / (0.5 * widths[car]), abs=0.03)
        assert columns[car, DRIFTING] == pytest.approx(0.0, abs=0.05)  # boxes stand along the road


def test_a_bot_drifts_where_it_will_be_and_nowhere_in_a_bend() -> None:
    track = load_track("oval")
    cars = Simulation(track, num_envs=1, objects=BOTS)
    teller = NearbyTeller(cars)
    offsets, drifts = [], []
    for _ in range(15 * 40):
        cars.step(np.zeros((1, 2), np.float32))
        place = float(cars.object_column("object_distance")[0, 0])
        offsets.append(float(cars.object_column("object_offset")[0, 0]))
        columns = teller()[0]
        drifts.append(float(columns[DRIFTING] / columns[CLOSENESS] / DRIFT))
        cars.place(0, (place - 1.5) % track.length)
    rate, drift = np.diff(offsets), np.array(drifts)[1:]
    is_changing = np.abs(rate) > 0.015  # m in a step, of 0.067 along the road
    assert is_changing.sum() > 20
    assert (np.sign(drift[is_changing]) == np.sign(rate[is_changing])).all()
    assert np.abs(drift[is_changing]).min() > 0.1
    assert np.abs(drift[np.abs(rate) < 0.0005]).max() < 0.12


def test_on_an_open_road_nobody_is_told_of_a_way_round() -> None:
    sketch = Sketch(points=((0, 0), (4, 0), (8, 0)), widths=(0.8, 0.8, 0.8), is_closed=False)
    road = draw_road(sketch, name="road")
    cars = Simulation([load_track("oval"), road], num_envs=2, objects=boxes((0.1, 1)))
    cars.step(np.zeros((2, 2), np.float32))
    for car in range(2):
        cars.place(car, 0.9 * cars.driven_track(car).length)
    assert (np.sign(told(cars)[:, PLACE]) == [1.0, -1.0]).all()


def test_who_is_gone_is_not_told_of() -> None:
    cars = Simulation(load_track("oval"), num_envs=2, cars_per_race=2)
    cars.place(0, 1.0)
    cars.place(1, 1.4)
    assert told(cars)[0, CLOSENESS] > 0.4
    kinds = cars.object_column("object_kind")
    kinds[:] = OBJECT_KINDS.index("gone_racer")
    assert not NearbyTeller(cars)()[0].any()


def test_a_training_among_objects_with_a_teacher_is_told() -> None:
    settings = make_plan("oval", objects=BOTS).settings
    assert settings.tells_nearby
    assert settings.distill == OBJECTS.distill
    for actions in ("default", "continuous"):
        assert make_plan("oval", objects=BOTS, actions=actions).settings.distill == FAST_OBJECTS.distill
    alone = [make_plan("oval", objects=BOTS, algorithm="ppo", actions=name).settings for name in ("steady", "default")]
    assert not any(settings.tells_nearby for settings in alone)
    assert alone[0].to_dict() == alone[1].to_dict()  # a teacher's settings do not follow the actions of who has none
    assert not make_plan("oval").settings.tells_nearby


def test_a_run_of_an_earlier_version_goes_on_as_it_was() -> None:
    settings = make_plan("oval", objects=BOTS).settings
    document = settings.to_dict()
    assert TrainSettings.from_dict(document) == settings
    del document["tells_nearby"], document["distill"]["gamma"]
    before = TrainSettings.from_dict(document)
    assert before.state_size == settings.state_size - len(NEARBY_COLUMNS)
    assert before.distill.gamma == DistillConfig().gamma == 0.98


def test_the_child_of_an_earlier_versions_run_is_told(tmp_path: Path) -> None:
    old = train("oval", objects=BOTS, tells_nearby=False, until="1 steps", root=tmp_path, num_threads=1)
    assert not read_settings(RunFolder.open(old.run)).tells_nearby
    assert make_plan(parent=old.run).settings.tells_nearby
