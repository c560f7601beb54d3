import math

import numpy as np
import pytest

from racecraft.errors import ConfigError
from racecraft.sim import CameraSpec, Simulation, Start
from racecraft.sim.views import CarView, Scene
from racecraft.track import load_track

OVAL = load_track("oval")
START = (*OVAL.point_at(0.0).tolist(), float(OVAL.heading_at(0.0)))


def grey(picture):
    return picture @ np.array([0.2989, 0.587, 0.114])


def test_the_drivers_view_is_what_the_policy_sees_in_colour():
    simulation = Simulation(OVAL, start=Start(mode="fixed"))
    picture = Scene(OVAL).driver_view().draw(*START)
    assert picture.shape == (120, 160, 3)
    differs = np.abs(grey(picture) - simulation.frames[0]) > 2.0
    assert differs.mean() < 0.01  # a few edges, where colours are mixed in another order


def test_the_chase_camera_sees_the_car_it_follows():
    chase = Scene(OVAL).chase_view(width=320, height=240)
    empty = chase.draw(*START)
    with_car = chase.draw(*START, cars=[CarView(*START, color=(255, 0, 255))])
    changed = (empty != with_car).any(axis=2)
    rows, columns = np.nonzero(changed)
    assert columns.mean() == pytest.approx(160, abs=4)  # in the middle
    assert rows.mean() > 140  # and below it
    assert 0.01 < changed.mean() < 0.1


def test_a_fading_car_lies_between():
    chase = Scene(OVAL).chase_view(width=320, height=240)
    pictures = [
        chase.draw(*START, cars=[CarView(*START, alpha=alpha)] if alpha else []).astype(int)
        for alpha in (0.0, 0.3, 1.0)
    ]
    far, near = (np.abs(pictures[1] - pictures[i]).sum() for i in (2, 0))
    assert 0 < near < far


def test_the_top_view_shows_the_whole_track():
    top = Scene(OVAL).top_view(width=320, height=240)
    empty = top.draw()
    seen = []
    for s in np.linspace(0.0, OVAL.length, 12, endpoint=False):
        car = CarView(*OVAL.point_at(s).tolist(), float(OVAL.heading_at(s)), color=(255, 0, 255))
        rows, columns = np.nonzero((top.draw(cars=[car]) != empty).any(axis=2))
        seen.append((columns.mean(), rows.mean()))
    assert len({(round(x), round(y)) for x, y in seen}) == 12


def test_pictures_are_drawn_in_place():
    view = Scene(OVAL, palette="2020").driver_view(CameraSpec(width=64, height=48))
    out = np.zeros((48, 64, 3), dtype=np.uint8)
    assert view.draw(*START, out=out) is out
    np.testing.assert_array_equal(out, view.draw(*START))
    with pytest.raises(ValueError, match="size"):
        view.draw(*START, out=np.zeros((48, 63, 3), dtype=np.uint8))


def test_any_pose_is_safe():
    view = Scene(OVAL).chase_view(width=64, height=48)
    for x, y, heading in ((1e9, 0.0, 0.0), (math.nan, 0.0, 0.0), (0.0, -math.inf, 1e30)):
        assert view.draw(x, y, heading, cars=[CarView(x, y, heading)]).shape == (48, 64, 3)


def test_palettes_have_names():
    with pytest.raises(ConfigError, match="'2019'"):
        Scene(OVAL, palette="2019")
    assert (Scene(OVAL).driver_view().draw(*START) != Scene(OVAL, palette="2020").driver_view().draw(*START)).any()
