"""The car that drives on the page at first: in halves of numbers, it laps whatever track somebody chooses."""

from __future__ import annotations

import numpy as np
import pytest

from racecraft.agent.sensor_suite import FRONT_CAMERA
from racecraft.learn import make_learner
from racecraft.learn.flat_weights import split_weights
from racecraft.race.policy import NetworkPolicy, load_policy
from racecraft.run import RunFolder
from racecraft.run.starters import FOLDER
from racecraft.sim import STATUS_NAMES, Simulation, Start
from racecraft.site.plan import plan
from racecraft.site.starter import SHOWN, told_starter
from racecraft.track import load_track, track_names


@pytest.fixture(scope="module")
def policy() -> NetworkPolicy:
    _, weights = told_starter()
    whole = load_policy(RunFolder(FOLDER / SHOWN), num_threads=1)[1]
    learner = make_learner(whole.learner.spec, seed=None, num_threads=1)
    learner.load_weights(split_weights(weights.astype(np.float32), learner.spec))
    return NetworkPolicy(learner, whole.action_space, sensors=whole.sensors)


@pytest.mark.costly
@pytest.mark.parametrize("name", track_names())
def test_it_laps(policy: NetworkPolicy, name: str) -> None:
    track = load_track(name)
    car = Simulation(track, camera=FRONT_CAMERA.camera(), start=Start(mode="fixed"), laps=1)
    for _ in range(int(15 * track.length / 0.5)):
        car.step(policy(car.frames))
        if car.terminated[0] or car.truncated[0]:
            break
    assert STATUS_NAMES[int(car.column("status")[0])] == "lap_complete"


def test_the_page_has_a_network_of_its_size_and_its_commands() -> None:
    told, weights = told_starter()
    network = plan()["races"]["time-trial"]["policies"]["continuous"]
    assert len(weights) == sum(int(np.prod(shape)) for _, shape in network["weights"])
    assert np.isfinite(weights).all()
    low, high = np.reshape(told["table"], (2, 2))
    assert (low < high).all()
    assert low[0] == pytest.approx(-high[0])
