"""How fast cars learn in a browser's tab, how smooth the page stays, and how much is loaded; on a quiet machine.

python benchmarks/site.py [--seeds 5] [--json]

Needs `make site`, Playwright and Chromium, and Brotli of Node. With --json the last line is one object; the bits are
those of tests/site, which it runs.
"""

from __future__ import annotations

import argparse
import functools
import http.server
import json
import os
import re
import shutil
import signal
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from racecraft import train

ROOT = Path(__file__).parents[1]
SITE = ROOT / "build" / "site"
OPTIONS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-compositing", "--no-sandbox"]
BROTLI = "process.stdout.write(String(require('zlib').brotliCompressSync(require('fs').readFileSync(0)).length))"
PATIENCE = 180_000  # ms
SLOWER = 4  # times, like a cheap Chromebook
PERIOD = 0.04  # s, in which a slowed browser runs for a part
COUNT_FRAMES = """() => {
  const began = performance.now();
  let frames = 0, isCounting = true;
  const count = () => isCounting && (frames++, requestAnimationFrame(count));
  requestAnimationFrame(count);
  window.stopCounting = () => ((isCounting = false), (1000 * frames) / (performance.now() - began));
}"""
LONG = 60_000  # camera steps of native's training, whose pace is compared


class Files(http.server.SimpleHTTPRequestHandler):
    """A static host."""

    asked: list[str] = []  # noqa: RUF012  # of all of them

    def do_GET(self) -> None:
        """Notes what was asked for."""
        self.asked.append(self.path)
        super().do_GET()

    def log_message(self, *_: object) -> None:
        """Says nothing."""


@contextmanager
def hosted() -> Iterator[str]:
    """The site's address."""
    host = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Files, directory=str(SITE)))
    threading.Thread(target=host.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{host.server_port}/"
    finally:
        host.shutdown()
        host.server_close()


def compressed(path: Path) -> int:
    """Bytes of a file by Brotli at its best."""
    done = subprocess.run(["node", "-e", BROTLI], input=path.read_bytes(), capture_output=True, check=True)
    return int(done.stdout)


def in_the_tab(seeds: int) -> dict[str, Any]:
    """Press Train on the page as it opens, once a seed."""
    from playwright.sync_api import sync_playwright

    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    with hosted() as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=OPTIONS)
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        opened = time.monotonic()
        page.goto(address)
        button = page.get_by_role("button", name="Train")
        button.wait_for()
        usable = time.monotonic() - opened
        page.get_by_text("It has learned already").wait_for(timeout=PATIENCE)
        driving = time.monotonic() - opened
        wall, steps, frames = [], 0, []
        before: list[str] = []
        for _ in range(seeds):
            began = time.monotonic()
            button.click()
            page.get_by_text("64 cars learning at once").wait_for(timeout=PATIENCE)
            before = before or list(dict.fromkeys(Files.asked))
            page.evaluate(COUNT_FRAMES)
            page.get_by_text("It drives 5 of 5 laps").wait_for(timeout=PATIENCE)
            wall.append(time.monotonic() - began)
            figures = page.locator("dl.figures").inner_text()
            steps += int(re.search(r"Steps\s+([\d\u202f]+)", figures)[1].replace("\u202f", ""))  # type: ignore[index]
            frames.append(page.evaluate("stopCounting()"))
        version = browser.version
        slow = slowly(browser, address)
        browser.close()
    loaded = [SITE / (path.lstrip("/") or "index.html") for path in before if path != "/favicon.ico"]
    return {
        "chromium": version,
        "usable_seconds": usable,
        "first_car_seconds": driving,
        "five_laps": {"wall_seconds": wall, "median": statistics.median(wall), "worst": max(wall)},
        "steps_per_second": steps / sum(wall),
        "frames_per_second": statistics.median(frames),
        "slow_five_laps_seconds": slow,
        "before_first_car": sum(compressed(path) for path in loaded),
    }


def slowly(browser: Any, address: str) -> float:
    """Seconds from Train to 5 of 5 laps where all of the browser's processes get a quarter of their time."""
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.goto(address)
    button = page.get_by_role("button", name="Train")
    button.wait_for()
    with slowed_down(descendants(os.getpid(), "--type=")):
        began = time.monotonic()
        button.click()
        page.get_by_text("It drives 5 of 5 laps").wait_for(timeout=PATIENCE)
        seconds = time.monotonic() - began
    page.close()
    return seconds


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


def natively() -> float:
    """Camera steps per second of the same training on one thread."""
    began = time.monotonic()
    result = train("reinvent_2018", reward="racing", until=f"{LONG} steps", seed=1, num_threads=1, evaluate_every=10**9)
    seconds = time.monotonic() - began
    shutil.rmtree(result.run)
    return LONG / seconds


def bits() -> dict[str, bool]:
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
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=5, help="trainings, 1 to 8")
    parser.add_argument("--json", action="store_true", help="end in one object")
    options = parser.parse_args()
    tab, native = in_the_tab(options.seeds), natively()
    document = {
        "chromium": tab["chromium"],
        "usable_seconds": tab["usable_seconds"],
        "first_car_seconds": tab["first_car_seconds"],
        "five_laps": {**tab["five_laps"], "slow_wall_seconds": tab["slow_five_laps_seconds"]},
        "frames_per_second": tab["frames_per_second"],
        "train": {
            "steps_per_second": tab["steps_per_second"],
            "native_steps_per_second": native,
            "of_native": tab["steps_per_second"] / native,
        },
        "bytes": {
            "core": compressed(SITE / "core" / "core.wasm"),
            "before_first_car": tab["before_first_car"],
            "with_python": tab["before_first_car"]
            + sum(compressed(path) for path in sorted((SITE / "python").iterdir())),
        },
        "bits": bits(),
    }
    laps, pace, size = document["five_laps"], document["train"], document["bytes"]
    print(
        f"Chromium {document['chromium']}: the page is usable after {document['usable_seconds']:.2f} s, "
        f"a car drives after {document['first_car_seconds']:.2f} s"
    )
    print(f"5 of 5 laps after {laps['median']:.1f} s (worst {laps['worst']:.1f} s), {len(laps['wall_seconds'])} seeds")
    print(f"{pace['steps_per_second']:,.0f} camera steps/s, {pace['of_native']:.0%} of native's on one thread")
    print(f"{size['core']:,} bytes the core, {size['before_first_car']:,} all before the first car, by Brotli")
    print(f"{size['with_python']:,} bytes with Python, by Brotli")
    print(f"{document['frames_per_second']:.0f} frames/s while 64 cars learn, WebGL by the processor")
    print(f"5 of 5 laps after {laps['slow_wall_seconds']:.1f} s with a processor {SLOWER} times slower")
    print(f"bits as native's: {document['bits']}")
    if options.json:
        print(json.dumps(document))


if __name__ == "__main__":
    main()
