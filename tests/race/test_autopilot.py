import numpy as np
import pytest

from racecraft import _native
from racecraft.errors import ConfigError
from racecraft.race.autopilot import Autopilot
from racecraft.sim import STATE_COLUMNS, STATUS_NAMES, Simulation, Start, Vehicle
from racecraft.sim.columns import CURVATURE_AHEAD
from racecraft.track import generate_track, load_track, track_names


def drive(simulation, autopilot, steps=4000):
    for _ in range(steps):
        simulation.step(autopilot(simulation.state))
        if (simulation.terminated | simulation.truncated).all():
            break
    return [STATUS_NAMES[int(status)] for status in simulation.column("status")]


def test_the_state_is_what_it_is_taken_for():
    assert _native.STATE_COLUMNS == STATE_COLUMNS
    track = load_track("bowtie")
    simulation = Simulation(track, camera=None, start=Start(mode="fixed", offset=0.3))
    first = STATE_COLUMNS.index("curvature_0")
    s = simulation.column("projection_distance") + np.array(CURVATURE_AHEAD)
    np.testing.assert_allclose(simulation.state[0, first:], track.curvature_at(s), atol=0.05)


@pytest.mark.costly
@pytest.mark.parametrize("direction", ["forward", "reverse"])
@pytest.mark.parametrize("speed", [1.0, 2.5])
def test_it_laps_every_track_of_the_library_in_both_directions(direction, speed):
    tracks = [load_track(name) for name in track_names()]
    start = Start(mode="fixed")
    simulation = Simulation(tracks, num_envs=len(tracks), camera=None, start=start, direction=direction, num_threads=1)
    assert drive(simulation, Autopilot(speed=speed)) == ["lap_complete"] * len(tracks)


def test_it_laps_generated_tracks_from_anywhere():
    tracks = [generate_track(seed) for seed in range(8)]
    start = Start(mode="random", lateral_jitter=0.1, heading_jitter=0.3)
    simulation = Simulation(tracks, num_envs=16, camera=None, start=start, direction="alternate", num_threads=1)
    assert drive(simulation, Autopilot()) == ["lap_complete"] * 16


def test_it_keeps_to_the_centre_line():
    even = Vehicle(steering_bias=0.0)  # the default car pulls to the left
    simulation = Simulation(load_track("reinvent_2018"), camera=None, start=Start(mode="fixed"), vehicle=even)
    autopilot, furthest = Autopilot(), 0.0
    for _ in range(250):
        simulation.step(autopilot(simulation.state))
        furthest = max(furthest, abs(float(simulation.column("offset")[0])))
    assert furthest < 0.1


@pytest.mark.parametrize(
    ("field", "value"),
    [("speed", 0.0), ("speed", 5.0), ("speed", float("nan")), ("lateral_acceleration", 0.0), ("lookahead", 0.0)],
)
def test_a_wrong_setting_names_itself(field, value):
    with pytest.raises(ConfigError, match=field):
        Autopilot(**{field: value})
