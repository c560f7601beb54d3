"""What it costs to have a training done by a worker elsewhere, beside the console's own machine; on a quiet machine.

python benchmarks/workers.py [--rounds 5] [--until "40000 steps"] [--json]

All run here, in turns, with folders of their own and one store; so what is measured is the work of fetching, copying
and telling, not of a line. A worker is away with the database and the store, and once more with nothing but the
server's address and a token. Needs racecraft[serve], racecraft[s3] and httpx.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import httpx

MAX_SECONDS = 0.5  # more than at home
MAX_CPU = 0.03  # of the CPU time at home
TICK = 0.02  # s between two looks at a job
HERTZ = os.sysconf("SC_CLK_TCK")


@contextmanager
def running(*arguments: str) -> Iterator[str]:
    """A verb that prints one line of JSON when it is ready."""
    process = subprocess.Popen([sys.executable, "-m", "racecraft", *arguments], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield process.stdout.readline()
    finally:
        process.terminate()
        process.wait(60)
        process.stdout.close()


def job_processes(runs: Path) -> dict[int, float]:
    """CPU seconds of the processes that do jobs in a folder, with what they started."""
    found = {}
    for entry in Path("/proc").iterdir():
        try:
            words = (entry / "cmdline").read_bytes().split(b"\0") if entry.name.isdigit() else []
            if b"racecraft.serve.jobs" in words and os.fsencode(runs) in words:
                fields = (entry / "stat").read_text().rsplit(")", 1)[1].split()
                found[int(entry.name)] = sum(map(int, fields[11:15])) / HERTZ
        except OSError:
            continue
    return found


def train(client: httpx.Client, name: str, runs: Path, until: str) -> tuple[float, float]:
    """Seconds from the click to the told end, and the CPU seconds meanwhile of the process that does the job.

    The one that loads for the next job, five seconds after the click wherever it is, is no part of this one.
    """
    settings = {"name": name, "track": "oval", "seed": 1, "until": until, "train": False}
    client.post("/api/models", json=settings).raise_for_status()
    client.get("/").raise_for_status()
    time.sleep(6.0)  # until a process waits for the job, as it does for somebody who reads before the click
    before = job_processes(runs)
    after = dict(before)
    begun = time.perf_counter()
    job = client.post(f"/api/models/{name}/train", json={}).json()["id"]
    while (state := client.get(f"/api/jobs/{job}").json()["state"]) in ("queued", "running"):
        after |= {process: used for process, used in job_processes(runs).items() if process in before}
        time.sleep(TICK)
    if state != "done":
        raise SystemExit(f"The training {state}.")
    return time.perf_counter() - begun, sum(used - before[process] for process, used in after.items())


def measure(rounds: int, until: str) -> dict[str, list[tuple[float, float]]]:
    """Wall and CPU seconds at home and away, in turns."""
    found: dict[str, list[tuple[float, float]]] = {"home": [], "away": [], "token": []}
    with tempfile.TemporaryDirectory() as folder:
        base = Path(folder)
        shared = ["--artifacts", f"file://{base}/store", "--database", f"sqlite:///{base}/console.db"]
        for number in range(rounds):
            for place in found:
                runs = base / place
                with ExitStack() as stack:
                    options = ["--runs", str(base / "home"), "--no-browser", "--port", "0", *shared, "--json"]
                    slots = [] if place == "home" else ["--trainings", "0"]
                    slots += ["--league"] if place == "token" else []  # where there are tokens
                    link = json.loads(stack.enter_context(running("serve", *options, *slots)))["link"]
                    client = stack.enter_context(httpx.Client(base_url=link.split("/?")[0], timeout=120))
                    client.get(link)
                    if place == "away":
                        stack.enter_context(running("worker", "--runs", str(runs), *shared, "--json"))
                    if place == "token":
                        made = client.post("/api/account/tokens", json={"scopes": ["worker"]}).raise_for_status().json()
                        (base / "secret").write_text(made["secret"])
                        way = ["--server", link.split("/?")[0], "--token-file", str(base / "secret")]
                        stack.enter_context(running("worker", "--runs", str(runs), *way, "--json"))
                    found[place].append(train(client, f"{place}-{number}", runs, until))
    return found


def main() -> int:
    """Print the table; the exit status is 1 when a bar is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--until", default="40000 steps")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    found = measure(options.rounds, options.until)
    medians = {place: [statistics.median(one) for one in zip(*values, strict=True)] for place, values in found.items()}
    home = medians["home"]
    more = {place: (one[0] - home[0], one[1] / home[1] - 1.0) for place, one in medians.items() if place != "home"}
    if options.json:
        print(json.dumps({**found, "more": more}))
    else:
        for place, (wall, used) in medians.items():
            print(f"{place:5} {wall:7.2f} s from click to end  {used:7.2f} s of CPU")
        for place, (seconds, cpu) in more.items():
            bars = f"bars {MAX_SECONDS}, {100 * MAX_CPU:.0f} %"
            print(f"{place}: {seconds:+.2f} s, {100 * cpu:+.1f} % of CPU ({bars})")
    return int(any(seconds > MAX_SECONDS or cpu > MAX_CPU for seconds, cpu in more.values()))


if __name__ == "__main__":
    sys.exit(main())
