"""Laps, corners and maps of traces made by hand, where everything is known."""

from __future__ import annotations

import csv
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecraft.agent import ContinuousActionSpace
from racecraft.analysis import (
    TracedLap,
    draw_maps,
    driven_direction,
    in_one,
    iterations_of,
    passages,
    read_laps,
    sectors_of,
    start_place,
)
from racecraft.errors import RunError
from racecraft.race.artifacts import write_simtrace
from racecraft.race.autopilot import Autopilot
from racecraft.race.evaluation import evaluate
from racecraft.race.rules import RaceRules
from racecraft.run.simtrace import WRITTEN
from racecraft.track import Track, load_track

DT = 1 / 15


def write_trace(path: Path, track: Track, laps: list[tuple[float, str, float]]) -> None:
    """Laps at a constant speed on the centre line: speed in m/s, status at the end, share driven."""
    path.parent.mkdir(parents=True, exist_ok=True)
    clock = 0.0
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(WRITTEN)
        for number, (speed, status, share) in enumerate(laps):
            steps = round(share * track.length / speed / DT)
            for step in range(steps + 1):
                place = min(step * speed * DT, track.length)
                x, y = track.point_at(place).tolist()
                yaw = float(np.degrees(track.heading_at(place)))
                ended = step == steps
                row: list[Any] = [number, step + 1.0, x, y, yaw, 15.0, speed, step % 2, speed, ended, True]
                done = 100 if ended and share == 1 else min(100 * place / track.length, 100)
                row += [done, 0, track.length, round(clock, 3), status if ended else "in_progress", 0, 0]
                writer.writerow(row)
                clock += DT


@pytest.fixture(scope="module")
def oval() -> Track:
    return load_track("oval")


def test_laps_are_read_back(tmp_path: Path, oval: Track) -> None:
    path = tmp_path / "0-iteration.csv"
    write_trace(path, oval, [(2.0, "lap_complete", 1.0), (1.0, "off_track", 0.4)])
    whole, part = read_laps(path)
    assert (whole.number, whole.is_complete, part.is_complete) == (1, True, False)
    assert (len(whole.time), whole.time[0], whole.share[0]) == (round(oval.length / 2.0 / DT) + 1, 0.0, 0.0)
    assert (whole.penalty_seconds, part.penalty_seconds) == (0.0, 0.0)
    assert whole.seconds == pytest.approx(oval.length / 2.0, abs=2 * DT)
    assert whole.seconds == pytest.approx(len(whole.time) * DT, abs=1e-9)  # though the file's times are rounded to ms
    assert part.seconds == pytest.approx(len(part.time) * DT, abs=1e-9)
    assert np.median(whole.speed) == pytest.approx(2.0, rel=0.02)
    assert part.share[-1] == pytest.approx(0.4, abs=0.01)
    assert whole.time_at(np.array([0.5]))[0] == pytest.approx(oval.length / 4.0, abs=0.1)
    assert start_place(oval, whole) == pytest.approx(0.0, abs=0.01)
    assert driven_direction(oval, [whole.points, part.points]) is oval
    backwards = driven_direction(oval.reversed(), [whole.points])
    assert backwards.point_at(1.0) == pytest.approx(oval.point_at(1.0), abs=0.05)


def test_a_lap_that_flows_into_the_next_is_whole_in_the_originals_words(tmp_path: Path, oval: Track) -> None:
    path = tmp_path / "0-iteration.csv"
    write_trace(path, oval, [(2.0, "in_progress", 1.0), (2.0, "lap_complete", 1.0), (1.0, "in_progress", 0.4)])
    assert [lap.is_complete for lap in read_laps(path)] == [True, True, False]
    rows = [line.split(",") for line in path.read_text().splitlines()]
    path.write_text("".join(",".join(row[:15]) + "\n" for row in rows))  # as in 2019, without a status
    assert [lap.is_complete for lap in read_laps(path)] == [True, True, False]


def test_an_old_picture_was_taken_on_the_way_to_where_the_car_is(tmp_path: Path, oval: Track) -> None:
    path = tmp_path / "0-iteration.csv"
    write_trace(path, oval, [(2.0, "lap_complete", 1.0)])
    (lap,) = read_laps(path)
    now, then = lap.seen_from(0.0), lap.seen_from(DT / 2)
    ahead = 0.14 * np.column_stack([np.cos(lap.heading), np.sin(lap.heading)])
    assert now[:, :2] == pytest.approx(lap.points - ahead)
    assert (now[:, 2] == lap.heading).all()
    assert (then[0] == now[0]).all()  # nothing is known of before
    assert then[1:, :2] == pytest.approx((now[1:, :2] + now[:-1, :2]) / 2)
    put = replace(lap, puts=(7,)).seen_from(DT / 2)
    assert (put[7] == now[7]).all()
    assert (np.delete(put, 7, axis=0) == np.delete(then, 7, axis=0)).all()


def test_steps_that_a_car_stands_are_its_penalty(tmp_path: Path, oval: Track) -> None:
    path = tmp_path / "0-iteration.csv"
    write_trace(path, oval, [(2.0, "lap_complete", 1.0)])
    lines = path.read_text().splitlines()
    path.write_text(
        "\n".join([*lines[:10], *(line.replace("in_progress", "pause") for line in lines[10:40]), *lines[40:]])
    )
    (lap,) = read_laps(path)
    assert lap.penalty_seconds == pytest.approx(2.0)


def test_laps_that_follow_each_other_without_a_stop_are_one_drive(tmp_path: Path) -> None:
    def laps(**rules: Any) -> list[TracedLap]:
        given = RaceRules(laps=2, **rules)
        driven = evaluate(Autopilot(speed=2.0), load_track("oval"), rules=given, num_trials=2, sees="state")
        write_simtrace(driven, tmp_path, action_space=ContinuousActionSpace(low=(-0.5, 0.1), high=(0.5, 4.0)))
        return read_laps(tmp_path / "0-iteration.csv")

    assert [lap.goes_on for lap in laps(is_continuous=False)] == [False] * 4
    both = laps()
    assert [lap.goes_on for lap in both] == [False, True, False, True]
    drive, half = in_one(both[2:]), len(both[2].time)
    assert (drive.number, len(drive.time), drive.puts) == (4, half + len(both[3].time), ())
    assert drive.seconds == pytest.approx(both[2].seconds + both[3].seconds)
    assert (drive.seen_from(0.0)[half:] == both[3].seen_from(0.0)).all()
    before, then, now = (drive.seen_from(age)[half - at] for age, at in ((0.0, 1), (DT / 2, 0), (0.0, 0)))
    assert then == pytest.approx((before + now) / 2), "where the lap before ended is known"
    told = both[2].steering_angle[-1], both[2].throttle[-1]
    assert drive.commands[half] == pytest.approx(told)
    put = in_one([replace(both[2], puts=(7,)), replace(both[3], puts=(9,))])
    assert put.puts == (7, half + 9)


@pytest.mark.parametrize("name", ["oval", "reinvent_2018", "hairpin"])
def test_sectors_are_the_whole_lap_and_their_times_add_up(tmp_path: Path, name: str) -> None:
    track = load_track(name)
    sectors = sectors_of(track)
    assert sum(sector.end - sector.start for sector in sectors) == pytest.approx(track.length)
    for before, after in pairwise(sectors):
        assert before.end == pytest.approx(after.start)
    write_trace(tmp_path / "t.csv", track, [(1.5, "lap_complete", 1.0), (1.5, "off_track", 0.5)])
    whole, part = read_laps(tmp_path / "t.csv")
    found = passages(track, whole, sectors)
    assert all(passage is not None for passage in found)
    assert sum(p.seconds for p in found if p is not None) == pytest.approx(whole.seconds, abs=1e-9)
    for passage, sector in zip(found, sectors, strict=True):
        assert passage is not None
        assert passage.seconds == pytest.approx((sector.end - sector.start) / 1.5, abs=0.15)
        assert passage.slowest <= min(passage.entry_speed, passage.exit_speed)
    assert any(passage is None for passage in passages(track, part, sectors))


def test_maps_count_where_cars_were(tmp_path: Path, oval: Track) -> None:
    write_trace(tmp_path / "0-iteration.csv", oval, [(2.0, "lap_complete", 1.0), (1.0, "off_track", 0.4)])
    (tmp_path / "1-iteration.csv").write_text("damaged\n")
    (tmp_path / "x-iteration.csv").write_text("")
    assert iterations_of(tmp_path) == [0, 1]
    assert iterations_of(tmp_path / "nothing") == []
    maps = draw_maps(oval, tmp_path, [0, 1])
    assert maps.visits.sum() == maps.rows
    assert maps.episodes == 2
    assert maps.usage == pytest.approx([0.5, 0.5], abs=0.02)
    assert maps.exits.shape == (1, 2)
    assert maps.exits[0] == pytest.approx(oval.point_at(0.4 * oval.length), abs=0.1)
    middle = slice(4, 6)
    assert maps.visits[:, middle].sum() == maps.rows  # all of it beside the centre line
    half = len(maps.visits) // 2
    assert np.nanmean(maps.reward[half + 4 :]) == pytest.approx(2.0)
    assert np.nanmean(maps.reward[1 : half // 2]) == pytest.approx(
        1.33, abs=0.1
    )  # twice as many steps at half the pace
    assert np.nanmean(maps.steering_angle) == pytest.approx(np.radians(15))
    assert maps.grid.shape == (len(maps.visits) + 1, maps.visits.shape[1] + 1, 2)
    assert not draw_maps(oval, tmp_path, []).rows


def test_an_action_that_nobody_has_takes_no_memory(tmp_path: Path, oval: Track) -> None:
    """A table of every number up to that of a stranger's trace would fill it."""
    write_trace(tmp_path / "0-iteration.csv", oval, [(2.0, "lap_complete", 1.0)])
    path = tmp_path / "0-iteration.csv"
    header, *rows = path.read_text().splitlines()
    fields = [row.split(",") for row in rows]
    for row in fields[len(fields) // 2 :]:
        row[7] = "70000"
    path.write_text("\n".join([header, *map(",".join, fields)]) + "\n")
    maps = draw_maps(oval, tmp_path, [0])
    assert maps.rows
    assert len(maps.usage) < 10
    assert maps.usage.sum() == pytest.approx(1.0)


def test_what_is_no_trace_is_told(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("a,b\n1,2\n")
    with pytest.raises(RunError):
        read_laps(tmp_path / "t.csv")


def test_a_car_put_back_after_a_mistake_did_not_drive_there(tmp_path: Path, oval: Track) -> None:
    """It leaves the road to the side at 1 m/s, is put back half a metre away, and stands for its penalty."""
    path = tmp_path / "0-iteration.csv"
    write_trace(path, oval, [(1.0, "off_track", 0.4)])
    lines = path.read_text().splitlines()
    head, rows = lines[0].split(","), [line.split(",") for line in lines[1:]]
    y, status, time = (head.index(name) for name in ("Y", "episode_status", "tstamp"))
    put = 40
    for row in rows[put:]:
        row[y] = str(float(row[y]) + 0.5)
    rows[put][status] = "pause"
    rows[put:put] = [list(rows[put]) for _ in range(5)]
    for step, row in enumerate(rows):
        row[time] = f"{step * DT:.3f}"
    path.write_text("\n".join([lines[0], *(",".join(row) for row in rows)]) + "\n")
    (lap,) = read_laps(path)
    assert lap.puts == (put,)
    assert lap.speed[put - 1] == pytest.approx(1.0, abs=0.1)
    assert lap.speed[put] == 0.0
    assert lap.speed.max() < 3.0  # the half metre in one step would be 7.5 m/s
    done = np.isfinite(lap.commands).all(axis=1)
    assert np.flatnonzero(~done).tolist() == [0, *range(put, put + 7)]  # nor did it do what it was told as it stood
    np.testing.assert_allclose(lap.commands[done], np.broadcast_to([np.radians(15), 1.0], (done.sum(), 2)), atol=1e-6)
