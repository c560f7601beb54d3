"""Pictures that real cameras took: the original's simulator on two laps in 2026, and a car on the floor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

SHARED = Path(__file__).parents[2] / "shared"
SIMULATED = SHARED / "params_2026"
FLOOR = SHARED / "frames"


def simulated_frames() -> NDArray[np.uint8]:
    """Of two laps of the original's simulator  (467, 120, 160)."""
    return _read(sorted(SIMULATED.glob("run_*/*.jpg")))


def floor_frames() -> NDArray[np.uint8]:
    """Of a car on the floor, and two more of the simulator  (62, 120, 160)."""
    return _read([*sorted(FLOOR.glob("car/*.jpg")), *sorted(FLOOR.glob("*.png"))])


def _read(files: list[Path]) -> NDArray[np.uint8]:
    pictures = [Image.open(file).convert("L").resize((160, 120), Image.Resampling.BILINEAR) for file in files]
    return np.stack([np.asarray(picture) for picture in pictures])
