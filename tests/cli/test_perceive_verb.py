"""`racecraft perceive`: what it prints and writes, and its wrong options."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import Run
from PIL import Image

from racecraft.perception import Perceiver


def test_a_picture(racecraft: Run) -> None:
    Image.new("RGB", (160, 120), (90, 90, 90)).save("a.png")
    outcome = racecraft("perceive", "a.png", "-o", "seen")
    assert outcome.status == 0, outcome.err
    assert "a.png" in outcome.out
    assert "Painted in seen." in outcome.out
    assert [path.name for path in Path("seen").iterdir()] == ["00000-a.png"]


def test_as_json(racecraft: Run) -> None:
    Image.new("RGB", (160, 120), (90, 90, 90)).save("a.png")
    (one,) = racecraft("perceive", "a.png", "--json").document["pictures"]
    assert one["file"] == "a.png"
    assert len(one["middle"]) == 4
    assert isinstance(one["on_road"], bool)
    assert {"offset_m", "heading_rad", "offset_error_m", "heading_error_rad"} <= one.keys()


@pytest.mark.costly
def test_a_run_by_its_last_evaluation(racecraft: Run, trained: Path) -> None:
    short = ("-l", "1", "--trials", "1", "--max-resets", "0", "--no-video")
    assert racecraft("evaluate", str(trained), *short).status == 0
    outcome = racecraft("perceive", str(trained), "--json")
    assert outcome.status == 0, outcome.err
    pictures = outcome.document["pictures"]
    assert len(pictures) > 5
    assert pictures[0]["on_road"]
    assert pictures[0]["middle"][1] is not None


@pytest.mark.costly
def test_learning(racecraft: Run) -> None:
    learn = ("--train", "w.safetensors", "--updates", "2", "--roads", "1", "--store", "256", "--seed", "3")
    document = racecraft("perceive", *learn, "--json").document
    assert document == {"weights": "w.safetensors", "bytes": Path("w.safetensors").stat().st_size, "updates": 2}
    Image.new("RGB", (160, 120), (90, 90, 90)).save("a.png")
    outcome = racecraft("perceive", "a.png", "--weights", "w.safetensors")
    assert outcome.status == 0, outcome.err
    Perceiver(Path("w.safetensors"), num_threads=1)


@pytest.mark.costly
def test_driving(racecraft: Run) -> None:
    document = racecraft("perceive", "--drive", "oval", "--speed", "1.6", "--randomize", "light", "--json").document
    assert (document["laps"], document["trials"], document["speed"]) == (2, 2, 1.6)
    outcome = racecraft("perceive", "--drive", "oval")
    assert outcome.status == 0, outcome.err
    assert "2 of 2 laps completed" in outcome.out
    assert racecraft("perceive", "a.png", "--drive", "oval").status == 2
    assert "nowhere" in racecraft("perceive", "--drive", "nowhere").err


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["a.png", "--speed", "2"], "--speed goes with --drive."),
        (["a.png", "--seed", "2"], "--seed goes with --drive or --train."),
        (["a.png", "--updates", "2"], "--updates goes with --train."),
        (["--drive", "oval", "--roads", "2"], "--roads goes with --train."),
        (["--train", "w", "--vehicle", "v4"], "--vehicle goes with --drive."),
    ],
)
def test_options_of_what_is_not_done_are_refused(racecraft: Run, arguments: list[str], says: str) -> None:
    Image.new("RGB", (160, 120)).save("a.png")
    outcome = racecraft("perceive", *arguments)
    assert (outcome.status, outcome.out) == (2, "")
    assert says in outcome.err


def test_mistakes(racecraft: Run) -> None:
    outcome = racecraft("perceive", "nowhere")
    assert (outcome.status, outcome.out) == (1, "")
    assert "There is nothing at nowhere." in outcome.err
    assert racecraft("perceive").status == 1
    assert racecraft("perceive", "a.png", "--train", "w").status == 2
    outcome = racecraft("perceive", "--train", "nowhere/w", "--updates", "1", "--roads", "1", "--store", "128")
    assert (outcome.status, outcome.out) == (1, "")
    assert "nowhere/w cannot be written: there is no folder nowhere." in outcome.err
    assert "updates" not in outcome.err
    Path("w").write_text("no weights")
    Image.new("RGB", (160, 120)).save("a.png")
    outcome = racecraft("perceive", "a.png", "--weights", "w")
    assert outcome.status == 1
    assert "cannot be read" in outcome.err
