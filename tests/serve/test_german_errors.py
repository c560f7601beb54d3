"""What the server says, in the pages' other language: all of it, and nothing that it no longer says."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "src/racecraft"
GERMAN = ROOT / "web/src/i18n/de/errors.json"

PLACES = (
    *("serve", "reward/aside.py", "reward/check.py", "reward/imports.py", "reward/worker_process.py", "checks.py"),
    "track/validate.py",
    *("track/sketch.py", "track/readers.py", "track/generator.py"),
    *("agent/model_metadata.py", "agent/metadata_file.py", "agent/hyperparameters.py"),
    *("car/command.py", "car/metadata.py", "car/evaluation.py"),
    *("importing", "sim/objects.py", "training/stop.py", "training/parent.py", "training/start.py"),
    *("training/settings.py", "learn/ppo.py", "learn/sac.py", "learn/distill.py", "learn/saliency.py"),
    *("run/checkpoint.py", "run/folder.py", "run/lock.py", "run/stretches.py"),
    *("race/entry.py", "race/entry_file.py", "race/policy.py", "race/rules.py", "contest", "film"),
    *("judging/trained.py", "judging/evaluation.py", "judging/demonstration.py"),
    *("replay", "json_file.py", "analysis/share.py", "run/simtrace.py", "run/metrics.py", "run/judged.py"),
    *("run/training_params.py", "sim/randomization.py", "sim/vehicle.py", "sim/parameter_file.py"),
    *("reward/sandbox/confinement.py", "sweeping/plan.py", "tuning/space.py", "tuning/start.py"),
)
"""Where errors come from that a page shows."""
OPERATORS = (
    *(
        "serve/store",
        "serve/settings.py",
        "serve/provider_settings.py",
        "serve/backup.py",
        "serve/worker.py",
        "serve/__init__.py",
        "serve/station.py",
    ),
    "serve/server.py",
    *("importing/history.py", "importing/own.py", "serve/jobs/bench.py", "serve/jobs/line.py"),
    "serve/jobs/parcel.py",
    *("film/limit_picture.py", "film/replay_film.py", "film/av1.py"),
)
"""Where they come from that only terminals and logs show, or that quote others."""
REPORTS = (
    *("importing/importer.py", "importing/job.py", "importing/drfc.py", "importing/env_file.py", "importing/own.py"),
    *("importing/report.py", "importing/weights.py", "importing/model_files.py"),
    *("agent/hyperparameters.py", "agent/metadata_file.py", "agent/model_metadata.py", "agent/aws_file.py"),
    "car/metadata.py",
    *("training/plan.py", "training/parent.py"),
)
"""Where what a page tells of an import, of a car, or of what a training begins with, comes from."""
TOLD = {"used", "unused", "becomes", "without_effect", "NO_EFFECT", "ELSEWHERE", "RACES", "_WHY", "_WHY_MISNAMED"}
"""What such a file calls its tables of these."""
PLAIN = re.compile(
    r"(Value|Type|Key|Attribute|Assertion|Runtime|OS|Stop)\w*|HTTPException|SystemExit|BadParameter|NoAnswer"
)


def sentence(node: ast.expr) -> str | None:
    """A text of the source, with ``{}`` for what is filled in; None for what is put together elsewhere."""
    match node:
        case ast.Constant(value=str(text)):
            return text
        case ast.JoinedStr(values=parts):
            return "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in parts)
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            sides = sentence(left), sentence(right)
            return None if None in sides else f"{sides[0]}{sides[1]}"
    return None


def named_in(call: ast.Call) -> ast.JoinedStr | None:
    """What a check calls the setting that it refuses, where that is words and a name: ``Vehicle parameter {}``."""
    match call:
        case ast.Call(func=ast.Name(id=check), args=[ast.JoinedStr(values=[ast.Constant(), *_]) as name, *_]):
            return name if check == "require" or check.startswith("check_") else None
    return None


def said_in(path: Path) -> Iterator[str]:
    """The errors and hints of one file."""
    for node in ast.walk(ast.parse(path.read_text())):
        texts: list[ast.expr] = []
        if isinstance(node, ast.Raise) and isinstance(call := node.exc, ast.Call):
            name = call.func.id if isinstance(call.func, ast.Name) else getattr(call.func, "attr", "")
            if not PLAIN.fullmatch(name):
                texts = call.args[:1] + [word.value for word in call.keywords if word.arg == "hint"]
        elif isinstance(node, ast.Call) and (named := named_in(node)):
            texts = [named]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            places = {"problem": slice(2, 4), "Problem": slice(2, 4), "_at": slice(1, 3)}
            texts = node.args[places[node.func.id]] if node.func.id in places else []
        elif isinstance(node, ast.Yield) and isinstance(node.value, ast.Tuple):
            texts = node.value.elts[1:3]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "refuse":
            parts = [node.args[0].body, node.args[0].orelse] if isinstance(node.args[0], ast.IfExp) else node.args[:1]
            yield from (f"{{}} {sentence(part)}." for part in parts)
        for text in filter(None, map(sentence, texts)):
            if text.strip("{}.; is") and text not in ("error", "warning"):
                yield text


def allowed_in(path: Path) -> Iterator[str]:
    """What the fields of one of AWS's files may be, with gaps for numbers; two numbers alone are in the sentence."""
    for node in ast.walk(ast.parse(path.read_text())):
        match node:
            case ast.Call(func=ast.Name(id="Field"), keywords=words):
                texts = filter(None, (sentence(word.value) for word in words if word.arg == "description"))
                gaps = (re.sub(r"\d[\d.]*", "{}", text) for text in texts)
                yield from (text for text in gaps if text.strip("{}' ") != "to")


def name_of(node: ast.expr) -> str:
    """Of a variable, an attribute, or of the table that something is an entry of."""
    match node:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name
        case ast.Subscript(value=table):
            return name_of(table)
    return ""


def told_in(path: Path) -> Iterator[str]:
    """The notes of one file, and what its tables say became of something."""
    for node in ast.walk(ast.parse(path.read_text())):
        texts: list[ast.expr] = []
        pairs: list[tuple[ast.expr, ast.expr]] = []
        match node:
            case ast.Call(func=ast.Attribute(attr="append", value=told), args=[text]) if name_of(told) == "notes":
                texts = [text]
            case ast.Assign(targets=[ast.Tuple(elts=names)], value=ast.Tuple(elts=values)):
                pairs = list(zip(names, values, strict=True))
            case ast.Assign(targets=[told], value=value) | ast.AnnAssign(target=told, value=ast.expr() as value):
                pairs = [(told, value)]
        for told, value in pairs:
            if name_of(told) in TOLD:
                texts += value.values if isinstance(value, ast.Dict) else [value]
        for text in texts:
            parts = [text.body, text.orelse] if isinstance(text, ast.IfExp) else [text]
            yield from (said for said in map(sentence, parts) if said and re.search("[a-z] [a-z]", said))


def files() -> list[Path]:
    found = [path for place in PLACES for path in (SOURCES / place).rglob("*.py") or [SOURCES / place]]
    found += [SOURCES / place for place in PLACES if place.endswith(".py")]
    left = tuple(str(SOURCES / place) for place in OPERATORS)
    return [path for path in found if not str(path).startswith(left)]


def test_every_error_that_a_page_can_show_is_said_in_german() -> None:
    german = json.loads(GERMAN.read_text())
    said = {text: path for path in files() for text in said_in(path)}
    assert len(said) > 300
    told = {text: SOURCES / place for place in REPORTS for text in told_in(SOURCES / place)}
    assert len(told) > 60
    allowed = {text: SOURCES / place for place in REPORTS for text in allowed_in(SOURCES / place)}
    assert len(allowed) > 20
    said.update(told | allowed)
    missing = [f"{path.relative_to(ROOT)}: {text}" for text, path in sorted(said.items()) if text not in german]
    assert missing == []


def test_what_is_filled_in_is_filled_in_there_too() -> None:
    for english, german in json.loads(GERMAN.read_text()).items():
        gaps, count = re.findall(r"\{(\d*)\}", german), english.count("{}")
        assert sorted(gaps) in ([""] * count, [str(place) for place in range(count)]), english
        assert german.strip()


@pytest.mark.costly
def test_nothing_is_translated_that_nobody_says() -> None:
    """What stands between the gaps stands in the sources, if it is not put together of pieces or Pydantic's."""
    trees = [ast.parse(path.read_text()) for path in SOURCES.rglob("*.py")]
    nodes = (node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.expr))
    spoken = "\n".join(text for node in nodes if (text := sentence(node)))
    put_together = re.compile(
        r"\{\}: .*|(You have|All the) .* (used up|more)\.|\{\} is (\{\}|missing); .*|did not (load|return).*"
    )
    for english in json.loads(GERMAN.read_text()):
        if not put_together.fullmatch(english):
            assert max(english.split("{}"), key=len).strip(" .,") in spoken, english
