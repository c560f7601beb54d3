"""Domain randomisation: drawn evenly, by car and episode alone, doing what it says, and nothing when it is off."""

from __future__ import annotations

from dataclasses import fields, replace
from itertools import pairwise

import numpy as np
import pytest

from racecraft import _native
from racecraft.sim import CONDITIONS, CameraSpec, Randomization, Simulation, Vehicle
from racecraft.sim.randomization import LIMITS, PRESETS
from racecraft.track import load_track

OVAL = load_track("oval")
SMALL = CameraSpec(width=64, height=48)
STRAIGHT = np.float32([0.0, 1.5])
DRAWN = tuple(name for name in CONDITIONS if name != "strength")
"""Those that `strength` is a share of."""
REAL = {name: getattr(PRESETS["real"], name) for name in DRAWN[DRAWN.index("pale_dashes") :]}
"""Ranges of what only `real` draws."""


def drive(simulation: Simulation, steps: int = 12, action: np.ndarray = STRAIGHT) -> None:
    for _ in range(steps):
        simulation.step(np.tile(action, (simulation.num_envs, 1)))
        simulation.reset(simulation.terminated | simulation.truncated)


def one(camera: CameraSpec | None = SMALL, **ranges: float) -> Simulation:
    """A car under exactly these conditions."""
    return Simulation(OVAL, camera=camera, randomize=Randomization(**{k: (v, v) for k, v in ranges.items()}))


def test_names_are_the_cores():
    assert _native.CONDITIONS == CONDITIONS
    assert [field.name for field in fields(Randomization)] == [*CONDITIONS, "tint", "colour"] == list(LIMITS)


def test_neutral_conditions_change_no_bit():
    """A randomisation whose every range is neutral but one that cannot be seen runs all of its code."""
    plain = Simulation(OVAL, num_envs=8, camera=SMALL, seed=3)
    neutral = Simulation(
        OVAL, num_envs=8, camera=SMALL, seed=3, randomize=replace(Randomization(), gradient_across=(0.0, 1e-9))
    )
    assert len(plain.conditions) == 0
    assert len(neutral.conditions) == 8
    for simulation in (plain, neutral):
        drive(simulation, 40, np.float32([0.2, 2.0]))
    np.testing.assert_array_equal(plain.vehicles, neutral.vehicles)
    np.testing.assert_array_equal(plain.rows, neutral.rows)
    np.testing.assert_array_equal(plain.frames, neutral.frames)


def episodes(simulation: Simulation, count: int) -> np.ndarray:
    """Conditions of each car's first episodes  (count, N, C)."""
    drawn = []
    for _ in range(count):
        drawn.append(simulation.conditions.copy())
        simulation.reset()
    return np.array(drawn)


def test_draws_fill_their_ranges_evenly_and_independently():
    wide = Randomization(**{name: getattr(PRESETS["strong"], name) for name in CONDITIONS[:16]}, **REAL)
    drawn = episodes(Simulation(OVAL, num_envs=500, camera=None, randomize=wide), 8).reshape(-1, len(CONDITIONS))
    drawn = drawn[:, [CONDITIONS.index(name) for name in DRAWN]]
    ranges = np.array([getattr(wide, name) for name in DRAWN])
    unit = (drawn - ranges[:, 0]) / (ranges[:, 1] - ranges[:, 0])
    assert unit.min() >= 0.0
    assert unit.max() <= 1.0
    error = 5.0 / np.sqrt(len(unit))
    np.testing.assert_allclose(unit.mean(axis=0), 0.5, atol=0.29 * error)
    np.testing.assert_allclose(unit.var(axis=0), 1 / 12, atol=0.09 * error)
    between = np.corrcoef(unit.T) - np.eye(len(DRAWN))
    assert np.abs(between).max() < error
    assert len(np.unique(unit, axis=0)) == len(unit)


def test_an_episode_without_strength_is_as_without_randomisation_and_one_of_all_as_ever():
    every = replace(PRESETS["strong"], **REAL)
    settings = {"num_envs": 6, "camera": SMALL, "seed": 3}
    pictures = {}
    for name, ranges in {
        "nothing": "none",
        "none of it": replace(every, strength=(0.0, 0.0)),
        "less than none": replace(every, strength=(-2.0, -1.0)),
        "all": every,
        "more than all": replace(every, strength=(2.0, 3.0)),
        "half": replace(every, strength=(0.5, 0.5)),
    }.items():
        simulation = Simulation(OVAL, **settings, randomize=ranges)
        drive(simulation, 20, np.float32([0.2, 2.0]))
        pictures[name] = (simulation.vehicles.copy(), simulation.rows.copy(), simulation.frames.copy())
    for one, other in (("nothing", "none of it"), ("nothing", "less than none"), ("all", "more than all")):
        for first, second in zip(pictures[one], pictures[other], strict=True):
            np.testing.assert_array_equal(first, second)
    away = {name: np.abs(pictures[name][2].astype(float) - pictures["nothing"][2]).mean() for name in ("half", "all")}
    assert 0.0 < away["half"] < away["all"]


def test_what_is_drawn_beyond_none_and_all_of_it_counts_as_the_end():
    mixed = replace(PRESETS["strong"], strength=(-1.0, 3.0))
    drawn = episodes(Simulation(OVAL, num_envs=500, camera=None, randomize=mixed), 8).reshape(-1, len(CONDITIONS))
    strengths, frictions = drawn[:, CONDITIONS.index("strength")], drawn[:, CONDITIONS.index("friction")]
    assert (strengths.min(), strengths.max()) == (0.0, 1.0)
    assert np.mean(strengths == 0.0) == pytest.approx(0.25, abs=0.03)
    assert np.mean(strengths == 1.0) == pytest.approx(0.5, abs=0.03)
    assert np.all(frictions[strengths == 0.0] == 1.0)
    assert frictions[strengths == 1.0].min() < 0.61
    between = (strengths > 0.0) & (strengths < 1.0)
    assert np.all(frictions[between] >= 1.0 - 0.4 * strengths[between] - 1e-6)


def test_a_draw_depends_on_seed_car_and_episode_alone():
    whole = episodes(Simulation(OVAL, num_envs=6, camera=None, seed=5, randomize="strong", num_threads=2), 3)
    np.testing.assert_array_equal(
        episodes(Simulation(OVAL, num_envs=2, camera=None, seed=5, randomize="strong"), 3), whole[:, :2]
    )
    shown = [i for i, name in enumerate(CONDITIONS) if name in DRAWN and name not in REAL]
    other = episodes(Simulation(OVAL, num_envs=6, camera=None, seed=6, randomize="strong"), 3)
    assert (other != whole)[:, :, shown].all()
    narrower = replace(PRESETS["strong"], friction=(1.0, 1.0), light=(1.0, 1.0))
    others = [i for i, name in enumerate(CONDITIONS) if name not in ("friction", "light")]
    same = episodes(Simulation(OVAL, num_envs=6, camera=None, seed=5, randomize=narrower), 3)
    np.testing.assert_array_equal(same[:, :, others], whole[:, :, others])


def test_a_car_begun_anew_with_a_seed_is_the_first_of_that_seed():
    several = Simulation(OVAL, num_envs=4, camera=SMALL, randomize="strong")
    drive(several)
    several.reset(seeds=np.arange(7, 11, dtype=np.uint64))
    drive(several)
    for car in range(4):
        alone = Simulation(OVAL, camera=SMALL, randomize="strong", seed=7 + car)
        drive(alone)
        np.testing.assert_array_equal(alone.conditions[0], several.conditions[car])
        np.testing.assert_array_equal(alone.vehicles[:, 0], several.vehicles[:, car])
        np.testing.assert_array_equal(alone.frames[0], several.frames[car])


@pytest.mark.parametrize("preset", ["strong", "real"])
@pytest.mark.parametrize("num_threads", [1, 3])
def test_bits_do_not_depend_on_batch_threads_or_instruction_set(num_threads, preset):
    def seen(batch: int) -> list[bytes]:
        records = []
        for first in range(0, 12, batch):
            seeds = np.arange(first, first + batch, dtype=np.uint64)
            simulation = Simulation(OVAL, num_envs=batch, camera=SMALL, randomize=preset, num_threads=num_threads)
            simulation.reset(seeds=seeds)
            drive(simulation, 20, np.float32([0.3, 3.0]))
            arrays = (simulation.vehicles.T, simulation.frames, simulation.rows)
            records += [b"".join(array[car].tobytes() for array in arrays) for car in range(batch)]
        return records

    best = _native.isa()
    try:
        expected = seen(12)
        for isa in _native.available_isas():
            _native.set_isa(isa)
            assert seen(4) == expected
    finally:
        _native.set_isa(best)


def test_a_saved_simulation_goes_on_as_if_nothing_had_happened():
    saved_one, other = (Simulation(OVAL, num_envs=3, camera=SMALL, seed=1, randomize="strong") for _ in range(2))
    drive(saved_one, 20, np.float32([0.4, 2.0]))
    saved = saved_one.save()
    other.load(saved)
    for simulation in (saved_one, other):
        drive(simulation, 20, np.float32([0.4, 2.0]))
    for name in ("vehicles", "frames", "rows", "conditions", "parameters"):
        np.testing.assert_array_equal(getattr(saved_one, name), getattr(other, name))


@pytest.mark.parametrize("preset", ["strong", "real"])
def test_a_saved_episode_comes_back_with_its_conditions(preset):
    """Conditions, cameras, latencies and shakes are not saved but drawn again, by seed, car, episode and step."""
    saved_one = Simulation(OVAL, num_envs=3, camera=SMALL, seed=1, randomize=preset, lidar=True)
    saved_one.reset()
    drive(saved_one, 3)
    saved_one.reset(np.array([True, False, True]))
    drive(saved_one, 5)
    other = Simulation(OVAL, num_envs=3, camera=SMALL, seed=2, randomize=preset, lidar=True)
    drawn = [i for i, name in enumerate(CONDITIONS) if np.ptp(getattr(PRESETS[preset], name)) > 0.0]
    assert (other.conditions != saved_one.conditions)[:, drawn].all()
    other.load(saved_one.save())
    for _ in range(10):
        for name in ("conditions", "frames", "lidar", "state", "vehicles", "rows"):
            np.testing.assert_array_equal(getattr(other, name), getattr(saved_one, name))
        for simulation in (saved_one, other):
            simulation.step(np.tile(np.float32([0.3, 3.0]), (3, 1)))


# ---- what each quantity does


def test_conditions_reach_the_car():
    randomize = Randomization(friction=(0.7, 0.7), mass=(1.25, 1.25), speed_gain=(0.9, 0.9), steering_bias=(0.01, 0.01))
    simulation = Simulation(OVAL, camera=None, randomize=randomize)
    car = dict(zip(_native.VEHICLE_PARAMETERS, simulation.parameters[:, 0].tolist(), strict=True))
    base = Vehicle()
    assert car["front_friction"] == pytest.approx(0.7 * base.front_friction)
    assert car["rear_friction"] == pytest.approx(0.7 * base.rear_friction)
    assert car["mass"] / car["yaw_inertia"] == pytest.approx(base.mass / base.yaw_inertia)
    assert car["drive_acceleration"] == pytest.approx(base.drive_acceleration / 1.25)
    assert car["brake_acceleration"] == pytest.approx(base.brake_acceleration / 1.25)
    assert car["speed_gain"] == pytest.approx(0.9 * base.speed_gain)
    assert car["steering_bias"] == pytest.approx(base.steering_bias + 0.01)
    assert car["front_axle"] == pytest.approx(base.front_axle)


@pytest.mark.parametrize("latency", [0, 1, 2])
def test_a_late_command_acts_whole_steps_later(latency):
    """A car with a latency does what one without does that many steps later; it stands meanwhile."""
    prompt, late = one(camera=None), one(camera=None, latency=float(latency))
    actions = [np.float32([[0.1 * np.sin(step), 1.0 + 0.5 * np.cos(step)]]) for step in range(12)]
    tracks = []
    for simulation, delay in ((prompt, 0), (late, latency)):
        poses = []
        for action in [*actions, *[actions[-1]] * delay]:
            simulation.step(action)
            poses.append(simulation.vehicles[:, 0].copy())
        tracks.append(np.array(poses[delay:]))
    # the wheels of a standing car already turn to the late car's straight command, so its bias has acted
    np.testing.assert_allclose(tracks[1][:, :4], tracks[0][:, :4], atol=2e-3)
    assert latency == 0 or not np.array_equal(tracks[1], tracks[0])


def test_latency_may_be_a_fraction_of_a_step():
    travelled = []
    for latency in (0.0, 0.5, 1.0):
        simulation = one(camera=None, latency=latency)
        begin = simulation.vehicles[:2, 0].copy()
        drive(simulation, 8, np.float32([0.0, 2.0]))
        travelled.append(float(np.hypot(*(simulation.vehicles[:2, 0] - begin))))
    whole = travelled[0] - travelled[2]
    assert 0.05 < whole < 2.0 / 15.0
    assert travelled[0] - travelled[1] == pytest.approx(0.5 * whole, rel=0.1)


def test_a_latency_is_rounded_to_the_nearest_substep():
    ends = []
    for latency in (0.49, 0.5, 0.51, 0.43, 0.57):  # of a step, which has 8 substeps
        simulation = one(camera=None, latency=latency)
        drive(simulation, 3, np.float32([0.3, 2.0]))
        ends.append(simulation.vehicles[:, 0].tolist())
    assert ends[0] == ends[1] == ends[2]
    assert ends[3] != ends[1] != ends[4]


def test_no_command_is_remembered_beyond_a_reset_or_a_new_place():
    simulation = one(camera=None, latency=2.0)
    drive(simulation, 10, np.float32([0.5, 4.0]))
    simulation.place(0, 3.0)
    x = simulation.vehicles[0, 0]
    simulation.step(STRAIGHT[None])
    assert simulation.vehicles[0, 0] == x
    assert simulation.vehicles[3, 0] == 0.0
    drive(simulation, 10, np.float32([0.1, 4.0]))
    simulation.reset()
    start = simulation.vehicles[:4, 0].copy()
    simulation.step(STRAIGHT[None])
    np.testing.assert_array_equal(simulation.vehicles[:4, 0], start)


def test_the_camera_moves_as_a_camera_of_that_place_would():
    moved = one(camera_pitch=0.05, camera_height=0.03, camera_left=0.02, camera_forward=-0.02, camera_fov=0.1)
    spec = replace(
        SMALL,
        pitch=SMALL.pitch + 0.05,
        above_ground=SMALL.above_ground + 0.03,
        left=0.02,
        forward=SMALL.forward - 0.02,
        horizontal_fov=SMALL.horizontal_fov + 0.1,
    )
    expected = Simulation(OVAL, camera=spec)
    difference = np.abs(moved.frames.astype(int) - expected.frames)
    assert difference.max() <= 1  # the sums are rounded elsewhere
    assert np.abs(moved.frames.astype(int) - one().frames).mean() > 3


def test_yaw_turns_the_camera_about_itself():
    angle = 0.2
    seen = one(camera_yaw=angle).frames[0].copy()
    turned = Simulation(OVAL, camera=replace(SMALL, forward=0.0))
    car = Simulation(OVAL, camera=SMALL)
    x, y, heading = car.vehicles[:3, 0].tolist()
    lens = SMALL.forward
    turned.set_pose(0, x + lens * np.cos(heading), y + lens * np.sin(heading), heading + angle)
    assert np.abs(seen.astype(int) - turned.frames[0]).max() <= 1


def test_light_and_black_level_are_linear():
    plain = one().frames.astype(float)
    np.testing.assert_allclose(one(light=0.5).frames, 0.5 * plain, atol=1.5)
    np.testing.assert_allclose(one(black_level=0.1).frames, plain + 25.5, atol=3.0)  # grain is a share of brightness
    assert one(light=4.0).frames.max() == 255
    assert one(black_level=-0.5).frames.min() == 0


def test_a_gradient_lights_one_side():
    plain, across, down = (
        s.frames[0].astype(float) for s in (one(), one(gradient_across=0.4), one(gradient_down=-0.3))
    )
    x = (np.arange(64) + 0.5) / 32 - 1
    y = (np.arange(48) + 0.5) / 24 - 1
    np.testing.assert_allclose(across, np.minimum(plain * (1 + 0.4 * x), 255), atol=1)
    np.testing.assert_allclose(down, np.minimum(plain * (1 - 0.3 * y)[:, None], 255), atol=1)


@pytest.mark.parametrize("sigma", [0.3, 0.8, 1.5, 3.0])
def test_blur_is_a_gaussian_of_that_width(sigma):
    from scipy.ndimage import gaussian_filter

    expected = gaussian_filter(one().frames[0].astype(float), sigma, mode="reflect")
    difference = np.abs(one(blur=sigma).frames[0] - expected)
    assert difference.mean() < (1.5 if sigma < 1 else 0.8)  # grain is a blurred pixel's worst neighbour
    assert difference.max() < (14 if sigma < 1 else 5)  # a narrow one is hardly a Gaussian in whole pixels


def test_tint_weighs_the_colours():
    randomize = Randomization(tint=(0.0, 2.0))
    levels = []
    for seed in range(40):
        frame = Simulation(OVAL, camera=SMALL, seed=seed, randomize=randomize).frames[0]
        levels.append((np.median(frame[-8:, 20:44]), frame.mean()))
    road, mean = np.array(levels).T
    assert road.std() > 8
    assert mean.std() > 8
    assert 0.5 < np.corrcoef(road, mean)[0, 1] < 1.0


def test_every_colour_has_its_own_shift():
    frames = Simulation(OVAL, num_envs=200, camera=SMALL, randomize=Randomization(colour=(-0.1, 0.1))).frames
    sky, road = frames[:, 0, 32].astype(float), frames[:, -1, 20].astype(float)
    for level in (sky, road):
        assert 40 < np.ptp(level) <= 52
    assert abs(np.corrcoef(sky, road)[0, 1]) < 0.3


def test_dashes_fade_to_the_edge_lines_and_walls_to_white():
    def seen(**ranges: float) -> np.ndarray:
        simulation = one(**ranges)
        simulation.place(0, 0.0)
        return simulation.frames[0].astype(int)

    plain, half, pale = (seen(pale_dashes=share) for share in (0.0, 0.5, 1.0))
    changed = pale != plain
    assert 20 < changed.sum() < 400
    assert (pale > plain)[changed].all()
    assert np.abs(2 * half - plain - pale).max() <= 3
    assert pale[changed].max() == pytest.approx(plain[20:].max(), abs=2)  # an edge line's

    walls = seen(pale_walls=0.5)
    assert (walls[20:] == plain[20:]).all()
    assert walls[:8].min() == pytest.approx(127 + plain[:8].min() / 2, abs=2)


def test_lower_walls_show_the_hall_above_them():
    """Rows of sky at the top grow as walls shrink, as a ray over the wall's upper edge says."""
    shown = []
    for height in (0.0, -0.5, -0.75):
        frame = one(CameraSpec(), wall_height=height).frames[0]
        shown.append(int((frame[:60, 80] > 150).sum()))
    assert shown[0] < shown[1] < shown[2]


def test_a_crowd_is_seen_above_the_walls_and_hardly_on_them():
    plain = one(CameraSpec(), wall_height=-0.75).frames[0].astype(int)
    full = one(CameraSpec(), wall_height=-0.75, crowd=1.0).frames[0].astype(int)
    change = np.abs(full - plain)
    above, wall = plain == 180, plain < 40
    wall[60:] = False
    assert above.sum() > 500
    assert change[above].mean() > 30
    assert 1 < change[wall].mean() < 12
    assert change[60:].max() == 0
    halls = {one(CameraSpec(), wall_height=-0.75, crowd=1.0).frames[0].tobytes()}
    for seed in range(4):
        randomize = Randomization(wall_height=(-0.75, -0.75), crowd=(1.0, 1.0))
        halls.add(Simulation(OVAL, randomize=randomize, seed=seed + 5).frames[0].tobytes())
    assert len(halls) == 5


def test_pictures_of_a_car_that_stands_shake_and_are_noisy():
    simulation = one(CameraSpec(), shake=0.01)
    stand = np.zeros((1, 2), np.float32)
    pictures = []
    for _ in range(6):
        pictures.append(simulation.frames[0].astype(int))
        simulation.step(stand)
    assert all(np.abs(a - b).max() > 20 for a, b in pairwise(pictures))
    noisy = one(CameraSpec(), noise=0.02)
    plain = one(CameraSpec()).frames[0].astype(int)
    first = noisy.frames[0].astype(int)
    assert (first - plain)[40:].std() == pytest.approx(5.1, abs=0.6)
    noisy.step(stand)
    assert np.abs(noisy.frames[0] - first).mean() > 4


def test_a_turning_car_smears_its_pictures_and_one_that_goes_straight_does_not():
    contrast = {}
    for name, steering in (("straight", 0.0), ("turning", 0.5)):
        sharp, smeared = one(CameraSpec()), one(CameraSpec(), shutter=0.02)
        for simulation in (sharp, smeared):
            drive(simulation, 8, np.float32([steering, 2.0]))
        edges = [np.abs(np.diff(s.frames[0, 40:].astype(int), axis=1)).max(axis=1).mean() for s in (sharp, smeared)]
        contrast[name] = edges[1] / edges[0]
    assert contrast["straight"] > 0.95
    assert contrast["turning"] < 0.8


def test_two_lenses_shake_together_and_have_noise_of_their_own():
    camera = CameraSpec(baseline=0.06)
    left, right = one(camera, shake=0.02).frames[0].astype(int)
    still = one(camera).frames[0].astype(int)
    rows = [int(np.abs(np.diff(eye[:, 80])).argmax()) for eye in (left, right, *still)]
    assert abs((rows[0] - rows[2]) - (rows[1] - rows[3])) <= 1
    noisy = one(camera, noise=0.02).frames[0].astype(int) - still
    assert abs(np.corrcoef(noisy.reshape(2, -1))[0, 1]) < 0.1


@pytest.mark.parametrize("name", sorted(PRESETS))
def test_every_preset_drives(name):
    for vehicle in ("v4", "v5", "v6"):
        simulation = Simulation(OVAL, num_envs=16, camera=SMALL, vehicle=vehicle, randomize=name)
        drive(simulation, 30, np.float32([0.3, 4.0]))
        assert np.isfinite(simulation.vehicles).all()


# ---- several tracks


def test_tracks_are_drawn_for_every_episode():
    tracks = [load_track(name) for name in ("oval", "hairpin", "reinvent_2018")]
    simulation = Simulation(tracks, num_envs=300, camera=None, track_order="random", direction="alternate")
    chosen = []
    for _ in range(4):
        chosen.append(simulation.column("track_index").astype(int).copy())
        simulation.reset()
    for episode, indices in enumerate(chosen):
        assert (indices // 3 == episode % 2).all()  # every other one reversed
        assert (np.bincount(indices % 3, minlength=3) > 60).all()
    assert (chosen[0] % 3 != chosen[1] % 3).any()
    again = Simulation(tracks, num_envs=20, camera=None, track_order="random")
    np.testing.assert_array_equal(again.column("track_index"), chosen[0][:20])
