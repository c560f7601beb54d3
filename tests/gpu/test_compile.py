"""Every kernel compiles to PTX and to machine code, on machines without a GPU."""

from __future__ import annotations

import re

import pytest

from racecraft import _native
from racecraft.errors import ConfigError
from racecraft.gpu import CudaDevice, compile_program, open_device
from racecraft.sim.cuda_simulation import PROGRAMS, SOURCES

pytest.importorskip("cuda.bindings.nvrtc", reason="cuda-bindings is not installed")
DEFINES = {"RC_BATCH_BYTES": _native.BATCH_BYTES, "RC_IMAGE_WIDTH": 160}


def compiled(name: str, architecture: str) -> bytes:
    source = (SOURCES / f"{name}.cu").read_text()
    return compile_program(source, name=f"{name}.cu", architecture=architecture, include=SOURCES, defines=DEFINES)


def test_every_kernel_of_the_source_is_listed():
    for name, kernels in PROGRAMS.items():
        source = (SOURCES / f"{name}.cu").read_text()
        assert sorted(re.findall(r"^RC_KERNEL\((\w+)", source, re.MULTILINE)) == sorted(kernels)
    assert sorted(path.stem for path in SOURCES.glob("*.cu")) == sorted(PROGRAMS)


@pytest.mark.costly
@pytest.mark.parametrize("name", PROGRAMS)
def test_programs_become_ptx_without_fused_multiply_add(name):
    code = compiled(name, "compute_80").decode()
    for kernel in PROGRAMS[name]:
        assert f".entry {kernel}(" in code
    # Correct rounding, and nothing that rounds once where the CPU rounds twice.
    assert re.findall(r"\b(?:fma\.rn\.f32|fma\.rn\.f64|\w+\.approx\.\w+|\w+\.ftz\.\w+)", code) == []
    assert re.search(r"\b(?:mul|add)\.(?:rn\.)?f32", code)


@pytest.mark.slow
@pytest.mark.parametrize("architecture", ["sm_80", "sm_90", "sm_100"])
@pytest.mark.parametrize("name", PROGRAMS)
def test_programs_become_machine_code(name, architecture):
    code = compiled(name, architecture)
    assert code[:4] == b"\x7fELF"
    for kernel in PROGRAMS[name]:
        assert f".text.{kernel}".encode() in code


def test_machine_code_of_one_program():
    assert compiled("frames", "sm_90")[:4] == b"\x7fELF"


def test_a_batch_of_another_layout_is_refused_by_the_compiler():
    defines = {**DEFINES, "RC_BATCH_BYTES": _native.BATCH_BYTES + 8}
    with pytest.raises(ConfigError, match="host and device disagree"):
        compile_program(
            (SOURCES / "cars.cu").read_text(),
            name="cars.cu",
            architecture="compute_80",
            include=SOURCES,
            defines=defines,
        )


def test_what_does_not_compile_says_where(tmp_path):
    with pytest.raises(ConfigError, match=r"bad\.cu does not compile for sm_90(.|\n)*bad\.cu\(2\): error"):
        compile_program("\nint broken(;", name="bad.cu", architecture="sm_90")
    with pytest.raises(ConfigError, match="sm_1"):
        compile_program("", name="old.cu", architecture="sm_1")


def test_programs_are_compiled_once(tmp_path):
    source = 'extern "C" __global__ void nothing() {}'
    first = compile_program(source, name="a.cu", architecture="compute_80", cache=tmp_path)
    (kept,) = tmp_path.glob("*.bin")
    assert kept.read_bytes() == first
    kept.write_bytes(b"from the cache")
    assert compile_program(source, name="a.cu", architecture="compute_80", cache=tmp_path) == b"from the cache"
    assert compile_program(source + " ", name="a.cu", architecture="compute_80", cache=tmp_path)[:2] != b"fr"
    blocked = tmp_path / "file"
    blocked.write_text("")
    assert compile_program(source, name="a.cu", architecture="compute_80", cache=blocked / "x") == first


def test_names_of_devices_are_checked():
    for name in ("gpu", "cuda:x", "cuda:-1", "CUDA"):
        with pytest.raises(ConfigError, match="allowed are 'cuda'"):
            open_device(name)


def test_a_machine_without_a_gpu_says_so_in_one_sentence():
    try:
        CudaDevice()
    except ConfigError as raised:
        error = raised
    else:
        pytest.skip("this machine has a GPU")
    assert str(error).startswith("Device 'cuda' was asked for, but")
    assert "nvidia-smi" in error.hint
