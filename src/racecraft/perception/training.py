"""How the network learns: it is told what was there in pictures of many drives, none of them beside its neighbours.

worlds ──frames, truth──▶ a shuffled store ──minibatches──▶ loss's slopes ──▶ network ──answers──▶ `recalling`
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

import numpy as np

from racecraft.perception.lessons import Lessons
from racecraft.perception.losses import slopes_of
from racecraft.perception.mirror import mirrored_answers, mirrored_observations
from racecraft.perception.network import Perceiver
from racecraft.perception.recalling import drives_of, taught
from racecraft.perception.store import Store
from racecraft.perception.worlds import worlds

USUAL: Final = Lessons()


def train(lessons: Lessons = USUAL, *, tell: Callable[[int, float], None] = lambda *_: None) -> Perceiver:
    """A perceiver that has had its lessons; the same bits for the same lessons.

    Args:
        lessons: How much, and how.
        tell: Called with the number of updates, of the network and then of its memory, and the loss, now and then.
    """
    perceiver = Perceiver(None, seed=lessons.seed, num_threads=1)
    _teach_network(perceiver, lessons, tell)
    perceiver.settle()  # memory learns of the answers that it will be told
    drives = drives_of(perceiver, lessons)
    perceiver.memory = taught(drives, lessons, tell=lambda update, loss: tell(lessons.updates + update, loss))
    return perceiver


def _teach_network(perceiver: Perceiver, lessons: Lessons, tell: Callable[[int, float], None]) -> None:
    network = perceiver.network
    store = Store(lessons.store, network.observation_shape)
    rng = np.random.default_rng([lessons.seed, 0x6C657373])
    places = worlds(lessons.seed, num_roads=lessons.roads)
    losses: list[float] = []
    said = time.monotonic()
    for update in range(lessons.updates):
        due = lessons.store // 2 + round(update * lessons.fresh * lessons.minibatch_size)
        while store.seen < due:
            for place in places:
                frames, truth = place.look()
                store.put(perceiver.observe(frames), truth, rng=rng)
        seen, wanted = store.draw(lessons.minibatch_size, rng=rng)
        turned = lessons.minibatch_size // 2  # so many are looked at in a mirror
        seen[:turned] = mirrored_observations(seen[:turned])
        wanted[:turned] = mirrored_answers(wanted[:turned])
        slopes, loss = slopes_of(network.policy(seen), wanted)
        share = update / lessons.updates
        rate = lessons.learning_rate * min(1.0, (update + 1) / 300) * (0.5 + 0.5 * np.cos(np.pi * share))
        network.descend(seen, slopes, learning_rate=float(rate), max_grad_norm=5.0)
        losses.append(loss)
        if time.monotonic() - said > 5.0 or update == lessons.updates - 1:
            tell(update + 1, float(np.mean(losses)))
            losses.clear()
            said = time.monotonic()
