"""Pictures from wherever they are: files, folders, videos, replays and the last evaluation of a run.

Everybody's files: what is no picture, too large or too many is refused in a sentence before it is decoded.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.errors import ConfigError, printable, typed
from racecraft.extras import needed_for
from racecraft.film.encoding import FRAME_RATE
from racecraft.replay.replay import read_replay
from racecraft.scoped_warnings import scoped_warnings
from racecraft.sim.camera import LUMA, CameraSpec
from racecraft.sim.views import Scene

if TYPE_CHECKING:
    from PIL.Image import Image

PICTURES: Final = (".png", ".jpg", ".jpeg", ".webp", ".bmp")
VIDEOS: Final = (".mp4", ".mkv", ".mov", ".avi", ".webm")
FORMATS: Final = "mov,matroska,avi"
"""FFmpeg's names of what videos may be: what a file is goes by its content, and some formats are lists of others."""
MAX_BYTES: Final = 20_000_000
"""Of a picture's file."""
MAX_PIXELS: Final = 4096 * 4096
"""Of a picture, or of a video's frame."""
MAX_PICTURES: Final = 20_000
"""Of one call; 22 minutes of video."""
SHAPE: Final = (160, 120)
"""What the network gets, width and height."""
SHOWN: Final = (640, 480)
"""What is painted on, width and height."""
_ORIENTATION: Final = 0x0112
_TURNS: Final[dict[Any, tuple[bool, int]]] = {
    **{2: (True, 0), 3: (False, 2), 4: (True, 2)},
    **{5: (True, 3), 6: (False, 1), 7: (True, 1), 8: (False, 3)},
}
"""What EXIF's orientations ask for: to mirror, and quarters to the right."""


@dataclass(frozen=True)
class Picture:
    """One frame."""

    file: str
    """Where it is from: a path, and behind ``#`` the frame's number in a video or replay."""
    stem: str
    """Name of that file, without its ending."""
    shown: NDArray[np.uint8]
    """RGB (480, 640, 3)."""
    seen: NDArray[np.uint8]
    """What the network gets, grey (120, 160)."""
    is_of_film: bool = False
    """Whether it is one of a video, replay or run, of which its neighbours tell more."""
    is_first: bool = True
    """Whether it has nothing to do with the picture before: the first of all, or the car was put somewhere else."""
    commands: tuple[float, float] | None = None
    """What the car did since the picture before, steering angle in rad and speed in m/s; None where nobody knows."""


def read_pictures(sources: Sequence[str | Path]) -> Iterator[Picture]:
    """The pictures of files, folders of files, videos, replays and runs, one after the other.

    Args:
        sources: Paths.

    Raises:
        ConfigError: There is nothing at a path, it is not a picture or a video, or there are too many.
        ReplayError: A replay is damaged.
    """
    if not sources:
        raise ConfigError("No pictures are given.", hint="Give files, folders of pictures, a video or a run folder.")
    count = 0
    for source in sources:
        for picture in _pictures_of(Path(source)):
            count += 1
            if count > MAX_PICTURES:
                raise ConfigError(f"There are more than {MAX_PICTURES:,} pictures.", hint="Give a part of them.")
            yield picture


def is_sequence(sources: Sequence[str | Path]) -> bool:
    """Whether the sources are one film: a single video, replay or run."""
    if len(sources) != 1:
        return False
    path = Path(sources[0])
    return path.suffix.lower() in (*VIDEOS, ".replay") or (path / "run.json").is_file()


def _pictures_of(path: Path) -> Iterator[Picture]:
    if not path.exists():
        raise ConfigError(f"There is nothing at {_named(path)}.", hint="Give pictures, a video or a run folder.")
    if (path / "run.json").is_file():
        replays = sorted(path.glob("evaluation-*/evaluation.replay"))
        if not replays:
            raise ConfigError(
                f"Run {_named(path)} was never evaluated.", hint=f"First racecraft evaluate {typed(path)}"
            )
        yield from _from_replay(replays[-1])
    elif path.is_dir():
        files = [file for file in path.iterdir() if file.suffix.lower() in PICTURES and file.is_file()]
        if not files:
            hint = f"Pictures end in {', '.join(PICTURES)}; a run folder has a run.json."
            raise ConfigError(f"There is no picture in {_named(path)}.", hint=hint)
        for file in sorted(files, key=_by_number):
            yield _from_file(file)
    elif not path.is_file():  # whoever reads a pipe may wait for ever
        raise ConfigError(f"{_named(path)} cannot be read: it is no regular file.")
    elif path.suffix.lower() in VIDEOS:
        yield from _from_video(path)
    elif path.suffix.lower() == ".replay":
        yield from _from_replay(path)
    else:
        yield _from_file(path)


def _by_number(path: Path) -> list[str | int]:
    """Frame 2 comes before frame 10."""
    parts = re.split(r"(\d+)", path.name)
    return [int(part) if place % 2 else part for place, part in enumerate(parts)]


def _from_file(path: Path) -> Picture:
    from PIL import Image

    try:
        if path.stat().st_size > MAX_BYTES:
            raise ConfigError(f"Picture {_named(path)} is larger than {MAX_BYTES // 1_000_000} MB.")
        with (
            scoped_warnings("error", Image.DecompressionBombWarning),
            Image.open(path, formats=("PNG", "JPEG", "WEBP", "BMP")) as image,
        ):
            _check_size(path, *image.size)
            return _picture(path, _upright(image))
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        if isinstance(error, ConfigError):
            raise
        hint = f"Pictures are PNG, JPEG, WebP or BMP; videos end in {', '.join(VIDEOS)}."
        raise ConfigError(f"{_named(path)} is no picture that can be read.", hint=hint) from error


def rate_of(path: Path) -> int:
    """Pictures a second of a film, 1 to 120; a replay or run has the simulator's.

    Raises:
        ConfigError: It is no video that can be read.
    """
    if path.suffix.lower() not in VIDEOS:
        return FRAME_RATE
    with _video(path) as (_, stream):
        return min(max(round(stream.average_rate or FRAME_RATE), 1), 120)


def _from_video(path: Path) -> Iterator[Picture]:
    with _video(path) as (container, stream):
        for number, frame in enumerate(container.decode(stream)):
            _check_size(path, frame.width, frame.height)
            pixels = np.asarray(frame.to_ndarray(format="rgb24"), np.uint8)
            quarters = round(getattr(frame, "rotation", 0) / 90)  # to the left; the first of PyAV 14 did not tell
            upright = np.ascontiguousarray(np.rot90(pixels, quarters))
            yield _picture(path, upright, frame=number, is_first=number == 0)


@contextmanager
def _video(path: Path) -> Iterator[tuple[Any, Any]]:
    """PyAV's container and its stream of pictures; what goes wrong inside the block is the file's fault."""
    with needed_for("Reading a video"):
        import av

    # What labels it is nothing to us; newer ones of PyAV pass over what is not text by themselves.
    unlabelled: dict[str, Any] = {"metadata_errors": "ignore"} if int(av.__version__.split(".")[0]) < 19 else {}
    try:
        with av.open(str(path), options={"format_whitelist": FORMATS}, **unlabelled) as container:
            if not container.streams.video:
                raise ConfigError(f"There is no picture in the video {_named(path)}.")
            stream = container.streams.video[0]
            if stream.codec_context is None:  # of a codec that there is not
                raise ConfigError(f"{_named(path)} is no video that can be read.")
            _check_size(path, stream.codec_context.width, stream.codec_context.height)
            yield container, stream
    except (av.error.FFmpegError, OSError) as error:
        raise ConfigError(f"{_named(path)} is no video that can be read.") from error


def _from_replay(path: Path) -> Iterator[Picture]:
    """What the driver of its best car saw, of a stereo camera the left one of its pictures."""
    replay = read_replay(path)
    recording = replay.evaluation.best_trial.recording
    lens = (replay.conditions.camera or CameraSpec()).left_lens
    camera = replace(lens, width=SHOWN[0], height=SHOWN[1])
    view = Scene(recording.track, palette=camera.palette).driver_view(camera, lit_walls=False)
    is_placed = recording.is_placed
    is_first = is_placed & ~np.append(False, is_placed[:-1])
    for step, (x, y, heading) in enumerate(recording.seen_from(camera.age).tolist()):
        pixels = view.draw(x, y, heading, cars=recording.objects(step))
        picture = _picture(path, pixels, frame=step, is_first=step == 0 or bool(is_first[step]))
        if step and not is_placed[step - 1 : step + 1].any():  # else it did not do what it was told
            steering_angle, speed = recording.actions[step - 1].tolist()
            picture = replace(picture, commands=(steering_angle, speed))
        yield picture


def _upright(image: Image) -> NDArray[np.uint8]:
    """RGB (height, width, 3) as a person sees the picture: turned as its EXIF data says, and 16 bits of grey as 8."""
    turns = _turns_of(image)
    if image.mode.startswith("I"):
        deep = np.asarray(image).astype(np.uint32)
        grey = ((deep * 255 + 32767) // 65535).astype(np.uint8)
        pixels = np.repeat(grey[:, :, None], 3, axis=2)
    else:
        pixels = np.asarray(image.convert("RGB"))
    is_mirrored, quarters = turns
    return np.ascontiguousarray(np.rot90(pixels[:, ::-1] if is_mirrored else pixels, -quarters))


def _turns_of(image: Image) -> tuple[bool, int]:
    """Whether a picture has to be mirrored from left to right, and then how many quarters turned to the right."""
    try:
        with scoped_warnings("ignore", UserWarning):  # of what is damaged among them
            return _TURNS.get(image.getexif().get(_ORIENTATION), (False, 0))
    except (SyntaxError, ValueError, struct.error):  # what is said of a picture is damaged, the picture is not
        return False, 0


def _picture(path: Path, pixels: NDArray[np.uint8], *, frame: int | None = None, is_first: bool = True) -> Picture:
    """Resized as the original does it: bilinear, then grey."""
    from PIL import Image

    image = Image.fromarray(pixels)
    small = np.asarray(image.resize(SHAPE, Image.Resampling.BILINEAR))
    grey = np.rint(small @ np.array(LUMA)).astype(np.uint8)
    return Picture(
        file=str(path) if frame is None else f"{path}#{frame}",
        stem=path.stem,
        shown=np.asarray(image.resize(SHOWN, Image.Resampling.BILINEAR)),
        seen=grey,
        is_of_film=frame is not None,
        is_first=is_first,
    )


def _check_size(path: Path, width: int, height: int) -> None:
    if width * height > MAX_PIXELS:
        raise ConfigError(f"{_named(path)} has pictures of {width} x {height} pixels, more than 4096 x 4096.")


def _named(path: Path) -> str:
    return printable(str(path))[:200]
