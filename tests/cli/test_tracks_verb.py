"""`racecraft tracks`: the list, limits, pictures and sheets."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import Run


def test_tracks_are_listed(racecraft: Run) -> None:
    outcome = racecraft("tracks")
    lines = outcome.out.splitlines()
    assert outcome.status == 0
    assert all(len(line) <= 80 for line in lines)
    (line,) = (line for line in lines if "reinvent_2018" in line)
    assert "17.7 m" in line
    assert "0.76 m" in line


def test_the_limit_of_a_track(racecraft: Run) -> None:
    outcome = racecraft("tracks", "limit", "oval")
    assert outcome.status == 0
    assert "no lap under" in outcome.out
    document = racecraft("tracks", "limit", "oval", "--json").document
    medals = document["medals"]
    assert document["ideal_seconds"] < document["driven_seconds"] < 1.1 * document["ideal_seconds"]
    assert medals["author"] < medals["gold"] < medals["silver"] < medals["bronze"]
    listed = {track["name"]: track for track in racecraft("tracks", "--json").document["tracks"]}
    assert listed["oval"]["limit"]["ideal_seconds"] == document["ideal_seconds"]
    assert listed["straight"]["limit"] is None
    assert "Medals: author" in racecraft("tracks", "show", "oval", "--width", "400").out


@pytest.mark.costly
def test_a_sheet_of_tracks(racecraft: Run) -> None:
    from PIL import Image

    outcome = racecraft("tracks", "sheet", "--width", "600", "-o", "all.webp")
    assert (outcome.status, outcome.out) == (0, "18 tracks drawn to all.webp\n")
    document = racecraft(
        "tracks", "sheet", "generated:1", "oval", "--columns", "2", "--width", "400", "--json"
    ).document
    assert document["picture"] == "tracks.png"
    assert [track["name"] for track in document["tracks"]] == ["generated:1", "oval"]
    with Image.open("tracks.png") as picture:
        assert picture.size[0] == 400


def test_tracks_as_json(racecraft: Run) -> None:
    tracks = {track["name"]: track for track in racecraft("tracks", "--json").document["tracks"]}
    assert len(tracks) >= 12
    assert tracks["reinvent_2018"]["length_m"] == pytest.approx(17.7, abs=0.05)
    assert tracks["straight"]["min_radius_m"] is None
    assert tracks["oval"]["is_closed"]


@pytest.mark.parametrize("name", ["oval", "generated:7"])
def test_a_track_is_drawn(racecraft: Run, tmp_path: Path, name: str) -> None:
    outcome = racecraft("tracks", "show", name, "--width", "400")
    assert outcome.status == 0
    (picture,) = tmp_path.glob("*.png")
    assert picture.name in outcome.out
    document = racecraft("tracks", "show", name, "--width", "400", "-o", "mine.png", "--json").document
    assert (document["name"], document["picture"]) == (name, "mine.png")
    assert (tmp_path / "mine.png").read_bytes().startswith(b"\x89PNG")
