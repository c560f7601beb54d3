"""Pictures one after the other as a video: H.264, yuv420p, playable while it loads."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import RunError

FRAME_RATE: Final = 15
"""A picture for every step."""
QUALITY: Final = 22
"""x264's constant rate factor: 18 is near lossless, 28 is poor."""


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
        RunError: The file cannot be written.
    """
    import av

    unfinished = path.with_name(f".{path.stem}.part.mp4")
    try:
        with av.open(str(unfinished), "w", options={"movflags": "faststart"}) as container:
            stream = None
            for pixels in pictures:
                if stream is None:
                    options = {"preset": "veryfast", "crf": str(quality)}
                    stream = container.add_stream("h264", rate=rate, options=options)
                    stream.height, stream.width, stream.pix_fmt = *pixels.shape[:2], "yuv420p"
                container.mux(stream.encode(av.VideoFrame.from_ndarray(pixels, format="rgb24")))
            if stream is not None:
                container.mux(stream.encode())
        os.replace(unfinished, path)
    except OSError as error:
        raise RunError(f"{path} cannot be written: {error.strerror or error}.") from error
    finally:
        unfinished.unlink(missing_ok=True)
