"""What the page brings for Python is all that it needs: no other file of the package, no library."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from racecraft.site.__main__ import python_files


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
