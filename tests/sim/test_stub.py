"""The committed type stub of the native core is the one that the build generates."""

from __future__ import annotations

import sysconfig
from pathlib import Path

import pytest

import racecraft


def test_stub_is_the_generated_one() -> None:
    committed = Path(racecraft.__file__).with_name("_native.pyi")
    generated = Path(sysconfig.get_paths()["purelib"]) / "racecraft" / "_native.pyi"
    if not generated.exists():
        pytest.skip("the package is not installed from this environment's site-packages")
    assert committed.read_text(encoding="utf-8") == generated.read_text(encoding="utf-8"), "run `make stub`"
