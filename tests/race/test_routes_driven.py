"""Every AWS route, a full lap in each direction, by a driver that only follows the centre line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from racecraft.race import Autopilot
from racecraft.sim import STATUS_NAMES, Simulation, Start
from racecraft.track import load_track

ROUTES = Path(__file__).parents[3] / "shared" / "tracks"


@pytest.mark.slow
def test_every_route_is_lapped_in_both_directions_with_all_wheels_on_the_road() -> None:
    if not ROUTES.is_dir():
        pytest.skip("the folder ../shared/tracks with AWS's routes is not here")
    tracks = [load_track(path) for path in sorted(ROUTES.glob("*.npy"))]
    assert len(tracks) == 127
    is_closed = np.array([track.is_closed for track in tracks])
    # episodes alternate: the first one of every car runs forward, the second in reverse
    simulation = Simulation(
        tracks, num_envs=127, camera=None, start=Start(mode="fixed"), direction="alternate", num_threads=1
    )
    autopilot = Autopilot(speed=1.0)
    for is_reversed in (0.0, 1.0):
        assert (simulation.column("is_reversed") == is_reversed).all()
        on_road = np.ones(127, dtype=bool)
        for _ in range(2000):
            simulation.step(autopilot(simulation.state))
            on_road &= simulation.column("all_wheels_on_track") == 1.0
            if simulation.terminated.all():
                break
        status = [STATUS_NAMES[int(code)] for code in simulation.column("status")]
        wrong = {t.name: s for t, s in zip(tracks, status, strict=True) if s != "lap_complete"}
        assert wrong == {}
        # an open road begins at the start line: the rear wheels stand before it
        assert [t.name for t, is_on in zip(tracks, on_road | ~is_closed, strict=True) if not is_on] == []
        simulation.reset()
