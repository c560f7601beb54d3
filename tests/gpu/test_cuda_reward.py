"""Translated reward functions against Python itself, and what must not be translated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from host_device import HostDevice

import racecraft.reward
from racecraft import _native
from racecraft.gpu import compile_program
from racecraft.reward import RewardWorker
from racecraft.reward.cuda import CudaReward
from racecraft.reward.cuda_source import cuda_source
from racecraft.reward.numeric import NotNumeric
from racecraft.reward.params import make_params
from racecraft.sim import Simulation, Start
from racecraft.sim.columns import ROW_COLUMNS
from racecraft.sim.cuda_simulation import SOURCES
from racecraft.track import load_track

PRESETS = Path(racecraft.reward.__file__).parent / "presets"
TRANSLATED = ("racing", "centerline", "heading", "anti_zigzag", "progress_pace", "speed_gate", "stay_inside")
TRACKS = (load_track("oval"), load_track("reinvent_2018"))

PYTHON = '''
"""Much of what is translated."""
from math import sqrt, pi
import math

HALF = 1 / 2
TURN = 2 * pi

def square(x):
    return x * x

def reach(line, start, far):
    total = 0.0
    for step in range(1, far + 1):
        point = line[(start + step) % len(line)]
        before = line[(start + step - 1) % len(line)]
        if total > 3:
            break
        total += sqrt(square(point[0] - before[0]) + square(point[1] - before[1]))
    else_value = 1 if total > 1 and not total > 2 else -1
    return total + else_value

def reward_function(params):
    reward: float = 1e-3
    lines = params["waypoints"]
    here = params["closest_waypoints"]
    angle = math.degrees(math.atan2(lines[here[1]][1] - lines[here[0]][1], lines[here[1]][0] - lines[here[0]][0]))
    difference = abs(angle - params["heading"]) % 360
    difference = min(difference, 360 - difference)
    if 0 <= difference < 10 or params["is_left_of_center"]:
        reward += 1.0
    elif difference > 100:
        reward -= params["steps"] // 7
    else:
        reward *= (params["speed"] or 0.5) ** 2
    first, last = (lines[-1][0], HALF)
    return float(reward + reach(lines, here[0], 9) + max(first, last, 0) - int(difference) % -3 + math.floor(-TURN))
'''


@pytest.fixture(scope="module")
def rows():
    simulation = Simulation(
        TRACKS, num_envs=64, camera=None, start=Start(mode="random", heading_jitter=1.0), direction="alternate"
    )
    rng = np.random.default_rng(5)
    kept = [simulation.rows.copy()]
    for _ in range(60):
        simulation.step(np.column_stack([rng.uniform(-0.5, 0.5, 64), rng.uniform(0, 4, 64)]))
        kept.append(simulation.rows.copy())
        simulation.reset(simulation.terminated)
    return np.concatenate(kept)


def reward_of(source: str, device) -> CudaReward:
    return CudaReward(source, TRACKS, device=device, width=_native_width(), include=SOURCES)


def _native_width() -> int:
    return len(_native.ROW_COLUMNS)


@pytest.mark.costly
@pytest.mark.parametrize("source", ["python", *TRANSLATED])
def test_translation_and_interpreter_agree(source, device, rows):
    text = PYTHON if source == "python" else (PRESETS / f"{source}.py").read_text()
    with RewardWorker(text, list(TRACKS)) as worker:
        reward_of(text, device).prove(worker, rows)
        assert len(set(worker(rows).tolist())) > 1


@pytest.mark.costly
@pytest.mark.parametrize("key", ["steering_angle", "speed", "progress"])
def test_commands_and_progress_are_those_of_python_to_the_bit(key, device):
    """The action space's own numbers, and 100 at the most."""
    angles, speeds = np.arange(-300, 301) / 10, (np.arange(601) % 391 + 10) / 100
    rows = np.zeros((601, _native_width()))
    rows[:, ROW_COLUMNS.index("steering_angle")] = np.radians(angles).astype(np.float32)
    rows[:, ROW_COLUMNS.index("speed")] = speeds.astype(np.float32)
    rows[:, ROW_COLUMNS.index("progress")] = np.linspace(-0.1, 1.1, len(rows))
    reward = reward_of(f"def reward_function(params):\n    return params['{key}']", device)
    address, rewards = device.allocate(rows.nbytes), device.allocate(8 * len(rows))
    device.write(address, rows)
    reward.pay(address, rewards, count=len(rows))
    paid = device.read(rewards, 8 * len(rows)).view(np.float64)
    assert paid.tolist() == [make_params(row, [[(0.0, 0.0)]])[key] for row in rows.tolist()]
    expected = {"steering_angle": angles, "speed": speeds, "progress": np.minimum(paid, 100.0)}
    assert paid.tolist() == expected[key].tolist()


@pytest.mark.costly
def test_what_python_raises_is_not_a_number():
    device = HostDevice()
    bad = "import math\ndef reward_function(params):\n    return {}"
    rows = np.zeros((2, _native_width()))
    rows[1, 1] = 1.0  # a prepare step: never asked
    for expression in (
        "1 / params['x']",
        "math.sqrt(params['x'] - 1)",
        "params['x'] ** -1",
        "1 % params['x']",
        "params['waypoints'][9999][0]",
        "math.log(params['x'] - 1)",
        "1e308 * 10",
    ):
        reward = reward_of(bad.format(expression), device)
        address, rewards = device.allocate(rows.nbytes), device.allocate(16)
        device.write(address, rows)
        reward.pay(address, rewards, count=2)
        paid = device.read(rewards, 16).view(np.float64)
        assert np.isnan(paid[0]), expression
        assert paid[1] == 0.0


def test_a_translation_that_differs_is_not_believed(rows):
    device = HostDevice()
    reward = reward_of("def reward_function(params):\n    return params['x']", device)
    with pytest.raises(NotNumeric, match="where the interpreter gave"):
        reward.prove(lambda rows: rows[:, 2] + 1e-6, rows[rows[:, 1] > 1])


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("return [1.0][0]", "uses List|looks into"),
        ("return sum(params['waypoints'][0])", "calls sum"),
        ("while True:\n        return 1.0", "line"),
        ("x = 1.0\n    x = params['waypoints']\n    return x", "number here"),
        ("return params['waypoints'] ", "does not return a number"),
        ("return 10000000000000000000000", "holds the number"),
        ("return reward_function(params)", "as a whole|calls itself|calls"),
        ("return params['speed'] if True else params['waypoints']", "two kinds"),
        ("return math.gamma(3.0)", "calls math"),
        ("return unknown", "unknown is not known"),
        ("import os\n    return 1.0", "line"),
    ],
)
def test_what_is_not_translated_says_why(body, reason):
    with pytest.raises(NotNumeric, match=reason):
        cuda_source(f"import math\ndef reward_function(params):\n    {body}\n")


@pytest.mark.costly
def test_translations_compile_for_gpus():
    pytest.importorskip("cuda.bindings.nvrtc", reason="cuda-bindings is not installed")
    code = compile_program(cuda_source(PYTHON), name="reward.cu", architecture="compute_80", include=SOURCES)
    assert b".entry pay_cars(" in code
    code = compile_program(cuda_source(PYTHON), name="reward.cu", architecture="sm_90", include=SOURCES)
    assert code[:4] == b"\x7fELF"
