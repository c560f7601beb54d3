"""What the compiler made of the core: GCC 12 may fuse products with sums although it was told not to."""

from __future__ import annotations

import platform
import re
import shutil
import subprocess

import pytest

from racecraft import _native


@pytest.mark.costly
@pytest.mark.skipif(platform.machine() != "x86_64", reason="these are instructions of x86-64")
def test_no_product_is_fused_with_a_sum_and_a_difference_at_once() -> None:
    """Nobody writes such a pair by hand, so each would be a rounding lost, and bits that differ between machines."""
    objdump = shutil.which("objdump")
    if objdump is None:
        pytest.skip("objdump is not installed")
    code = subprocess.run([objdump, "-d", _native.__file__], capture_output=True, text=True, check=True).stdout
    assert re.search(r"\bvfmadd\d+ps\b", code)  # the learner's own fused sums: this does look at the core
    assert set(re.findall(r"\bvfm(?:addsub|subadd)\w+", code)) == set()
