"""Where the driver's camera sits and what it sees; the picture itself is drawn by the native renderer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from racecraft.checks import check_choice, check_number, check_whole, make_plain

PALETTES: Final = ("2018", "2020", "2026")
LUMA: Final = (0.2989, 0.587, 0.114)
"""What the original weighs red, green and blue with to make grey (ITU-R BT.601)."""


@dataclass(frozen=True, kw_only=True)
class CameraSpec:
    """The front camera of the original car, 160 x 120 grey at 15 Hz."""

    width: int = 160
    """Pixels."""
    height: int = 120
    """Pixels."""
    horizontal_fov: float = 1.13
    """rad, 64.7 degrees."""
    forward: float = 0.14529
    """m, lens ahead of the car's origin."""
    left: float = 0.0
    """m, lens to the left of the car's centre plane."""
    above_ground: float = 0.1314
    """m, lens above the road, as fitted to frames of the original."""
    pitch: float = 0.2385
    """rad, downwards, as fitted; the original's drawing says 0.2618, but its car squats a little."""
    baseline: float = 0.0
    """m between the two lenses of a stereo camera, half of it to either side of `left`; 0 for one lens. AWS's
    has 0.06."""
    age: float = 0.0
    """s that a picture is old when the command that answers it begins to act, 0 to 1/15; rounded to whole substeps of
    physics. What moves besides the car is drawn where it is at the end of the step."""
    palette: str = "2018"
    """Colours of the world: ``2018``, ``2020`` or ``2026``."""

    def __post_init__(self) -> None:
        check_whole("Camera setting width", self.width, 8, 2048)
        check_whole("Camera setting height", self.height, 8, 2048)
        limits = {
            "horizontal_fov": (0.1, 2.8),
            "forward": (-2.0, 2.0),
            "left": (-2.0, 2.0),
            "above_ground": (0.02, 0.9),
            "pitch": (0.0, 1.5),
            "baseline": (0.0, 0.5),
            "age": (0.0, 1.0 / 15.0),
        }
        for name, (low, high) in limits.items():
            check_number(f"Camera setting {name}", getattr(self, name), low, high)
        check_choice("Camera palette", self.palette, PALETTES)
        make_plain(self)

    @property
    def left_lens(self) -> CameraSpec:
        """The camera of its one lens, or of the left one of two."""
        return replace(self, left=self.left + 0.5 * self.baseline, baseline=0.0)


CAMERAS: Final = {
    "2018": CameraSpec(),
    "2020": CameraSpec(palette="2020"),
    "2026": CameraSpec(palette="2026", pitch=0.2365, age=0.0275),
}
"""The original's camera over the years. That of 2026 is fitted to a lap of its frames and judged by another
(``docs/fidelity.md``): colours and sheen, the pitch, and how much older a frame is than the row that comes next."""
