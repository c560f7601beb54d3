"""Where pictures come from, what is refused, and what is told and painted of them."""

from __future__ import annotations

import os
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageOps

from racecraft.agent.sensor_suite import SensorSuite
from racecraft.errors import ConfigError, ShapeError
from racecraft.film.encoding import write_video
from racecraft.learn.native_regressor import NativeRegressor
from racecraft.learn.networks import PERCEIVER
from racecraft.perceiving import perceive
from racecraft.perceiving.painting import paint
from racecraft.perceiving.reading import rate_of, read_pictures
from racecraft.perception import Belief, Perceiver, Watcher
from racecraft.perception.answers import NUM_OUTPUTS, NUMBERS
from racecraft.perception.belief import believe
from racecraft.perception.network import of_one_brightness
from racecraft.perception.telling import tell
from racecraft.race import RULE_SETS, evaluate
from racecraft.replay import Replay, write_replay
from racecraft.sim.camera import CAMERAS
from racecraft.track import load_track


@pytest.fixture(scope="module")
def perceiver() -> Perceiver:
    return Perceiver(num_threads=1)


def belief_of(**numbers: float) -> Belief:
    """Of one picture: all zero but for some of `NUMBERS`, in their units."""
    outputs = np.zeros((1, NUM_OUTPUTS), np.float32)
    for name, value in numbers.items():
        outputs[0, list(NUMBERS).index(name)] = value / NUMBERS[name]
    return believe(outputs)


def road(width: int = 320, height: int = 240) -> Image.Image:
    """Something that has light and shade."""
    levels = np.add.outer(np.arange(height), np.arange(width)) % 251
    return Image.fromarray(np.stack([levels] * 3, axis=2).astype(np.uint8))


def test_pictures_of_every_kind_and_size(tmp_path: Path, perceiver: Perceiver) -> None:
    road().save(tmp_path / "a.png")
    road(160, 120).convert("L").save(tmp_path / "b.jpg")
    road(99, 77).convert("RGBA").save(tmp_path / "c.webp")
    (tmp_path / "notes.txt").write_text("no picture")
    told = perceive([tmp_path, tmp_path / "a.png"], output=tmp_path / "seen", perceiver=perceiver)
    assert [Path(one["file"]).name for one in told] == ["a.png", "b.jpg", "c.webp", "a.png"]
    assert told[0] == told[3]
    painted = sorted((tmp_path / "seen").iterdir())
    assert [path.name for path in painted] == ["00000-a.png", "00001-b.png", "00002-c.png", "00003-a.png"]
    with Image.open(painted[0]) as image:
        assert image.size == (640, 480)


def test_one_source_needs_no_list_and_texts_are_paths(tmp_path: Path, perceiver: Perceiver) -> None:
    road().save(tmp_path / "a.png")
    told = perceive([tmp_path / "a.png"], perceiver=perceiver)
    assert perceive(tmp_path / "a.png", perceiver=perceiver) == told
    assert perceive(str(tmp_path / "a.png"), output=str(tmp_path / "seen"), perceiver=perceiver) == told
    assert [path.name for path in (tmp_path / "seen").iterdir()] == ["00000-a.png"]
    for sources in (5, None, [5], {"a.png"}):
        with pytest.raises(ConfigError, match=r"sources is .*; allowed is a path, or a list of several"):
            perceive(sources, perceiver=perceiver)  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match="output is 5; use a path"):
        perceive(tmp_path, output=5, perceiver=perceiver)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["a#1", "a#2.b", "50%", "with a space", "%d"])
def test_painted_pictures_keep_the_names_of_their_files(tmp_path: Path, perceiver: Perceiver, name: str) -> None:
    road().save(tmp_path / f"{name}.png")
    road(160, 120).save(tmp_path / f"{name}.jpg")
    told = perceive([tmp_path], output=tmp_path / "seen", perceiver=perceiver)
    assert [one["file"] for one in told] == [str(tmp_path / f"{name}{ending}") for ending in (".jpg", ".png")]
    assert sorted(path.name for path in (tmp_path / "seen").iterdir()) == [f"0000{i}-{name}.png" for i in range(2)]


def test_a_picture_of_16_bits_is_as_bright_as_one_of_8(tmp_path: Path) -> None:
    grey = np.asarray(road(160, 120).convert("L"))
    Image.fromarray(grey.astype(np.uint16) * 257 + np.uint16(60)).save(tmp_path / "deep.png")
    Image.fromarray(grey).save(tmp_path / "plain.png")
    deep, plain = read_pictures([tmp_path / "deep.png", tmp_path / "plain.png"])
    assert np.array_equal(deep.seen, plain.seen)
    assert np.array_equal(deep.shown, plain.shown)


@pytest.mark.parametrize("orientation", range(10))
@pytest.mark.parametrize("ending", ["jpg", "png", "webp"])
def test_a_picture_is_seen_the_way_up_that_its_camera_says(tmp_path: Path, orientation: int, ending: str) -> None:
    exif = Image.Exif()
    exif[0x0112] = orientation
    pixels = np.zeros((120, 160, 3), np.uint8)
    pixels[:40, :50] = 250
    pixels[:40, 50:] = 120
    lying = Image.fromarray(pixels)
    lying.save(tmp_path / f"lying.{ending}", exif=exif, quality=95)
    upright = Image.open(tmp_path / f"lying.{ending}")
    ImageOps.exif_transpose(upright).save(tmp_path / "upright.png", exif=b"")
    one, other = read_pictures([tmp_path / f"lying.{ending}", tmp_path / "upright.png"])
    assert np.array_equal(one.seen, other.seen)


def test_what_is_damaged_about_a_picture_leaves_it_as_it_lies(tmp_path: Path) -> None:
    chance = np.random.default_rng(1)
    exif = Image.Exif()
    exif[0x0112], exif[0x010F] = 6, "maker"
    whole = exif.tobytes()
    road(160, 120).save(tmp_path / "a.png")
    (plain,) = read_pictures([tmp_path / "a.png"])
    turned = 0
    for _ in range(60):
        damaged = bytearray(whole)
        for place in chance.integers(len(whole), size=4):
            damaged[place] = chance.integers(256)
        road(160, 120).save(tmp_path / "a.png", exif=bytes(damaged))
        (picture,) = read_pictures([tmp_path / "a.png"])
        turned += not np.array_equal(picture.seen, plain.seen)
    assert turned < 50


def test_a_video_is_painted_as_one(tmp_path: Path, perceiver: Perceiver) -> None:
    frames = [np.asarray(road(640, 480).rotate(turn)) for turn in range(5)]
    write_video(frames, tmp_path / "in.mp4")
    told = perceive([tmp_path / "in.mp4"], output=tmp_path / "out.mp4", perceiver=perceiver)
    assert {picture.is_of_film for picture in read_pictures([tmp_path / "in.mp4"])} == {True}
    assert [one["file"].rpartition("#")[2] for one in told] == ["0", "1", "2", "3", "4"]
    painted = [picture.shown.astype(int) for picture in read_pictures([tmp_path / "out.mp4"])]
    assert len(painted) == 5
    assert np.abs(painted[0] - frames[0]).mean() > 2.0


def test_a_video_may_be_badly_labelled(tmp_path: Path, perceiver: Perceiver) -> None:
    write_video([np.asarray(road(640, 480))], tmp_path / "in.mp4")
    film = (tmp_path / "in.mp4").read_bytes()
    assert film.count(b"VideoHandler") == 1
    (tmp_path / "in.mp4").write_bytes(film.replace(b"VideoHandler", b"Video\xbfandler"))
    assert len(perceive([tmp_path / "in.mp4"], perceiver=perceiver)) == 1
    (tmp_path / "in.mp4").write_bytes(film.replace(b"avc1", b"none"))
    with pytest.raises(ConfigError, match="no video"):
        perceive([tmp_path / "in.mp4"], perceiver=perceiver)


def moved(film: Path, matrix: tuple[int, ...]) -> bytes:
    """A video of MP4 that is to be shown by a matrix."""
    content = bytearray(film.read_bytes())
    place = content.index(b"tkhd") + 44
    content[place : place + 36] = struct.pack(">9i", *(number << 16 for number in matrix[:6]), 0, 0, 1 << 30)
    return bytes(content)


@pytest.mark.parametrize(
    ("quarters", "matrix"), [(1, (0, 1, 0, -1, 0, 0)), (2, (-1, 0, 0, 0, -1, 0)), (3, (0, -1, 0, 1, 0, 0))]
)
def test_a_video_is_seen_the_way_up_that_its_camera_says(
    tmp_path: Path, quarters: int, matrix: tuple[int, ...]
) -> None:
    upright = np.zeros((480, 640, 3), np.uint8)
    upright[:160, :200], upright[:160, 200:] = 250, 120
    write_video([np.ascontiguousarray(np.rot90(upright, quarters))], tmp_path / "a.mp4")
    (lying,) = read_pictures([tmp_path / "a.mp4"])
    (tmp_path / "a.mp4").write_bytes(moved(tmp_path / "a.mp4", matrix))
    (turned,) = read_pictures([tmp_path / "a.mp4"])
    assert np.abs(turned.shown.astype(int) - upright).mean() < 4.0
    assert np.abs(lying.shown.astype(int) - upright).mean() > 40.0


def test_a_painted_film_is_as_fast_as_the_film_and_never_replaces_it(tmp_path: Path, perceiver: Perceiver) -> None:
    film = tmp_path / "in.mp4"
    write_video([np.asarray(road(640, 480))] * 3, film, rate=30)
    perceive([film], output=tmp_path / "out.mp4", perceiver=perceiver)
    assert rate_of(film) == rate_of(tmp_path / "out.mp4") == 30
    assert rate_of(tmp_path / "a.replay") == 15
    (tmp_path / "link.mp4").symlink_to(film)
    before = film.read_bytes()
    for same in (film, tmp_path / "link.mp4"):
        with pytest.raises(ConfigError, match="the film that is looked at"):
            perceive([film], output=same, perceiver=perceiver)
    assert film.read_bytes() == before


def test_pictures_do_not_become_a_film(tmp_path: Path, perceiver: Perceiver) -> None:
    road().save(tmp_path / "a.png")
    with pytest.raises(ConfigError, match="a film of what is none"):
        perceive([tmp_path / "a.png"], output=tmp_path / "out.mp4", perceiver=perceiver)
    assert not (tmp_path / "out.mp4").exists()


def test_pictures_of_a_folder_go_by_their_numbers(tmp_path: Path) -> None:
    for name in ("frame_10.png", "frame_2.png", "1.png", "frame.png", "frame_2b10.png", "frame_2b9.png"):
        road(160, 120).save(tmp_path / name)
    names = [Path(picture.file).name for picture in read_pictures([tmp_path])]
    assert names == ["1.png", "frame.png", "frame_2.png", "frame_2b9.png", "frame_2b10.png", "frame_10.png"]


def test_a_video_that_is_a_list_of_other_files_is_refused(tmp_path: Path, perceiver: Perceiver) -> None:
    write_video([np.asarray(road(640, 480))], tmp_path / "in.mp4")
    os.mkfifo(tmp_path / "pipe")  # whoever reads it waits for ever
    for other in ("in.mp4", "pipe"):
        (tmp_path / "a.mp4").write_text(f"ffconcat version 1.0\nfile {other}\n")
        with pytest.raises(ConfigError, match="no video that can be read"):
            perceive([tmp_path / "a.mp4"], perceiver=perceiver)


@pytest.mark.parametrize(
    ("sensor", "camera"),
    [("FRONT_FACING_CAMERA", "2018"), ("LEFT_CAMERA", "2018"), ("STEREO_CAMERAS", "2018"), ("LEFT_CAMERA", "2026")],
)
def test_a_replay_shows_what_the_driver_saw(tmp_path: Path, sensor: str, camera: str) -> None:
    seen: list[NDArray[np.uint8]] = []

    def driver(frames: NDArray[np.uint8]) -> NDArray[np.float32]:
        seen.append(frames[0].reshape(-1, 120, 160)[0].copy())  # of two lenses the left one
        return np.array([[0.1, 1.0]], np.float32)

    evaluation = evaluate(
        driver,
        load_track("oval"),
        rules=replace(RULE_SETS["first_lap"], time_limit=1.0),
        num_trials=1,
        camera=CAMERAS[camera],
        sensors=SensorSuite((sensor,)),
        randomize="none",
        num_threads=1,
    )
    pictures = list(read_pictures([write_replay(Replay.of(evaluation), tmp_path / "a.replay")]))
    assert len(pictures) == len(seen) + 1  # the first is of the step that prepares the start
    for picture, frame in zip(pictures[1:], seen, strict=True):
        assert np.abs(picture.seen.astype(int) - frame).mean() < 2.0


def test_of_a_replay_it_knows_what_the_car_was_told(perceiver: Perceiver, tmp_path: Path) -> None:
    asked: list[list[float]] = []

    def driver(frames: NDArray[np.uint8]) -> NDArray[np.float32]:
        asked.append([0.02 * len(asked), 1.0 + 0.1 * len(asked)])
        return np.array(asked[-1:], np.float32)

    evaluation = evaluate(
        driver, load_track("oval"), rules=replace(RULE_SETS["first_lap"], time_limit=1.0), num_trials=1, num_threads=1
    )
    path = write_replay(Replay.of(evaluation), tmp_path / "a.replay")
    film = list(read_pictures([path]))
    assert [one.commands for one in film[:2]] == [None, None]  # of the start nobody was asked before
    assert [one.commands for one in film[2:]] == [pytest.approx(one) for one in asked[: len(film) - 2]]
    assert len(film) > 8
    frames, begins = np.stack([one.seen for one in film]), np.array([one.is_first for one in film])
    commands = np.array([one.commands or (np.nan, np.nan) for one in film], np.float32)
    told = [one["heading_rad"] for one in perceive([path], perceiver=perceiver)]
    knowing = Watcher(perceiver).film(frames, begins, commands=commands).heading
    assert told == pytest.approx(knowing, abs=6e-5)
    assert np.abs(knowing - Watcher(perceiver).film(frames, begins).heading)[2:].max() > 1e-3
    late = np.concatenate([commands[:1], commands[:-1]])
    assert np.abs(knowing - Watcher(perceiver).film(frames, begins, commands=late).heading)[2:].max() > 1e-3


def test_a_car_that_is_put_back_is_in_another_place(tmp_path: Path) -> None:
    evaluation = evaluate(
        lambda frames: np.tile(np.array([0.3, 1.5], np.float32), (len(frames), 1)),
        load_track("oval"),
        rules=replace(RULE_SETS["drfc"], time_limit=8.0),
        num_trials=1,
        num_threads=1,
    )
    pictures = list(read_pictures([write_replay(Replay.of(evaluation), tmp_path / "a.replay")]))
    firsts = [step for step, picture in enumerate(pictures) if picture.is_first]
    poses = evaluation.best_trial.recording.poses
    jumps = [step for step in range(1, len(poses)) if np.hypot(*(poses[step] - poses[step - 1])[:2]) > 0.2]
    assert len(jumps) > 0
    assert firsts == [0, *jumps]
    stands = evaluation.best_trial.recording.is_placed
    did = [not stands[step] and not stands[step - 1] for step in range(1, len(poses))]
    assert 0 < sum(did) < len(did) - len(jumps)
    assert [picture.commands is not None for picture in pictures] == [False, *did]
    asked = {(round(one[0], 6), one[1]) for one in (picture.commands for picture in pictures) if one}
    assert asked == {(0.3, 1.5)}
    assert all(picture.is_of_film for picture in pictures)


@pytest.mark.filterwarnings("default")  # no errors, which they are in tests alone
def test_what_is_no_picture_is_refused(tmp_path: Path, perceiver: Perceiver) -> None:
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(40))
    (tmp_path / "b.jpg").write_text("text")
    (tmp_path / "c.mp4").write_bytes(bytes(1000))
    (tmp_path / "d").mkdir()
    Image.new("1", (5000, 5000)).save(tmp_path / "e.png")  # 3 kB
    Image.new("1", (9500, 9500)).save(tmp_path / "h.png")  # which Pillow warns of
    with (tmp_path / "f.png").open("wb") as large:
        large.truncate(30_000_000)
    says = {
        "a.png": "no picture", "b.jpg": "no picture", "c.mp4": "no video", "d": "no picture in",
        "e.png": "5000 x 5000 pixels", "f.png": "larger than 20 MB", "g": "nothing at", "h.png": "no picture that",
    }  # fmt: skip
    for name, sentence in says.items():
        with pytest.raises(ConfigError, match=sentence):
            perceive([tmp_path / name], perceiver=perceiver)
    with pytest.raises(ConfigError, match="No pictures are given"):
        perceive([], perceiver=perceiver)


def test_every_truncation_of_a_picture_is_refused_or_read(tmp_path: Path, perceiver: Perceiver) -> None:
    road(40, 30).save(tmp_path / "whole.png")
    whole = (tmp_path / "whole.png").read_bytes()
    refused = 0
    for length in range(0, len(whole), max(len(whole) // 40, 1)):
        (tmp_path / "cut.png").write_bytes(whole[:length])
        try:
            perceive([tmp_path / "cut.png"], perceiver=perceiver)
        except ConfigError:
            refused += 1
    assert refused > 30


def test_dark_and_bright_pictures_are_seen_in_one_brightness_and_a_wall_stays_a_wall() -> None:
    noise = np.random.default_rng(3).normal(0.0, 1.0, (120, 160))
    pictures = np.stack([40 + 5 * noise, 190 + 15 * noise, 90 + noise]).round().astype(np.uint8)
    seen = of_one_brightness(pictures)
    assert seen.mean(axis=(1, 2)) == pytest.approx([112.0] * 3, abs=1.0)
    assert seen.std(axis=(1, 2)) == pytest.approx([48.0, 48.0, 12.0], abs=1.5)  # less than 4 levels count as 4


def test_what_is_told() -> None:
    told = tell("a", belief_of(offset=0.1, heading=-0.2, heading_ahead=0.3, closeness=0.5), 0)
    assert told["offset_m"] == pytest.approx(0.1)
    assert told["heading_rad"] == pytest.approx(-0.2)
    assert told["heading_ahead_rad"] == pytest.approx(0.3)
    assert told["distance_m"] == pytest.approx(1.0)
    assert told["middle"] == [None] * 4  # as likely there as not
    assert tell("a", belief_of(), 0)["distance_m"] is None


def test_an_offset_to_the_left_is_painted_on_the_left() -> None:
    plain = np.full((480, 640, 3), 90, np.uint8)
    for side, columns in ((0.2, slice(190, 320)), (-0.2, slice(321, 450))):
        painted = paint(plain, belief_of(offset=side, half_width=0.4), 0)
        white = np.asarray((painted[440:476] > 240).all(axis=2))
        assert white[:, columns].sum() > 0.95 * white.sum() > 50


def test_how_sure_it_is_of_the_offset_is_painted_to_both_sides() -> None:
    plain = np.full((480, 640, 3), 90, np.uint8)
    unsure = belief_of(half_width=0.2)
    sure = replace(unsure, offset_error=np.zeros(1, np.float32))
    changed = (paint(plain, unsure, 0) != paint(plain, sure, 0))[456:461].any(axis=(0, 2))
    off = round(0.2 * 640 * NUMBERS["offset"] / 0.2)  # an expected error of 1 in the network's unit
    for side in (changed[:300][::-1], changed[340:]):  # the arrow of the car hides what is between
        assert side[: off - 22].all()
        assert not side[off - 18 :].any()


def test_slopes_of_another_shape_are_refused() -> None:
    network = NativeRegressor(PERCEIVER, 4, num_threads=1)
    seen = network.encode(np.zeros((3, 120, 160), np.uint8))
    before = network.policy(seen)
    with pytest.raises(ShapeError, match=r"\(3, 5\), expected \(3, 4\)"):
        network.descend(seen, np.zeros((3, 5), np.float32), learning_rate=0.1)
    network.descend(seen, np.ones((3, 4), np.float32), learning_rate=0.01)
    assert (network.policy(seen) < before).all()
