"""Requests of every kind that the API's own description allows, and many that it does not: none breaks the server."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from running_consoles import RunningConsole

pytestmark = pytest.mark.costly

DOCUMENT = json.loads((Path(__file__).parents[2] / "web" / "openapi.json").read_text())
OPERATIONS = [f"{method.upper()} {path}" for path, item in DOCUMENT["paths"].items() for method in item]
EXAMPLES = 14
NASTY = ["\0", "%00", "..", "a\udc80b".encode("utf-8", "surrogatepass").decode("latin-1"), "𝓂", "'; drop table jobs;--"]


@pytest.fixture(scope="module")
def operations() -> dict[str, Any]:
    schemathesis = pytest.importorskip("schemathesis")
    schema = schemathesis.openapi.from_dict(DOCUMENT)
    schema.config.max_stream_events = 1  # the stream of a model that there is never ends
    found = [one.ok() for one in schema.get_all_operations()]
    return {operation.label: operation for operation in found}


@pytest.mark.slow
def test_every_operation_is_tried(operations: dict[str, Any]) -> None:
    assert list(operations) == OPERATIONS


@pytest.mark.slow
@pytest.mark.parametrize("label", OPERATIONS)
def test_no_request_breaks_the_server(console: RunningConsole, operations: dict[str, Any], label: str) -> None:
    from requests import Session
    from schemathesis import GenerationMode

    operation = operations[label]
    if console.client.get("/api/models/fuzzed").status_code == 404:
        console.create(name="fuzzed", train=False, track="oval", until="512 steps")  # when it is told to train
    modes = [operation.as_strategy(generation_mode=mode) for mode in GenerationMode]
    cookie = f"racecraft_session={console.client.cookies['racecraft_session']}"
    base = str(console.client.base_url).rstrip("/")

    @settings(
        max_examples=EXAMPLES,
        deadline=None,
        database=None,
        derandomize=True,
        suppress_health_check=list(HealthCheck),
        phases=[Phase.generate],
    )
    @given(case=st.one_of(modes), name=st.sampled_from(["fuzzed", "", *NASTY]))
    def attempt(case: Any, name: str) -> None:
        if name and "name" in (case.path_parameters or {}):
            case.path_parameters["name"] = name
        if operation.label == "POST /api/models" and isinstance(case.body, dict):
            case.body["train"] = False
        reply = case.call(base_url=base, headers={"Cookie": cookie}, timeout=60, session=session)
        assert reply.status_code < 500, reply.text
        if reply.status_code >= 400:
            assert set(reply.json()) == {"error"}, reply.text
            assert {"code", "message", "hint"} <= set(reply.json()["error"])

    with Session() as session:
        attempt()
    for job in console.client.get("/api/jobs").json():  # what was asked for is tried elsewhere
        if job["state"] in ("queued", "running"):
            console.client.post(f"/api/jobs/{job['id']}/cancel")
    assert console.process.poll() is None
    assert console.client.get("/api/console").status_code == 200


HOSTILE = [*NASTY, "../../etc/passwd", "..%2f..%2fetc", "%2e%2e", "a" * 5000, ".racecraft", "con", "\r\nX: y", "~"]


@pytest.mark.parametrize("name", HOSTILE, ids=lambda name: ascii(name)[:20])
def test_hostile_names_get_the_one_shape(console: RunningConsole, name: str) -> None:
    client = console.client
    for path in ("", "/history", "/archive", "/files/metrics/x.json", "/evaluations", "/evaluations/x/telemetry"):
        for quoted in (quote(name, safe=""), quote(name)):
            reply = client.get(f"/api/models/{quoted}{path}", follow_redirects=False)
            assert "root:" not in reply.text
            if reply.status_code not in (200, 307):  # the client has taken the dots out of the address itself
                assert reply.status_code in (404, 405), (quoted, path)
                assert set(reply.json()) == {"error"}
    assert client.get("/api/jobs", params={"run": name}).status_code in (200, 422)
    for kind in ("jobs", "tracks"):
        reply = client.get(f"/api/{kind}/{quote(name, safe='')}")
        assert reply.status_code in (404, 422)
        assert set(reply.json()) == {"error"}


@pytest.mark.parametrize("name", ["generated:0..99999999", "generated:", "generated:x", "generated:9" + "9" * 400])
def test_a_name_cannot_ask_for_endless_work(console: RunningConsole, name: str) -> None:
    reply = console.client.get(f"/api/tracks/{quote(name)}", timeout=60)
    assert reply.status_code in (404, 422), reply.text[:200]
    assert set(reply.json()) == {"error"}
