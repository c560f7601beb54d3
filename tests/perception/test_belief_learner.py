"""A network that sees nothing but what perception tells: what it is told, what it learns, what refuses it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from racecraft import load_track
from racecraft.car.export import export_run, read_exported
from racecraft.errors import ConfigError
from racecraft.importing import import_run
from racecraft.learn import NetworkSpec, make_learner
from racecraft.learn.networks import PERCEPTION
from racecraft.learn.saliency import grad_cam
from racecraft.perception import Perceiver
from racecraft.perception.answers import IN_SIGHT, MIDDLES, NUM_CONTINUOUS, NUM_OUTPUTS, NUM_TARGETS, PLACES
from racecraft.perception.learner import USUAL_LOG_ERROR, BeliefLearner, byte_slopes, bytes_of
from racecraft.perception.mirror import SIDED, mirrored_answers
from racecraft.race import evaluate
from racecraft.race.policy import load_policy
from racecraft.race.seeing import learner_of
from racecraft.run import RunFolder
from racecraft.sim import Simulation, Start
from racecraft.training import resume, train
from racecraft.training.settings import TrainSettings

SPEC = NetworkSpec(name=PERCEPTION, num_actions=5, state_size=16)
CAMERA_BYTES = 120 * 160


@pytest.fixture(scope="module")
def frames() -> np.ndarray:
    """Pictures of cars here and there on a road  (16, 120, 160)."""
    simulation = Simulation(
        [load_track("reinvent_2018")],
        num_envs=16,
        seed=3,
        start=Start(mode="random", lateral_jitter=0.2, heading_jitter=0.3),
    )
    return np.array(simulation.frames)


def test_every_number_is_told_by_a_byte_that_grows_with_it() -> None:
    outputs = np.zeros((41, NUM_OUTPUTS), np.float32)
    outputs[:, IN_SIGHT] = 1.0
    for place in range(NUM_OUTPUTS):
        line = outputs.copy()
        line[:, place] = np.linspace(-1.5, 1.5, 41) + (USUAL_LOG_ERROR if place >= NUM_TARGETS else 0.0)
        told = bytes_of(line)
        assert (np.diff(told[:, place].astype(int)) > 0).all(), place
        hidden = range(MIDDLES.start, MIDDLES.stop) if IN_SIGHT.start <= place < IN_SIGHT.stop else ()
        others = np.delete(told, [place, *hidden], axis=1)
        assert (others == others[0]).all(), place


def test_nothing_is_128_and_the_largest_numbers_stay_bytes() -> None:
    nothing = np.zeros((1, NUM_OUTPUTS), np.float32)
    assert (bytes_of(nothing)[:, :NUM_TARGETS] == 128).all()
    assert bytes_of(nothing + 1e9).max() <= 255
    assert bytes_of(nothing - 1e9).min() == 1


def test_two_millimetres_beside_the_middle_are_told() -> None:
    outputs = np.zeros((2, NUM_OUTPUTS), np.float32)
    outputs[1, PLACES["offset"]] = 0.0021 / 0.25
    first, second = bytes_of(outputs)
    assert first[PLACES["offset"]] != second[PLACES["offset"]]


def test_columns_of_a_middle_that_is_out_of_sight_are_not_told() -> None:
    outputs = np.full((1, NUM_OUTPUTS), 0.7, np.float32)
    outputs[:, IN_SIGHT] = -2.0
    assert (bytes_of(outputs)[:, MIDDLES] == 128).all()
    outputs[:, IN_SIGHT] = 2.0
    assert (bytes_of(outputs)[:, MIDDLES] > 128).all()


def test_slopes_say_how_far_a_byte_moves() -> None:
    rng, step = np.random.default_rng(2), 0.1
    outputs = rng.normal(size=(64, NUM_OUTPUTS)).astype(np.float32)
    slopes = byte_slopes(outputs)
    for place in set(range(NUM_OUTPUTS)) - set(range(IN_SIGHT.start, IN_SIGHT.stop)):
        more, less = outputs.copy(), outputs.copy()
        more[:, place] += step
        less[:, place] -= step
        moved = bytes_of(more)[:, place].astype(float) - bytes_of(less)[:, place]
        assert slopes[:, place] == pytest.approx(moved / (2 * step), abs=1.0 / (2 * step) + 1.0), place
    hidden = outputs[:, IN_SIGHT] <= 0.0
    assert hidden.any()
    assert not slopes[:, MIDDLES][hidden].any()


def test_a_mirrors_numbers_are_told_as_far_to_the_other_side() -> None:
    outputs = np.random.default_rng(1).normal(size=(8, NUM_OUTPUTS)).astype(np.float32)
    straight, turned = bytes_of(outputs).astype(int), bytes_of(mirrored_answers(outputs)).astype(int)
    sided = [PLACES[name] for name in SIDED]
    assert (straight[:, sided] + turned[:, sided] == 256).all()
    others = [place for place in range(NUM_CONTINUOUS) if place not in sided and place < MIDDLES.start]
    assert (straight[:, others] == turned[:, others]).all()


def test_an_observation_is_what_perception_tells_and_no_more(frames: np.ndarray) -> None:
    learner = BeliefLearner(SPEC, num_threads=1)
    observations = learner.encode(frames)
    assert observations.shape == (16, 10, 10, 1)
    flat = observations.reshape(16, -1)
    np.testing.assert_array_equal(flat[:, :NUM_OUTPUTS], bytes_of(Perceiver().outputs(frames)))
    assert not flat[:, NUM_OUTPUTS:].any()
    assert len(np.unique(flat, axis=0)) == 16


def test_a_picture_is_told_alike_alone_among_others_and_by_any_number_of_threads(frames: np.ndarray) -> None:
    together = BeliefLearner(SPEC, num_threads=2).encode(frames)
    alone = BeliefLearner(SPEC, num_threads=1)
    np.testing.assert_array_equal(np.concatenate([alone.encode(frames[i : i + 1]) for i in range(16)]), together)


def test_what_perception_does_not_look_at_changes_no_action(frames: np.ndarray) -> None:
    learner = BeliefLearner(SPEC, seed=1)
    sky = frames.copy()
    sky[:, :24] = 255 - sky[:, :24]  # a fifth of the picture
    np.testing.assert_array_equal(learner.policy(learner.encode(sky)), learner.policy(learner.encode(frames)))
    road = frames.copy()
    road[:, 60:] = 255 - road[:, 60:]
    assert (learner.policy(learner.encode(road)) != learner.policy(learner.encode(frames))).any()


def test_a_lidar_is_told_beside_the_beliefs(frames: np.ndarray) -> None:
    spec = replace(SPEC, lidar_size=64)
    learner = BeliefLearner(spec, seed=1)
    lidar = np.random.default_rng(0).integers(0, 256, (16, 64), dtype=np.uint8)
    sight = np.concatenate([frames.reshape(16, -1), lidar], axis=1)
    observations = learner.encode(sight)
    np.testing.assert_array_equal(observations[:, 100:], lidar)
    np.testing.assert_array_equal(observations[:, :100], BeliefLearner(SPEC).encode(frames).reshape(16, 100))
    other = sight.copy()
    other[:, CAMERA_BYTES:] = 255 - lidar
    assert (learner.policy(learner.encode(other)) != learner.policy(observations)).any()


def test_two_lenses_a_gpu_and_grad_cam_by_itself_refuse_it() -> None:
    with pytest.raises(ConfigError, match="one lens"):
        learner_of(replace(SPEC, lenses=2))
    with pytest.raises(ConfigError, match="learns on device 'cpu'"):
        TrainSettings(network=PERCEPTION, device="cuda")
    with pytest.raises(ConfigError, match="sees what is told"):  # by itself: `explain` knows perception
        grad_cam(SPEC, make_learner(SPEC).weights(), np.zeros((120, 160), np.uint8))


def _trained(root: Path, until: str, **settings: object) -> Path:
    return train("oval", until=until, network=PERCEPTION, root=root, name="beliefs", num_threads=1, **settings).run  # type: ignore[arg-type]


@pytest.mark.costly
def test_it_goes_on_in_the_bits_of_a_training_that_was_never_broken_off(tmp_path: Path) -> None:
    whole = RunFolder.open(_trained(tmp_path / "a", "2048 steps", evaluate_every=1024))
    broken = RunFolder.open(_trained(tmp_path / "b", "1024 steps", evaluate_every=1024))
    resume(broken.path, until="2048 steps")
    first, second = (load_policy(folder, checkpoint="last")[1].learner.weights() for folder in (whole, broken))
    assert all((first[name] == second[name]).all() for name in first if name.startswith("policy."))


@pytest.mark.costly
def test_a_loaded_policy_drives_as_the_one_that_was_trained(tmp_path: Path, frames: np.ndarray) -> None:
    run = RunFolder.open(_trained(tmp_path, "1024 steps"))
    _, policy = load_policy(run, checkpoint="last")
    commands = policy(frames)
    assert isinstance(policy.learner, BeliefLearner)
    assert np.isfinite(commands).all()
    file = export_run(run.path, checkpoint="last").file
    exported = read_exported(file)
    assert isinstance(exported.learner, BeliefLearner)
    np.testing.assert_array_equal(exported(frames), commands)
    back = RunFolder.open(import_run(file, root=tmp_path, name="back", track="oval").run)
    np.testing.assert_array_equal(load_policy(back)[1](frames), commands)
    evaluation = evaluate(policy, load_track("oval"), num_trials=1, seed=0)
    assert len(evaluation.trials) == 1


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_it_learns_to_lap_from_beliefs_alone(tmp_path: Path, seed: int) -> None:
    result = train(
        "reinvent_2018", until="5 laps or 120000 steps", network=PERCEPTION, seed=seed, root=tmp_path, num_threads=2
    )
    assert result.reason == "laps", result
