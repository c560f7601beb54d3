"""Logs that cannot be replayed or calibrated with: what is wrong is told in a sentence."""

from __future__ import annotations

import pytest
from own_drives import OVAL, write

from racecraft.errors import ConfigError, RunError
from racecraft.fidelity import calibrate, replay
from racecraft.run.simtrace import COLUMNS


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "holds no sim-trace"),
        ("hello\nworld\n" * 100, "holds no sim-trace"),
        ("\x00\xff" * 1000, "holds no sim-trace"),
        ("episode,steps,X\n0,1,2\n", "lacks the column 'Y'"),
        ("SIM_TRACE_LOG:1,2,3\n", "1 broken rows and 0 good"),
        ("x" * 3_000_000, "holds no sim-trace"),
    ],
)
def test_what_is_no_log_says_so(text, message, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(text, encoding="latin-1")
    with pytest.raises(RunError, match=message):
        replay(path, track="oval")


@pytest.mark.parametrize("separator", [(";", "semicolons"), ("\t", "tabs")])
@pytest.mark.parametrize("has_header", [True, False])
def test_a_table_that_a_spreadsheet_separated_otherwise_is_told_so(separator, has_header, tmp_path, lines):
    path = tmp_path / "a.csv"
    mark, name = separator
    table = [list(COLUMNS)] * has_header + [[field.replace(".", ",") for field in fields] for fields in lines]
    path.write_text("\n".join(mark.join(fields) for fields in table))
    with pytest.raises(RunError, match=rf"^a\.csv has {name} between its columns; a sim-trace has commas") as caught:
        replay(path, track="oval")
    assert "as it was logged" in caught.value.hint


def test_files_that_cannot_be_read(tmp_path, lines):
    with pytest.raises(RunError, match="cannot be read"):
        replay(tmp_path / "none.csv", track="oval")
    with pytest.raises(RunError, match="is a folder; logs are files") as error:
        replay(tmp_path, track="oval")
    assert error.value.hint == f"Name those in it: {tmp_path}/*.csv"
    whole = write(tmp_path / "a.csv.gz", lines).read_bytes()
    (tmp_path / "half.csv.gz").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(RunError, match=r"half\.csv\.gz cannot be read"):
        replay(tmp_path / "half.csv.gz", track="oval")


def test_another_track_is_refused(lines, tmp_path):
    path = write(tmp_path / "a.csv", lines)
    with pytest.raises(RunError, match="was driven on a track of"):
        replay(path, track="bowtie")
    with pytest.raises(RunError, match="was driven on a track of"):
        calibrate(path, track="bowtie")
    moved = [[*fields[:2], str(float(fields[2]) + 0.4), *fields[3:]] for fields in lines]
    with pytest.raises(RunError, match=r"was not driven on oval: \d+ % of the first .* 0.5 m off"):
        replay(write(tmp_path / "b.csv", moved), track="oval")


def test_logs_of_one_name_are_told_apart(lines, tmp_path):
    for folder, length in (("0", None), ("1", "60.0")):  # workers write files of the same names
        (tmp_path / folder).mkdir()
        told = [[*fields[:13], length or fields[13], *fields[14:]] for fields in lines]
        write(tmp_path / folder / "0-iteration.csv", told)
    paths = [tmp_path / folder / "0-iteration.csv" for folder in ("0", "1")]
    with pytest.raises(RunError, match=r"[/\\]1[/\\]0-iteration\.csv was driven on a track of 60\.00 m"):
        replay(paths, track="oval")


def test_too_little_to_calibrate(lines, tmp_path):
    with pytest.raises(RunError, match="windows of 21 rows"):
        calibrate(write(tmp_path / "a.csv", lines[:40]))
    with pytest.raises(ConfigError, match="held_out"):
        calibrate(write(tmp_path / "a.csv", lines), held_out=1.0)


def test_a_log_in_which_two_workers_write_by_turns_says_so(lines, tmp_path):
    both = [["7", *line[1:]] for line in lines]
    path = write(tmp_path / "both.log", [row for pair in zip(lines, both, strict=True) for row in pair], form="log")
    with pytest.warns(UserWarning, match=r"^Motion is not compared: .* 21 rows .* as a file of its own\.$"):
        result = replay(path, track=OVAL)
    assert (result.to_dict()["windows"], result.rules.rows) == (0, 2 * len(lines))
    with pytest.raises(RunError) as caught:
        calibrate(path)
    assert "as a file of its own" in caught.value.hint
