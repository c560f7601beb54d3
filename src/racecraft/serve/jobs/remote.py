"""The queue and the object store of a console, through its server: for workers that hold nothing but a token.

Every address names the worker that asks, and the server answers about the one job that this worker has.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from racecraft.errors import RunError
from racecraft.serve.jobs.line import MAX_OBJECT, Line, Refused
from racecraft.serve.jobs.office import MAX_CODE, MAX_TOLD, Answer, OfficeAway, Slot
from racecraft.serve.jobs.parcel import HEAD, MAX_PARCEL, pack
from racecraft.serve.store.objects import Content, NoObject
from racecraft.serve.store.tables import Job
from racecraft.version import VERSION

ROOM: Final = "/api/workers"
FIELDS: Final = ("id", "kind", "run", "user_id", "payload", "cargo", "travels", "attempts")
"""What a worker is told of a job."""


class RemoteOffice:
    """A console's queue.

    Args:
        line: To its server.
    """

    def __init__(self, line: Line) -> None:
        self._line = line
        self._heard = -1

    def take(
        self, slot: Slot, kinds: tuple[str, ...], *, owner: str, machine: str, places: int, is_home: bool
    ) -> Job | None:
        """The next job for a place of this machine; where all are taken, have somebody rest for who waits."""
        if places == 0:
            return None
        asked = {"slot": slot, "kinds": list(kinds), "machine": machine, "places": places, "version": VERSION}
        return _job(self._line.ask("POST", f"{ROOM}/{owner}/take", asked))

    def listen(self) -> None:
        """Return as soon as there may be something new, which the server answers with, or after some seconds."""
        told = self._line.ask("GET", f"{ROOM}/news?after={self._heard}")
        found = told.get("number") if isinstance(told, dict) else None
        if type(found) is not int:
            raise OfficeAway("The console's answer is no news.")
        self._heard = found

    def held(self, owner: str) -> Job | None:
        """The job that a worker has."""
        return _job(self._line.ask("GET", f"{ROOM}/{owner}/job"))

    def heartbeat(self, job_id: str, *, owner: str, has_progressed: bool = False) -> Answer:
        """Keep a job, and hear whether to go on; who is refused has lost it."""
        try:
            told = self._line.ask(
                "POST", f"{ROOM}/{owner}/heartbeat", {"job": job_id, "has_progressed": has_progressed}
            )
        except Refused:
            return Answer("lost")
        word = str(told.get("word")) if isinstance(told, dict) else ""
        if word not in ("go on", "rest", "stop", "lost"):
            raise OfficeAway("The console's answer to a heartbeat is none.")
        return Answer(word, told.get("is_watched") is True)  # type: ignore[arg-type]

    def finish(
        self,
        job_id: str,
        *,
        owner: str,
        state: str,
        result: Mapping[str, Any] | None = None,
        error: Mapping[str, Any] | None = None,
    ) -> bool:
        """End a job that this owner holds; False when it is another's now."""
        error = None if error is None else _shortened(error)
        told = {"job": job_id, "state": state, "result": result, "error": error}
        return self._tell(f"{ROOM}/{owner}/finish", told)

    def hand_back(self, owner: str) -> None:
        """Put back what an owner was asked to let go of."""
        self._tell(f"{ROOM}/{owner}/release", {"why": "asked"})

    def release(self, owner: str, *, has_company: bool = False) -> None:
        """Put back what an owner holds that has ended without a word."""
        self._tell(f"{ROOM}/{owner}/release", {"why": "all died" if has_company else "died"})

    def take_back_expired(self) -> None:
        """That is for the console's own machine."""

    def _tell(self, path: str, told: Mapping[str, Any]) -> bool:
        try:
            self._line.ask("POST", path, told)
        except Refused:  # it is another's now
            return False
        return True


class RemoteObjects:
    """What a job may read and write of a console's object store.

    Args:
        line: To its server.
        owner: The worker that has the job.
    """

    def __init__(self, line: Line, owner: str) -> None:
        self.url = line.url
        self._line, self._room = line, f"{ROOM}/{owner}/objects"

    def get(self, key: str) -> Content:
        """What is under a key."""
        try:
            return self._line.fetch(f"{self._room}/{quote(key)}")
        except Refused as error:
            if error.status == 404:
                raise NoObject(str(error)) from error
            raise

    def put(self, key: str, data: bytes | Path) -> None:
        """Have this under a key."""
        content = data.read_bytes() if isinstance(data, Path) else data
        if len(content) > MAX_OBJECT:
            raise Refused(f"A file is larger than {MAX_OBJECT >> 20} MB, more than a worker may send.")
        self._line.send(f"{self._room}/{quote(key)}", content)

    @contextmanager
    def together(self) -> Iterator[Callable[[str, bytes], None]]:
        """A block that puts much, in as few requests as it takes."""
        pieces: list[tuple[str, bytes]] = []
        room = MAX_PARCEL

        def send() -> None:
            nonlocal room
            if pieces:
                self._line.send(self._room, pack(pieces))
            pieces.clear()
            room = MAX_PARCEL

        def put(key: str, data: bytes) -> None:
            nonlocal room
            size = HEAD + len(data)
            if size > room:
                send()
            if size > room:
                self.put(key, data)
            else:
                pieces.append((key, data))
                room -= size

        yield put
        send()

    def delete(self, keys: Iterable[str]) -> None:
        """The server does that itself, when a list of files no longer names them."""

    def beside(self, key: str) -> list[str]:
        """A job knows the names of what it needs."""
        raise RunError("A worker does not see what else is in the store.")

    def below(self, key: str) -> list[str]:
        """As `beside`."""
        return self.beside(key)


def _shortened(error: Mapping[str, Any]) -> dict[str, Any]:
    """An error as the server takes it: refused for its length it would be no failure, but a job to be begun again."""
    bounds = {"code": MAX_CODE, "message": MAX_TOLD, "hint": MAX_TOLD}
    cut = {key: error[key][: most - 1] + "…" for key, most in bounds.items() if len(error.get(key, "")) > most}
    return {**error, **cut}


def _job(told: Any) -> Job | None:
    if told is None:
        return None
    if not isinstance(told, dict) or set(told) != set(FIELDS):
        raise Refused("The console's answer is no job.", hint="Install the same version of Racecraft on both machines.")
    return Job(**told)
