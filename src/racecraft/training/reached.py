"""Whether a training that is asked to go on would end before it learned anything.

run folder (last checkpoint, stretches) + until -> *is_reached* -> bool
"""

from __future__ import annotations

from racecraft.errors import RacecraftError
from racecraft.run import CheckpointWarning, RunFolder
from racecraft.run.checkpoint import StoredCheckpoint
from racecraft.run.stretches import recorded_stretches, stretches_as_it_is
from racecraft.scoped_warnings import scoped_warnings
from racecraft.training.parent import is_weights_only
from racecraft.training.progress import EvaluationReport
from racecraft.training.stop import Until, settled


def is_reached(folder: RunFolder, until: Until, *, is_changed: bool) -> bool:
    """Whether a run has come as far as its limits say, so that going on would train nothing.

    Args:
        folder: The run.
        until: The limits.
        is_changed: Whether it is to go on with something changed that its files do not say yet. What was driven before
            a change is no end of what comes after.

    Returns:
        Also False where its files cannot be read: the training itself says what is wrong with them.
    """
    try:
        with scoped_warnings("ignore", CheckpointWarning):
            saved = folder.checkpoints.find("last")
        if is_weights_only(saved):
            return False
        since, state = _since(folder, saved, is_changed=is_changed), saved.metadata["evaluator"]
        last = EvaluationReport.from_dict(state["last"]) if state["last"] is not None else None
        reached = until.reached(
            steps=saved.step,
            seconds=float(saved.metadata["seconds"]),
            last=last if last is not None and last.step > since else None,
            has_settled=last is not None and settled(state["best_score"], last.step, int(state.get("gained_at", 0))),
        )
    except (RacecraftError, KeyError, TypeError, ValueError):
        return False
    return bool(reached)


def _since(folder: RunFolder, saved: StoredCheckpoint, *, is_changed: bool) -> int:
    """The step that the stretch to come begins at, as `racecraft.run.stretches.begin_stretch` will have it."""
    before = [stretch for stretch in recorded_stretches(folder) if stretch.step < saved.step]
    if not before:
        return saved.step if is_changed else 0
    goes_on = not is_changed and before[-1].number in stretches_as_it_is(folder)
    return before[-1].step if goes_on else saved.step
