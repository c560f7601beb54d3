"""A run that begins from another: what it takes over, what begins anew, what is refused."""

from __future__ import annotations

import json
import os
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tiny_runs import Recorder, Train, assert_same, logs, weights

from racecraft.agent import ModelMetadata, action_space
from racecraft.errors import CheckpointError, ConfigError, RunError
from racecraft.learn import DistillConfig, NetworkSpec, initial_weights, make_learner
from racecraft.race.evaluation import Completion
from racecraft.run import RunFolder
from racecraft.run.history import read_history
from racecraft.training import EvaluationReport, evaluator, resume
from racecraft.training.parent import begin_from, fitting, open_parent
from racecraft.training.plan import make_plan
from racecraft.training.start import read_settings

IDLE: dict[str, Any] = {"until": "64 steps", "evaluate_every": 64}


@pytest.fixture
def parent(tiny: Train) -> Path:
    return tiny(name="parent", until="128 steps", evaluate_every=64, seed=5).run


def test_a_child_begins_with_the_weights_and_settings_of_its_parent(tiny: Train, parent: Path, tmp_path: Path) -> None:
    plan = make_plan(parent=parent, until="64 steps")
    theirs = read_settings(RunFolder.open(parent))
    assert (plan.settings.track, plan.settings.ppo, plan.settings.evaluation_trials) == ("oval", theirs.ppo, 2)
    assert plan.reward == RunFolder.open(parent).read_reward_function()

    child = plan.start(root=tmp_path / "children", name="child")
    best = RunFolder.open(parent).checkpoints.load("best")
    assert child.read_info().parent == {"run": str(parent), "step": best.step, "file": best.path.name}
    copied = child.parent_checkpoint.load().arrays
    given = {name: array for name, array in best.arrays.items() if name.startswith("weights/")}
    assert copied.keys() == given.keys()
    for name, array in given.items():
        np.testing.assert_array_equal(copied[name], array, err_msg=name)


@pytest.mark.skipif(sys.platform != "linux", reason="names are text elsewhere")
def test_a_child_of_a_run_whose_folder_is_no_text_can_be_opened(tiny: Train, parent: Path, tmp_path: Path) -> None:
    odd = tmp_path / os.fsdecode(b"odd\xff")
    shutil.copytree(parent, odd)
    child = make_plan(parent=odd, until="64 steps").start(root=tmp_path, name="child")
    said = RunFolder.open(child.path).read_info().parent
    assert said is not None
    assert said["run"] == f"{tmp_path}/odd\ufffd"


def test_it_learns_on_from_them_and_not_from_random_ones(tiny: Train, parent: Path) -> None:
    """One step of Adam moves no weight by more than a few learning rates; two random networks are far apart."""
    child = tiny(parent=f"{parent}@last", reward="racing", **IDLE).run
    before, after = weights(parent), weights(child)
    name = "weights/policy.conv2.weight"
    fresh = initial_weights(NetworkSpec(num_actions=10), seed=0)["policy.conv2.weight"]
    moved = np.abs(after[name] - before[name]).max()
    assert 0 < moved < 0.02 < np.abs(fresh - before[name]).max()


@pytest.mark.costly
def test_it_needs_its_parent_no_longer(tiny: Train, parent: Path, tmp_path: Path) -> None:
    undisturbed = tiny(parent=parent, name="undisturbed", **IDLE).run
    plan = make_plan("oval", parent=parent, until="64 steps", evaluate_every=64, num_threads=1)
    child = plan.start(root=tmp_path / "runs", name="orphan")
    shutil.rmtree(parent)
    resume(child.path)  # a kill before the first checkpoint leaves this folder
    assert weights(child.path).keys() == weights(undisturbed).keys()
    later = tmp_path / "runs" / "again"
    shutil.copytree(child.path, later)
    resume(later, until="128 steps")
    resume(child.path, until="128 steps")
    assert_same(later, child.path)


def judged_steps(run: Path) -> list[int]:
    return [point["step"] for point in read_history(RunFolder.open(run).history)[0] if point["kind"] == "evaluation"]


def test_what_it_begins_with_is_judged_first_and_stays_the_best_where_all_that_comes_of_it_is_worse(
    tiny: Train, parent: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shares = iter([0.9, 0.5, 0.3])

    def drive(*arguments: Any, **settings: Any) -> Completion:
        share, none = next(shares), np.full(2, np.nan)
        return Completion(
            completions=np.full(2, share), lap_times=none, rewards=np.zeros(2), statuses=("off_track",) * 2
        )

    monkeypatch.setattr(evaluator, "completion", drive)
    recorder = Recorder()
    child = tiny(parent=f"{parent}@last", until="128 steps", evaluate_every=64, reporter=recorder).run
    assert [(report.step, report.is_best) for report in recorder.evaluations] == [(0, True), (64, False), (128, False)]
    assert judged_steps(child) == [0, 64, 128]
    store = RunFolder.open(child).checkpoints
    assert [(entry.step, entry.score) for entry in store.entries()] == [
        (0, (0.9, -1e6)),
        (64, (0.5, -1e6)),
        (128, (0.3, -1e6)),
    ]
    best, theirs = store.load("best"), weights(parent)
    assert (best.step, best.metrics["completion"]) == (0, 0.9)
    for name, array in best.arrays.items():
        np.testing.assert_array_equal(array, theirs[name], err_msg=name)


@pytest.mark.costly
@pytest.mark.parametrize("algorithm", ["ppo", "distill"])
def test_killed_before_its_first_update_it_resumes_as_if_it_never_was(
    tiny: Train, parent: Path, tmp_path: Path, algorithm: str
) -> None:
    killed = tmp_path / "killed"

    class Killing(Recorder):
        def evaluation(self, report: EvaluationReport) -> None:
            super().evaluation(report)
            if report.step == 64:
                shutil.copytree(tmp_path / "runs" / "child", killed)

    settings: dict[str, Any] = {"parent": parent, "evaluate_every": 64, "until": "192 steps"}
    if algorithm == "distill":
        short = DistillConfig(num_envs=8, num_steps=8, teacher_steps=128, minibatch_size=32)
        settings |= {"algorithm": "distill", "distill": short}
    child = tiny(name="child", reporter=Killing(), **settings).run
    assert [entry.step for entry in RunFolder.open(killed).checkpoints.entries()] == [0]
    resume(killed)
    assert judged_steps(killed) == judged_steps(child) == [0, 64, 128, 192]
    assert_same(killed, child)
    assert logs(killed) == logs(child)


def test_one_that_begins_from_nothing_is_not_judged_before_it_learned(parent: Path) -> None:
    assert judged_steps(parent) == [64, 128]
    assert [entry.step for entry in RunFolder.open(parent).checkpoints.entries()] == [64, 128]


def test_another_action_space_gives_the_policy_a_new_last_layer_and_says_so(tiny: Train, parent: Path) -> None:
    recorder = Recorder()
    child = tiny(parent=parent, actions="continuous", reporter=recorder, **IDLE).run
    assert any("the policy's last layer begins anew" in note for note in recorder.notes)
    assert weights(child)["weights/policy.head.weight"].shape == (2, 128)

    faster = Recorder()
    tiny(parent=parent, actions="aws", reporter=faster, **IDLE)  # ten actions as well: only the speeds are others
    assert not any("anew" in note for note in faster.notes)
    assert any("Begins with the weights of" in note for note in faster.notes)


def test_another_critic_begins_anew(tiny: Train, parent: Path) -> None:
    recorder = Recorder()
    tiny(parent=parent, critic="camera", reporter=recorder, **IDLE)
    assert "The critic sees something else: it begins anew." in recorder.notes


def test_only_what_fits_is_taken() -> None:
    ten, five = NetworkSpec(num_actions=10, state_size=8), NetworkSpec(num_actions=5, state_size=9)
    kept = fitting(initial_weights(ten, seed=1), five)
    assert "policy.dense1.weight" in kept
    assert not any(name.startswith(("policy.head", "critic.")) for name in kept)
    with pytest.raises(ConfigError, match=r"do not fit the network RACECRAFT_SMALL: policy\.conv1"):
        fitting({}, ten)


def test_another_network_or_other_sensors_are_refused(parent: Path, tmp_path: Path) -> None:
    name = "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW"
    with pytest.raises(ConfigError, match=f"has the network RACECRAFT_SMALL, the new run is to have {name}") as caught:
        make_plan(parent=parent, network=name).start(root=tmp_path)
    assert "--network RACECRAFT_SMALL" in caught.value.hint

    document = RunFolder.open(parent).read_model_metadata().to_dict()
    file = tmp_path / "model_metadata.json"
    file.write_text(json.dumps({**document, "sensor": ["LEFT_CAMERA"]}))
    plan = make_plan(parent=parent)
    seen = ModelMetadata.load(file)
    assert plan.parent is not None
    with pytest.raises(ConfigError, match="sees with FRONT_FACING_CAMERA, the new run is to see with LEFT_CAMERA"):
        plan.parent.check(plan.settings.network_spec(seen), seen)


@pytest.mark.parametrize(
    ("text", "error", "match"),
    [
        ("nowhere", RunError, "There is no run"),
        ("{parent}@first", ConfigError, "'first' of .* is none; allowed are best, last"),
        ("{parent}@77", CheckpointError, "no checkpoint of step 77"),
        ("{parent}@", ConfigError, "''"),
        ("{parent}@²", ConfigError, "²"),
    ],
)
def test_what_is_no_checkpoint_is_refused(parent: Path, text: str, error: type[Exception], match: str) -> None:
    with pytest.raises(error, match=match):
        open_parent(text.format(parent=parent))


@pytest.mark.parametrize("name", ["policy.conv2.weight", "critic.dense1.bias"])
def test_a_weight_that_is_no_number_begins_nothing(parent: Path, tmp_path: Path, name: str) -> None:
    broken = tmp_path / "broken"
    shutil.copytree(parent, broken)
    store = RunFolder.open(broken).checkpoints
    saved = store.load("last")
    saved.arrays[f"weights/{name}"].flat[1] = np.inf
    store.save(saved.step + 1, saved.arrays, metadata=saved.metadata)
    with pytest.raises(CheckpointError, match=rf"has weights that are NaN or infinite: {name}\.$"):
        make_plan(parent=f"{broken}@last").start(root=tmp_path / "children")
    assert not (tmp_path / "children").exists()
    child = make_plan(parent=parent, until="64 steps").start(root=tmp_path / "children")
    copied = child.parent_checkpoint.load()
    copied.arrays[f"weights/{name}"].flat[1] = np.nan
    with pytest.raises(CheckpointError, match=rf"has weights that are NaN or infinite: {name}\.$"):
        begin_from(make_learner(read_settings(child).network_spec(child.read_model_metadata())), copied)
    for head in ("policy.head.bias", "policy.head.weight"):  # other actions have a head of their own
        saved.arrays[f"weights/{head}"].flat[0] = np.nan
    saved.arrays[f"weights/{name}"].flat[1] = 0.0
    store.save(saved.step + 2, saved.arrays, metadata=saved.metadata)
    make_plan(parent=f"{broken}@last", actions="continuous").start(root=tmp_path / "children")


def test_a_damaged_copy_of_the_weights_is_refused(parent: Path, tmp_path: Path) -> None:
    child = make_plan(parent=parent, until="64 steps").start(root=tmp_path / "children")
    file = next((child.path / "parent").glob("*.safetensors"))
    file.write_bytes(file.read_bytes()[:-9])
    with pytest.raises(CheckpointError, match=r"bytes instead of"):
        resume(child.path)


def test_an_aws_run_is_followed_by_one_as_aws_trains(tiny: Train, tmp_path: Path) -> None:
    from racecraft.agent import Hyperparameters

    file = tmp_path / "hyperparameters.json"
    Hyperparameters(num_episodes_between_training=2, num_epochs=3).save(file)
    first = tiny(hyperparameters=file, until="8 steps", evaluate_every=8).run
    plan = make_plan(parent=first, actions=action_space("fast"))
    assert plan.hyperparameters == Hyperparameters.load(file)
    assert (plan.settings.ppo.episodes_per_iteration, plan.settings.ppo.num_envs) == (2, 2)
    assert plan.metadata.action_space.size == 21
