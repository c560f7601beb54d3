"""The report of real runs: whole, self-contained, and safe against names and code that look like HTML."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from racecraft.agent import ModelMetadata, action_space
from racecraft.analysis import pay_laps, write_report
from racecraft.analysis.svg import Chart, Curve, line_chart, nice_ticks
from racecraft.errors import ConfigError, RewardError, RunError
from racecraft.judging.evaluation import evaluate_run
from racecraft.reward import load_preset
from racecraft.run import RunFolder
from racecraft.track import load_track
from racecraft.track.readers import save_route
from racecraft.training import Until
from racecraft.training.job import Training
from racecraft.training.settings import make_settings
from racecraft.training.start import start_run

REWARD = "def reward_function(params):\n    # <script>alert(1)</script> & more\n    return params['speed']\n"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    metadata = ModelMetadata(action_space=action_space("default"), neural_network="RACECRAFT_SMALL")
    settings = make_settings(metadata=metadata, track="oval", until=Until(steps=3000), seed=1, num_threads=1)
    root = tmp_path_factory.mktemp("runs")
    folder = start_run(settings, reward=REWARD, metadata=metadata, root=root, name="a-run")
    Training(folder).run()
    evaluate_run(folder.path, laps=1, num_trials=2, rules="first_lap", video=False, num_threads=1)
    return folder.path


@pytest.mark.costly
def test_a_report_needs_nothing_else(run: Path) -> None:
    path = write_report(run)
    assert path == run / "report.html"
    text = path.read_text()
    assert "<script" not in text
    assert "&lt;script&gt;" in text
    assert re.search(r"(?:src|href)=", text) is None
    assert "http" not in text.replace("http-equiv", "")
    assert "default-src 'none'" in text
    for heading in ("Learning", "Laps of the last evaluation", "Where it was paid", "Actions", "Settings"):
        assert f"<h2>{heading}</h2>" in text
    assert str(run.parent) not in text
    for picture in re.findall(r"<svg.*?</svg>", text, re.DOTALL):
        ElementTree.fromstring(picture)
        assert "nan" not in picture
    assert len(text) < 2_000_000


def test_nothing_is_drawn_on_a_road_that_was_redrawn_since(run: Path, tmp_path: Path) -> None:
    """A file of the run says what road it was; by its name alone, another lies there now."""
    again = tmp_path / "again"
    shutil.copytree(run, again)
    text = write_report(again).read_text()
    assert "Racing line, coloured by speed" in text
    (summary,) = again.glob("evaluation-*/evaluation.json")
    redrawn = {"track_digest": "0" * 64}
    summary.write_text(json.dumps({**json.loads(summary.read_text()), **redrawn}))
    without = write_report(again).read_text()
    assert "The track was changed since, so neither the line nor the corners are drawn." in without
    assert "Racing line" not in without
    assert "<h2>Where it was paid</h2>" in without
    information = json.loads((again / "run.json").read_text())
    (again / "run.json").write_text(json.dumps({**information, **redrawn}))
    assert "<h2>Where it was paid</h2>" not in write_report(again).read_text()


def test_a_run_whose_track_is_gone_has_a_report_too(run: Path, tmp_path: Path) -> None:
    again = tmp_path / "again"
    shutil.copytree(run, again)
    information = json.loads((again / "run.json").read_text())
    several = {"track": f"oval + {tmp_path}/my road.npy"}
    (again / "run.json").write_text(json.dumps({**information, **several}))
    (summary,) = again.glob("evaluation-*/evaluation.json")
    summary.write_text(json.dumps({**json.loads(summary.read_text()), "track": "my road"}))
    text = write_report(again).read_text()
    assert "oval + my road · " in text  # all of them, and no folder
    assert str(tmp_path) not in text
    assert "The track is not there any more, so neither the line nor the corners are drawn." in text
    for heading in ("Learning", "Laps of the last evaluation", "Actions", "Settings"):
        assert f"<h2>{heading}</h2>" in text


def test_an_evaluation_on_any_of_several_tracks_has_its_line(run: Path, tmp_path: Path) -> None:
    again = tmp_path / "again"
    shutil.copytree(run, again)
    save_route(load_track("oval"), tmp_path / "my road.npy")
    information = json.loads((again / "run.json").read_text())
    (again / "run.json").write_text(json.dumps({**information, "track": f"bowtie + {tmp_path}/my road.npy"}))
    (summary,) = again.glob("evaluation-*/evaluation.json")
    told = {"track": "my road", "track_digest": load_track(tmp_path / "my road.npy").digest}
    summary.write_text(json.dumps({**json.loads(summary.read_text()), **told}))
    assert "Racing line, coloured by speed" in write_report(again).read_text()


@pytest.mark.parametrize("rows", [0, 3])
def test_an_evaluation_without_a_lap_leaves_a_report(run: Path, tmp_path: Path, rows: int) -> None:
    again = tmp_path / "again"
    shutil.copytree(run, again)
    (trace,) = again.glob("evaluation-*/evaluation-simtrace/0-iteration.csv")
    trace.write_text("".join(trace.read_text().splitlines(keepends=True)[: 1 + rows]))
    text = write_report(again).read_text()
    assert "<h2>Learning</h2>" in text
    assert "<h2>Laps of the last evaluation</h2>" not in text


@pytest.mark.costly
def test_a_run_that_was_never_trained_has_a_report_too(run: Path, tmp_path: Path) -> None:
    metadata = RunFolder(run).read_model_metadata()
    settings = make_settings(metadata=metadata, track="oval")
    folder = start_run(settings, reward=REWARD, metadata=metadata, root=tmp_path, name="new")
    text = write_report(folder.path, tmp_path / "deep" / "r.html").read_text()
    assert "Reward function" in text
    assert "<h2>Learning</h2>" not in text


def test_curves_and_rewards_that_no_training_wrote_leave_a_report(run: Path, tmp_path: Path) -> None:
    """An archive brings its own along."""
    again = tmp_path / "again"
    shutil.copytree(run, again)
    points: list[dict[str, object]] = [
        {"kind": "iteration", "step": 1, "seconds": "x", "reward": 1},
        {"kind": "iteration", "step": 1, "seconds": 1e308, "reward": 1},
        *(
            {"kind": "evaluation", "step": 1, "seconds": 2, "completions": c}
            for c in (["a"], {"a": 1}, [[1], [1, 2]], 5)
        ),
        {"kind": "iteration", "step": 1, "seconds": 3, "reward": 1e308, "entropy": -1e308},
        {"kind": "iteration", "step": 1, "seconds": 3, "reward": -1e308, "entropy": 1e308},
        {"kind": "iteration", "step": 2, "seconds": 4, "reward": 2, "completion": 0.5},
    ]
    (again / "metrics" / "history.jsonl").write_text("".join(json.dumps(point) + "\n" for point in points))
    for trace in (again / "training-simtrace").iterdir():
        lines = [line.split(",") for line in trace.read_text().splitlines()]
        for line in lines[1:]:
            line[8] = "1e308"
        trace.write_text("".join(",".join(line) + "\n" for line in lines))
    text = write_report(again).read_text()
    assert "<h2>Learning</h2>" in text
    for picture in re.findall(r"<svg.*?</svg>", text, re.DOTALL):
        assert "nan" not in picture


def test_what_cannot_be_reported_is_told(run: Path, tmp_path: Path) -> None:
    with pytest.raises(RunError, match="There is no run"):
        write_report(tmp_path / "none")
    (tmp_path / "file").write_text("")
    with pytest.raises(RunError, match="cannot be written"):
        write_report(run, tmp_path / "file" / "r.html")
    with pytest.raises(ConfigError, match="path is 5; use a file's path"):
        write_report(run, 5)  # type: ignore[arg-type]


def test_laps_are_paid_anew(run: Path) -> None:
    (trace,) = run.glob("evaluation-*/evaluation-simtrace/0-iteration.csv")
    track = load_track("oval")
    laps = pay_laps("def reward_function(params):\n    return params['x']\n", track, trace)
    assert len(laps) == 2
    for lap in laps:
        assert lap.rewards == pytest.approx(lap.points[:, 0], abs=1e-4)
    with pytest.raises(RewardError):
        pay_laps("def reward_function(params):\n    return 1 / 0\n", track, trace)


@pytest.mark.parametrize("reward", ["lap_time", "touring"])
def test_a_flying_lap_is_paid_like_any_other_at_the_line(tmp_path: Path, reward: str) -> None:
    """Who remembers progress must not lose a lap of it there."""
    track = load_track("oval")
    trace = _three_flying_laps(tmp_path)
    first, second, third = pay_laps(load_preset(reward), track, trace)
    assert abs(first.rewards[0]) < 0.05  # from standing
    for lap in (second, third):
        assert lap.rewards[0] > 0.5 * lap.rewards[1]
        assert lap.rewards[:-1].min() > 0.02  # the last step leads beyond 100 %, which nobody is paid for
    counted = pay_laps("def reward_function(params):\n    return params['steps']\n", track, trace)
    assert counted[1].rewards[:3].tolist() == [3.0, 4.0, 5.0]  # of the lap, not of the trial


def _three_flying_laps(folder: Path) -> Path:
    from racecraft.race.artifacts import write_simtrace
    from racecraft.race.autopilot import Autopilot
    from racecraft.race.evaluation import evaluate
    from racecraft.race.rules import race_rules

    driver = Autopilot(speed=2.0)
    rules = race_rules("drfc", {"laps": 3})
    driven = evaluate(driver, load_track("oval"), rules=rules, num_trials=1, sees="state", num_threads=1)
    write_simtrace(driven, folder, action_space=action_space("continuous"))
    return folder / "0-iteration.csv"


def test_a_single_large_number_is_a_chart_too() -> None:
    text = line_chart(
        Chart(curves=[Curve(label="a", x=np.array([1e11]), y=np.array([1e11]))], x_label="x", y_label="y")
    )
    assert "nan" not in text
    assert "inf" not in text


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [(0, 1, [0, 0.2, 0.4, 0.6, 0.8, 1.0]), (3, 3, [3]), (-10, 90, [0, 20, 40, 60, 80])],
)
def test_ticks_are_round_numbers(low: float, high: float, expected: list[float]) -> None:
    assert nice_ticks(low, high) == pytest.approx(expected)


def test_charts_know_gaps_and_emptiness() -> None:
    x = np.arange(4.0)
    curve = Curve(label="<a>", x=x, y=np.array([1.0, np.nan, 2.0, 3.0]))
    drawn = line_chart(Chart(curves=[curve], x_label="x", y_label="y"))
    (path,) = re.findall(r'class="curve first" d="([^"]*)"', drawn)
    assert path.count("M") == 2
    assert "&lt;a&gt;" in drawn
    nothing = Curve(label="", x=x, y=np.full(4, np.nan))
    assert line_chart(Chart(curves=[nothing], x_label="x", y_label="y")) == ""
