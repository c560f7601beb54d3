"""What a run learned with stays in its folder when something is changed; every step knows its stretch."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from tiny_runs import Recorder, Train

from racecraft.analysis import write_report
from racecraft.errors import ConfigError, RewardError, RunError
from racecraft.importing import import_run
from racecraft.reward import load_preset
from racecraft.run import RunFolder, archive_chunks, change_reward, read_stretches, stretch_at
from racecraft.training import Until, resume, train
from racecraft.training.job import Training

OTHER = "def reward_function(params):\n    return params['speed']\n"
THIRD = "def reward_function(params):\n    return params['progress']\n"


@pytest.mark.costly
def test_a_changed_reward_begins_a_stretch_and_the_old_one_stays(tiny: Train) -> None:
    run = tiny().run
    folder = RunFolder.open(run)
    (first,) = read_stretches(folder)
    assert (first.number, first.step, first.reward_function) == (1, 0, load_preset("centerline"))
    folder.reward_function.write_text(OTHER)  # as a user of the command line does
    recorder = Recorder()
    resume(run, until="768 steps", reporter=recorder)
    assert "From here on with other reward." in recorder.notes
    first, second = read_stretches(folder)
    assert first.reward_function == load_preset("centerline")
    assert (second.number, second.step, second.reward_function) == (2, 512, OTHER)
    assert second.changes(first) == ["reward"]
    assert [stretch_at([first, second], step).number for step in (0, 1, 512, 513, 768)] == [1, 1, 1, 2, 2]
    resume(run, until="896 steps")
    assert read_stretches(folder) == [first, second]


@pytest.mark.costly
def test_actions_hyperparameters_and_vehicle_belong_to_a_stretch(tiny: Train) -> None:
    folder = RunFolder.open(tiny().run)
    document = json.loads((folder.path / "run.json").read_text())
    document["settings"]["vehicle"]["mass"] *= 1.1
    document["settings"]["ppo"]["learning_rate"] *= 0.5
    document["settings"]["until"], document["settings"]["num_threads"] = "9 laps", 2
    (folder.path / "run.json").write_text(json.dumps(document))
    metadata = json.loads(folder.model_metadata.read_text())
    metadata["action_space"][0]["speed"] *= 0.9
    folder.model_metadata.write_text(json.dumps(metadata))
    resume(folder.path, until="576 steps")
    first, second = read_stretches(folder)
    assert second.changes(first) == ["actions", "hyperparameters", "vehicle"]
    assert first.model_metadata != second.model_metadata == metadata


def test_another_network_is_refused_before_a_stretch_begins(tiny: Train) -> None:
    folder = RunFolder.open(tiny().run)
    before = folder.model_metadata.read_text()
    fewer, stereo = json.loads(before), {**json.loads(before), "sensor": ["STEREO_CAMERAS"]}
    fewer["action_space"] = fewer["action_space"][:6]
    for document, says in ((fewer, "num_actions 10, and its files now ask for 6"), (stereo, "lenses 1, and")):
        folder.model_metadata.write_text(json.dumps(document))
        recorder = Recorder()
        with pytest.raises(ConfigError, match=says) as caught:
            resume(folder.path, until="576 steps", reporter=recorder)
        assert "racecraft train --from" in caught.value.hint
        assert recorder.notes == []
        assert len(read_stretches(folder)) == 1
    folder.model_metadata.write_text(before)
    assert resume(folder.path, until="576 steps").steps == 576


@pytest.mark.costly
def test_a_stretch_that_trained_nothing_is_forgotten(tiny: Train) -> None:
    folder = RunFolder.open(tiny().run)
    for reward in (OTHER, THIRD):
        folder.reward_function.write_text(reward)
        Training(folder, until=Until(steps=512)).run()
    assert [stretch.reward_function for stretch in read_stretches(folder)[1:]] == [THIRD]
    folder.reward_function.write_text(load_preset("centerline"))
    resume(folder.path, until="576 steps")
    assert len(read_stretches(folder)) == 1


@pytest.mark.costly
def test_what_was_driven_before_a_change_does_not_end_what_comes_after(tmp_path: Path) -> None:
    result = train("oval", reward="racing", until="1 laps or 60000 steps", seed=1, num_threads=1, root=tmp_path)
    assert result.reason == "laps"
    assert resume(result.run).steps == result.steps  # nothing was changed, so the limit holds
    change_reward(RunFolder(result.run), OTHER)
    again = resume(result.run, until=f"1 laps or {result.steps + 64} steps")
    assert again.steps > result.steps


@pytest.mark.costly
def test_a_reward_is_given_beside_resume(tiny: Train, tmp_path: Path) -> None:
    run = tiny().run
    (tmp_path / "other.py").write_text(OTHER)
    resume(run, until="576 steps", reward=tmp_path / "other.py")
    assert [stretch.reward_function for stretch in read_stretches(RunFolder(run))][1:] == [OTHER]
    (tmp_path / "broken.py").write_text("def reward_function(params):\n    return params['sped']\n")
    with pytest.raises(RewardError):
        resume(run, reward=tmp_path / "broken.py")
    assert RunFolder(run).read_reward_function() == OTHER


@pytest.mark.costly
def test_a_run_of_an_earlier_version_has_one_stretch_and_keeps_it(tiny: Train) -> None:
    folder = RunFolder.open(tiny().run)
    shutil.rmtree(folder.stretches)
    (first,) = read_stretches(folder)
    assert (first.step, first.reward_function) == (0, load_preset("centerline"))
    change_reward(folder, OTHER)
    resume(folder.path, until="576 steps")
    assert [(one.step, one.reward_function) for one in read_stretches(folder)] == [
        (0, load_preset("centerline")),
        (512, OTHER),
    ]


@pytest.mark.costly
def test_stretches_travel_in_an_archive_and_damaged_ones_are_told(tiny: Train, tmp_path: Path) -> None:
    folder = RunFolder.open(tiny().run)
    change_reward(folder, OTHER)
    resume(folder.path, until="576 steps")
    (tmp_path / "kept.tar.gz").write_bytes(b"".join(archive_chunks(folder)))
    there = RunFolder(import_run(tmp_path / "kept.tar.gz", root=tmp_path / "there").run)
    assert read_stretches(there) == read_stretches(folder)
    whole = json.loads((folder.stretches / "2.json").read_text())
    (folder.stretches / "2.json").write_text(json.dumps({**whole, "began": "yesterday"}))
    with pytest.raises(RunError, match=r"2\.json cannot be read: Invalid isoformat"):
        read_stretches(folder)
    (folder.stretches / "2.json").write_text('{"format": 1, "number": 2}')
    with pytest.raises(RunError, match=r"2\.json cannot be read"):
        read_stretches(folder)
    (tmp_path / "damaged.tar.gz").write_bytes(b"".join(archive_chunks(folder)))
    report = import_run(tmp_path / "damaged.tar.gz", root=tmp_path / "damaged")
    assert any("is not known" in note for note in report.notes)
    assert len(read_stretches(RunFolder(report.run))) == 1


@pytest.mark.costly
def test_the_report_says_which_reward_drove_what(tiny: Train) -> None:
    folder = RunFolder.open(tiny().run)
    assert "<h2>Stretches</h2>" not in write_report(folder.path).read_text()
    change_reward(folder, OTHER)
    resume(folder.path, until="768 steps")
    text = write_report(folder.path).read_text()
    assert text.index("Reward function of stretch 2") < text.index("Reward function of stretch 1")
    assert text.count("<title>Stretch 2</title>") > 0
    (table,) = (part for part in text.split("<section") if "<h2>Stretches</h2>" in part)
    assert "<td>512</td><td>reward</td>" in table
