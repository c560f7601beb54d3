"""Trainings on a cluster of Ray: three real nodes on this machine, one of which is lost."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import pytest

from racecraft.errors import ConfigError
from racecraft.run import RunFolder
from racecraft.sweeping import make_sweep, read_sweep
from racecraft.track import load_track, save_route
from racecraft.training.job import Training
from racecraft.tuning.cluster import pack, tracks_of, train_packed, unpack
from racecraft.tuning.trial import Order, Report

FILE = """
seeds = [1, 2, 3]
[all]
track = "TRACK"
until = "512 steps"
num_envs = 8
evaluate_every = 256
[settings.plain]
[settings.bold]
numbers = { learning_rate = 0.002 }
"""
RAY = Path(__file__).parents[2] / "build" / "ray"


def own_track(folder: Path) -> str:
    folder.mkdir(parents=True, exist_ok=True)
    return str(save_route(load_track("oval"), folder / "own.npy"))


def same(one: RunFolder, other: RunFolder) -> None:
    first, second = (run.checkpoints.load("last").arrays for run in (one, other))
    assert set(first) == set(second)
    for name, value in first.items():
        if name != "recent_episodes":  # holds wall-clock times
            np.testing.assert_array_equal(second[name], value, err_msg=f"{one.name} {name}")


@pytest.mark.costly
def test_a_node_needs_nothing_but_what_it_is_sent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RACECRAFT_MOVED", "")  # which is put back
    text = FILE.replace("[1, 2, 3]", "[1]").replace("TRACK", own_track(tmp_path / "tracks"))
    sweep, alone = (make_sweep(read_sweep(text), runs=tmp_path / place, name="s") for place in ("runs", "alone"))
    run = sweep.run_of("bold", 1)
    (run.path / ".hidden").write_text("stays")
    sent, tracks = pack(run.path), tracks_of(run)
    Training(alone.run_of("bold", 1)).run()
    Path(next(iter(tracks))).unlink()
    order = Order(run=str(run.path), goal="laps", trial_steps=1, is_checked=False, num_threads=1)
    packed, answer = train_packed(sent, tracks, order.to_dict())
    assert Report.from_dict(answer).reason == "steps"
    unpack(packed, run.path)
    same(alone.run_of("bold", 1), run)
    assert (run.path / ".hidden").exists()
    unpack(sent, tmp_path / "broken")
    (tmp_path / "broken" / "reward_function.py").write_text("nonsense(")
    _, answer = train_packed(pack(tmp_path / "broken"), tracks, order.to_dict())
    assert answer["error"]["kind"] == "RewardError"


def test_without_ray_it_says_what_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    sweep = make_sweep(read_sweep(FILE.replace("TRACK", "oval")), runs=tmp_path, name="s")
    with pytest.raises(ConfigError, match="--cluster needs ray") as told:
        sweep.train(cluster="auto")
    assert "racecraft[ray]" in told.value.hint


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.filterwarnings("ignore")
def test_a_lost_node_changes_no_bit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if RAY.is_dir():
        monkeypatch.syspath_prepend(str(RAY))
        monkeypatch.setenv("PYTHONPATH", str(RAY) + os.pathsep + os.environ.get("PYTHONPATH", ""))
    monkeypatch.setenv("RAY_raylet_start_wait_time_s", "240")  # the machine may be busy
    pytest.importorskip("ray", reason="Ray is not installed: make build/ray")
    from ray.cluster_utils import Cluster

    text = FILE.replace("TRACK", own_track(tmp_path / "tracks"))
    sweep, alone = (make_sweep(read_sweep(text), runs=tmp_path / place, name="s") for place in ("runs", "alone"))
    small = {"num_cpus": 1, "object_store_memory": 80_000_000}
    cluster = Cluster(initialize_head=True, head_node_args={**small, "include_dashboard": False})
    try:
        lost = cluster.add_node(**small)
        cluster.add_node(**small)
        cluster.wait_for_nodes()
        told: dict[str, Report | Exception] = {}

        def tell(run: str, how: Report | Exception) -> None:
            if not told:
                cluster.remove_node(lost, allow_graceful=False)
            told[run] = how

        assert not sweep.train(cluster=cluster.address, on_end=tell)
    finally:
        cluster.shutdown()
    assert {how.reason for how in told.values() if isinstance(how, Report)} == {"steps"}
    assert set(told) == set(sweep.names())
    for name in sweep.names():
        Training(RunFolder(alone.runs / name)).run()
        same(RunFolder(alone.runs / name), RunFolder(sweep.runs / name))
