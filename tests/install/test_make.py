"""What `make` says where something that it needs is too old or missing."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MODULES = {"web": "web", "provider": "tests/serve/identity_provider"}


@pytest.mark.parametrize("folder", MODULES.values(), ids=MODULES)
@pytest.mark.parametrize(
    ("version", "will_do"),
    [
        *((old, False) for old in ("v18.19.1", "v20.18.9", "v21.9.0", "v22.11.0")),
        *((new, True) for new in ("v20.19.0", "v22.12.0", "v23.0.0", "v24.1.0")),
    ],
)
def test_a_node_that_is_too_old_is_told_before_npm_fails(
    tmp_path: Path, folder: str, version: str, will_do: bool
) -> None:
    make = shutil.which("make")
    if make is None:
        pytest.skip("make is not installed")
    for tool, script in {"node": f"echo {version}", "npm": "echo npm was asked; exit 1"}.items():
        (tmp_path / tool).write_text(f"#!/bin/sh\n{script}\n")
        (tmp_path / tool).chmod(0o755)
    told = subprocess.run(
        [make, "-C", ROOT, "-W", f"{folder}/package.json", f"{folder}/node_modules/.package-lock.json"],
        env={**os.environ, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert told.returncode == 2
    assert ("npm was asked" in told.stdout) == will_do, told.stdout
    assert (f"node on PATH is {version}" in told.stdout) == (not will_do), told.stdout


@pytest.mark.parametrize(
    ("lacking", "path", "says"),
    [
        ("sysconfig.get_path = lambda name: '/nowhere'", None, "Python.h is not in /nowhere"),
        ("sys.modules['ensurepip'] = None", None, "-venv"),
        ("", "", "apt install g++"),
        ("", None, ""),
    ],
    ids=["headers", "ensurepip", "compiler", "nothing"],
)
def test_what_a_machine_lacks_is_told_before_anything_is_set_up(
    tmp_path: Path, lacking: str, path: str | None, says: str
) -> None:
    make = shutil.which("make")
    if make is None:
        pytest.skip("make is not installed")
    (tmp_path / "sitecustomize.py").write_text(f"import sys, sysconfig\n{lacking}\n")
    python = tmp_path / "python"
    change = "" if path is None else f"PATH={tmp_path}"
    python.write_text(
        f"""#!/bin/sh
[ "$1" = tools/prerequisites.py ] || exit 1
PYTHONPATH={tmp_path} {change} exec {sys.executable} "$@"
"""
    )
    python.chmod(0o755)
    environment = tmp_path / ".venv"
    told = subprocess.run(
        [make, "-C", ROOT, f"VENV={environment}", f"PYTHON={python}", f"{environment}/pyvenv.cfg"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert told.returncode == 2
    assert not environment.exists()
    if says:
        assert says in told.stdout
    assert ("Set-up, once" in told.stdout) == (not says), told.stdout
