"""Builds the C++ tests with CMake and runs them: as users get the core, and with assertions under sanitizers.

The golden hashes are also compared without any optimisation nor vectors, on an ARM processor, which is emulated, and as
Windows programs under Wine, where it is installed.

    pytest tests/native -m "not slow"     only the release build, of which make test-fast runs the short programs

As users get it means in the very folder in which the installed core was built, whose objects are linked here. The other
builds lie beside it in build/ and are kept as well, so that only what changed is compiled again. Sides of this suite
that run at once share the cores.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROGRAMS = tuple(sorted(path.stem for path in (ROOT / "native/tests").glob("*_test.cpp")))
GOLDEN = tuple(name for name in PROGRAMS if "golden" in (ROOT / f"native/tests/{name}.cpp").read_text())
EMULATED = {  # and the word that chooses the tests: all but those that take an emulator minutes
    "camera_test": "golden",
    "network_test": "golden",
    "lens_test": "",
    "network_sums_test": "",
}
EMULATOR = ("qemu-aarch64", "-L", "/usr/aarch64-linux-gnu")
CROSS_COMPILER = "aarch64-linux-gnu-g++"
ZIG = ROOT / "build/zig/ziglang/zig"
ELSEWHERE = {
    "aarch64": {
        "CMAKE_SYSTEM_NAME": "Linux",
        "CMAKE_SYSTEM_PROCESSOR": "aarch64",
        "CMAKE_CXX_COMPILER": CROSS_COMPILER,
    },
    "windows": {"CMAKE_TOOLCHAIN_FILE": str(ROOT / "native/windows.cmake"), "ZIG": str(ZIG)},
}
LONG = ("camera_test", "engine_test", "network_test", "vehicle_test")
"""Programs that take half a second and more as users get the core."""
SHORT = tuple(name for name in PROGRAMS if name not in LONG)
THREADED = ("engine_test", "thread_pool_test")
TOOLS = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))  # cmake and ninja of this environment
JOBS = max(1, (os.cpu_count() or 1) // int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")))


@cache
def release(programs: tuple[str, ...]) -> Path:
    """The folder of the installed core's own objects, with these programs beside them."""
    python = "cp312-abi3" if sys.version_info >= (3, 12) else f"cp{sys.version_info.major}{sys.version_info.minor}-*"
    folders = [path.parent for path in (ROOT / "build").glob(f"{python}-*/build.ninja")]
    assert folders, "make build compiles the core"
    return compiled(folders[0], programs)


@cache
def build(
    name: str,
    build_type: str,
    sanitizers: str = "",
    programs: tuple[str, ...] = PROGRAMS,
    *,
    portable: bool = False,
    elsewhere: str = "",
    **environment: str,
) -> Path:
    """Configure and compile, and give the folder of the programs."""
    folder = ROOT / "build" / f"cpp-{name}"
    settings = {
        "RACECRAFT_SANITIZE": sanitizers,
        "RACECRAFT_PORTABLE": "ON" if portable else "OFF",
        "CMAKE_BUILD_TYPE": build_type,
    }
    settings |= ELSEWHERE.get(elsewhere, {})
    options = (f"-D{key}={value}" for key, value in settings.items())
    run([cmake(), "-S", ROOT, "-B", folder, "-G", "Ninja", *options], **environment)
    return compiled(folder, programs, **environment)


def compiled(folder: Path, programs: tuple[str, ...] = PROGRAMS, **environment: str) -> Path:
    run([cmake(), "--build", folder, "--parallel", str(JOBS), "--target", *programs], **environment)
    return folder


def cmake() -> str:
    found = shutil.which("cmake", path=TOOLS)
    if found is None:
        pytest.skip("cmake is not installed")
    return found


def run(command: list[str | Path], **environment: str) -> str:
    """The output of a command that must succeed."""
    done = subprocess.run(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, "PATH": TOOLS, **environment},
        timeout=1200,
        check=False,
    )
    assert done.returncode == 0, f"{command[0]} returned {done.returncode}:\n{done.stdout[-6000:]}"
    return done.stdout


@cache
def runs(folder: Path, programs: tuple[str, ...] = PROGRAMS, *words: str, **environment: str) -> dict[str, Future[str]]:
    """Every program of a build, run as many at a time as there are cores for them, since most have one thread.

    A program runs the tests whose names hold one of the words, or all.
    """
    with ThreadPoolExecutor(JOBS) as pool:
        return {name: pool.submit(run, [folder / name, *words], **environment) for name in programs}


@pytest.mark.costly
@pytest.mark.parametrize("program", [*SHORT, *(pytest.param(name, marks=pytest.mark.costly) for name in LONG)])
def test_release(program):
    programs = LONG if program in LONG else SHORT
    runs(release(programs), programs)[program].result()


@pytest.mark.slow
@pytest.mark.parametrize("program", GOLDEN)
def test_without_optimisation_the_golden_hashes_are_the_same(program):
    # What the optimiser makes of the kernels is compared with the hashes by the release build, per instruction set.
    folder = build("debug", "Debug", programs=GOLDEN, portable=True)
    told = runs(folder, GOLDEN, "golden")[program].result()
    assert re.search(r"^ok .*golden", told, flags=re.MULTILINE), told


@pytest.mark.slow
@pytest.mark.parametrize("program", EMULATED)
def test_an_arm_processor_computes_the_same_bits(program):
    for tool in (CROSS_COMPILER, EMULATOR[0]):
        if shutil.which(tool) is None:
            pytest.skip(f"{tool} is not installed")
    folder = build("aarch64", "Release", programs=tuple(EMULATED), elsewhere="aarch64")
    told = run([*EMULATOR, folder / program, EMULATED[program]])
    assert re.search(r"^ok ", told, flags=re.MULTILINE), told


@pytest.fixture(scope="module")
def wine_prefix(tmp_path_factory):
    return str(tmp_path_factory.mktemp("wine"))  # not in build/, as it holds a link to all that this machine has


@pytest.mark.slow
@pytest.mark.parametrize("program", PROGRAMS)
def test_windows_programs_compute_the_same_bits(program, wine_prefix):
    if shutil.which("wine") is None:
        pytest.skip("Wine is not installed")
    if not ZIG.exists():
        pytest.skip("Zig is not here: make site")
    folder = ROOT / "build/cpp-windows"
    cache = str(folder / "zig")
    build("windows", "Release", elsewhere="windows", ZIG_GLOBAL_CACHE_DIR=cache, ZIG_LOCAL_CACHE_DIR=cache)
    told = run(["wine", folder / f"{program}.exe"], WINEPREFIX=wine_prefix, WINEDEBUG="-all")
    assert re.search(r"^ok ", told, flags=re.MULTILINE), told


@pytest.mark.slow
@pytest.mark.parametrize("program", PROGRAMS)
def test_address_and_undefined_behaviour_sanitizers_find_nothing(program):
    runs(build("asan", "None", "address,undefined"), ASAN_OPTIONS="detect_leaks=1")[program].result()


@pytest.mark.slow
@pytest.mark.parametrize("program", THREADED)
def test_thread_sanitizer_finds_nothing(program):
    # Which thread touches what is decided above the kernels, whose instruction set is no matter here.
    folder = build("tsan", "Release", "thread", THREADED, portable=True)
    runs(folder, THREADED, TSAN_OPTIONS="halt_on_error=1")[program].result()


def test_every_type_of_the_core_has_a_name_of_its_own():
    # Two types of one name in two files are one type to the linker, which then takes either's functions.
    names = Counter()
    for path in sorted((ROOT / "native").glob("*/**/*.[ch]pp")):
        if "tests" in path.parts:
            continue
        text = re.sub(r"^namespace \{$.*?^\}  // namespace$", "", path.read_text(), flags=re.MULTILINE | re.DOTALL)
        names.update(re.findall(r"^(?:struct|class|union|enum class|enum) ([\w:]+)[^;]*?\{", text, flags=re.MULTILINE))
    assert len(names) > 20
    assert {name: count for name, count in names.items() if count > 1} == {}


def test_kernels_bring_no_code_that_another_instruction_set_could_link():
    # A template of the standard library compiled for AVX-512 and chosen by the linker would crash older CPUs.
    nm = shutil.which("nm")
    if nm is None:
        pytest.skip("nm is not installed")
    folder = release(SHORT)
    objects = [p for isa in ("avx2", "avx512") for p in folder.glob(f"CMakeFiles/racecraft_kernels_{isa}.dir/**/*.o")]
    if not objects:
        pytest.skip("this machine's build has one instruction set")
    for path in objects:
        symbols = run([nm, "--defined-only", "--demangle", path]).splitlines()
        weak = [line for line in symbols if re.match(r"\w+ [WVu] ", line)]
        assert weak == [], path.name
