"""The command line, every verb, in this process unless a process of its own is the point."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from racecraft import __version__, cli
from racecraft.bench import suite
from racecraft.errors import RacecraftError
from racecraft.learn import PPOConfig
from racecraft.run import read_metrics, read_simtrace
from racecraft.training import settings as training_settings

GOOD = "def reward_function(params):\n    return float(params['progress'])\n"
BAD = "def reward_function(params):\n    return params['progres']\n"
SMALL = ("--track", "oval", "--num-envs", "8", "--evaluate-every", "512", "--num-threads", "1")


class Outcome(NamedTuple):
    status: int
    out: str
    err: str

    @property
    def document(self) -> Any:
        """The one JSON object on stdout, as strict readers see it."""
        assert self.out.count("\n") == 1
        return json.loads(self.out, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))


Run = Callable[..., Outcome]


@pytest.fixture
def racecraft(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Run:
    """`racecraft ARGUMENTS` in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")

    def run(*arguments: str) -> Outcome:
        with monkeypatch.context() as patch:
            patch.setattr(sys, "argv", ["racecraft", *arguments])
            patch.setattr("racecraft.cli.train.process_start", time.monotonic)  # not when the tests began
            patch.setattr("warnings.showwarning", None)  # restored afterwards, whatever main puts here
            capsys.readouterr()
            with pytest.raises(SystemExit) as ended:
                cli.main()
        printed = capsys.readouterr()
        assert isinstance(ended.value.code, int)
        return Outcome(ended.value.code, printed.out, printed.err)

    return run


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that can be evaluated."""
    from racecraft import train

    ppo = PPOConfig(num_envs=8, num_steps=8, minibatch_size=32, update_epochs=1)
    root = tmp_path_factory.mktemp("runs")
    return train(
        "oval", ppo=ppo, until="128 steps", evaluate_every=64, evaluation_trials=2, num_threads=1, root=root
    ).run


# ---- help


VERBS = (
    "train",
    "import",
    "evaluate",
    "race",
    "ladder",
    "film",
    "verify",
    "report",
    "tracks",
    "tracks show",
    "tracks sheet",
    "tracks limit",
    "reward",
    "reward check",
    "reward list",
    "reward show",
    "tune",
    "replay",
    "calibrate",
    "serve",
)


@pytest.mark.parametrize("verb", ["", *VERBS, "doctor", "bench"])
def test_every_verb_explains_itself_in_80_columns(racecraft: Run, verb: str) -> None:
    outcome = racecraft(*verb.split(), "--help")
    assert outcome.status == 0
    assert outcome.out.startswith(f"Usage: racecraft {verb}".rstrip())
    assert all(len(line) <= 80 for line in outcome.out.splitlines())
    assert "..." not in re.sub(r"(ARGS\]|TRACKS\]|MODELS\}?|logs[\]}]?)\.\.\.", "", outcome.out)  # nothing is cut
    assert racecraft(*verb.split(), "-h").out == outcome.out


def test_the_version(racecraft: Run) -> None:
    assert racecraft("--version") == (0, f"{__version__}\n", "")


def test_without_a_verb_it_shows_the_help(racecraft: Run) -> None:
    outcome = racecraft()
    assert outcome.status == 2
    assert "Commands:" in outcome.out + outcome.err


def test_the_defaults_in_the_help_are_those_of_the_settings() -> None:
    import inspect

    from racecraft import train
    from racecraft.training import defaults

    shown = {name: parameter.default for name, parameter in inspect.signature(cli.train.train).parameters.items()}
    public = {name: parameter.default for name, parameter in inspect.signature(train).parameters.items()}
    settings = training_settings.TrainSettings()
    assert shown["track"] == [settings.track] == [training_settings.DEFAULT_TRACK]
    for name in ("reward", "actions", "until", "sensors"):
        assert not shown[name]  # as the race has it
        assert not public[name]
    assert defaults.TIME_TRIAL.until == str(settings.until)
    for name in ("critic", "direction", "evaluate_every", "num_threads", "seed"):
        assert shown[name] == getattr(settings, name)


HEAVY = ("torch", "gymnasium", "scipy", "shapely", "PIL", "av", "tensorboard")


@pytest.mark.parametrize(
    ("arguments", "absent"),
    [
        (["--help"], (*HEAVY, "numpy", "rich", "racecraft._native")),
        (["train", "--help"], (*HEAVY, "numpy", "rich", "racecraft._native")),
        (["tracks"], ("torch", "av", "PIL", "gymnasium", "scipy", "casadi")),
        (["reward", "check", "centerline"], ("torch", "av", "PIL", "gymnasium")),
    ],
)
def test_quick_verbs_import_nothing_heavy(tmp_path: Path, arguments: list[str], absent: tuple[str, ...]) -> None:
    program = (
        "import sys, atexit; from racecraft.cli import main; sys.argv[1:] = sys.argv[1:]; "
        f"atexit.register(lambda: print('loaded', [n for n in {absent!r} if n in sys.modules])); main()"
    )
    done = subprocess.run([sys.executable, "-c", program, *arguments], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "loaded []"


# ---- wrong usage and errors


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
        (["train", "--race", "head-to-heads"], "ConfigError", "head-to-heads"),
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


def test_what_an_error_says_is_no_markup(racecraft: Run, tmp_path: Path) -> None:
    assert "[bold]x[/bold]" in racecraft("train", "--critic", "[bold]x[/bold]").err


def test_a_closed_pipe_is_no_error(tmp_path: Path) -> None:
    command = f"{sys.executable} -m racecraft tracks | true"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert "Traceback" not in done.stderr


# ---- tracks


def test_tracks_are_listed(racecraft: Run) -> None:
    outcome = racecraft("tracks")
    lines = outcome.out.splitlines()
    assert outcome.status == 0
    assert all(len(line) <= 80 for line in lines)
    (line,) = (line for line in lines if "reinvent_2018" in line)
    assert "17.7 m" in line
    assert "0.76 m" in line


def test_the_limit_of_a_track(racecraft: Run) -> None:
    outcome = racecraft("tracks", "limit", "oval")
    assert outcome.status == 0
    assert "no lap under" in outcome.out
    document = racecraft("tracks", "limit", "oval", "--json").document
    medals = document["medals"]
    assert document["ideal_seconds"] < document["driven_seconds"] < 1.1 * document["ideal_seconds"]
    assert medals["author"] < medals["gold"] < medals["silver"] < medals["bronze"]
    listed = {track["name"]: track for track in racecraft("tracks", "--json").document["tracks"]}
    assert listed["oval"]["limit"]["ideal_seconds"] == document["ideal_seconds"]
    assert listed["straight"]["limit"] is None
    assert "Medals: author" in racecraft("tracks", "show", "oval", "--width", "400").out


def test_a_sheet_of_tracks(racecraft: Run) -> None:
    from PIL import Image

    outcome = racecraft("tracks", "sheet", "--width", "600", "-o", "all.webp")
    assert (outcome.status, outcome.out) == (0, "18 tracks drawn to all.webp\n")
    document = racecraft(
        "tracks", "sheet", "generated:1", "oval", "--columns", "2", "--width", "400", "--json"
    ).document
    assert document["picture"] == "tracks.png"
    assert [track["name"] for track in document["tracks"]] == ["generated:1", "oval"]
    with Image.open("tracks.png") as picture:
        assert picture.size[0] == 400


def test_tracks_as_json(racecraft: Run) -> None:
    tracks = {track["name"]: track for track in racecraft("tracks", "--json").document["tracks"]}
    assert len(tracks) >= 12
    assert tracks["reinvent_2018"]["length_m"] == pytest.approx(17.7, abs=0.05)
    assert tracks["straight"]["min_radius_m"] is None
    assert tracks["oval"]["is_closed"]


@pytest.mark.parametrize("name", ["oval", "generated:7"])
def test_a_track_is_drawn(racecraft: Run, tmp_path: Path, name: str) -> None:
    outcome = racecraft("tracks", "show", name, "--width", "400")
    assert outcome.status == 0
    (picture,) = tmp_path.glob("*.png")
    assert picture.name in outcome.out
    document = racecraft("tracks", "show", name, "--width", "400", "-o", "mine.png", "--json").document
    assert (document["name"], document["picture"]) == (name, "mine.png")
    assert (tmp_path / "mine.png").read_bytes().startswith(b"\x89PNG")


# ---- rewards


def test_a_good_reward_is_fit_for_training(racecraft: Run, tmp_path: Path) -> None:
    (tmp_path / "reward_function.py").write_text(GOOD)
    outcome = racecraft("reward", "check", "reward_function.py")
    assert outcome.status == 0
    assert "Fit for training." in outcome.out
    assert all(len(line) <= 80 for line in outcome.out.splitlines())
    document = racecraft("reward", "check", "reward_function.py", "--json").document
    assert document["ok"]
    assert document["problems"] == []
    assert {"start", "finish"} <= {situation["name"] for situation in document["situations"]}


def test_a_reward_check_shows_what_was_printed(racecraft: Run, tmp_path: Path) -> None:
    source = (
        "def reward_function(params):\n    for i in range(9): print('\\x1b[2J', params['steps'], i)\n    return 1.0\n"
    )
    (tmp_path / "reward_function.py").write_text(source)
    shown = racecraft("reward", "check", "reward_function.py").out
    assert "Printed at 'finish':" in shown
    assert "200.0 0" in shown
    assert "5 lines more" in shown
    assert "\x1b[2J" not in shown
    situations = racecraft("reward", "check", "reward_function.py", "--json").document["situations"]
    assert all(situation["printed"].count("\n") == 9 for situation in situations)


def test_a_bad_reward_is_told_with_line_and_column(racecraft: Run, tmp_path: Path) -> None:
    (tmp_path / "reward_function.py").write_text(BAD)
    outcome = racecraft("reward", "check", "reward_function.py")
    assert outcome.status == 1
    assert "line 2, column" in outcome.out
    assert "Did you mean 'progress'?" in outcome.out
    assert "Not fit for training." in outcome.out
    (problem,) = racecraft("reward", "check", "reward_function.py", "--json").document["problems"]
    assert (problem["line"], problem["severity"]) == (2, "error")
    assert problem["column"] >= 1


def test_a_reward_that_fails_in_a_situation_says_in_which(racecraft: Run, tmp_path: Path) -> None:
    source = "def reward_function(params):\n    return 1 / (1 - params['is_offtrack'])\n"
    (tmp_path / "reward_function.py").write_text(source)
    outcome = racecraft("reward", "check", "reward_function.py")
    assert outcome.status == 1
    assert "ZeroDivisionError" in outcome.out
    document = racecraft("reward", "check", "reward_function.py", "--json").document
    failed = [situation["name"] for situation in document["situations"] if situation["error"]]
    assert failed == ["off track"]


def test_presets_are_listed_shown_and_fit(racecraft: Run) -> None:
    listed = racecraft("reward", "list", "--json").document["rewards"]
    assert {"centerline", "racing"} <= listed.keys()
    assert all(text.endswith(".") for text in listed.values())
    assert "centerline" in racecraft("reward", "list").out
    source = racecraft("reward", "show", "centerline").out
    assert "def reward_function(params):" in source
    assert json.loads(racecraft("reward", "show", "centerline", "--json").out) == {"source": source}


# ---- train, evaluate


def test_train_ends_with_one_json_object(racecraft: Run) -> None:
    outcome = racecraft("train", *SMALL, "--until", "1024 steps", "--seed", "3", "--name", "mine", "--json")
    assert (outcome.status, outcome.err) == (0, "")
    result = outcome.document
    assert result["run"] == "runs/mine"
    assert result["steps"] == 1024
    assert result["wall_seconds"] > 0
    assert 0 <= result["laps_completed"] <= result["evaluation_trials"] == 5
    assert result["best_lap_seconds"] is None or result["best_lap_seconds"] > 0
    assert result["reason"] == "steps"
    assert json.loads(Path("runs/mine/run.json").read_text())["seed"] == 3


def test_train_against_itself_and_against_the_run_that_came_of_it(racecraft: Run) -> None:
    race = ("--race", "head-to-head", "--cars", "3", "--until", "512 steps", "--json")
    first = racecraft("train", *SMALL, *race, "--name", "first")
    assert (first.status, first.err) == (0, "")
    opponents = json.loads(Path("runs/first/run.json").read_text())["settings"]["opponents"]
    assert (opponents["drivers"], opponents["cars"]) == (["self"], 3)
    second = racecraft("train", *SMALL, *race, "--opponents", "runs/first", "--reward", "overtake", "--name", "second")
    assert (second.status, second.err) == (0, "")
    bots = racecraft("train", *SMALL, "--race", "head-to-head", "--opponents", "bots", "--bots", "2", *race[4:])
    assert (bots.status, bots.err) == (0, "")
    assert json.loads(Path(bots.document["run"], "run.json").read_text())["settings"]["objects"]["bots"]["count"] == 2


def test_train_tells_people_how_it_goes_and_how_to_go_on(racecraft: Run) -> None:
    outcome = racecraft("train", *SMALL, "--until", "1024 steps", "--name", "mine")
    assert outcome.status == 0
    assert len([line for line in outcome.err.splitlines() if "of 5 laps" in line]) == 2
    assert "All steps are done" in outcome.out
    assert "racecraft train --resume runs/mine" in outcome.out
    resumed = racecraft("train", "--resume", "runs/mine", "--until", "1536 steps", "--json")
    assert (resumed.status, resumed.document["steps"]) == (0, 1536)
    taken = racecraft("train", *SMALL, "--name", "mine", "--json")
    assert taken.document["error"]["code"] == "RunError"
    assert "--resume" in taken.document["error"]["hint"]


def test_the_log_of_aws_on_stdout_is_all_there_is_on_stdout(racecraft: Run, trained: Path) -> None:
    outcome = racecraft("train", *SMALL, "--until", "512 steps", "--name", "mine", "--aws-log", "-")
    assert outcome.status == 0
    marks = ("SIM_TRACE_LOG:", "Training> Name=main_level/agent, ", "Policy training> Surrogate loss=", "Sensor list ")
    for mark in marks:
        assert any(line.startswith(mark) for line in outcome.out.splitlines()), mark
    assert "Learned" not in outcome.out
    assert outcome.err == ""
    racecraft("train", "--resume", "runs/mine", "--until", "1024 steps", "--aws-log", "later/mine.log", "--json")
    assert "SIM_TRACE_LOG:" in Path("later/mine.log").read_text()
    outcome = racecraft(
        "evaluate", str(trained), "--laps", "1", "--trials", "1", "--no-video", "--max-resets", "2", "--aws-log", "-"
    )
    assert outcome.out.splitlines()[-1].startswith("Testing> Name=main_level/agent")
    for verb in ("train", "evaluate runs/mine"):
        outcome = racecraft(*verb.split(), "--aws-log", "-", "--json")
        assert outcome.status == 2
        assert "both want stdout" in outcome.err


def test_train_with_a_video_evaluates_in_the_same_object(racecraft: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from racecraft.race import run_evaluation

    asked: list[Path] = []

    class Evaluated:
        def to_dict(self) -> dict[str, Any]:
            return {"laps_completed": 3}

    monkeypatch.setattr(run_evaluation, "evaluate_run", lambda run: asked.append(run) or Evaluated())
    result = racecraft("train", *SMALL, "--until", "512 steps", "--name", "mine", "--video", "--json").document
    assert asked == [Path("runs/mine")]
    assert result["evaluation"] == {"laps_completed": 3}


def test_a_reward_that_fails_late_is_one_error(racecraft: Run, tmp_path: Path) -> None:
    source = GOOD.replace(
        "    return", "    if params['is_offtrack'] and params['steps'] != 95: return None\n    return"
    )
    (tmp_path / "mine.py").write_text(source)
    outcome = racecraft("train", *SMALL, "--reward", "mine.py", "--until", "9000 steps", "--name", "mine")
    assert outcome.status == 1
    assert "line 2" in outcome.err
    assert "params = {" in outcome.err
    assert "--resume runs/mine" in outcome.err
    assert "Traceback" not in outcome.err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_training_is_status_130_and_can_go_on(racecraft: Run, number: signal.Signals) -> None:
    ended = threading.Event()

    def interrupt() -> None:
        while not Path("runs/mine/checkpoints/manifest.json").exists():
            if ended.wait(0.01):
                return  # the signal would end the tests, not the training
        os.kill(os.getpid(), number)

    thread = threading.Thread(target=interrupt)
    thread.start()
    try:
        outcome = racecraft("train", *SMALL, "--until", "10 minutes", "--name", "mine")
    finally:
        ended.set()
        thread.join()
    assert outcome.status == 130, outcome
    assert "Stopped" in outcome.out
    assert "racecraft train --resume runs/mine" in outcome.out
    resumed = racecraft("train", "--resume", "runs/mine", "--until", "1 steps", "--json")
    assert (resumed.status, resumed.document["reason"]) == (0, "steps")


def test_evaluate(racecraft: Run, trained: Path) -> None:
    outcome = racecraft("evaluate", str(trained), "--laps", "1", "--trials", "2", "--no-video", "--max-resets", "2")
    assert outcome.status == 0
    assert "laps clean" in outcome.out
    for what in ("metrics", "sim-trace", "racing line"):
        assert what in outcome.out
    table = [line for line in outcome.out.splitlines() if str(trained) not in line]
    assert all(len(line) <= 80 for line in table)


def test_evaluate_as_json_names_files_that_can_be_read(racecraft: Run, trained: Path) -> None:
    arguments = ["--track", "oval", "--laps", "1", "--trials", "2", "--max-resets", "1", "--json"]
    document = racecraft("evaluate", str(trained), *arguments).document
    assert document["run"] == str(trained)
    assert document["trials"] == 2
    assert {"laps_completed", "best_lap_seconds", "mean_completion", "completion_interval", "off_track_count"} <= (
        document.keys()
    )
    assert document["official_races"] == []  # our own tracks have none
    assert document["limit"]["ideal_seconds"] < document["limit"]["medals"]["author"]
    files = {name: Path(path) for name, path in document["files"].items()}
    assert len(read_metrics(files["metrics"])["metrics"]) >= 2
    assert len(read_simtrace(files["sim-trace"])["steps"]) > 2
    assert files["racing line"].read_bytes().startswith(b"\x89PNG")
    assert files["video"].read_bytes()[4:8] == b"ftyp"
    assert document["files"]["video"].endswith("mp4/camera-pip/0-video.mp4")
    json.loads(files["summary"].read_text())


def test_race_verify_and_ladder(racecraft: Run, trained: Path, tmp_path: Path) -> None:
    short = ("--track", "oval", "--time-limit", "4", "--no-video", "--laps", "1")
    document = racecraft("race", str(trained), f"{trained}@64", *short, "--json").document
    assert [result["place"] for result in document["results"]] == [None, None]
    replays = [path for name, path in document["files"].items() if name.startswith("replay")]
    assert len(replays) == 2
    for replay in replays:
        assert racecraft("verify", replay, "--json").document["is_genuine"]
    told = racecraft("verify", replays[0])
    assert told.status == 0
    assert "bit for bit" in told.out
    table = racecraft("race", str(trained), "--type", "object-avoidance", "--objects", "2", *short)
    assert table.status == 0
    assert "crashes" in table.out

    rated = racecraft("ladder", str(trained), f"{trained}@64", "-t", "oval", "--starts", "1", "--time-limit", "4")
    assert rated.status == 0
    assert "rating" in rated.out
    assert racecraft("race", str(trained), "--bots", "2", *short).err.startswith("ConfigError: --bots goes with --type")

    filmed = racecraft("film", replays[0], "--ghost", replays[1], "--ghost", "best-lap", "--json").document
    assert Path(filmed["video"]).stat().st_size > 10_000
    assert racecraft("film", replays[0], "--car", "2").err.startswith("ConfigError: Car 2")

    from racecraft.race import read_replay, write_replay

    forged = read_replay(replays[0])
    forged.rewards[0][5] += 1.0
    path = write_replay(forged, tmp_path / "forged.replay")
    refused = racecraft("verify", str(path))
    assert refused.status == 1
    assert "step 5" in refused.out
    document = racecraft("verify", str(path), "--json").document
    assert (document["is_genuine"], document["difference"]["step"]) == (False, 5)
    assert racecraft("verify", str(tmp_path / "none.replay")).err.startswith("ReplayError")


@pytest.mark.parametrize(
    ("option", "says"),
    [
        (["--rules", "dfrc"], "Did you mean 'drfc'?"),
        (["--checkpoint", "bets"], "best"),
        (["--checkpoint", "77"], "77"),
        (["--laps", "0"], "laps"),
        (["--trials", "0"], "num_trials"),
        (["--direction", "up"], "direction"),
        (["--track", "ovla"], "Did you mean 'oval'?"),
        (["--offtrack-penalty", "-1"], "offtrack_penalty"),
        (["--seed", "-1"], "seed"),
    ],
)
def test_a_wrong_option_of_evaluate_writes_nothing(racecraft: Run, trained: Path, option: list[str], says: str) -> None:
    before = set(trained.rglob("*"))
    outcome = racecraft("evaluate", str(trained), *option)
    assert outcome.status == 1, outcome.err
    assert says in outcome.err
    assert set(trained.rglob("*")) == before


# ---- doctor, bench


def test_the_doctor(racecraft: Run) -> None:
    outcome = racecraft("doctor")
    assert outcome.status == 0, outcome.out
    assert "native core" in outcome.out
    assert racecraft("doctor", "--json").document["ok"]


def test_the_doctor_finds_what_is_broken(racecraft: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from racecraft.bench import doctor

    def broken() -> str:
        raise RacecraftError("gone")

    monkeypatch.setattr(doctor, "CHECKS", [("learner", broken, "Install it again.")])
    outcome = racecraft("doctor")
    assert outcome.status == 1
    assert "RacecraftError: gone" in outcome.out
    assert "Install it again." in outcome.out
    assert not racecraft("doctor", "--json").document["ok"]


def test_bench(racecraft: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(suite, "CAMERA_CARS", 16)
    monkeypatch.setattr(suite, "STATE_CARS", 64)
    outcome = racecraft("bench", "--only", "simulator", "--seconds", "0.1", "--json")
    assert (outcome.status, outcome.err) == (0, "")
    assert outcome.document.keys() == {"machine", "simulator"}
    assert outcome.document["simulator"]["camera_steps_per_second"] > 0
    assert outcome.document["simulator"]["state_steps_per_second"] > 0
    shown = racecraft("bench", "--only", "simulator", "--only", "reward", "--seconds", "0.1")
    assert "camera_steps_per_second" in shown.out
    assert "calls_per_second" in shown.out
    assert all(len(line) <= 80 for line in shown.out.splitlines())
