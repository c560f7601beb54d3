"""A camera whose pictures are older than the car: taken within the step, seen from at its end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from reference import DT, Pose, move

from racecraft.errors import ConfigError, ShapeError
from racecraft.sim import CameraSpec, Simulation, Start, Vehicle
from racecraft.sim.views import driver_frames
from racecraft.track import load_track

OVAL = load_track("oval")
SMALL = CameraSpec(width=64, height=48)
SUBSTEP = DT / 8  # s
ACTIONS = np.array([[0.1, 2.0], [-0.2, 1.5], [0.4, 3.0]])


def driven(camera: CameraSpec, **settings) -> Simulation:
    simulation = Simulation(OVAL, num_envs=3, camera=camera, start=Start(mode="random"), seed=5, **settings)
    for _ in range(10):
        simulation.step(ACTIONS)
    assert not simulation.terminated.any()
    return simulation


def seen_from(simulation: Simulation, poses: np.ndarray) -> np.ndarray:
    return driver_frames(OVAL, poses, replace(simulation.camera, age=0.0))


@pytest.mark.parametrize("substeps", [1, 3, 7])
def test_a_picture_is_taken_so_many_substeps_before_the_end_of_its_step(substeps):
    simulation = driven(replace(SMALL, age=substeps * SUBSTEP))
    before = [Pose(*car.tolist()) for car in simulation.vehicles.T.astype(float)]
    simulation.step(ACTIONS)
    apart = {}
    for age in range(9):
        poses = [
            move(Vehicle(), pose, tuple(action), substeps=8 - age, sim_dt=SUBSTEP).array()[:3]
            for pose, action in zip(before, ACTIONS, strict=True)
        ]
        apart[age] = np.abs(simulation.frames.astype(int) - seen_from(simulation, np.array(poses))).mean()
    assert min(apart, key=apart.__getitem__) == substeps
    assert apart[substeps] < 0.05


def test_a_picture_as_old_as_a_step_is_of_where_the_step_began():
    simulation = driven(replace(SMALL, age=DT))
    poses = simulation.vehicles[:3].T.copy()
    simulation.step(ACTIONS)
    assert (simulation.frames == seen_from(simulation, poses)).all()


def test_it_changes_what_is_seen_and_nothing_else():
    new, old = driven(SMALL), driven(replace(SMALL, age=0.025))
    assert (new.vehicles == old.vehicles).all()
    assert (new.judged == old.judged).all()
    assert (new.frames != old.frames).any()
    assert (new.frames == seen_from(new, new.vehicles[:3].T)).all()


def test_a_car_that_was_put_somewhere_sees_that_place():
    simulation = driven(replace(SMALL, age=0.025))
    simulation.place(1, 3.0, speed=1.0)
    simulation.reset(np.array([True, False, False]))
    here = seen_from(simulation, simulation.vehicles[:3].T)
    assert (simulation.frames[:2] == here[:2]).all()
    assert (simulation.frames[2] != here[2]).any()


def test_a_car_that_was_stopped_sees_where_it_stands():
    simulation = driven(replace(SMALL, age=0.025))
    for car in range(3):
        simulation.freeze(car, 5)
    simulation.step(ACTIONS)
    assert (simulation.frames == seen_from(simulation, simulation.vehicles[:3].T)).all()


def test_a_saved_simulation_goes_on_with_the_same_picture():
    simulation = driven(replace(SMALL, age=0.025))
    other = driven(replace(SMALL, age=0.025))
    other.step(ACTIONS)
    other.load(simulation.save())
    assert (other.frames == simulation.frames).all()
    with pytest.raises(ShapeError, match="this simulation needs"):
        Simulation(OVAL, num_envs=3, camera=SMALL).load(simulation.save())


def test_ages_that_cannot_be():
    for age in (-0.001, 0.07, float("nan"), "old"):
        with pytest.raises(ConfigError, match="Camera setting age"):
            CameraSpec(age=age)
