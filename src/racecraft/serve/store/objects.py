"""Bytes by keys: the little that copies of runs need of an object store, so that another way to one can stand in."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Protocol

from racecraft.errors import ConfigError
from racecraft.extras import needed_for

SCHEMES: Final = ("s3://", "file:///")
AT_ONCE: Final = 24
"""Threads of a process that ask a store; a server has 40, and a store may take minutes to answer none."""
WAIT: Final = 5.0  # s for a place among them, and none while others waited in vain


class NoAnswer(Exception):
    """The store cannot be reached, or fails; the message says how."""


class NoObject(NoAnswer):
    """There is nothing under this key."""


@dataclass(frozen=True)
class Content:
    """What is under a key."""

    size: int
    chunks: Iterator[bytes]

    def read(self) -> bytes:
        """All of it."""
        return b"".join(self.chunks)


class Objects(Protocol):
    """A store, or what stands for one; every method may raise `NoAnswer`."""

    url: str
    """As messages call it."""

    def get(self, key: str) -> Content:
        """What is under a key; raises `NoObject`."""

    def put(self, key: str, data: bytes | Path) -> None:
        """Have this under a key, or a file's content, from now on."""

    def together(self) -> AbstractContextManager[Callable[[str, bytes], None]]:
        """A block that puts much: in the order in which it does, and all when it has ended well."""

    def delete(self, keys: Iterable[str]) -> None:
        """Have nothing under these keys."""

    def beside(self, key: str) -> list[str]:
        """The keys directly below one."""

    def below(self, key: str) -> list[str]:
        """All keys below one."""


class ObjectStore:
    """S3 or a folder, through obstore.

    Args:
        url: ``s3://bucket/prefix`` or ``file:///folder``.

    Raises:
        ConfigError: No such kind of store, or it cannot be opened.
    """

    def __init__(self, url: str) -> None:
        if not url.startswith(SCHEMES):
            raise ConfigError(
                f"artifacts is {url.split('://')[0]!r}; allowed are s3://BUCKET/PREFIX and file:///FOLDER."
            )
        with needed_for("An object store"):
            import obstore
            from obstore import exceptions, store
        self.url = url
        self._places, self._is_stuck = threading.Semaphore(AT_ONCE), False
        self._api, self._missing = obstore, (exceptions.NotFoundError, FileNotFoundError)
        self._broken = (exceptions.BaseError, OSError)
        endpoint = os.environ.get("AWS_ENDPOINT_URL", os.environ.get("AWS_ENDPOINT", ""))
        try:
            if url.startswith("file:"):  # to the letter: names of folders may hold what an address takes for its own
                self._store: Any = store.LocalStore(Path(url.removeprefix("file://")), mkdir=True)
            else:
                # obstore's own 5 s to connect and 30 s to answer are too short where a machine or a line is busy
                times = {"connect_timeout": "30 seconds", "timeout": "300 seconds"}
                options: Any = {"allow_http": endpoint.startswith("http://"), **times}
                retries: Any = {"max_retries": 3}
                self._store = store.from_url(url, client_options=options, retry_config=retries)
        except (*self._broken, ValueError) as error:
            raise ConfigError(f"The object store {url} cannot be opened: {first_line(error)}.") from error

    def get(self, key: str) -> Content:
        """What is under a key."""
        with self._translated():
            reply = self._api.get(self._store, key)
            return Content(reply.meta["size"], self._chunks(reply))

    def _chunks(self, reply: Any) -> Iterator[bytes]:
        stream = iter(reply.stream())
        while True:
            with self._translated():  # not while who reads takes its time
                chunk = next(stream, None)
            if chunk is None:
                return
            yield bytes(chunk)

    def put(self, key: str, data: bytes | Path) -> None:
        """Have this under a key."""
        with self._translated():
            self._api.put(self._store, key, data)

    @contextmanager
    def together(self) -> Iterator[Callable[[str, bytes], None]]:
        """A block that puts much."""
        yield self.put

    def delete(self, keys: Iterable[str]) -> None:
        """Have nothing under these keys."""
        for key in keys:
            try:
                with self._translated():
                    self._api.delete(self._store, key)
            except NoObject:
                continue

    def beside(self, key: str) -> list[str]:
        """The keys directly below one."""
        with self._translated():
            return [entry["path"] for entry in self._api.list_with_delimiter(self._store, key)["objects"]]

    def below(self, key: str) -> list[str]:
        """All keys below one."""
        with self._translated():
            return [entry["path"] for page in self._api.list(self._store, key) for entry in page]

    @contextmanager
    def _translated(self) -> Iterator[None]:
        """One of the places, and errors of ours."""
        if not self._places.acquire(timeout=0.0 if self._is_stuck else WAIT):
            self._is_stuck = True
            raise NoAnswer("too many wait for it")
        try:
            yield
        except self._missing as error:
            raise NoObject(first_line(error)) from error
        except self._broken as error:
            raise NoAnswer(first_line(error)) from error
        finally:
            self._is_stuck = False
            self._places.release()


def first_line(error: BaseException) -> str:
    """What an error of somebody else's says, short."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0][:300].rstrip(".")
