from __future__ import annotations

import json
import os
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecraft import evaluate, train
from racecraft.errors import CheckpointError, ConfigError, RacecraftError, RunError
from racecraft.film.replay_film import film_replay
from racecraft.judging import evaluation
from racecraft.learn import PPOConfig
from racecraft.replay.header import header_of
from racecraft.run import RunFolder
from racecraft.sim import CameraSpec, Vehicle
from racecraft.sim.camera import CAMERAS
from racecraft.track import generate_track
from racecraft.training import SilentReporter


def trained(root: Path, **settings: Any) -> Path:
    ppo = PPOConfig(num_envs=8, num_steps=8, minibatch_size=32, update_epochs=1)
    small = {"ppo": ppo, "until": "64 steps", "evaluate_every": 64, "evaluation_trials": 1, "num_threads": 1}
    return train(settings.pop("track", "oval"), **{**small, **settings}, root=root).run


QUICK = {"laps": 1, "num_trials": 2, "max_resets": 1, "video": False, "num_threads": 1}


@pytest.mark.costly
def test_it_evaluates_as_it_was_trained(tmp_path: Path) -> None:
    run = trained(tmp_path, direction="reverse", vehicle=Vehicle(mass=5.0))
    found = evaluate(run, **QUICK)
    assert found.evaluation.rules.direction == "reverse"
    assert found.evaluation.track.name == "oval"
    assert found.step == 64
    assert evaluate(run, **QUICK, direction="forward").evaluation.rules.direction == "forward"
    best = [evaluate(run, **QUICK, vehicle=vehicle).to_dict()["mean_completion"] for vehicle in (None, "v4")]
    assert best[0] == found.to_dict()["mean_completion"]


@pytest.mark.costly
def test_a_run_learns_and_is_evaluated_and_filmed_with_its_camera(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Seen(SilentReporter):
        def begin(self, simulation: Any, policy: Any) -> None:
            cameras.append(simulation.camera)

    cameras: list[CameraSpec] = []
    run = trained(tmp_path, camera="2026", reporter=Seen())
    assert cameras == [CAMERAS["2026"]]
    palettes: list[str] = []
    for module in ("judging.evaluation", "film.replay_film"):
        monkeypatch.setattr(f"racecraft.{module}.film", lambda *_, camera, **__: palettes.append(camera.palette) or run)
    found = evaluate(run, **{**QUICK, "video": True})
    film_replay(found.files["replay"])
    assert (found.evaluation.conditions.camera, palettes) == (CAMERAS["2026"], ["2026", "2026"])
    document = json.loads((run / "run.json").read_text())
    assert document["settings"].pop("camera") == "2026"
    (run / "run.json").write_text(json.dumps(document))  # as runs of earlier versions are
    assert evaluate(run, **QUICK).evaluation.conditions.camera == CameraSpec()
    document["settings"]["camera"] = "2031"
    (run / "run.json").write_text(json.dumps(document))
    with pytest.raises(RunError, match=r"'2031' in run\.json is none of this version"):
        evaluate(run, **QUICK)


@pytest.mark.costly
def test_a_seed_repeats_an_evaluation_and_each_has_a_folder_of_its_own(tmp_path: Path) -> None:
    run = trained(tmp_path)
    first, again = evaluate(run, **QUICK, seed=3), evaluate(run, **QUICK, seed=3)
    assert first.evaluation.summary() == again.evaluation.summary()
    assert len({*first.files.values(), *again.files.values()}) == 10
    assert len(list(run.glob("evaluation-*"))) == 2
    traces = [found.files["sim-trace"].read_text() for found in (first, again)]
    assert traces[0] == traces[1]
    expected = {**first.evaluation.summary(), "step": first.step, "video": None, "driven": first.to_dict()["driven"]}
    expected |= {"vehicle": "v5", "track_digest": first.evaluation.track.digest}
    expected |= {"conditions": json.loads(json.dumps(header_of(first.evaluation.conditions)))}
    assert json.loads(first.files["summary"].read_text()) == expected


@pytest.mark.costly
def test_an_evaluation_in_a_car_of_ones_own_says_so(tmp_path: Path) -> None:
    run = trained(tmp_path, vehicle=Vehicle(front_friction=1.9))
    found = evaluate(run, **{**QUICK, "max_resets": 100})
    for document in (found.to_dict(), json.loads(found.files["summary"].read_text())):
        assert document["driven"]["own"] == ["vehicle"]
        assert "front_friction 1.9 instead of 0.32" in document["driven"]["sentence"]
    sentence = evaluate(run, **QUICK, vehicle="v5").to_dict()["driven"]["sentence"]
    assert sentence.endswith("(max_resets 1 instead of 100, otherwise drfc) with the standard car v5 on oval")


@pytest.mark.costly
def test_a_car_that_randomisation_makes_another_has_no_limit_and_no_medal(tmp_path: Path) -> None:
    run = trained(tmp_path, track="reinvent_2018")
    assert evaluate(run, **QUICK).to_dict()["limit"] is not None
    assert evaluate(run, **QUICK, randomize="aws").to_dict()["limit"] is not None  # another light
    assert evaluate(run, **QUICK, randomize="light").to_dict()["limit"] is None


@pytest.mark.costly
def test_a_track_that_changed_since_must_be_named(tmp_path: Path) -> None:
    def save(seed: int) -> None:
        track = generate_track(seed)
        np.save(tmp_path / "mine.npy", np.hstack([track.centerline, track.inner, track.outer]))

    save(1)
    run = trained(tmp_path, track=str(tmp_path / "mine.npy"))
    save(2)
    with pytest.raises(ConfigError, match="changed"):
        evaluate(run, **QUICK)
    assert evaluate(run, **QUICK, track=str(tmp_path / "mine.npy")).evaluation.track.digest == generate_track(2).digest


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is read-only for root")
def test_a_run_that_cannot_be_written_to_is_an_error_of_ours(tmp_path: Path) -> None:
    run = trained(tmp_path)
    run.chmod(0o500)
    try:
        with pytest.raises(RunError, match="cannot be written"):
            evaluate(run, **QUICK)
    finally:
        run.chmod(0o700)


@pytest.mark.costly
def test_a_folder_with_a_file_in_the_way_is_an_error_of_ours(tmp_path: Path) -> None:
    run = trained(tmp_path)
    (run / "mp4").write_text("in the way")
    with pytest.raises(RunError, match="cannot be written"):
        evaluate(run, **{**QUICK, "video": True})


@pytest.mark.costly
def test_two_evaluations_at_once_have_a_film_each_and_one_without_still_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run, filming = trained(tmp_path), threading.Barrier(2, timeout=60.0)
    film_it = evaluation.film

    def together(*arguments: Any, **settings: Any) -> Path:
        filming.wait()
        return film_it(*arguments, **settings)

    monkeypatch.setattr(evaluation, "film", together)
    with ThreadPoolExecutor(2) as pool:
        found = [one.result() for one in [pool.submit(evaluate, run, **{**QUICK, "video": True}) for _ in range(2)]]
    assert sorted(one.files["video"].name for one in found) == ["0-video.mp4", "1-video.mp4"]
    assert all(one.files["video"].stat().st_size > 1000 for one in found)

    def full(*_: Any, **__: Any) -> Path:
        raise RunError("No space left on device.")

    monkeypatch.setattr(evaluation, "film", full)
    with pytest.raises(RunError, match="No space left"):
        evaluate(run, **{**QUICK, "video": True})
    summaries = [json.loads(path.read_text()) for path in sorted(run.glob("evaluation-*/evaluation.json"))]
    assert [summary["video"] is None for summary in summaries] == [False, False, True]
    assert sorted(path.name for path in (run / "mp4/camera-pip").iterdir()) == ["0-video.mp4", "1-video.mp4"]


def test_a_checkpoint_that_does_not_describe_its_network_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = trained(tmp_path)
    store = RunFolder.open(run).checkpoints
    saved = store.load("last")
    for network in (None, {}, {"name": "RACECRAFT_SMALL"}, {**saved.metadata["network"], "name": "NONE"}):
        store.save(128, saved.arrays, metadata={"network": network}, score=(2.0,))
        with pytest.raises(RacecraftError) as caught:
            evaluate(run, **QUICK)
        assert isinstance(caught.value, CheckpointError | ConfigError)


@pytest.mark.costly
def test_a_run_without_a_checkpoint_says_so(tmp_path: Path) -> None:
    run = trained(tmp_path)
    for path in (run / "checkpoints").iterdir():
        path.unlink()
    with pytest.raises(CheckpointError, match="no checkpoint"):
        evaluate(run, **QUICK)
