"""Logs of our own making: a drive of the simulator, written in every form, must come back without a difference."""

from __future__ import annotations

import csv
import gzip
import json
import math
from pathlib import Path

import numpy as np
import pytest
from own_drives import AT, OVAL, drive, write

from racecraft.agent import action_space
from racecraft.cli.text import say_calibrated, say_replayed
from racecraft.errors import ConfigError, RunError
from racecraft.fidelity import calibrate, draw_comparison, read_logs, replay
from racecraft.fidelity.dynamics import clock_of, step_durations
from racecraft.fidelity.logs import Faults
from racecraft.race.artifacts import write_simtrace
from racecraft.race.evaluation import evaluate
from racecraft.run.simtrace import COLUMNS
from racecraft.sim import STATUS_NAMES, Vehicle
from racecraft.sim.logged import LogJudge, drive_windows

STAMPED = 15  # columns up to tstamp


def test_angles_of_2019_are_in_radians(lines, tmp_path):
    yaw, steer = COLUMNS.index("yaw"), COLUMNS.index("steer")
    in_radians = [
        [repr(math.radians(float(text))) if place in (yaw, steer) else text for place, text in enumerate(fields)]
        for fields in lines
    ]
    for columns in (15, 17):  # younger logs never are
        (log,) = read_logs([write(tmp_path / "a.log", in_radians, columns=columns, form="log")], Faults())
        (told,) = read_logs([write(tmp_path / "b.log", lines, columns=columns, form="log")], Faults())
        for name in ("heading", "steering_angle"):
            assert np.allclose(getattr(log, name), getattr(told, name), atol=1e-9) == (columns == 15)


@pytest.mark.parametrize("columns", [15, 16, 17, 18, 19])
@pytest.mark.parametrize(("form", "name"), [("csv", "a.csv"), ("bare", "a.csv"), ("log", "a.log"), ("csv", "a.csv.gz")])
def test_our_own_drive_comes_back_in_every_form(lines, tmp_path, columns, form, name):
    found = replay(write(tmp_path / name, lines, columns=columns, form=form), track="oval").to_dict()
    assert found["rows"] == len(lines)
    assert found["broken_rows"] == 0
    assert found["progress_agreement"] == found["closest_waypoint_agreement"] == found["episode_end_agreement"] == 1.0
    assert found["all_wheels_agreement"] > 0.999  # single precision at a border
    assert found["position_error_m"]["15"] < 0.02  # what remains: six rows do not tell the start exactly


def test_what_a_paused_car_does_counts_as_no_step_back():
    falls = [5.0 - 0.02 * row for row in range(31)]
    places = OVAL.point_at(np.array(falls))
    poses = np.column_stack([places, OVAL.heading_at(np.array(falls))])
    is_paused = np.arange(31) == 15  # put back, after fourteen steps back
    rows = LogJudge(OVAL)(
        poses=poses,
        commands=np.tile([0.0, 1.0], (31, 1)),
        progress=np.zeros(31),
        is_first=np.arange(31) == 0,
        is_paused=is_paused,
    )
    told = [STATUS_NAMES[int(row[AT["status"]])] for row in rows]
    assert told == ["prepare", *["in_progress"] * 14, "pause", *["in_progress"] * 14, "reversed"]


@pytest.mark.parametrize("heading", [0.0, math.pi / 2, -2.0])
def test_a_car_that_slides_at_first_slides_on(heading):
    across = np.array([-math.sin(heading), math.cos(heading)])  # to its left
    for way in (0.1, -0.1):
        poses = np.column_stack([np.arange(3)[:, None] * way * across, np.full(3, heading)])
        ((end,),) = drive_windows(
            Vehicle().values(),
            poses=poses,
            commands=np.zeros((3, 2), np.float32),
            durations=np.full(3, 1 / 15, np.float32),
            first=np.array([0]),
            known=2,
            free=1,
        )
        assert 1.4 * abs(way) < np.sign(way) * (end[:2] @ across) < 2.0 * abs(way)


def test_the_direction_is_found(tmp_path):
    result = replay(write(tmp_path / "a.csv", drive(episodes=3, direction="reverse")), track="oval")
    assert result.reversed
    assert result.to_dict()["progress_agreement"] == 1.0


def test_rewards(lines, tmp_path):
    path = write(tmp_path / "a.csv", lines)
    right, wrong = ("def reward_function(params):\n    return params['speed']" + tail for tail in ("\n", " + 1\n"))
    assert replay(path, track="oval", reward=right).to_dict()["reward_agreement"] == 1.0
    result = replay(path, track="oval", reward=wrong)
    assert result.to_dict()["reward_agreement"] == 0.0
    assert str(result.differences.kept[0]).startswith("a.csv, line 3: reward 1.76152933, here 2.761529")


@pytest.mark.costly
def test_another_cars_drive_is_told_apart_and_calibrated(tmp_path):
    path = write(tmp_path / "a.csv", drive(episodes=40, vehicle="v6"))
    assert replay(path, track="oval", vehicle="v5").to_dict()["position_error_m"]["15"] > 0.05
    result = calibrate(path, vehicle="v5", track="oval")
    fitted, preset = (np.median(errors[:, -1, 0]) for errors in (result.errors, result.preset_errors))
    assert fitted < 0.25 * preset
    result.vehicle.save(tmp_path / "car.json")
    assert replay(path, track="oval", vehicle=str(tmp_path / "car.json")).to_dict()["position_error_m"]["15"] < 0.05


def test_a_car_that_is_moved_by_hand_starts_anew(tmp_path, lines, capfd):
    def whole(number: str) -> list[list[str]]:
        return [[*fields] for fields in lines if fields[0] == number]

    moved, jumps = [], 0
    for number in sorted({fields[0] for fields in lines}, key=int):
        rows = whole(number)
        if len(rows) > 90:
            rows, jumps = rows[:40] + rows[60:], jumps + 1  # 20 rows that nobody drove
            for step, fields in enumerate(rows[40:], start=41):
                fields[1], fields[14] = repr(float(step)), repr(float(rows[39][14]) + (step - 40) / 15)
        moved += rows
    assert jumps > 5
    path = write(tmp_path / "moved.csv", moved)
    found = replay(path, track="oval")
    assert (found.moved, found.to_dict()["moved_by_hand"]) == (jumps, jumps)
    assert found.to_dict()["progress_agreement"] == 1.0
    assert found.errors[:, :, 0].max() < 0.3, "no window reaches across a jump, of a metre"
    say_replayed(found, None)
    assert f"The car was moved by hand {jumps} times" in capfd.readouterr().out
    fitted = calibrate(path, iterations=1)
    assert fitted.to_dict()["moved_by_hand"] == jumps
    say_calibrated(fitted, tmp_path / "car.json")
    assert f"The car was moved by hand {jumps} times" in capfd.readouterr().out
    assert replay(write(tmp_path / "driven.csv", lines), track="oval").moved == 0


def test_time_stamps_of_the_next_row_are_recognised(tmp_path, lines):
    def clock(offset: int) -> str:
        rng, told = np.random.default_rng(0), [list(fields) for fields in lines]
        moved = [float(fields[2]) for fields in told], [float(fields[3]) for fields in told]
        # The car of the log moved 1/15 s between rows; pretend that its speed was even and time was not.
        distance = np.hypot(*(np.diff(values, append=values[-1]) for values in moved))
        passed = np.where(distance > 0, distance, 1 / 15)
        passed = 1 / 15 * passed / np.convolve(passed, np.ones(11) / 11, mode="same") + rng.normal(0, 1e-4, len(told))
        stamps = np.cumsum(np.roll(passed, offset))
        for fields, stamp in zip(told, stamps, strict=True):
            fields[14] = repr(float(stamp))
        (log,) = read_logs([write(tmp_path / f"{offset}.csv", told)], Faults())
        lasts = step_durations(log, "late")
        assert np.isnan(lasts[log.is_first]).all()
        return clock_of([log])

    assert clock(0) == "late"
    assert clock(1) == "prompt"


@pytest.mark.parametrize("words", [("TRUE", "FALSE"), ("true", "false"), ("1", "0"), ("1.0", "0.0")])
def test_a_yes_is_one_however_a_tool_saved_it(lines, tmp_path, words):
    truths = dict(zip(("True", "False"), words, strict=True))
    saved = [[truths.get(field, field) for field in fields] for fields in lines]
    found = replay(write(tmp_path / "a.csv", saved), track="oval").to_dict()
    assert (found["rows"], found["broken_rows"]) == (len(lines), 0)
    assert found["all_wheels_agreement"] > 0.999
    assert found["episode_end_agreement"] == 1.0


def test_a_yes_or_no_that_is_neither_breaks_its_row(lines, tmp_path):
    odd = [list(fields) for fields in lines]
    odd[10][10], odd[20][9] = "maybe", ""
    result = replay(write(tmp_path / "a.csv", odd), track="oval")
    assert result.faults.notes == [
        "a.csv, line 12: all_wheels_on_track is 'maybe', neither True nor False",
        "a.csv, line 22: done is '', neither True nor False",
    ]


def test_quotes_round_every_field_are_none_of_it(lines, tmp_path):
    discrete = [[*fields[:7], "3", *fields[8:]] for fields in lines]
    quoted = [[f'"{field}"' for field in fields] for fields in discrete]
    found = replay(write(tmp_path / "a.csv", quoted), track="oval").to_dict()
    assert (found["rows"], found["broken_rows"]) == (len(lines), 0)


def test_broken_rows_are_counted_and_named(lines, tmp_path):
    broken = [list(fields) for fields in lines]
    broken[10][2], broken[20][3], broken[30] = "nan", "far", broken[30][:7]
    result = replay(write(tmp_path / "a.csv", broken), track="oval")
    assert result.to_dict()["broken_rows"] == 3
    assert result.to_dict()["rows"] == len(lines) - 3
    assert {note.split(":")[0] for note in result.faults.notes} == {f"a.csv, line {line}" for line in (12, 22, 32)}
    assert result.to_dict()["progress_agreement"] > 0.99


def test_every_row_that_differs_is_listed_with_both_values(lines, tmp_path):
    wrong = [list(fields) for fields in lines]
    wrong[4][11] = "55.5"  # progress
    wrong[5][10] = str(wrong[5][10] == "False")  # wheels
    wrong[6][12] = "999"  # waypoint
    last = next(row for row in range(7, len(wrong)) if wrong[row][9] == "True")
    wrong[last][15] = "reversed"
    path = write(tmp_path / "a.csv", wrong)
    result = replay(path, track="oval", rows=tmp_path / "out" / "rows.csv")
    with (tmp_path / "out" / "rows.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    found = {(row["what"], int(row["line"])): row for row in rows}
    assert found["progress", 6]["logged"] == "55.5"
    assert float(found["progress", 6]["here"]) == pytest.approx(float(lines[4][11]))
    assert found["all_wheels_on_track", 7]["logged"] == wrong[5][10]
    assert "mm inside the border" in found["all_wheels_on_track", 7]["why"]
    assert found["closest_waypoint", 8]["logged"] == "999"
    assert found["closest_waypoint", 8]["here"] == lines[6][12]
    end = found["episode_end", last + 2]
    assert (end["logged"], end["here"], end["step"]) == ("reversed", lines[last][15], str(int(float(lines[last][1]))))
    assert len(rows) == sum(result.differences.counts.values())
    assert [str(row["line"]) for row in result.to_dict()["differences"]] == [row["line"] for row in rows]
    with pytest.raises(RunError, match="cannot be written"):
        replay(path, track="oval", rows=tmp_path)


def test_each_episode_finds_its_own_direction(lines, tmp_path):
    back = drive(episodes=4, direction="reverse")
    both = lines + [[str(100 + int(fields[0])), *fields[1:]] for fields in back]
    result = replay(write(tmp_path / "a.csv", both), track="oval")
    found = result.to_dict()
    assert found["progress_agreement"] == found["closest_waypoint_agreement"] == 1.0
    assert result.rules.reversed == len(back)
    assert not result.reversed


def test_an_evaluation_of_ours_with_resets_and_flying_laps(tmp_path):
    def swerves(state):
        """Drives well, but runs off every now and then."""
        steer = -0.5 * state[:, 4] - 1.2 * state[:, 5] + 0.2 * state[:, 9]
        swerves.calls += 1
        if swerves.calls % 90 > 70:
            steer = np.full(len(state), 0.5)
        return np.stack([steer, np.full(len(state), 2.0)], axis=1).astype(np.float32)

    swerves.calls = 0
    space = action_space("continuous")
    evaluation = evaluate(swerves, OVAL, num_trials=2, sees="state")
    assert evaluation.summary()["resets"] > 2
    write_simtrace(evaluation, tmp_path, action_space=space)
    result = replay(tmp_path / "0-iteration.csv", track="oval")
    found = result.to_dict()
    assert found["progress_agreement"] == found["closest_waypoint_agreement"] == 1.0
    assert found["episodes"] == evaluation.laps_begun
    assert found["episode_end_agreement"] == 1.0
    assert found["broken_rows"] == 0
    assert found["windows"] > 20
    assert found["position_error_p90_m"]["15"] < 0.05  # of driving: where it stands for a penalty is left out


@pytest.mark.costly
def test_logs_as_they_come_out_of_other_tools(lines, tmp_path):
    rows = [",".join(fields) for fields in lines]
    names = ["episode", "steps", "x", "y", "yaw", "steering_angle", "speed", *COLUMNS[7:10], "on_track", *COLUMNS[11:]]
    tables = {
        "json.log": [json.dumps({"message": f"SIM_TRACE_LOG:{row}\n"}) for row in rows],
        "tabs.log": [f"[agent-9] SIM_TRACE_LOG:{row}\t2026-01-01" for row in rows],
        "utils.csv": [",".join(names), *rows],
        "index.csv": ["," + ",".join(COLUMNS), *(f"{i},{row}" for i, row in enumerate(rows))],
        "turned.csv": [",".join(reversed(COLUMNS)), *(",".join(reversed(fields)) for fields in lines)],
        "prints.log": [
            text for row in rows for text in ("{'episode': 1, 'steps': 2}", "SIM_TRACE_LOG:" + row, "9" * 50_000)
        ],
    }
    for name, texts in tables.items():
        (tmp_path / name).write_text("\r\n".join(texts) + "\r\n")
    events = [{"timestamp": 1, "message": f"SIM_TRACE_LOG:{row}\n"} for row in rows]
    tables["line.json"] = [json.dumps({"nextToken": "9" * 12_345, "events": events})]
    tables["glued.log"] = ["SIM_TRACE_LOG:" + "SIM_TRACE_LOG:".join(rows)]
    for name in ("line.json", "glued.log"):
        (tmp_path / name).write_text(tables[name][0])
    (tmp_path / "utf16.csv").write_text("\n".join([",".join(COLUMNS), *rows]), encoding="utf-16")
    for name in (*tables, "utf16.csv"):
        found = replay(tmp_path / name, track="oval").to_dict()
        assert (name, found["rows"], found["broken_rows"]) == (name, len(lines), 0)
        assert found["progress_agreement"] == 1.0


def test_picture(lines, tmp_path):
    from PIL import Image

    result = replay(write(tmp_path / "a.csv", lines), track="oval")
    with Image.open(draw_comparison(result, tmp_path / "pictures" / "a.png")) as picture:
        assert picture.size == (1600, 884)
        assert len(picture.getcolors(1 << 20)) > 100
    with pytest.raises(ConfigError, match=r"ends in '\.txt'"):
        draw_comparison(result, tmp_path / "a.txt")
    with pytest.warns(UserWarning, match="Motion is not compared"):
        short = replay(write(tmp_path / "b.csv", lines[:10]), track="oval")
    with pytest.raises(ConfigError, match="nothing to draw"):
        draw_comparison(short, tmp_path / "b.png")


@pytest.mark.costly
def test_the_verbs(lines, tmp_path, monkeypatch):
    from typer.testing import CliRunner

    from racecraft.cli.entry import every_verb

    monkeypatch.chdir(tmp_path)
    path = str(write(tmp_path / "a.csv", lines))
    done = CliRunner().invoke(every_verb(), ["replay", path, "--track", "oval", "--json"])
    assert done.exit_code == 0
    assert json.loads(done.stdout)["rows"] == len(lines)
    assert not (tmp_path / "replay.png").exists()
    done = CliRunner().invoke(every_verb(), ["replay", path, "--track", "oval"])
    assert done.exit_code == 0
    assert "progress" in done.stdout
    assert (tmp_path / "replay.png").exists()
    brief = str(write(tmp_path / "brief.csv", lines[:15]))
    asked = ["replay", brief, "--track", "oval", "--picture", "asked.png"]
    with pytest.warns(UserWarning, match="Motion is not compared"):
        done = CliRunner().invoke(every_verb(), asked)
    assert "progress" in done.stdout  # what was found is told, though there is nothing to draw
    assert done.exit_code != 0
    assert not (tmp_path / "asked.png").exists()
    done = CliRunner().invoke(every_verb(), ["calibrate", path, "--track", "oval", "--output", "my cars/car.json"])
    assert done.exit_code == 0
    assert "car.json" in done.stdout
    assert json.loads((tmp_path / "my cars" / "car.json").read_text())["mass"] == 7.5


def test_episodes_are_handed_on_whole(lines, tmp_path, monkeypatch):
    monkeypatch.setattr("racecraft.fidelity.logs.BATCH_ROWS", 100)
    logs = list(read_logs([write(tmp_path / "a.csv", lines)], Faults()))
    assert len(logs) > 3
    assert sum(len(log) for log in logs) == len(lines)
    assert all(log.is_first[0] and log.is_prepare[0] for log in logs)
    episodes = [set(log.episode.tolist()) for log in logs]
    assert sum(map(len, episodes)) == len(set.union(*episodes)) == 25


@pytest.mark.costly
def test_a_long_log_does_not_fill_the_memory(lines, tmp_path):
    # From /proc, not getrusage: that one starts a process at the peak of the parent it was forked from.
    if not Path("/proc/self/status").exists():
        pytest.skip("the peak memory of a process is read from /proc")
    import subprocess
    import sys

    text = "".join(",".join(fields) + "\n" for fields in lines).encode()
    repeats = [count // len(lines) for count in (100_000, 400_000)]
    for name, repeat in zip(("short", "long"), repeats, strict=True):
        with gzip.open(tmp_path / f"{name}.csv.gz", "wb", compresslevel=1) as file:
            file.write(",".join(COLUMNS).encode() + b"\n")
            for _ in range(repeat):
                file.write(text)
    code = (
        "from racecraft.fidelity import replay\n"
        "for name in ('short', 'long'):\n"
        f"    print(replay({str(tmp_path)!r} + f'/{{name}}.csv.gz', track='oval').rules.rows)\n"
        "    print(next(line for line in open('/proc/self/status') if line.startswith('VmHWM')).split()[1])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    short, before, long, after = map(int, done.stdout.split())
    assert [short, long] == [repeat * len(lines) for repeat in repeats]
    assert after < 250_000  # kB
    assert after - before < 30_000  # 300,000 rows are 40 MB of text; 24 bytes of each are kept, for the percentiles
