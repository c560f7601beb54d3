"""Searches for better numbers of a model: folders beside the models; `racecraft.serve.tuning.tasks` fills them.

runs/.racecraft/tunings/<id>/   what `racecraft tune` makes, too; a trial is a run folder
"""

from __future__ import annotations

import re
import secrets
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from racecraft.errors import ConfigError, RacecraftError, RunError
from racecraft.json_file import read_json_object
from racecraft.run import RunFolder, RunInfo
from racecraft.run.folder import sanitize_name
from racecraft.run.history import read_history
from racecraft.serve.jobs.cargo import rivals_of
from racecraft.serve.jobs.queue import ENDED, JobQueue
from racecraft.serve.live.cars import NAME as LIVE
from racecraft.serve.models.garage import Garage
from racecraft.serve.models.mirror import Mirror
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.settings import TUNINGS
from racecraft.serve.store.tables import Job
from racecraft.serve.tuning.schemas import KeepTrial, NewTuning, TunableNumber, TuningCard, TuningTrial
from racecraft.training.start import read_settings

if TYPE_CHECKING:
    from racecraft.tuning import Parameter

_ID: Final = re.compile(r"[0-9a-f]{16}")
_WHERE: Final = re.compile(r"^.*/(?=model_metadata\.json: )")
"""Where a file of the model lies, which is nobody's business."""


class Tunings:
    """The searches of a console.

    Args:
        state: The console's own folder.
        queue: Of jobs.
        garage: Of models.
        mirror: Has the object store hold what a search needs.
        see: Is given each search's job before somebody hears of it.
    """

    def __init__(
        self, state: Path, queue: JobQueue, garage: Garage, *, mirror: Mirror, see: Callable[[Job], Job]
    ) -> None:
        self._see = see
        self._folder, self._queue, self._garage, self._mirror = state / TUNINGS, queue, garage, mirror

    def space(self, name: str) -> list[TunableNumber]:
        """Everything that may be searched of a model.

        Raises:
            RacecraftError: The model cannot be read.
        """
        from racecraft.tuning import HYPERPARAMETERS, find_constants, plan_of, space_of

        plan = plan_of(self._garage.folder(name))
        usual = {parameter.name for parameter in space_of(plan)}
        constants = [name for name, value in find_constants(plan.reward).items() if value != 0]
        is_ppo = plan.settings.algorithm == "ppo"
        names = [*constants, *(name for name in HYPERPARAMETERS if is_ppo and name not in constants)]
        return [_tunable(parameter, usual) for parameter in space_of(plan, names)]

    def start(self, name: str, request: NewTuning) -> Job:
        """Make a search and queue its job.

        Raises:
            RacecraftError: It makes no sense, or Optuna is not installed.
        """
        from racecraft.tuning import make_tuning, plan_of

        search = [f"{number.name}={number.low!r}..{number.high!r}" for number in request.search or ()]
        if request.search == []:
            raise ConfigError("search is empty; name at least one number, or leave it out.")
        tuning = secrets.token_hex(8)
        plan = plan_of(self._garage.folder(name))
        folder = make_tuning(
            plan,
            search=search,
            goal=request.goal,
            trial_steps=request.trial_steps,
            root=self._folder,
            name=tuning,
        )
        payload = {"tuning": tuning, "minutes": request.minutes, "trials": request.trials}
        rivals, cargo = rivals_of(plan.settings.to_dict(), self._garage.runs), None
        if rivals is not None:
            runs = (RunFolder(self._garage.runs / rival) for rival in rivals)
            cargo = self._mirror.share(*runs, tracks=(plan.settings.track,), filled=folder)
        return self._queue.add("tune", name, payload, cargo=cargo)

    def cards(self, name: str) -> list[TuningCard]:
        """A model's searches, newest first."""
        folder = self._garage.folder(name)
        cards = (self._card(self._see(job)) for job in self._queue.list(run=folder.name, kind="tune"))
        return [card for card in cards if card is not None]

    def keep(self, name: str, tuning: str, request: KeepTrial) -> str:
        """Make a model of a trial, trained as far as it was; its name.

        Raises:
            NotFound: There is no such trial, or it has no policy.
            Conflict: There is a model of that name, or the trial is none of this search.
        """
        card, _ = self._find(name, tuning)
        number = card.best if request.trial is None else request.trial
        if number is None or not any(trial.number == number and trial.can_be_kept for trial in card.trials):
            raise NotFound(f"The search has no trial {'yet' if number is None else number} that can be kept.")
        fresh = request.name
        if fresh is None:
            stem = sanitize_name(f"{name[:50]}-tuned")
            taken = {path.name for path in self._garage.runs.iterdir()}
            fresh = next(one for one in (stem, *(f"{stem}-{n}" for n in range(2, 10_000))) if one not in taken)
        self._garage.require_new(fresh)
        source = self._folder / tuning / f"trial-{number:04d}"
        info = self._honest(tuning, number)
        copy = self._folder / f"{tuning}-{secrets.token_hex(4)}"
        try:
            shutil.copytree(source, copy, ignore=shutil.ignore_patterns(".lock", f"{LIVE}*"))
            kept = RunFolder(copy)
            kept.write_info(info)
            # one stretch says what the other files say, and of these a search makes none
            shutil.rmtree(kept.stretches, ignore_errors=True)
            for file in (kept.hyperparameters, kept.race_rules):
                file.unlink(missing_ok=True)
            copy.rename(self._garage.runs / fresh)
        except OSError as error:
            shutil.rmtree(copy, ignore_errors=True)
            raise RunError(
                f"The trial cannot be copied: {error.strerror or error}.", hint="Free disk space."
            ) from error
        return fresh

    def _honest(self, tuning: str, number: int) -> RunInfo:
        """The ``run.json`` of a model that is made of a trial, which may come from another machine.

        Raises:
            Conflict: The trial is not what the search would have made with its numbers.
        """
        from racecraft.tuning import Tuning

        run = RunFolder(self._folder / tuning / f"trial-{number:04d}")
        try:
            search = Tuning(self._folder / tuning, parents=self._garage.runs)
            trials = read_json_object(search.folder / "result.json")["trials"]
            plan = search.plan_of_trial(next(trial["params"] for trial in trials if trial["number"] == number))
            info, parent = run.read_info(), None if plan.parent is None else plan.parent.record()
            made = (read_settings(run), run.read_reward_function(), run.read_model_metadata(), info.parent)
            is_honest = made == (plan.settings, plan.reward, plan.metadata, parent)
        except (RacecraftError, KeyError, TypeError, ValueError, AttributeError) as error:
            raise Conflict("The trial's files cannot be read.", hint="Keep another one.") from error
        if not is_honest:
            raise Conflict("The trial is not what the search asked for.", hint="Keep another one.")
        return replace(info, foreign=plan.foreign or self._garage.is_foreign(plan.reward))

    def remove(self, name: str, tuning: str) -> None:
        """Remove a search with its trials.

        Raises:
            Conflict: It is under way.
        """
        card, folder = self._find(name, tuning)
        if card.state not in ENDED:
            raise Conflict("The search is under way.", hint="Stop it first.")
        shutil.rmtree(folder, ignore_errors=True)

    def _find(self, name: str, tuning: str) -> tuple[TuningCard, Path]:
        for card in self.cards(name):
            if card.id == tuning:
                return card, self._folder / tuning
        raise NotFound(f"Model {name!r} has no search {tuning[:40]!r}.")

    def _card(self, job: Job) -> TuningCard | None:
        """What is known of a search; None where its folder is gone."""
        tuning = str(job.payload.get("tuning", ""))
        folder = self._folder / tuning
        try:
            document = read_json_object(folder / "tuning.json") if _ID.fullmatch(tuning) else None
        except ConfigError:
            document = None
        if document is None:
            return None
        try:
            found = read_json_object(folder / "result.json")
        except ConfigError:  # no trial has ended yet
            found = {"trials": [], "importances": {}, "best": None}
        return TuningCard(
            id=tuning,
            job=job.id,
            state=job.state,  # type: ignore[arg-type]
            created=job.created,
            started=job.started,
            finished=job.finished,
            goal=document["goal"],
            minutes=job.payload["minutes"],
            trials_wanted=job.payload["trials"],
            trial_steps=document["trial_steps"],
            space=[TunableNumber(**parameter, is_usual=False) for parameter in document["space"]],
            trials=[_trial(folder, trial) for trial in found["trials"]],
            best=found["best"]["number"] if found["best"] else None,
            importances=found["importances"],
            notes=[_WHERE.sub("", str(note)) for note in document.get("notes", ())],  # older ones have none
            error=str((job.error or {}).get("message", "")),
        )


def _tunable(parameter: Parameter, usual: set[str]) -> TunableNumber:
    return TunableNumber(**parameter.to_dict(), is_usual=parameter.name in usual)


def _trial(folder: Path, trial: dict[str, Any]) -> TuningTrial:
    run = RunFolder(folder / f"trial-{trial['number']:04d}")
    evaluations = []
    if trial["state"] == "running":
        evaluations = [point for point in read_history(run.history)[0] if point.get("kind") == "evaluation"]
    best = max((sum(point["completions"]) / len(point["completions"]) for point in evaluations), default=None)
    return TuningTrial(
        number=trial["number"],
        state=trial["state"],
        value=trial["value"],
        params=trial["params"],
        completion=trial["completion"] if best is None else best,
        best_lap=trial["best_lap_seconds"],
        steps=trial["steps"],
        error=trial["error"],
        can_be_kept=(run.path / "run.json").is_file() and run.checkpoints.last is not None,
    )
