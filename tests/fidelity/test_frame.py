"""Two camera frames of the original, found and reproduced; frames of our own, found to the millimetre; bad files."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from racecraft.cli.entry import every_verb
from racecraft.errors import ConfigError
from racecraft.fidelity.frame import FrameFit, fit_frame, network_frame
from racecraft.fidelity.likeness import edge_offsets, mean_difference, structural_similarity
from racecraft.sim.camera import CameraSpec
from racecraft.sim.views import Scene
from racecraft.track import load_track

pytestmark = pytest.mark.costly

SHARED = Path(__file__).parents[3] / "shared"
ROUTE = SHARED / "tracks" / "reinvent_base.npy"
FRAMES = [SHARED / "frames" / f"frame_{number}.png" for number in (1, 2)]
needs_frames = pytest.mark.skipif(
    not FRAMES[0].is_file(), reason="the original's camera frames are not beside this repository"
)


@pytest.fixture(scope="module")
def fits() -> list[FrameFit]:
    return [fit_frame(frame, track=ROUTE) for frame in FRAMES]


@pytest.mark.costly
@needs_frames
def test_frames_of_the_original_are_reproduced(fits):
    for fit in fits:
        assert fit.difference < 5.0  # the bar is 12
        assert fit.similarity > 0.85  # the bar is 0.8
        for name, offset in fit.offsets.items():
            assert offset is not None
            assert offset < 1.0, name


@needs_frames
def test_both_frames_have_the_same_lens_and_it_is_the_default(fits):
    for fit in fits:
        assert fit.camera.pitch == pytest.approx(CameraSpec().pitch, abs=0.004)
        assert fit.camera.above_ground == pytest.approx(CameraSpec().above_ground, abs=0.002)


@needs_frames
def test_the_original_has_our_grain_and_shades(fits):
    for fit in fits:
        road = (slice(100, 118), slice(60, 100))  # close to the lens, between the dashes and the line
        seen, drawn = fit.seen[road].astype(float), fit.drawn[road].astype(float)
        assert drawn.mean() == pytest.approx(seen.mean(), abs=4.0)
        assert 0.5 < drawn.std() / seen.std() < 1.5
        sky = (slice(0, 30), slice(0, 100))
        assert drawn_equals(fit.seen[sky], fit.drawn[sky])


def drawn_equals(seen, drawn) -> bool:
    return bool(np.abs(seen.astype(int) - drawn).max() <= 3)


def our_frame(path: Path, track, pose, size=(640, 480)) -> Path:
    camera = CameraSpec(width=size[0], height=size[1])
    picture = Scene(track).driver_view(camera, lit_walls=False).draw(*pose)
    Image.fromarray(picture).save(path)
    return path


@pytest.mark.costly
def test_a_frame_of_our_own_is_found(tmp_path):
    track = load_track("reinvent_2018")
    x, y = track.point_at(6.0).tolist()
    pose = (x + 0.05, y - 0.03, float(track.heading_at(6.0)) + 0.2)
    fit = fit_frame(our_frame(tmp_path / "frame.png", track, pose), track=track)
    assert math.dist((fit.x, fit.y), pose[:2]) < 0.003
    assert math.remainder(fit.heading - pose[2], 2 * math.pi) == pytest.approx(0.0, abs=0.005)
    assert fit.similarity > 0.9
    assert fit.difference < 3.0


@pytest.mark.costly
def test_the_command_prints_and_draws(tmp_path):
    track = load_track("oval")
    pose = (*track.point_at(3.0).tolist(), float(track.heading_at(3.0)))
    frame = our_frame(tmp_path / "frame.png", track, pose)
    sheet = tmp_path / "sheet.png"
    command = ["replay", "--frame", str(frame), "--track", "oval"]
    done = CliRunner().invoke(every_verb(), [*command, "--json"], catch_exceptions=False)
    found = json.loads(done.stdout)
    assert found["pose"]["x"] == pytest.approx(pose[0], abs=0.003)
    assert found["structural_similarity"] > 0.9
    assert set(found["edge_offsets_px"]) == {"horizon", "lines", "dashes"}
    said = CliRunner().invoke(every_verb(), [*command, "-o", str(sheet)], catch_exceptions=False).stdout
    with Image.open(sheet) as picture:
        assert picture.size == (1920, 960)
    assert "Taken on oval" in said
    assert "structural similarity" in said


@pytest.mark.parametrize("arguments", [[], ["log.csv", "--frame", "frame.png"]])
def test_either_logs_or_a_frame(arguments):
    with pytest.raises(ConfigError, match="either logs or one --frame"):
        CliRunner().invoke(every_verb(), ["replay", *arguments], catch_exceptions=False)


def test_files_that_are_no_frames(tmp_path):
    with pytest.raises(ConfigError, match="does not exist"):
        fit_frame(tmp_path / "none.png", track="oval")
    (tmp_path / "text.png").write_text("not a picture")
    with pytest.raises(ConfigError, match="cannot be read as a picture"):
        fit_frame(tmp_path / "text.png", track="oval")
    with pytest.raises(ConfigError, match="cannot be read"):
        fit_frame(tmp_path, track="oval")
    Image.new("RGB", (300, 300)).save(tmp_path / "square.png")
    with pytest.raises(ConfigError, match=r"^Frame \S+ has 300 x 300 pixels; it must be 4:3, 160 to 4096 wide\.$"):
        fit_frame(tmp_path / "square.png", track="oval")
    whole = our_frame(tmp_path / "whole.png", load_track("oval"), (0.0, 0.0, 0.0)).read_bytes()
    (tmp_path / "cut.png").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ConfigError, match="cannot be read"):
        fit_frame(tmp_path / "cut.png", track="oval")
    (tmp_path / "large.png").write_bytes(b"\x89PNG" + bytes(20_000_001))
    with pytest.raises(ConfigError, match="larger than 20 MB"):
        fit_frame(tmp_path / "large.png", track="oval")


# --- how alike


def test_the_same_picture_is_alike():
    picture = np.random.default_rng(1).integers(0, 256, (120, 160)).astype(np.uint8)
    assert structural_similarity(picture, picture) == pytest.approx(1.0)
    assert mean_difference(picture, picture) == 0.0
    assert mean_difference(np.zeros((4, 4), np.uint8), np.full((4, 4), 255, np.uint8)) == 255.0


def test_structural_similarity_is_the_papers():
    """Against the formula written out for every window."""
    random = np.random.default_rng(2)
    a = random.integers(0, 256, (24, 30)).astype(np.uint8)
    b = (0.7 * a + random.integers(0, 60, a.shape)).astype(np.uint8)
    near = np.arange(-5, 6)
    weights = np.exp(-(near[:, None] ** 2 + near**2) / (2 * 1.5**2))
    weights /= weights.sum()
    values = []
    for row in range(5, 24 - 5):
        for column in range(5, 30 - 5):
            x, y = (p[row - 5 : row + 6, column - 5 : column + 6].astype(float) for p in (a, b))
            mx, my = (weights * x).sum(), (weights * y).sum()
            vx, vy = (weights * (x - mx) ** 2).sum(), (weights * (y - my) ** 2).sum()
            both = (weights * (x - mx) * (y - my)).sum()
            c1, c2 = 2.55**2, 7.65**2
            values.append((2 * mx * my + c1) * (2 * both + c2) / ((mx**2 + my**2 + c1) * (vx + vy + c2)))
    assert structural_similarity(a, b) == pytest.approx(np.mean(values), abs=1e-9)


def test_edges_are_measured_in_pixels():
    def picture(shift: int):
        drawn = np.zeros((120, 160, 3))
        drawn[40 + shift :] = (106, 152, 116)
        drawn[60 + shift : 64 + shift] = 215
        drawn[80 + shift : 88 + shift, 50:70] = (219, 131, 1)
        return drawn

    assert edge_offsets(picture(0), picture(0)) == {"horizon": 0.0, "lines": 0.0, "dashes": 0.0}
    for offset in edge_offsets(picture(0), picture(3)).values():
        assert offset == pytest.approx(3.0, abs=0.3)
    assert edge_offsets(picture(0), np.zeros((120, 160, 3)))["lines"] is None


def test_a_frame_becomes_what_the_network_gets():
    picture = np.zeros((480, 640, 3), dtype=np.uint8)
    picture[..., 0] = 100
    assert network_frame(picture).shape == (120, 160)
    assert (network_frame(picture) == 30).all()  # 0.2989 of red
