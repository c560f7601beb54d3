"""The reward function in a process of its own: rows of the simulation in, rewards out.

    with RewardWorker(source, tracks) as worker:
        rewards = worker(simulation.rows)  # (N, columns) -> (N,)

User code never runs in the trainer, and is locked in where it runs (`racecraft.reward.sandbox`). The two processes
share memory and ring each other over pipes, once per batch; replies are numbers and text, never pickles. Whatever a
reward function does, the caller gets rewards or one `RewardError` that names the line and the params, within a bounded
time. Nothing that comes back is believed: the process may write what it likes into its pipes and memory, at any time.
"""

from __future__ import annotations

import contextlib
import importlib.util
import marshal
import mmap
import os
import re
import select
import threading
import time
import weakref
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from racecraft import system
from racecraft.checks import check_type, check_whole, is_number, require
from racecraft.errors import ConfigError, RewardError, RewardTimeout, ShapeError, printable
from racecraft.reward import launch
from racecraft.reward import worker_process as protocol
from racecraft.reward.failure import SHOWN_BYTES, SHOWN_WIDTH, hint_about, kept_prints, told
from racecraft.reward.modules import needed_modules, used_words
from racecraft.reward.numeric import NotNumeric, numeric_source
from racecraft.reward.params import make_params
from racecraft.reward.sandbox import Confinement, find_confinement, make_plan
from racecraft.sim.columns import ROW_COLUMNS, row_width

if TYPE_CHECKING:
    from racecraft.track.track import Track

Rows = npt.NDArray[np.float64]

TEXT_BYTES = 8 * 1024  # longest description of a failure
PATIENCE, MOST_PATIENCE = 10.0, 30.0  # times its limit, or s beyond it: how long a call may last by the wall
MOST_SECONDS = 1_000_000  # s, that a limit may be: more than a week
LEAST_WAIT = 0.01  # s, between two looks at a core's time
LOG_BYTES = 64 * 1024  # how much of the last printed text is kept
MAX_BATCH = 4096  # rows per doorbell; larger arrays go over in parts
CAUSES = {
    "SIGKILL": "killed from outside, or by the system for lack of memory",
    "SIGSEGV": "a crash, often of endless recursion",
    "SIGSYS": "a system call that no reward function has any business with",
}

_TRACK_COLUMN = ROW_COLUMNS.index("track_index")
_FRAME = re.compile(rf'File "{re.escape(protocol.FILENAME)}", line (\d{{1,7}})\b')


class RewardWorker:
    """Calls a user's ``reward_function(params)`` in a separate process.

    A call costs about 2 µs for a short function. After an error the process is gone, and further calls say
    so. Globals of the user's file live on between calls, as on AWS, where one process drove one car;
    ``num_cars`` keeps that true for a batch.

    Args:
        source: Text of the user's ``reward_function.py``.
        tracks: The simulation's tracks; a row's ``track_index`` selects the waypoints, i + len(tracks) means
            track i driven the other way.
        seed: Seeds ``random`` and ``numpy.random`` in the process, so that a run repeats.
        timeout_s: How long one call of the function may run before the process is killed, s of a core. What it sleeps,
            or waits while others have the cores, counts far less: see `PATIENCE`.
        start_timeout_s: The same for the top level of the source, imports included.
        memory_limit_mb: Address space of the process, MB.
        num_cars: How many copies of the source's globals there are: row i belongs to car i modulo this. One
            is right for functions that keep no state, and loads fastest; see `keeps_state`.
        num_objects: On the track besides the car; rows then have their columns, as `Simulation.judged` has.
        compiled: Compile a function that only computes with numbers, which takes some seconds and then pays
            several times faster. It needs numba (``pip install racecraft[compile]``). Any other function is
            interpreted as usual, and `interpreted_because` says why.
        foreign: The source is somebody else's: it runs completely locked in or not at all, and is not compiled, as
            the compiler would need files while user code runs.
        confinement: The walls around the process; by default all that this machine offers.
        waits: Until the source is loaded. Otherwise the process comes up beside what the caller does meanwhile, and
            `wait`, or else the first call, raises what is wrong with the source.

    Raises:
        RewardError: The source cannot be loaded, or is foreign and cannot be locked in.
    """

    def __init__(
        self,
        source: str,
        tracks: Track | Sequence[Track],
        *,
        seed: int = 0,
        timeout_s: float = 5.0,
        start_timeout_s: float = 30.0,
        memory_limit_mb: int = 2048,
        num_cars: int = 1,
        num_objects: int = 0,
        compiled: bool = False,
        foreign: bool = False,
        confinement: Confinement | None = None,
        waits: bool = True,
    ) -> None:
        check_type("source", source, str, "use the text of a reward function, which load_reward(path) reads")
        several = tuple(tracks) if isinstance(tracks, Sequence) else (tracks,)
        are_tracks = len(several) > 0 and all(hasattr(track, "waypoints") for track in several)
        require("tracks", tracks, are_tracks, "a Track, or several in a list")
        for name, value in (("timeout_s", timeout_s), ("start_timeout_s", start_timeout_s)):
            is_time = is_number(value, is_plain=False) and 0 < value <= MOST_SECONDS
            require(name, value, is_time, f"a number above 0, to {MOST_SECONDS}")
        require("seed", seed, isinstance(seed, int | np.integer), "a whole number")
        check_whole("num_cars", num_cars, 1, 2**20)
        check_whole("num_objects", num_objects, 0, 1000)
        check_whole("memory_limit_mb", memory_limit_mb, 64, 2**20)
        confinement = find_confinement() if confinement is None else confinement
        if foreign:
            confinement.require()
        self.foreign = foreign
        """Whether the source is somebody else's."""
        self.confinement = confinement
        """The walls around the process."""
        self._source = source
        self._waypoints = waypoints_of(several)
        self._timeout_s = float(timeout_s)
        self._failure = ""  # why the process has ended: text, as a kept error would keep this object alive
        self._num_read = 0  # bytes of the log
        self.num_lost = 0
        """Bytes printed before what `read_log` last returned, and after what it returned before: too many at once."""

        self.interpreted_because = ""
        """Why the function is interpreted though compiling was asked for."""
        if compiled and foreign:
            self.interpreted_because = "it comes from somebody else, and the compiler reads files while it runs"
        kernel = self._rewrite(source) if compiled and not foreign else ""

        width = self._width = row_width(num_objects)
        rewards_offset = MAX_BATCH * width * 8
        text_offset = rewards_offset + MAX_BATCH * 8
        log_offset = text_offset + TEXT_BYTES
        size = log_offset + protocol.SIZE.size + LOG_BYTES
        packages = (*protocol.PACKAGES, *(("numba", "llvmlite") if kernel else ()))
        paths = launch.package_paths(packages)
        plan = make_plan(
            confinement,
            packages=packages,
            files=(str(launch.PROGRAM.with_name("kernel.py")), *paths) if kernel else (),
            memory_limit=memory_limit_mb * 2**20,
        )
        descriptor = system.unnamed_memory(size)
        try:
            memory = mmap.mmap(descriptor, size)
            self._process, lifeline = launch.start_process(
                descriptor, bubblewrap=confinement.bubblewrap, readable=(*plan["readable"], *plan["listed"])
            )
        finally:
            os.close(descriptor)
        self._finalizer = weakref.finalize(self, self._process.kill, os.getpid())
        self._rows = np.frombuffer(memory, np.float64, MAX_BATCH * width).reshape(MAX_BATCH, -1)
        self._rewards = np.frombuffer(memory, np.float64, MAX_BATCH, rewards_offset)
        self._text = memoryview(memory)[text_offset:log_offset]
        self._log = memoryview(memory)[log_offset:]
        self._poll = select.poll()
        assert self._process.popen.stdin is not None
        assert self._process.popen.stdout is not None
        self._requests = self._process.popen.stdin.fileno()
        self._replies = self._process.popen.stdout.fileno()
        self._poll.register(self._replies, select.POLLIN | select.POLLHUP)

        setup = {
            "source": source,
            "seed": int(seed) % 2**32,
            "waypoints": self._waypoints,
            "num_columns": width,
            "num_cars": num_cars,
            "modules": needed_modules(source),
            "words": used_words(source),
            "memory": descriptor,
            "memory_size": size,
            "lifeline": lifeline,
            "confinement": plan,
            "inside_path": str(launch.PROGRAM.parent / "sandbox" / "inside.py"),
            "rewards_offset": rewards_offset,
            "text_offset": text_offset,
            "log_offset": log_offset,
            "params_path": make_params.__code__.co_filename,
            "package_paths": paths,
            "kernel": kernel,
            "kernel_path": str(launch.PROGRAM.with_name("kernel.py")),
            "trace_signal": system.TRACE,
        }
        self._start_timeout_s = float(start_timeout_s)
        self._turn = threading.Lock()  # of several threads that ask, one after the other has the memory and the pipes
        self._is_ready = False
        try:
            with contextlib.suppress(BrokenPipeError), os.fdopen(os.dup(self._requests), "wb") as pipe:
                data = marshal.dumps(setup)
                pipe.write(protocol.SIZE.pack(len(data)) + data)
            os.set_blocking(self._requests, False)
        except BaseException:
            self._finalizer()
            raise
        if waits:
            self.wait()

    def _rewrite(self, source: str) -> str:
        """The source to compile, or nothing and the reason."""
        if importlib.util.find_spec("numba") is None:
            raise ConfigError("Compiled rewards need numba.", hint="Install it: pip install 'racecraft[compile]'")
        try:
            return numeric_source(source)
        except NotNumeric as reason:
            self.interpreted_because = str(reason)
            return ""

    def wait(self) -> None:
        """Wait until the source is loaded; calling again does nothing.

        Raises:
            RewardError: It cannot be loaded, or its process not be locked in; the worker has ended.
        """
        if self._is_ready or self._failure:
            return
        try:
            for expected in (protocol.LOCKED, protocol.READY):
                if not self._replies_within(self._start_timeout_s):
                    raise self._stalled(None, self._start_timeout_s)
                self._read_reply(None, 0, expected)
        except BaseException as error:
            self._end(str(error) if isinstance(error, RewardError) else "its start was interrupted.")
            raise
        self._is_ready = True

    def __call__(self, rows: Rows) -> npt.NDArray[np.float64]:
        """The rewards of a batch of rows.

        Args:
            rows: Rows of the simulation, columns in the order of ``ROW_COLUMNS``, then those of objects if
                there are any  (N, columns).

        Returns:
            One reward per row, finite and within ±1e5  (N,).

        Raises:
            RewardError: The function raised, returned no number, hung or crashed; the worker has ended.
        """
        with self._turn:
            return self._answered(rows)

    def _answered(self, rows: Rows) -> npt.NDArray[np.float64]:
        self.wait()
        if self._failure:
            raise RewardError(
                f"The reward worker ended after an error and cannot be called again: {self._failure}",
                hint="Correct the reward function and make a new RewardWorker.",
            )
        rows = np.asarray(rows, np.float64)
        if rows.ndim != 2 or rows.shape[1] != self._width:
            raise ShapeError(f"rows has shape {rows.shape}, expected (N, {self._width}): one row of sim.rows per car.")
        if not np.isfinite(rows).all():
            raise ShapeError("rows holds NaN or infinity; every value of a judged step is finite.")
        track_index = rows[:, _TRACK_COLUMN]
        if len(rows) and (track_index.min() < 0 or track_index.max() >= len(self._waypoints)):
            raise ShapeError(f"rows holds a track_index outside 0 to {len(self._waypoints) - 1}, the worker's tracks.")
        rewards = np.empty(len(rows))
        for first in range(0, len(rows), MAX_BATCH):
            part = rows[first : first + MAX_BATCH]
            rewards[first : first + len(part)] = self._call(part, first)
        return rewards

    def _call(self, rows: Rows, first: int) -> npt.NDArray[np.float64]:
        count = len(rows)
        self._rows[:count] = rows
        shared = self._rewards[:count]
        shared.fill(np.nan)  # a finite value says that the row is done
        try:
            with contextlib.suppress(BrokenPipeError):
                self._ring(count, first)
            num_done = 0
            while not self._replies_within(self._timeout_s):
                before, num_done = num_done, max(num_done, _num_done(shared))
                if num_done == before:
                    raise self._stalled(rows, self._timeout_s, first=first)
            self._read_reply(rows, first, protocol.REWARDS)
            rewards = shared.copy()  # the process may still write into its own
        except BaseException as error:
            self._end(str(error) if isinstance(error, RewardError) else "a batch was interrupted.")
            raise
        if not (np.abs(rewards) <= protocol.REWARD_LIMIT).all():  # NaN included: never trust the process's own check
            self._end("The reward worker answered without all rewards: user code wrote into its memory.")
            raise RewardError(self._failure)
        return rewards

    def _replies_within(self, timeout_s: float) -> bool:
        """Whether it replies, or ends, before it has had a core for so long, or has lasted far longer."""
        longest = min(PATIENCE * timeout_s, timeout_s + MOST_PATIENCE)
        used, deadline = self._process.seconds(), time.monotonic() + longest
        left = timeout_s
        while not self._poll.poll(left * 1000):
            left = min(used + timeout_s - self._process.seconds(), deadline - time.monotonic())
            if left <= 0:
                return bool(self._poll.poll(0))
            left = max(left, LEAST_WAIT)
        return True

    def _ring(self, count: int, first: int) -> None:
        try:
            os.write(self._requests, protocol.REQUEST.pack(count, first))
        except BlockingIOError:
            raise RewardError("The reward worker answers without taking requests: user code is in its pipe.") from None

    def _read_reply(self, rows: Rows | None, first: int, expected: int) -> None:
        """Take the reply that waits in the pipe; anything but what is expected raises."""
        message = os.read(self._replies, protocol.REPLY.size)
        if len(message) < protocol.REPLY.size:
            raise self._crashed(rows, first)
        status, row, line, size = protocol.REPLY.unpack(message)
        if size > TEXT_BYTES or (rows is not None and row >= len(rows)):
            status = 0
        text = printable(bytes(self._text[: min(size, TEXT_BYTES)]).decode("utf-8", "replace"))
        if status == expected:
            if status == protocol.READY and text:
                self.interpreted_because = text
            return
        if status != protocol.FAILED:
            raise RewardError("The reward worker sent a reply that makes no sense: user code wrote into its pipe.")
        if expected == protocol.LOCKED:
            raise RewardError(f"The reward worker cannot be locked in: it {text}.", hint="See: racecraft doctor")
        raise self._error(text, line, rows, row, first=first)

    def _stalled(self, rows: Rows | None, timeout_s: float, *, first: int = 0) -> RewardError:
        """The error of a process that makes no progress; asks it for its stack first."""
        system.ask_where(self._process.interpreter)
        line = _line_in(self._read_stderr(timeout_s=1.0))
        text = f"did not {'load' if rows is None else 'return'} within {timeout_s:g} s"
        error = self._error(text, line, rows, 0 if rows is None else _num_done(self._rewards[: len(rows)]), first=first)
        return RewardTimeout(str(error), line=error.line, row_index=error.row_index, params=error.params)

    def _crashed(self, rows: Rows | None, first: int) -> RewardError:
        """The error of a process that ended without a reply."""
        ending = self._process.ending(timeout_s=5.0)
        if ending is None:
            return RewardError("The reward worker closed its pipe: user code may not touch file descriptors.")
        signal_name, status = ending
        stack = self._read_stderr(timeout_s=1.0)
        line = _line_in(stack)
        if signal_name:
            cause = CAUSES.get(signal_name)
            text = f"ended the worker process with {signal_name}" + (f" ({cause})" if cause else "")
        else:
            text = f"ended the worker process with exit status {status}"
        if rows is None and line < 0 and stack.strip():
            text += f": {printable(stack.strip().splitlines()[-1][:SHOWN_WIDTH])}"
        return self._error(text, line, rows, 0 if rows is None else _num_done(self._rewards[: len(rows)]), first=first)

    def _error(self, text: str, line: int, rows: Rows | None, row: int, *, first: int) -> RewardError:
        """One sentence, the line at fault, and the params that the function was called with."""
        params: dict[str, Any] | None = None
        if rows is not None and row < len(rows):
            params = make_params(rows[row].tolist(), self._waypoints)
        printed = kept_prints(self._log, SHOWN_BYTES)
        message = told(text, self._source, line=line, is_loading=rows is None, params=params, printed=printed)
        return RewardError(
            message,
            hint=hint_about(message),
            line=line if line > 0 else None,
            row_index=None if rows is None else first + row,
            params=params,
        )

    def _read_stderr(self, timeout_s: float) -> str:
        """What the process wrote about its own crash, up to 64 KB."""
        assert self._process.popen.stderr is not None
        descriptor = self._process.popen.stderr.fileno()
        os.set_blocking(descriptor, False)
        deadline = time.monotonic() + timeout_s
        data = b""
        while time.monotonic() < deadline and len(data) < 65536:
            if system.can_be_read(descriptor, 0.05):
                part = os.read(descriptor, 65536)
                if not part:
                    break
                data += part
            elif data:
                break
        return data.decode("utf-8", "replace")

    def read_log(self) -> str:
        """What the user's function printed since the last call of this, or the last 64 KB of it."""
        (written,) = protocol.SIZE.unpack_from(self._log)
        since = max(written - self._num_read, 0)
        self._num_read = written
        self.num_lost = max(since - LOG_BYTES, 0)
        return kept_prints(self._log, since)

    @property
    def process_id(self) -> int:
        """Number of the worker process."""
        return self._process.interpreter

    def close(self) -> None:
        """End the process; calling again does nothing."""
        self._end("it was closed.")

    def _end(self, reason: str) -> None:
        self._failure = self._failure or reason
        self._finalizer()

    def __enter__(self) -> RewardWorker:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def waypoints_of(tracks: Sequence[Track]) -> list[list[tuple[float, float]]]:
    """The centre lines as AWS hands them out, for each track and then for each driven the other way."""
    forward = [[(x, y) for x, y in track.waypoints.tolist()] for track in tracks]
    return forward + [line[::-1] for line in forward]


def _num_done(rewards: npt.NDArray[np.float64]) -> int:
    """How many rows have their reward: they are written in order."""
    missing = np.isnan(rewards)
    return int(missing.argmax()) if missing.any() else len(rewards)


def _line_in(stack: str) -> int:
    """The innermost line of the user's file in a stack written by faulthandler, or -1."""
    match = _FRAME.search(stack)
    return int(match.group(1)) if match else -1
