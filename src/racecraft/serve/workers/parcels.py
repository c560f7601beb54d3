"""What the worker that has a job may read and write of the object store: what the job names, and nothing else.

    runs/NAME.json  runs/NAME/SHA256    a run that the job reads
    SHELF/NAME.json SHELF/NAME/SHA256   what it fills: its run, or a folder of another kind
    tracks/SHA256                       a track that it drives on
    live/NAME                           its cars, only written

The keys are those of `racecraft.serve.store.artifacts`, without whose it is: that follows from the job. Content is kept
under its own digest or not at all, and a list of files only once all that it names is there.
"""

from __future__ import annotations

import re
import threading
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from racecraft.errors import RacecraftError, RunError
from racecraft.run import RunFolder
from racecraft.run.stretches import MAX_BYTES, stretches_as_it_is
from racecraft.serve.jobs.cargo import Cargo
from racecraft.serve.jobs.line import MAX_OBJECT
from racecraft.serve.jobs.queue import folder_of
from racecraft.serve.problems import Conflict, NotFound, Unreachable
from racecraft.serve.store.artifacts import MAX_LIVE_BYTES, RUNS, Artifacts, Copy, read_copy
from racecraft.serve.store.objects import Content, NoAnswer, NoObject
from racecraft.serve.store.tables import Job
from racecraft.serve.workers.leases import Lease

MAX_LIST: Final = 1 << 23
"""Bytes of a list of files."""
MAX_FOLDER: Final = 1 << 32
"""Bytes of all files of a list."""
MAX_WAITING: Final = 1 << 30
"""Bytes of content that no list names yet."""
FIXED: Final = re.compile(
    r"(run|tuning|model_metadata|hyperparameters|race_rules)\.json"
    r"|reward_function\.py|training_params\.yaml|parent/.*|ghosts/.*"
)
"""Files that say what is to be done: a job reads them and never changes them."""
STRETCH: Final = re.compile(r"stretches/([1-9]\d{0,3})\.json")
"""What was learned with; the newest one begins with the training, also when that begins again at the same step."""
_NAME: Final = r"[A-Za-z0-9_][A-Za-z0-9._-]{0,63}"
_KEY: Final = re.compile(
    rf"(?P<shelf>[a-z]{{1,16}})/(?:(?P<list>{_NAME})\.json|(?P<name>{_NAME})/(?P<digest>[0-9a-f]{{64}})|(?P<one>{_NAME}))"
)


@dataclass(frozen=True)
class Key:
    """A key that a worker named, taken apart."""

    shelf: str
    name: str
    digest: str = ""
    """Of a file's content; empty for the list of files."""
    is_single: bool = False
    """Whether it is neither, but a track or cars."""

    @classmethod
    def parse(cls, text: str) -> Key:
        """One that could be.

        Raises:
            NotFound: It could not.
        """
        found = _KEY.fullmatch(text)
        if found is None:
            raise NotFound("This job has nothing of this name.")
        if found["list"] is not None and found["shelf"] not in ("tracks", "live"):
            return cls(found["shelf"], found["list"])
        if found["digest"] is not None:
            return cls(found["shelf"], found["name"], found["digest"])
        return cls(found["shelf"], text.partition("/")[2], is_single=True)


class Parcels:
    """Of all jobs.

    Args:
        artifacts: The console's object store, or None.
    """

    def __init__(self, artifacts: Artifacts | None) -> None:
        self._artifacts = artifacts
        self._waiting: dict[str, dict[str, int]] = {}  # sizes by digest, of content that no list names yet, by job
        self._lock = threading.Lock()

    def fetch(self, job: Job, key: Key) -> Content:
        """What a job may read.

        Raises:
            NotFound: It is not there, or not for this job.
            Unreachable: The store does not answer.
        """
        store, cargo, filled = self._store(job), Cargo.from_dict(job.cargo), _filled(job)
        readable = key.is_single and key.shelf == "tracks" and key.name in cargo.tracks.values()
        if not key.is_single:
            readable = (key.shelf, key.name) == filled or (key.shelf == RUNS and key.name in cargo.runs)
        if not readable:
            raise NotFound("This job has nothing of this name.")
        try:
            if key.is_single:
                return store.objects.get(store.track_key(key.name))
            return store.objects.get(store.shelf(key.shelf).key(*_ending(key)))
        except NoObject as error:
            raise NotFound("This job has nothing of this name.") from error
        except NoAnswer as error:
            raise _no_answer() from error

    def require_writable(self, job: Job, key: Key, size: int) -> None:
        """Refuse before it is read what a job may not write, or so much of it.

        Raises:
            NotFound: It is not for this job.
            RunError: It is too large.
        """
        shelf, name = _filled(job)
        is_live = key.is_single and key.shelf == "live" and folder_of(job) is None and key.name == job.run
        if not is_live and (key.is_single or (key.shelf, key.name) != (shelf, name)):
            raise NotFound("This job has nothing of this name.")
        most = MAX_LIVE_BYTES if is_live else MAX_OBJECT if key.digest else MAX_LIST
        if size > most:
            raise RunError(f"This may have at most {most >> 20} MB.")
        with self._lock:
            waiting = sum(self._waiting.get(job.id, {}).values())
        if key.digest and waiting + size > MAX_WAITING:
            raise RunError(f"More than {MAX_WAITING >> 20} MB were sent that no list of files names.")

    def keep(self, job: Job, key: Key, data: bytes | Path, *, size: int, digest: str, lease: Lease) -> None:
        """Take in what `require_writable` allowed.

        Args:
            job: That the lease is about.
            key: Where it belongs.
            data: The content, or a file that holds it.
            size: In bytes.
            digest: Its SHA-256.
            lease: Of who sends it.

        Raises:
            Conflict: Another machine went on with the job.
            RunError: It is not what it is said to be.
            Unreachable: The store does not answer.
        """
        store = self._store(job).shelf(key.shelf)
        try:
            if key.is_single:
                assert isinstance(data, bytes)
                store.show(key.name, data)
            elif key.digest:
                if digest != key.digest:
                    raise RunError(
                        "What came has another digest than it was sent under.", hint="It was damaged on the way."
                    )
                store.objects.put(store.key(*_ending(key)), data)
                with self._lock:
                    self._waiting.setdefault(job.id, {})[digest] = size
            else:
                assert isinstance(data, bytes)
                self._list(job, store, key, data, lease)
        except NoAnswer as error:
            raise _no_answer() from error

    def forget(self, job: Job) -> None:
        """A job has ended or goes to another: what no list names is worth nothing."""
        with self._lock:
            waiting = self._waiting.pop(job.id, None)
        if waiting:
            shelf, name = _filled(job)
            store = self._store(job).shelf(shelf)
            with suppress(NoAnswer, RunError):
                named = {line["sha256"] for line in (store.copy(name) or Copy()).files.values()}
                store.objects.delete(store.key(name, digest) for digest in waiting.keys() - named)

    def _list(self, job: Job, store: Artifacts, key: Key, data: bytes, lease: Lease) -> None:
        name = key.name
        found, after = store.copy(name), read_copy(data, name)
        if found is None and key.shelf == RUNS:
            raise Conflict(f"Run {name!r} was removed.")
        before = found or Copy()
        if after == before:  # sent again, as its answer was lost
            return
        if after.number != before.number + 1 or (found is not None and after.life != before.life):
            raise Conflict(f"Run {name!r} was changed by another machine.")
        if sum(line["size"] for line in after.files.values()) > MAX_FOLDER:
            raise RunError(f"All files together may have at most {MAX_FOLDER >> 30} GB.")
        for path in sorted(before.files.keys() | after.files.keys()):
            is_settled = key.shelf == RUNS or path in before.files
            if is_settled and FIXED.fullmatch(path) and _what(before, path) != _what(after, path):
                raise RunError(f"A job does not change {path}.")
        there = {line["sha256"]: line["size"] for line in before.files.values()}
        with self._lock:
            waiting = dict(self._waiting.get(job.id, {}))
        there |= waiting
        for path, line in after.files.items():
            digest = line["sha256"]
            if digest not in there:  # sent to the server before this one
                try:
                    there[digest] = store.objects.get(store.key(name, digest)).size
                except NoObject as error:
                    raise RunError(f"{path} is in the list of files, and its content is not there.") from error
            if line["size"] != there[digest]:
                raise RunError(f"{path} has another size than the list of files says.")
        if key.shelf == RUNS:
            self._check_stretches(store, name, before, after)
        with lease.holding(job):
            store.objects.put(store.key(f"{name}.json"), data)
        with self._lock:
            self._waiting.pop(job.id, None)
        named = {line["sha256"] for line in after.files.values()}
        store.objects.delete(store.key(name, digest) for digest in there.keys() - named)

    def _check_stretches(self, store: Artifacts, name: str, before: Copy, after: Copy) -> None:
        """Refuse stretches that change what was, or say something else of the training than the files do."""
        last = max(_stretches(before), default=0)
        changed = {
            number: path
            for number, path in (_stretches(before) | _stretches(after)).items()
            if _what(before, path) != _what(after, path)
        }
        for number, path in sorted(changed.items()):
            if number < last:
                raise RunError(f"A job does not change {path}.")
        if not changed:
            return
        with TemporaryDirectory() as place:
            folder = RunFolder(Path(place))
            for path, line in after.files.items():
                if STRETCH.fullmatch(path) or (FIXED.fullmatch(path) and "/" not in path):
                    if line["size"] > MAX_BYTES:
                        raise RunError(f"This may have at most {MAX_BYTES >> 20} MB.")
                    file = folder.path / path
                    file.parent.mkdir(exist_ok=True)
                    file.write_bytes(store.objects.get(store.key(name, line["sha256"])).read())
            try:
                honest = stretches_as_it_is(folder)
            except RacecraftError as error:
                raise RunError(f"What run {name!r} learned with cannot be read.") from error
        for number, path in sorted(changed.items()):
            if path in after.files and number not in honest:
                raise RunError(f"{path} says something else than the files that a job does not change.")

    def _store(self, job: Job) -> Artifacts:
        if self._artifacts is None:
            raise NotFound("This console has no object store.")
        return self._artifacts.of(job.user_id)


def _filled(job: Job) -> tuple[str, str]:
    return folder_of(job) or (RUNS, job.run)


def _ending(key: Key) -> tuple[str, ...]:
    return (key.name, key.digest) if key.digest else (f"{key.name}.json",)


def _what(copy: Copy, path: str) -> str:
    return str(copy.files[path]["sha256"]) if path in copy.files else ""


def _stretches(copy: Copy) -> dict[int, str]:
    """The paths of a run's stretches by their numbers."""
    return {int(found[1]): path for path in copy.files if (found := STRETCH.fullmatch(path))}


def _no_answer() -> Unreachable:
    return Unreachable("The console's object store does not answer.", hint="Try again in a moment.")
