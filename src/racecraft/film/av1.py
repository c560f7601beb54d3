"""A film by the encoder of Pillow, which knows AV1 as the format of pictures AVIF: an MP4 file without H.264's library.

Pictures are encoded a few seconds at a time, so that they never all lie in memory; each piece begins with a picture
that needs no other, which is what a player jumps to.
"""

from __future__ import annotations

import io
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from itertools import chain, islice
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.film.boxes import Samples, movie, read_samples

PIECE: Final = 75
"""Pictures that are encoded together."""
ENCODER: Final = "aom"
EFFORT: Final = {"cpu-used": "11"}
"""The least: as fast as x264, for files half as large again. Twice the time would save that."""


def is_there() -> bool:
    """Whether this Pillow was built with the encoder, as its own wheels are."""
    from PIL import features

    if not features.check("avif"):
        return False
    from PIL import _avif  # the one place that tells encoders from decoders

    return bool(_avif.encoder_codec_available(ENCODER))


def write_av1(pictures: Iterable[NDArray[np.uint8]], path: Path, *, rate: int, quality: int) -> None:
    """Write a video.

    Args:
        pictures: RGB (height, width, 3), all as large as the first, with even sides; at least one.
        path: Where to.
        rate: Pictures a second.
        quality: As x264's constant rate factor.

    Raises:
        OSError: The file cannot be written.
    """
    description, sizes, keys = b"", list[int](), list[int]()
    height = width = 0
    with path.open("wb") as file, tempfile.TemporaryFile(dir=path.parent) as rest:
        for piece in _pieces(picture.copy() for picture in pictures):
            height, width = piece[0].shape[:2]
            samples = _encoded(piece, 131 - 3 * quality)  # as near to the pictures as x264
            description = description or samples.description
            keys += sorted(len(sizes) + key for key in samples.keys)
            sizes += map(len, samples.data)
            rest.write(b"".join(samples.data))
        rest.seek(0)
        file.write(movie(description, sizes, keys, width=width, height=height, rate=rate))
        shutil.copyfileobj(rest, file)


def _pieces(pictures: Iterator[NDArray[np.uint8]]) -> Iterator[list[NDArray[np.uint8]]]:
    """PIECE pictures or one more, as a picture alone is no sequence; fewer only where there are no more."""
    ahead = list(islice(pictures, 2))
    while ahead:
        piece = list(islice(chain(ahead, pictures), PIECE))
        ahead = list(islice(pictures, 2))
        if len(ahead) == 1:
            piece += ahead
            ahead = []
        yield piece


def _encoded(piece: list[NDArray[np.uint8]], quality: int) -> Samples:
    from PIL import Image

    images = [Image.fromarray(pixels) for pixels in piece]
    alone = len(images) == 1
    file = io.BytesIO()
    images[0].save(
        file,
        "AVIF",
        save_all=True,
        append_images=images if alone else images[1:],
        duration=1,
        quality=min(max(quality, 0), 100),
        codec=ENCODER,
        speed=10,
        advanced=EFFORT,
        subsampling="4:2:0",
        range="limited",
    )
    samples = read_samples(file.getvalue())
    return Samples(samples.description, samples.data[:1], samples.keys & {0}) if alone else samples
