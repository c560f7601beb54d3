"""Whatever is given in place of a setting, an action or a mask is refused in one sentence that names it."""

from __future__ import annotations

import json
import math
from dataclasses import asdict

import numpy as np
import pytest

from racecraft.errors import ConfigError, NonFiniteAction, RacecraftError, ShapeError
from racecraft.sim import Bots, CameraSpec, Obstacles, Simulation, Start, Vehicle
from racecraft.track import Track, load_track

OVAL = load_track("oval")
NOT_NUMBERS = (math.nan, math.inf, -math.inf, None, "1", True, [1], object())


@pytest.fixture
def simulation() -> Simulation:
    return Simulation(OVAL, num_envs=3, camera=None)


def everything(simulation: Simulation) -> bytes:
    return b"".join(a.tobytes() for a in (simulation.rows, simulation.vehicles, simulation.terminated))


@pytest.mark.parametrize(
    ("name", "bad"),
    [
        ("num_envs", (0, -1, 1_000_001, 1.5, math.nan, None, "3", True)),
        ("seed", (-1, 2**64, 0.5, None, "seed")),
        ("laps", (0, -1, 2**40, 1.0)),
        ("max_steps", (1, 0, -5, 2**31, 1e3)),
        ("substeps", (3, 0, 129, 8.0)),
        ("num_threads", (-1, 1025, 1.0)),
        ("time_limit", (-1e-9, 1e10, *NOT_NUMBERS)),
        ("direction", ("back", "", None, 1)),
        ("start", (None, "fixed", {"mode": "fixed"})),
        ("camera", (True, "front", (160, 120))),
        ("vehicle", ("v7", "", None, 5, {}, "/no/such/file.json")),
    ],
)
def test_settings(name, bad):
    for value in bad:
        with pytest.raises(ConfigError) as caught:
            Simulation(OVAL, **{name: value})
        message = str(caught.value)
        assert name in message.lower()
        assert "\n" not in message
        assert repr(value) in message or name == "vehicle"


def test_numbers_of_numpy_are_kept_as_those_that_json_knows():
    settings = [
        Vehicle(mass=np.float32(7.25), yaw_inertia=np.float64(0.2)),
        CameraSpec(width=np.int64(80), pitch=np.float32(0.25)),
        Obstacles(count=np.int16(3), min_distance=np.float32(1.5)),
        Bots(count=np.uint8(2), speed=np.float32(0.5), positions=((np.float32(0.5), np.int64(1)),)),
    ]
    for one in settings:
        assert type(one)(**json.loads(json.dumps(asdict(one)))) == one
    numbers = {"num_envs": np.int64(4), "cars_per_race": np.int8(2), "seed": np.uint64(2**64 - 1)}
    simulation = Simulation(OVAL, **numbers, camera=None)
    told = (simulation.num_envs, simulation.cars_per_race, simulation.seed)
    assert json.loads(json.dumps(told)) == [4, 2, 2**64 - 1]


def test_an_open_track_has_one_lap():
    x = np.linspace(0.0, 6.0, 25)
    road = Track("road", *(np.stack((x, np.full(25, y)), axis=1) for y in (0.0, 0.5, -0.5)))
    Simulation([OVAL, road], num_envs=2, camera=None, laps=1)
    with pytest.raises(ConfigError, match="laps is 2; allowed is 1 on an open track"):
        Simulation([OVAL, road], num_envs=2, camera=None, laps=2)


@pytest.mark.parametrize("tracks", [[], (), None, "oval", ["oval"], [OVAL, None], np.zeros((9, 6)), 5])
def test_tracks(tracks):
    with pytest.raises(ConfigError, match="track"):
        Simulation(tracks)


@pytest.mark.parametrize(
    ("kind", "name", "bad"),
    [
        (Start, "mode", ("fixd", "", None, 3)),
        (Start, "offset", (1.01, -1.01, *NOT_NUMBERS)),
        (Start, "advance", (1.01, -1.01, *NOT_NUMBERS)),
        (Start, "lateral_jitter", (-0.1, 1.1, *NOT_NUMBERS)),
        (Start, "heading_jitter", (-0.1, 3.2, *NOT_NUMBERS)),
        (Start, "spread", (1, None, "yes")),
        (CameraSpec, "width", (7, 2049, 160.0, *NOT_NUMBERS)),
        (CameraSpec, "height", (7, 2049, 120.0, *NOT_NUMBERS)),
        (CameraSpec, "horizontal_fov", (0.0, 3.0, *NOT_NUMBERS)),
        (CameraSpec, "above_ground", (0.0, 1.0, *NOT_NUMBERS)),
        (CameraSpec, "pitch", (-0.1, 1.6, *NOT_NUMBERS)),
        (CameraSpec, "forward", (2.1, *NOT_NUMBERS)),
        (CameraSpec, "left", (-2.1, *NOT_NUMBERS)),
        (CameraSpec, "palette", ("2019", "", None, 2018)),
    ],
)
def test_starts_and_cameras(kind, name, bad):
    for value in bad:
        with pytest.raises(ConfigError, match=name):
            kind(**{name: value})


def test_a_misspelt_start_is_recognised():
    with pytest.raises(ConfigError, match="Start mode is 'randon'; allowed are fixed, advance, random") as error:
        Start(mode="randon")
    assert error.value.hint == "Did you mean 'random'?"


def test_the_ends_of_every_range_work():
    for camera in (CameraSpec(width=8, height=8), CameraSpec(pitch=1.5, above_ground=0.9, horizontal_fov=2.8)):
        Simulation(OVAL, camera=camera).step([[0.0, 1.0]])
    Simulation(OVAL, seed=2**64 - 1, max_steps=2**31 - 1, substeps=128, laps=1_000_000, camera=None).step([[0.1, 4.0]])
    start = Start(mode="random", offset=-1.0, advance=-1.0, lateral_jitter=1.0, heading_jitter=math.pi, spread=True)
    simulation = Simulation(OVAL, num_envs=np.int64(5), seed=np.uint64(3), start=start, camera=None, num_threads=16)
    for _ in range(20):
        simulation.step(np.tile([0.5, 4.0], (5, 1)))
        simulation.reset(simulation.terminated)


# --- actions and masks


@pytest.mark.parametrize(
    "actions",
    [
        np.zeros((3, 3)), np.zeros((2, 2)), np.zeros((4, 2)), np.zeros(6), np.zeros((1, 3, 2)), np.zeros((0, 2)),
        0.0, [], None, "left", [["a", "b"]] * 3, [[1, 2], [3]], object(), {"steering": 1},
        np.full((3, 2), 1j), [[10**400, 1]] * 3,
    ],
)  # fmt: skip
def test_actions_of_another_shape_or_kind(simulation, actions):
    before = everything(simulation)
    with pytest.raises(ShapeError, match="action"):
        simulation.step(actions)
    assert everything(simulation) == before


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e300])
@pytest.mark.parametrize("column", [0, 1])
def test_actions_that_are_not_finite_move_nothing(simulation, bad, column):
    before = everything(simulation)
    actions = np.zeros((3, 2))
    actions[1, column] = bad
    with pytest.raises(NonFiniteAction, match=r"action\[1\]"):
        simulation.step(actions)
    assert everything(simulation) == before


@pytest.mark.parametrize("make", [np.asarray, np.ndarray.tolist, np.asfortranarray, lambda a: a.astype(np.float16)])
def test_actions_may_be_any_array_of_numbers(simulation, make):
    actions = np.array([[0.25, 1.5], [0.0, 2.0], [-0.5, 0.5]])
    simulation.step(make(actions))
    assert simulation.column("speed").tolist() == [1.5, 2.0, 0.5]
    strided = np.zeros((6, 4))[::2, ::2]
    strided[:] = actions
    simulation.step(strided)
    assert simulation.column("speed").tolist() == [1.5, 2.0, 0.5]


@pytest.mark.parametrize("mask", [np.ones(2, bool), np.ones(3, int), np.ones((3, 1), bool), [1, 0, 1], True, "all"])
def test_masks(simulation, mask):
    before = everything(simulation)
    with pytest.raises(ShapeError, match="mask"):
        simulation.reset(mask)
    assert everything(simulation) == before


@pytest.mark.parametrize("seeds", [np.ones(2, np.uint64), np.ones(3, np.int64), np.ones(3), [1, 2, 3], 5])
def test_seeds(simulation, seeds):
    with pytest.raises(ShapeError, match="seeds"):
        simulation.reset(seeds=seeds)


@pytest.mark.parametrize("choice", [-1, 1, 2**31 - 1])
def test_a_track_that_does_not_exist(simulation, choice):
    simulation.track_choice[1] = choice
    with pytest.raises(ConfigError, match="track_choice"):
        simulation.reset()


# --- poses


@pytest.mark.parametrize("env", [-1, 3, 1.0, None, "0", True])
def test_cars_that_do_not_exist(simulation, env):
    for call in (
        lambda: simulation.set_pose(env, 0, 0, 0),
        lambda: simulation.place(env, 0),
        lambda: simulation.freeze(env, 1),
        lambda: simulation.driven_track(env),
    ):
        with pytest.raises(ConfigError, match="env"):
            call()


@pytest.mark.parametrize("bad", [*NOT_NUMBERS, 1e5 + 1, -1e6])
def test_poses(simulation, bad):
    before = everything(simulation)
    for pose in ((bad, 0, 0), (0, bad, 0), (0, 0, bad)):
        with pytest.raises(ConfigError, match="pose"):
            simulation.set_pose(0, *pose)
    for speed in (bad, -1.0, 11.0):
        with pytest.raises(ConfigError, match="speed"):
            simulation.set_pose(0, 0, 0, 0, speed=speed)
    with pytest.raises(ConfigError, match="arc_length"):
        simulation.place(0, bad)
    with pytest.raises(ConfigError, match="offset"):
        simulation.place(0, 0.0, offset=bad)
    assert everything(simulation) == before


def test_penalties(simulation):
    for steps in (-1, 2**31, 1.5, None):
        with pytest.raises(ConfigError, match="steps"):
            simulation.freeze(0, steps)


@pytest.mark.parametrize(
    "saved", [b"", "state", None, np.zeros(10), np.zeros(9, np.uint8), np.zeros((2, 9), np.uint8), [1, 300], object()]
)
def test_saved_states(simulation, saved):
    with pytest.raises(ShapeError, match=r"^Saved simulation state"):
        simulation.load(saved)


def test_all_errors_are_ours():
    assert issubclass(ConfigError, RacecraftError)
    assert issubclass(ShapeError, ValueError)
    assert Vehicle() == Vehicle()
