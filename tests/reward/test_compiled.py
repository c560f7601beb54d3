"""A compiled reward function gives the interpreter's rewards to the bit, or is not compiled."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from racecraft.errors import ConfigError, RewardError
from racecraft.reward import RewardWorker, load_preset, preset_names
from racecraft.reward.numeric import VALUES, NotNumeric, numeric_source
from racecraft.reward.params import TEMPLATE, make_params
from racecraft.reward.worker_process import PROVING_ROWS
from racecraft.sim.columns import ROW_COLUMNS

FUNCTIONS = Path(__file__).parent / "functions"
NUMERIC = ("anti_zigzag", "centerline", "heading", "progress_pace", "racing", "speed_gate", "stay_inside")
START_S = 120.0  # compiling takes seconds, more on a busy machine


def body(*lines: str, top: str = "") -> str:
    return top + "def reward_function(params):\n" + "".join(f"    {line}\n" for line in lines)


@pytest.fixture(scope="module")
def batches(make_row) -> list[np.ndarray]:
    """Twice as many rows as are compared before the compiled function is believed, anywhere and in any state."""
    rng = np.random.default_rng(3)
    rows = np.stack([make_row() for _ in range(2 * PROVING_ROWS)])

    def fill(name: str, values: np.ndarray) -> None:
        rows[:, ROW_COLUMNS.index(name)] = values

    count = len(rows)
    for name, low, high in (("x", -3, 3), ("y", -2, 2), ("heading", -4, 4), ("offset", -0.6, 0.6), ("speed", 0.1, 4)):
        fill(name, rng.uniform(low, high, count))
    for name in ("all_wheels_on_track", "is_offtrack", "is_reversed", "track_index"):
        fill(name, rng.integers(0, 2, count).astype(float))
    behind = rng.integers(0, 24, count).astype(float)
    fill("closest_prev", behind)
    fill("closest_next", behind + 1)
    fill("steps", rng.integers(1, 400, count).astype(float))
    fill("progress", rng.uniform(-0.1, 1.1, count))
    fill("steering_angle", rng.uniform(-0.8, 0.8, count))
    return np.split(rows, 16)


# --- what can be rewritten


def test_the_rewritten_values_are_those_of_the_dict(batches):
    """Every numeric key, computed by its expression, against `make_params`."""
    waypoints = [[(0.0, 1.0), (2.0, 3.0)], [(4.0, 5.0), (6.0, 7.0)]]
    namespace: dict = {}
    exec(numeric_source(body("return [" + ", ".join(f"params['{key}']" for key in VALUES) + "]")), namespace)
    for row in np.concatenate(batches)[:200]:
        if row[ROW_COLUMNS.index("steps")] == 1.0:
            continue
        found: list = [None]
        namespace["kernel"](row[None], found, waypoints)
        params = make_params(row.tolist(), waypoints)
        for key, value in zip(VALUES, found[0], strict=True):
            assert value == (tuple(params[key]) if key == "closest_waypoints" else params[key]), key


def test_keys_that_are_not_numbers_are_those_of_objects():
    assert {key for key in TEMPLATE if key not in VALUES} == {key for key in TEMPLATE if "object" in key}


@pytest.mark.parametrize(
    ("source", "why"),
    [
        (body("return helper(params)", top="def helper(p):\n    return p['x']\n"), "as a whole"),
        (body("return params[key]", top="key = 'x'\n"), "as a whole"),
        (body("params['x'] = 1.0", "return params['x']"), "as a whole"),
        (body("return len(params['objects_location'])"), "as a whole"),
        (body("global n", "n = 1", "return n"), "remembers"),
        (body("print(params['x'])", "return 1.0"), "prints"),
        (body("return random.random()", top="import random\n"), "random"),
        ("reward_function = lambda params: params['x']", "plain function"),
        ("def reward_function(params, k=2.0):\n    return k * params['x']", "more than params"),
        ("def reward_function(params, /):\n    return params['x']", "more than params"),
        (load_preset("object_avoidance"), "as a whole"),
    ],
)
def test_what_is_not_numeric_is_refused_with_its_reason(source, why):
    with pytest.raises(NotNumeric, match=why):
        numeric_source(source)


@pytest.mark.parametrize("name", preset_names())
def test_presets_that_neither_remember_nor_loop_over_objects_are_numeric(name):
    if name in NUMERIC:
        assert "def kernel(" in numeric_source(load_preset(name))
    else:
        assert name in ("dodge", "duel", "lap_time", "object_avoidance", "overtake", "slalom", "touring")
        with pytest.raises(NotNumeric):
            numeric_source(load_preset(name))


# --- in the worker


def interpreted(source: str, track, batches) -> np.ndarray:
    with RewardWorker(source, track) as worker:
        return np.concatenate([worker(batch) for batch in batches])


@pytest.mark.costly
def test_a_compiled_reward_is_the_interpreted_one_to_the_bit(track, batches):
    pytest.importorskip("numba")
    source = load_preset("racing")
    with RewardWorker(source, track, compiled=True, start_timeout_s=START_S) as worker:
        rewards = np.concatenate([worker(batch) for batch in batches])
        assert worker.interpreted_because == ""
        assert worker.read_log() == ""
    assert rewards.tobytes() == interpreted(source, track, batches).tobytes()
    assert len(np.unique(rewards)) > 500


@pytest.mark.costly
def test_compiled_commands_are_the_numbers_of_the_action_space(track, make_row):
    """And progress is 100 at the most; a number that tells all three."""
    pytest.importorskip("numba")
    angles, speeds = np.arange(-300, 301) / 10, (np.arange(601) % 391 + 10) / 100
    rows = np.tile(make_row(), (601, 1))
    rows[:, ROW_COLUMNS.index("steering_angle")] = np.radians(angles).astype(np.float32)
    rows[:, ROW_COLUMNS.index("speed")] = speeds.astype(np.float32)
    rows[:, ROW_COLUMNS.index("progress")] = np.linspace(0.9, 1.1, 601)
    source = body("return (params['steering_angle'] * 100.0 + params['speed']) * 10.0 + params['progress']")
    with RewardWorker(source, track, compiled=True, start_timeout_s=START_S) as worker:
        assert len(rows) >= PROVING_ROWS
        worker(rows)
        rewards = worker(rows)  # compiled by now
        assert worker.read_log() == worker.interpreted_because == ""
    progress = np.minimum(np.linspace(0.9, 1.1, 601) * 100.0, 100.0)
    assert rewards.tolist() == ((angles * 100.0 + speeds) * 10.0 + progress).tolist()


@pytest.mark.slow
@pytest.mark.parametrize(
    "source",
    [
        *(load_preset(name) for name in ("centerline", "heading", "progress_pace")),
        *((FUNCTIONS / f"{name}.py").read_text() for name in ("waypoint_look_ahead", "angle_wraps")),
    ],
    ids=lambda source: source[:40],
)
def test_many_are(track, batches, source):
    pytest.importorskip("numba")
    with RewardWorker(source, track, compiled=True, start_timeout_s=START_S) as worker:
        rewards = np.concatenate([worker(batch) for batch in batches])
    assert rewards.tobytes() == interpreted(source, track, batches).tobytes()


@pytest.mark.slow
def test_a_function_that_means_something_else_compiled_goes_on_interpreted(track, batches):
    pytest.importorskip("numba")
    source = body("return float((int(params['steps']) * 10**17 * 1000) % 1009)")  # beyond 64 bits
    with RewardWorker(source, track, compiled=True, start_timeout_s=START_S) as worker:
        rewards = np.concatenate([worker(batch) for batch in batches])
        assert "goes on interpreted" in worker.read_log() or worker.interpreted_because
    assert rewards.tobytes() == interpreted(source, track, batches).tobytes()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("expression", "says"),
    [
        ("1.0 / (params['x'] - 99.0)", "ZeroDivisionError"),
        ("params['waypoints'][24 if params['x'] < 50 else 99][0]", "IndexError"),
        ("params['x'] * 10000", "1010000"),
        ("(params['x'] - 99.5) ** 0.5 * 0 if params['x'] > 99.8 else float('nan') if params['x'] > 9 else 1.0", "nan"),
    ],
)
def test_an_error_late_in_compiled_code_has_its_line_and_params(track, batches, make_row, expression, says):
    pytest.importorskip("numba")
    with RewardWorker(body(f"return {expression}"), track, compiled=True, start_timeout_s=START_S) as worker:
        for batch in batches:
            worker(batch)
        assert worker.interpreted_because == ""
        bad = {"1010000": 101.0}.get(says, 99.0)
        with pytest.raises(RewardError, match=says) as caught:
            worker(np.stack([make_row(), make_row(x=bad)]))
    assert (caught.value.line, caught.value.row_index) == (2, 1)
    assert caught.value.params["x"] == bad


@pytest.mark.slow
def test_what_numba_cannot_compile_is_interpreted_and_says_why(track, batches):
    pytest.importorskip("numba")
    source = body("return float('{:.3f}'.format(params['speed']))")
    with RewardWorker(source, track, compiled=True, start_timeout_s=START_S) as worker:
        assert worker.interpreted_because
        rewards = np.concatenate([worker(batch) for batch in batches])
    assert rewards.tobytes() == interpreted(source, track, batches).tobytes()


def test_what_is_not_numeric_is_interpreted_and_says_why(track, rows):
    pytest.importorskip("numba")
    with RewardWorker(load_preset("object_avoidance"), track, compiled=True) as worker:
        assert "as a whole" in worker.interpreted_because
        assert np.isfinite(worker(rows)).all()


def test_without_numba_it_says_what_to_install(track, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(ConfigError, match="numba") as caught:
        RewardWorker(load_preset("racing"), track, compiled=True)
    assert "racecraft[compile]" in caught.value.hint
