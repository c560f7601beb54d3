"""The wheel, as users get it: in an empty environment and an empty folder, without a compiler."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tarfile
import urllib.request
import zipfile
from pathlib import Path

import pytest

from racecraft import _native

ROOT = Path(__file__).parents[2]
PAGES = ROOT / "src/racecraft/serve/pages/index.html"
TOOLS = Path(sys.executable).parent

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(900),
    pytest.mark.skipif(not PAGES.exists(), reason="the console's pages are not built: make wheel"),
]


def run(*command: str | Path, path: str, cwd: Path) -> str:
    """What a command that must succeed printed."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "VIRTUAL_ENV"))}
    done = subprocess.run(
        command, cwd=cwd, env={**environment, "PATH": path}, capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]
    return done.stdout


@pytest.fixture(scope="module")
def dist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that `make wheel` would fill."""
    folder = tmp_path_factory.mktemp("dist")
    build = ("--sdist", "--wheel", "--no-build-isolation", "--out-dir", folder)
    path = os.pathsep.join((str(TOOLS), os.environ["PATH"]))
    run(TOOLS / "uv", "build", "-q", "--python", sys.executable, *build, path=path, cwd=ROOT)
    return folder


@pytest.fixture(scope="module")
def installed(dist: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The programs of an environment that has the wheel, what it needs, and nothing else."""
    folder = tmp_path_factory.mktemp("empty")
    (wheel,) = dist.glob("*.whl")
    path = os.environ["PATH"]
    run(TOOLS / "uv", "venv", "-q", "--python", sys.executable, folder / "venv", path=path, cwd=folder)
    where = ("--python", folder / "venv/bin/python", "-c", ROOT / "requirements/serve.txt")
    run(TOOLS / "uv", "pip", "install", "-q", *where, f"racecraft[serve] @ {wheel.as_uri()}", path=path, cwd=folder)
    return folder / "venv/bin"


def test_a_wheel_is_small_and_has_the_pages_and_an_sdist_has_them_too(dist: Path) -> None:
    (wheel,) = dist.glob("*.whl")
    assert wheel.stat().st_size < 4e6
    python = "cp311-cp311" if sys.version_info < (3, 12) else "cp312-abi3"
    assert python in wheel.name
    names = zipfile.ZipFile(wheel).namelist()
    pages = {path.relative_to(ROOT / "src").as_posix() for path in PAGES.parent.rglob("*") if path.is_file()}
    assert pages <= set(names)
    assert not [name for name in names if name.startswith(("tests/", "web/")) or name.endswith(".pyc")]
    (sdist,) = dist.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        inside = {name.partition("/src/")[2] for name in archive.getnames()}
    assert pages <= inside


def test_a_wheel_trains_evaluates_and_serves_without_a_compiler(installed: Path, tmp_path: Path) -> None:
    path = str(installed)
    build = json.loads(run(installed / "racecraft", "--version", "--json", path=path, cwd=tmp_path))
    assert build["instruction_sets"] == _native.available_isas()
    assert build["commit"] is None
    listed = json.loads(run(installed / "racecraft", "lessons", "--json", path=path, cwd=tmp_path))["lessons"]
    assert [Path(one["path"]).name for one in listed] == [path.name for path in sorted(ROOT.glob("lessons/*.py"))]
    assert not [one for one in listed if ROOT in Path(one["path"]).parents]
    german = {path.name: path.read_bytes() for path in ROOT.glob("lessons/de/*")}
    assert {path.name: path.read_bytes() for path in Path(listed[0]["path"]).parent.glob("de/*")} == german != {}
    options = ("--until", "5 laps", "--seed", "1", "--name", "first", "--json")
    trained = json.loads(run(installed / "racecraft", "train", *options, path=path, cwd=tmp_path))
    assert trained["reason"] == "laps"
    run(installed / "racecraft", "evaluate", "runs/first", "--laps", "1", path=path, cwd=tmp_path)
    assert list(tmp_path.glob("runs/first/**/*.mp4"))
    command = (installed / "racecraft", "serve", "--json", "--no-browser", "--port", "0")
    with subprocess.Popen(
        command, cwd=tmp_path, env={**os.environ, "PATH": path}, stdout=subprocess.PIPE, text=True
    ) as console:
        try:
            assert console.stdout is not None
            link = json.loads(console.stdout.readline())["link"]
            with urllib.request.build_opener(urllib.request.HTTPCookieProcessor()).open(link, timeout=30) as answer:
                page = answer.read().decode()
        finally:
            console.terminate()
    before, after = PAGES.read_text(encoding="utf-8").split("__NONCE__", 1)
    assert page.startswith(before)
    assert page[len(before) :].count("<script") == after.count("<script")
