"""The benchmark of the tab finds its way about the page as it is."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "benchmarks" / "site.py"

pytest.importorskip("playwright")


@pytest.mark.costly
@pytest.mark.slow
@pytest.mark.skipif(not (ROOT / "build/site/index.html").exists(), reason="The site is not built: make site")
@pytest.mark.skipif(not shutil.which("chromium"), reason="Chromium is not installed")
def test_the_script_trains_in_the_tab_and_beside_it() -> None:
    command = [sys.executable, str(SCRIPT), "--only", "page", "pace", "--seeds", "1", "--steps", "1024", "--json"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert len(told["five_laps"]["wall_seconds"]) == 1
    assert 0 < told["bytes"]["core"] < told["bytes"]["before_first_car"] <= 500_000
    assert told["bytes"]["core"] <= 120_000
    assert told["train"]["of_native"] == pytest.approx(
        told["train"]["steps_per_second"] / told["train"]["native_steps_per_second"]
    )
