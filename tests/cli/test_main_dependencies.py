"""Every verb and every option where only the main dependencies are installed: it works, or names the extra."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from main_dependencies import RUNNER, link_main_packages, main_packages
from packaging.requirements import Requirement
from PIL import Image
from typer.main import get_command

from racecraft import load_track
from racecraft.cli.entry import every_verb
from racecraft.extras import EXTRAS, MODULES, not_installed
from racecraft.track import save_route

ROOT = Path(__file__).parents[2]
BOXES = "--objects 1 --parked-cars --placement random"
BOTS = "--bots 1 --bot-speed 0.4 --lane-changes"
SHORT = "-t oval --until 64steps --num-envs 8 --num-threads 1 --evaluate-every 32 --runs R"
AHEAD = SHORT.replace("oval", "I.npy")  # filmed in seconds: even who has not learned anything gets to its end
COMMANDS: dict[str, list[str]] = {
    "train": [
        f"train {AHEAD} -n a -r racing --actions continuous --network RACECRAFT_SMALL --critic camera --vehicle v4"
        " --camera 2026 --direction reverse --randomize light -s 2 --json --video --aws-log L",
        f"train {SHORT} -n b --model-metadata M --hyperparameters H --device cpu",
        f"train {SHORT} -n c --sensors STEREO_CAMERAS --race object-avoidance {BOXES}",
        f"train {SHORT} -n l --race head-to-bot {BOTS}",
        f"train {SHORT} -n d --race object-avoidance --objects 1 --positions 0.5,1",
        f"train {SHORT} -n e --race head-to-head --cars 2 --opponents self",
        f"train {SHORT} -n f --recipe steady --algorithm distill",
        f"train {SHORT} -n g --algorithm sac --actions continuous",
        f"train {SHORT} -n h --algorithm sb3:ppo",
        f"train {SHORT} -n i --device cuda",
        f"train {SHORT} -n j --from R/a",
        "train --resume R/a --until 96steps",
    ],
    "evaluate": [
        "evaluate R/b -t oval -l 1 --trials 1 --rules drfc --checkpoint last --vehicle v5 --direction reverse"
        " --randomize light --offtrack-penalty 1 --collision-penalty 1"
        " --max-resets 0 -s 3 --video --ghost best-lap --aws-log L --json",  # whoever films it, films a second
        f"evaluate R/b -l 1 --trials 1 --max-resets 0 --race head-to-bot {BOTS} --no-video",
        f"evaluate R/b -l 1 --trials 1 --max-resets 0 --race object-avoidance {BOXES} --no-video",
        "evaluate R/b -l 1 --trials 1 --max-resets 0 --race object-avoidance --objects 1 --positions 0.5,1 --no-video",
        "evaluate R/b --as car -l 1 --trials 1 --max-resets 0 --no-video",
        "evaluate R/b --tracks oval",
    ],
    "race": [
        "race R/b R/b@last -t oval --type time-trial --trials 1 -l 1 --rules drfc --ranking best"
        " --minimum-laps 1 --time-limit 4 --offtrack-penalty 1 --collision-penalty 1 --max-resets 0 --direction forward"
        " --vehicle v5 --randomize none -s 1 --video --ghost best-lap -o X --json",
        f"race R/b R/b@last -t oval --type object-avoidance -l 1 --time-limit 4 {BOXES} --no-video -o X",
        f"race R/b -t oval --type head-to-bot -l 1 --time-limit 4 {BOTS} --no-video -o X",
        "race R/b R/b@last -t oval -l 1 --time-limit 4 --trials 1 --secret --no-video -o X",
        "race R/b -t oval --type object-avoidance -l 1 --time-limit 4 --objects 1 --positions 0.5,1 --no-video -o X",
    ],
    "ladder": [
        "ladder R/b R/b@last -t oval --type time-trial --schedule round-robin --starts 1 -l 1 --rules drfc"
        " --randomize light --time-limit 4 --vehicle v5 -s 1 --json",
        f"ladder R/b R/b@last -t oval --schedule swiss --rounds 1 --starts 1 --type object-avoidance {BOXES}",
        f"ladder R/b R/b@last -t oval --starts 1 --type head-to-bot {BOTS}",
        "ladder R/b R/b@last -t oval --starts 1 --time-limit 4 --type object-avoidance --objects 1 --positions 0.5,1",
    ],
    "film": ["film P --car 1 --ghost best-lap -o F.mp4 --json"],
    "verify": [
        "verify P --json",
        "verify D --race C",
        f"verify --race http://127.0.0.1:9/league/1 --commitment {64 * 'a'} --json",
    ],
    "report": ["report R/b -o report.html --json"],
    "share": ["share R/b --evaluation Z --language de -o share.html --json"],
    "export": ["export R/b --to car --checkpoint last -o exported.tar.gz --json", "export R/b --to onnx"],
    "car": [
        "car calibrate --circle-left 0.8 --circle-right 0.9 --servo 1.7,1.45,1.2 --speed 40=1.1 --slider 40"
        " --latency 0.05 -o car.json --json",
    ],
    "perceive": [
        "perceive G -o seen --json",
        "perceive R/b -o seen.mp4",
        "perceive --train E --updates 2 --roads 1 --store 256 -s 2",
        "perceive G --weights E",
        "perceive --drive oval --speed 1.4 --vehicle v4 --randomize light --trials 1",
    ],
    "import": ["import R/b -t oval -r racing --network RACECRAFT_SMALL -n k --runs R -c best --json"],
    "replay": [
        "replay S -t oval -r racing --vehicle v5 -o S.png --rows S.csv --json",
        "replay --frame G -t oval --palette 2018",
    ],
    "calibrate": ["calibrate S --vehicle v5 -t oval -o V.json --json"],
    "tracks": [
        "tracks limit oval -o T.png --json",
        "tracks limit oval --vehicle v6 --direction reverse",
        "tracks limit T.npy",
        "tracks sheet oval hairpin -o T.png --columns 2 --width 800 --title Two --json",
        "tracks show oval -o T.png --width 400 --json",
        "tracks --json",
    ],
    "reward": ["reward list --json", "reward show racing --json", "reward check W -t oval --objects 2 --bots 1 --json"],
    "learn": [
        "learn --json",
        "learn CliffWalking-v1 --algorithm sarsa --until 200steps --seed 1 --set gamma=0.9 --name w --runs R --json",
        "learn Racecraft-v0 --algorithm q-table --until 640steps --make max_episode_steps=60 --name t --runs R --watch",
        "learn --resume R/w --watch",
        "learn ALE/Pong-v5 --algorithm dqn --until 200steps --runs R",
    ],
    "lessons": [
        "lessons --language de --json",
        "lessons quiz 1 --answers babb --language en --json",
        "lessons open 1 --folder N --no-browser --no-start --json",
        "lessons open 1 --folder N --no-browser",
        "lessons run 3 --json",
    ],
    "tune": [
        "tune -t oval -r racing --search lr --for laps -m 1 --trials 1 --trial-steps 64 --actions continuous"
        " --hyperparameters H --from R/a -s 1 --num-threads 1 --processes 1 --window 2 -n u --root U --json",
        "tune --model-metadata M",
        "tune --resume U/u",
    ],
    "serve": [
        "serve --runs R -p 0 --database sqlite:///D.db --artifacts file:///tmp/none --trainings 1 --others 1"
        " --no-browser --json",
        "serve --runs R -p 0 --league --host 127.0.0.1 --address http://127.0.0.1:8321 --plain-http",
        "serve --runs R -p 0 --league --address https://x --trusted-proxy 127.0.0.1 --certificate C.pem --key K.pem",
        "serve --runs R -p 0 --league --provider https://x --provider-client c --provider-secret-file W"
        " --provider-name N --provider-domain x.example --provider-claim a=b --provider-group 1",
    ],
    "login": ["login http://127.0.0.1:9 --token rc_none --json", "login http://127.0.0.1:9"],
    "races": ["races --json"],
    "submit": ["submit R/a --race 1 --checkpoint best --wait --json"],
    "league": [
        "league audit --runs R --database sqlite:///D.db --count 5 --json",
        "league token --runs R --database sqlite:///D.db --days 1 --json",
        "league reset you --runs R --database sqlite:///D.db --address https://x --json",
        "league backup B.tar --runs R --database sqlite:///D.db --json",
        "league restore B.tar --runs B --database sqlite:///E.db --json",
    ],
    "sweep": [
        "sweep Q -n q --runs R --processes 1 --json",
        "sweep --resume q --runs R --board",
        "sweep Q -n r --runs R --cluster auto",
    ],
    "worker": [
        "worker --runs W --database sqlite:///D.db --artifacts file:///tmp/none --trainings 1 --others 1 --machine w"
        " --json",
        "worker --server http://127.0.0.1:9 --token-file M --plain-http",
    ],
    "bench": ["bench --only reward --seconds 0.1 --seeds 1 --json"],
    "doctor": ["doctor --json"],
}
"""What is typed, by verb; single capitals are files that the test makes first."""
ELSEWHERE = ("login", "races", "submit", "verify --race http")
"""Lines that ask a league, of which there is none here; they need no extra to find that out."""
GLOBAL = {"--help", "--debug", "--version"}


def options(command: Any, path: str = "") -> set[tuple[str, str]]:
    """(verb, option) of every option there is, by its last spelling."""
    if hasattr(command, "commands"):
        found = {pair for name, inner in command.commands.items() for pair in options(inner, path or name)}
        if path:
            found |= {(path, option.opts[-1]) for option in command.params if option.opts[-1].startswith("-")}
        return found
    return {(path, option.opts[-1]) for option in command.params if option.opts[-1].startswith("-")} - {
        (path, name) for name in GLOBAL
    }


def spellings(command: Any) -> dict[str, str]:
    """Every spelling of an option, also of its opposite, and its last one."""
    found = {}
    for inner in getattr(command, "commands", {}).values():
        found |= spellings(inner)
    for option in command.params:
        found |= dict.fromkeys([*option.opts, *option.secondary_opts], option.opts[-1])
    return found


def test_every_option_is_typed_somewhere() -> None:
    root = get_command(every_verb())  # type: ignore[attr-defined]
    called = spellings(root)
    typed = {
        (verb, called.get(word, word)) for verb, lines in COMMANDS.items() for line in lines for word in line.split()
    }
    assert options(root) - typed == set()


def package(text: str) -> str:
    """A requirement without its versions."""
    requirement = Requirement(text)
    return requirement.name + (f"[{','.join(requirement.extras)}]" if requirement.extras else "")


def test_the_extras_are_those_of_the_project() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    declared = {extra: {package(text) for text in texts} for extra, texts in project.items()}
    assert {extra: set(packages) for extra, packages in EXTRAS.items()} == declared
    assert set(MODULES.values()) <= EXTRAS.keys()


def test_a_module_of_no_extra_is_a_bug() -> None:
    assert not_installed("racecraft.nothing") is None
    told = not_installed("scipy.ndimage", "This")
    assert told is not None
    assert str(told) == "This needs scipy, which is not installed."
    assert "racecraft[limit]" in told.hint
    assert ".venv/bin/pip install casadi scipy" in told.hint


def test_the_environment_of_the_main_job_is_small() -> None:
    """150 MB with bytecode of what is imported; docs/machine.md says what each package takes."""
    needed = main_packages("pip", *(ROOT / "requirements/build.in").read_text().replace(">=", " ").split()[::2])
    assert {"numpy", "nanobind", "scikit-build-core"} <= needed
    size = {name: sum(file.size or 0 for file in metadata.files(name) or ()) for name in needed}
    assert sum(size.values()) < 125e6, sorted(size.items(), key=lambda pair: -pair[1])[:5]
    pinned = set(re.findall(r"^([\w.-]+)==", (ROOT / "requirements/train.txt").read_text(), flags=re.MULTILINE))
    assert needed - {"racecraft", "pip"} <= pinned  # and nothing else but what other systems need
    assert pinned - needed <= {"colorama"}


def straight_on(*, metres: float) -> np.ndarray[Any, Any]:
    """A route: centre line and borders (W, 6)."""
    ahead = np.arange(0.0, metres, 0.15)
    lines = [np.stack([ahead, np.full_like(ahead, side)], axis=1) for side in (0.0, 0.45, -0.45)]
    return np.concatenate(lines, axis=1)


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[int, str]]:
    """What every command said."""
    site, folder = tmp_path_factory.mktemp("site"), tmp_path_factory.mktemp("work")
    link_main_packages(site)
    (folder / "W").write_text("def reward_function(params):\n    return 1.0\n")
    (folder / "Q").write_text('seeds = [1]\n[all]\ntrack = "oval"\nuntil = "64 steps"\n[settings.plain]\n')
    (folder / "H").write_text('{"lr": 0.001}')
    document = {"action_space": [{"steering_angle": a, "speed": 1.0, "index": i} for i, a in enumerate((-8, 8))]}
    (folder / "M").write_text(
        json.dumps({**document, "sensor": ["FRONT_FACING_CAMERA"], "neural_network": "RACECRAFT_SMALL"})
    )
    save_route(load_track("hairpin"), folder / "T.npy")
    np.save(folder / "I.npy", straight_on(metres=4.0))
    Image.new("RGB", (160, 120)).save(folder / "G", format="PNG")
    places = {"S": "R/b/training-simtrace/0-iteration.csv"}
    environment = {**os.environ, "PYTHONPATH": str(site), "COLUMNS": "100", "XDG_CACHE_HOME": str(folder / "cache")}

    def run(lines: list[str]) -> list[tuple[int, str]]:
        words = [[places.get(word, word) for word in line.split()] for line in lines]
        return _run(words, folder, environment)

    found: dict[str, tuple[int, str]] = {}

    def run_until(verb: str) -> None:
        """In one process: what one verb imports helps no other that needs what is not there."""
        verbs = list(COMMANDS)
        lines = [line for name in verbs[: verbs.index(verb) + 1] for line in COMMANDS[name] if line not in found]
        found.update(zip(lines, run(lines), strict=True))

    run_until("ladder")
    first = min(folder.glob("R/b/evaluation-*/evaluation.replay"))
    places["Z"], places["P"] = first.parent.name.removeprefix("evaluation-"), str(first)
    places["D"] = next(str(path) for path in sorted(folder.glob("X/*/*.replay")))
    places["C"] = str(Path(places["D"]).parent)
    run_until("doctor")
    return found


def _run(words: list[list[str]], folder: Path, environment: dict[str, str]) -> list[tuple[int, str]]:
    typed = [[re.sub(r"^(\d+)steps$", r"\1 steps", word) for word in line] for line in words]
    done = subprocess.run(
        [sys.executable, "-S", "-c", RUNNER],
        cwd=folder, env=environment, input=json.dumps(typed), capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    return [(status, text) for status, text in json.loads(done.stdout.splitlines()[-1])]


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_only_the_main_dependencies_are_there(tmp_path: Path) -> None:
    link_main_packages(tmp_path)
    assert {"numpy", "pillow", "typer"} <= main_packages()
    probe = "import sys\nfor name in sys.argv[1:]:\n    try: __import__(name)\n    except ImportError: print(name)"
    names = ["numpy", "racecraft", "scipy", "torch", "casadi", "fastapi", "optuna", "av"]
    done = subprocess.run(
        [sys.executable, "-S", "-c", probe, *names],
        env={**os.environ, "PYTHONPATH": str(tmp_path)}, capture_output=True, text=True, timeout=300, check=True,
    )  # fmt: skip
    assert done.stdout.split() == ["scipy", "torch", "casadi", "fastapi", "optuna", "av"]


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("line", [line for lines in COMMANDS.values() for line in lines])
def test_it_works_or_names_the_extra(told: dict[str, tuple[int, str]], line: str) -> None:
    status, text = told[line]
    words = " ".join(text.split())
    assert "bug in Racecraft" not in words, words[-2000:]
    assert "ModuleNotFoundError" not in words, words[-2000:]
    if status != 0:
        assert status == 1, words[-2000:]
        if line.startswith(ELSEWHERE):
            assert re.search(r"does not answer as a league does|No league is known", words), words[-2000:]
            return
        assert re.search(r"needs [\w-]+, which is not installed|U/u holds no tuning", words), words[-2000:]
        assert "racecraft[" in words or "U/u" in line, words[-2000:]


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_what_needs_no_extra_works(told: dict[str, tuple[int, str]]) -> None:
    """Not to be satisfied by naming extras everywhere."""
    failed = {line for line, (status, _) in told.items() if status != 0}
    needed = (
        "--algorithm sac",
        "sb3:",
        "--device cuda",
        "ladder ",
        "--frame",
        "tracks limit ",
        "tune ",
        "serve ",
        "worker ",
        "sweep Q -n r",
        "league ",
        *ELSEWHERE,
        "learn --resume R/w --watch",
        "learn ALE/",
        "lessons open 1 --folder N --no-browser",
    )
    assert [line for line in failed if not any(part in line for part in needed)] == []
