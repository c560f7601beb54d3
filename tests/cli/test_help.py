"""What every verb says about itself, and how little it loads to say it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import Run

from racecraft import __version__, _native
from racecraft.training import settings as training_settings

VERBS = (
    "train",
    "import",
    "evaluate",
    "race",
    "ladder",
    "login",
    "races",
    "submit",
    "film",
    "verify",
    "report",
    "perceive",
    "tracks",
    "tracks show",
    "tracks sheet",
    "tracks limit",
    "reward",
    "reward check",
    "reward list",
    "reward show",
    "tune",
    "learn",
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
    assert "..." not in re.sub(
        r"(ARGS\]|TRACKS\]|MODELS\}?|logs[\]}]?|sources\]?)\.\.\.", "", outcome.out
    )  # nothing is cut
    assert racecraft(*verb.split(), "-h").out == outcome.out


def test_the_version(racecraft: Run) -> None:
    assert racecraft("--version") == (0, f"{__version__}\n", "")


def test_the_build(racecraft: Run) -> None:
    build = racecraft("--version", "--json").document
    assert build["version"] == __version__
    assert build["instruction_sets"] == _native.available_isas()
    assert build["instruction_set"] in build["instruction_sets"]
    if (Path(__file__).parents[2] / ".git").exists():
        assert re.fullmatch(r"[0-9a-f]{40}", build["commit"])
    assert re.match(r"(GCC|.*[Cc]lang) \d", build["compiler"])


def test_without_a_verb_it_shows_the_help(racecraft: Run) -> None:
    outcome = racecraft()
    assert outcome.status == 2
    assert "Commands:" in outcome.out + outcome.err
    as_json = racecraft("--json")
    assert as_json.status == 2
    error = {"code": "UsageError", "message": "Missing command.", "hint": "See 'racecraft --help'."}
    assert as_json.document == {"error": error}


def test_the_defaults_in_the_help_are_those_of_the_settings() -> None:
    import inspect

    from racecraft import train
    from racecraft.cli.train import train as typed
    from racecraft.training.regimes import TIME_TRIAL

    shown = {name: parameter.default for name, parameter in inspect.signature(typed).parameters.items()}
    public = {name: parameter.default for name, parameter in inspect.signature(train).parameters.items()}
    settings = training_settings.TrainSettings()
    assert shown["track"] == [settings.track] == [training_settings.DEFAULT_TRACK]
    for name in ("reward", "actions", "until", "sensors", "critic"):
        assert not shown[name]  # as the race has it
        assert not public.get(name)
    assert TIME_TRIAL.until == str(settings.until)
    for name in ("direction", "evaluate_every", "num_threads", "seed"):
        assert shown[name] == getattr(settings, name)


HEAVY = ("torch", "gymnasium", "scipy", "shapely", "PIL", "av", "tensorboard", "pydantic", "importlib.metadata")


@pytest.mark.costly
@pytest.mark.parametrize(
    ("arguments", "absent"),
    [
        (["--help"], (*HEAVY, "numpy", "rich", "racecraft._native")),
        (["train", "--help"], (*HEAVY, "numpy", "rich", "racecraft._native")),
        (["learn", "--help"], (*HEAVY, "numpy", "rich", "racecraft._native")),
        (["--version"], (*HEAVY, "numpy", "rich", "racecraft._native")),
        (
            ["train", "--track", "oval", "--until", "1 steps", "--num-envs", "2", "--json"],
            (*HEAVY, "casadi", "fastapi", "numba", "rich", "yaml", "email", "racecraft.cli.serve"),
        ),
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
