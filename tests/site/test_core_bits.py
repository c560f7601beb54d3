"""The core in WebAssembly against the native one: cars on several tracks, and a training, to the bit.

Needs Node, the pages' packages, and the compiler that `make site` installs. A clean build takes minutes of processor
time, so nothing is built where that was not run.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from numpy.typing import NDArray

from racecraft import _native
from racecraft.agent import action_space
from racecraft.learn import PPO, NetworkSpec, PPOConfig
from racecraft.learn.flat_weights import join_weights
from racecraft.learn.learner import Weights, below
from racecraft.learn.native_learner import NativeLearner
from racecraft.learn.networks import ARCHITECTURES, Architecture, Conv
from racecraft.sim import CameraSpec, Simulation, Start
from racecraft.sim.camera import CAMERAS
from racecraft.sim.columns import ROW_COLUMNS, STATE_COLUMNS
from racecraft.sim.simulation import DIRECTIONS, START_MODES, track_arrays
from racecraft.sim.vehicle import load_vehicle
from racecraft.site.plan import packed, told_cars, told_layers, told_network, told_ppo, told_track
from racecraft.track import Track, load_track

pytestmark = pytest.mark.slow
Pay = Callable[[NDArray[np.float64]], NDArray[np.float64]]
ROOT = Path(__file__).parents[2]
BUILDS = ("core", "exact", "scalar", "threads")
TRACKS = (
    *("straight", "oval", "speedway", "reinvent_2018", "kidney", "delta", "bowtie"),
    *("boomerang", "trefoil", "serpent", "bottleneck", "hairpin", "harbor"),
)
CARS, STEPS, SEED = 3, 50, 5
DISTANCE, WIDTH = ROW_COLUMNS.index("offset"), ROW_COLUMNS.index("track_width")
PLAIN = PPOConfig(num_envs=16, num_steps=6, minibatch_size=32, update_epochs=1)
AWS = PPOConfig(
    num_envs=6,
    episodes_per_iteration=4,
    max_steps_per_iteration=90,
    minibatch_size=40,
    update_epochs=1,
    value_loss="huber",
    exploration="e-greedy",
    epsilon_steps=60,
    rate_steps=50,
    is_eps_hat=True,
    normalize_returns=False,
)
SMALL, NARROW = "RACECRAFT_SMALL", "NARROW"
TRAININGS = {
    "plain": (PLAIN, "default", SMALL),
    "aws": (AWS, "default", SMALL),
    "continuous": (PLAIN, "continuous", SMALL),
    "narrow": (PLAIN, "default", NARROW),
}
OVERLAPPING = Architecture((Conv(16, 8, 4), Conv(16, 2, 1), Conv(20, 4, 2)), (128,), pool=2, sky=0.2)
"""Of NARROW: neighbours in a row share inputs of one panel, which no network of ours has."""


def digest(*arrays: NDArray[Any]) -> str:
    return hashlib.sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)).hexdigest()


def settings_of(camera: CameraSpec | None, start: Start, num_envs: int, direction: str) -> dict[str, float]:
    return told_cars(camera, start, num_envs, seed=SEED, direction=direction, max_steps=40)


def simulation_of(track: Track, camera: CameraSpec | None, start: Start, num_envs: int, direction: str) -> Simulation:
    options: dict[str, Any] = {"camera": camera, "start": start, "direction": direction}
    return Simulation(track, num_envs=num_envs, seed=SEED, max_steps=40, num_threads=1, **options)


def driven() -> list[tuple[dict[str, Any], dict[str, str]]]:
    """A drive on every track, each with another start, and what the native core makes of it."""
    cases = []
    rng = np.random.default_rng(SEED)
    for i, name in enumerate(TRACKS):
        jitter = {"lateral_jitter": 0.1, "heading_jitter": 0.2}
        start = Start(mode=START_MODES[i % 3], offset=0.07 * i, spread=i % 2 == 0, **jitter)
        camera = [CameraSpec(), CameraSpec(width=80, height=60), CAMERAS["2026"], None][i % 4]
        shape = (camera, start, CARS, DIRECTIONS[i % 3])
        track = load_track(name)
        actions = rng.uniform((-0.6, 0.0), (0.6, 4.0), (STEPS, CARS, 2)).astype(np.float32)
        simulation = simulation_of(track, *shape)
        seen: dict[str, list[NDArray[Any]]] = {"frames": [], "rows": [], "state": [], "vehicles": []}
        for action in actions:
            simulation.step(action)
            for key, arrays in seen.items():
                arrays.append(getattr(simulation, key).copy())
            simulation.reset(simulation.terminated | simulation.truncated)
        case = {
            "what": "drive",
            "track": told_track(track_arrays(track)),
            "settings": settings_of(*shape),
            "vehicle": asdict(load_vehicle("v5")),
            "actions": packed(actions),
        }
        cases.append((case, {key: digest(*arrays) for key, arrays in seen.items()}))
    return cases


def near_the_middle(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """As bits.mjs pays."""
    return np.asarray(1.0 - np.abs(rows[:, DISTANCE]) / rows[:, WIDTH])


class Road:
    """Cars that are paid for what their rows say."""

    def __init__(self, simulation: Simulation, space: Any, pay: Pay) -> None:
        self.simulation, self.space, self.num_envs, self.pay = simulation, space, simulation.num_envs, pay

    def observe(self) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        return self.simulation.frames, self.simulation.state

    def step(self, actions: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.bool_], NDArray[np.bool_]]:
        simulation = self.simulation
        simulation.step(self.space.to_commands(actions))
        return self.pay(simulation.rows), simulation.terminated.copy(), simulation.truncated.copy()

    def reset(self, mask: NDArray[np.bool_]) -> None:
        self.simulation.reset(mask)


def trained(name: str, pay: Pay = near_the_middle) -> tuple[dict[str, Any], dict[str, Any]]:
    """Two iterations of a training, and what the native core learned."""
    config, actions, network = TRAININGS[name]
    space = action_space(actions)
    is_discrete = space.kind == "discrete"
    spec = NetworkSpec(num_actions=space.size, state_size=len(STATE_COLUMNS), is_discrete=is_discrete, name=network)
    shape = (CameraSpec(), Start(spread=True), config.num_envs, "forward")
    track = load_track("reinvent_2018")
    learner = NativeLearner(spec, seed=SEED, num_threads=1)
    initial = learner.weights()
    road = Road(simulation_of(track, *shape), space, pay)
    ppo = PPO(config, learner, road, seed=SEED)
    ended = [[e.total, e.length] for _ in range(2) for e in ppo.iterate().ended]
    outputs = learner.policy(learner.encode(road.simulation.frames))
    best = outputs.argmax(axis=1) if is_discrete else outputs[:, : space.size]
    table = space.to_commands(np.arange(space.size)) if is_discrete else np.stack([space.low, space.high])
    matrices = [w for name, w in initial.items() if name.endswith(".weight")]
    case = {
        "what": "train",
        "track": told_track(track_arrays(track)),
        "settings": settings_of(*shape),
        "vehicle": asdict(load_vehicle("v5")),
        "network": told_network(spec),
        "layers": told_layers(spec),
        "ppo": told_ppo(config),
        "table": packed(table.astype(np.float64)),
        "seed": SEED,
        "weights": packed(join_weights(initial, spec)),
        "iterations": 2,
        "pay": {"distance": "offset", "width": "track_width"},
    }
    optimizer = learner.optimizer_state()

    def flat(weights: Weights) -> str:
        return digest(join_weights(weights, spec))

    return case, {
        "weights": flat(learner.weights()),
        "moment1": flat(below("moment1/", optimizer)),
        "moment2": flat(below("moment2/", optimizer)),
        "initial": digest(*(w for w in matrices)),
        "best": digest(space.to_commands(best)),
        "steps": ppo.total_steps,
        "ended": ended,
    }


def broken_lines() -> dict[str, Any]:
    """What the core is told of a track whose centre line has a point that is none."""
    arrays = track_arrays(load_track("oval"))
    return {
        **arrays,
        "centerline": np.where(np.arange(len(arrays["centerline"]))[:, None] == 3, np.nan, arrays["centerline"]),
    }


@pytest.fixture(scope="module")
def expected() -> list[tuple[dict[str, Any], Any]]:
    with patch.dict(ARCHITECTURES, {NARROW: OVERLAPPING}):
        return [*driven(), *(trained(name) for name in TRAININGS)]


@pytest.fixture(scope="module", params=BUILDS)
def found(request: pytest.FixtureRequest, expected: Any, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What Node makes of the cases with one build."""
    cases = [*(case for case, _ in expected), {"what": "refuse", "track": told_track(broken_lines())}]
    return {"build": request.param, **in_node(request.param, cases, tmp_path_factory.mktemp("bits"))}


def in_node(build: str, cases: list[dict[str, Any]], folder: Path) -> dict[str, Any]:
    """What Node makes of cases with a build."""
    node, code = shutil.which("node"), ROOT / "build/wasm" / f"{build}.wasm"
    if node is None or not (ROOT / "web/node_modules/vite").is_dir():
        pytest.skip("Node or the pages' packages are not installed")
    if not (ROOT / "build/zig/ziglang/zig").exists():
        pytest.skip("Zig's compiler is not installed: make site")
    subprocess.run(["make", "-s", str(code.relative_to(ROOT))], cwd=ROOT, check=True, capture_output=True)
    file = folder / "cases.json"
    file.write_text(json.dumps(cases))
    options = ["--experimental-wasm-relaxed-simd"] if needs_flag(node) else []
    command = [node, *options, str(Path(__file__).with_name("bits.mjs")), str(ROOT / "web"), str(code), str(file)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr[-4000:]
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def needs_flag(node: str) -> bool:
    """Node 20 has relaxed SIMD behind a flag, later ones have no such flag."""
    version = subprocess.run([node, "--version"], capture_output=True, text=True, check=True).stdout
    return int(version.lstrip("v").split(".")[0]) < 21


def test_cars_on_every_track_are_the_native_ones(found, expected):
    for name, theirs, (_, ours) in zip(TRACKS, found["results"], expected, strict=False):
        assert theirs == ours, name


def test_a_training_learns_the_native_weights(found, expected):
    if not found["isFused"]:
        pytest.skip("this machine has no fused multiply-add, and the page takes the exact build")
    results = found["results"][len(TRACKS) :]
    for name, theirs, (_, ours) in zip(TRAININGS, results, expected[len(TRACKS) :], strict=False):
        assert theirs == ours, name


def test_sums_are_fused_wherever_a_machine_or_our_own_arithmetic_can(found):
    assert found["isFused"] or (found["build"] in ("core", "threads") and _native.best_isa() == "portable")


def test_a_page_takes_the_next_build_where_one_does_not_run(found):
    if not found["isFused"]:
        pytest.skip("this machine has no fused multiply-add, and the page takes the exact build")
    one = [["core.wasm", False, 1], ["exact.wasm", True, 1], ["scalar.wasm", True, 1]]
    assert found["doors"] == ([["threads.wasm", False, 3]] if found["build"] == "threads" else one)


def test_a_refusal_is_the_native_sentence_and_leaves_the_stack_as_it_was(found):
    arrays = broken_lines()
    with pytest.raises(ValueError, match="is not finite") as native:
        _native.GroundMap(arrays["centerline"], arrays["inner"], arrays["outer"], arrays["is_closed"], 0.01)
    assert found["results"][-1] == {"sentence": str(native.value), "stack": 0}
