"""Browsers of other engines than Chromium's, by what each speaks itself, so that nothing is installed beside them.

Firefox speaks Marionette: WebDriver's commands as JSON over TCP. WebKit (GTK) has a program that speaks WebDriver over
HTTP. A script's result comes back as JSON has it.
"""

from __future__ import annotations

import base64
import http.client
import json
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, Protocol

from free_ports import free_port

FIREFOX = shutil.which("firefox-esr") or shutil.which("firefox")
WEBKIT = shutil.which("WebKitWebDriver")
SCREEN = shutil.which("Xvfb")  # WebKit has no mode without one
PATIENCE: Final = 120.0  # s, of whatever is waited for
PREFERENCES: Final = """user_pref("marionette.port", {port});
user_pref("browser.shell.checkDefaultBrowser", false);
user_pref("datareporting.policy.dataSubmissionEnabled", false);
user_pref("network.captive-portal-service.enabled", false);
user_pref("browser.startup.page", 0);
user_pref("webgl.force-enabled", true);
user_pref("app.update.enabled", false);
"""


class BrowserFailed(Exception):
    """What a browser says of a command that it could not follow."""


class Wire(Protocol):
    """Carries WebDriver's commands."""

    def __call__(self, name: str, **told: Any) -> Any:
        """The result's value."""


class Marionette:
    """Firefox's own port: messages are [0, number, command, arguments] and [1, number, error, result]."""

    def __init__(self, port: int) -> None:
        self._socket, self._number = connected(port), 0
        self._read()  # who it is
        self("NewSession")

    def __call__(self, name: str, **told: Any) -> Any:
        self._number += 1
        message = json.dumps([0, self._number, f"WebDriver:{name}", told]).encode()
        self._socket.sendall(b"%d:%s" % (len(message), message))
        _, _, error, result = self._read()
        if error:
            raise BrowserFailed(error["message"])
        return result["value"] if isinstance(result, dict) and set(result) == {"value"} else result

    def close(self) -> None:
        """Hang up."""
        self._socket.close()

    def _read(self) -> Any:
        size = b""
        while not size.endswith(b":"):
            size += self._take(1)
        return json.loads(self._take(int(size[:-1])))

    def _take(self, count: int) -> bytes:
        taken = b""
        while len(taken) < count:
            part = self._socket.recv(count - len(taken))
            if not part:
                raise BrowserFailed("Firefox has gone.")
            taken += part
        return taken


class WebDriver:
    """The protocol over HTTP."""

    PATHS: Final = {
        "Navigate": ("POST", "/url"),
        "ExecuteAsyncScript": ("POST", "/execute/async"),
        "TakeScreenshot": ("GET", "/screenshot"),
        "SetWindowRect": ("POST", "/window/rect"),
        "SetTimeouts": ("POST", "/timeouts"),
        "DeleteSession": ("DELETE", ""),
    }

    def __init__(self, port: int, options: dict[str, Any]) -> None:
        connected(port).close()
        self._port = port
        answer = self._ask("POST", "/session", {"capabilities": {"alwaysMatch": options}})
        self._session = f"/session/{answer['sessionId']}"

    def __call__(self, name: str, **told: Any) -> Any:
        method, path = self.PATHS[name]
        return self._ask(method, self._session + path, told)

    def _ask(self, method: str, path: str, told: dict[str, Any]) -> Any:
        line = http.client.HTTPConnection("127.0.0.1", self._port, timeout=PATIENCE + 10)
        line.request(method, path, json.dumps(told) if method == "POST" else None)
        value = json.loads(line.getresponse().read())["value"]
        line.close()
        if isinstance(value, dict) and "error" in value:
            raise BrowserFailed(value.get("message") or value["error"])
        return value


class Tab:
    """A page of some browser."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        wire("SetTimeouts", script=int(1000 * PATIENCE), pageLoad=int(1000 * PATIENCE))

    def open(self, address: str) -> None:
        """Go there."""
        self._wire("Navigate", url=address)

    def run(self, expression: str, *given: Any) -> Any:
        """What a JavaScript function, or the promise that it gives, comes to."""
        script = (
            "const told = arguments[arguments.length - 1];"
            f"Promise.resolve().then(() => ({expression})(...Array.from(arguments).slice(0, -1)))"
            ".then((value) => told({ value }), (error) => told({ error: String(error) }));"
        )
        answer = self._wire("ExecuteAsyncScript", script=script, args=list(given))
        if "error" in answer:
            raise BrowserFailed(answer["error"])
        return answer.get("value")

    def wait(self, expression: str, *given: Any) -> Any:
        """Until a function gives something that is true."""
        until = time.monotonic() + PATIENCE
        while not (value := self.run(expression, *given)):
            if time.monotonic() > until:
                text = self.run("() => document.body.innerText")
                raise BrowserFailed(f"{expression} {given} does not come true on: {text}")
            time.sleep(0.1)
        return value

    def resize(self, width: int, height: int) -> None:
        """Of the window."""
        self._wire("SetWindowRect", width=width, height=height)

    def picture(self, path: Path) -> None:
        """Save what is seen as PNG."""
        path.write_bytes(base64.b64decode(self._wire("TakeScreenshot")))


def connected(port: int) -> socket.socket:
    """A connexion to a program that has just been started."""
    until = time.monotonic() + PATIENCE
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port), timeout=PATIENCE + 10)
        except OSError:
            if time.monotonic() > until:
                raise
            time.sleep(0.05)


@contextmanager
def firefox(folder: Path) -> Iterator[Tab]:
    """A Firefox without a window, whose profile is a folder."""
    port = free_port()
    (folder / "user.js").write_text(PREFERENCES.format(port=port), encoding="utf-8")
    command = [str(FIREFOX), "--headless", "--no-remote", "--marionette", "--profile", str(folder)]
    with running(command, {"HOME": str(folder), "MOZ_REMOTE_SETTINGS_DEVTOOLS": "1"}):
        wire = Marionette(port)
        yield Tab(wire)
        wire.close()


@contextmanager
def webkit(folder: Path) -> Iterator[Tab]:
    """WebKit's small browser, on a screen that nobody sees."""
    port = free_port()
    browser = next(Path("/usr/lib").glob("*/webkit2gtk-4.*/MiniBrowser"))
    told = {"webkitgtk:browserOptions": {"binary": str(browser), "args": ["--automation"]}}
    surroundings = {
        "LANG": "en_US.UTF-8",  # or the page would be told "C", which no formatter of numbers takes
        "HOME": str(folder),
        "XDG_RUNTIME_DIR": str(folder),
        "WEBKIT_DISABLE_SANDBOX_THIS_IS_DANGEROUS": "1",
    }
    with screen() as display, running([str(WEBKIT), f"--port={port}"], {**surroundings, "DISPLAY": display}):
        wire = WebDriver(port, told)
        yield Tab(wire)
        wire("DeleteSession")


@contextmanager
def screen() -> Iterator[str]:
    """Name of a screen that nobody sees."""
    read, write = os.pipe()
    command = [str(SCREEN), "-displayfd", str(write), "-screen", "0", "1600x1200x24", "-nolisten", "tcp"]
    with running(command, {}, pass_fds=(write,)):
        os.close(write)
        with os.fdopen(read) as told:
            yield f":{told.readline().strip()}"


@contextmanager
def running(command: list[str], surroundings: dict[str, str], pass_fds: tuple[int, ...] = ()) -> Iterator[None]:
    """A program and what it starts, until the end."""
    options: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "pass_fds": pass_fds}
    program = subprocess.Popen(command, env={**os.environ, **surroundings}, start_new_session=True, **options)
    try:
        yield
    finally:
        os.killpg(program.pid, 15)
        try:
            program.wait(10)
        except subprocess.TimeoutExpired:
            os.killpg(program.pid, 9)
            program.wait()
