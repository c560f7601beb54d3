"""Requests for new models that together say something in every field."""

from __future__ import annotations

from typing import Any

from racecraft.serve.models.schemas import NewModel

REWARD = "def reward_function(params):\n    return params['speed'] - 0.5\n"
STEERED = [{"steering_angle": angle, "speed": 1.5, "index": i} for i, angle in enumerate((-20.0, 0.0, 20.0))]
CAMERA = {"sensor": ["FRONT_FACING_CAMERA"], "neural_network": "RACECRAFT_SMALL", "version": "5"}

REQUESTS: list[dict[str, Any]] = [
    {
        **{"track": "oval", "more_tracks": ["hairpin", "generated:3"], "direction": "alternate", "reward": REWARD},
        **{"vehicle": {"mass": 2.5, "speed_gain": 0.9}, "randomize": {"friction": [0.7, 1.1], "blur": [0.0, 1.5]}},
        **{"model_metadata": {"action_space": STEERED, **CAMERA}, "tuning": {"lr": 0.002, "num_epochs": 7}},
        **{"critic": "camera", "seed": 5, "until": "2000 steps", "algorithm": "ppo"},
    },
    {
        **{"track": "oval", "race": "object-avoidance", "parked_cars": True, "objects": 2, "placement": "fixed"},
        **{"positions": [[0.25, 1], [0.7, -1]], "sensors": ["FRONT_FACING_CAMERA", "LIDAR"], "actions": "steady"},
        **{"until": "3000 steps"},
    },
    {
        **{"track": "oval", "race": "head-to-bot", "bot_speed": 0.6, "lane_changes": True, "placement": "even"},
        **{"objects": 4, "vehicle": "v4", "randomize": "light", "network": "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW"},
        **{"hyperparameters": {"lr": 0.0005, "batch_size": 128, "num_episodes_between_training": 10}},
    },
    {"track": "oval", "race": "head-to-head", "cars": 3, "opponents": ["driven"], "actions": "continuous"},
]
"""The last one races against a model ``driven``."""
BESIDE = {"name", "tags", "train"}
"""Fields that say nothing of how a model learns."""

assert {field for request in REQUESTS for field in request} | BESIDE == set(NewModel.model_fields)
