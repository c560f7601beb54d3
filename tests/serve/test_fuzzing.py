"""Requests of every kind that the API's own description allows, and many that it does not: none breaks the server."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from httpx import Client
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from leagues import ok
from running_consoles import RunningConsole
from schools import School, label_of

pytestmark = pytest.mark.costly

DOCUMENT = json.loads((Path(__file__).parents[2] / "web" / "openapi.json").read_text())
EXAMPLES = {"owner": 3, "teacher": 4, "ada": 5, "nobody": 1}
"""Requests of an admin, an organiser, a racer, and who is not signed in."""
ENDINGS = ("/api/door/sign-out", "/api/account")
"""After these she who asked may be somebody else, or gone."""
NASTY = ["\0", "%00", "..", "a\udc80b".encode("utf-8", "surrogatepass").decode("latin-1"), "𝓂", "'; drop table jobs;--"]


def _order(label: str) -> tuple[bool, bool]:
    """What looks comes before what removes, or little would be left to look at."""
    method, path = label.split()
    return path.startswith(ENDINGS) and method != "GET", method == "DELETE"


LABELS = [f"{method.upper()} {path}" for path, item in DOCUMENT["paths"].items() for method in item]
OPERATIONS = sorted(LABELS, key=_order)


@pytest.fixture(scope="module")
def operations() -> dict[str, Any]:
    schemathesis = pytest.importorskip("schemathesis")
    schema = schemathesis.openapi.from_dict(DOCUMENT)
    schema.config.max_stream_events = 1  # the stream of a model that there is never ends
    found = [one.ok() for one in schema.get_all_operations()]
    return {operation.label: operation for operation in found}


@pytest.mark.slow
def test_every_operation_is_tried(operations: dict[str, Any]) -> None:
    assert set(operations) == set(OPERATIONS)


@pytest.mark.slow
@pytest.mark.parametrize("label", OPERATIONS)
def test_no_request_of_anybody_breaks_the_server(school: School, operations: dict[str, Any], label: str) -> None:
    from requests import Session
    from schemathesis import GenerationMode

    operation, console = operations[label], school.league.console
    modes = [operation.as_strategy(generation_mode=mode) for mode in GenerationMode]
    base = str(console.client.base_url).rstrip("/")
    hers = {name: school.objects[ours] for name, ours in ids_of(label).items()}

    def attempts(key: str, examples: int) -> Callable[[], None]:
        @settings(
            max_examples=examples,
            deadline=None,
            database=None,
            derandomize=True,
            suppress_health_check=list(HealthCheck),
            phases=[Phase.generate],
        )
        @given(
            case=st.one_of(modes),
            named=st.sampled_from(["hers", "hers", "hers", "nasty", "any"]),
            text=st.sampled_from(NASTY),
        )
        def attempt(case: Any, named: str, text: str) -> None:
            for name in case.path_parameters or {}:
                if named == "hers":
                    case.path_parameters[name] = hers[name]
                elif named == "nasty" and isinstance(hers[name], str):
                    case.path_parameters[name] = text
            if isinstance(case.body, dict) and "train" in case.body:
                case.body["train"] = False
            reply = case.call(
                base_url=base, headers={"Cookie": f"racecraft_session={key}"}, timeout=60, session=session
            )
            assert reply.status_code < 500, reply.text
            if reply.status_code >= 400:
                assert set(reply.json()) == {"error"}, reply.text
                assert {"code", "message", "hint"} <= set(reply.json()["error"])

        return attempt

    with Session() as session:
        for who, examples in EXAMPLES.items():
            attempts(key_of(school, who), examples)()
            if who in school.people:
                cancel_jobs(school.people[who])
    assert console.process.poll() is None
    assert console.client.get("/api/health").status_code == 204


def cancel_jobs(client: Client) -> None:
    """Of somebody, who may be gone by now: what a job does is tried elsewhere."""
    jobs = client.get("/api/jobs")
    for job in jobs.json() if jobs.status_code == 200 else []:
        if job["state"] in ("queued", "running"):
            client.post(f"/api/jobs/{job['id']}/cancel")


def key_of(school: School, who: str) -> str:
    """The session's key of somebody; Ada, whom an earlier request may have sent out, comes back with a new card."""
    if who == "nobody":
        return ""
    client = school.people[who]
    if who == "ada" and client.get("/api/account").status_code == 401:
        wanted = {"members": [school.objects["member"]]}
        printed = school.people["teacher"].post(f"/api/groups/{school.objects['group_id']}/cards", json=wanted)
        if printed.status_code == 201:
            client = school.people["ada"] = school.league.stranger()
            ok(client.post("/api/door/card", json={"secret": printed.json()["cards"][0]["link"].split("#")[1]}))
    return str(client.cookies.get("racecraft_session", ""))


def ids_of(label: str) -> dict[str, str]:
    """The names in an address, each with the kind of thing that it names."""
    return dict(zip(re.findall(r"{(\w+)}", label), re.findall(r"{(\w+)}", label_of(label)), strict=True))


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


@pytest.mark.parametrize("length", [300, 5000])
def test_what_no_disk_has_a_name_for_is_not_there(console: RunningConsole, length: int) -> None:
    name = console.create(name=f"long-{length}", track="oval", train=False)
    stamp, file = "1" * length, f"evaluation-1/{'a' * length}.json"
    rooms = [f"/evaluations/{stamp}{room}" for room in ("/telemetry", "/laps", "/share.html", "/share.png")]
    paths = [f"/api/models/{name}{room}" for room in (f"/files/{file}", *rooms)]
    for path in (*paths, f"/assets/{'a' * length}.js"):
        reply = console.client.get(path)
        assert reply.status_code == 404, path[:60]
        assert set(reply.json()) == {"error"}


@pytest.mark.parametrize("name", ["generated:0..99999999", "generated:", "generated:x", "generated:9" + "9" * 400])
def test_a_name_cannot_ask_for_endless_work(console: RunningConsole, name: str) -> None:
    reply = console.client.get(f"/api/tracks/{quote(name)}", timeout=60)
    assert reply.status_code in (404, 422), reply.text[:200]
    assert set(reply.json()) == {"error"}
