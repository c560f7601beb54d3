"""A trial becomes a model only as the search asked for it: another machine may have made it, and may lie."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("optuna")
from racecraft.learn import PPOConfig
from racecraft.run import RunFolder, begin_stretch
from racecraft.serve.jobs.queue import JobQueue
from racecraft.serve.models.garage import Garage
from racecraft.serve.people.people import add_person
from racecraft.serve.problems import Conflict
from racecraft.serve.settings import OWNER, STATE_FOLDER, TUNINGS
from racecraft.serve.store.database import Database
from racecraft.serve.tuning.schemas import KeepTrial
from racecraft.serve.tuning.tunings import Tunings
from racecraft.tuning import Tuning, start_tuning

TUNING = "0123456789abcdef"
OTHER = "def reward_function(params):\n    return 2.0\n"
NUMBERS = {"BORDER_LOSS": 0.25, "learning_rate": 0.001, "update_epochs": 2}


class Bench:
    """A search of somebody's, with a trial in it."""

    def __init__(self, database: Database, root: Path, user: int) -> None:
        runs, state = root / str(user), root / str(user) / STATE_FOLDER
        self.garage = Garage(runs, state, database, user_id=user)
        queue, mirror = JobQueue(database, user_id=user), None
        search = ["BORDER_LOSS", "learning_rate", "update_epochs"]
        self.folder = start_tuning(
            "oval", reward="racing", search=search, root=state / TUNINGS, name=TUNING, ppo=PPOConfig(num_envs=8)
        )
        tuning = Tuning(self.folder)
        shutil.copytree(tuning.plan.start(root=root / "spare", name=f"of-{user}").path, runs / "model")
        self.trial = tuning.plan_of_trial(NUMBERS).start(root=self.folder, name="trial-0000")
        begin_stretch(self.trial, step=0)
        self.trial.checkpoints.save(64, {}, metadata={})
        told = {"number": 0, "state": "complete", "value": 1.0, "params": NUMBERS, "completion": 1.0, "steps": 64}
        told |= {"best_lap_seconds": None, "seconds": 1.0, "error": "", "run": str(self.trial.path)}
        result = {"trials": [told], "importances": {}, "best": told}
        (self.folder / "result.json").write_text(json.dumps(result))
        queue.add("tune", "model", {"tuning": TUNING, "minutes": 1, "trials": 1})
        self.tunings = Tunings(state, queue, self.garage, mirror=mirror, see=lambda job: job)  # type: ignore[arg-type]

    def keep(self, name: str) -> RunFolder:
        return self.garage.folder(self.tunings.keep("model", TUNING, KeepTrial(trial=0, name=name)))

    def rewrite(self, **changes: Any) -> None:
        file = self.trial.path / "run.json"
        file.write_text(json.dumps(json.loads(file.read_text()) | changes))


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    database = Database(f"sqlite:///{tmp_path / 'console.db'}")
    database.migrate()
    yield database
    database.close()


@pytest.mark.costly
def test_whose_reward_a_kept_trial_has_follows_from_whose_search_it_was(database: Database, tmp_path: Path) -> None:
    with database.transaction() as session:
        guest = add_person(session, "Ada")
    for user, is_foreign in ((OWNER, False), (guest, True)):
        bench = Bench(database, tmp_path, user)
        bench.rewrite(foreign=not is_foreign)
        (bench.trial.path / "stretches" / "1.json").write_text(json.dumps({"reward_function": OTHER}))
        (bench.trial.path / "race_rules.json").write_text("{}")
        kept = bench.keep("kept")
        assert kept.read_info().foreign is is_foreign
        assert kept.read_reward_function() == bench.trial.read_reward_function()
        assert "BORDER_LOSS = 0.25" in kept.read_reward_function()
        assert kept.checkpoints.last is not None
        assert not kept.stretches.exists()
        assert not kept.race_rules.exists()
        assert kept.read_aws_hyperparameters()["lr"] == 0.001


@pytest.mark.costly
def test_a_trial_that_the_search_did_not_ask_for_is_not_kept(database: Database, tmp_path: Path) -> None:
    bench = Bench(database, tmp_path, OWNER)
    settings = json.loads((bench.trial.path / "run.json").read_text())["settings"]
    metadata = json.loads(bench.trial.model_metadata.read_text())
    rival = {"drivers": [str(tmp_path / "another" / "run")], "cars": 2}
    lies: list[Callable[[], Any]] = [
        lambda: bench.trial.reward_function.write_text(OTHER),
        lambda: bench.rewrite(settings=settings | {"direction": "reverse"}),
        lambda: bench.rewrite(settings=settings | {"opponents": rival}),
        lambda: bench.rewrite(track=str(tmp_path / "another" / "track.npy")),
        lambda: bench.rewrite(parent={"run": str(tmp_path / "another" / "run"), "step": 1, "file": "x"}),
        lambda: bench.rewrite(settings=settings | {"ppo": settings["ppo"] | {"learning_rate": 0.5}}),
        lambda: bench.trial.model_metadata.write_text(json.dumps(metadata | {"sensor": ["LEFT_CAMERA"]})),
        lambda: bench.trial.reward_function.unlink(),
        lambda: bench.rewrite(settings=[]),
    ]
    safe = tmp_path / "safe"
    shutil.copytree(bench.trial.path, safe)
    for lie in lies:
        lie()
        with pytest.raises(Conflict, match=r"not what the search asked for|cannot be read"):
            bench.keep("kept")
        shutil.rmtree(bench.trial.path)
        shutil.copytree(safe, bench.trial.path)
    result = json.loads((bench.folder / "result.json").read_text())
    for numbers in ({"gamma": 0.5}, {"BORDER_LOSS": 0.5}, {"learning_rate": 7.5}):
        result["trials"][0]["params"] = NUMBERS | numbers
        (bench.folder / "result.json").write_text(json.dumps(result))
        with pytest.raises(Conflict):
            bench.keep("kept")
    assert not (bench.garage.runs / "kept").exists()
