"""What a gradient step costs on each instruction set of this machine, measured in turns, and that all end in one state.

    python benchmarks/learner_instruction_sets.py [--network RACECRAFT_SMALL] [--rounds 5]

CPU time of one thread, the least of all rounds; each round takes every instruction set once, so that what else the
machine does meets all of them. The last line is JSON. A whole training on one of them: RACECRAFT_ISA=portable racecraft
train.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import time

import numpy as np
from learner_layers import OBJECTIVE

from racecraft import _native
from racecraft.learn import Minibatch, NetworkSpec, network_names
from racecraft.learn.native_learner import NativeLearner
from racecraft.sim import STATE_COLUMNS


def steps(network: str, isa: str, *, count: int = 4, minibatch_size: int = 256) -> tuple[float, str]:
    """CPU seconds of so many gradient steps, and the hash of the weights they end in."""
    _native.set_isa(isa)
    spec = NetworkSpec(name=network, num_actions=10, state_size=len(STATE_COLUMNS))
    learner = NativeLearner(spec, num_threads=1)
    rng = np.random.default_rng(0)
    frames = rng.integers(0, 256, (minibatch_size, *spec.frame_shape), dtype=np.uint8)
    minibatch = Minibatch(
        observations=learner.encode(frames),
        states=rng.standard_normal((minibatch_size, spec.state_size)).astype(np.float32),
        actions=rng.integers(0, spec.num_actions, minibatch_size),
        log_probs=np.full(minibatch_size, -np.log(spec.num_actions), np.float32),
        advantages=rng.standard_normal(minibatch_size).astype(np.float32),
        returns=rng.standard_normal(minibatch_size).astype(np.float32),
    )
    begun = time.process_time()
    for _ in range(count):
        learner.update(minibatch, OBJECTIVE)
    spent = time.process_time() - begun
    weights = b"".join(np.ascontiguousarray(values).tobytes() for _, values in sorted(learner.weights().items()))
    return spent / count, hashlib.sha256(weights).hexdigest()


def main() -> None:
    """Print a table for people and one line of JSON for programs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--network", default=network_names()[0], choices=network_names())
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    isas = _native.available_isas()
    rounds = [{isa: steps(options.network, isa) for isa in isas} for _ in range(options.rounds)]
    seconds = {isa: min(found[isa][0] for found in rounds) for isa in isas}
    ends = {found[isa][1] for found in rounds for isa in isas}
    for isa in isas:
        print(f"{isa:10}{1e3 * seconds[isa]:9.1f} ms{seconds[isa] / seconds[isas[-1]]:9.1f} times the best")
    print("the same bits" if len(ends) == 1 else "DIFFERENT BITS")
    print(json.dumps({"network": options.network, "seconds_per_step": seconds, "same_bits": len(ends) == 1}))


if __name__ == "__main__":
    main()
