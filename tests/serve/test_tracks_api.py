"""Tracks that are drawn, imported, deleted; and what strangers try."""

from __future__ import annotations

import io
import json
import math
import pickle
from typing import Any

import httpx
import numpy as np
import pytest
from running_consoles import RunningConsole

OVAL = [
    {"x": 4 * math.cos(0.5 * i), "y": 2.5 * math.sin(0.5 * i), "width": 0.8 + 0.02 * i}
    for i in range(12)
]  # fmt: skip
DRAWING = {"points": OVAL, "is_closed": True}


def refused(reply: httpx.Response, status: int) -> dict[str, Any]:
    assert reply.status_code == status, reply.text
    document = reply.json()
    assert set(document) == {"error"}
    return dict(document["error"])


def names(console: RunningConsole) -> list[str]:
    return [track["name"] for track in console.client.get("/api/tracks").json()]


@pytest.mark.costly
def test_a_drawing_is_judged_saved_changed_deleted_and_brought_back(console: RunningConsole) -> None:
    client = console.client
    verdict = client.post("/api/tracks/validate", json=DRAWING).json()
    assert verdict["ok"]
    assert verdict["direction"] == "counter-clockwise"
    assert len(verdict["geometry"]["center"]) > 50

    saved = client.put("/api/tracks/my-oval", json=DRAWING)
    assert saved.status_code == 200, saved.text
    assert saved.json()["is_own"]
    assert saved.json()["length"] == pytest.approx(verdict["geometry"]["length"], abs=0.01)
    assert client.get("/api/tracks/my-oval/sketch").json() == DRAWING
    assert len(client.get("/api/tracks/my-oval").json()["center"]) > 50

    refused(client.put("/api/tracks/my-oval", json=DRAWING), 409)
    refused(client.put("/api/tracks/My-Oval", json=DRAWING), 409)
    wider = {**DRAWING, "points": [{**point, "x": 2 * point["x"]} for point in OVAL]}
    replaced = client.put("/api/tracks/my-oval", params={"replace": True}, json=wider).json()
    assert replaced["length"] > 1.3 * saved.json()["length"]
    listed = next(track for track in client.get("/api/tracks").json() if track["name"] == "my-oval")
    assert listed["length"] == replaced["length"]

    route = client.get("/api/tracks/my-oval/route.npy").content
    assert np.load(io.BytesIO(route)).shape[1] == 6
    assert client.delete("/api/tracks/my-oval").status_code == 204
    assert "my-oval" not in names(console)
    refused(client.delete("/api/tracks/my-oval"), 404)
    assert client.post("/api/tracks/my-oval/restore").json() == replaced
    refused(client.post("/api/tracks/my-oval/restore"), 404)
    assert client.get("/api/tracks/my-oval/sketch").json() == wider


def test_a_drawing_that_crosses_itself_says_where(console: RunningConsole) -> None:
    points = [{"x": x, "y": y, "width": 0.6} for x, y in ((-4, -2), (4, 2), (4, -2), (-4, 2))]
    verdict = console.client.post("/api/tracks/validate", json={"points": points}).json()
    assert not verdict["ok"]
    assert "crosses" in verdict["problem"]["message"]
    assert verdict["place"] is not None
    assert verdict["geometry"] is not None
    assert "crosses" in refused(console.client.put("/api/tracks/eight", json={"points": points}), 422)["message"]
    assert "eight" not in names(console)


@pytest.mark.parametrize("name", ["oval", "generated:7"])
def test_every_track_can_be_taken_as_a_beginning(console: RunningConsole, name: str) -> None:
    sketch = console.client.get(f"/api/tracks/{name}/sketch").json()
    assert console.client.post("/api/tracks/validate", json=sketch).json()["ok"]


@pytest.mark.parametrize(
    "sketch",
    [
        {"points": []},
        {"points": OVAL[:2]},
        {"points": OVAL * 20},
        {"points": [*OVAL, OVAL[-1]]},
        {"points": [{"x": 1e3, "y": 0, "width": 1}, *OVAL]},
        {"points": [{"x": "1" * 400, "y": 0, "width": 1}, *OVAL]},
        {"points": [{**point, "width": 0.01} for point in OVAL]},
        {"points": [{**point, "more": 1} for point in OVAL]},
        {"points": OVAL, "name": "x"},
        [],
    ],
)
def test_nonsense_is_never_a_track(console: RunningConsole, sketch: Any) -> None:
    verdict = console.client.post("/api/tracks/validate", json=sketch)
    assert verdict.status_code == 422 or not verdict.json()["ok"]
    refused(console.client.put("/api/tracks/nonsense", json=sketch), 422)


@pytest.mark.parametrize("bad", ["NaN", "Infinity", "-Infinity", "1e999"])
def test_numbers_that_are_none_are_refused(console: RunningConsole, bad: str) -> None:
    text = json.dumps(DRAWING).replace('"x": 4.0', f'"x": {bad}', 1)
    headers = {"content-type": "application/json"}
    refused(console.client.post("/api/tracks/validate", content=text, headers=headers), 422)


@pytest.mark.parametrize(
    "name", ["..", "a b", ".hidden", "x" * 65, "a%2f..%2fb", "%00", "ü", "generated:7", "con.npy", "-x", "a%0ab"]
)
def test_hostile_names_are_refused(console: RunningConsole, name: str) -> None:
    before = sorted(console.runs.rglob("*.npy"))
    reply = console.client.put(f"/api/tracks/{name}", json=DRAWING)
    assert reply.status_code in (404, 405, 422), reply.text
    assert sorted(console.runs.rglob("*.npy")) == before


def test_a_librarys_name_is_taken(console: RunningConsole) -> None:
    refused(console.client.put("/api/tracks/oval", json=DRAWING), 409)
    refused(console.client.put("/api/tracks/OVAL", params={"replace": True}, json=DRAWING), 409)
    refused(console.client.delete("/api/tracks/oval"), 404)


def test_track_files_are_imported(console: RunningConsole) -> None:
    client = console.client
    route = client.get("/api/tracks/oval/route.npy").content
    octets = {"content-type": "application/octet-stream"}
    taken = client.post(
        "/api/tracks/import", params={"file": "C:\\My files\\Home (2).npy"}, content=route, headers=octets
    )
    assert taken.status_code == 201, taken.text
    assert taken.json()["name"] == "Home_2"
    assert taken.json()["length"] == pytest.approx(16.79, abs=0.01)
    refused(client.post("/api/tracks/import", params={"file": "Home (2).npy"}, content=route, headers=octets), 409)

    rows = ["# x_m, y_m, w_tr_right_m, w_tr_left_m"]
    rows += [f"{4 * math.cos(a / 10)},{3 * math.sin(a / 10)},0.4,0.5" for a in range(63)]
    reply = client.post("/api/tracks/import", params={"file": "x.csv", "name": "club"}, content="\n".join(rows))
    assert reply.json()["mean_width"] == pytest.approx(0.9, abs=0.01)
    assert "club" in names(console)
    assert client.get("/api/tracks/club/sketch").json()["is_closed"]


@pytest.mark.parametrize(
    ("file", "content", "status"),
    [
        ("a.txt", b"1,2,3,4", 422),
        ("a", b"", 422),
        ("a.npy", b"", 422),
        ("a.npy", b"\x93NUMPY\x01\x00junk", 422),
        ("a.npy", pickle.dumps({"a": 1}), 422),
        ("a.csv", b"\xff\xfe\x00", 422),
        ("a.csv", b"1,2\n" * 5, 422),
        ("a.csv", b"1,2,1,1\n" * 400_000, 422),
        ("a.csv", b"1,2,1,1\n" * 2_000_000, 413),
        ("../../a.csv", b"1,2,1,1\n", 422),
        ("x" * 300 + ".csv", b"1,2,1,1\n", 422),
    ],
)
def test_other_files_are_not(console: RunningConsole, file: str, content: bytes, status: int) -> None:
    before = names(console)
    headers = {"content-type": "application/octet-stream"}
    refused(console.client.post("/api/tracks/import", params={"file": file}, content=content, headers=headers), status)
    assert names(console) == before


def test_a_damaged_track_does_not_break_the_gallery(console: RunningConsole) -> None:
    folder = console.runs / ".racecraft" / "tracks"
    (folder / "broken.npy").write_bytes(b"nothing")
    try:
        assert "oval" in names(console)
        assert "broken" not in names(console)
        refused(console.client.get("/api/tracks/broken"), 422)
    finally:
        (folder / "broken.npy").unlink()
