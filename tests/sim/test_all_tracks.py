"""A million steps with extreme commands over AWS's routes: no NaN, nothing escapes, the rules end every episode."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from racecraft.sim import STATUS_NAMES, Simulation, Start
from racecraft.track import load_track

ROUTES = Path(__file__).parents[3] / "shared" / "tracks"
CARS_PER_TRACK = 8


def extreme(rng: np.random.Generator, previous: np.ndarray) -> np.ndarray:
    """Full lock and full speed, stops and numbers far out of range, held for a while."""
    n = len(previous)
    steering = rng.choice([-1e9, -0.6, -0.2, 0.0, 0.2, 0.6, 1e9], n)
    speed = rng.choice([-1e9, 0.0, 0.5, 1.5, 4.0, 1e9], n)
    return np.where(rng.random((n, 1)) < 0.15, np.stack((steering, speed), axis=1), previous)


def check(simulation: Simulation, speed_limit: float) -> None:
    for array in (simulation.rows, simulation.state, simulation.vehicles):
        assert np.isfinite(array).all()
    assert (np.hypot(*simulation.vehicles[3:5]) < speed_limit).all()
    half_width, offset = simulation.state[:, 7], np.abs(simulation.column("offset"))
    # All wheels off is at most a car's length beyond the border; a step later the episode is over.
    assert (offset < half_width + 0.4 + speed_limit / 15.0).all()
    progress, status = simulation.column("progress"), simulation.column("status").astype(int)
    assert (np.abs(progress) < 1.5).all()
    ended = simulation.terminated
    assert np.isin(
        status[ended], [STATUS_NAMES.index(s) for s in ("lap_complete", "off_track", "immobilized", "reversed")]
    ).all()
    assert np.isin(status[~ended], [STATUS_NAMES.index(s) for s in ("in_progress", "time_up", "lap_complete")]).all()
    prev, following = simulation.column("closest_prev"), simulation.column("closest_next")
    assert ((prev >= 0) & (following == prev + 1)).all()
    wheels = simulation.column("all_wheels_on_track") + simulation.column("is_offtrack")
    assert (wheels <= 1).all()


def drive(tracks: list, num_steps: int, *, camera: bool) -> None:
    settings = {} if camera else {"camera": None}
    simulation = Simulation(
        tracks,
        num_envs=CARS_PER_TRACK * len(tracks),
        direction="alternate",
        start=Start(mode="random", lateral_jitter=0.3, heading_jitter=3.0),
        time_limit=20.0,
        **settings,
    )
    rng = np.random.default_rng(11)
    actions = np.zeros((simulation.num_envs, 2))
    longest, seen = 0, set()
    for _ in range(num_steps):
        actions = extreme(rng, actions)
        simulation.step(actions)
        check(simulation, speed_limit=8.0)
        done = simulation.terminated | simulation.truncated
        seen |= {STATUS_NAMES[int(s)] for s in simulation.column("status")[done]}
        longest = max(longest, int(simulation.column("steps").max()))
        simulation.reset(done)
    assert longest <= 300
    assert {"off_track", "reversed", "immobilized"} <= seen


def routes() -> list:
    if not ROUTES.is_dir():
        pytest.skip("the folder ../shared/tracks with AWS's routes is not here")
    return [load_track(path) for path in sorted(ROUTES.glob("*.npy"))]


def test_a_few_tracks_with_the_camera():
    drive([load_track(name) for name in ("oval", "bowtie", "reinvent_2018")], 120, camera=True)


@pytest.mark.slow
def test_a_million_steps_over_all_routes():
    tracks = routes()
    assert len(tracks) == 127
    drive(tracks, 1_000_000 // (CARS_PER_TRACK * len(tracks)) + 1, camera=False)


@pytest.mark.slow
def test_the_core_agrees_with_the_track_on_every_route():
    for track in routes():
        simulation = Simulation(track, num_envs=32, camera=None, start=Start(mode="random", lateral_jitter=0.3))
        front = simulation.rows[:, 2:4]
        arc_length, offset = track.project(front)
        apart = np.abs(simulation.column("projection_distance") - arc_length)
        assert (np.minimum(apart, track.length - apart) < 1e-6).all(), track.name
        np.testing.assert_allclose(simulation.column("offset"), offset, atol=1e-9)
        np.testing.assert_allclose(simulation.column("track_width"), track.width_at(arc_length), atol=1e-9)
        assert simulation.column("track_length")[0] == pytest.approx(track.length, rel=1e-12)
