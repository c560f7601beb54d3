"""What the page brings for Python is all that it needs: no other file of the package, no library."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from racecraft.site.__main__ import python_files
from racecraft.site.calls import Paying


def test_the_shipped_files_need_python_alone(tmp_path: Path) -> None:
    for name, text in python_files().items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    begin = (
        f"import sys; sys.path.append({str(tmp_path)!r}); import racecraft.site.calls as calls; print(calls.__file__)"
    )
    done = subprocess.run([sys.executable, "-I", "-S", "-c", begin], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert Path(done.stdout.strip()).is_relative_to(tmp_path)


def test_a_function_is_known_to_remember_where_it_does() -> None:
    asked = {"waypoints": [[[0.0, 0.0], [1.0, 0.0]]], "numCars": 1, "numColumns": 1, "seed": 0}
    counting = "n = 0\ndef reward_function(params):\n    global n\n    n += 1\n    return float(n)\n"
    for source, remembers in (
        (counting, True),
        ("def reward_function(params):\n    return 1.0\n", False),
        ("x =", False),
    ):
        assert Paying(json.dumps({**asked, "source": source})).remembers is remembers
