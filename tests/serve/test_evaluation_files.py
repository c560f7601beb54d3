"""Evaluations whose files are cut off, or say something else than they should, are shown as far as they can be."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from racecraft.run import RunFolder
from racecraft.serve.evaluations.routes import COLUMNS, get_telemetry, list_evaluations

STAMP = "20260101000000"
ROW = ["0", "1.0", "0.5", "0.5", "90.0", "0.0", "1.0", "1.0", "10.0", "0.2", "in_progress"]


@pytest.fixture
def context(tmp_path: Path) -> Any:
    (tmp_path / f"evaluation-{STAMP}" / "evaluation-simtrace").mkdir(parents=True)
    return SimpleNamespace(garage=SimpleNamespace(folder=lambda _: RunFolder(tmp_path)))


@pytest.mark.parametrize(
    "end",
    ["0,2.0,0.5", ",".join(["x", *ROW[1:]]), ",".join([*ROW[:2], "nan", *ROW[3:]]), ",".join([*ROW[:2], "\udcff"])],
)
def test_telemetry_ends_where_its_file_is_damaged(context: Any, tmp_path: Path, end: str) -> None:
    lines = [",".join(COLUMNS), ",".join(ROW), ",".join(ROW), end]
    file = tmp_path / f"evaluation-{STAMP}" / "evaluation-simtrace" / "0-iteration.csv"
    file.write_text("\n".join(lines), encoding="utf-8", errors="surrogateescape")
    columns = get_telemetry("a", STAMP, context).columns
    assert {len(values) for values in columns.values()} <= {0, 2}
    assert len({len(values) for values in columns.values()}) == 1
    file.write_text("no header\n1,2\n")
    assert get_telemetry("a", STAMP, context).columns["X"] == []


def test_an_evaluation_with_damaged_files_hides_no_other(context: Any, tmp_path: Path) -> None:
    for number, (summary, metrics) in enumerate(
        [({}, {"metrics": []}), ({"video": 1}, {"metrics": []}), ({}, {}), ({}, {"metrics": [[None]]}), ({}, {"a": 1})]
    ):
        stamp = f"{int(STAMP) + number}"
        folder = RunFolder(tmp_path)
        folder.evaluation(stamp).mkdir(exist_ok=True)
        (folder.evaluation(stamp) / "evaluation.json").write_text(json.dumps(summary))
        folder.evaluation_metrics(stamp).parent.mkdir(exist_ok=True)
        folder.evaluation_metrics(stamp).write_text(json.dumps(metrics))
    assert [card.stamp for card in list_evaluations("a", context)] == [STAMP]
