"""The run folder: what a run is made from, its checkpoints, logs and metrics, all safe against a kill."""

from racecraft.run.archive import archive_chunks
from racecraft.run.aws_log import AwsLog
from racecraft.run.checkpoint import Checkpoint, CheckpointStore, CheckpointWarning
from racecraft.run.episodes import Episode, EpisodeCounter
from racecraft.run.events import EventWriter
from racecraft.run.folder import RunFolder, RunInfo, list_runs
from racecraft.run.metrics import TrainingMetrics, Trial, read_metrics, write_evaluation_metrics
from racecraft.run.print_log import PrintLog
from racecraft.run.simtrace import SimTraceWriter, read_simtrace

__all__ = [
    "AwsLog",
    "Checkpoint",
    "CheckpointStore",
    "CheckpointWarning",
    "Episode",
    "EpisodeCounter",
    "EventWriter",
    "PrintLog",
    "RunFolder",
    "RunInfo",
    "SimTraceWriter",
    "TrainingMetrics",
    "Trial",
    "archive_chunks",
    "list_runs",
    "read_metrics",
    "read_simtrace",
    "write_evaluation_metrics",
]
