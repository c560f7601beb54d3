"""A `racecraft.gpu.Device` on the CPU: the text of the very same kernels, compiled by the C++ compiler.

A block's threads run one after the other (native/gpu/kernel.hpp), so what is compared with the engine is every line of
a kernel but the hardware's own scheduling.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pytest

# GCC 12 vectorises pairs of double -> float -> double conversions and forgets to round: not on a GPU, so not here.
ARITHMETIC = ("-O2", "-fno-tree-slp-vectorize", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math")


@cache
def library(source: str, include: Path | None, defines: tuple[tuple[str, object], ...]) -> ctypes.CDLL:
    """A program as a library of functions run_<kernel>."""
    compiler = shutil.which("c++") or shutil.which("g++")
    if compiler is None:
        pytest.skip("there is no C++ compiler")
    folder = Path(mkdtemp(prefix="racecraft-kernels-"))
    (folder / "program.cpp").write_text(source)
    options = ["-std=c++20", *ARITHMETIC, "-fPIC", "-shared", *(f"-D{key}={value}" for key, value in defines)]
    options += [f"-I{include}"] if include is not None else []
    done = subprocess.run(
        [compiler, *options, folder / "program.cpp", "-o", folder / "program.so"],
        stderr=subprocess.PIPE,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stderr
    loaded = ctypes.CDLL(str(folder / "program.so"))
    shutil.rmtree(folder)
    return loaded


class HostDevice:
    """Memory and kernels of the CPU; arrays are NumPy views."""

    name = "host"

    def __init__(self) -> None:
        self._kernels = {}
        self._memory = {}
        self.launches = []

    def load(self, source, *, name, kernels, include, defines) -> None:
        loaded = library(source, include, tuple(sorted(defines.items())))
        for kernel in kernels:
            self._kernels[kernel] = getattr(loaded, f"run_{kernel}")

    def allocate(self, size: int) -> int:
        memory = np.zeros(max(size, 256) + 64, np.uint8)
        address = (memory.ctypes.data + 63) // 64 * 64
        self._memory[address] = memory
        return address

    def array(self, address, shape, dtype):
        size = int(np.prod(shape)) * np.dtype(dtype).itemsize
        memory = self._memory[address]
        begin = address - memory.ctypes.data
        return memory[begin : begin + size].view(dtype).reshape(shape)

    def write(self, address, data) -> None:
        data = np.ascontiguousarray(data)
        ctypes.memmove(address, data.ctypes.data, data.nbytes)

    def read(self, address, size):
        data = np.empty(size, np.uint8)
        ctypes.memmove(data.ctypes.data, address, size)
        return data

    def fill(self, address, value, size, *, stream=0) -> None:
        ctypes.memset(address, value, size)

    def launch(self, kernel, *, blocks, threads, batch, input, extra, stream) -> None:
        self.launches.append((kernel, blocks, threads))
        aligned = self.allocate(len(batch))
        self.write(aligned, batch)
        self._kernels[kernel](
            ctypes.c_int32(blocks), ctypes.c_void_p(aligned), ctypes.c_void_p(input), ctypes.c_void_p(extra)
        )
        del self._memory[aligned]
