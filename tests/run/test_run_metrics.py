import json
from pathlib import Path

import pytest

from racecraft.errors import RunError
from racecraft.run import Episode, TrainingMetrics, Trial, read_metrics, write_evaluation_metrics
from racecraft.run.metrics import STATUS_LABELS
from racecraft.sim.columns import STATUS_NAMES

LOGS = Path(__file__).parents[3] / "shared" / "logs"


def episode(number, status="off_track", progress=0.2965734, reward=31.405, start=27.746, end=31.538):
    return Episode(number, 0, 50, reward, progress, status, start, end - start)


def test_first_episode_of_a_real_file(tmp_path):
    path = LOGS / "drfc" / "TrainingMetrics.json"
    if not path.exists():
        pytest.skip("shared/logs is not there")
    metrics = TrainingMetrics(tmp_path / "TrainingMetrics.json")
    metrics.add(episode(0))
    metrics.write()
    text, real = (tmp_path / "TrainingMetrics.json").read_text(), path.read_text()
    assert text[: text.index("}") + 1] == real[: real.index("}") + 1]
    assert text[text.rindex("}]") :] == real[real.rindex("}]") :]


def test_whole_real_files_are_reproduced(tmp_path):
    files = [LOGS / "drfc" / "TrainingMetrics.json", LOGS / "droa" / "training-metrics.json"]
    if not files[0].exists():
        pytest.skip("shared/logs is not there")
    names = {label: name for name, label in STATUS_LABELS.items()}
    for path in files:
        metrics = TrainingMetrics(tmp_path / path.name, interval_s=1e9)
        for line in read_metrics(path)["metrics"]:
            start, end = line["start_time"] / 1000, line["metric_time"] / 1000
            status, share = names[line["episode_status"]], line["completion_percentage"] / 100
            metrics.add(
                episode(line["episode"] - 1, status, share, line["reward_score"], start, end),
                phase=line["phase"],
            )
        metrics.write()
        assert json.loads(metrics.path.read_text()) == json.loads(path.read_text())


def test_numbers_are_rounded_as_aws_does(tmp_path):
    metrics = TrainingMetrics(tmp_path / "m.json", interval_s=0)
    for progress in (0.29657, 0.999999, 1.0, 1.0 - 1e-16, -0.001, 0.57):
        metrics.add(episode(0, progress=progress, reward=8.504))
    metrics.write()
    lines = read_metrics(metrics.path)["metrics"]
    assert [line["completion_percentage"] for line in lines] == [29, 99, 100, 100, 0, 57]
    assert lines[0]["reward_score"] == 9


def test_evaluation_carries_the_number_of_the_training_episode_before(tmp_path):
    metrics = TrainingMetrics(tmp_path / "m.json", interval_s=0)
    for number in range(40):
        metrics.add(episode(number))
    metrics.add(episode(0, status="lap_complete", progress=1.0), phase="evaluation")
    metrics.write()
    lines = read_metrics(metrics.path)["metrics"]
    assert (lines[20]["episode"], lines[20]["trial"]) == (21, 1)
    assert (lines[40]["episode"], lines[40]["trial"], lines[40]["phase"]) == (40, 20, "evaluation")
    assert lines[40]["episode_status"] == "Lap complete"


def test_resumed_run_continues_the_file_from_its_checkpoint(tmp_path):
    first = TrainingMetrics(tmp_path / "m.json", interval_s=0)
    for number in range(10):
        first.add(episode(number))
    first.write()
    second = TrainingMetrics(tmp_path / "m.json", episodes=6, interval_s=0)
    second.add(episode(6, status="crashed"))
    second.write()
    lines = read_metrics(second.path)["metrics"]
    assert [line["episode"] for line in lines] == [1, 2, 3, 4, 5, 6, 7]
    assert lines[-1]["episode_status"] == "Crashed"


def test_a_resumed_run_keeps_no_lines_that_no_training_wrote(tmp_path):
    """An archive's file may be an evaluation's, or anybody's."""
    first = TrainingMetrics(tmp_path / "m.json", interval_s=0)
    first.add(episode(0))
    first.write()
    document = read_metrics(first.path)
    (line,) = document["metrics"]
    for name in ("episode", "metric_time", "phase"):
        document["metrics"].append({key: value for key, value in line.items() if key != name})
        document["metrics"].append({**line, name: "1"})
        document["metrics"].append({**line, name: [1]})
    first.path.write_text(json.dumps(document))
    second = TrainingMetrics(first.path, episodes=6, clock=100.0, interval_s=0)
    second.write()
    assert read_metrics(second.path)["metrics"] == [line]


def test_very_long_runs_are_thinned_evenly(tmp_path, monkeypatch):
    monkeypatch.setattr("racecraft.run.metrics.MAX_EPISODES", 100)
    metrics = TrainingMetrics(tmp_path / "m.json", interval_s=1e9)
    for number in range(1000):
        metrics.add(episode(number))
        if number % 100 == 99:
            metrics.add(episode(0), phase="evaluation")
    metrics.write()
    lines = read_metrics(metrics.path)["metrics"]
    training = [line["episode"] for line in lines if line["phase"] == "training"]
    assert 40 < len(training) <= 100
    assert training == list(range(1, training[-1] + 1, training[1] - training[0]))
    assert training[-1] > 950
    assert len(lines) - len(training) == 10


def test_writing_is_rare(tmp_path):
    metrics = TrainingMetrics(tmp_path / "m.json", interval_s=1000)
    metrics.add(episode(0))
    metrics.add(episode(1))
    assert len(read_metrics(metrics.path)["metrics"]) == 1
    metrics.write()
    assert len(read_metrics(metrics.path)["metrics"]) == 2


def test_a_file_that_takes_long_to_write_is_written_the_more_rarely(tmp_path, monkeypatch):
    """Half a second of writing is a hundredth of the time until it is written again."""
    clock = [1000.0]

    def write(path, data, *, durable):
        clock[0] += 0.5
        path.write_bytes(data)

    monkeypatch.setattr("racecraft.run.metrics.write_file", write)
    monkeypatch.setattr("racecraft.run.metrics.time.monotonic", lambda: clock[0])
    metrics = TrainingMetrics(tmp_path / "m.json", interval_s=1.0)
    seen = []
    for number, later in enumerate((0.0, 49.0, 2.0)):
        clock[0] += later
        metrics.add(episode(number))
        seen.append(len(read_metrics(metrics.path)["metrics"]))
    assert seen == [1, 1, 3]


def test_every_status_has_a_label():
    assert tuple(STATUS_LABELS) == STATUS_NAMES


def test_evaluation_file_is_that_of_aws(tmp_path):
    files = list(LOGS.glob("drfc/EvaluationMetrics-*.json"))
    if not files:
        pytest.skip("shared/logs is not there")
    trials = [Trial(**line) for line in read_metrics(files[0])["metrics"]]
    write_evaluation_metrics(tmp_path / "metrics" / "e.json", trials)
    assert (tmp_path / "metrics" / "e.json").read_text() == files[0].read_text()


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"metrics": 3}', '{"metrics": [3]}', '{"metrics": [{}]}'])
def test_damaged_files(tmp_path, text):
    (tmp_path / "m.json").write_text(text)
    with pytest.raises(RunError):
        read_metrics(tmp_path / "m.json")


def test_unwritable(tmp_path):
    (tmp_path / "metrics").write_text("")
    with pytest.raises(RunError, match="cannot be written"):
        TrainingMetrics(tmp_path / "metrics" / "m.json").add(episode(0))
