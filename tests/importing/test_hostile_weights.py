"""Whatever is done to a file of weights: one sentence, soon, in little memory, and no run."""

from __future__ import annotations

import json
import subprocess
import sys
import tarfile
import zlib
from pathlib import Path

import models
import numpy as np
import pytest
from aws_models import SHALLOW, AwsModel
from tensorflow_bundles import table

from racecraft.agent.sensor_suite import SensorSuite
from racecraft.errors import SourceError
from racecraft.importing.frozen_graph import open_frozen_graph
from racecraft.importing.weights import read_weights
from racecraft.learn import NetworkSpec
from tensorflow_graphs import VERSIONS, GraphWriter, attribute, bytes_field, number, shape_message

SECONDS, MEGABYTES = 2.0, 500


def outcome(path: Path) -> str:
    """What reading a graph's policy says; empty where it is read."""
    spec = NetworkSpec(name=SHALLOW, num_actions=5, state_size=1)
    try:
        with open_frozen_graph(path) as graph:
            read_weights(graph, spec, SensorSuite(), [])
    except SourceError as error:
        return str(error)
    return ""


def few_layers() -> bytes:
    """A graph whose constants are short, so that every bit of it matters to the reader."""
    writer = GraphWriter()
    scope = "main_level/agent/main/online/network_1/"
    writer.constant(f"{scope}FRONT_FACING_CAMERA/Conv2d_0/kernel", np.ones((8, 8, 1, 32), np.float32)[:1, :1])
    writer.constant(f"{scope}ppo_head_0/policy_fc/kernel", np.ones((2, 5), np.float32))
    writer.node(f"{scope}ppo_head_0/policy", "Softmax", f"{scope}ppo_head_0/policy_fc/kernel")
    return writer.bytes()


@pytest.mark.costly
def test_whatever_bits_flip_a_graph_gives_a_sentence_or_its_weights(tmp_path: Path) -> None:
    path = tmp_path / "model.pb"
    rng = np.random.default_rng(3)
    said = set()
    for whole in (few_layers(), AwsModel().small_graph()):
        for _ in range(1000):
            damaged = bytearray(whole)
            damaged[rng.integers(len(damaged))] ^= 1 << int(rng.integers(8))
            path.write_bytes(damaged)
            said.add(outcome(path))
    assert "" in said  # some bits only change a weight, which nothing can tell
    assert len(said) > 20
    assert not any("\n" in text or len(text) > 400 for text in said)


@pytest.mark.costly
def test_wherever_a_graph_is_cut_off_it_is_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "model.pb"
    for whole in (few_layers(), AwsModel().small_graph()):
        for size in range(len(whole) - len(VERSIONS)):
            path.write_bytes(whole[:size])
            assert outcome(path), size


RUN = """
import json, sys, time
from racecraft.errors import RacecraftError
from racecraft.importing import import_run
import racecraft.importing.importer
for path in sys.argv[1:]:
    begun = time.process_time()
    try:
        import_run(path, track="oval")
        said = ""
    except RacecraftError as error:
        said = str(error)
    (peak,) = (line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM"))
    memory = int(peak) / 1024  # of this process alone: getrusage counts the one that it was forked from
    print(json.dumps([path, said, time.process_time() - begun, memory]))
"""


@pytest.mark.costly
def test_a_hostile_archive_costs_seconds_and_megabytes(tmp_path: Path) -> None:
    metadata = json.dumps(AwsModel().metadata())
    huge = bytes_field(8, number(1, 1) + bytes_field(2, shape_message((1 << 13, 1 << 13))) + bytes_field(5, bytes(4)))
    constant = bytes_field(2, "Const") + attribute("value", huge)
    policy = "main_level/agent/main/online/network_1/ppo_head_0/policy_fc/kernel"
    files: dict[str, models.Files] = {
        "fields": {"model.pb": number(9, 1) * 3_000_000},
        "nodes": {"model.pb": b"".join(bytes_field(1, bytes_field(1, f"n{i}") + constant) for i in range(19_000))},
        "huge": {"model.pb": bytes_field(1, bytes_field(1, policy) + constant)},
        "messages": {"model.pb": b"\x0a\x00" * 3_000_000},
        "names": {
            "1_Step-2.ckpt.index": table([(b"", number(1, 1)), *((b"n%d" % i, number(1, 1)) for i in range(10_500))]),
            "1_Step-2.ckpt.data-00000-of-00001": b"x",
        },
        "index": {"1_Step-2.ckpt.index": bytes(1 << 21), "1_Step-2.ckpt.data-00000-of-00001": b"x"},
        "json": {"model.pb": b"x", "deepracer_checkpoints.json": "[" * 500_000},
    }
    paths = [
        models.as_tar({"model_metadata.json": metadata, **made}, tmp_path / f"{name}.tar")
        for name, made in files.items()
    ]
    paths.append(bomb(tmp_path / "bomb.tar.gz", metadata))
    done = subprocess.run(
        [sys.executable, "-c", RUN, *map(str, paths)], capture_output=True, text=True, cwd=tmp_path, check=True
    )
    told = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(told) == len(paths)
    for path, said, seconds, megabytes in told:
        assert said, path
        assert "\n" not in said
        assert seconds < SECONDS, (path, seconds)
        assert megabytes < MEGABYTES, (path, megabytes)
    assert not list(tmp_path.glob("runs/*"))


def bomb(path: Path, metadata: str) -> Path:
    """Weights that grow eightyfold, to 400 MB."""
    squeeze = zlib.compressobj(1, wbits=31)
    piece = np.random.default_rng(1).bytes(8_000) + bytes((1 << 20) - 8_000)
    with path.open("wb") as file:
        for name, content, count in (("model_metadata.json", metadata.encode(), 1), ("model.pb", piece, 400)):
            info = tarfile.TarInfo(name)
            info.size = len(content) * count
            file.write(squeeze.compress(info.tobuf()))
            for _ in range(count):
                file.write(squeeze.compress(content))
            file.write(squeeze.compress(bytes(-info.size % 512)))
        file.write(squeeze.compress(bytes(1024)) + squeeze.flush())
    return path
