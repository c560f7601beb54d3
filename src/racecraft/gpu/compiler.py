"""NVRTC: CUDA source to machine code, on any machine, with the arithmetic of the CPU.

No fused multiply-add, exact division and square root, subnormal numbers kept: the bits are those of the native core.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from racecraft.errors import ConfigError
from racecraft.extras import needed_for

ARITHMETIC: Final = ("--fmad=false", "--prec-div=true", "--prec-sqrt=true", "--ftz=false")
LANGUAGE: Final = ("--std=c++20", "-default-device", "-w")
INSTALL: Final = "Install it: pip install 'racecraft[cuda]'"


def compile_program(
    source: str,
    *,
    name: str,
    architecture: str,
    include: Path | None = None,
    defines: Mapping[str, object] | None = None,
    cache: Path | None = None,
) -> bytes:
    """Compile a program.

    Args:
        source: CUDA C++.
        name: What errors call it.
        architecture: ``sm_90`` for machine code (cubin), ``compute_90`` for PTX.
        include: Folder of its headers.
        defines: Macros.
        cache: Folder that keeps what was compiled; None compiles anew.

    Raises:
        ConfigError: NVRTC is not installed, does not know the architecture, or refuses the source.
    """
    with needed_for("Compiling for a GPU"):
        from cuda.bindings import nvrtc
    options = [*LANGUAGE, *ARITHMETIC, f"-arch={architecture}"]
    options += [f"-D{key}={value}" for key, value in (defines or {}).items()]
    try:
        version = _checked(nvrtc.nvrtcVersion(), nvrtc)
    except (RuntimeError, OSError) as error:
        raise ConfigError(f"NVRTC, the CUDA compiler, cannot be loaded: {error}.", hint=INSTALL) from error
    kept = None if cache is None else cache / f"{_digest(source, include, options, version)}.bin"
    if kept is not None and kept.is_file():
        return kept.read_bytes()
    if include is not None:
        options += [f"-I{include}", f"-I{include / 'racecraft'}"]
    program = _checked(nvrtc.nvrtcCreateProgram(source.encode(), name.encode(), 0, None, None), nvrtc)[0]
    try:
        (status,) = nvrtc.nvrtcCompileProgram(program, len(options), [option.encode() for option in options])
        if status != nvrtc.nvrtcResult.NVRTC_SUCCESS:
            raise ConfigError(f"{name} does not compile for {architecture}: {status.name}.\n{_log(program, nvrtc)}")
        if architecture.startswith("sm_"):
            size, get = nvrtc.nvrtcGetCUBINSize, nvrtc.nvrtcGetCUBIN
        else:
            size, get = nvrtc.nvrtcGetPTXSize, nvrtc.nvrtcGetPTX
        code = bytes(_checked(size(program), nvrtc)[0])
        _checked(get(program, code), nvrtc)
    finally:
        nvrtc.nvrtcDestroyProgram(program)
    if kept is not None:
        _keep(kept, code)
    return code


def cache_folder() -> Path:
    """Where compiled programs are kept between processes."""
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "racecraft" / "cuda"


def _digest(source: str, include: Path | None, options: list[str], version: tuple[Any, ...]) -> str:
    """Of all that decides the code."""
    digest = hashlib.sha256(repr((source, options, version)).encode())
    for path in sorted(include.rglob("*.hpp")) if include is not None else ():
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _keep(path: Path, code: bytes) -> None:
    """Store a program whole or not at all; a disk that takes none only costs time."""
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
            file.write(code)
        os.replace(file.name, path)


def _log(program: Any, nvrtc: Any) -> str:
    text = bytes(_checked(nvrtc.nvrtcGetProgramLogSize(program), nvrtc)[0])
    _checked(nvrtc.nvrtcGetProgramLog(program, text), nvrtc)
    return text.rstrip(b"\0\n").decode("utf-8", "replace")


def _checked(result: tuple[Any, ...], nvrtc: Any) -> tuple[Any, ...]:
    if result[0] != nvrtc.nvrtcResult.NVRTC_SUCCESS:
        raise ConfigError(f"NVRTC, the CUDA compiler, failed: {result[0].name}.")
    return result[1:]
