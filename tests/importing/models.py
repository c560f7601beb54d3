"""Models of the original, made small: what the tests import."""

from __future__ import annotations

import csv
import io
import json
import tarfile
import zipfile
from collections.abc import Mapping
from pathlib import Path

from aws_models import AwsModel

from racecraft.run.simtrace import COLUMNS

Files = dict[str, str | bytes]

REWARD = "def reward_function(params):\n    return float(params['progress'])\n"
ACTIONS = [{"steering_angle": angle, "speed": 1.0, "index": place} for place, angle in enumerate((-30.0, 0.0, 30.0))]
METADATA = json.dumps({"action_space": ACTIONS, "sensor": ["FRONT_FACING_CAMERA"], "version": "5"})
HYPERPARAMETERS = json.dumps({"batch_size": 64, "lr": 0.0003, "num_episodes_between_training": 5, "num_epochs": 3})
PARAMS = """\
WORLD_NAME: oval
REVERSE_DIR: "True"
CHANGE_START_POSITION: false
START_POSITION_OFFSET: 0.25
MIN_EVAL_TRIALS: 3
JOB_TYPE: TRAINING
"""


def simtrace(episodes: int = 2, *, columns: int = 18) -> str:
    """A sim-trace of a car that stands still."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS[:columns])
    for episode in range(episodes):
        for step in (1.0, 2.0, 3.0):
            status = "prepare" if step == 1 else "in_progress"
            row = (episode, step, 1, 2, 0, 0, 1, 0, 0, step == 3, True, 1.5, 0, 16.8, step / 15, status, 0, 0, 1e9)
            writer.writerow(row[:columns])
    return text.getvalue()


def metrics(*, phase: str = "training") -> str:
    line = {
        "metric_time": 100,
        "start_time": 0,
        "elapsed_time_in_milliseconds": 100,
        "completion_percentage": 3,
        "trial": 1,
        "episode_status": "Off track",
        "phase": phase,
    }
    return json.dumps({"metrics": [line], "version": 2.0})


MODEL = {
    "reward_function.py": REWARD,
    "model_metadata.json": METADATA,
    "hyperparameters.json": HYPERPARAMETERS,
    "training_params.yaml": PARAMS,
}
"""A virtual model of DeepRacer on AWS."""

HISTORY = {
    "metrics/training/20240611.json": metrics(),
    "metrics/evaluation/20240612.json": metrics(phase="evaluation"),
    "sim-trace/training/2024-06-11T23:03:50Z-mine/training-simtrace/0-iteration.csv": simtrace(columns=17),
    "sim-trace/evaluation/20240612/evaluation-simtrace/0-iteration.csv": simtrace(1, columns=19),
    "logs/training/training-20240611-robomaker.log": "starting\nSIM_TRACE_LOG:" + simtrace().splitlines()[1] + "\n",
}

GRAPH = AwsModel(num_actions=len(ACTIONS)).small_graph()
WEIGHTS: Files = {
    "model/.coach_checkpoint": "8_Step-100.ckpt",
    "model/8_Step-100.ckpt.meta": "a graph that is not read",
    "model/model_7.pb": "graph",
    "model/model_8.pb": GRAPH,
    "model/deepracer_checkpoints.json": json.dumps({"best_checkpoint": {"name": "8_Step-100.ckpt"}}),
}

DRFC: Files = {
    "run.env": "DR_WORLD_NAME=oval\nDR_LOCAL_S3_MODEL_PREFIX=my-model\n",
    "system.env": "DR_WORKERS=1\nDR_DOCKER_STYLE=swarm\n",
    "custom_files/reward_function.py": REWARD,
    "custom_files/model_metadata.json": METADATA,
    "custom_files/hyperparameters.json": HYPERPARAMETERS,
    "defaults/reward_function.py": "this is no Python",
    "data/minio/bucket/my-model/metrics/TrainingMetrics.json": metrics(),
    "data/minio/bucket/my-model/training-simtrace/0-iteration.csv": simtrace(),
    "data/minio/bucket/my-model/model/model_1.pb": GRAPH,
    "data/minio/bucket/other/reward_function.py": REWARD,
    "data/minio/bucket/other/training-simtrace/0-iteration.csv": "no sim-trace",
}


def _bytes(content: str | bytes) -> bytes:
    return content.encode() if isinstance(content, str) else content


def as_folder(files: Mapping[str, str | bytes], folder: Path) -> Path:
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(_bytes(text))
    return folder


def as_tar(files: Mapping[str, str | bytes], path: Path, *, prefix: str = "") -> Path:
    with tarfile.open(path, "w:gz" if path.suffix == ".gz" else "w") as archive:
        for name, text in files.items():
            data = _bytes(text)
            info = tarfile.TarInfo(prefix + name)
            info.size = len(data)
            archive.addfile(info, io.BytesIO(data))
    return path


def as_zip(files: Mapping[str, str | bytes], path: Path, *, prefix: str = "") -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in files.items():
            archive.writestr(prefix + name, _bytes(text))
    return path
