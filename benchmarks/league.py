"""How fast a league is, against what it must reach; on a machine of two cores that does nothing else.

python benchmarks/league.py [--only door submissions spectators board judging classroom] [--json]

Each row starts a league of its own. Needs racecraft[serve] and httpx; the board is read on PostgreSQL as well,
where that is installed. `submissions` takes six minutes, all others together as long again.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import sqlalchemy as sa

from racecraft.race.entry_file import pack_entry
from racecraft.race.policy import WEIGHTS
from racecraft.run import RunFolder
from racecraft.run.checkpoint import HEADER_KEY
from racecraft.run.starters import unpack_starter
from racecraft.run.tensor_file import tensor_file
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Group, Job, Race, Submission, User, now
from racecraft.serve.submissions.board import read_board

TESTS = Path(__file__).parents[1] / "tests" / "serve"
HERTZ = os.sysconf("SC_CLK_TCK")
PATIENCE = 120.0  # s
CLASS = 30
WRONG = 20  # passwords
SUBMISSIONS, PERIOD, EACH = 200, 300.0, 2  # in so many s, so many of each person
KILLS = (0.3, 0.6)  # of the period: when server and workers are killed
SPECTATORS, WINDOW = 100, 15.0  # s
ENTRIES, READS = 10_000, 15
JUDGED = 10
LESSON = 180.0  # s

Row = dict[str, Any]


@dataclass
class League:
    """A running one, and its owner's client."""

    runs: Path
    process: subprocess.Popen[str]
    owner: httpx.Client
    people: list[httpx.Client] = field(default_factory=list)

    @property
    def base(self) -> str:
        return str(self.owner.base_url).rstrip("/")

    def client(self) -> httpx.Client:
        self.people.append(httpx.Client(base_url=self.base, timeout=PATIENCE))
        return self.people[-1]

    def fill(self, count: int) -> tuple[int, list[dict[str, Any]]]:
        """A group of so many people: its number, and their cards."""
        group = told(self.owner.post("/api/groups", json={"title": "Class"}))["id"]
        names = [{"name": f"Racer {number}"} for number in range(count)]
        return group, told(self.owner.post(f"/api/groups/{group}/members", json={"people": names}))

    def came_in(self, card: dict[str, Any]) -> httpx.Client:
        """A client that has shown its card, as the page behind its link does."""
        client = self.client()
        told(client.post("/api/door/card", json={"secret": card["link"].split("#")[1]}))
        return client

    def race(self, group: int) -> int:
        number: int = told(self.owner.post(f"/api/groups/{group}/races", json={"title": "Cup"}))["id"]
        return number


def told(reply: httpx.Response) -> Any:
    reply.raise_for_status()
    return reply.json() if reply.content else None


@contextmanager
def league(runs: Path, *options: str) -> Iterator[League]:
    with ExitStack() as stack:
        process, link = start(runs, *options)
        owner = stack.enter_context(httpx.Client(base_url=link.split("/?")[0], timeout=PATIENCE))
        owner.get(link)
        running = League(runs, process, owner)
        try:
            yield running
        finally:
            for client in running.people:
                client.close()
            running.process.terminate()
            running.process.wait(60)


def start(runs: Path, *options: str) -> tuple[subprocess.Popen[str], str]:
    words = ["serve", "--league", "--json", "--no-browser", "--runs", str(runs), "--port", str(free_port()), *options]
    process = subprocess.Popen([sys.executable, "-m", "racecraft", *words], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    return process, json.loads(process.stdout.readline())["link"]


def free_port() -> int:
    with socket.socket() as door:
        door.bind(("127.0.0.1", 0))
        number: int = door.getsockname()[1]
        return number


def cpu(process: int, *, children: bool = False) -> float:
    """Seconds of a process, with those of its children that have ended if these are wanted."""
    fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return sum(map(int, fields[11 : 15 if children else 13])) / HERTZ


def p95(values: list[float]) -> float:
    return statistics.quantiles(values, n=20)[-1]


def figure(value: float, unit: str, bar: float) -> Row:
    return {"value": round(value, 3), "unit": unit, "bar": bar, "is_met": value <= bar}


def entries(folder: Path, count: int) -> Iterator[bytes]:
    """So many drivers that differ in one weight by nothing that matters: each is judged for itself."""
    from safetensors.numpy import load

    data = pack_entry(RunFolder(unpack_starter("quick", folder)))
    header = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])["__metadata__"][HEADER_KEY]
    arrays = load(data)
    name = next(name for name in sorted(arrays) if name.startswith(WEIGHTS))
    for number in range(count):
        changed = arrays[name].copy()
        changed.flat[0] += np.float32(1e-6 * (number + 1))
        yield b"".join(tensor_file({**arrays, name: changed}, {HEADER_KEY: header}))


def door() -> Row:
    """A class behind one address comes in by card, each with the page and its scripts; and one guesses passwords."""
    with tempfile.TemporaryDirectory() as folder, league(Path(folder)) as running:
        _, cards = running.fill(CLASS)
        answered: list[int] = []

        def come(card: dict[str, Any]) -> None:
            client = running.came_in(card)
            page = client.get("/").text
            scripts = [part.split('"')[0] for part in page.split('="') if part.startswith("/assets/")]
            paths = [*scripts, "/api/door", "/api/models", "/api/groups", "/api/league/races"]
            answered.extend(client.get(path).status_code for path in paths)

        begun = time.perf_counter()
        with ThreadPoolExecutor(CLASS) as pool:
            list(pool.map(come, cards))
        took = time.perf_counter() - begun
        guesses = [{"name": cards[0]["name"], "password": f"wrong {number}"} for number in range(WRONG)]
        answers = [running.client().post("/api/door/sign-in", json=guess).status_code for guess in guesses]
    row = figure(took, "s", 60.0)
    row |= {"not_200": sum(status != 200 for status in answered), "guesses": answers}
    return row | {"is_met": row["is_met"] and not row["not_200"] and answers[-1] == 429}


def submissions() -> Row:
    """A deadline: everybody sends in; meanwhile the server and its workers are killed, as by a power cut."""
    with tempfile.TemporaryDirectory() as folder, league(Path(folder) / "runs") as running:
        group, cards = running.fill(SUBMISSIONS // EACH)
        race, people = running.race(group), [running.came_in(card) for card in cards]
        kills = [PERIOD * share for share in KILLS]
        port = str(running.owner.base_url.port)
        begun, accepted = time.perf_counter(), 0
        for number, data in enumerate(entries(Path(folder), SUBMISSIONS)):
            while time.perf_counter() - begun < PERIOD * number / SUBMISSIONS:
                time.sleep(0.01)
            if kills and time.perf_counter() - begun > kills[0]:
                kills.pop(0)
                for process in (running.process.pid, *workers(running.runs)):
                    with suppress(ProcessLookupError):
                        os.kill(process, signal.SIGKILL)
                running.process.wait()
                running.process, _ = start(running.runs, "--port", port)
            address = f"/api/league/races/{race}/submissions?model=quick"
            accepted += people[number % len(people)].post(address, content=data).status_code == 202
        database = Database(f"sqlite:///{running.runs / '.racecraft' / 'console.db'}")
        while True:
            with database.transaction() as session:
                jobs = session.scalars(sa.select(Job).where(Job.kind == "judge")).all()
                ranked = session.scalar(sa.select(sa.func.count()).where(Submission.judged.is_not(None)))
            if all(job.state not in ("queued", "running") for job in jobs):
                break
            time.sleep(0.5)
        database.close()
    waits = [(job.finished - job.created).total_seconds() for job in jobs if job.finished is not None]
    row = figure(p95(waits), "s", 60.0) | {"accepted": accepted, "judged": ranked, "kills": len(KILLS)}
    return row | {"is_met": row["is_met"] and accepted == ranked == SUBMISSIONS}


def workers(runs: Path) -> list[int]:
    """The processes that do jobs, and judges in a submission's folder."""
    found = []
    for entry in Path("/proc").iterdir():
        with suppress(OSError):
            words = (entry / "cmdline").read_bytes() if entry.name.isdigit() else b""
            if b"racecraft.serve" in words and (
                os.fsencode(runs) in words or runs in (entry / "cwd").readlink().parents
            ):
                found.append(int(entry.name))
    return found


WATCH = """
import http.client, re, sys, threading, time
host, cookie, path, count, seconds = sys.argv[1:]
sizes = []
def watch():
    connection = http.client.HTTPConnection(host)
    connection.request('GET', path, headers={'Cookie': cookie})
    reply, end, kept = connection.getresponse(), time.monotonic() + float(seconds), b''
    while time.monotonic() < end and (part := reply.read1(1 << 16)):
        *whole, kept = re.split(rb'\\r?\\n\\r?\\n', kept + part)
        sizes.extend(len(event) + 4 for event in whole if event.startswith(b'event: live'))
threads = [threading.Thread(target=watch) for _ in range(int(count))]
[thread.start() for thread in threads]
[thread.join() for thread in threads]
print(sum(sizes) / max(1, len(sizes)), len(sizes))
"""


def spectators() -> Row:
    """A hundred tabs follow 64 cars beside their training, while others use the API."""
    with tempfile.TemporaryDirectory() as folder, league(Path(folder)) as running:
        owner = running.owner
        told(owner.post("/api/models", json={"name": "live", "until": "30 minutes"}))
        while "event: live" not in first_events(owner):
            time.sleep(0.1)
        time.sleep(8.0)  # until the next worker has loaded
        cookie = "; ".join(f"{one.name}={one.value}" for one in owner.cookies.jar)
        words = [running.base.removeprefix("http://"), cookie, "/api/events/live", str(SPECTATORS), str(WINDOW + 6.0)]
        watching = subprocess.Popen([sys.executable, "-c", WATCH, *words], stdout=subprocess.PIPE, text=True)
        time.sleep(4.0)
        before, begun, waits = cpu(running.process.pid), time.perf_counter(), list[float]()
        while time.perf_counter() - begun < WINDOW:
            time.sleep(0.2)
            path = ("/api/models", "/api/models/live", "/api/jobs", "/api/groups", "/api/league/races")[len(waits) % 5]
            asked = time.perf_counter()
            told(owner.get(path))
            waits.append(1000 * (time.perf_counter() - asked))
        share = 100 * (cpu(running.process.pid) - before) / (time.perf_counter() - begun)
        size, count = watching.communicate(timeout=60)[0].split()
        owner.post("/api/models/live/stop")
    parts = {
        "server": figure(share, "% of a core", 25.0),
        "event": figure(float(size), "bytes", 3000),
        "api_p95": figure(p95(waits), "ms", 100.0),
    }
    return {**parts, "events": int(count), "is_met": all(part["is_met"] for part in parts.values())}


def first_events(client: httpx.Client) -> str:
    text = ""
    with client.stream("GET", "/api/events/live") as stream:
        for line in stream.iter_lines():
            text += line
            if text.count("event: ") > 3:
                break
    return text


def board() -> Row:
    """Ten thousand people's best, and who is around the one in the middle."""
    sys.path.append(str(TESTS))
    from postgres_servers import binaries, postgres_server  # a server of its own, as the tests have

    parts: Row = {}
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        urls = {"sqlite": f"sqlite:///{folder}/league.db"}
        if binaries() is not None:
            urls["postgresql"] = stack.enter_context(postgres_server()).new_database()
        for name, url in urls.items():
            database = Database(url)
            database.migrate()
            race, took = fill(database), []
            for _ in range(READS):
                begun = time.perf_counter()
                with database.transaction() as session:
                    rows = read_board(session, race, user_id=10 + ENTRIES // 2, top=100).rows
                took.append(1000 * (time.perf_counter() - begun))
            assert len(rows) == 107
            database.close()
            parts[name] = figure(statistics.median(took), "ms", 50.0)
    return {**parts, "is_met": len(parts) == 2 and all(part["is_met"] for part in parts.values())}


def fill(database: Database) -> int:
    """A race in which everybody stands; its number."""
    with database.transaction() as session:
        group = Group(title="g")
        session.add(group)
        session.flush()
        race = Race(owner_id=1, group_id=group.id, title="r", track="oval", ranking="total")
        session.add_all([race, Job(id="j", kind="judge", run="", state="done")])
        users = range(10, 10 + ENTRIES)
        session.execute(sa.insert(User), [{"id": user, "name": f"u{user}", "handle": f"u{user}"} for user in users])
        session.flush()
        fields = {"race_id": race.id, "job_id": "j", "model": "m", "completion": 1.0, "judged": now()}
        rows = [
            {
                **fields,
                "user_id": user,
                "digest": hashlib.sha256(str(user).encode()).hexdigest(),
                "score_ms": 20_000 + user * 7919 % 9973,
                "best_lap_ms": 9000 + user % 13,
                "resets": user % 3,
            }
            for user in users
        ]
        session.execute(sa.insert(Submission), rows)
        return race.id


def judging() -> Row:
    """The CPU of all processes that have to do with an entry: three laps in five trials, a starter drives.

    The first one pays for processes that wait for the others; what it takes is told beside the median.
    """
    with tempfile.TemporaryDirectory() as folder, league(Path(folder) / "runs") as running:
        group, (card,) = running.fill(1)
        race, racer = running.race(group), running.came_in(card)
        time.sleep(8.0)  # until a worker has loaded
        used = []
        for data in entries(Path(folder), JUDGED):
            address = f"/api/league/races/{race}/submissions"
            before = cpu_of_tree(running.process.pid)
            number = told(racer.post(f"{address}?model=quick", content=data))["id"]
            while told(racer.get(f"{address}/{number}"))["state"] in ("queued", "running"):
                time.sleep(0.2)
            time.sleep(1.0)  # until all is tidied up
            used.append(cpu_of_tree(running.process.pid) - before)
    return figure(statistics.median(used), "s of CPU", 1.2) | {"first": round(used[0], 3)}


def cpu_of_tree(root: int) -> float:
    """Seconds of CPU of a process and all that it and its children have started, living or not."""
    parents = {}
    for entry in Path("/proc").iterdir():
        with suppress(OSError):
            if entry.name.isdigit():
                parents[int(entry.name)] = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
    tree, more = {root}, {root}
    while more:
        more = {child for child, parent in parents.items() if parent in more} - tree
        tree |= more
    used = 0.0
    for one in tree:
        with suppress(OSError):
            used += cpu(one, children=True)
    return used


def classroom() -> Row:
    """Everybody trains the default car at the same moment, and sees until their turn who comes before them."""
    with tempfile.TemporaryDirectory() as folder, league(Path(folder)) as running:
        _, cards = running.fill(CLASS)
        people = [running.came_in(card) for card in cards]
        people[0].get("/").raise_for_status()
        time.sleep(6.0)  # until a worker waits
        begun, laps = time.perf_counter(), dict[int, float]()

        def create(client: httpx.Client) -> bool:
            told(client.post("/api/models", json={"name": "mine", "until": "1 lap"}))
            job = first_jobs(client)[0]
            return job["state"] == "queued" and not job["behind"] and job["attempts"] == 0

        with ThreadPoolExecutor(CLASS) as pool:
            unseen = sum(pool.map(create, people))
        while len(laps) < CLASS and time.perf_counter() - begun < 4 * LESSON:
            for number, client in enumerate(people):
                if number not in laps and told(client.get("/api/models/mine"))["best_lap"] is not None:
                    laps[number] = time.perf_counter() - begun
            time.sleep(1.0)
    row = figure(max(laps.values(), default=0.0), "s", LESSON) | {"lapped": len(laps), "unseen": unseen}
    row["median"] = round(statistics.median(laps.values()), 1) if laps else None
    return row | {"is_met": row["is_met"] and len(laps) == CLASS and unseen <= 1}  # the next one has nobody before it


def first_jobs(client: httpx.Client) -> Any:
    """What the page of somebody's model shows of its jobs at once."""
    kind = ""
    with client.stream("GET", "/api/events/mine") as stream:
        for line in stream.iter_lines():
            if line.startswith("event: "):
                kind = line.removeprefix("event: ")
            elif line.startswith("data: ") and kind == "jobs":
                return json.loads(line.removeprefix("data: "))
    raise AssertionError("The stream ended.")


ROWS: dict[str, Callable[[], Row]] = {
    "door": door,
    "submissions": submissions,
    "spectators": spectators,
    "board": board,
    "judging": judging,
    "classroom": classroom,
}


def main() -> int:
    """Print the table; the exit status is 1 when a bar is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=ROWS, default=list(ROWS))
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    found: dict[str, Row] = {}
    for name in arguments.only:
        found[name] = ROWS[name]()
        if not arguments.json:
            print(f"{name:12} {'met' if found[name]['is_met'] else 'NOT MET':8} {json.dumps(found[name])}", flush=True)
    if arguments.json:
        print(json.dumps(found))
    return 0 if all(row["is_met"] for row in found.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
