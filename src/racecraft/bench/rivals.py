"""Other people's programs measured beside ours: the scripts of ``benchmarks/rivals`` in a source checkout."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

TIMEOUT_S = 600.0


def measure_rivals(seconds: float) -> dict[str, Any]:
    """Run every rival's script for about so many seconds; a rival that is not installed says so."""
    folder = Path(__file__).parents[3] / "benchmarks" / "rivals"
    scripts = sorted(path for path in folder.glob("*.py") if not path.name.startswith("_"))
    if not scripts:
        return {"skipped": "the rivals' scripts are in the source repository, under benchmarks/rivals"}
    return {script.stem: _measure(script, seconds) for script in scripts}


def _measure(script: Path, seconds: float) -> dict[str, Any]:
    command = [sys.executable, str(script), "--seconds", f"{seconds:g}"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
        if done.returncode == 0:
            document = json.loads(done.stdout.strip().splitlines()[-1])
            if isinstance(document, dict):
                return document
        return {"skipped": done.stderr.strip().splitlines()[-1] if done.stderr.strip() else "no output"}
    except (subprocess.TimeoutExpired, ValueError, IndexError) as error:
        return {"skipped": f"{type(error).__name__}: {error}"}
