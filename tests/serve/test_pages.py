"""The console's pages in real headless Chromium, against a real server and a real short training."""

from __future__ import annotations

import io
import json
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from browsers import ROOT, THEMES, needs_axe, needs_browser, needs_pages, violations_by_theme, visiting
from running_consoles import RunningConsole, running_console

from until_true import until_true

if TYPE_CHECKING:
    from playwright.sync_api import Page

WEB = ROOT / "web"
BUILT = ROOT / "src" / "racecraft" / "serve" / "pages" / "index.html"


def test_the_committed_openapi_is_the_servers() -> None:
    """To renew it: python -m racecraft.serve.openapi > web/openapi.json."""
    from racecraft.serve.openapi import document

    assert json.loads((WEB / "openapi.json").read_text()) == document()


def test_the_editor_knows_every_key_of_params() -> None:
    import re

    from racecraft.reward.params import TEMPLATE

    source = (WEB / "src" / "lib" / "params.ts").read_text()
    assert re.findall(r"^  (\w+):\s+\"", source, re.MULTILINE) == list(TEMPLATE)


def test_what_the_server_names_is_in_the_catalogue() -> None:
    import re

    from racecraft.serve.rewards.routes import list_actions, list_rewards

    catalogue = (WEB / "src" / "i18n" / "en" / "presets.ts").read_text()
    known = dict(re.findall(r'^  (\w+):\s+"(.*)",$', catalogue, re.MULTILINE))
    assert {f"preset_{reward.name}" for reward in list_rewards()} <= known.keys()
    assert {f"preset_name_{reward.name}" for reward in list_rewards()} <= known.keys()
    assert {f"space_name_{space.name}" for space in list_actions()} <= known.keys()
    assert {known[f"space_{space.name}"]: space.name for space in list_actions()} == {
        space.description: space.name for space in list_actions()
    }


def test_the_lock_file_names_no_registry() -> None:
    assert "resolved" not in (WEB / "package-lock.json").read_text()


@needs_pages
def test_the_first_page_is_light_and_loads_nothing_from_elsewhere() -> None:
    import gzip
    import re

    page = BUILT.read_text()
    scripts = re.findall(r'(?:src|href)="(/assets/[^"]+)"', page)
    assert scripts
    assert "http" not in page.replace("http://www.w3.org/2000/svg", "")  # a namespace is not loaded
    sizes = [len(gzip.compress((BUILT.parent / name.lstrip("/")).read_bytes())) for name in scripts]
    assert sum(sizes) < 200_000


@pytest.mark.costly
@needs_pages
def test_scripts_are_sent_as_small_as_a_browser_takes_them(console: RunningConsole) -> None:
    import gzip

    client = console.client
    scripts = sorted((BUILT.parent / "assets").glob("*.js"), key=lambda path: path.stat().st_size)
    for path in scripts[-3:]:
        address, whole = f"/assets/{path.name}", path.read_bytes()
        sizes = {}
        for wanted, given in (("br, gzip", "gzip"), ("gzip;q=0", None), ("identity", None)):
            with client.stream("GET", address, headers={"accept-encoding": wanted}) as reply:
                data = b"".join(reply.iter_raw())
            assert reply.headers.get("content-encoding") == given
            assert reply.headers["content-type"].startswith("text/javascript")
            assert reply.headers["vary"] == "Accept-Encoding"
            sizes[given] = len(data)
            if given == "gzip":
                assert gzip.decompress(data) == whole
        assert sizes["gzip"] < 0.45 * sizes[None]
        assert sizes[None] == len(whole)


def test_only_large_json_is_compressed_for_who_takes_it(console: RunningConsole) -> None:
    import gzip

    sizes = {}
    for wanted, given in (("gzip, br", "gzip"), ("identity", None), ("gzip;q=0", None)):
        with console.client.stream("GET", "/api/tracks", headers={"accept-encoding": wanted}) as reply:
            data = b"".join(reply.iter_raw())
        assert reply.headers.get("content-encoding") == given
        assert reply.headers["vary"] == "Accept-Encoding"
        assert int(reply.headers["content-length"]) == len(data)
        sizes[given] = len(data)
        listed = json.loads(gzip.decompress(data) if given else data)
        assert "oval" in {track["name"] for track in listed}
    assert sizes["gzip"] < 0.6 * sizes[None]
    small = console.client.get("/api/console", headers={"accept-encoding": "gzip"})
    assert "content-encoding" not in small.headers


@pytest.mark.slow
@pytest.mark.skipif(not (WEB / "node_modules").exists(), reason="web/node_modules is not installed")
@pytest.mark.parametrize("script", ["test", "check"])
def test_the_web_clients_own(script: str) -> None:
    npm = shutil.which("npm")
    assert npm is not None
    done = subprocess.run([npm, "run", "--silent", script], cwd=WEB, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]


@pytest.fixture(scope="module")
def visited() -> Iterator[tuple[RunningConsole, Page]]:
    with (
        tempfile.TemporaryDirectory() as folder,
        running_console(Path(folder) / "runs") as console,
        visiting(console) as visit,
    ):
        yield console, visit.page


ONE_BEST_LAP = r"""() => {
  const told = document.querySelector(".figures dd").innerText.match(/[\d.]+\ss/)?.[0];
  const above = document.querySelector("header p.row").innerText;
  if (told && !above.includes(told)) throw new Error(`${told} is not in ${above}`);
  return told;
}"""  # wherever the page says it, while a training goes on


@pytest.mark.slow
@needs_pages
@needs_browser
def test_a_newcomers_path_to_a_lap_on_video(visited: tuple[RunningConsole, Any]) -> None:
    console, page = visited
    complaints: list[str] = []
    page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: complaints.append(request.url) if not _is_ours(request.url, console) else None)
    page.goto(str(console.client.base_url))
    page.get_by_role("link", name="Make the first model").click()
    page.get_by_text("The function is fine.").wait_for()
    page.get_by_role("button", name="Train now").first.click()
    page.get_by_text("64 cars learning at once").wait_for()
    for drawn in (".scene canvas", "[aria-label='What the car sees']"):
        console.wait_for(lambda: len(_colours(page.locator(drawn).screenshot())) > 20)  # noqa: B023
    page.get_by_role("button", name="From above").click()
    until_true(page, ONE_BEST_LAP)
    page.locator(".badge.finished").wait_for()
    page.get_by_role("tab", name="Evaluation").click()
    page.get_by_role("spinbutton", name="Laps").fill("1")
    page.get_by_role("button", name="Start an evaluation").click()
    video = page.locator("video")
    video.wait_for()
    assert console.client.get(str(video.get_attribute("src"))).headers["content-type"] == "video/mp4"
    page.get_by_role("heading", name="Replay").wait_for()
    page.get_by_role("link", name="Garage").first.click()
    page.locator(".picture img").wait_for()
    assert complaints == []


@pytest.mark.slow
@needs_pages
@needs_browser
def test_mistakes_are_shown_where_they_are(visited: tuple[RunningConsole, Any]) -> None:
    console, page = visited
    page.goto(f"{console.client.base_url}/create")
    page.get_by_text("The function is fine.").wait_for()
    page.locator(".cm-line", has_text='"is_offtrack"').get_by_text('"is_offtrack"').hover()
    page.locator(".cm-tooltip", has_text="No wheel is on the road.").wait_for()
    editor = page.locator(".cm-content")
    editor.click()
    page.keyboard.press("ControlOrMeta+a")
    page.keyboard.insert_text("def reward_function(params):\n    return parms['speed']\n")
    page.get_by_text("parms").nth(1).wait_for()
    trains = page.get_by_role("button", name="Train now")
    assert [trains.nth(place).is_disabled() for place in range(2)] == [True, True]
    assert page.get_by_text("There is a mistake in the reward function.").count() == 2  # beside each of them
    page.keyboard.press("ControlOrMeta+a")
    page.keyboard.press("Delete")
    page.get_by_text("Write a reward function, or choose a preset.").nth(2).wait_for()  # and below the editor
    assert [trains.nth(place).is_disabled() for place in range(2)] == [True, True]


@pytest.fixture(scope="module")
def flaws(visited: tuple[RunningConsole, Any]) -> dict[str, dict[str, Any]]:
    """What axe finds in each theme on pages that are opened once for both."""
    console, page = visited
    model = next(iter(console.client.get("/api/models").json()), None)
    own = [f"/models/{model['name']}/{tab}" for tab in ("watch", "race", "setup")] if model else []
    found: dict[str, dict[str, Any]] = {theme: {} for theme in THEMES}
    for path in ("/", "/create", "/tracks", "/settings", *own):
        page.goto(f"{console.client.base_url}{path}")
        page.locator("h1").wait_for()
        page.wait_for_timeout(1000)
        for theme, there in violations_by_theme(page).items():
            found[theme] |= {path: there} if there else {}
    return found


@pytest.mark.slow
@needs_pages
@needs_browser
@needs_axe
@pytest.mark.parametrize("theme", THEMES)
def test_axe_finds_nothing_serious(flaws: dict[str, dict[str, Any]], theme: str) -> None:
    assert flaws[theme] == {}


@pytest.mark.slow
@needs_pages
@needs_browser
def test_paper_is_dark_on_white_whatever_the_screen_is(visited: tuple[RunningConsole, Any]) -> None:
    console, page = visited
    page.goto(f"{console.client.base_url}/settings")
    page.evaluate("localStorage.setItem('racecraft-theme', 'dark')")
    page.reload()
    page.locator("html[data-theme=dark] h1").wait_for()
    colour = "getComputedStyle(document.querySelector('h1')).color"
    screen = page.evaluate(colour)
    page.emulate_media(media="print")
    paper = page.evaluate(colour)
    assert page.evaluate("getComputedStyle(document.documentElement).backgroundColor") == "rgb(255, 255, 255)"
    assert (screen, paper) == ("rgb(237, 240, 243)", "rgb(27, 31, 36)")
    assert not page.locator("nav").first.is_visible()
    page.emulate_media(media="screen")
    assert page.locator("nav").first.is_visible()
    page.evaluate("localStorage.removeItem('racecraft-theme')")


def _colours(png: bytes) -> set[Any]:
    from PIL import Image

    pixels = np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).reshape(-1, 3)
    return set(map(tuple, pixels.tolist()))


def _is_ours(url: str, console: RunningConsole) -> bool:
    return url.startswith((str(console.client.base_url), "data:", "blob:"))
