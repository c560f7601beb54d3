"""The log of AWS's simulator and trainer, as tools read it line by line.

SIM_TRACE_LOG:0,2,3.1997,0.6831,0.1833,-30.00,1.00,0,1.0000,False,True,0.7906,1,17.71,6.279,in_progress,0.00,0
Training> Name=main_level/agent, Worker=0, Episode=1, Total reward=2.66, Steps=20, Training iteration=0
Policy training> Surrogate loss=-0.01, KL divergence=0.01, Entropy=2.6, training epoch=0, learning_rate=0.0003
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TextIO

from racecraft.errors import RunError
from racecraft.run.closing import Closing
from racecraft.run.episodes import Episode

if TYPE_CHECKING:
    from racecraft.agent import ModelMetadata

STDOUT: Final = "-"
_LIDAR: Final = {"num_sectors": 8, "num_values_per_sector": 8, "clipping_dist": 2.0}


class AwsLog(Closing):
    """Writes the lines to a file or to stdout; a context manager.

    Args:
        path: A file, or ``-`` for stdout.
        phase: What the episodes are: ``Training`` or ``Testing``.
        steps: Steps behind a resumed training, whose file is continued.
    """

    def __init__(self, path: str | Path, *, phase: str = "Training", steps: int = 0) -> None:
        self.path = path
        self.phase = phase
        self._steps = steps
        self._is_own = str(path) != STDOUT
        self._file: TextIO = sys.stdout
        try:
            if self._is_own:
                own = Path(path)
                own.parent.mkdir(parents=True, exist_ok=True)
                self._file = own.open("a" if steps else "w", encoding="utf-8")
        except OSError as error:
            raise self._failure(error) from error

    def write_settings(self, *, world: str, metadata: ModelMetadata, hyperparameters: dict[str, Any]) -> None:
        """What a job is: track, sensors, network, actions and AWS's hyperparameters."""
        document = metadata.to_dict()
        version = float(document["version"])
        self._print(
            f" * /WORLD_NAME: {world}\n"
            f"Sensor list {document['sensor']!r}, network {document['neural_network']}, simapp_version {version}, "
            f"training_algorithm {document['training_algorithm']}, "
            f"action_space_type {document['action_space_type']} lidar_config {_LIDAR}\n"
            f"Action space from file: {document['action_space']!r}\n"
            f"Using the following hyper-parameters\n{json.dumps(hyperparameters, indent=2)}\n"
        )

    def write_episode(self, rows: Sequence[Sequence[str]], episode: Episode, *, iteration: int) -> None:
        """An episode: the rows of its sim-trace, their fields as text, and its sum."""
        self._steps += len(rows)
        self._print(
            "".join(f"SIM_TRACE_LOG:{_rounded(row)}\n" for row in rows)
            + f"{self.phase}> Name=main_level/agent, Worker=0, Episode={episode.number + 1}, "
            f"Total reward={round(episode.reward, 2)}, Steps={self._steps}, Training iteration={iteration}\n"
        )

    def write_policy(
        self, *, surrogate_loss: float, kl_divergence: float, entropy: float, epoch: int, learning_rate: float
    ) -> None:
        """An update of the policy."""
        self._print(
            f"Policy training> Surrogate loss={surrogate_loss}, KL divergence={kl_divergence}, Entropy={entropy}, "
            f"training epoch={epoch}, learning_rate={learning_rate}\n"
        )

    def flush(self) -> None:
        """Hand everything to the system."""
        try:
            self._file.flush()
        except OSError as error:
            raise self._failure(error) from error

    def close(self) -> None:
        """Finish the file; stdout stays open."""
        self.flush()
        if self._is_own:
            self._file.close()

    def _print(self, text: str) -> None:
        try:
            self._file.write(text)
        except OSError as error:
            raise self._failure(error) from error

    def _failure(self, error: OSError) -> RunError:
        name = self.path if self._is_own else "stdout"
        return RunError(f"The log {name} cannot be written: {error.strerror or error}.")


def _rounded(row: Sequence[str]) -> str:
    """The fields in the widths that AWS prints: four digits, two for angles, speeds and lengths."""
    number, steps, x, y, yaw, steer, throttle, action, reward, done, wheels, progress, closest, length = row[:14]
    stamp, status, pause, crashes = row[14:18]
    return (
        f"{number},{float(steps):.0f},{float(x):.4f},{float(y):.4f},{float(yaw):.4f},{float(steer):.2f},"
        f"{float(throttle):.2f},{action},{float(reward):.4f},{done},{wheels},{float(progress):.4f},{closest},"
        f"{float(length):.2f},{stamp},{status},{float(pause):.2f},{crashes}"
    )
