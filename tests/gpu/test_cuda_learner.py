"""The learner and PPO of a GPU, with their tensors on the CPU: against the reference, and as a training that learns."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest
from host_device import HostDevice

from racecraft.agent import action_space
from racecraft.errors import CheckpointError, ConfigError, TrainingError
from racecraft.learn import Minibatch, NetworkSpec, Objective, PPOConfig, make_learner
from racecraft.reward import RewardWorker, load_reward
from racecraft.run import EpisodeCounter
from racecraft.sim import CameraSpec, CudaSimulation, Start
from racecraft.sim.columns import state_width
from racecraft.track import load_track
from racecraft.training.cuda_environment import CudaTrainingEnvironment

pytestmark = pytest.mark.skipif(find_spec("torch") is None, reason="torch is not installed")

OBJECTIVE = Objective(
    learning_rate=1e-3, clip_coef=0.2, ent_coef=0.01, vf_coef=0.5, value_loss="mse", max_grad_norm=0.5
)
CAMERA = CameraSpec(width=128, height=100)


def spec_of(is_discrete: bool, state_size: int) -> NetworkSpec:
    return NetworkSpec(
        num_actions=5 if is_discrete else 2, is_discrete=is_discrete, state_size=state_size, frame_shape=(100, 128)
    )


def CudaLearner(spec: NetworkSpec, **settings):
    from racecraft.learn import torch_cuda_learner  # and torch, which takes seconds to load, not before it is needed

    return torch_cuda_learner.CudaLearner(spec, device="cpu", **settings)


def minibatch_of(learner, size: int, seed: int = 0) -> Minibatch:
    rng = np.random.default_rng(seed)
    spec = learner.spec
    frames = rng.integers(0, 256, (size, *spec.frame_shape), dtype=np.uint8)
    actions = rng.integers(0, spec.num_actions, size) if spec.is_discrete else rng.normal(size=(size, 2))
    return Minibatch(
        observations=learner.encode(frames),
        states=rng.normal(size=(size, spec.state_size)).astype(np.float32),
        actions=actions if spec.is_discrete else actions.astype(np.float32),
        log_probs=rng.normal(-1.6, 0.1, size).astype(np.float32),
        advantages=rng.normal(size=size).astype(np.float32),
        returns=rng.normal(size=size).astype(np.float32),
    )


@pytest.mark.parametrize(("is_discrete", "state_size"), [(True, 16), (False, 16), (True, 0)])
def test_gradient_steps_are_those_of_the_reference(is_discrete, state_size):
    spec = spec_of(is_discrete, state_size)
    import torch

    ours = CudaLearner(spec, precision="float32")
    theirs = make_learner(spec, backend="torch")
    theirs._dtype = torch.float32
    for step in range(3):
        minibatch = minibatch_of(ours, 96, step)
        mine, reference = ours.update(minibatch, OBJECTIVE), theirs.update(minibatch, OBJECTIVE)
        for name in ("policy_loss", "value_loss", "entropy", "approx_kl", "clip_fraction", "grad_norm"):
            assert getattr(mine, name) == pytest.approx(getattr(reference, name), rel=1e-4, abs=1e-6), name
    for name, weights in theirs.weights().items():
        np.testing.assert_allclose(ours.weights()[name], weights, rtol=1e-3, atol=2e-5, err_msg=name)
    frames = minibatch_of(ours, 7).observations
    np.testing.assert_allclose(ours.policy(frames), theirs.policy(frames), rtol=1e-3, atol=1e-4)


def test_frames_are_encoded_as_everywhere():
    import torch

    learner = CudaLearner(spec_of(True, 16))
    frames = np.random.default_rng(1).integers(0, 256, (5, 100, 128), dtype=np.uint8)
    assert (learner.encode_frames(torch.from_numpy(frames)).numpy() == learner.encode(frames)).all()


def test_a_step_that_is_not_finite_changes_nothing():
    learner = CudaLearner(spec_of(True, 16))
    minibatch = minibatch_of(learner, 16)
    learner.update(minibatch, OBJECTIVE)
    before, moments = learner.weights(), learner.optimizer_state()
    minibatch.returns[3] = np.nan
    assert not learner.update(minibatch, OBJECTIVE).is_finite
    for name, weights in before.items():
        assert (learner.weights()[name] == weights).all()
    for name, array in moments.items():
        assert (learner.optimizer_state()[name] == array).all()
    with pytest.raises(CheckpointError):
        learner.load_weights({})


def test_without_a_gpu_the_learner_says_so():
    import torch

    if torch.cuda.is_available():
        pytest.skip("this machine has a GPU")
    with pytest.raises(ConfigError, match="torch finds no GPU"):
        make_learner(spec_of(True, 16), device="cuda")


def open_ppo(*, reward: str = "racing", config: PPOConfig | None = None, actions: str = "default", notes=None):
    from racecraft.learn.torch_cuda_ppo import CudaPPO

    config = config or PPOConfig(num_envs=32, num_steps=8, minibatch_size=64)
    tracks = [load_track("oval")]
    simulation = CudaSimulation(
        tracks, num_envs=config.num_envs, device=HostDevice(), camera=CAMERA, start=Start(mode="random"), max_steps=40
    )
    space = action_space(actions)
    source = reward if "\n" in reward else load_reward(reward)
    environment = CudaTrainingEnvironment(
        simulation,
        RewardWorker(source, tracks),
        source,
        space,
        counter=EpisodeCounter(config.num_envs),
        note=(notes if notes is not None else []).append,
    )
    is_discrete = space.kind == "discrete"
    spec = NetworkSpec(
        num_actions=space.size if is_discrete else 2,
        is_discrete=is_discrete,
        state_size=state_width(0),
        frame_shape=(100, 128),
    )
    learner = CudaLearner(spec)
    return CudaPPO(config, learner, environment, seed=3), environment


@pytest.mark.costly
@pytest.mark.parametrize("actions", ["default", "continuous"])
def test_an_iteration_does_what_it_says(actions):
    notes: list[str] = []
    ppo, environment = open_ppo(actions=actions, notes=notes)
    before = ppo.learner.weights()
    total = 0
    for iteration in range(1, 9):
        stats = ppo.iterate()
        total += len(environment.take_finished())
        assert stats.iteration == iteration
        assert stats.total_steps == iteration * 256
        assert np.isfinite([stats.losses.policy_loss, stats.losses.grad_norm]).all()
    assert total == environment.counter.number > 32
    assert notes == ["The reward function runs on the GPU."]
    assert any((before[name] != array).any() for name, array in ppo.learner.weights().items())


@pytest.mark.costly
def test_interpreted_and_translated_rewards_train_alike():
    def run(reward: str, notes: list[str]):
        ppo, _ = open_ppo(reward=reward, notes=notes)
        for _ in range(3):
            ppo.iterate()
        return ppo.learner.weights()

    plain = "def reward_function(params):\n    return float(params['progress'] + params['speed'])\n"
    told: list[str] = []
    ours, theirs = run(plain, told), run(plain + "SEEN = [1.0]\n", told)
    assert "runs on the GPU" in told[0]
    assert "interpreted on the CPU" in told[1]
    for name, weights in ours.items():
        np.testing.assert_allclose(theirs[name], weights, rtol=1e-5, atol=1e-6)


@pytest.mark.costly
def test_advantages_are_those_of_the_reference():
    ppo, _ = open_ppo(config=PPOConfig(num_envs=16, num_steps=44, minibatch_size=64, normalize_returns=False))
    ppo._generator.manual_seed(1)
    ppo._collect_all()
    ppo._estimate_all()
    from racecraft._native import generalized_advantages

    values = ppo.learner.estimates(ppo._observations.flatten(0, 1), ppo._states.flatten(0, 1)).view(44, 16)
    advantages, returns = generalized_advantages(
        rewards=ppo._rewards.numpy(),
        values=values.numpy(),
        next_values=ppo._next_values.numpy(),
        terminated=ppo._ends.numpy(),
        truncated=ppo._cuts.numpy(),
        gamma=ppo.config.gamma,
        gae_lambda=ppo.config.gae_lambda,
    )
    assert ppo._cuts.any() or ppo._ends.any()
    np.testing.assert_allclose(ppo._returns.view(44, 16), returns, rtol=1e-4, atol=1e-4)
    normal = (advantages - advantages.mean()) / advantages.std()
    np.testing.assert_allclose(ppo._advantages.view(44, 16), normal, rtol=1e-3, atol=1e-3)


@pytest.mark.costly
def test_training_goes_on_from_its_state():
    first, _ = open_ppo()
    for _ in range(2):
        first.iterate()
    state, cars = first.state(), first.cars.simulation.save()
    second, _ = open_ppo()
    second.load_state(state)
    second.cars.simulation.load(cars)
    assert first.iterate().mean_return == pytest.approx(second.iterate().mean_return, nan_ok=True)
    for name, weights in first.learner.weights().items():
        assert (second.learner.weights()[name] == weights).all()


@pytest.mark.costly
def test_what_a_gpu_does_not_train_is_refused():
    with pytest.raises(ConfigError, match="whole episodes"):
        open_ppo(config=PPOConfig(num_envs=32, episodes_per_iteration=20, minibatch_size=64))
    ppo, _ = open_ppo()
    ppo._rewards[0, 0] = float("nan")
    with pytest.raises(TrainingError, match="not a number"):
        ppo._tell_episodes()
