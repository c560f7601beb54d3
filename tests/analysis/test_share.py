"""A lap to send around: one page that needs nothing else, with the very replay inside, and a picture of it."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from racecraft.agent import ModelMetadata, action_space
from racecraft.analysis.share import draw_share, share, write_share
from racecraft.analysis.share_heat import Placed, draw_heat, share_heat
from racecraft.analysis.share_picture import finish_picture
from racecraft.errors import ReplayError, RunError
from racecraft.film.racing_line import draw_racing_line
from racecraft.judging.evaluation import evaluate_run
from racecraft.learn import PPOConfig
from racecraft.replay import Replay, read_replay, verify
from racecraft.replay.in_picture import CHUNK
from racecraft.run import RunFolder
from racecraft.run.atomic import write_json
from racecraft.sim import Randomization
from racecraft.training import Until
from racecraft.training.job import Training
from racecraft.training.settings import make_settings
from racecraft.training.start import start_run

REWARD = "def reward_function(params):\n    # </script><script>alert(1)</script>\n    return params['speed']\n"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    metadata = ModelMetadata(action_space=action_space("default"), neural_network="RACECRAFT_SMALL")
    ppo = PPOConfig(num_envs=8, num_steps=8, minibatch_size=32, update_epochs=1)
    settings = make_settings(metadata=metadata, track="oval", until=Until(steps=64), seed=1, num_threads=1, ppo=ppo)
    root = tmp_path_factory.mktemp("runs")
    folder = start_run(settings, reward=REWARD, metadata=metadata, root=root, name="a-run")
    Training(folder).run()
    evaluate_run(folder.path, laps=1, num_trials=2, rules="drfc", video=False, num_threads=1, max_resets=9)
    return folder


@pytest.fixture(scope="module")
def stamp(run: RunFolder) -> str:
    (found,) = run.path.glob("evaluation-*")
    return found.name.removeprefix("evaluation-")


@pytest.mark.costly
def test_the_page_needs_nothing_else_and_runs_nothing_else(run: RunFolder, stamp: str) -> None:
    text = share(run, stamp)
    assert re.search(r"\ssrc=", text) is None
    assert "http" not in text.replace("http-equiv", "")
    assert str(run.path.parent) not in text
    scripts = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    assert len(scripts) == 1
    digest = base64.b64encode(hashlib.sha256(scripts[0].encode()).digest()).decode()
    assert f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'\"" in text
    assert "&lt;script&gt;alert(1)" in text
    assert "<script>alert" not in text


def test_the_lap_and_its_replay_are_inside(run: RunFolder, stamp: str, tmp_path: Path) -> None:
    text = share(run, stamp, language="de")
    replay = run.evaluation(stamp) / "evaluation.replay"
    (data,) = re.findall(r'download="a-run\.replay" href="data:application/octet-stream;base64,([^"]+)"', text)
    (tmp_path / "sent.replay").write_bytes(base64.b64decode(data))
    assert (tmp_path / "sent.replay").read_bytes() == replay.read_bytes()
    assert verify(read_replay(tmp_path / "sent.replay")).is_genuine

    (document,) = re.findall(r'<script type="application/json" id="lap">(.*?)</script>', text, re.DOTALL)
    lap = json.loads(document)
    laps = [(time, car) for car in read_replay(replay).cars for time in car.recording.lap_times.values()]
    recording = min(laps, key=lambda one: one[0])[1].recording
    (car,) = lap["cars"]
    np.testing.assert_allclose(np.column_stack([car["x"], car["y"]]), recording.origins, atol=1e-3)
    edges = np.array(lap["inner"]) - np.array(lap["outer"])
    np.testing.assert_allclose(np.hypot(*edges.T), recording.track.mean_width, rtol=0.1)
    assert "<dt>Rundenzeit</dt>" in text
    assert f"<dd>{min(laps, key=lambda one: one[0])[0]:.3f} s</dd>".replace(".", ",") in text
    assert "<dt>Medaille</dt>" not in text  # nine resets win none


def test_a_medal_is_told(run: RunFolder, stamp: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from racecraft.limits import TrackLimit

    drawn: list[list[tuple[str, str]]] = []
    monkeypatch.setattr("racecraft.analysis.share.draw_line", lambda *_, figures, **__: drawn.append(figures))
    monkeypatch.setattr("racecraft.analysis.share.finish_picture", lambda path, *_, **__: path)
    draw_share(run, stamp, tmp_path / "plain.png")
    monkeypatch.setattr("racecraft.analysis.share.known_limit", lambda *_: TrackLimit(ideal=900.0, driven=1000.0))
    draw_share(run, stamp, tmp_path / "won.png", language="de")
    assert [
        [figure for figure in figures if figure[0][:5] == "MEDAI" or figure[0] == "MEDAL"] for figures in drawn
    ] == [[], [("MEDAILLE", "Autor")]]
    assert "<dt>Medal</dt><dd>Author</dd>" in share(run, stamp)

    def of_another_car(*given: Any, **settings: Any) -> Replay:
        replay = read_replay(*given, **settings)
        return replace(replay, conditions=replace(replay.conditions, randomize=Randomization(friction=(1.0, 1.2))))

    monkeypatch.setattr("racecraft.analysis.share.read_replay", of_another_car)
    assert "<dt>Medal</dt>" not in share(run, stamp)


@pytest.mark.costly
def test_speeds_have_the_decimals_of_the_language(run: RunFolder, stamp: str, tmp_path: Path) -> None:
    for language, point, line in (("en", ".", "Racing line"), ("de", ",", "Ideallinie")):
        text = share(run, stamp, language=language)
        assert re.search(
            rf'<figcaption class="bar">\d{re.escape(point)}\d m/s <span>.*</span> \d{re.escape(point)}\d m/s', text
        )
        assert f'aria-label="{line}"' in text
    drive = read_replay(run.evaluation(stamp) / "evaluation.replay").cars[0].recording
    dots, commas = (
        np.asarray(Image.open(draw_racing_line(drive, tmp_path / f"{name}.png", point=point)).convert("L"), np.int16)
        for name, point in (("dots", "."), ("commas", ","))
    )
    rows, columns = np.nonzero(dots - commas)
    assert len(rows) > 0
    assert rows.max() < 0.1 * dots.shape[1]  # below the colours, in the upper right corner
    assert columns.min() > 0.7 * dots.shape[1]


@pytest.mark.costly
def test_a_picture_has_the_reward_and_the_replay_inside(run: RunFolder, stamp: str, tmp_path: Path) -> None:
    path = draw_share(run, stamp, tmp_path / "sent.png")
    plain = draw_racing_line(
        read_replay(run.evaluation(stamp) / "evaluation.replay").cars[0].recording, tmp_path / "p.png"
    )
    with Image.open(path) as picture, Image.open(plain) as line:
        assert picture.info["Description"] == REWARD
        assert picture.width == line.width
        below = np.asarray(picture.convert("L"))[line.height :]
    assert below.shape[0] > 100
    assert (below < 100).sum() > 1000  # letters
    assert verify(read_replay(path)).is_genuine
    assert read_replay(path).num_steps == read_replay(run.evaluation(stamp) / "evaluation.replay").num_steps

    with pytest.raises(ReplayError, match="is a picture without a replay inside"):
        read_replay(plain)
    content = path.read_bytes()
    cut = tmp_path / "cut.png"
    cut.write_bytes(content[: content.index(CHUNK) + 40])
    with pytest.raises(ReplayError, match="without a replay inside"):
        read_replay(cut)


@pytest.mark.costly
def test_a_long_line_and_a_long_function_end_on_the_paper(tmp_path: Path) -> None:
    heights = []
    for lines in (10, 60, 61, 5000):
        path = tmp_path / f"{lines}.png"
        Image.new("RGB", (800, 40)).save(path)
        finish_picture(path, "Reward", "\n".join(["    " + "x\t" * 2000] * lines), replay=b"")
        with Image.open(path) as picture:
            heights.append(picture.height)
            assert (np.asarray(picture.convert("L"))[40:, -20:] > 200).all()
    assert heights[0] < heights[1] < heights[2] == heights[3]


def test_what_cannot_be_shared_is_told(run: RunFolder, stamp: str, tmp_path: Path) -> None:
    for wrong in ("20200101000000", "..", "x"):
        with pytest.raises(RunError, match="has no evaluation"):
            share(run, wrong)
    (tmp_path / "file").write_text("")
    with pytest.raises(RunError, match="cannot be written"):
        write_share(run.path, tmp_path / "file" / "s.html")
    assert write_share(run.path).read_text() == share(run, stamp)
    (run.path / "share.html").unlink()
    later = run.path / "evaluation-29991231235959"  # of a race too long for a replay file
    later.mkdir()
    write_json(later / "evaluation.json", {"track": "oval"})
    assert write_share(run.path, tmp_path / "s.html").read_text() == share(run, stamp)
    (later / "evaluation.json").unlink()
    later.rmdir()
    (tmp_path / "new").mkdir()
    write_json(tmp_path / "new" / "run.json", json.loads((run.path / "run.json").read_text()))
    with pytest.raises(RunError, match="no evaluation to share"):
        write_share(tmp_path / "new")


def test_a_heat_whose_file_lacks_a_car_is_told_in_a_sentence(run: RunFolder, stamp: str, tmp_path: Path) -> None:
    file = run.path / f"evaluation-{stamp}" / "evaluation.replay"
    count = len(read_replay(file).cars)
    rows = [
        Placed(car=car, name=f"car {car}", place=car + 1, score=None, best_lap=None, gap=None) for car in (0, count)
    ]
    assert "car 0" in share_heat(file, rows[:1], title="A heat")
    with pytest.raises(ReplayError, match="does not have all cars of the heat"):
        share_heat(file, rows, title="A heat")
    with pytest.raises(ReplayError, match="does not have all cars of the heat"):
        draw_heat(file, rows, tmp_path / "heat.png", title="A heat")
    assert not (tmp_path / "heat.png").exists()
