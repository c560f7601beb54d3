"""How fast the console is, against what it must reach; on a machine that does nothing else.

python benchmarks/console.py [--only start size training garage browser] [--json]

Needs racecraft[serve], httpx and the built pages; the part in the browser needs Playwright and Chromium as well.
"""

from __future__ import annotations

import argparse
import gzip
import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import httpx
from drawn_frames import COUNT_FRAMES

PAGES = Path(__file__).parents[1] / "src" / "racecraft" / "serve" / "pages"
COOKIE = "racecraft_session"
GARAGE = (200, 1000)  # runs, evaluations of each
WINDOW = 8.0  # s of training between two changes of the number of viewers


@dataclass(frozen=True)
class Figure:
    """One measured thing and the bar for it."""

    name: str
    value: float
    unit: str
    bar: float
    more_is_better: bool = False

    @property
    def is_met(self) -> bool:
        return self.value >= self.bar if self.more_is_better else self.value <= self.bar


@dataclass(frozen=True)
class Console:
    """A running one."""

    client: httpx.Client
    process: subprocess.Popen[str]
    started: float

    @property
    def base(self) -> str:
        return str(self.client.base_url).rstrip("/")

    def job_of(self, name: str) -> Any:
        return self.client.get("/api/jobs", params={"run": name}).json()[0]


@contextmanager
def console(runs: Path) -> Iterator[Console]:
    begun = time.perf_counter()
    command = [sys.executable, "-m", "racecraft", "serve", "--json", "--no-browser", "--port", "0", "--runs", str(runs)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    link = json.loads(process.stdout.readline())["link"]
    try:
        with httpx.Client(base_url=link.split("/?")[0], timeout=120) as client:
            client.get(link)
            yield Console(client, process, begun)
    finally:
        process.terminate()
        process.wait(60)
        process.stdout.close()


def start() -> list[Figure]:
    """From the command to a page that can be used: the pages, their scripts and the garage are there."""
    times = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(5):
            with console(Path(folder)) as running:
                page = running.client.get("/").text
                for name in _scripts(page):
                    running.client.get(name).raise_for_status()
                running.client.get("/api/models").raise_for_status()
                times.append(time.perf_counter() - running.started)
    return [Figure("racecraft serve to the first usable page", statistics.median(times[1:]), "s", 2.0)]


def size() -> list[Figure]:
    """What a browser loads before it shows anything: the page, its scripts and styles."""
    page = (PAGES / "index.html").read_text()
    first = [PAGES / "index.html", *(PAGES / name.lstrip("/") for name in _scripts(page))]
    packed = sum(len(gzip.compress(path.read_bytes())) for path in first)
    return [Figure("first load: page, scripts and styles, gzipped", packed / 1000, "kB", 200)]


def training() -> list[Figure]:
    """A click to the first moving car; the API beside a training; a training beside viewers."""
    with tempfile.TemporaryDirectory() as folder, console(Path(folder)) as running:
        client = running.client
        client.get("/").raise_for_status()
        begun = time.perf_counter()
        client.post("/api/models", json={"name": "busy", "until": "30 minutes"}).raise_for_status()
        moving = _first_moving_car(running, "busy") - begun
        time.sleep(3.0)
        waits = []
        for number in range(400):
            path = ("/api/models", "/api/models/busy", "/api/models/busy/history", "/api/jobs", "/api/tracks")[
                number % 5
            ]
            before = time.perf_counter()
            client.get(path).raise_for_status()
            waits.append(time.perf_counter() - before)
        rates: dict[int, list[float]] = {0: [], 1: [], 20: []}
        for viewers in (0, 1, 0, 20) * 3 + (0,):  # in turn, so that a slow minute of the machine hits all
            with _viewers(running, "busy", viewers):
                time.sleep(1.0)
                rates[viewers].append(_rate(running, "busy"))
        client.post("/api/models/busy/stop")
        alone = statistics.median(rates[0])
        slower = {viewers: 100 * (1 - statistics.median(rates[viewers]) / alone) for viewers in (1, 20)}
    return [
        Figure("Train now to the first moving car", moving, "s", 3.0),
        Figure("API beside a training, 95th percentile", 1000 * statistics.quantiles(waits, n=20)[-1], "ms", 100),
        Figure("Training slower with 1 viewer", slower[1], "%", 5),
        Figure("Training slower with 20 viewers", slower[20], "%", 10),
    ]


def garage() -> list[Figure]:
    """The garage of somebody who has been at it for years."""
    with tempfile.TemporaryDirectory() as folder:
        runs = Path(folder) / "runs"
        with console(runs) as running:
            running.client.post("/api/models", json={"name": "first", "train": False}).raise_for_status()
        for number in range(GARAGE[0]):
            shutil.copytree(runs / "first", runs / f"run-{number:03d}")
            for stamp in range(GARAGE[1]):
                place = runs / f"run-{number:03d}" / f"evaluation-{20250101000000 + stamp}"
                place.mkdir()
                (place / "evaluation.json").write_text("{}")
        with console(runs) as running:
            times = []
            for _ in range(21):
                before = time.perf_counter()
                cards = running.client.get("/api/models").json()
                times.append(1000 * (time.perf_counter() - before))
            assert len(cards) == GARAGE[0] + 1
            assert cards[-2]["evaluations"] == GARAGE[1]
    what = f"Garage of {GARAGE[0]} runs x {GARAGE[1]:,} evaluations"
    return [
        Figure(what, statistics.median(times[1:]), "ms", 300),
        Figure(f"{what}, never seen before", times[0], "ms", 15_000),
    ]


def browser() -> list[Figure]:
    """64 cars in software WebGL, in headless Chromium."""
    from playwright.sync_api import sync_playwright

    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    with tempfile.TemporaryDirectory() as folder, console(Path(folder)) as running, sync_playwright() as playwright:
        # as Chromium does by itself without a GPU: what is in 3D and the page around it are drawn in different ways
        software = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-compositing"]
        opened = playwright.chromium.launch(executable_path=chromium, args=[*software, "--no-sandbox"])
        page = opened.new_page(viewport={"width": 1440, "height": 900})
        page.add_init_script(COUNT_FRAMES)
        cookie = running.client.cookies[COOKIE]
        page.context.add_cookies([{"name": COOKIE, "value": cookie, "url": running.base}])
        page.goto(running.base)
        page.locator("h1").wait_for()
        opening = page.evaluate("performance.now()") / 1000
        running.client.post("/api/models", json={"name": "watched", "until": "10 minutes"}).raise_for_status()
        _first_moving_car(running, "watched")
        page.goto(f"{running.base}/models/watched/watch")
        page.locator(".scene canvas").wait_for()
        page.wait_for_timeout(3000)
        frames = page.evaluate(
            """() => new Promise(done => { const before = window.drawnFrames, t0 = performance.now();
               const tick = () => { const t = performance.now() - t0, n = window.drawnFrames - before;
                                    t > 6000 ? done(1000 * n / t) : requestAnimationFrame(tick); };
               requestAnimationFrame(tick); })"""
        )
        before = page.evaluate("performance.memory ? performance.memory.usedJSHeapSize : 0")
        page.wait_for_timeout(20_000)
        after = page.evaluate("performance.memory ? performance.memory.usedJSHeapSize : 0")
        running.client.post("/api/models/watched/stop")
        opened.close()
    return [
        Figure("First page in the browser", opening, "s", 2.0),
        Figure("64 cars in 3D, software WebGL", frames, "frames/s", 30, more_is_better=True),
        Figure("Heap of a tab after 20 s more", (after - before) / 1e6, "MB more", 30),
    ]


PARTS: dict[str, Callable[[], list[Figure]]] = {
    "start": start,
    "size": size,
    "training": training,
    "garage": garage,
    "browser": browser,
}


def _scripts(page: str) -> list[str]:
    return re.findall(r'(?:src|href)="(/assets/[^"]+)"', page)


def _events(running: Console, name: str) -> Iterator[tuple[str, Any]]:
    with running.client.stream("GET", f"/api/events/{name}") as stream:
        kind = ""
        for line in stream.iter_lines():
            if line.startswith("event: "):
                kind = line.removeprefix("event: ")
            elif line.startswith("data: "):
                yield kind, json.loads(line.removeprefix("data: "))


def _first_moving_car(running: Console, name: str) -> float:
    """When a car was first seen somewhere else than before."""
    first = None
    for kind, data in _events(running, name):
        if kind == "live":
            first = first or data["poses"]
            if data["poses"] != first:
                return time.perf_counter()
    raise AssertionError("The stream ended.")


def _rate(running: Console, name: str) -> float:
    """Camera steps per second over a window, by the points of the curves."""
    before = running.client.get(f"/api/models/{name}/history").json()
    time.sleep(WINDOW)
    points = running.client.get(f"/api/models/{name}/history", params={"offset": before["offset"]}).json()["points"]
    steps = [point for point in points if point["kind"] == "iteration"]
    return float((steps[-1]["step"] - steps[0]["step"]) / (steps[-1]["seconds"] - steps[0]["seconds"]))


@contextmanager
def _viewers(running: Console, name: str, count: int) -> Iterator[None]:
    """So many open tabs; they run in a process of their own, as browsers do."""
    script = (
        "import sys, threading, http.client\n"
        "host, cookie, name, count = sys.argv[1:]\n"
        "def watch():\n"
        "    connection = http.client.HTTPConnection(host)\n"
        "    connection.request('GET', f'/api/events/{name}', headers={'Cookie': cookie})\n"
        "    reply = connection.getresponse()\n"
        "    while reply.read1(1 << 16): pass\n"
        "threads = [threading.Thread(target=watch, daemon=True) for _ in range(int(count))]\n"
        "[thread.start() for thread in threads]\n"
        "[thread.join() for thread in threads]\n"
    )
    cookie = f"{COOKIE}={running.client.cookies[COOKIE]}"
    host = running.base.removeprefix("http://")
    process = subprocess.Popen([sys.executable, "-c", script, host, cookie, name, str(count)]) if count else None
    try:
        yield
    finally:
        if process is not None:
            process.kill()
            process.wait()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    figures = []
    for name in arguments.only:
        figures += PARTS[name]()
    if arguments.json:
        print(json.dumps([{**asdict(figure), "is_met": figure.is_met} for figure in figures], indent=1))
    else:
        print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}\n")
        for figure in figures:
            sign = ">=" if figure.more_is_better else "<="
            verdict = "met" if figure.is_met else "NOT MET"
            print(f"{figure.name:52}{figure.value:10.2f} {figure.unit:9} {sign} {figure.bar:g}  {verdict}")
    return 0 if all(figure.is_met for figure in figures) else 1


if __name__ == "__main__":
    sys.exit(main())
