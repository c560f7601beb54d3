"""The program inside the reward worker process: rows in, rewards out.

``launch.py`` starts it as a bare interpreter, so it imports built-in modules only, and is ready in 20 ms.
It reads one setup message from stdin, locks itself in, loads the modules that the user's source names, takes away the
right to open any file, loads the source, and then serves batches:

    stdin   REQUEST(count, first_row)       one per batch, the doorbell
    memory  rows (count, columns) in, rewards (count,) out, text of a failure, ring of the last prints
    stdout  REPLY(status, row, line, text_size)
    stderr  the stack that ``faulthandler`` writes when the process crashes or is asked where it hangs

User code has no business with these three: its prints go to the ring, and file descriptors 0 to 2 lead nowhere. It is
taken to be hostile all the same: the caller believes nothing that comes back.
"""

from __future__ import annotations

import faulthandler
import io
import marshal
import mmap
import os
import struct
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType
    from typing import Any

    Reward = Callable[[dict[str, Any]], object]

REQUEST = struct.Struct("<II")  # rows in this batch, index of the first one in the caller's array
REPLY = struct.Struct("<BIiI")  # status, row, line (-1 unknown), bytes of text
READY, REWARDS, FAILED, LOCKED = 1, 2, 3, 4  # statuses of a reply; LOCKED comes first, READY once all is loaded
SIZE = struct.Struct("<Q")  # bytes of the setup message; also the count of printed bytes that heads the ring

PI = 3.141592653589793
FILENAME = "reward_function.py"  # what the user's source is called in every traceback
STEPS = 1  # column of a row that counts the episode's steps from 1, the prepare step
REWARD_LIMIT = 1e5  # largest magnitude that AWS accepts
POSITIONS = (  # parameters of a function of 2018 and early 2019, and behind them the closest waypoint
    *("on_track", "x", "y", "distance_from_center", "car_orientation", "progress", "steps", "throttle", "steering"),
    *("track_width", "waypoints"),
)

# Events of sys.addaudithook that a reward function has no use for. The kernel refuses them; refusing them here as well
# says it in words.
FORBIDDEN_EVENTS = frozenset(
    (
        *("os.exec", "os.fork", "os.forkpty", "os.posix_spawn", "os.spawn", "os.system", "pty.spawn"),
        *("subprocess.Popen", "os.kill", "os.killpg", "ctypes.dlopen"),
        *("socket.__new__", "socket.bind", "socket.connect", "socket.getaddrinfo"),
        *("os.remove", "os.rename", "os.rmdir", "os.mkdir", "os.link", "os.symlink", "os.truncate", "os.utime"),
        *("os.chmod", "os.chown", "os.setxattr", "os.removexattr", "sqlite3.connect"),
    )
)
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND  # flags of an open file
SIGKILL = 9  # signal.SIGKILL, whose module is not built in
PROVING_ROWS = 512  # that a compiled function gets beside the interpreter before it is believed
PACKAGES = ("numpy", "scipy", "shapely")  # that a reward function may import where they are installed


class BadRewardError(Exception):
    """What the function returned is not a reward."""


class LogFile(io.TextIOBase):
    """What is opened in place of a log file: its lines go where prints go."""

    def __init__(self, prints: PrintRing) -> None:
        self._prints = prints

    def writable(self) -> bool:
        """Yes."""
        return True

    def write(self, text: str) -> int:
        """Print it."""
        return self._prints.write(text)

    def seek(self, offset: int, whence: int = 0) -> int:
        """Stay where it is, as a file that never grows."""
        return 0


class PrintRing(io.TextIOBase):
    """A text stream into shared memory that keeps the last bytes and never blocks, grows or fails."""

    def __init__(self, memory: memoryview) -> None:
        self._head = memory[: SIZE.size]
        self._ring = memory[SIZE.size :]
        self._written = 0

    def writable(self) -> bool:
        """Yes."""
        return True

    def write(self, text: str) -> int:
        """Append the text, over the oldest bytes when the ring is full."""
        room = len(self._ring)
        data = text[-room:].encode("utf-8", "replace")[-room:]
        start = self._written % room
        first = min(len(data), room - start)
        self._ring[start : start + first] = data[:first]
        self._ring[: len(data) - first] = data[first:]
        self._written += len(data)
        SIZE.pack_into(self._head, 0, self._written)
        return len(text)


def main() -> None:
    """Load the user's source, then serve batches until the caller hangs up or a call fails."""
    requests, replies, trace = os.dup(0), os.dup(1), os.dup(2)
    nowhere = os.open(os.devnull, os.O_RDWR)
    for standard in (0, 1, 2):
        os.dup2(nowhere, standard)
    setup = marshal.loads(read_exactly(requests, SIZE.unpack(read_exactly(requests, SIZE.size))[0]))

    memory = memoryview(mmap.mmap(setup["memory"], setup["memory_size"]))
    os.close(setup["memory"])
    prints = PrintRing(memory[setup["log_offset"] :])
    faulthandler.enable(trace, all_threads=False)
    faulthandler.register(setup["trace_signal"], trace, all_threads=False)
    end_with(setup["lifeline"])
    server = Server(setup, memory, replies)
    try:
        needed = (0, 1, 2, requests, replies, trace, setup["lifeline"])
        finish = load_program(setup["inside_path"])["enter"](setup["confinement"], needed)
    except Exception as error:
        server.fail(error, 0)
        return
    server.reply(LOCKED)
    refusal = b""
    try:
        sys.path.extend(setup["package_paths"])
        load_modules(setup["modules"], frozenset(setup["words"]))
        if setup["kernel"]:
            refusal = server.compile(setup)
        lock_imports(frozenset(name.partition(".")[0] for name in setup["modules"]))
        finish()
        del finish  # and with it the last that held ctypes
        sys.stdout = sys.stderr = prints
        replace_log_files(prints)
        sys.addaudithook(guard)
        functions = load_functions(setup["source"], seed=setup["seed"], num_cars=setup["num_cars"])
    except BaseException as error:
        server.fail(error, 0)
        return
    server.reply(READY, size=len(refusal))
    server.serve(requests, functions)


class Server:
    """Answers requests over the shared memory."""

    def __init__(self, setup: dict[str, Any], memory: memoryview, replies: int) -> None:
        self._make_params = load_program(setup["params_path"])["make_params"]
        self._row = struct.Struct(f"{setup['num_columns']}d")
        self._rows = memory[: setup["rewards_offset"]]
        self._rewards = memory[setup["rewards_offset"] : setup["text_offset"]].cast("d")
        self._text = memory[setup["text_offset"] : setup["log_offset"]]
        self._waypoints = setup["waypoints"]
        self._replies = replies
        self._process_id = os.getpid()
        self._write = os.write
        self._kernel: Callable[[Any, Any], None] | None = None
        self._num_proven = 0  # rows

    def compile(self, setup: dict[str, Any]) -> bytes:
        """Compile the rewritten source; why that cannot be done, or nothing."""
        import numpy as np

        try:
            compile_kernel = load_program(setup["kernel_path"])["compile_kernel"]
            self._kernel = compile_kernel(setup["kernel"], self._waypoints, setup["num_columns"])
        except Exception as error:
            refusal = describe(error)[: len(self._text)]
            self._text[: len(refusal)] = refusal
            return refusal
        self._row_array = np.frombuffer(self._rows, np.float64).reshape(-1, setup["num_columns"])
        self._reward_array = np.asarray(self._rewards)
        self._scratch = np.empty(len(self._reward_array))
        return b""

    def serve(self, requests: int, functions: list[Reward]) -> None:
        """Serve batches. Row i of the caller's array goes to function i modulo their number."""
        read = os.read
        while True:
            message = read(requests, REQUEST.size)
            if len(message) < REQUEST.size:
                return
            count, first = REQUEST.unpack(message)
            if self._kernel is None or not self._serve_compiled(count, self._kernel):
                if not self._serve_batch(count, first, functions):
                    return
                if self._kernel is not None:
                    self._prove(count)
            self.reply(REWARDS)

    def _serve_compiled(self, count: int, kernel: Callable[[Any, Any], None]) -> bool:
        """Try the compiled function; False where the interpreter has to answer instead."""
        rewards = self._scratch[:count]
        try:
            kernel(self._row_array[:count], rewards)
        except Exception:  # the interpreter raises the same, and says where
            rewards.fill(float("nan"))
            return False
        if self._num_proven < PROVING_ROWS or not (abs(rewards) <= REWARD_LIMIT).all():
            return False
        self._reward_array[:count] = rewards
        return True

    def _prove(self, count: int) -> None:
        """Compare with what the interpreter gave; a function that differs in a single bit is not compiled."""
        if (self._scratch[:count] == self._reward_array[:count]).all():
            self._num_proven += count
        else:
            self._kernel = None
            sys.stdout.write("[racecraft: compiled, this function gave other rewards; it goes on interpreted]\n")

    def _serve_batch(self, count: int, first: int, functions: list[Reward]) -> bool:
        make_params, waypoints, rewards = self._make_params, self._waypoints, self._rewards
        reward_function, num_functions = functions[0], len(functions)
        index = 0
        try:
            for row in self._row.iter_unpack(self._rows[: count * self._row.size]):
                if row[STEPS] == 1.0:  # the prepare step: AWS does not call the function, the reward is 0
                    rewards[index] = 0.0
                    index += 1
                    continue
                if num_functions > 1:
                    reward_function = functions[(first + index) % num_functions]
                reward = reward_function(make_params(row, waypoints))
                if type(reward) is not float:
                    reward = to_float(reward)
                if not -REWARD_LIMIT <= reward <= REWARD_LIMIT:
                    raise BadRewardError(f"returned {reward!r}; a reward is a finite number within ±100000")
                rewards[index] = reward
                index += 1
        except BadRewardError as error:
            self.fail(error, index, line=line_of_return(reward_function, make_params(row, waypoints)))
            return False
        except BaseException as error:
            self.fail(error, index)
            return False
        return True

    def reply(self, status: int, *, row: int = 0, line: int = -1, size: int = 0) -> None:
        """Ring back."""
        if os.getpid() != self._process_id:  # a copy that user code forked off: it has no voice
            os._exit(1)
        self._write(self._replies, REPLY.pack(status, row, line, size))

    def fail(self, error: BaseException, row: int, *, line: int = -1) -> None:
        """Report what went wrong; the process ends after this."""
        if line < 0:
            line = line_of(error)
        data = describe(error)[: len(self._text)]
        self._text[: len(data)] = data
        self.reply(FAILED, row=row, line=line, size=len(data))


def load_program(path: str) -> dict[str, Any]:
    """The names of a file of Racecraft's, run without importing the package around it."""
    namespace: dict[str, Any] = {"__name__": os.path.basename(path)}
    with open(path, encoding="utf-8") as file:
        code = compile(file.read(), path, "exec")
    exec(code, namespace)
    return namespace


def end_with(lifeline: int) -> None:
    """Have the kernel end this process, whatever it does, once nobody holds the other end of this pipe any more."""
    if sys.platform == "linux":
        import fcntl

        fcntl.fcntl(lifeline, fcntl.F_SETOWN, os.getpid())
        # SIGIO, the usual one, could be put off: by the mask of a crash's handler, or by one that a sigreturn brings
        fcntl.fcntl(lifeline, fcntl.F_SETSIG, SIGKILL)
        fcntl.fcntl(lifeline, fcntl.F_SETFL, fcntl.fcntl(lifeline, fcntl.F_GETFL) | os.O_ASYNC)


def load_modules(names: list[str], words: frozenset[str]) -> None:
    """Load what the source will import, and the parts of packages that its words may mean; nothing can be, later."""
    for name in names:
        load_module(name)
    if "numpy" in sys.modules:
        load_module("numpy.random")  # to seed it
    waiting = [name for name in (*names, *PACKAGES) if name in sys.modules and name.partition(".")[0] in PACKAGES]
    while waiting:
        package = waiting.pop()
        for folder in getattr(sys.modules[package], "__path__", ()):
            parts = {part.partition(".")[0] for part in os.listdir(folder)}
            waiting += [name for part in parts & words if load_module(name := f"{package}.{part}")]


def load_module(name: str) -> bool:
    """Import a module unless it is there already; the source's own statement will say why it cannot be."""
    try:
        if name.endswith(".*"):  # everything, and so also what a package loads when it is asked for it
            module = sys.modules[name[:-2]]
            for part in module.__all__:
                getattr(module, part, None)
            return True
        return name not in sys.modules and __import__(name) is not None
    except BaseException:
        return False


def lock_imports(looked_for: frozenset[str]) -> None:
    """From now on only modules that Python has built in can still be loaded."""
    without_files = sys.meta_path[:2]  # Python's own, of modules inside the interpreter: built in, or frozen
    sys.meta_path[:] = [*without_files, LockedFinder(looked_for)]
    if "ctypes" not in looked_for and "numpy" not in sys.modules:  # no wall: a tool that need not lie around
        for name in [name for name in sys.modules if name.partition(".")[0] in ("ctypes", "_ctypes")]:
            del sys.modules[name]


def replace_log_files(prints: PrintRing) -> None:
    """Let functions that write a log go on without its file."""
    os.getcwd = lambda: "/"  # what it is, and can no longer be asked
    if (logging := sys.modules.get("logging")) is None:
        return
    told: list[bool] = []

    def open_log(handler: Any) -> LogFile:
        if not told:
            told.append(True)
            prints.write("[racecraft: no log file is written; its lines are kept here]\n")
        return LogFile(prints)

    logging.FileHandler._open = open_log


class LockedFinder:
    """Stands in for the finder of files, as none can be opened any more."""

    def __init__(self, looked_for: frozenset[str]) -> None:
        self._looked_for = looked_for  # and not found, where they are asked for again

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:
        """Say why a module cannot be had."""
        if name.partition(".")[0] not in self._looked_for:
            raise ModuleNotFoundError(f"{name} cannot be loaded here: import it by its plain name", name=name)


def load_functions(source: str, *, seed: int, num_cars: int) -> list[Reward]:
    """Run the user's source once per car that keeps its own globals; each run gives one function."""
    code = compile(source, FILENAME, "exec", dont_inherit=True)
    if (random := sys.modules.get("random")) is not None:
        random.seed(seed)
    if (numpy_random := sys.modules.get("numpy.random")) is not None:
        numpy_random.seed(seed)  # what users call is the global generator

    functions = []
    for _ in range(num_cars):
        module = type(sys)("reward_function")
        sys.modules["reward_function"] = module  # dataclasses look up their module by name
        exec(code, module.__dict__)
        function = module.__dict__.get("reward_function")
        if not callable(function):
            raise BadRewardError("has no function 'reward_function(params)'")
        functions.append(by_position(function))
    return functions


def by_position(function: Any) -> Reward:
    """A function of 2018, which takes twelve values in radians instead of a dict, as one of `params`; others as is."""
    code = getattr(function, "__code__", None) if type(function) is type(by_position) else None
    if code is None or code.co_argcount != 12 or code.co_varnames[:11] != POSITIONS or function.__defaults__:
        return function  # type: ignore[no-any-return]

    def reward_function(params: dict[str, Any]) -> object:
        if params["is_offtrack"]:
            return 1e-8  # what AWS paid then, without asking
        x, y, waypoints = params["x"], params["y"], params["waypoints"]
        before, after = params["closest_waypoints"]
        to_before, to_after = [
            (waypoints[index][0] - x) ** 2 + (waypoints[index][1] - y) ** 2 for index in (before, after)
        ]
        return function(
            *(params["all_wheels_on_track"], x, y, params["distance_from_center"], params["heading"] * PI / 180.0),
            *(params["progress"], int(params["steps"]) - 1),  # AWS's first step had no number then
            *(params["speed"], params["steering_angle"] * PI / 180.0, params["track_width"]),
            *(waypoints, after if to_after < to_before else before),
        )

    return reward_function


def guard(event: str, arguments: tuple[object, ...]) -> None:
    """Refuse what a reward function has no use for, at the line that tries it."""
    if event in FORBIDDEN_EVENTS:
        raise PermissionError(f"a reward function may not use {event}")
    if event == "open" and not isinstance(arguments[0], int):
        writes = isinstance(arguments[2], int) and arguments[2] & WRITING
        raise PermissionError(f"a reward function may not {'write' if writes else 'read'} files")


def to_float(reward: Any) -> float:
    """What AWS's ``float()`` makes of a bool, an int, or numpy's scalar or array of one; a text is no number here."""
    try:
        if getattr(reward, "size", None) == 1 and hasattr(reward, "item"):
            reward = reward.item()  # numpy's own float() refuses an array that has dimensions, since 2.4
    except Exception:
        pass  # it is told below what it is
    if reward is None:
        raise BadRewardError("returned None; every path through the function must return a number")
    if isinstance(reward, (str, bytes, bytearray)):
        raise BadRewardError(f"returned the text {reward[:50]!r}; a reward is a number")
    try:
        return float(reward)
    except Exception as error:
        kind = type(reward).__name__
        raise BadRewardError(f"returned a value of type {kind}, which is not a number") from error


def line_of(error: BaseException) -> int:
    """The deepest line of the user's file in the error's traceback, or -1."""
    if isinstance(error, SyntaxError) and error.filename == FILENAME and error.lineno is not None:
        return error.lineno
    line, step = -1, error.__traceback__
    while step is not None:
        if step.tb_frame.f_code.co_filename == FILENAME:
            line = step.tb_lineno
        step = step.tb_next
    return line


def line_of_return(reward_function: Reward, params: dict[str, Any]) -> int:
    """The line that returns the bad value for these params, found by calling the function again under a trace.

    A function that remembers or draws random numbers may return a good one this time; then it is not known: -1.
    """
    line = -1

    def trace(frame: FrameType, event: str, value: object) -> Any:
        nonlocal line
        if frame.f_code.co_filename != FILENAME:
            return None
        if event == "return":
            line = frame.f_lineno  # the outermost frame returns last
        return trace

    shown = sys.stdout, sys.stderr
    sys.stdout = sys.stderr = io.StringIO()  # it has printed this once
    sys.settrace(trace)
    try:
        returned = reward_function(params)
    except BaseException:
        return -1
    finally:
        sys.settrace(None)
        sys.stdout, sys.stderr = shown
    try:
        is_good = abs(to_float(returned)) <= REWARD_LIMIT
    except BadRewardError:
        is_good = False
    return -1 if is_good else line


def describe(error: BaseException) -> bytes:
    """One line about the error, whatever its ``__str__`` does."""
    kind = type(error).__name__
    try:
        text = " ".join(str(error.msg if isinstance(error, SyntaxError) else error)[:2000].split())
    except BaseException:
        text = ""
    if isinstance(error, BadRewardError):
        message = text
    elif isinstance(error, ModuleNotFoundError) and error.name in PACKAGES:
        message = f"needs {error.name}, which is not installed here: pip install {error.name}"
    elif isinstance(error, SystemExit):
        message = f"called sys.exit({text})"
    elif isinstance(error, MemoryError) and not text:
        message = "raised MemoryError: the memory limit is used up"
    else:
        message = f"raised {kind}: {text}" if text else f"raised {kind}"
    return message.encode("utf-8", "replace")


def read_exactly(descriptor: int, size: int) -> bytes:
    """Read ``size`` bytes, however many reads it takes."""
    parts = []
    while size > 0:
        part = os.read(descriptor, min(size, 1 << 20))
        if not part:
            raise EOFError("the caller hung up during the setup")
        parts.append(part)
        size -= len(part)
    return b"".join(parts)


if __name__ == "__main__":
    main()
    os._exit(0)  # no atexit handler or thread of user code may hold up the end
