import math

import numpy as np
import pytest

from racecraft.errors import ConfigError
from racecraft.sim import ROW_COLUMNS, Bots, CameraSpec, Objects, Obstacles, Simulation, Start
from racecraft.sim.views import BoxView, CarView, ScanView, Scene, driver_frames, views_of_objects
from racecraft.track import load_track

OVAL = load_track("oval")
START = (*OVAL.point_at(0.0).tolist(), float(OVAL.heading_at(0.0)))


def grey(picture):
    return picture @ np.array([0.2989, 0.587, 0.114])


def test_the_drivers_view_is_what_the_policy_sees_in_colour():
    simulation = Simulation(OVAL, start=Start(mode="fixed"))
    picture = Scene(OVAL).driver_view(lit_walls=False).draw(*START)
    assert picture.shape == (120, 160, 3)
    apart = np.abs(grey(picture) - simulation.frames[0])
    assert apart.mean() < 1.0
    assert (apart > 8.0).mean() < 0.01  # a few edges, where colours are mixed in another order; shades are 8 apart


def test_frames_from_anywhere_are_those_of_a_simulation():
    simulation = Simulation(OVAL, num_envs=3, start=Start(mode="random", heading_jitter=0.5))
    np.testing.assert_array_equal(driver_frames(OVAL, simulation.vehicles[:3].T), simulation.frames)


def test_people_see_lighter_walls_and_the_same_ground():
    scene = Scene(OVAL)
    lit, true = (scene.driver_view(lit_walls=lit_walls).draw(*START) for lit_walls in (True, False))
    assert (lit[:20] > true[:20]).any(axis=2).mean() > 0.9
    np.testing.assert_array_equal(lit[60:], true[60:])


def test_walls_are_as_bright_as_their_direction_and_sky_is_above_them():
    """From the middle of the room: walls in the order of brightness that frames of the original show."""
    middle = np.mean([OVAL.outer.min(axis=0), OVAL.outer.max(axis=0)], axis=0)
    poses = [(*middle, heading) for heading in np.arange(4) * math.pi / 2]  # +x, +y, -x, -y
    walls = driver_frames(OVAL, poses, CameraSpec(pitch=0.0, horizontal_fov=0.2))[:, 40:60, 70:90]
    assert [int(wall.min()) for wall in walls] == [int(wall.max()) for wall in walls] == [25, 15, 6, 2]
    sky = driver_frames(OVAL, poses, CameraSpec(pitch=0.0, horizontal_fov=2.0))[:, 0]
    assert (sky == 180).all()


def test_grain_is_part_of_the_ground():
    """It fades with distance, and a step sideways shows the same strokes elsewhere, not others."""
    x, y, heading = START
    frame = driver_frames(OVAL, [START])[0].astype(float)
    road = frame[110:118, 90:110]
    assert 2.0 < road.std() < 5.0
    assert np.abs(road - np.median(road)).max() < 10.0
    small = CameraSpec(horizontal_fov=0.3, pitch=1.5, above_ground=0.5, forward=0.0)  # like a map of the road
    shift = 32 * 2 * 0.5 * math.tan(0.15) / 160  # m of 32 pixels
    left = (x - 0.1 - shift * math.sin(heading), y + shift * math.cos(heading), heading)
    one, other = driver_frames(OVAL, [(x - 0.1, y, heading), left], small).astype(float)
    same = np.corrcoef(one[20:100, :120].ravel(), other[20:100, 32:152].ravel())[0, 1]
    stays = np.corrcoef(one[20:100, :120].ravel(), other[20:100, :120].ravel())[0, 1]
    assert same > 0.95
    assert stays < 0.6


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


def test_boxes_and_bots_stand_where_the_simulation_has_them():
    objects = Objects(
        obstacles=Obstacles(count=1, placement="fixed", positions=((1.2 / OVAL.length, 1),)),
        bots=Bots(count=1, placement="fixed", positions=((1.8 / OVAL.length, -1),)),
    )
    simulation = Simulation(OVAL, objects=objects, start=Start(mode="fixed"))
    views = views_of_objects(simulation.judged[0, len(ROW_COLUMNS) :])
    assert [type(view) for view in views] == [BoxView, CarView]
    driver = Scene(OVAL).driver_view()
    pictures = [driver.draw(*START, cars=cars) for cars in ([], views)]
    seen = np.abs(simulation.frames[0].astype(int) - Simulation(OVAL, start=Start(mode="fixed")).frames[0]) > 4
    drawn = (pictures[0] != pictures[1]).any(axis=2)  # its shadow included
    assert seen.sum() > 300
    assert (seen & drawn).sum() > 0.9 * seen.sum()
    assert drawn.sum() < 2.5 * seen.sum()
    assert views_of_objects(np.zeros(0)) == []


def test_beams_of_a_lidar_end_where_the_sensor_measures():
    places = ((0.02, 1.0), (0.05, -1.0), (0.95, 1.0), (0.97, -1.0))
    boxes = Obstacles(count=4, placement="fixed", positions=places)
    simulation = Simulation(OVAL, camera=None, lidar=True, objects=Objects(obstacles=boxes), start=Start(mode="fixed"))
    simulation.reset()
    x, y, heading = (float(value) for value in simulation.vehicles[:3, 0])
    objects = views_of_objects(simulation.judged[0, len(ROW_COLUMNS) :])
    above = CameraSpec(width=640, height=480, pitch=1.5, above_ground=0.9, forward=0.0, horizontal_fov=2.6)
    view = Scene(OVAL).driver_view(above)
    without = view.draw(x, y, 0.0, cars=objects)
    shown = view.draw(x, y, 0.0, cars=objects, scan=ScanView(x, y, heading, objects)).astype(int)
    is_dot = (shown[..., 0] > 225) & (shown[..., 1] < 90)
    angles = heading + math.radians(30) + np.arange(64) * math.radians(300 / 63)
    ends_x = x + 0.02913 * math.cos(heading) + simulation.lidar[0] * np.cos(angles)  # the scanner's place in the car
    ends_y = y + 0.02913 * math.sin(heading) + simulation.lidar[0] * np.sin(angles)
    focal, sine, cosine, down = 320 / math.tan(1.3), math.sin(1.5), math.cos(1.5), 0.9 - 0.13
    depth = (ends_x - x) * cosine + down * sine
    columns, rows = 320 - focal * (ends_y - y) / depth, 240 + focal * (down * cosine - (ends_x - x) * sine) / depth
    inside = (columns > 2) & (columns < view.width - 3) & (rows > 2) & (rows < view.height - 3)
    assert inside.sum() > 20
    for column, row in zip(columns[inside].astype(int), rows[inside].astype(int), strict=True):
        assert is_dot[row - 2 : row + 3, column - 2 : column + 3].any()
    assert 0.01 < (shown != without).any(axis=2).mean() < 0.3  # thin beams, not a painted floor


def test_a_beam_stops_at_a_car_and_not_at_what_it_cannot_hit():
    scene = Scene(OVAL)
    behind = CarView(START[0] - 1.0, START[1], START[2])
    view = scene.chase_view()
    looking_back = (START[0], START[1], START[2] + math.pi)
    pictures = [view.draw(*looking_back, cars=[behind], scan=ScanView(*START, objects)) for objects in ([], [behind])]
    assert (pictures[0] != pictures[1]).any()
    np.testing.assert_array_equal(pictures[0], view.draw(*looking_back, cars=[behind], scan=ScanView(*START)))
