"""Run the console: one process on 127.0.0.1, until Ctrl-C."""

from __future__ import annotations

import socket
from collections.abc import Callable

import uvicorn

from racecraft.checks import check_whole
from racecraft.errors import ConfigError
from racecraft.serve.app import create_app
from racecraft.serve.settings import ServeSettings

ADDRESS = "127.0.0.1"


def serve(settings: ServeSettings, *, on_ready: Callable[[str], None]) -> None:
    """Serve until SIGINT or SIGTERM; trainings under way are saved and go on with the next server.

    Args:
        settings: Of the console.
        on_ready: Is given the one-time link as soon as connections are accepted.

    Raises:
        ConfigError: The port is taken.
        RunError: A folder or the database cannot be opened.
    """
    check_whole("others", settings.other_slots, 1, 64)  # races and copies of runs are made here and nowhere else
    # Called TCP by name, or asyncio leaves Nagle's algorithm on, and every reply waits 40 ms for an acknowledgement.
    listener = socket.socket(proto=socket.IPPROTO_TCP)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((settings.host, settings.port))
    except OSError as error:
        listener.close()
        raise ConfigError(
            f"Port {settings.port} of {settings.host} cannot be used: {error.strerror}.",
            hint="Choose another with --port.",
        ) from error
    port = listener.getsockname()[1]
    app = create_app(settings, hosts={f"{name}:{port}" for name in (ADDRESS, "localhost", settings.host)})
    config = uvicorn.Config(
        app, log_level="warning", access_log=False, server_header=False, timeout_graceful_shutdown=2
    )
    listener.listen(128)
    on_ready(f"http://{ADDRESS}:{port}/?ticket={app.state.guard.ticket()}")
    uvicorn.Server(config).run(sockets=[listener])
