"""A teacher's two towers and the gradient of their loss, written down in NumPy in double: slow and obvious."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecraft.learn import Minibatch, NetworkSpec, Objective, networks
from racecraft.learn.distributions import LOG_STD_MAX, LOG_STD_MIN

Weights = dict[str, NDArray[np.float64]]
LAYERS = (*(f"dense{i}" for i in range(1, len(networks.TEACHER_UNITS) + 1)), "head")


def forward(weights: Weights, tower: str, states: NDArray[Any]) -> list[NDArray[np.float64]]:
    """The states and the outputs of every layer, the head's last."""
    outputs = [states.astype(float)]
    for layer in LAYERS:
        x = outputs[-1] @ weights[f"{tower}.{layer}.weight"].T + weights[f"{tower}.{layer}.bias"]
        outputs.append(x if layer == "head" else np.tanh(x))
    return outputs


def backward(weights: Weights, tower: str, outputs: list[NDArray[np.float64]], slope: NDArray[Any]) -> Weights:
    """The gradient of a tower's parameters from that of its outputs (B, outputs)."""
    gradient = {}
    for i in range(len(LAYERS) - 1, -1, -1):
        gradient[f"{tower}.{LAYERS[i]}.weight"] = slope.T @ outputs[i]
        gradient[f"{tower}.{LAYERS[i]}.bias"] = slope.sum(0)
        slope = (slope @ weights[f"{tower}.{LAYERS[i]}.weight"]) * (1 - outputs[i] ** 2)
    return gradient


def loss_and_gradient(
    spec: NetworkSpec, weights: Weights, minibatch: Minibatch, objective: Objective
) -> tuple[dict[str, float], Weights]:
    """Terms of the clipped PPO loss, ``total`` among them, and its gradient by name."""
    rows = np.arange(len(minibatch.advantages)) if minibatch.rows is None else minibatch.rows
    states, actions = minibatch.observations[rows], minibatch.actions[rows]
    advantages, returns = minibatch.advantages[rows].astype(float), minibatch.returns[rows].astype(float)
    policy, critic = (forward(weights, tower, states) for tower in ("policy", "critic"))
    log_probs, entropy, by_log_prob, by_entropy = _distribution(spec, weights, policy[-1], actions)
    log_ratio = log_probs - minibatch.log_probs[rows]
    ratio = np.exp(log_ratio)
    free = -advantages * ratio
    clipped = -advantages * ratio.clip(1 - objective.clip_coef, 1 + objective.clip_coef)
    slope = np.where(free < clipped, 0.0, free) / len(rows)  # d ratio / d log_prob = ratio
    by_outputs = slope[:, None] * by_log_prob - objective.ent_coef / len(rows) * by_entropy
    error = critic[-1][:, 0] - returns
    is_linear = (np.abs(error) > 1) & (objective.value_loss == "huber")
    value_loss = np.where(is_linear, np.abs(error) - 0.5, 0.5 * error**2)
    by_value = objective.vf_coef / len(rows) * np.where(is_linear, np.sign(error), error)
    gradient = backward(weights, "policy", policy, by_outputs[:, : spec.num_actions])
    gradient |= backward(weights, "critic", critic, by_value[:, None])
    if not spec.is_discrete:
        gradient["policy.log_std"] = by_outputs[:, spec.num_actions :].sum(0)
    terms = {
        "policy_loss": float(np.maximum(free, clipped).mean()),
        "value_loss": float(value_loss.mean()),
        "entropy": float(entropy.mean()),
        "approx_kl": float(((ratio - 1) - log_ratio).mean()),
        "clip_fraction": float((np.abs(ratio - 1) > objective.clip_coef).mean()),
        "grad_norm": float(np.sqrt(sum(float(np.square(slope).sum()) for slope in gradient.values()))),
    }
    terms["total"] = (
        terms["policy_loss"] + objective.vf_coef * terms["value_loss"] - objective.ent_coef * terms["entropy"]
    )
    return terms, gradient


def _distribution(
    spec: NetworkSpec, weights: Weights, outputs: NDArray[np.float64], actions: NDArray[Any]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Log-probabilities and entropies (B,), and their slopes by logits, or by means and log deviations (B, P)."""
    if spec.is_discrete:
        logs = outputs - outputs.max(1, keepdims=True)
        logs = logs - np.log(np.exp(logs).sum(1, keepdims=True))
        probs = np.exp(logs)
        entropy = -(probs * logs).sum(1)
        chosen = np.eye(spec.num_actions)[actions]
        return (chosen * logs).sum(1), entropy, chosen - probs, -probs * (logs + entropy[:, None])
    raw = np.broadcast_to(weights["policy.log_std"], outputs.shape)
    log_std = raw.clip(LOG_STD_MIN, LOG_STD_MAX)
    z = (actions - outputs) * np.exp(-log_std)
    log_probs = (-0.5 * z**2 - log_std - 0.9189385332046727).sum(1)
    is_free = (raw == log_std).astype(float)
    by_log_prob = np.concatenate([z * np.exp(-log_std), (z**2 - 1) * is_free], axis=1)
    by_entropy = np.concatenate([np.zeros_like(z), is_free], axis=1)
    return log_probs, (log_std + 1.4189385332046727).sum(1), by_log_prob, by_entropy
