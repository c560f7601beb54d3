"""What perception tells of a picture, as nodes of a graph: for a policy that sees nothing else.

    camera ─ sky cut off, pooled ─ one brightness ─┬─ convolutions, dense ────────┬─ joined ─ all outputs ─ bytes / 255
                                                   └─ the same of a mirror image ─┘

The mirror image is seen by turning the convolutions over instead of the picture. The mean of both, the signs of what is
told the other way round there, and the scales of what is told are all in the weights of the layer behind them. Sums
over a picture are products with ones, so nodes are of the kinds that every policy has, and a few that take no settings.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.car.graph_writer import GraphWriter
from racecraft.car.onnx_writer import OnnxWriter
from racecraft.learn.learner import NetworkSpec
from racecraft.learn.networks import TOLD_SIDE, architecture_of, pooled_shape, sky_rows
from racecraft.perception.answers import IN_SIGHT, MIDDLES, NUM_OUTPUTS
from racecraft.perception.learner import NOTHING, REACH, TOLD_AS_NOTHING, TOLD_UNITS
from racecraft.perception.mirror import mirrored_answers
from racecraft.perception.network import LEAST_SPREAD, MEAN, SPREAD

Floats = NDArray[np.float32]
PLACES: Final = TOLD_SIDE**2
"""Numbers told; those behind perception's outputs are 0."""


def tell(
    writer: GraphWriter | OnnxWriter, below: str, image: str, *, spec: NetworkSpec, weights: Mapping[str, Floats]
) -> str:
    """What `racecraft.perception.learner.BeliefLearner.encode` makes of pictures, over 255  (N, 10, 10, 1).

    Args:
        writer: Of the graph.
        below: What the names of nodes begin with.
        image: Pictures of 0 to 255  (N, 120, 160, 1).
        spec: Perception's network.
        weights: Its weights.
    """
    return _Telling(writer, below, spec, weights).tell(image)


class _Telling:
    """The nodes while they are written."""

    def __init__(
        self, writer: GraphWriter | OnnxWriter, below: str, spec: NetworkSpec, weights: Mapping[str, Floats]
    ) -> None:
        self.writer, self.below, self.spec, self.weights = writer, below, spec, weights

    def tell(self, image: str) -> str:
        writer, name = self.writer, self.below
        levels = self._of_one_brightness(image)
        seen = writer.join(f"{name}/seen", self._looked(levels, "straight"), self._looked(levels, "turned"))
        numbers = self._dense("outputs", seen, *self._outputs())
        in_sight = self._dense("in_sight", numbers, *_gate())
        numbers = self._apply(
            "known", "Mul", numbers, self._apply("gate", "Relu", self._apply("side", "Sign", in_sight))
        )
        squared = self._apply("squared", "Mul", numbers, numbers)
        length = self._apply("length", "Sqrt", self._with("longer", "Add", squared, 1.0))
        bent = self._apply("bent", "RealDiv", numbers, length)
        whole = self._apply(
            "whole", "Floor", self._with("level", "Add", self._with("wide", "Mul", bent, REACH), NOTHING + 0.5)
        )
        shares = np.zeros((1, PLACES), np.float32)
        shares[:, :NUM_OUTPUTS] = 1.0 / 255.0
        told = self._apply("told", "Mul", whole, writer.constant(f"{name}/shares", shares))
        return writer.reshape(f"{name}/told/square", told, [-1, TOLD_SIDE, TOLD_SIDE, 1])

    def _of_one_brightness(self, image: str) -> str:
        """Pooled pixels of 0 to 1, as `perception.network.of_one_brightness` has them  (N, rows, columns, 1)."""
        writer, (rows, columns) = self.writer, pooled_shape(self.spec)
        x = writer.below(f"{self.below}/below_sky", image, row=sky_rows(self.spec))
        x = writer.pool(f"{self.below}/pool", x, side=architecture_of(self.spec).pool)
        x = self._apply("pixels", "Floor", self._with("half", "Add", x, 0.5))
        flat = writer.reshape(f"{self.below}/flat", x, [-1, rows * columns])
        centred = self._apply("centred", "Sub", flat, self._mean("mean", flat))
        variance = self._mean("variance", self._apply("squares", "Mul", centred, centred))
        spread = self._with("enough", "Maximum", self._apply("spread", "Sqrt", variance), LEAST_SPREAD)
        shares = self._with("stretched", "Mul", self._apply("share", "RealDiv", centred, spread), SPREAD)
        whole = self._apply("rounded", "Floor", self._with("brighter", "Add", shares, MEAN + 0.5))
        within = self._with("most", "Minimum", self._with("least", "Maximum", whole, 0.0), 255.0)
        return writer.reshape(
            f"{self.below}/levels", self._with("unit", "RealDiv", within, 255.0), [-1, rows, columns, 1]
        )

    def _looked(self, levels: str, side: str) -> str:
        """What the layers before the last make of levels, or of their mirror image  (N, units)."""
        writer, x, (height, width) = self.writer, levels, pooled_shape(self.spec)
        arch, is_turned = architecture_of(self.spec), side == "turned"
        for index, conv in enumerate(arch.convs, 1):
            kernel = self.weights[f"policy.conv{index}.weight"].transpose(2, 3, 1, 0)
            name = f"{self.below}/{side}/conv{index}"
            kernel = np.ascontiguousarray(kernel[:, ::-1] if is_turned else kernel)
            kernels = writer.variable(f"{name}/kernel", kernel)
            x = writer.convolution(f"{name}/Conv2D", x, kernels, stride=conv.stride)
            x = self._biased(f"{side}/conv{index}", x, self.weights[f"policy.conv{index}.bias"])
            x = writer.apply(f"{name}/Relu", "Relu", x)
            height, width = (height - conv.kernel) // conv.stride + 1, (width - conv.kernel) // conv.stride + 1
        size = height * width * arch.convs[-1].filters
        x = writer.reshape(f"{self.below}/{side}/flat", x, [-1, size])
        kernel = self.weights["policy.dense1.weight"].reshape(-1, height, width, arch.convs[-1].filters)
        kernel = (kernel[:, :, ::-1] if is_turned else kernel).reshape(len(kernel), size).T
        x = self._dense(f"{side}/dense1", x, np.ascontiguousarray(kernel), self.weights["policy.dense1.bias"])
        return writer.apply(f"{self.below}/{side}/dense1/Relu", "Relu", x)

    def _outputs(self) -> tuple[Floats, Floats]:
        """Kernel (2 units, places) and bias (places,) of what is told before it is bent: the mean of both sides."""
        kernel, bias = self.weights["policy.head.weight"].T, self.weights["policy.head.bias"]
        both = np.concatenate([kernel, mirrored_answers(kernel)]) * np.float32(0.5)
        middle = np.float32(0.5) * (bias + mirrored_answers(bias[None])[0])
        behind = PLACES - NUM_OUTPUTS
        told = (middle - TOLD_AS_NOTHING) / TOLD_UNITS
        return np.pad(both / TOLD_UNITS, ((0, 0), (0, behind))), np.pad(told, (0, behind))

    def _mean(self, name: str, values: str) -> str:
        """Of each row  (N, 1)."""
        rows, columns = pooled_shape(self.spec)
        ones = self.writer.constant(f"{self.below}/{name}/ones", np.ones((rows * columns, 1), np.float32))
        total = self.writer.product(f"{self.below}/{name}/sum", values, ones)
        return self._with(name, "RealDiv", total, float(rows * columns))

    def _dense(self, name: str, values: str, kernel: Floats, bias: Floats) -> str:
        variable = self.writer.variable(f"{self.below}/{name}/kernel", kernel)
        return self._biased(name, self.writer.product(f"{self.below}/{name}/MatMul", values, variable), bias)

    def _biased(self, name: str, values: str, bias: Floats) -> str:
        place = f"{self.below}/{name}"
        return self.writer.bias(f"{place}/BiasAdd", values, self.writer.variable(f"{place}/bias", bias))

    def _apply(self, name: str, operation: str, *inputs: str) -> str:
        return self.writer.apply(f"{self.below}/{name}", operation, *inputs)

    def _with(self, name: str, operation: str, values: str, number: float) -> str:
        """An operation with one number."""
        return self._apply(name, operation, values, self.writer.constant(f"{self.below}/{name}/y", np.float32(number)))


def _gate() -> tuple[Floats, Floats]:
    """Kernel and bias of what is above 0 where a number is told: of a column, that it is in sight; of all else, 1."""
    kernel, bias = np.zeros((PLACES, PLACES), np.float32), np.ones(PLACES, np.float32)
    for column, sight in zip(range(*MIDDLES.indices(NUM_OUTPUTS)), range(*IN_SIGHT.indices(NUM_OUTPUTS)), strict=True):
        kernel[sight, column], bias[column] = 1.0, 0.0
    return kernel, bias
