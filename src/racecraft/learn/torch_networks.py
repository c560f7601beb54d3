"""The towers of ``racecraft.learn.networks`` in torch: functions of a dictionary of parameters, no modules.

A convolution and its ReLU are one autograd function, for speed on a CPU: everything stays in channels-last
layout in both directions, where torch on its own falls back to slow element-wise loops over mixed layouts.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from racecraft.learn.learner import NetworkSpec
from racecraft.learn.networks import CRITIC_UNITS, architecture_of, block_size, image_shape

Parameters = dict[str, Tensor]


class _ConvRelu(torch.autograd.Function):
    """``relu(conv2d(x, weight, bias, stride))`` in x's precision, for float32 parameters."""

    @staticmethod
    def forward(ctx: Any, x: Tensor, weight: Tensor, bias: Tensor, stride: int) -> Tensor:
        weight = weight.to(x.dtype, memory_format=torch.channels_last)
        y = torch.conv2d(x, weight, bias.to(x.dtype), stride).relu_()
        ctx.save_for_backward(x, weight, y)
        ctx.stride = stride
        return y

    @staticmethod
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor | None, Tensor, Tensor, None]:
        x, weight, y = ctx.saved_tensors
        grad = torch.ops.aten.threshold_backward(grad.contiguous(memory_format=torch.channels_last), y, 0)
        wanted = [ctx.needs_input_grad[0], True, True]
        grad_x, grad_weight, grad_bias = torch.ops.aten.convolution_backward(
            grad, x, weight, [len(weight)], [ctx.stride] * 2, [0, 0], [1, 1], False, [0, 0], 1, wanted
        )
        return grad_x, grad_weight.float(), grad_bias.float(), None


def sensor_tower(
    parameters: Parameters, observations: Tensor, *, spec: NetworkSpec, tower: str, dtype: torch.dtype
) -> Tensor:
    """The head's outputs (B, outputs), float32, for encoded frames (B, *observation_shape) of uint8."""
    x = sensor_features(parameters, observations, spec=spec, tower=tower, dtype=dtype)
    return _linear(parameters, x.float(), f"{tower}.head")


def sensor_features(
    parameters: Parameters, observations: Tensor, *, spec: NetworkSpec, tower: str, dtype: torch.dtype
) -> Tensor:
    """What the head of a tower sees  (B, units of the last dense layer)."""
    arch, block = architecture_of(spec), block_size(spec)
    rows, columns, channels = image_shape(spec)
    size = rows * columns * channels
    flat = observations.flatten(1)
    images = flat[:, :size].reshape(len(flat), rows, columns, channels)
    x = images.permute(0, 3, 1, 2).to(dtype).mul_(1.0 / 255.0)  # a view of (B, H, W, C): channels last
    for i, conv in enumerate(arch.convs, 1):
        weight, stride = parameters[f"{tower}.conv{i}.weight"], conv.stride
        if i == 1 and block > 1:
            weight, stride = _fold(weight, block), 1
        x = _ConvRelu.apply(x, weight, parameters[f"{tower}.conv{i}.bias"], stride)
    x = _beside_lidar(parameters, x.permute(0, 2, 3, 1).flatten(1), flat[:, size:], arch.lidar, tower=tower)
    for i in range(1, len(arch.dense) + 1):
        x = _linear(parameters, x, f"{tower}.dense{i}").relu_()
    return x


def _beside_lidar(parameters: Parameters, x: Tensor, lidar: Tensor, units: tuple[int, ...], *, tower: str) -> Tensor:
    """What the camera gave, and behind it what the LIDAR's layers give, where there is one."""
    if not lidar.shape[1]:
        return x
    y = lidar.to(x.dtype).mul_(1.0 / 255.0)
    for i in range(1, len(units) + 1):
        y = _linear(parameters, y, f"{tower}.lidar{i}").relu_()
    return torch.cat([x, y], dim=1)


def policy(parameters: Parameters, observations: Tensor, *, spec: NetworkSpec, dtype: torch.dtype) -> Tensor:
    """Logits, or means followed by log standard deviations  (B, P)."""
    outputs = sensor_tower(parameters, observations, spec=spec, tower="policy", dtype=dtype)
    if spec.is_discrete:
        return outputs
    return torch.cat([outputs, parameters["policy.log_std"].expand_as(outputs)], dim=1)


def critic(
    parameters: Parameters, observations: Tensor, states: Tensor, *, spec: NetworkSpec, dtype: torch.dtype
) -> Tensor:
    """Values  (B,), from the privileged state where the network has it, else from the sensors."""
    if not spec.state_size:
        return sensor_tower(parameters, observations, spec=spec, tower="critic", dtype=dtype)[:, 0]
    x = states
    for i in range(1, len(CRITIC_UNITS) + 1):
        x = _linear(parameters, x, f"critic.dense{i}").tanh()
    return _linear(parameters, x, "critic.head")[:, 0]


def _fold(weight: Tensor, block: int) -> Tensor:
    """A kernel over the blocks that ``networks.encode`` makes: (F, L, K, K) -> (F, L b², K/b, K/b)."""
    filters, lenses, kernel, _ = weight.shape
    steps = kernel // block
    folded = weight.view(filters, lenses, steps, block, steps, block).permute(0, 1, 3, 5, 2, 4)
    return folded.reshape(filters, -1, steps, steps)


def _linear(parameters: Parameters, x: Tensor, layer: str) -> Tensor:
    weight, bias = parameters[f"{layer}.weight"], parameters[f"{layer}.bias"]
    return torch.nn.functional.linear(x, weight.to(x.dtype), bias.to(x.dtype))
