"""The torch learner by its name, and torch itself not before one is made: to load it takes seconds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from racecraft.learn import torch_learner


def TorchLearner(*arguments: Any, **settings: Any) -> torch_learner.TorchLearner:
    from racecraft.learn import torch_learner

    return torch_learner.TorchLearner(*arguments, **settings)
