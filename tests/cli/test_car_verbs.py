"""`racecraft export`, `racecraft car` and `racecraft evaluate --as`: what they print, and their wrong options."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import Run

from racecraft.car.calibration import load_calibration


def test_export(racecraft: Run, trained: Path) -> None:
    outcome = racecraft("export", str(trained), "--to", "car", "--output", "floor.tar.gz")
    assert outcome.status == 0, outcome.err
    assert "note: Only relative speed counts on a car: 1 m/s, 50 %" in outcome.out
    assert "Written: floor.tar.gz  RACECRAFT_SMALL, step" in outcome.out
    assert Path("floor.tar.gz").read_bytes().startswith(b"\x1f\x8b")


def test_export_as_json(racecraft: Run, trained: Path) -> None:
    document = racecraft("export", str(trained), "-o", "floor.tar.gz", "--json").document
    assert document["file"] == "floor.tar.gz"
    assert document["size"] == Path("floor.tar.gz").stat().st_size
    assert document["run"] == str(trained)
    assert len(document["notes"]) == 1


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--to", "cra"], "Did you mean 'car'?"),
        (["--checkpoint", "77"], "77"),
        (["-o", "floor.zip"], "end in .tar.gz"),
        (["-o", "the.floor.tar.gz"], "cuts names"),
    ],
)
def test_a_wrong_option_writes_nothing(racecraft: Run, trained: Path, arguments: list[str], says: str) -> None:
    before = set(trained.rglob("*"))
    outcome = racecraft("export", str(trained), *arguments)
    assert outcome.status == 1, outcome.err
    assert says in outcome.err
    assert set(trained.rglob("*")) == before
    assert not list(Path().iterdir())


def test_an_exported_checkpoint_may_be_named_as_for_races(racecraft: Run, trained: Path) -> None:
    document = racecraft("export", f"{trained}@64", "-o", "floor.tar.gz", "--json").document
    assert (document["run"], document["step"]) == (str(trained), 64)
    outcome = racecraft("export", f"{trained}@64", "--checkpoint", "best")
    assert outcome.status == 2
    assert "names a checkpoint, and so does --checkpoint best" in " ".join(outcome.err.split())


@pytest.mark.costly
def test_a_car_is_measured_and_driven(racecraft: Run, trained: Path) -> None:
    measured = ["--circle-left", "0.8", "--servo", "1.7,1.45,1.25", "--speed", "60=1.9", "--speed", "30=0.7"]
    outcome = racecraft("car", "calibrate", *measured, "-o", "mine.json")
    assert outcome.status == 0, outcome.err
    assert "Full lock: 22.294° to the left, 24° to the right." in outcome.out
    assert "0.7 m/s at 30 %, 1.9 m/s at 60 %; slider where it suits." in outcome.out
    assert "racecraft evaluate RUN --as mine.json" in outcome.out
    driving = ["--as", "mine.json", "--laps", "1", "--trials", "1", "--max-resets", "0", "--no-video", "--json"]
    document = racecraft("evaluate", str(trained), *driving).document
    assert document["as_car"]["right_degrees"] == 24.0
    assert document["as_car"]["slider_driven_percent"] == pytest.approx(63.2)
    assert Path(document["files"]["as a car"]).read_bytes().startswith(b"\x89PNG")
    assert "as_car" not in racecraft("evaluate", str(trained), *driving[2:]).document


def test_a_car_is_written_into_a_folder_that_is_not_there_yet(racecraft: Run, tmp_path: Path) -> None:
    file = tmp_path / "our cars" / "2026" / "rot.json"
    assert racecraft("car", "calibrate", "--slider", "50", "-o", str(file)).status == 0
    assert load_calibration(file).slider_percent == 50.0


def test_of_a_car_that_is_too_fast_it_is_said_what_the_simulator_drives(racecraft: Run) -> None:
    told = [racecraft("car", "calibrate", "--speed", speed).out for speed in ("60=4.1", "60=4.0")]
    assert ["The simulator drives 4 m/s at most" in text for text in told] == [True, False]


@pytest.mark.parametrize(
    ("arguments", "status", "says"),
    [
        (["car", "calibrate"], 1, "Nothing was measured"),
        (["car", "calibrate", "--speed", "fast"], 2, "expected 2 numbers with '=' between them"),
        (["car", "calibrate", "--speed", "30=fast"], 2, "--speed is '30=fast'"),
        (["car", "calibrate", "--servo", "1.2,1.7"], 2, "expected 3 numbers with ',' between them"),
        (["car", "calibrate", "--servo", "nan,nan,nan"], 1, "servo is nan"),
        (["car", "calibrate", "--circle-left", "0.1"], 1, "A circle of 0.1 m to the left"),
        (["car", "calibrate", "--slider", "50", "-o", "/dev/null/car.json"], 1, "cannot be written"),
        (["evaluate", "RUN", "--as", "crr"], 1, "Did you mean 'car'?"),
        (["evaluate", "RUN", "--as", "car", "--tracks", "oval"], 2, "--as does not go with --tracks"),
        (["evaluate", "RUN", "--as", "car", "--checkpoint", "77"], 1, "77"),
    ],
)
def test_a_wrong_number_of_a_car_writes_nothing(
    racecraft: Run, trained: Path, arguments: list[str], status: int, says: str
) -> None:
    before = set(trained.rglob("*"))
    outcome = racecraft(*(str(trained) if word == "RUN" else word for word in arguments))
    assert outcome.status == status, outcome.err
    assert says in " ".join(outcome.err.replace("│", " ").split())
    assert set(trained.rglob("*")) == before
    assert not list(Path().iterdir())
