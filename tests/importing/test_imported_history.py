"""Metrics, sim-traces and logs that are malformed are left out, and named."""

from __future__ import annotations

import re
from pathlib import Path

import models
import pytest

from racecraft.importing import import_run

BAD_HISTORY: dict[str, tuple[str, str, str]] = {
    "short row": ("training-simtrace/1-iteration.csv", models.simtrace() + "1,2,3\n", "1 rows are broken"),
    "no number": (
        "training-simtrace/1-iteration.csv",
        models.simtrace().replace("16.8", "long"),
        "are broken|broken rows",
    ),
    "nan": ("training-simtrace/1-iteration.csv", models.simtrace().replace("16.8", "nan", 1), "1 rows are broken"),
    "text": ("training-simtrace/1-iteration.csv", "hello\n" * 100, "holds no sim-trace"),
    "empty": ("training-simtrace/1-iteration.csv", "", "holds no sim-trace"),
    "no metrics": ("metrics/TrainingMetrics.json", "[]", "expected an object"),
    "no trials": ("metrics/TrainingMetrics.json", '{"metrics": [1]}', "no list of trials"),
    "text in metrics": ("metrics/TrainingMetrics.json", models.metrics().replace("100", '"x"'), "is not a number"),
    "huge": ("metrics/TrainingMetrics.json", models.metrics().replace("100", "1" * 400), "too large for a number"),
    "infinite": ("metrics/TrainingMetrics.json", models.metrics().replace("100", "1e999"), "too large"),
    "no status": ("metrics/TrainingMetrics.json", models.metrics().replace("episode_status", "x"), "no episode_status"),
    "odd name": ("metrics/Training Metrics $(x).json", models.metrics(), "odd characters"),
    "plain log": ("logs/sagemaker.log", "Policy training> ...\n", "holds no sim-trace"),
}


@pytest.mark.parametrize(("name", "text", "says"), BAD_HISTORY.values(), ids=BAD_HISTORY)
def test_malformed_history_is_left_out_and_named(name: str, text: str, says: str, tmp_path: Path) -> None:
    good = "training-simtrace/0-iteration.csv"
    files = {**models.MODEL, good: models.simtrace(), name: text}
    found = import_run(models.as_folder(files, tmp_path / "m"))
    assert found.kept == [good]
    assert re.search(says, found.unused[name])
    assert not (found.run / "original" / name).exists()
    assert str(found.run) not in found.unused[name]  # where it is not


def test_a_packed_sim_trace_is_not_unpacked(tmp_path: Path) -> None:
    import gzip

    folder = models.as_folder({**models.MODEL, "training-simtrace/0-iteration.csv": ""}, tmp_path / "m")
    (folder / "training-simtrace" / "0-iteration.csv").write_bytes(gzip.compress(bytes(10**6)))
    found = import_run(folder)
    assert "packed once more" in found.unused["training-simtrace/0-iteration.csv"]
