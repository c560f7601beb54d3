"""An imported run can be trained and evaluated, and nothing foreign runs before that."""

from __future__ import annotations

import json
from pathlib import Path

import models
import pytest

from racecraft import evaluate, resume
from racecraft.errors import ConfigError, RewardError
from racecraft.importing import import_run
from racecraft.race.policy import load_policy
from racecraft.run import RunFolder


@pytest.mark.costly
def test_the_printed_command_trains_and_evaluation_follows_the_rules(tmp_path: Path) -> None:
    env = models.DRFC["run.env"] + "DR_EVAL_NUMBER_OF_TRIALS=1\nDR_EVAL_MAX_RESETS=1\nDR_EVAL_OFF_TRACK_PENALTY=0.5\n"
    files = {name: text for name, text in models.DRFC.items() if "hyperparameters" not in name}
    found = import_run(
        models.as_folder({**files, "run.env": env}, tmp_path / "drfc"), name="mine", network="RACECRAFT_SMALL"
    )
    assert found.next_command == "racecraft train --resume runs/mine"
    result = resume(found.run, until="1 steps")
    assert result.steps > 0
    assert (found.run / "original" / "training-simtrace" / "0-iteration.csv").read_text() == models.simtrace()
    raced = evaluate(found.run, num_trials=1, video=False).evaluation
    assert (raced.rules.laps, raced.rules.max_resets, raced.rules.offtrack_penalty) == (1, 1, 0.5)
    named = evaluate(found.run, rules="droa", laps=1, max_resets=1, num_trials=1, video=False).evaluation
    assert named.rules.offtrack_penalty == 1.0
    (found.run / "race_rules.json").write_text('{"lapps": 3}')
    with pytest.raises(ConfigError, match=r"race_rules\.json: There is no race rule 'lapps'\. Did you mean 'laps'"):
        evaluate(found.run, video=False)


def test_a_model_with_two_lenses_and_a_lidar_is_imported_and_trained(tmp_path: Path) -> None:
    document = {
        **json.loads(models.METADATA),
        "sensor": ["STEREO_CAMERAS", "DISCRETIZED_SECTOR_LIDAR"],
        "lidar_config": {"num_sectors": 16, "num_values_per_sector": 4, "clipping_dist": 3.0},
    }
    files = {**models.MODEL, "model_metadata.json": json.dumps(document)}
    found = import_run(models.as_tar(files, tmp_path / "model.tar.gz"), name="mine", network="RACECRAFT_SMALL")
    assert resume(found.run, until="1 steps").steps > 0
    _, policy = load_policy(RunFolder.open(found.run))
    assert (policy.learner.spec.lenses, policy.learner.spec.lidar_size) == (2, 64)


def test_nothing_foreign_runs_while_importing_and_a_bad_reward_stops_the_training_before_it_begins(
    tmp_path: Path,
) -> None:
    trap = tmp_path / "trap"
    reward = f"open({str(trap)!r}, 'w')\nwhile True: pass\n{models.REWARD}"
    with pytest.raises(RewardError, match="not allowed"):  # the check of the text refuses it
        import_run(models.as_folder({**models.MODEL, "reward_function.py": reward}, tmp_path / "a"))
    hanging = f"raise SystemExit\n{models.REWARD}"
    files = {**models.MODEL, "reward_function.py": hanging, "setup.py": f"open({str(trap)!r}, 'w')"}
    found = import_run(models.as_folder(files, tmp_path / "b"), network="RACECRAFT_SMALL", name="x")
    assert "neither run nor kept" in found.unused[f"setup.py ({len(files['setup.py'])} bytes)"]
    with pytest.raises(RewardError):
        resume(found.run, until="1 steps")
    assert not trap.exists()
    assert not (found.run / "checkpoints").exists()
