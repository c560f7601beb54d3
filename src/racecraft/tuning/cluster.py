"""Seats on a cluster of Ray: a run goes there whole, is trained wherever there is room, and comes back whole.

    run folder ──packed──▶ Ray's object store ──▶ a node trains ──packed──▶ run folder

A node that is lost takes nothing with it: Ray has another one train what it was sent, to the same bits.
"""

from __future__ import annotations

import io
import tarfile
import tempfile
import threading
from pathlib import Path
from typing import Any, Final

from racecraft.errors import ConfigError, RacecraftError
from racecraft.extras import needed_for
from racecraft.moved import move
from racecraft.run import RunFolder
from racecraft.track.selection import JOINT
from racecraft.training.job import Training
from racecraft.tuning.seats import Seat, SeatLost, error_of, told
from racecraft.tuning.trial import Order, Report, run_trial

RETRIES: Final = 5
"""Nodes that may be lost with one training before it is given back."""
GLANCE: Final = 0.5  # s between two looks whether somebody wants the end
LAST: Final = "checkpoints/manifest.json"
"""File that makes what was unpacked before it count."""


def cluster_seats(address: str, most: int) -> list[Seat]:
    """A seat for each core of a cluster, and no more than so many.

    Args:
        address: ``auto`` for the cluster that this machine belongs to, or as Ray names one: ``ray://HOST:10001``.
        most: Seats.

    Raises:
        ConfigError: Ray is not installed, or there is no cluster.
    """
    with needed_for("--cluster"):
        import ray
    try:
        ray.init(address=address, log_to_driver=False, logging_level="ERROR", ignore_reinit_error=True)
        cores = int(ray.cluster_resources().get("CPU", 0))
    except (ConnectionError, RuntimeError, ValueError, OSError) as error:
        first = (str(error).splitlines() or [type(error).__name__])[0][:200]
        raise ConfigError(f"There is no cluster of Ray at {address!r}: {first}", hint="Start one: ray start") from error
    train = ray.remote(num_cpus=1, max_retries=RETRIES)(train_packed)
    return [ClusterSeat(ray, train) for _ in range(max(1, min(cores, most)))]


class ClusterSeat:
    """One training at a time somewhere on a cluster."""

    def __init__(self, ray: Any, train: Any) -> None:
        self._ray, self._train = ray, train
        self._is_stopped = threading.Event()

    def run(self, order: Order) -> Report:
        """See `Seat`; what is stopped was not trained."""
        folder = RunFolder.open(Path(order.run))
        sent = self._train.remote(pack(folder.path), tracks_of(folder), {**order.to_dict(), "num_threads": 1})
        while not self._ray.wait([sent], timeout=GLANCE)[0]:
            if self._is_stopped.is_set():
                self._ray.cancel(sent, force=True)
                raise SeatLost("It was stopped.")
        try:
            packed, answer = self._ray.get(sent)
        except self._ray.exceptions.RayError as error:
            raise SeatLost(f"The cluster lost the training: {type(error).__name__}.") from error
        if "error" in answer:
            raise error_of(answer["error"])
        with folder.lock():
            unpack(packed, folder.path)
        return Report.from_dict(answer)

    def stop(self) -> None:
        """See `Seat`."""
        self._is_stopped.set()

    def close(self) -> None:
        """See `Seat`."""
        self._ray.shutdown()


def train_packed(packed: bytes, tracks: dict[str, bytes], order: dict[str, Any]) -> tuple[bytes, dict[str, Any]]:
    """What a node does: train a run that was packed; it packed again, and what there is to report."""
    with tempfile.TemporaryDirectory() as place:
        run = Path(place) / Path(order["run"]).name
        unpack(packed, run)
        places = {}
        for number, (path, content) in enumerate(tracks.items()):
            places[path] = Path(place) / str(number) / Path(path).name
            places[path].parent.mkdir()
            places[path].write_bytes(content)
        move(places)
        try:
            report = run_trial(Order.from_dict({**order, "run": str(run)}), on_training=_nothing)
        except RacecraftError as error:
            return b"", {"error": told(error)}
        return pack(run), report.to_dict()


def tracks_of(folder: RunFolder) -> dict[str, bytes]:
    """The files of tracks that a run is trained on, by the paths that it names.

    Raises:
        ConfigError: It needs what is not sent to a cluster.
    """
    info = folder.read_info()
    if any(driver != "self" for driver in (info.settings.get("opponents") or {}).get("drivers", ())):
        raise ConfigError(f"Run {folder.name!r} races against other runs, which a cluster does not have.")
    files = {}
    for name in info.track.split(JOINT):
        path = Path(name.strip())
        if path.is_dir():
            raise ConfigError(f"Run {folder.name!r} is trained on a folder of tracks, which a cluster does not have.")
        if path.is_file():
            files[name.strip()] = path.read_bytes()
    return files


def pack(run: Path) -> bytes:
    """All of a run but what is hidden, the list of its checkpoints last."""
    files = [path for path in sorted(run.rglob("*")) if path.is_file() and not path.is_symlink()]
    names = {path.relative_to(run).as_posix(): path for path in files}
    kept = [name for name in names if not any(part.startswith(".") for part in Path(name).parts)]
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w") as archive:
        for name in sorted(kept, key=lambda name: name == LAST):
            archive.add(names[name], arcname=name, recursive=False)
    return packed.getvalue()


def unpack(packed: bytes, run: Path) -> None:
    """Have a run as it was packed, over what is there."""
    run.mkdir(parents=True, exist_ok=True)
    with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
        archive.extractall(run, filter="data")


def _nothing(_: Training) -> None:
    """Nobody on a node stops a training."""
