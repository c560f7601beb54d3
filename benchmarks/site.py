"""How fast cars learn in a browser's tab, how smooth the page stays, and how much is loaded; on a quiet machine.

python benchmarks/site.py [--only page pace threads python slow bits] [--seeds 5] [--json]

Needs `make site`, Playwright and Chromium, and Brotli of Node. With --json the last line is one object; the bits are
those of tests/site, which it runs.
"""

from __future__ import annotations

import argparse
import functools
import http.server
import json
import os
import shutil
import signal
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from drawn_frames import COUNT_FRAMES

PARTS = ["page", "pace", "threads", "python", "slow", "bits"]
ROOT = Path(__file__).parents[1]
SITE = ROOT / "build" / "site"
OPTIONS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-compositing", "--no-sandbox"]
BROTLI = """const { readFileSync } = require("fs"), { brotliCompressSync } = require("zlib");
console.log(JSON.stringify(process.argv.slice(1).map((path) => brotliCompressSync(readFileSync(path)).length)));"""
PATIENCE = 180_000  # ms
SLOWER = 4  # times, like a cheap Chromebook
PERIOD = 0.04  # s, in which a slowed browser runs for a part
TURNS = 3  # of the trainings whose pace is compared, without an evaluation
NATIVE = """
import shutil, sys, time
from racecraft import train
steps, seed = int(sys.argv[1]), int(sys.argv[2])
began = time.monotonic()
result = train("reinvent_2018", reward="racing", until=f"{steps} steps", seed=seed, num_threads=1, evaluate_every=10**9)
seconds = time.monotonic() - began
shutil.rmtree(result.run)
print(steps / seconds)
"""
TRAIN = """async ([site, address, most, seed, isTeam]) => {
  const read = async (file) => (await fetch(new URL(file, site))).json();
  const [plan, track] = await Promise.all([read("data/plan.json"), read("data/tracks/reinvent_2018.json")]);
  const text = `import ${JSON.stringify(new URL(address, site).href)};`;
  const worker = new Worker(URL.createObjectURL(new Blob([text], { type: "text/javascript" })), { type: "module" });
  const race = { ...plan.races["time-trial"], evaluateEvery: 1e9 };
  const asked = { plan, race, policy: race.policies.default, objects: race.objects, track, seed };
  return new Promise((told, failed) => {
    let last, threads;
    worker.onmessage = ({ data }) => {
      if (data.kind === "ready") worker.postMessage({ kind: "train", ...asked, reward: "racing", most });
      else if (data.kind === "loaded") threads = data.threads;
      else if (data.kind === "iteration") last = { steps: data.iteration.steps, seconds: data.seconds };
      else if (data.kind === "failed") failed(new Error(data.message));
      else if (data.kind === "ended") (worker.terminate(), told({ ...last, threads }));
    };
    worker.postMessage({ kind: "load", site, hasPython: false, isTeam });
  });
}"""


class Files(http.server.SimpleHTTPRequestHandler):
    """A static host."""

    asked: list[str] = []  # noqa: RUF012  # of all of them
    more: dict[str, str] = {}  # noqa: RUF012  # headers

    def do_GET(self) -> None:
        """Notes what the page asked for; what its service worker keeps for later is not needed before."""
        if "Service-Worker" not in self.headers and not self.headers.get("Referer", "").endswith("/offline.js"):
            self.asked.append(self.path)
        super().do_GET()

    def end_headers(self) -> None:
        """With those below."""
        for name, value in self.more.items():
            self.send_header(name, value)
        super().end_headers()

    def log_message(self, *_: object) -> None:
        """Says nothing."""


class Isolating(Files):
    """One whose pages may share memory between threads."""

    more = {"Cross-Origin-Opener-Policy": "same-origin", "Cross-Origin-Embedder-Policy": "require-corp"}  # noqa: RUF012


@contextmanager
def hosted(kind: type[Files]) -> Iterator[str]:
    """The site's address."""
    host = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(kind, directory=str(SITE)))
    threading.Thread(target=host.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{host.server_port}/"
    finally:
        host.shutdown()
        host.server_close()


def compressed(paths: Iterable[Path]) -> dict[Path, int]:
    """Bytes of each file by Brotli at its best."""
    files = list(dict.fromkeys(paths))
    done = subprocess.run(["node", "-e", BROTLI, *files], capture_output=True, check=True)
    return dict(zip(files, json.loads(done.stdout), strict=True))


@contextmanager
def browsing(kind: type[Files] = Files) -> Iterator[tuple[Any, str]]:
    """A browser, and the site's address."""
    from playwright.sync_api import sync_playwright

    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    with hosted(kind) as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=OPTIONS)
        yield browser, address
        browser.close()


def in_the_tab(seeds: int) -> dict[str, Any]:
    """Press Train on the page as it opens, once a seed."""
    with browsing() as (browser, address):
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.set_default_timeout(PATIENCE)
        page.add_init_script(COUNT_FRAMES)
        opened = time.monotonic()
        page.goto(address)
        button = page.get_by_role("button", name="Train", exact=True)
        button.wait_for()
        usable = time.monotonic() - opened
        page.get_by_text("It has learned already").wait_for()
        driving = time.monotonic() - opened
        wall, frames = [], []
        before: list[str] = []
        for _ in range(seeds):
            began = time.monotonic()
            button.click()
            page.get_by_text("64 cars learning at once").wait_for()
            before = before or list(dict.fromkeys(Files.asked))
            learning, drawn = time.monotonic(), page.evaluate("drawnFrames")
            page.get_by_text("It drives 5 of 5 laps").wait_for()
            wall.append(time.monotonic() - began)
            frames.append((page.evaluate("drawnFrames") - drawn) / (time.monotonic() - learning))
        version = browser.version
    laps, rate = statistics.median(wall), statistics.median(frames)
    loaded = [SITE / (path.lstrip("/") or "index.html") for path in before if path != "/favicon.ico"]
    sizes = compressed([*loaded, SITE / "core" / "core.wasm"])
    needed, core = sum(sizes[path] for path in loaded), sizes[SITE / "core" / "core.wasm"]
    print(f"Chromium {version}: the page is usable after {usable:.2f} s, a car drives after {driving:.2f} s")
    print(f"5 of 5 laps after {laps:.1f} s (worst {max(wall):.1f} s), {seeds} seeds")
    print(f"{core:,} bytes the core, {needed:,} all before the first car, by Brotli")
    print(f"{rate:.0f} frames/s drawn while 64 cars learn, WebGL by the processor")
    return {
        "chromium": version,
        "usable_seconds": usable,
        "first_car_seconds": driving,
        "five_laps": {"wall_seconds": wall, "median": laps, "worst": max(wall)},
        "frames_per_second": rate,
        "bytes": {"core": core, "before_first_car": needed},
    }


def python() -> dict[str, Any]:
    """What Python adds to that."""
    added = sum(compressed(sorted((SITE / "python").iterdir())).values())
    print(f"{added:,} bytes Python, by Brotli")
    return {"python_bytes": added}


def side_by_side(steps: int) -> dict[str, Any]:
    """The same training in a page's worker and natively, in turns."""
    tab, native = [], []
    with in_a_worker(Files, steps) as train:
        for seed in range(1, TURNS + 1):
            tab.append(train(seed, False)[0])
            native.append(natively(steps, seed))
    pace, beside = statistics.median(tab), statistics.median(native)
    print(f"{pace:,.0f} camera steps/s, {pace / beside:.0%} of native's on one thread with AVX2")
    return {"train": {"steps_per_second": pace, "native_steps_per_second": beside, "of_native": pace / beside}}


def several(steps: int) -> dict[str, Any]:
    """The same training in a page's worker on one thread and on as many as there are, in turns."""
    one, all_ = [], []
    count = 1
    with in_a_worker(Isolating, steps) as train:
        for seed in range(1, TURNS + 1):
            one.append(train(seed, False)[0])
            pace, count = train(seed, True)
            all_.append(pace)
    pace, beside = statistics.median(all_), statistics.median(one)
    print(f"{pace:,.0f} camera steps/s on {count} threads, {pace / beside:.2f} times one thread's {beside:,.0f}")
    return {"threads": {"count": count, "steps_per_second": pace, "one_thread": beside, "of_one": pace / beside}}


@contextmanager
def in_a_worker(kind: type[Files], steps: int) -> Iterator[Callable[[int, bool], tuple[float, int]]]:
    """Trains with a seed, in several threads or not: camera steps per second, and threads."""
    worker = next((SITE / "assets").glob("worker-*.js")).name
    with browsing(kind) as (browser, address):
        page = browser.new_page()
        page.set_default_timeout(PATIENCE)
        page.goto(f"{address}docs/index.html")  # a page of the site on which nothing moves

        def train(seed: int, is_team: bool) -> tuple[float, int]:
            done = page.evaluate(TRAIN, [address, f"assets/{worker}", steps, seed, is_team])
            return done["steps"] / done["seconds"], done["threads"]

        yield train


def slowly() -> dict[str, Any]:
    """From Train to 5 of 5 laps where all of the browser's processes get a quarter of their time."""
    with browsing() as (browser, address):
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.set_default_timeout(PATIENCE)
        page.goto(address)
        button = page.get_by_role("button", name="Train", exact=True)
        button.wait_for()
        with slowed_down(descendants(os.getpid(), "--type=")):
            began = time.monotonic()
            button.click()
            page.get_by_text("It drives 5 of 5 laps").wait_for()
            seconds = time.monotonic() - began
    print(f"5 of 5 laps after {seconds:.1f} s with a processor {SLOWER} times slower")
    return {"slow_five_laps": {"wall_seconds": [seconds]}}


def descendants(root: int, option: str) -> list[int]:
    """Processes below one whose command has an option."""
    parents, commands = {}, {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parents[int(folder.name)] = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
            commands[int(folder.name)] = (folder / "cmdline").read_text()
        except OSError:
            continue  # it has ended

    def is_below(process: int) -> bool:
        return process == root or (process in parents and is_below(parents[process]))

    return [process for process in parents if option in commands.get(process, "") and is_below(process)]


@contextmanager
def slowed_down(processes: list[int]) -> Iterator[None]:
    """Stop them most of the time: a browser's own throttle leaves its workers alone."""
    is_over = threading.Event()

    def stop_and_go() -> None:
        while not is_over.is_set():
            for process in processes:
                os.kill(process, signal.SIGSTOP)
            time.sleep(PERIOD * (1 - 1 / SLOWER))
            for process in processes:
                os.kill(process, signal.SIGCONT)
            time.sleep(PERIOD / SLOWER)

    thread = threading.Thread(target=stop_and_go)
    thread.start()
    try:
        yield
    finally:
        is_over.set()
        thread.join()


def natively(steps: int, seed: int) -> float:
    """Camera steps per second of the same training on one thread with AVX2."""
    environment = {**os.environ, "RACECRAFT_ISA": "avx2"}
    command = [sys.executable, "-c", NATIVE, str(steps), str(seed)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return float(done.stdout.split()[-1])


def bits() -> dict[str, Any]:
    """Whether cars and weights are native's."""
    checks = {
        "simulator": "test_cars_on_every_track_are_the_native_ones[core]",
        "weights": "test_a_training_learns_the_native_weights[core]",
    }
    file = str(ROOT / "tests/site/test_core_bits.py")
    found = {}
    for name, test in checks.items():
        command = [sys.executable, "-m", "pytest", "-q", "-rs", f"{file}::{test}"]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        found[name] = done.returncode == 0 and "SKIPPED" not in done.stdout
    print(f"bits as native's: {found}")
    return {"bits": found}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--seeds", type=int, default=5, help="trainings until 5 of 5 laps, 1 to 8")
    parser.add_argument("--steps", type=int, default=60_000, help="camera steps of trainings whose pace is compared")
    parser.add_argument("--json", action="store_true", help="end in one object")
    options = parser.parse_args()
    parts: dict[str, Callable[[], dict[str, Any]]] = {
        "page": lambda: in_the_tab(options.seeds),
        "pace": lambda: side_by_side(options.steps),
        "threads": lambda: several(options.steps),
        "python": python,
        "slow": slowly,
        "bits": bits,
    }
    document: dict[str, Any] = {}
    for name in options.only:
        document |= parts[name]()
    if "bytes" in document and "python_bytes" in document:
        document["bytes"]["with_python"] = document["bytes"]["before_first_car"] + document["python_bytes"]
    if options.json:
        print(json.dumps(document))


if __name__ == "__main__":
    main()
