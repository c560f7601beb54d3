"""A camera frame of the original: where it was taken, and how much ours from there looks like it.

    frame -> coarse search along the track -> refinement, finer and finer -> pose, lens, likeness

Every candidate is drawn by the camera that trains, so what fits is what a policy sees.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.checks import check_type
from racecraft.errors import ConfigError
from racecraft.fidelity.given import track_of
from racecraft.fidelity.likeness import edge_offsets, mean_difference, structural_similarity
from racecraft.scoped_warnings import scoped_warnings
from racecraft.sim.camera import LUMA, CameraSpec
from racecraft.sim.views import Scene, driver_frames
from racecraft.track.track import Track

MAX_BYTES: Final = 20_000_000  # of a frame's file
MAX_SIDE: Final = 4096  # pixels
SHAPE: Final = (160, 120)  # what the network gets
SPACING: Final = 0.1  # m along the track between the search's first candidates
LANES: Final = np.linspace(-0.45, 0.45, 7)  # across it, in widths of the road
HEADINGS: Final = 40  # in the full circle
DASH_PERIOD: Final = 0.1016  # m
CHUNK: Final = 2048  # candidates that are drawn together
LENS_RANGE: Final = 0.2  # share by which the lens may be higher or look further down than the car's
POSE_STEPS: Final = np.array([0.01, 0.01, 0.01])  # m, m, rad, of derivatives at full size
LENS_STEPS: Final = np.array([0.003, 0.002])  # rad, m
ITERATIONS: Final = 20
LONGEST: Final = 10.0  # steps that a candidate may move at once
OUTLIER: Final = 12.0  # difference in brightness from which a pixel counts less

Grey = NDArray[np.uint8]
Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class FrameFit:
    """A frame and ours from the pose that fits it best."""

    track: Track
    x: float
    """m, of the car's origin."""
    y: float
    """m"""
    heading: float
    """rad"""
    camera: CameraSpec
    """With the fitted pitch and height."""
    frame: NDArray[np.uint8]
    """As read, RGB (H, W, 3)."""
    seen: Grey
    """As the network would get it, grey (120, 160)."""
    drawn: Grey
    """Ours, grey (120, 160)."""
    offsets: dict[str, float | None]
    """How far edges lie apart, px; see `edge_offsets`."""

    @property
    def difference(self) -> float:
        """Mean absolute difference of the grey pictures, of 255."""
        return mean_difference(self.seen, self.drawn)

    @property
    def similarity(self) -> float:
        """Structural similarity of the grey pictures."""
        return structural_similarity(self.seen, self.drawn)

    def to_dict(self) -> dict[str, Any]:
        """What `racecraft replay --frame --json` prints."""
        lens = self.camera.forward * np.array([np.cos(self.heading), np.sin(self.heading)])
        return {
            "track": self.track.name,
            "pose": {"x": round(self.x, 4), "y": round(self.y, 4), "heading": round(self.heading, 4)},
            "lens": {
                "x": round(self.x + float(lens[0]), 4),
                "y": round(self.y + float(lens[1]), 4),
                "above_ground": round(self.camera.above_ground, 4),
                "pitch": round(self.camera.pitch, 4),
                "horizontal_fov": self.camera.horizontal_fov,
            },
            "mean_absolute_difference": round(self.difference, 3),
            "structural_similarity": round(self.similarity, 4),
            "edge_offsets_px": {k: None if v is None else round(v, 3) for k, v in self.offsets.items()},
        }


def fit_frame(frame: str | Path, *, track: str | Path | Track, palette: str = "2018") -> FrameFit:
    """Find where on a track a frame was taken.

    Args:
        frame: Picture of the original's front camera, 640 x 480 in colour (any size of that shape will do).
        track: Name of a track, file of a route, or a track.
        palette: Colours of its world: ``2018``, ``2020`` or ``2026``.

    Raises:
        ConfigError: The file is no such picture.
        TrackError: The track cannot be used.
    """
    check_type("frame", frame, (str, os.PathLike), "use a picture's path")
    picture = _read(Path(frame))
    road = track_of(track)
    camera = CameraSpec(palette=palette)
    seen = network_frame(picture)
    best = _search(road, camera, seen)
    for divisor, keep in ((4, 24), (2, 6), (1, 1)):
        smaller = _resized(camera, divisor)
        target = _shrunk(seen, divisor)
        fits = [_refine(road, smaller, target, pose, divisor) for pose in best]
        fits.sort(key=lambda fit: fit[0])
        best = _distinct([pose for _, pose in fits], keep)
    camera, pose = refine_lens(road, camera, seen, _next_dashes(road, camera, seen, best[0]))
    pose[2] = np.arctan2(np.sin(pose[2]), np.cos(pose[2]))
    small = np.asarray(_shrink_image(picture), dtype=float)
    colour = Scene(road, palette=palette).driver_view(camera, lit_walls=False).draw(*pose)
    return FrameFit(
        track=road,
        x=float(pose[0]),
        y=float(pose[1]),
        heading=float(pose[2]),
        camera=camera,
        frame=picture,
        seen=seen,
        drawn=driver_frames(road, [pose], camera)[0],
        offsets=edge_offsets(small, colour.astype(float)),
    )


def network_frame(picture: NDArray[np.uint8]) -> Grey:
    """A colour frame as the original hands it to the network: bilinear to 160 x 120, then grey."""
    return np.asarray(np.rint(_shrink_image(picture) @ np.array(LUMA)), dtype=np.uint8)


def _shrink_image(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    from PIL import Image

    return np.asarray(Image.fromarray(picture).resize(SHAPE, Image.Resampling.BILINEAR))


def _read(path: Path) -> NDArray[np.uint8]:
    from PIL import Image

    hint = "Give a frame of the original's front camera, such as a PNG of 640 x 480 pixels."
    try:
        if path.stat().st_size > MAX_BYTES:
            raise ConfigError(f"Frame {path} is larger than {MAX_BYTES // 1_000_000} MB.", hint=hint)
        with (
            scoped_warnings("error", Image.DecompressionBombWarning),
            Image.open(path, formats=("PNG", "JPEG", "WEBP", "BMP")) as image,
        ):
            wide, high = image.size
            if max(wide, high) > MAX_SIDE or wide < SHAPE[0] or abs(3 * wide - 4 * high) > wide / 50:
                raise ConfigError(
                    f"Frame {path} has {wide} x {high} pixels; it must be 4:3, {SHAPE[0]} to {MAX_SIDE} wide.",
                    hint=hint,
                )
            return np.array(image.convert("RGB"))
    except FileNotFoundError:
        raise ConfigError(f"Frame {path} does not exist.", hint=hint) from None
    except ConfigError:
        raise
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        raise ConfigError(f"Frame {path} cannot be read as a picture: {error}.", hint=hint) from error


def _resized(camera: CameraSpec, divisor: int) -> CameraSpec:
    return replace(camera, width=camera.width // divisor, height=camera.height // divisor)


def _shrunk(picture: Grey, divisor: int) -> Numbers:
    high, wide = picture.shape
    return np.asarray(picture.reshape(high // divisor, divisor, wide // divisor, divisor).mean(axis=(1, 3)))


def _search(track: Track, camera: CameraSpec, seen: Grey) -> list[Numbers]:
    """The best poses of a grid along the whole track, all of it in pictures of 40 x 30."""
    small, target = _resized(camera, 4), _shrunk(seen, 4)
    along = np.arange(0.0, track.length, SPACING)
    points, normal = track.point_at(along), track.heading_at(along) + np.pi / 2
    offsets = np.outer(track.width_at(along), LANES)
    lens = points[:, None] + offsets[..., None] * np.stack([np.cos(normal), np.sin(normal)], axis=-1)[:, None]
    headings = np.linspace(-np.pi, np.pi, HEADINGS, endpoint=False)
    back = camera.forward * np.stack([np.cos(headings), np.sin(headings)], axis=-1)
    origins = lens.reshape(-1, 1, 2) - back
    poses = np.concatenate([origins, np.broadcast_to(headings[:, None], (*origins.shape[:2], 1))], axis=2)
    poses = poses.reshape(-1, 3)
    scores = np.empty(len(poses), dtype=np.float32)
    wanted = target.astype(np.int16)
    for first in range(0, len(poses), CHUNK):
        part = slice(first, first + CHUNK)
        scores[part] = np.abs(driver_frames(track, poses[part], small) - wanted).mean(axis=(1, 2))
    return _distinct(poses[np.argsort(scores, kind="stable")[:4000]], 96)


def _distinct(poses: list[Numbers] | Numbers, count: int) -> list[Numbers]:
    """The first poses that are not almost one of those before."""
    kept: list[Numbers] = []
    for pose in poses:
        apart = [np.hypot(*(pose[:2] - other[:2])) + 0.3 * abs(np.sin((pose[2] - other[2]) / 2)) for other in kept]
        if min(apart, default=1.0) > 0.08:
            kept.append(pose)
            if len(kept) == count:
                break
    return kept


def _refine(track: Track, camera: CameraSpec, target: Numbers, pose: Numbers, divisor: int) -> tuple[float, Numbers]:
    """The pose near this one that fits best, and its mean absolute difference."""

    def draw(candidates: Numbers) -> Numbers:
        return driver_frames(track, candidates, camera).astype(np.float64)

    found, drawn = _descend(draw, target, pose, POSE_STEPS * divisor)
    return float(np.abs(drawn - target).mean()), found


def _descend(
    draw: Callable[[Numbers], Numbers], target: Numbers, start: Numbers, steps: Numbers
) -> tuple[Numbers, Numbers]:
    """Levenberg-Marquardt on the brightness of all pixels; those far off count less, by a pseudo-Huber loss.

    Args:
        draw: Pictures (N, H, W) of candidates (N, P).
        target: What they should look like, (H, W).
        start: The first candidate, (P,).
        steps: Of the derivatives, (P,).

    Returns:
        The best candidate (P,) and its picture (H, W).
    """

    def loss_of(drawn: Numbers) -> float:
        return float(np.sqrt(1 + ((drawn - target) / OUTLIER) ** 2).sum())

    at, drawn, damping = start, draw(start[None])[0], 1e-2
    loss = loss_of(drawn)
    for _ in range(ITERATIONS):
        around = draw(np.concatenate([at + np.diag(steps), at - np.diag(steps)])).reshape(2, len(steps), -1)
        slope = (around[0] - around[1]) / 2  # per step
        apart = (drawn - target).ravel()
        weighted = slope / np.sqrt(1 + (apart / OUTLIER) ** 2)
        curvature, descent = weighted @ slope.T, -weighted @ apart
        while damping < 1e3:
            system = curvature + (1e-6 + damping * np.diag(curvature)) * np.eye(len(steps))
            change = np.clip(np.linalg.solve(system, descent), -LONGEST, LONGEST)
            trial = at + change * steps
            picture = draw(trial[None])[0]
            if loss_of(picture) < loss:
                break
            damping *= 10
        else:
            break
        at, drawn, gain = trial, picture, loss - loss_of(picture)
        loss, damping = loss - gain, damping / 10
        if gain < 1e-5 * loss:
            break
    return at, drawn


def _next_dashes(track: Track, camera: CameraSpec, seen: Grey, pose: Numbers) -> Numbers:
    """The same look up to two dashes on or back, as long as it fits better: dashes are all alike."""
    half, target = _resized(camera, 2), _shrunk(seen, 2)
    best, score = pose, float("inf")
    for _ in range(5):
        rough = [_refine(track, half, target, start, 2) for start in _shifted(track, camera, best)]
        nearest = _distinct([pose for _, pose in sorted(rough, key=lambda fit: fit[0])], 4)
        fits = [_refine(track, camera, seen.astype(np.float64), start, 1) for start in (best, *nearest)]
        lowest, found = min(fits, key=lambda fit: fit[0])
        if lowest >= score - 1e-3:
            break
        score, best = lowest, found
    return best


def _shifted(track: Track, camera: CameraSpec, pose: Numbers) -> list[Numbers]:
    """Poses with the lens some quarters of a dash further along the track, as far from its middle and as oblique."""
    ahead = camera.forward * np.array([np.cos(pose[2]), np.sin(pose[2])])
    lens = pose[:2] + ahead
    s, offset = track.project(lens)
    oblique = pose[2] - track.heading_at(s)
    poses = []
    for dashes in np.arange(-2.0, 2.1, 0.25):
        at = s + dashes * DASH_PERIOD
        along = float(track.heading_at(at))
        heading = along + oblique
        place = track.point_at(at) + offset * np.array([-np.sin(along), np.cos(along)])
        place = place - camera.forward * np.array([np.cos(heading), np.sin(heading)])
        poses.append(np.array([*place, heading]))
    return poses


def refine_lens(track: Track, camera: CameraSpec, seen: Grey, pose: Numbers) -> tuple[CameraSpec, Numbers]:
    """Pose, pitch and height of the lens together, from a pose that is nearly right.

    Args:
        track: Where the frame was taken.
        camera: Its look, and a lens to begin with.
        seen: The frame, grey (120, 160).
        pose: x [m], y [m] and heading [rad] of the car's origin (3,).
    """
    lens = np.array([camera.pitch, camera.above_ground])

    def with_lens(values: Numbers) -> CameraSpec:
        pitch, above = np.clip(values[3:], lens * (1 - LENS_RANGE), lens * (1 + LENS_RANGE)).tolist()
        return replace(camera, pitch=pitch, above_ground=above)

    def draw(candidates: Numbers) -> Numbers:
        frames = [driver_frames(track, values[None, :3], with_lens(values))[0] for values in candidates]
        return np.asarray(frames, dtype=np.float64)

    steps = np.concatenate([POSE_STEPS, LENS_STEPS])
    found, _ = _descend(draw, seen.astype(np.float64), np.concatenate([pose, lens]), steps)
    return with_lens(found), found[:3].copy()


def draw_frame(fit: FrameFit, path: str | Path) -> Path:
    """Write the frame, ours and the difference side by side, in colour and as the network gets them.

    Args:
        fit: What `fit_frame` returned.
        path: Where to; the ending says how (.png, .jpg, .webp).

    Raises:
        ConfigError: The ending is none of these, or the file cannot be written.
    """
    from PIL import Image

    from racecraft.fidelity.picture import check_ending, save_picture

    path = check_ending(path)
    size = (640, 480)
    camera = replace(fit.camera, width=size[0], height=size[1])
    view = Scene(fit.track, palette=fit.camera.palette).driver_view(camera, lit_walls=False)
    seen = Image.fromarray(fit.frame).resize(size, Image.Resampling.BILINEAR)
    drawn = view.draw(fit.x, fit.y, fit.heading)
    pairs = ((np.asarray(seen), drawn), (_enlarged(fit.seen), _enlarged(fit.drawn)))
    rows = []
    for one, other in pairs:
        apart = np.abs(one.astype(int) - other).clip(0, 255).astype(np.uint8)
        rows.append(np.concatenate([one, other, apart], axis=1))
    return save_picture(Image.fromarray(np.concatenate(rows)), path)


def _enlarged(grey: Grey) -> NDArray[np.uint8]:
    """A grey picture four times as large, in RGB."""
    return np.asarray(np.repeat(np.kron(grey, np.ones((4, 4), np.uint8))[..., None], 3, axis=2))
