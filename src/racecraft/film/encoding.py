"""Pictures one after the other as a video, playable while it loads: H.264 where PyAV is installed, otherwise AV1."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import RunError
from racecraft.extras import not_installed
from racecraft.film.av1 import is_there, write_av1

FRAME_RATE: Final = 15
"""A picture for every step."""
QUALITY: Final = 22
"""x264's constant rate factor: 18 is near lossless, 28 is poor."""
H264: Final = "H.264"
AV1: Final = "AV1"


def encoder() -> str:
    """What videos are made with here, H264 or AV1.

    Raises:
        ConfigError: With neither.
    """
    if importlib.util.find_spec("av") is not None:
        return H264
    if is_there():
        return AV1
    told = not_installed("av", "A video, where Pillow has no encoder of AVIF,")
    assert told is not None
    raise told


def write_video(
    pictures: Iterable[NDArray[np.uint8]], path: Path, *, rate: int = FRAME_RATE, quality: int = QUALITY
) -> None:
    """Write a video; nothing is left of one that breaks off.

    Args:
        pictures: RGB (height, width, 3), all as large as the first, with even sides; at least one.
        path: Where to, ending in ``.mp4``.
        rate: Pictures a second.
        quality: x264's constant rate factor.

    Raises:
        ConfigError: There is no encoder.
        RunError: The file cannot be written.
    """
    unfinished = path.with_name(f".{path.stem}.{os.getpid()}.part.mp4")
    write = _write_h264 if encoder() == H264 else write_av1
    try:
        write(pictures, unfinished, rate=rate, quality=quality)
        os.replace(unfinished, path)
    except OSError as error:
        raise RunError(f"{path} cannot be written: {error.strerror or error}.") from error
    finally:
        unfinished.unlink(missing_ok=True)


def _write_h264(pictures: Iterable[NDArray[np.uint8]], path: Path, *, rate: int, quality: int) -> None:
    import av

    with av.open(str(path), "w", options={"movflags": "faststart"}) as container:
        stream = None
        for pixels in pictures:
            if stream is None:
                options = {"preset": "veryfast", "crf": str(quality)}
                stream = container.add_stream("h264", rate=rate, options=options)
                stream.height, stream.width, stream.pix_fmt = *pixels.shape[:2], "yuv420p"
            container.mux(stream.encode(av.VideoFrame.from_ndarray(pixels, format="rgb24")))
        if stream is not None:
            container.mux(stream.encode())
