"""Reads and writes the files of others: AWS DeepRacer routes (.npy), F1TENTH and TUM centre lines (.csv).

A file is untrusted: its size is capped before it is read, its header is judged before its data, nothing is
unpickled, and the track it describes goes through `validate`. Every refusal is a `TrackError` that names the
file.
"""

from __future__ import annotations

import io
import os
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from racecraft.errors import TrackError, TrackNotFound
from racecraft.json_file import is_utf16, open_regular
from racecraft.scoped_warnings import scoped_warnings
from racecraft.track.polyline import Floats, signed_area
from racecraft.track.track import CLOSED_GAP, Track
from racecraft.track.validate import MAX_WAYPOINTS, MAX_WIDTH, MIN_WAYPOINTS, check_rows, validate

MAX_FILE_BYTES = 2_000_000  # AWS's largest route has 19 kB; 10,000 waypoints of text fit in well
MAX_FOLD_ROWS = 64  # longest loop of a border that is cut off, waypoints
MAX_HEADER_BYTES = 1_000  # of an .npy file; numpy writes 118
ADDRESS = re.compile(r" at 0x[0-9a-fA-F]+")
ROUTE_COLUMNS = ("centerline", "inner", "outer")
CSV_COLUMNS = ("x_m", "y_m", "w_tr_right_m", "w_tr_left_m")


def read_route(path: str | Path) -> Track:
    """A track from an AWS DeepRacer route: float (W, 6), centre x, y, inner x, y, outer x, y, metres.

    It is closed when its last row repeats the first.

    Raises:
        TrackNotFound: There is no such file.
        TrackError: The file is no route, or its track cannot be driven.
    """
    path = Path(path)
    rows = _parse_npy(_read_bytes(path), path)
    lines = {name: rows[:, 2 * index : 2 * index + 2] for index, name in enumerate(ROUTE_COLUMNS)}
    return _checked(path.stem, lines)


def read_centerline_csv(path: str | Path) -> Track:
    """A track from the centre-line table of F1TENTH and TUM: x_m, y_m, w_tr_right_m, w_tr_left_m, metres.

    Commas, semicolons, tabs or spaces separate; the names may be missing, stand in the first line, or follow
    a ``#``. With names, the columns may come in any order and beside others. The line closes if its ends are
    near each other, whether or not the last row repeats the first.

    Raises:
        TrackNotFound: There is no such file.
        TrackError: The file is no such table, or its track cannot be driven.
    """
    path = Path(path)
    rows = _parse_csv(_read_bytes(path), path)
    check_rows({"centerline": rows[:, :2]}, name=path.stem)
    if (bad := np.flatnonzero(~((rows[:, 2:] >= 0.0) & (rows[:, 2:] <= MAX_WIDTH)).all(axis=1))).size:
        right, left = rows[bad[0], 2:]
        raise TrackError(
            f"{path.name}: waypoint {bad[0]} has {right:g} m of road to the right, {left:g} m to the left; "
            f"allowed is 0 to {MAX_WIDTH:g} m."
        )
    rows = rows[np.concatenate(([True], np.hypot(*np.diff(rows[:, :2], axis=0).T) > CLOSED_GAP))]
    if len(rows) < MIN_WAYPOINTS:
        raise TrackError(f"{path.name} has {len(rows)} different waypoints; at least {MIN_WAYPOINTS} are needed.")
    steps = np.hypot(*np.diff(rows[:, :2], axis=0).T)
    gap = float(np.hypot(*(rows[0, :2] - rows[-1, :2])))
    is_closed = gap <= 3.0 * float(steps.max()) and gap < 0.5 * float(steps.sum())
    if is_closed:
        rows = np.concatenate((rows if gap > CLOSED_GAP else rows[:-1], rows[:1]))
    centre, right_width, left_width = rows[:, :2], rows[:, 2:3], rows[:, 3:4]
    normal = _left_normals(centre, is_closed=is_closed)
    left = _unfold(centre + normal * left_width, is_closed=is_closed)
    right = _unfold(centre - normal * right_width, is_closed=is_closed)
    inner_is_left = not is_closed or signed_area(centre) >= 0.0
    inner, outer = (left, right) if inner_is_left else (right, left)
    return _checked(path.stem, {"centerline": centre, "inner": inner, "outer": outer})


def read_track(path: str | Path) -> Track:
    """A track from a file, by its ending: .npy or .csv.

    Raises:
        TrackNotFound: There is no such file.
        TrackError: The ending is another one, or the file is not a track that can be driven.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix == ".npy":
        return read_route(path)
    if suffix == ".csv":
        return read_centerline_csv(path)
    raise TrackError(
        f"{path.name!r} is not a track file; "
        "allowed are .npy (AWS route, 6 columns) and .csv (centre line with widths)."
    )


def save_route(track: Track, path: str | Path) -> Path:
    """Writes a track as an AWS DeepRacer route: .npy, float64 (W, 6). `read_route` gives the same track back.

    Raises:
        TrackError: The name does not end in .npy.
    """
    path = Path(path)
    if path.suffix.lower() != ".npy":
        raise TrackError(f"A route is an .npy file; {path.name!r} does not end in .npy.")
    with path.open("wb") as file:
        rows = np.concatenate((track.centerline, track.inner, track.outer), axis=1)
        rows = np.insert(rows, track.repeats, rows[list(track.repeats)], axis=0)
        np.save(file, rows, allow_pickle=False)
    return path


def _checked(name: str, lines: dict[str, Floats]) -> Track:
    check_rows(lines, name=name)
    track = Track(name, lines["centerline"], lines["inner"], lines["outer"])
    validate(track)
    return track


def _read_bytes(path: Path) -> bytes:
    """The content of a regular file of a sane size. Never waits on a pipe, never reads a large file."""
    try:
        with open_regular(path) as file:
            size = os.fstat(file.fileno()).st_size
            content = file.read(MAX_FILE_BYTES + 1) if size <= MAX_FILE_BYTES else b""
    except (FileNotFoundError, NotADirectoryError):
        begins = "Its path begins at the folder you are in; a run keeps its track's path as given."
        raise TrackNotFound(
            f"There is no track file {str(path)!r}.", hint="" if path.is_absolute() else begins
        ) from None
    except (OSError, ValueError) as error:
        raise TrackError(
            f"Cannot read track file {str(path)!r}: {getattr(error, 'strerror', None) or error}."
        ) from None
    if size > MAX_FILE_BYTES or len(content) > MAX_FILE_BYTES:
        raise TrackError(
            f"{path.name} has {size:,} bytes; track files of at most {MAX_FILE_BYTES:,} are read.",
            hint=f"A track has at most {MAX_WAYPOINTS:,} waypoints.",
        )
    return content


def _parse_npy(content: bytes, path: Path) -> Floats:
    file = io.BytesIO(content)
    try:
        with scoped_warnings("error"):
            version = np.lib.format.read_magic(file)
            read_header = (
                np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
            )
            shape, is_fortran, dtype = read_header(file, max_header_size=MAX_HEADER_BYTES)
    except Exception as error:  # numpy raises whatever its literal parser does on a hostile header
        # of Python's own objects it says where they lie in memory, which is nobody's business
        why = ADDRESS.sub("", str(error).splitlines()[0] if str(error) else type(error).__name__)[:120].rstrip(". ")
        raise TrackError(f"{path.name} is not a readable .npy file: {why}.") from None
    if dtype.hasobject or dtype.kind != "f" or dtype.itemsize not in (4, 8):
        raise TrackError(f"{path.name} holds {str(dtype)[:60]!r} values; a route is float64 or float32.")
    if len(shape) != 2 or shape[1] != 2 * len(ROUTE_COLUMNS):
        raise TrackError(
            f"{path.name} has shape {str(shape)[:60]}; "
            "a route has (W, 6): centre x, y, inner x, y, outer x, y in metres."
        )
    if not 0 <= shape[0] <= MAX_WAYPOINTS:
        raise TrackError(f"{path.name} claims {shape[0]:,} waypoints; at most {MAX_WAYPOINTS:,} are allowed.")
    size = shape[0] * shape[1] * dtype.itemsize
    data = file.read()
    if len(data) != size:
        raise TrackError(f"{path.name} is damaged: {len(data):,} bytes of data, {size:,} expected from its header.")
    rows = np.frombuffer(data, dtype=dtype).reshape(shape, order="F" if is_fortran else "C")
    with np.errstate(invalid="ignore"):
        return np.ascontiguousarray(rows, dtype=np.float64)


def _parse_csv(content: bytes, path: Path) -> Floats:
    """The four columns of the table as (W, 4)."""
    try:
        text = content.decode("utf-16" if is_utf16(content) else "utf-8-sig")
    except UnicodeDecodeError:
        raise TrackError(f"{path.name} is not a text file in UTF-8.") from None
    columns: Sequence[int] = (0, 1, 2, 3)
    rows: list[list[float]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        is_comment = line.lstrip().startswith("#")
        fields = _fields(line.lstrip(" \t#"))
        if not fields:
            continue
        if is_comment or (not rows and not _is_number(fields[0])):
            columns = _named_columns(fields, columns)
            continue
        if len(rows) == MAX_WAYPOINTS:
            raise TrackError(f"{path.name} has more than {MAX_WAYPOINTS:,} waypoints.", hint="Resample it.")
        if len(fields) <= max(columns) or (columns == (0, 1, 2, 3) and len(fields) != 4):
            raise TrackError(
                f"{path.name}, line {number}: a centre line has the columns {', '.join(CSV_COLUMNS)}; "
                f"this has {len(fields)}.",
                hint="Other columns are allowed when the first line names them.",
            )
        try:
            rows.append([float(fields[column]) for column in columns])
        except ValueError:
            raise TrackError(f"{path.name}, line {number} is no row of numbers: {line[:60]!r}.") from None
    if not rows:
        raise TrackError(f"{path.name} has no rows of numbers; a centre line has {', '.join(CSV_COLUMNS)}.")
    return np.array(rows)


def _fields(line: str) -> list[str]:
    for separator in (";", ",", "\t"):
        if separator in line:
            return [field.strip() for field in line.strip().rstrip(separator).split(separator)]
    return line.split()


def _named_columns(fields: Sequence[str], otherwise: Sequence[int]) -> Sequence[int]:
    names = [field.lower() for field in fields]
    return tuple(names.index(name) for name in CSV_COLUMNS) if set(CSV_COLUMNS) <= set(names) else otherwise


def _is_number(field: str) -> bool:
    try:
        float(field)
    except ValueError:
        return False
    return True


def _left_normals(centre: Floats, *, is_closed: bool) -> Floats:
    """Unit vectors square to the chord between both neighbours, to the left, (W, 2)."""
    chord = np.gradient(centre, axis=0)
    if is_closed:
        chord[0] = chord[-1] = centre[1] - centre[-2]
    length = np.maximum(np.hypot(*chord.T), 1e-12)
    return np.asarray(np.stack([-chord[:, 1], chord[:, 0]], axis=1) / length[:, None])


def _unfold(border: Floats, *, is_closed: bool) -> Floats:
    """Cuts off the small loops a border makes inside bends tighter than the half width.

    Where two pieces a few rows apart cross, all points between them move to the crossing, so that rows still pair up.
    """
    body = border[:-1].copy() if is_closed else border.copy()
    num_points = len(body)
    for rows_apart in range(min(MAX_FOLD_ROWS, num_points // 3), 1, -1):
        start, step = body, np.roll(body, -1, axis=0) - body
        other_start, other_step = np.roll(start, -rows_apart, axis=0), np.roll(step, -rows_apart, axis=0)
        between = other_start - start
        denominator = _cross(step, other_step)
        parallel = np.abs(denominator) < 1e-12
        denominator = np.where(parallel, 1.0, denominator)
        along, other_along = _cross(between, other_step) / denominator, _cross(between, step) / denominator
        meets = ~parallel & (along >= 0.0) & (along <= 1.0) & (other_along >= 0.0) & (other_along <= 1.0)
        if not is_closed:
            meets[num_points - 1 - rows_apart :] = False
        crossing = start + along[:, None] * step
        for row in np.flatnonzero(meets):
            body[(row + 1 + np.arange(rows_apart)) % num_points] = crossing[row]
    return np.concatenate((body, body[:1])) if is_closed else body


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
