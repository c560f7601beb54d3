"""Reward functions written down in a line, and workers that run them."""

from __future__ import annotations

import contextlib

from racecraft.reward.worker import RewardWorker

INDENT = "    "


def function(*body: str, top: str = "") -> str:
    """The source of a reward function with this body; the body starts in line 2, after the top's lines."""
    return top + "def reward_function(params):\n" + "".join(f"{INDENT}{line}\n" for line in body)


@contextlib.contextmanager
def running(source, track, **options):
    options = {"timeout_s": 1.0} | options
    with RewardWorker(source, track, **options) as worker:
        yield worker
