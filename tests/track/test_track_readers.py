from __future__ import annotations

import csv
import io
import os
import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from round_tracks import ring, track_of

from racecraft.errors import RacecraftError, TrackError, TrackNotFound
from racecraft.track import draw_contact_sheet, load_track, read_centerline_csv, read_route, save_route, track_names


def test_every_aws_route_loads_and_agrees_with_the_table(routes: Path) -> None:
    with (routes / "tracks.csv").open(newline="") as file:
        table = {row["name"]: row for row in csv.DictReader(file)}
    paths = sorted(routes.glob("*.npy"))
    assert len(paths) == 127
    for path in paths:
        track, row = load_track(path), table[path.stem]
        assert track.name == path.stem
        assert track.length == pytest.approx(float(row["length_m"]), rel=0.01)
        rows = np.hypot(*(track.inner - track.outer).T)  # the table's width; of nine routes they are slanted
        assert rows.mean() == pytest.approx(float(row["mean_width_m"]), rel=0.01)
        assert 0.6 < track.mean_width < 1.01 * rows.mean()
        assert track.is_closed == (row["closed"] == "True")
        assert len(track.centerline) == int(row["points"]) - int(row["dup_points"])
        if track.is_closed:
            assert (track.direction == "clockwise") == (row["direction"] == "CW")
            assert track.inner_is_left == (row["direction"] == "CCW")


@pytest.mark.slow
def test_every_aws_route_can_be_drawn(routes: Path, tmp_path: Path) -> None:
    tracks = [load_track(path) for path in sorted(routes.glob("*.npy"))]
    draw_contact_sheet(tracks, tmp_path / "all.png", columns=12, width_px=2400)


@pytest.mark.parametrize("name", track_names())
def test_a_saved_route_comes_back_bit_for_bit(name: str, tmp_path: Path) -> None:
    track = load_track(name)
    path = save_route(track, tmp_path / f"{name}.npy")
    again = load_track(path)
    assert again.digest == track.digest
    assert again.name == name
    assert np.load(path, allow_pickle=False).shape == (len(track.centerline), 6)
    assert (again.direction, again.is_closed) == (track.direction, track.is_closed)


def test_routes_are_saved_as_npy_only(tmp_path: Path) -> None:
    with pytest.raises(TrackError, match=r"does not end in \.npy"):
        save_route(load_track("oval"), tmp_path / "oval.csv")


@pytest.mark.parametrize("dtype", ["<f8", ">f8", "<f4"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_any_float_layout(write, dtype: str, order: str) -> None:
    track = read_route(write(np.asarray(ring(), dtype=dtype, order=order)))
    assert track.length == pytest.approx(track_of(ring()).length, rel=1e-6)


class Evil:
    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.system, ("touch /tmp/racecraft_was_here",)


def header(text: str) -> bytes:
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode("latin1")


GOOD = "{'descr': '<f8', 'fortran_order': False, 'shape': (100, 6), }\n"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "not a readable"),
        (b"hello", "not a readable"),
        (b"\x93NUMPY", "not a readable"),
        (b"\x93NUMPY\x09\x00" + b"x" * 100, "not a readable"),
        (pickle.dumps(Evil()), "not a readable"),
        (b"PK\x03\x04" + b"\0" * 100, "not a readable"),
        (header("(" * 900), "not a readable"),
        (header("{'descr': '<f8'}"), "not a readable"),
        (header("__import__('os').system('true')"), "not a readable"),
        (header(GOOD.replace("(100, 6)", "(10**9, 6)")), "not a readable"),
        (header(GOOD.replace("(100, 6)", "(999999999999, 6)")), "claims"),
        (header(GOOD.replace("(100, 6)", "(-100, 6)")), "claims|readable"),
        (header(GOOD.replace("(100, 6)", "(100, -6)")), "shape"),
        (header(GOOD.replace("<f8", "|O")), "float64"),
        (header(GOOD.replace("'<f8'", "[('a', '<f8')]")), "float64"),
        (header(GOOD.replace("<f8", "<U9")), "float64"),
        (header(GOOD), "damaged"),
        (header(GOOD) + b"\0" * 4799, "damaged"),
        (header(GOOD) + b"\0" * 4801, "damaged"),
        (b"\x93NUMPY\x02\x00\xff\xff\xff\xff" + b"x" * 100, "not a readable"),
        (b"\0" * 3_000_000, "3,000,000 bytes"),
    ],
)
def test_hostile_npy(write, content: bytes, words: str) -> None:
    with pytest.raises(TrackError, match=words):
        load_track(write(content))


def test_no_refusal_tells_where_an_object_lies_in_memory(write) -> None:
    with pytest.raises(TrackError, match=r"malformed node or string on line 1: <ast\.BinOp object>\.$"):
        load_track(write(header(GOOD.replace("(100, 6)", "(10**9, 6)"))))


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (np.array([[Evil()] * 6] * 9, dtype=object), "float64"),
        (ring()[:, :2], r"shape \(100, 2\)"),
        (np.column_stack([ring(), ring()[:, 0]]), r"shape \(100, 7\)"),
        (ring()[:, 0], "shape"),
        (ring()[None], "shape"),
        (np.float64(3.0), "shape"),
        (ring().astype(np.int64), "float64"),
        (ring().astype(np.float16), "float64"),
        (ring().astype(np.complex128), "float64"),
        (ring() > 0, "float64"),
        (ring().astype(str), "float64"),
        (np.zeros((0, 6)), "0 waypoints"),
        (ring()[:2], "2 waypoints"),
        (np.zeros((100, 6)), "repeats 99"),
        (np.full((100, 6), np.nan), "finite"),
        (np.full((100, 6), np.inf), "finite"),
        (ring() + 1e9, "within 10,000"),
        (ring(50_000, radius=100).astype(np.float32), "50,000 waypoints"),
        (np.repeat(ring(), 3, axis=0), "repeats"),
    ],
)
def test_wrong_arrays(write, rows: np.ndarray, words: str) -> None:
    with pytest.raises(TrackError, match=words):
        load_track(write(np.asarray(rows)))


def test_pipes_folders_and_missing_files(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.npy"
    os.mkfifo(pipe)
    with pytest.raises(TrackError, match=r"Cannot read track file '.*pipe\.npy': it is no regular file\.$"):
        load_track(pipe)
    folder = tmp_path / "folder.npy"
    folder.mkdir()
    with pytest.raises(TrackError, match=r"Cannot read track file '.*folder\.npy': Is a directory\.$"):
        load_track(folder)
    with pytest.raises(TrackNotFound, match="nowhere") as absolute:
        load_track(tmp_path / "nowhere.npy")
    assert absolute.value.hint == ""
    with pytest.raises(TrackNotFound, match="nowhere") as relative:
        load_track("nowhere.npy")
    assert "begins at the folder you are in" in relative.value.hint
    with pytest.raises(TrackError, match=r"allowed are \.npy"):
        load_track(tmp_path / "track.txt")
    with pytest.raises(TrackError):
        load_track("a\0b.npy")


@given(noise=st.binary(max_size=300), cut=st.integers(0, 400))
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_damage_is_refused_or_harmless(tmp_path: Path, noise: bytes, cut: int) -> None:
    file = io.BytesIO()
    np.save(file, ring(20))
    good = file.getvalue()
    for name in ("t.npy", "t.csv"):
        path = tmp_path / name
        path.write_bytes(good[:cut] + noise + good[cut + len(noise) :])
        try:
            load_track(path)
        except RacecraftError as error:
            message = str(error)
        else:
            message = ""
        assert len(message) < 400


# --- centre-line tables


def table(*, separator: str = ",", head: str = "# x_m,y_m,w_tr_right_m,w_tr_left_m", closes: bool = False) -> str:
    angle = np.linspace(0, 2 * np.pi, 121)[: 121 if closes else 120]
    rows = np.stack([5 * np.cos(angle), 5 * np.sin(angle), np.full_like(angle, 0.6), np.full_like(angle, 0.4)], axis=1)
    lines = [head.replace(",", separator)] if head else []
    return "\n".join(lines + [separator.join(f"{value:.7f}" for value in row) for row in rows]) + "\n"


@pytest.mark.parametrize("separator", [",", ";", "\t", " ", ", ", "; "])
@pytest.mark.parametrize("head", ["", "# x_m,y_m,w_tr_right_m,w_tr_left_m", "x_m,y_m,w_tr_right_m,w_tr_left_m"])
@pytest.mark.parametrize("closes", [True, False])
def test_centre_line_tables_of_every_kind(write, separator: str, head: str, closes: bool) -> None:
    track = read_centerline_csv(write(table(separator=separator, head=head, closes=closes), "ring.csv"))
    assert track.is_closed
    assert track.name == "ring"
    assert track.length == pytest.approx(10 * np.pi, rel=1e-3)
    assert track.mean_width == pytest.approx(1.0, rel=1e-4)
    assert track.direction == "counter-clockwise"
    assert np.hypot(*track.inner.T) == pytest.approx(np.full(len(track.inner), 4.6), abs=1e-3)  # left of travel
    assert np.hypot(*track.outer.T) == pytest.approx(np.full(len(track.inner), 5.6), abs=1e-3)


def test_clockwise_table_has_its_inner_border_on_the_right(write) -> None:
    rows = table(head="").strip().split("\n")
    track = load_track(write("\n".join(rows[::-1]), "back.csv"))
    assert track.direction == "clockwise"
    assert not track.inner_is_left
    assert np.hypot(*track.inner.T).mean() == pytest.approx(4.4, abs=1e-3)


def test_named_columns_may_stand_anywhere(write) -> None:
    lines = ["s;w_tr_left_m;y_m;x_m;w_tr_right_m"]
    for line in table(head="").strip().split("\n"):
        x, y, right, left = line.split(",")
        lines.append(f"0;{left};{y};{x};{right}")
    track = load_track(write("\ufeff" + "\r\n".join(lines), "named.csv"))
    assert np.hypot(*track.inner.T).mean() == pytest.approx(4.6, abs=1e-3)


def test_open_table(write) -> None:
    lines = "\n".join(f"{x},0,0.5,0.5" for x in np.arange(0, 10, 0.5))
    track = load_track(write(lines, "open.csv"))
    assert not track.is_closed
    assert track.length == pytest.approx(9.5)


def test_a_border_that_folds_inside_a_tight_bend_is_pulled_straight(write) -> None:
    angle = np.linspace(0, np.pi, 25)
    bend = np.stack([8 + 0.4 * np.sin(angle), 0.4 - 0.4 * np.cos(angle)], axis=1)
    there = np.stack([np.arange(0, 8, 0.2), np.zeros(40)], axis=1)
    back = np.stack([np.arange(8, 0, -0.2) - 0.2, np.linspace(0.8, 2.4, 40)], axis=1)
    rows = [f"{x:.6f},{y:.6f},0.5,0.45" for x, y in np.concatenate((there, bend, back))]
    track = load_track(write("\n".join(rows), "fold.csv"))
    assert not track.is_closed


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no rows"),
        ("# only a comment\n", "no rows"),
        ("1,2\n" * 20, "this has 2\\."),
        ("1,2,3,4,5,6,7\n" * 20, "this has 7\\."),
        ("1,2,0.5,0.5\n1,2,x,0.5\n", "no row of numbers"),
        ("1,2,0.5,0.5\n" * 20, "repeats 19"),
        ("0,0,1,1\n1,0,1,1\n", "2 waypoints"),
        ("0,0,1,1\n1,0,1,1\n1,1,1,1\n1,1.0000001,1,1\n", "different"),
        (table().replace("0.6000000", "nan"), "has nan m .* 0 to 100 m"),
        (table().replace("0.6000000", "-0.6"), "has -0.6 m .* 0 to 100 m"),
        (table().replace("0.6000000", "1e308"), "has 1e\\+308 m .* 0 to 100 m"),
        (table().replace("0.6000000", "0").replace("0.4000000", "0"), "0 m wide"),
        (table().replace("5.0000000", "inf"), "finite"),
        (table().replace("5.0000000", "5e9"), "within 10,000"),
        ("\n".join(f"{i},{i},1,1" for i in range(50_000)), "more than 10,000"),
        ("x" * 1_000_000, "no rows"),
        (table() * 2, "crosses or touches|neither"),
    ],
)
def test_wrong_tables(write, text: str, words: str) -> None:
    with pytest.raises(TrackError, match=words):
        load_track(write(text, "bad.csv"))


def test_a_table_that_a_spreadsheet_saved_as_unicode_text(write) -> None:
    plain = load_track(write(table(), "plain.csv"))
    tabs = table().replace(",", "\t").encode("utf-16")
    assert load_track(write(tabs, "tabs.csv")).digest == plain.digest


def test_binary_table(write) -> None:
    with pytest.raises(TrackError, match="UTF-8"):
        load_track(write(b"\xff\x00\xfe" * 50, "bad.csv"))
