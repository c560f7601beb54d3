import importlib.util

import av
import numpy as np
import pytest
from PIL import Image, features

from racecraft.errors import ConfigError
from racecraft.film import encoding
from racecraft.film.av1 import PIECE, write_av1
from racecraft.film.boxes import box, inside, read_samples
from racecraft.film.encoding import write_video


def pictures(count):
    """A bright square that walks over a ramp."""
    ramp = np.linspace(40, 120, 64, dtype=np.uint8)
    for number in range(count):
        picture = np.repeat(np.tile(ramp, (48, 1))[:, :, None], 3, axis=2)
        picture[10:20, number % 50 : number % 50 + 10] = 230, 60, 30
        yield picture


def decoded(path):
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.width, stream.height, stream.average_rate) == (64, 48, 15)
        assert stream.codec_context.pix_fmt == "yuv420p"
        return [(frame.pts, frame.key_frame, frame.to_ndarray(format="rgb24")) for frame in container.decode(stream)]


@pytest.mark.parametrize("count", [1, 2, PIECE + 1, 2 * PIECE + 2])
def test_another_decoder_sees_every_picture(count, tmp_path):
    path = tmp_path / "film.mp4"
    write_av1(pictures(count), path, rate=15, quality=22)
    found = decoded(path)
    assert [time for time, _, _ in found] == list(range(count))
    starts = {1: [0], 2: [0], PIECE + 1: [0], 2 * PIECE + 2: [0, PIECE, 2 * PIECE]}
    assert [time for time, is_key, _ in found if is_key] == starts[count]
    for (_, _, seen), drawn in zip(found, pictures(count), strict=True):
        assert np.abs(seen.astype(int) - drawn).mean() < 4
    data = path.read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")  # playable while it loads
    assert [file.name for file in tmp_path.iterdir()] == ["film.mp4"]


def test_films_are_av1_where_h264_is_not_installed(monkeypatch, tmp_path):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert encoding.encoder() == encoding.AV1
    write_video(pictures(3), tmp_path / "film.mp4")
    assert b"av01" in (tmp_path / "film.mp4").read_bytes()
    monkeypatch.setattr(features, "check", lambda name: False)
    with pytest.raises(ConfigError, match="needs av, which is not installed") as told:
        write_video(pictures(3), tmp_path / "other.mp4")
    assert "racecraft[video]" in told.value.hint


def test_what_is_no_sequence_of_pictures_is_refused(tmp_path):
    Image.new("RGB", (16, 16)).save(tmp_path / "one.avif")
    with pytest.raises(ValueError, match="no box b'moov'"):
        read_samples((tmp_path / "one.avif").read_bytes())
    with pytest.raises(ValueError, match="does not fit"):
        inside(box(b"free", b"1234")[:-1], b"moov")
