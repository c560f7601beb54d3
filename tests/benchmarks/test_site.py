"""The benchmark of the tab finds its way about the page as it is."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "benchmarks" / "site.py"
FEW_FRAMES = (
    "import drawn_frames, few_frames, runpy, sys; drawn_frames.COUNT_FRAMES += ';' + few_frames.FEW_FRAMES; "
    "del sys.argv[0]; runpy.run_path(sys.argv[0], run_name='__main__')"
)
"""The script as it is, but that the page is drawn four times a second, which leaves the processor to the training."""

pytest.importorskip("playwright")


@pytest.mark.costly
@pytest.mark.slow
@pytest.mark.skipif(not (ROOT / "build/site/index.html").exists(), reason="The site is not built: make site")
@pytest.mark.skipif(not shutil.which("chromium"), reason="Chromium is not installed")
def test_the_script_trains_in_the_tab_and_beside_it() -> None:
    arguments = ["--only", "page", "pace", "--seeds", "1", "--steps", "1024", "--json"]
    command = [sys.executable, "-c", FEW_FRAMES, str(SCRIPT), *arguments]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((str(SCRIPT.parent), str(ROOT / "tests")))}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert len(told["five_laps"]["wall_seconds"]) == 1
    assert 0 < told["bytes"]["core"] < told["bytes"]["before_first_car"] <= 500_000
    assert told["bytes"]["core"] <= 120_000
    assert told["train"]["of_native"] == pytest.approx(
        told["train"]["steps_per_second"] / told["train"]["native_steps_per_second"]
    )
