"""`racecraft learn` as it is typed: the object at the end, the curve, films, going on, mistakes."""

from __future__ import annotations

from io import StringIO
from pathlib import Path

import av
import pytest
from command_line import Run
from rich.console import Console

from racecraft.classic import RECIPES, Progress
from racecraft.cli.learn_text import CurveReporter

SHORT = ("learn", "CliffWalking-v1", "--algorithm", "sarsa", "--seed", "1", "--until", "12000 steps", "--name", "a")


@pytest.mark.costly
def test_it_ends_with_one_object(racecraft: Run, tmp_path: Path) -> None:
    outcome = racecraft(*SHORT, "--json")
    assert (outcome.status, outcome.err) == (0, "")
    document = outcome.document
    assert document["run"] == "runs/a"
    assert (document["steps"], document["reason"], document["seed"]) == (12_000, "steps", 1)
    assert 0.0 < document["learning_seconds"] <= document["wall_seconds"]
    assert document["mean_return"] <= -13.0
    assert (tmp_path / "runs" / "a" / "policy.safetensors").exists()
    again = racecraft(*SHORT[:-1], "b", "--json").document
    assert {**again, "run": 0, "wall_seconds": 0, "learning_seconds": 0} == {
        **document, "run": 0, "wall_seconds": 0, "learning_seconds": 0
    }  # fmt: skip
    other = racecraft(*SHORT[:-1], "c", "--json", "--set", "epsilon=0.5", "--set", "gamma=0.5").document
    assert other["training_return"] != document["training_return"]


@pytest.mark.costly
def test_for_people_it_prints_lines_and_where_the_run_is(racecraft: Run) -> None:
    outcome = racecraft(*SHORT)
    assert outcome.status == 0
    assert "All steps are done after" in outcome.out
    assert "runs/a" in outcome.out
    assert "10,000 steps  return" in outcome.err
    assert outcome.err.count("\n") == 2


@pytest.mark.costly
def test_it_films_what_was_learned(racecraft: Run, tmp_path: Path) -> None:
    short = ("--until", "640 steps", "--make", "max_episode_steps=60")
    outcome = racecraft("learn", "Racecraft-v0", *short, "--name", "a", "--watch", "--json")
    film = Path(outcome.document["film"])
    assert film == Path("runs/a/film.mp4")
    with av.open(str(tmp_path / film)) as container:
        stream = container.streams.video[0]
        assert (stream.width, stream.height) == (640, 480)
        assert stream.frames > 5


@pytest.mark.costly
def test_a_saved_run_is_watched_and_goes_on(racecraft: Run, tmp_path: Path) -> None:
    racecraft(*SHORT)
    outcome = racecraft("learn", "--resume", "runs/a", "--watch", "--json", "--until", "14000 steps")
    assert outcome.status == 0
    assert outcome.document["steps"] == 14_000
    with av.open(str(tmp_path / "runs" / "a" / "film.mp4")) as container:
        assert 10 < container.streams.video[0].frames < 500


@pytest.mark.costly
def test_who_only_watches_a_saved_run_leaves_it_as_it_is(racecraft: Run, tmp_path: Path) -> None:
    racecraft(*SHORT[:-3], "-15 return", "--name", "a")  # done long before its steps are
    files = {name: (tmp_path / "runs" / "a" / name).read_bytes() for name in ("learned.json", "policy.safetensors")}
    outcome = racecraft("learn", "--resume", "runs/a", "--watch", "--json")
    assert outcome.document == {"run": "runs/a", "film": "runs/a/film.mp4"}
    assert (tmp_path / "runs" / "a" / "film.mp4").stat().st_size > 1000
    assert files == {name: (tmp_path / "runs" / "a" / name).read_bytes() for name in files}
    assert "Film:       runs/a/film.mp4" in racecraft("learn", "--resume", "runs/a", "--watch").out


def test_without_an_environment_it_lists_what_is_tuned(racecraft: Run) -> None:
    outcome = racecraft("learn")
    assert all(environment in outcome.out and algorithm in outcome.out for environment, algorithm in RECIPES)
    pairs = [(pair["environment"], pair["algorithm"]) for pair in racecraft("learn", "--json").document["tuned"]]
    assert pairs == list(RECIPES)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("CartPole-v7", "--algorithm", "dqn"), "There is no environment 'CartPole-v7'"),
        (("CartPole-v1", "--algorithm", "dqm"), "algorithm is 'dqm'"),
        (("Taxi-v3",), "none is tuned for 'Taxi-v3'"),
        (("Pendulum-v1", "--algorithm", "dqn"), "sac are made for them"),
        (("CartPole-v1", "--algorithm", "dqn", "--set", "gamma"), "write it like NAME=VALUE"),
        (("CartPole-v1", "--algorithm", "dqn", "--set", "gamma=2"), "gamma is 2.0"),
        (("CartPole-v1", "--algorithm", "dqn", "--set", "gamma=1", "--set", "gamma=0"), "gives gamma twice"),
        (("CartPole-v1", "--algorithm", "dqn", "--set", "cuts=[]"), "There is no setting 'cuts'"),
        (("CartPole-v1", "--algorithm", "dqn", "--make", "wheels=4"), "cannot be made with wheels=4"),
        (("CartPole-v1", "--algorithm", "dqn", "--make", "=4"), "write it like NAME=VALUE"),
        (("CartPole-v1", "--algorithm", "dqn", "--until", "5 laps"), "laps are for 'racecraft train'"),
        (("CartPole-v1", "--algorithm", "dqn", "--until", "no better lap"), "laps are for 'racecraft train'"),
        (("CartPole-v1", "--algorithm", "dqn", "--seed", "-1"), "seed is -1"),
        (("--resume", "runs/none"), "learned.json is missing"),
    ],
)
def test_mistakes_are_told_in_one_sentence(
    racecraft: Run, tmp_path: Path, arguments: tuple[str, ...], says: str
) -> None:
    outcome = racecraft("learn", *arguments)
    assert (outcome.status, outcome.out) == (1, "")
    assert says in " ".join(outcome.err.split())
    assert "bug" not in outcome.err
    assert not (tmp_path / "runs").exists()


def test_resume_keeps_the_settings(racecraft: Run) -> None:
    outcome = racecraft("learn", "--resume", "runs/a", "--seed", "3")
    assert outcome.status == 2
    assert "--seed does not go with --resume" in outcome.err


def test_the_live_curve_rises_with_the_return() -> None:
    console = Console(file=StringIO(), force_terminal=True, width=80, color_system=None)
    with CurveReporter(title="T", console=console) as reporter:
        for turn in range(6):
            reporter(Progress(turn * 10, 60, 1.0, 60.0 * (100 - turn), float(turn), 10.0 * turn, is_best=True))
    shown = console.file.getvalue()  # type: ignore[attr-defined]
    assert "50.00" in shown
    assert "50 of 60 steps" in shown
    assert "at most 1 h 35 min more" in " ".join(shown.replace("│", " ").split())
    rows = [line for line in shown.splitlines() if any("⠀" < mark <= "⣿" for mark in line)][-8:]
    filled = [sum("⠀" < mark <= "⣿" for mark in row) for row in rows]
    assert filled == sorted(filled)  # a rising curve is wider below
    assert filled[0] < filled[-1]
