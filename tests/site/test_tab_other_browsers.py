"""The page in Firefox and in WebKit: native's bits, five laps, Python, a download, a drawing, both themes, a phone.

Needs `make site`; a browser that is not there is skipped. Firefox has several threads here and no WebGL; WebKit has no
relaxed SIMD, so there the exact build is tried.
"""

from __future__ import annotations

import base64
import functools
import http.server
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from built_page import SITE, Files
from other_browsers import FIREFOX, SCREEN, WEBKIT, Tab, firefox, webkit
from test_trainer_bits import bits

from racecraft import train
from racecraft.importing import import_run
from racecraft.run import RunFolder

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (SITE / "data" / "plan.json").exists(), reason="the page is not built: make site"),
]
STEPS = 500  # camera steps, of the training whose bits are compared
SEED = 5
FIRST = """(steps, seed, file) => new Promise(async (told, failed) => {
  const read = async (name) => (await fetch(name)).json();
  const [plan, track] = await Promise.all([read("data/plan.json"), read("data/tracks/oval.json")]);
  const address = new URL(`assets/${file}`, location.href).href;
  const text = new Blob([`import ${JSON.stringify(address)};`], { type: "text/javascript" });
  const worker = new Worker(URL.createObjectURL(text), { type: "module" });
  const race = { ...plan.races["time-trial"], evaluateEvery: steps };
  const asked = { plan, race, policy: race.policies.default, objects: race.objects, track, seed };
  const hex = async ({ buffer, byteOffset, byteLength }) => {
    const hash = await crypto.subtle.digest("SHA-256", new Uint8Array(buffer, byteOffset, byteLength).slice());
    return [...new Uint8Array(hash)].map((byte) => byte.toString(16).padStart(2, "0")).join("");
  };
  let loaded;
  worker.onmessage = async ({ data }) => {
    if (data.kind === "ready") worker.postMessage({ kind: "train", ...asked, reward: "centerline", most: steps });
    else if (data.kind === "loaded") loaded = data;
    else if (data.kind === "failed") failed(new Error(data.message));
    else if (data.kind === "evaluation") {
      worker.terminate();
      const { steps, ...state } = data.state;
      const named = ["learning", "average", "simulation", "totals", "lengths", "returnScale"];
      const hashes = await Promise.all(named.map(async (name) => [name, await hex(state[name])]));
      const { completions, lapTimes } = data.evaluation;
      const { isSlow, threads } = loaded;
      told({ isSlow, threads, bits: { steps, ...Object.fromEntries(hashes) }, completions, lapTimes });
    }
  };
  worker.onerror = ({ message }) => failed(new Error(message));
  worker.postMessage({ kind: "load", site: new URL(".", location.href).href, hasPython: false, isTeam: true });
})"""
NAMED = """(name) => [...document.querySelectorAll("button:not(:disabled)")]
  .find((one) => (one.ariaLabel ?? one.innerText).trim() === name)"""
CHOOSE = """(label, value) => {
  const field = [...document.querySelectorAll("select")]
    .find((one) => (one.ariaLabel ?? one.labels[0]?.innerText ?? "").trim().startsWith(label));
  field.value = value;
  field.dispatchEvent(new Event("change", { bubbles: true }));
}"""
WRITE = """(source) => {
  const { view } = document.querySelector(".cm-content").cmTile.root;
  view.dispatch({ changes: { from: 0, to: view.state.doc.length, insert: source } });
}"""  # a key or a paste that is only made up reaches no editor
KEEP_DOWNLOADS = """() => {
  const make = URL.createObjectURL;
  const keep = (blob) => blob.type !== "text/javascript" && (window.downloaded = blob); // workers are made so, too
  URL.createObjectURL = (blob) => (keep(blob), make.call(URL, blob));
}"""
DOWNLOADED = """async () => {
  if (!window.downloaded) return "";
  const bytes = new Uint8Array(await window.downloaded.arrayBuffer());
  return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
}"""
TOO_WIDE = "() => document.documentElement.scrollWidth - document.documentElement.clientWidth"
SLOW = "This browser or machine has no fused multiply-add"


class Isolating(Files):
    """A host that lets its pages have several threads."""

    def end_headers(self) -> None:
        """With the two that it takes."""
        self.send_header("Cross-Origin-Opener-Policy", "same-origin")
        self.send_header("Cross-Origin-Embedder-Policy", "require-corp")
        super().end_headers()


BROWSERS = {  # what opens it, and whether it is there
    "firefox": (firefox, FIREFOX is not None),
    "webkit": (webkit, WEBKIT is not None and SCREEN is not None),
}


class Visitor:
    """Somebody at the page."""

    def __init__(self, tab: Tab) -> None:
        self.tab = tab

    def press(self, name: str) -> None:
        """A button, when it can be pressed."""
        self.tab.wait(f"(name) => {{ const found = ({NAMED})(name); found?.click(); return Boolean(found); }}", name)

    def choose(self, label: str, value: str) -> None:
        """Of a list."""
        self.tab.run(CHOOSE, label, value)

    def read(self, text: str) -> None:
        """Wait until the page says so."""
        self.tab.wait("(text) => document.body.innerText.includes(text)", text)


@pytest.fixture(scope="module", params=BROWSERS)
def visitor(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Visitor]:
    opened, is_there = BROWSERS[request.param]
    if not is_there:
        pytest.skip(f"{request.param} is not installed")
    host = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Isolating, directory=str(SITE.parent)))
    threading.Thread(target=host.serve_forever, daemon=True).start()
    with opened(tmp_path_factory.mktemp(request.param)) as tab:
        tab.open(f"http://127.0.0.1:{host.server_port}/site/")
        tab.wait(f"() => Boolean(({NAMED})('Train'))")
        yield Visitor(tab)
    host.shutdown()
    host.server_close()


@pytest.fixture(scope="module")
def native(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The same training in the installed program."""
    options: dict[str, Any] = {"evaluate_every": STEPS, "until": f"{STEPS} steps", "seed": SEED, "num_threads": 1}
    run = train("oval", reward="centerline", root=tmp_path_factory.mktemp("runs"), **options).run
    saved = RunFolder(run).checkpoints.load("last")
    judged = saved.metadata["evaluator"]["last"]
    return {"bits": bits(saved), "completions": judged["completions"], "lapTimes": judged["lap_times"]}


def test_cars_and_weights_are_native_ones_to_the_bit(visitor: Visitor, native: dict[str, Any]) -> None:
    worker = next((SITE / "assets").glob("worker-*.js")).name
    found = visitor.tab.run(FIRST, STEPS, SEED, worker)
    has_fast = visitor.tab.run("async () => WebAssembly.validate(await (await fetch('core/core.wasm')).arrayBuffer())")
    cores = min(visitor.tab.run("() => navigator.hardwareConcurrency"), 8)
    assert (found.pop("isSlow"), found.pop("threads")) == ((False, cores) if has_fast else (True, 1))
    assert found == native


def test_a_car_learns_and_is_downloaded(visitor: Visitor, tmp_path: Path) -> None:
    visitor.choose("Track", "oval")
    visitor.tab.run(KEEP_DOWNLOADS)
    visitor.press("Train")
    visitor.read("64 cars learning at once")
    draws = "() => document.createElement('canvas').getContext('webgl2') !== null"
    says = "(text) => document.body.innerText.includes(text)"
    if not visitor.tab.run(draws):
        visitor.read("This browser draws no 3D here")
    else:
        assert not visitor.tab.run(says, "This browser draws no 3D here")
    if visitor.tab.run(says, SLOW):
        visitor.press("Stop")  # five laps take minutes
        return
    visitor.read("Paperclip, 5 of 5 laps, best")  # among the models, too
    visitor.press("Download: oval-racing-1")
    archive = tmp_path / "model.tar.gz"
    archive.write_bytes(base64.b64decode(visitor.tab.wait(DOWNLOADED)))
    judged = RunFolder(import_run(archive, root=tmp_path).run).checkpoints.load("best").metadata["evaluator"]["last"]
    visitor.read(f"best {min(judged['lap_times']):.2f}\xa0s")


def test_a_reward_in_python_is_checked_and_trains(visitor: Visitor) -> None:
    visitor.choose("What it is paid for", "own")
    visitor.tab.wait("() => document.querySelector('.cm-content') !== null")
    visitor.tab.run(WRITE, "def reward_function(params): return params['sped']")
    visitor.read("params has no key 'sped'. Did you mean 'speed'?")
    visitor.tab.run(WRITE, "def reward_function(params): return params['speed']")
    visitor.read("The function is fine.")
    visitor.press("Train")
    visitor.read("64 cars learning at once")
    visitor.press("Stop")
    visitor.choose("What it is paid for", "racing")


def test_a_track_is_drawn(visitor: Visitor) -> None:
    visitor.press("Draw a track")
    visitor.read("It can be driven.")
    visitor.press("Back")


def test_the_page_has_two_themes_and_fits_a_phone(visitor: Visitor) -> None:
    background = "() => getComputedStyle(document.documentElement).backgroundColor"
    seen = set()
    for theme in ("light", "dark"):
        visitor.choose("Theme", theme)
        visitor.tab.wait("(theme) => document.documentElement.dataset.theme === theme", theme)
        seen.add(visitor.tab.run(background))
    assert len(seen) == 2
    for width in (390, 768):  # or as narrow as windows get there
        visitor.tab.resize(width, 800)
        visitor.tab.wait("(width) => innerWidth < width + 120", width)
        visitor.tab.wait(f"() => ({TOO_WIDE})() === 0")  # once the charts have followed
