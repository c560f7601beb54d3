"""Minibatches of random samples, and the networks and their loss written down slowly and obviously."""

from __future__ import annotations

import numpy as np

from racecraft.learn import Learner, Minibatch, NetworkSpec, Objective, networks
from racecraft.learn.distributions import log_prob

OBJECTIVE = Objective(
    learning_rate=1e-3, clip_coef=0.2, ent_coef=0.01, vf_coef=0.5, value_loss="mse", max_grad_norm=0.5
)


def sight_for(spec: NetworkSpec, size: int, *, seed: int = 0) -> np.ndarray:
    """What the sensors might tell."""
    return np.random.default_rng(seed).integers(0, 256, (size, *networks.sight_shape(spec)), dtype=np.uint8)


def minibatch_for(learner: Learner, size: int = 192, *, seed: int = 0) -> Minibatch:
    rng, spec = np.random.default_rng(seed), learner.spec
    observations = learner.encode(rng.integers(0, 256, (size, *networks.sight_shape(spec)), dtype=np.uint8))
    if spec.is_discrete:
        actions = rng.integers(0, spec.num_actions, size)
    else:
        actions = rng.normal(size=(size, spec.num_actions)).astype(np.float32)
    return Minibatch(
        observations=observations,
        states=rng.normal(size=(size, spec.state_size)).astype(np.float32),
        actions=actions,
        log_probs=log_prob(learner.policy(observations), actions, is_discrete=spec.is_discrete),
        advantages=rng.normal(size=size).astype(np.float32),
        returns=rng.normal(size=size).astype(np.float32),
    )


def parts_of(spec: NetworkSpec, sight) -> tuple[np.ndarray, np.ndarray]:
    """Images (N, lenses, H, W) and the LIDAR's bytes (N, L)."""
    size = spec.lenses * int(np.prod(networks.picture_shape(spec)))
    flat = sight.reshape(len(sight), -1)
    return flat[:, :size].reshape(-1, spec.lenses, *networks.picture_shape(spec)), flat[:, size:]


def reference_tower(spec: NetworkSpec, weights, sight, tower: str) -> np.ndarray:
    """The tower that sees the sensors, in float64."""
    arch = networks.architecture_of(spec)
    height, width = networks.pooled_shape(spec)
    frames, lidar = parts_of(spec, sight)
    frames = frames[:, :, networks.sky_rows(spec) :]
    pooled = frames.reshape(len(frames), spec.lenses, height, arch.pool, width, arch.pool).mean((3, 5))
    x = np.floor(pooled + 0.5) / 255

    def dense(layer: str, x):
        return (x @ weights[f"{layer}.weight"].T + weights[f"{layer}.bias"]).clip(0)

    for i, conv in enumerate(arch.convs, 1):
        weight, bias = (weights[f"{tower}.conv{i}.{part}"].astype(float) for part in ("weight", "bias"))
        windows = np.lib.stride_tricks.sliding_window_view(x, (conv.kernel, conv.kernel), (2, 3))
        windows = windows[:, :, :: conv.stride, :: conv.stride]
        x = np.einsum("nchwij,fcij->nfhw", windows, weight, optimize=True) + bias[:, None, None]
        x = x.clip(0)
    x = x.transpose(0, 2, 3, 1).reshape(len(x), -1)
    if spec.lidar_size:
        y = lidar / 255
        for i in range(1, len(arch.lidar) + 1):
            y = dense(f"{tower}.lidar{i}", y)
        x = np.concatenate([x, y], axis=1)
    for i in range(1, len(arch.dense) + 1):
        x = dense(f"{tower}.dense{i}", x)
    return x @ weights[f"{tower}.head.weight"].T + weights[f"{tower}.head.bias"]


def reference_gradient(spec: NetworkSpec, weights, sight, minibatch: Minibatch, objective: Objective):
    """The PPO loss and its gradient by name, by torch's autograd in float64."""
    import torch
    from torch.nn import functional

    p = {name: torch.from_numpy(array).double().requires_grad_() for name, array in weights.items()}
    arch = networks.architecture_of(spec)
    frames, lidar = parts_of(spec, sight)

    def dense(layer: str, x: torch.Tensor) -> torch.Tensor:
        return functional.linear(x, p[f"{layer}.weight"], p[f"{layer}.bias"]).relu()

    def camera(tower: str) -> torch.Tensor:
        seen = torch.from_numpy(frames[:, :, networks.sky_rows(spec) :]).double()
        x = functional.avg_pool2d(seen, arch.pool)
        x = torch.floor(x + 0.5) / 255
        for i, conv in enumerate(arch.convs, 1):
            x = functional.conv2d(x, p[f"{tower}.conv{i}.weight"], p[f"{tower}.conv{i}.bias"], conv.stride).relu()
        x = x.permute(0, 2, 3, 1).reshape(len(x), -1)
        if spec.lidar_size:
            y = torch.from_numpy(lidar).double() / 255
            for i in range(1, len(arch.lidar) + 1):
                y = dense(f"{tower}.lidar{i}", y)
            x = torch.cat([x, y], 1)
        for i in range(1, len(arch.dense) + 1):
            x = dense(f"{tower}.dense{i}", x)
        return functional.linear(x, p[f"{tower}.head.weight"], p[f"{tower}.head.bias"])

    outputs, actions = camera("policy"), torch.from_numpy(minibatch.actions)
    if spec.is_discrete:
        distribution = torch.distributions.Categorical(logits=outputs)
        log_probs, entropy = distribution.log_prob(actions), distribution.entropy().mean()
    else:
        normal = torch.distributions.Normal(outputs, p["policy.log_std"].exp().expand_as(outputs))
        log_probs, entropy = normal.log_prob(actions.double()).sum(1), normal.entropy().sum(1).mean()
    if spec.state_size:
        x = torch.from_numpy(minibatch.states).double()
        for i in range(1, len(networks.CRITIC_UNITS) + 1):
            x = functional.linear(x, p[f"critic.dense{i}.weight"], p[f"critic.dense{i}.bias"]).tanh()
        values = functional.linear(x, p["critic.head.weight"], p["critic.head.bias"])[:, 0]
    else:
        values = camera("critic")[:, 0]

    advantages, returns = (torch.from_numpy(a).double() for a in (minibatch.advantages, minibatch.returns))
    ratio = (log_probs - torch.from_numpy(minibatch.log_probs).double()).exp()
    clipped = ratio.clamp(1 - objective.clip_coef, 1 + objective.clip_coef)
    policy_loss = torch.maximum(-advantages * ratio, -advantages * clipped).mean()
    error = functional.smooth_l1_loss if objective.value_loss == "huber" else functional.mse_loss
    value_loss = error(values, returns) * (1 if objective.value_loss == "huber" else 0.5)
    loss = policy_loss + objective.vf_coef * value_loss - objective.ent_coef * entropy
    loss.backward()
    terms = (policy_loss.item(), value_loss.item(), entropy.item())
    return terms, {name: tensor.grad.numpy() for name, tensor in p.items()}
