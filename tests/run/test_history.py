"""The history of a run: points are followed while they are written, and a resumed run writes its own again."""

import json
from pathlib import Path

import pytest

from racecraft.errors import RunError
from racecraft.run.history import MAX_LINE, HistoryWriter, read_history


def test_points_are_read_from_where_the_last_call_ended(tmp_path: Path) -> None:
    path = tmp_path / "metrics" / "history.jsonl"
    with HistoryWriter(path) as writer:
        assert read_history(path) == ([], 0)
        writer.add("evaluation", {"step": 1, "completions": [0.5]})
        points, offset = read_history(path)
        assert points == [{"kind": "evaluation", "step": 1, "completions": [0.5]}]
        assert read_history(path, offset=offset) == ([], offset)
        writer.add("note", {"step": 2, "text": "ä\n"})
    points, end = read_history(path, offset=offset)
    assert points == [{"kind": "note", "step": 2, "text": "ä\n"}]
    assert end == path.stat().st_size


def test_a_line_without_an_end_is_waited_for_until_it_is_longer_than_any(tmp_path: Path) -> None:
    path = tmp_path / "h"
    for size, end in ((MAX_LINE, 0), (MAX_LINE + 1, MAX_LINE + 1)):
        path.write_bytes(b"x" * size)
        assert read_history(path, max_bytes=2 * MAX_LINE) == ([], end)


def test_what_is_not_known_is_null(tmp_path: Path) -> None:
    with HistoryWriter(tmp_path / "h") as writer:
        writer.add_iteration({"step": 1, "reward": float("nan"), "pace": float("inf")})
    assert read_history(tmp_path / "h")[0] == [{"kind": "iteration", "step": 1, "reward": None, "pace": None}]


def test_iterations_in_a_rush_are_thinned(tmp_path: Path) -> None:
    with HistoryWriter(tmp_path / "h") as writer:
        for step in range(1000):
            writer.add_iteration({"step": step})
    assert len(read_history(tmp_path / "h")[0]) < 100


def test_the_first_iteration_is_written_however_young_the_clock_is(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("racecraft.run.history.time.monotonic", lambda: 0.1)  # s since the machine began
    with HistoryWriter(tmp_path / "h") as writer:
        writer.add_iteration({"step": 1})
        writer.add_iteration({"step": 2})
    assert [point["step"] for point in read_history(tmp_path / "h")[0]] == [1]


def test_a_resumed_run_drops_what_came_after_its_checkpoint(tmp_path: Path) -> None:
    path = tmp_path / "h"
    with HistoryWriter(path) as writer:
        for step in (10, 20, 30):
            writer.add("evaluation", {"step": step})
    with path.open("ab") as file:
        file.write(b'{"kind": "evaluation", "st')  # killed in the middle of a line
    with HistoryWriter(path, step=20) as writer:
        writer.add("evaluation", {"step": 25})
    assert [point["step"] for point in read_history(path)[0]] == [10, 20, 25]
    with HistoryWriter(path):
        assert read_history(path) == ([], 0)  # a fresh run starts anew


def test_half_lines_damaged_lines_and_foreign_files(tmp_path: Path) -> None:
    path = tmp_path / "h"
    path.write_bytes(b'{"step": 1}\nnot json\n[1]\n{"step": 2}\n{"step"')
    points, offset = read_history(path)
    assert [point["step"] for point in points] == [1, 2]
    assert path.read_bytes()[offset:] == b'{"step"'
    assert read_history(path, offset=10**9)[0] == points  # shorter than it was: from its start
    path.write_bytes(b"[" * 60_000 + b'\n{"step": NaN}\n{"step": 1e999}\n{"text": "\\ud800"}\n')
    assert read_history(path) == ([], path.stat().st_size)  # what no page could show
    path.write_bytes(b'{"step"')
    assert read_history(path) == ([], 0)  # the whole file is half a line
    long = b'{"step": 1}\n' * 6000
    path.write_bytes(long + b'{"step"')
    assert read_history(path)[1] == len(long) > 64 * 1024
    path.write_bytes(b"\0" * 200_000)
    assert read_history(path) == ([], 200_000)
    assert read_history(path, max_bytes=100_000) == ([], 100_000)


def test_a_file_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "metrics").write_text("a file where the folder should be")
    with pytest.raises(RunError, match="cannot be written"):
        HistoryWriter(tmp_path / "metrics" / "history.jsonl")


def test_every_line_is_json(tmp_path: Path) -> None:
    with HistoryWriter(tmp_path / "h") as writer:
        writer.add("note", {"step": 0, "text": "\x00\u2028\ud800"})
    for line in (tmp_path / "h").read_bytes().split(b"\n")[:-1]:
        json.loads(line)
