"""Every lesson from top to bottom, as a script and one as a notebook in a real kernel."""

from __future__ import annotations

import json
import os
import re
import resource
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image
from said_in_lessons import STATEMENTS

import quick_worlds
from racecraft.course import checks_of, find_lesson, lessons, to_notebook

LONGEST = 150.0
"""s of CPU, of one core."""
AS_A_SCRIPT = f"{quick_worlds.FIRST_LINE}; import runpy; runpy.run_path(sys.argv[1], run_name='__main__')"
"""As 'racecraft lessons run' does, but that Gymnasium's worlds compute their bits in a fraction of the time."""


@pytest.mark.slow
@pytest.mark.timeout(400)
@pytest.mark.parametrize("number", [lesson.number for lesson in lessons()])
def test_a_lesson_runs_from_top_to_bottom(number: int, tmp_path: Path) -> None:
    lesson = find_lesson(number)
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-c", AS_A_SCRIPT, str(lesson.path)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=380, check=False
    )
    assert done.returncode == 0, done.stderr[-3000:]
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before < LONGEST
    shown = re.findall(r"^\s*show\(", lesson.path.read_text(encoding="utf-8"), re.MULTILINE)
    pictures = list((tmp_path / "runs" / lesson.path.stem).iterdir())
    assert len(pictures) == len(shown) >= 2
    for path in pictures:
        with Image.open(path) as image:
            assert image.width >= 600
            assert len(image.convert("RGB").resize((100, 100)).getcolors(10_000) or []) > 20, "an empty sheet"
    refused = [line for line in done.stdout.splitlines() if line.startswith("✗ Not yet.")]
    assert len(refused) == len(checks_of(number)), "what a learner begins with is no answer"
    assert not (tmp_path / "data").exists(), "and nothing is solved"
    for statement in (one for one in STATEMENTS if one.lesson == number):
        assert statement.holds(done.stdout), f"the text says: {statement.text}"


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_a_notebook_runs_in_a_kernel(tmp_path: Path) -> None:
    nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
    lesson = min(lessons(), key=lambda one: one.facts.seconds)
    notebook = nbformat.reads(json.dumps(to_notebook(lesson.cells())), as_version=4)
    nbformat.validate(notebook)
    resources = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3", resources=resources).execute()
    shown = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert not [output for output in shown if output.output_type == "error"]
    pages = "".join(str(output.get("data", {}).get("text/html", "")) for output in shown)
    assert pages.count("data:image/png;base64,") >= 2
    assert not (tmp_path / "runs").exists(), "a notebook shows its pictures"
