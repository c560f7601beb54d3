"""The manifest of workers for Kubernetes, looked through without a cluster: its parts fit, and its command is ours."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.main import get_command

from racecraft.cli.entry import every_verb
from racecraft.serve.jobs.supervisor import GRACE

DEPLOY = Path(__file__).parents[2] / "deploy"


@pytest.fixture(scope="module")
def deployment() -> dict[str, Any]:
    (document,) = yaml.safe_load_all((DEPLOY / "workers.yaml").read_text(encoding="utf-8"))
    assert (document["apiVersion"], document["kind"]) == ("apps/v1", "Deployment")
    found: dict[str, Any] = document["spec"]
    return found


def test_what_it_starts_is_a_worker_of_the_image(deployment: dict[str, Any]) -> None:
    (container,) = deployment["template"]["spec"]["containers"]
    program, verb = container["command"]
    assert program in (DEPLOY / "Containerfile").read_text()
    worker = get_command(every_verb()).commands[verb]  # type: ignore[attr-defined]
    options = worker.make_context(verb, list(container["args"])).params
    assert (options["trainings"], options["others"], options["machine"]) == (1, 1, "$(POD)")
    assert container["env"][0]["name"] == "POD"
    assert str(options["runs"]).startswith(container["volumeMounts"][0]["mountPath"])
    assert options["server"] == "https://racing.example.org"
    assert not options["database"]
    text = (DEPLOY / "workers.yaml").read_text()
    made = re.search(r"#   racecraft (.+?) > (\w+) .* --from-file=(\w+)\n", text)
    assert made is not None
    assert made[2] == made[3] == Path(options["token_file"]).name
    league, name, *rest = made[1].split()
    maker = get_command(every_verb()).commands[league].commands[name]  # type: ignore[attr-defined]
    assert maker.make_context(name, rest).params["title"] == "kubernetes"


def test_its_parts_belong_together(deployment: dict[str, Any]) -> None:
    pod = deployment["template"]["spec"]
    assert deployment["selector"]["matchLabels"].items() <= deployment["template"]["metadata"]["labels"].items()
    assert pod["terminationGracePeriodSeconds"] > GRACE  # a training saves itself first
    (container,) = pod["containers"]
    assert {one["name"] for one in container["volumeMounts"]} == {one["name"] for one in pod["volumes"]}
    assert container["securityContext"]["readOnlyRootFilesystem"]  # all that is written lies on a volume
    (secret,) = (one for one in pod["volumes"] if "secret" in one)
    text = (DEPLOY / "workers.yaml").read_text()
    assert f"create secret generic {secret['secret']['secretName']} " in text
    (place,) = (one["mountPath"] for one in container["volumeMounts"] if one["name"] == secret["name"])
    assert f"--token-file={place}/token" in container["args"]
    assert pod["securityContext"]["fsGroup"]  # who may read it
    assert "rc_" not in text  # no secret in the file
