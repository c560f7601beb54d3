"""What the tab's builds without a fused multiply-add make of one: the C++ tests of it, as WebAssembly in Node."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]
RUN = """
import { readFileSync } from "node:fs";
import { WASI } from "node:wasi";
const system = new WASI({ version: "preview1", args: ["test"] });
const code = readFileSync(process.argv[1]);
const { instance } = await WebAssembly.instantiate(code, system.getImportObject());
process.exitCode = system.start(instance);
"""


@pytest.mark.parametrize("build", ["exact", "scalar"])
def test_products_are_added_with_one_rounding(build: str) -> None:
    node, program = shutil.which("node"), f"build/wasm/network_sums_test.{build}.wasm"
    if node is None or not (ROOT / "build/zig/ziglang/zig").exists():
        pytest.skip("Node or Zig's compiler is not installed: make site")
    subprocess.run(["make", "-s", program], cwd=ROOT, check=True, capture_output=True)
    command = [node, "--no-warnings", "--input-type=module", "--eval", RUN, "--", str(ROOT / program)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr[-4000:]
    told = done.stdout.split()
    assert "fused_multiply_add_between_two_floats" in told
    assert ("doubled_sums_are_fused_multiply_adds" in told) == (build == "exact")
