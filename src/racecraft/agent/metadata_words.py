"""The words that AWS's ``model_metadata.json`` chooses from."""

from __future__ import annotations

from typing import Final, Literal, get_args

NeuralNetwork = Literal[
    "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW",
    "DEEP_CONVOLUTIONAL_NETWORK",
    "DEEP_CONVOLUTIONAL_NETWORK_DEEP",
    "RACECRAFT_SMALL",  # ours, much faster to train
    "PERCEPTION",  # ours, which sees what perception tells
]
NEURAL_NETWORKS: Final[tuple[NeuralNetwork, ...]] = get_args(NeuralNetwork)
VERSIONS: Final = ("1", "2", "3", "4", "5", "6")
CONFIGURED: Final = "DISCRETIZED_SECTOR_LIDAR"
"""The one sensor that ``lidar_config`` is for."""


def plain(value: object) -> object:
    """A word in small letters, without spaces around it, as AWS's code reads it; anything else as it is."""
    return value.strip().lower() if isinstance(value, str) else value
