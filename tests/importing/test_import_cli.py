"""`racecraft import`, as a user types it."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import models
import pytest

from racecraft import cli, train
from racecraft.run import RunFolder


def racecraft(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, *arguments: str) -> tuple[int, str]:
    monkeypatch.setattr(sys, "argv", ["racecraft", *arguments])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    printed = capsys.readouterr()
    assert isinstance(ended.value.code, int)
    return ended.value.code, printed.out


def test_it_says_what_it_did_and_how_to_go_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    env = models.DRFC["run.env"] + "DR_WORLD_NAM=x\nDR_LOCAL_S3_PRETRAINED=True\n"
    folder = models.as_folder({**models.DRFC, "run.env": env}, tmp_path / "drfc")
    status, out = racecraft(capsys, monkeypatch, "import", str(folder), "--name", "mine", "--track", "kidney")
    assert status == 0
    for words in (
        "deepracer-for-cloud folder, folder drfc, to drive on kidney",
        "DR_WORLD_NAME=oval  --track was given",
        "DR_WORKERS  cars drive side by side",
        "DR_WORLD_NAM  unknown, has no effect. Did you mean 'DR_WORLD_NAME'?",
        "2 metrics, sim-traces and logs",
        "model/model_1.pb  weights of the policy",
        "its critic begins anew",
        "racecraft train --resume runs/mine",
    ):
        assert words in out, words
    status, out = racecraft(capsys, monkeypatch, "import", str(folder), "--runs", "other", "--json")
    document = json.loads(out)
    assert status == 0
    assert Path(document["run"]).parent == Path("other")
    assert RunFolder.open(document["run"]).name in document["next"]
    assert document["unknown"] == {"DR_WORLD_NAM": "Did you mean 'DR_WORLD_NAME'?"}
    assert any("its critic begins anew" in note for note in document["notes"])


def test_a_run_of_racecraft_keeps_its_files_where_they_were(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    ours = train("oval", until="64 steps", name="ours", num_threads=1).run
    _, out = racecraft(capsys, monkeypatch, "import", str(ours), "--name", "again")
    assert "metrics, sim-traces and logs  where they were in it" in out
    assert "was left out" not in out  # ip/hyperparameters.json, which is for AWS's tools
    _, out = racecraft(capsys, monkeypatch, "import", str(ours), "--json")
    document = json.loads(out)
    assert document["kept_in"] == ""
    for name in document["kept"]:
        assert (Path(document["run"]) / name).read_bytes() == (ours / name).read_bytes()
    folder = models.as_folder(models.DRFC, tmp_path / "drfc")
    _, out = racecraft(capsys, monkeypatch, "import", str(folder), "--json")
    document = json.loads(out)
    kept = [Path(document["run"]) / document["kept_in"] / name for name in document["kept"]]
    assert len(kept) == 2
    assert all(path.is_file() for path in kept)


def test_a_refusal_is_one_json_object(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "model.tar.gz").write_bytes(b"\x1f\x8bnonsense")
    status, out = racecraft(capsys, monkeypatch, "import", "model.tar.gz", "--json")
    assert status == 1
    assert json.loads(out)["error"]["code"] == "ArchiveError"
    assert not Path("runs").exists()


def test_what_a_stranger_calls_things_drives_no_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    params = 'WORLD_NAME: oval\n"X\\e]0;title\\a": 1\n'
    folder = models.as_folder({**models.MODEL, "training_params.yaml": params}, tmp_path / "m")
    status, out = racecraft(capsys, monkeypatch, "import", str(folder))
    assert status == 0
    assert "X�]0;title" in out
    assert "\x1b]" not in out
