"""Prints of the reward function in a file that does not grow without end."""

from __future__ import annotations

from pathlib import Path

import pytest

from racecraft.errors import RunError
from racecraft.run import PrintLog


def test_nothing_printed_makes_no_file(tmp_path: Path) -> None:
    with PrintLog(tmp_path / "logs" / "reward.log") as log:
        log.write("")
    assert list(tmp_path.iterdir()) == []


def test_a_second_writer_goes_on_where_the_first_stopped(tmp_path: Path) -> None:
    for text in ("first ü\n", "second\n"):
        with PrintLog(tmp_path / "logs" / "reward.log") as log:
            log.write(text)
    assert log.path.read_text(encoding="utf-8") == "first ü\nsecond\n"


def test_it_is_on_disk_at_once(tmp_path: Path) -> None:
    log = PrintLog(tmp_path / "reward.log")
    log.write("now")
    assert log.path.read_text() == "now"
    log.close()
    log.close()


def test_nothing_printed_drives_the_terminal_that_shows_the_file(tmp_path: Path) -> None:
    with PrintLog(tmp_path / "reward.log") as log:
        log.write("\x1b]0;mine\x07\x1b[2J\ta tab, ü\u202e\x9b1m\r\ud800\n\nlast")
    assert log.path.read_bytes().decode() == "�]0;mine��[2J\ta tab, ü��1m��\n\nlast"


def test_what_was_lost_is_told_where_it_was_lost(tmp_path: Path) -> None:
    with PrintLog(tmp_path / "reward.log") as log:
        log.write("before\n")
        log.write("after\n", lost=12_345)
    assert log.path.read_text().splitlines()[0] == "before"
    assert "12,345 bytes" in log.path.read_text().splitlines()[2]
    assert log.path.read_text().endswith("after\n")


def test_two_files_of_bounded_size_hold_the_last_of_it(tmp_path: Path) -> None:
    with PrintLog(tmp_path / "reward.log", max_bytes=1000) as log:
        for number in range(1000):
            log.write(f"{number:09d}\n")
    sizes = [log.path.stat().st_size, log.older.stat().st_size]
    assert max(sizes) == 1000
    kept = (log.older.read_text() + log.path.read_text()).split()
    assert kept == [f"{number:09d}" for number in range(1000 - len(kept), 1000)]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["reward.1.log", "reward.log"]


def test_one_huge_text_is_cut_to_its_end(tmp_path: Path) -> None:
    with PrintLog(tmp_path / "reward.log", max_bytes=10) as log:
        log.write("x" * 1000 + "0123456789")
        log.write("the end")
    assert log.older.read_text() == "0123456789"
    assert log.path.read_text() == "the end"


def test_a_place_that_cannot_be_written_is_one_error(tmp_path: Path) -> None:
    (tmp_path / "logs").write_text("a file where the folder should be")
    with (
        PrintLog(tmp_path / "logs" / "reward.log") as log,
        pytest.raises(RunError, match=r"reward\.log cannot be written"),
    ):
        log.write("x")
