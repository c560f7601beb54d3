"""The run folder: what a run is made from, its checkpoints, logs and metrics, all safe against a kill."""

from racecraft.run.archive import archive_chunks
from racecraft.run.aws_log import AwsLog
from racecraft.run.checkpoint import Checkpoint, CheckpointStore, CheckpointWarning
from racecraft.run.episodes import Episode, EpisodeCounter
from racecraft.run.events import EventWriter
from racecraft.run.folder import RunFolder, RunInfo, list_runs
from racecraft.run.judged import Judged, best_of, judged_laps
from racecraft.run.metrics import TrainingMetrics, Trial, read_metrics, write_evaluation_metrics
from racecraft.run.print_log import PrintLog
from racecraft.run.simtrace import SimTraceWriter, read_simtrace
from racecraft.run.stretches import Stretch, begin_stretch, change_reward, read_stretches, stretch_at

__all__ = [
    "AwsLog",
    "Checkpoint",
    "CheckpointStore",
    "CheckpointWarning",
    "Episode",
    "EpisodeCounter",
    "EventWriter",
    "Judged",
    "PrintLog",
    "RunFolder",
    "RunInfo",
    "SimTraceWriter",
    "Stretch",
    "TrainingMetrics",
    "Trial",
    "archive_chunks",
    "begin_stretch",
    "best_of",
    "change_reward",
    "judged_laps",
    "list_runs",
    "read_metrics",
    "read_simtrace",
    "read_stretches",
    "stretch_at",
    "write_evaluation_metrics",
]
