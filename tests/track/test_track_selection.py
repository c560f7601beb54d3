from __future__ import annotations

from pathlib import Path

import pytest

from racecraft.errors import TrackError, TrackNotFound
from racecraft.track import generate_track, join_names, joint_digest, load_track, load_tracks, save_route, track_names


def names(*spec: str | Path) -> list[str]:
    return [track.name for track in load_tracks(spec)]


def test_names():
    assert names("oval") == ["oval"]
    assert names("library") == list(track_names())
    assert names("generated:3..5") == ["generated:3", "generated:4", "generated:5"]
    assert names("generated:7,length=30") == ["generated:7,length=30"]
    assert names("generated:0..1,difficulty=0.9,width=0.8") == [
        f"generated:{seed},width=0.8,difficulty=0.9" for seed in (0, 1)
    ]
    assert names("oval + generated:1..2 + hairpin", "kidney") == [
        "oval",
        "generated:1",
        "generated:2",
        "hairpin",
        "kidney",
    ]
    assert names("all") == [*track_names(), *(f"generated:{seed}" for seed in range(32))]


def test_a_joined_text_means_the_same_tracks():
    spec = ["library", "generated:0..3", "oval"]
    joined = join_names(spec)
    assert isinstance(joined, str)
    assert names(joined) == names(*spec)
    assert join_names("oval") == "oval"


def test_a_folder_is_its_routes(tmp_path):
    for seed in (2, 1):
        save_route(generate_track(seed), tmp_path / f"track{seed}.npy")
    (tmp_path / "notes.txt").write_text("no track")
    (tmp_path / "index.csv").write_text("a,table,of,them\n")
    found = load_tracks(tmp_path)
    assert [track.digest for track in found] == [generate_track(seed).digest for seed in (1, 2)]
    assert [track.digest for track in load_tracks(str(tmp_path))] == [track.digest for track in found]
    assert len(load_tracks([str(tmp_path), "oval"])) == 3


def test_a_file_of_any_name_is_one_track(tmp_path):
    path = tmp_path / "this + that.npy"
    save_route(generate_track(1), path)
    assert load_tracks(str(path))[0].digest == generate_track(1).digest


def test_a_text_longer_than_a_path_names_tracks(tmp_path):
    save_route(generate_track(1), tmp_path / "long.npy")
    joined = " + ".join([str(tmp_path / "long.npy")] * 200)
    assert len(load_tracks(joined)) == 200
    for name in ("a" * 400, "a\0b", "a" * 400 + " + oval"):
        with pytest.raises(TrackNotFound, match="does not exist"):
            load_tracks(name)


def test_digests():
    oval, kidney = load_track("oval"), load_track("kidney")
    assert joint_digest([oval]) == oval.digest
    assert len({joint_digest(tracks) for tracks in ([oval], [kidney], [oval, kidney], [kidney, oval])}) == 4


@pytest.mark.parametrize(
    ("spec", "error", "words"),
    [
        ("ovall", TrackNotFound, "ovall"),
        ("oval + ", TrackNotFound, "''"),
        ("oval + ovall", TrackNotFound, "ovall"),
        ("generated:5..2", TrackError, "must rise"),
        ("generated:0..999999", TrackError, "1000 at most"),
        ("generated:0..2,speed=3", TrackError, "speed"),
        ("generated:..", TrackError, "generated"),
        (["generated:0..999", "oval"], TrackError, "1001 tracks"),
        ([], TrackError, "No track"),
    ],
)
def test_mistakes(spec, error, words):
    with pytest.raises(error, match=words):
        load_tracks(spec)


def test_folders_without_tracks(tmp_path):
    with pytest.raises(TrackError, match="holds no track"):
        load_tracks(tmp_path)
    (tmp_path / "bad.npy").write_bytes(b"no array")
    with pytest.raises(TrackError, match="bad"):
        load_tracks(tmp_path)
