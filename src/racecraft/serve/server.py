"""Run the console: one process on 127.0.0.1, until Ctrl-C."""

from __future__ import annotations

import socket
import ssl
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import uvicorn

from racecraft.checks import check_whole
from racecraft.errors import ConfigError
from racecraft.reward.aside import Aside
from racecraft.reward.reading import read_by
from racecraft.serve.app import create_app
from racecraft.serve.door.prompt import PromptProtocol
from racecraft.serve.settings import ServeSettings
from racecraft.serve.store.sole import sole_server

ADDRESS = "127.0.0.1"


def serve(settings: ServeSettings, *, on_ready: Callable[[str], None]) -> None:
    """Serve until SIGINT or SIGTERM; trainings under way are saved and go on with the next server.

    Args:
        settings: Of the console.
        on_ready: Is given the one-time link as soon as connections are accepted.

    Raises:
        ConfigError: The port is taken, or the certificate cannot be used.
        RunError: A folder or the database cannot be opened, or another server of the same league does not stop.
    """
    check_whole("others", settings.other_slots, 1, 64)  # races and copies of runs are made here and nowhere else
    encryption = _encryption(settings)
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
    is_lost = threading.Event()
    with listener, _alone(settings, on_loss=is_lost.set):
        _serve(settings, listener, encryption, is_lost, on_ready)


def _alone(settings: ServeSettings, on_loss: Callable[[], None]) -> AbstractContextManager[None]:
    """What a league counts in memory two servers would count twice; who is alone at a console counts nothing."""
    return sole_server(settings.database_url, on_loss=on_loss) if settings.league else nullcontext()


def _serve(
    settings: ServeSettings,
    listener: socket.socket,
    encryption: dict[str, Any],
    is_lost: threading.Event,
    on_ready: Callable[[str], None],
) -> None:
    port = listener.getsockname()[1]
    app = create_app(settings, hosts={f"{name}:{port}" for name in (ADDRESS, "localhost", settings.host)})
    config = uvicorn.Config(
        app,
        log_level="warning",
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=2,
        http=PromptProtocol,
        proxy_headers=bool(settings.trusted_proxies),  # else by default of whoever is on this machine
        forwarded_allow_ips=list(settings.trusted_proxies),
        **encryption,
    )
    listener.listen(128)
    at = settings.address.rstrip("/") if settings.certificate else f"http://{ADDRESS}:{port}"
    on_ready(f"{at}/?ticket={app.state.guard.ticket()}")
    with read_by(Aside()):
        _Server(config, is_lost, on_stop=app.state.context.supervisor.news.end).run(sockets=[listener])


class _Server(uvicorn.Server):
    """Stops when the league is another server's, and says so before it waits for open requests.

    Among these are some that wait for news themselves.
    """

    def __init__(self, config: uvicorn.Config, is_lost: threading.Event, *, on_stop: Callable[[], None]) -> None:
        super().__init__(config)
        self._is_lost, self._on_stop = is_lost, on_stop

    async def on_tick(self, counter: int) -> bool:
        """Whether to stop; asked ten times a second."""
        return await super().on_tick(counter) or self._is_lost.is_set()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Stop."""
        self._on_stop()
        await super().shutdown(sockets)


def _encryption(settings: ServeSettings) -> dict[str, Any]:
    if settings.certificate is None:
        return {}
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(settings.certificate, settings.key)
    except (OSError, ssl.SSLError) as error:  # before anybody is let in, and in a sentence
        reason = error.strerror or error
        raise ConfigError(f"The certificate {settings.certificate} with its key cannot be used: {reason}.") from error
    return {"ssl_certfile": settings.certificate, "ssl_keyfile": settings.key}
