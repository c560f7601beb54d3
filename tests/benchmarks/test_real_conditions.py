"""The benchmark of real conditions in miniature: what they cost, and a sheet of what they show."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "real_conditions.py"


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(SCRIPT), *arguments], capture_output=True, text=True, timeout=300, check=False
    )


@pytest.mark.costly
def test_it_tells_what_a_step_costs_under_each_preset() -> None:
    done = run("--pairs", "1", "--presets", "none,real")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert list(found) == ["none", "real"]
    assert found["none"]["ratio"] == 1.0
    assert all(each["microseconds"] > 0.0 for each in found.values())
    assert 0.5 < found["real"]["ratio"] < 3.0  # another process may meet one of the two


@pytest.mark.costly
def test_its_sheet_shows_pictures_that_differ_and_those_of_a_folder(tmp_path: Path) -> None:
    for name, level in (("a", 10), ("b", 250)):
        Image.new("RGB", (320, 240), (level, level, level)).save(tmp_path / f"{name}.jpg")
    done = run("--sheet", str(tmp_path / "sheet.webp"), "--beside", str(tmp_path))
    assert done.returncode == 0, done.stderr
    sheet = np.asarray(Image.open(tmp_path / "sheet.webp").convert("L"), float)
    assert sheet.shape == (4 * 124, 2 * 6 * 164)  # four rows of six pictures of 160 x 120 in frames, twice
    ours = sheet[:, : 6 * 164].reshape(4, 124, 6, 164)[:, 10:110, :, 10:150]
    assert ours.std(axis=(1, 3)).min() > 3.0  # no picture is of one brightness
    assert np.ptp(ours.mean(axis=(1, 3))) > 20.0
    beside = sheet[:, 6 * 164 :].reshape(4, 124, 6, 164)[:, 10:110, :, 10:150].mean(axis=(1, 3))
    assert beside[0, 0] == pytest.approx(10, abs=4)
    assert beside[-1, -1] == pytest.approx(250, abs=4)
