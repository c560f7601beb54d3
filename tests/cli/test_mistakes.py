"""Wrong usage, errors and bugs: status and one sentence, for people and as JSON."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import Run


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["trian"], "Did you mean 'train'?"),
        (["tracks", "shwo"], "Did you mean 'show'?"),
        (["reward", "chek"], "Did you mean 'check'?"),
        (["train", "--trak", "oval"], "--track"),
        (["train", "--seed", "many"], "--seed"),
        (["train", "now"], "now"),
        (["evaluate"], "run"),
        (["tracks", "show"], "name"),
        (["train", "--resume", "runs/x", "--seed", "4"], "--seed does not go with --resume"),
        (["train", "--resume", "runs/x", "--track", "oval"], "--track does not go with --resume"),
        (["train", "--resume", "runs/x", "--from", "runs/y"], "--from does not go with --resume"),
        (["replay", "log.csv", "--palette", "2020"], "--palette goes with --frame."),
        (["replay", "--frame", "a.png", "--vehicle", "v4"], "--vehicle goes with logs."),
        (["replay", "--frame", "a.png", "--rows", "a.csv"], "--rows goes with logs."),
    ],
)
def test_wrong_usage_is_status_2(racecraft: Run, arguments: list[str], says: str) -> None:
    outcome = racecraft(*arguments)
    assert (outcome.status, outcome.out) == (2, "")
    assert says in outcome.err
    as_json = racecraft(*arguments, "--json")
    assert as_json.status == 2
    assert as_json.document["error"]["code"] == "UsageError"
    assert says in as_json.document["error"]["message"]
    assert "--help" in as_json.document["error"]["hint"]


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (["train", "--track", "ovla"], "TrackNotFound", "Did you mean 'oval'?"),
        (["train", "--reward", "racign"], "RewardError", "Did you mean 'racing'?"),
        (["train", "--until", "soon"], "ConfigError", "soon"),
        (["train", "--vehicle", "v55"], "ConfigError", "Did you mean 'v5'?"),
        (["train", "--actions", "contnuous"], "ConfigError", "continuous"),
        (["train", "--critic", "priviliged"], "ConfigError", "Did you mean 'privileged'?"),
        (["train", "--network", "SMALL"], "ConfigError", "RACECRAFT_SMALL"),
        (["train", "--direction", "foward"], "ConfigError", "Did you mean 'forward'?"),
        (["train", "--num-envs", "-1"], "ConfigError", "num_envs"),
        (["train", "--race", "head-to-heads"], "ConfigError", "Did you mean 'head-to-head'?"),
        (["train", "--race", "head-to-model"], "ConfigError", "Train for it with --race head-to-head."),
        (["train", "--race", "grid"], "ConfigError", "Train for it with --race head-to-head."),
        (["train", "--race", "object-avoidance", "--objects", "0"], "ConfigError", "Obstacles count is 0; allowed is"),
        (["train", "--race", "head-to-bot", "--bots", "0"], "ConfigError", "Bots count is 0; allowed is"),
        (["train", "--race", "head-to-head", "--cars", "0"], "ConfigError", "2 to 8"),
        (["race", "RUN", "RUN", "--type", "grid", "--objects", "0"], "ConfigError", "Obstacles count is 0; allowed is"),
        (["evaluate", "RUN", "--objects", "0"], "ConfigError", "--objects goes with --race object-avoidance"),
        (["evaluate", "RUN", "--race", "head-to-head"], "ConfigError", "racecraft race RUN OTHER --type head-to-model"),
        (["race", "RUN", "RUN", "--type", "head_to_head"], "ConfigError", "are --type head-to-model;"),
        (["race", "RUN", "RUN", "--type", "griid"], "ConfigError", "head-to-bot, head-to-model, grid."),
        (["ladder", "RUN", "RUN", "--type", "head-to-head"], "ConfigError", "head-to-bot, head-to-model."),
        (["train", "--race", "duel"], "ConfigError", "head-to-bot, head-to-head"),
        (["train", "--race", "head-to-head", "--cars", "9"], "ConfigError", "2 to 8"),
        (["train", "--race", "head-to-head", "--cars", "2", "--opponents", "bots"], "ConfigError", "--bots"),
        (["train", "--race", "head-to-head", "--opponents", "runs/none"], "RunError", "none"),
        (["train", "--race", "head-to-head", "--opponents", "self", "--opponents", "a"], "ConfigError", "'self' alone"),
        (["train", "--cars", "3"], "ConfigError", "--race head-to-head"),
        (["train", "--opponents", "self"], "ConfigError", "--race head-to-head"),
        (["train", "--seed", "-1"], "ConfigError", "seed"),
        (["train", "--name", "../x"], "RunError", "../x"),
        (["train", "--hyperparameters", "none.json"], "ConfigError", "none.json"),
        (["train", "--resume", "runs/none"], "RunError", "none"),
        (["train", "--from", "runs/none@best"], "RunError", "none"),
        (["evaluate", "runs/none"], "RunError", "none"),
        (["import", "none"], "SourceError", "none"),
        (["import", "."], "SourceError", "reward_function.py"),
        (["tracks", "show", "ovla"], "TrackNotFound", "Did you mean 'oval'?"),
        (["tracks", "show", "oval", "--width", "-5"], "TrackError", "-5"),
        (["tracks", "show", "oval", "-o", "nowhere/oval.png"], "", "nowhere"),
        (["tracks", "show", "oval", "-o", "oval.txt"], "TrackError", "txt"),
        (["tracks", "limit", "straight"], "TrackError", "open"),
        (["tracks", "limit", "oval", "--vehicle", "v7"], "ConfigError", "v7"),
        (["tracks", "limit", "oval", "--direction", "up"], "ConfigError", "up"),
        (["tracks", "sheet", "oval", "ovla"], "TrackNotFound", "Did you mean 'oval'?"),
        (["tracks", "sheet", "oval", "--columns", "0"], "TrackError", "0"),
        (["tracks", "sheet", "oval", "-o", "oval.txt"], "TrackError", "txt"),
        (
            ["league", "token", " "],
            "ConfigError",
            "The token's name is ' '; allowed is what the list of tokens is to show.",
        ),
        (
            ["worker", "--server", "http://127.0.0.1:1", "--token-file", "t", "--trainings", "-1"],
            "ConfigError",
            "trainings is -1; allowed is a whole number from 0 to 64.",
        ),
        (["reward", "check", "racign"], "RewardError", "Did you mean 'racing'?"),
        (["reward", "show", "racign"], "RewardError", "Did you mean 'racing'?"),
        (["bench", "--only", "simulatr"], "ConfigError", "Did you mean 'simulator'?"),
        (["bench", "--seconds", "0"], "ConfigError", "seconds"),
    ],
)
def test_a_mistake_is_status_1_and_one_sentence(racecraft: Run, arguments: list[str], code: str, says: str) -> None:
    outcome = racecraft(*arguments)
    assert (outcome.status, outcome.out) == (1, "")
    assert says in outcome.err
    assert "Traceback" not in outcome.err
    assert outcome.err.startswith(f"{code}: " if code else "")
    if arguments[:2] != ["reward", "show"]:
        error = racecraft(*arguments, "--json").document
        assert error.keys() == {"error"}
        assert error["error"].keys() == {"code", "message", "hint"}
        assert error["error"]["code"].startswith(code)
        assert says in error["error"]["message"] + error["error"]["hint"]


def test_debug_shows_the_stack_trace(racecraft: Run) -> None:
    for arguments in (["--debug", "train", "--track", "ovla"], ["train", "--track", "ovla", "--debug"]):
        outcome = racecraft(*arguments)
        assert outcome.status == 1
        assert "Traceback" in outcome.err
        assert "TrackNotFound" in outcome.err


def test_a_bug_is_told_as_one(racecraft: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken() -> None:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("racecraft.bench.doctor.examine", broken)
    outcome = racecraft("doctor")
    assert outcome.status == 1
    assert outcome.err.startswith("ZeroDivisionError: division by zero\n")
    assert "--debug" in outcome.err
    assert "Traceback" not in outcome.err
    assert racecraft("doctor", "--json").document["error"]["code"] == "ZeroDivisionError"


def test_an_interrupt_before_the_verb_begins_is_no_stack_trace(racecraft: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("racecraft.cli.entry.application", interrupted)
    outcome = racecraft("tracks")
    assert (outcome.status, outcome.out, outcome.err) == (130, "", "")


def test_an_interrupt_while_the_command_line_is_imported_is_no_stack_trace(tmp_path: Path) -> None:
    script = """if True:
        import sys
        class Pressed:
            def find_spec(name, *_):
                if name == "typer":
                    raise KeyboardInterrupt
        sys.meta_path.insert(0, Pressed)
        from racecraft.cli import main
        sys.exit(main())
    """
    done = subprocess.run([sys.executable, "-c", script, "tracks"], capture_output=True, text=True, cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_what_an_error_says_is_no_markup(racecraft: Run, tmp_path: Path) -> None:
    assert "[bold]x[/bold]" in racecraft("train", "--critic", "[bold]x[/bold]").err


@pytest.mark.parametrize(
    ("command", "says"),
    [
        ("train --model-metadata m.json --actions safe", "--actions does not go with --model-metadata"),
        ("train --model-metadata m.json --sensors LIDAR", "--sensors does not go with --model-metadata"),
        ("tune --model-metadata m.json --actions safe", "--actions does not go with --model-metadata"),
        ("tune --for speed", "--for is 'speed'; allowed are laps, lap_time."),
    ],
)
def test_options_are_called_as_they_were_typed(racecraft: Run, command: str, says: str) -> None:
    told = racecraft(*command.split())
    assert told.status != 0
    assert says in " ".join(told.err.replace("│", " ").split())


@pytest.mark.costly
def test_a_closed_pipe_is_no_error(tmp_path: Path) -> None:
    command = f"{sys.executable} -m racecraft tracks | true"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("command", "variables", "status", "says"),
    [
        ("tracks", {"PYTHONIOENCODING": "ascii"}, 0, ""),
        ("tracks", {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}, 0, ""),
        ("reward check racing <&- >&- 2>&-", {}, 0, ""),
        ("doctor", {"RACECRAFT_ISA": "sse9"}, 1, "ConfigError: Instruction set 'sse9' cannot run here; choose one of "),
        ("tracks --json > /dev/full", {}, 1, "OSError: [Errno 28] No space left on device"),
        ("tracks > /dev/full", {}, 1, "OSError: [Errno 28] No space left on device"),
    ],
)
def test_odd_surroundings_are_no_bug(
    tmp_path: Path, command: str, variables: dict[str, str], status: int, says: str
) -> None:
    done = subprocess.run(
        ["bash", "-c", f"{sys.executable} -m racecraft {command}"],
        env={**os.environ, **variables}, capture_output=True, text=True, cwd=tmp_path, check=False,
    )  # fmt: skip
    assert done.returncode == status
    assert done.stderr.startswith(says)
    assert "Traceback" not in done.stderr
    assert "bug" not in done.stderr


@pytest.mark.parametrize(
    "command",
    [
        "train --reward {}",
        "train --reward centerline --model-metadata {}",
        "train --reward centerline --hyperparameters {}",
        "train --reward centerline --track {}.npy",
        "reward check {}",
        "verify {}",
        "film {}",
        "replay {} --track oval",
        "sweep {}",
        "import {}",
        "perceive {}",
        "perceive {}.mp4",
    ],
)
def test_a_pipe_is_not_waited_for(racecraft: Run, tmp_path: Path, command: str) -> None:
    for name in ("pipe", "pipe.npy", "pipe.mp4"):
        os.mkfifo(tmp_path / name)
    outcome = racecraft(*command.format(tmp_path / "pipe").split(), "--json")
    assert outcome.status == 1
    message = outcome.document["error"]["message"]
    assert message.endswith(("it is no regular file.", "to import.")), message
