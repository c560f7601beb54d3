"""What a machine lacks to compile Racecraft, in sentences: `make` asks before it sets anything up.

Runs on any Python from 3.11, which has nothing but the standard library.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import sys
import sysconfig
from pathlib import Path

VERSION = f"{sys.version_info.major}.{sys.version_info.minor}"
COMPILERS = ("c++", "g++", "clang++")


def missing() -> list[str]:
    """A sentence for each thing that is not there, with what brings it."""
    lacks = []
    if not any(map(shutil.which, (os.environ.get("CXX") or COMPILERS[0], *COMPILERS))):
        lacks.append(
            f"Racecraft's core is compiled, and none of {', '.join(COMPILERS)} is on PATH. "
            "Debian and Ubuntu: apt install g++; Fedora: dnf install gcc-c++; macOS: xcode-select --install"
        )
    if importlib.util.find_spec("ensurepip") is None:
        lacks.append(
            f"An environment of its own needs ensurepip, which this Python {VERSION} ({sys.executable}) lacks. "
            f"Debian and Ubuntu: apt install python{VERSION}-venv"
        )
    headers = Path(sysconfig.get_path("include"))
    if not (headers / "Python.h").is_file():
        lacks.append(
            f"Racecraft's core is compiled for this Python {VERSION} ({sys.executable}), whose Python.h is not in "
            f"{headers}. Debian and Ubuntu: apt install python{VERSION}-dev; Fedora: dnf install python3-devel"
        )
    return lacks


if __name__ == "__main__":
    for sentence in (found := missing()):
        print(sentence)
    sys.exit(bool(found))
