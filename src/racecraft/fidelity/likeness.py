"""How much two pictures of the driver's camera look alike: brightness, structure, and where the edges are."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.sim.camera import LUMA

WINDOW: Final = 1.5  # standard deviation of the similarity's window, pixels
WINDOW_RADIUS: Final = 5  # pixels, 11 x 11 as in the paper
STABILISERS: Final = ((0.01 * 255) ** 2, (0.03 * 255) ** 2)
FINER: Final = 8  # parts of a pixel in which edges are told apart
DARK: Final = 70.0  # brightness that walls stay under and the field is above
WHITE: Final = 150.0  # the darkest channel of a white line is above it
ORANGE: Final = 75.0  # red less blue of a dash is above it

Picture = NDArray[Any]


def mean_difference(a: Picture, b: Picture) -> float:
    """Mean absolute difference of two grey pictures of the same shape, in brightness of 255."""
    return float(np.abs(a.astype(float) - b.astype(float)).mean())


def structural_similarity(a: Picture, b: Picture) -> float:
    """SSIM of two grey pictures (H, W), 1 for the same: the mean over all whole windows.

    Wang et al., "Image quality assessment: from error visibility to structural similarity", 2004, with the paper's
    Gaussian window and constants.
    """
    from scipy import ndimage  # takes long to import; a console that only imports us has not the time

    a, b = a.astype(float), b.astype(float)

    def blur(picture: Picture) -> Picture:
        return np.asarray(ndimage.gaussian_filter(picture, WINDOW, radius=WINDOW_RADIUS))

    mean_a, mean_b = blur(a), blur(b)
    variance = blur(a * a) - mean_a**2 + blur(b * b) - mean_b**2
    covariance = blur(a * b) - mean_a * mean_b
    first, second = STABILISERS
    likeness = (2 * mean_a * mean_b + first) * (2 * covariance + second)
    likeness /= (mean_a**2 + mean_b**2 + first) * (variance + second)
    inside = slice(WINDOW_RADIUS, -WINDOW_RADIUS)
    return float(likeness[inside, inside].mean())


def edge_offsets(seen: Picture, drawn: Picture) -> dict[str, float | None]:
    """How far edges lie apart in two colour pictures (H, W, 3): the 95th percentile along them, in pixels.

    Returns:
        ``horizon`` (the walls' foot), ``lines`` (both sides of the white ones) and ``dashes``; None for what one of
        the pictures does not show.
    """
    return {
        "horizon": _offset(_horizon(seen), _horizon(drawn)),
        "lines": _offset(_outline(seen.min(axis=2), WHITE), _outline(drawn.min(axis=2), WHITE)),
        "dashes": _offset(_outline(_orange(seen), ORANGE), _outline(_orange(drawn), ORANGE)),
    }


def _offset(seen: Picture, drawn: Picture) -> float | None:
    if not seen.any() or not drawn.any():
        return None
    from scipy import ndimage

    distances = ndimage.distance_transform_edt(~drawn)[seen] / FINER
    return float(np.percentile(distances, 95))


def _outline(strength: Picture, level: float) -> Picture:
    """Where a channel crosses a level, on a finer grid of bool."""
    from scipy import ndimage

    high, wide = strength.shape
    above = _between(high) @ strength @ _between(wide).T > level
    return np.asarray(above & ~ndimage.binary_erosion(above, border_value=1))


def _between(count: int) -> Picture:
    """Weights that interpolate so many pixels linearly, (count * FINER, count)."""
    places = (np.arange(count * FINER) + 0.5) / FINER - 0.5
    return np.stack([np.interp(places, np.arange(count), pixel) for pixel in np.eye(count)], axis=1)


def _horizon(picture: Picture) -> Picture:
    """Only the first edge under the upper border, in every column."""
    outline = _outline(picture @ np.array(LUMA), DARK)
    first = np.zeros_like(outline)
    columns = np.flatnonzero(outline.any(axis=0))
    first[outline.argmax(axis=0)[columns], columns] = True
    return first


def _orange(picture: Picture) -> Picture:
    return np.asarray(picture[..., 0] - picture[..., 2])
