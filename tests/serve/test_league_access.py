"""Every route, every role, somebody else's object: what is not yours does not exist. A new route needs a row here."""

from __future__ import annotations

from typing import Any

import httpx
import pytest
from leagues import ok, untrained_run
from running_consoles import plain_client
from schools import RACE, School, label_of

from racecraft.judging.evaluation import evaluate_run

pytestmark = pytest.mark.costly

REWARD = "def reward_function(params):\n    return 1.0\n"

ROWS: dict[str, tuple[str, Any]] = {
    # whose is what it is about, and a body that would do
    "GET /api/lessons": ("each", None),
    "GET /api/lessons/{lesson}": ("each", None),
    "GET /api/lessons/{lesson}/pictures/{picture}": ("each", None),
    "PUT /api/lessons/{lesson}/progress": ("each", {"is_read": True}),
    "GET /api/groups/{group_id}/lessons": ("organiser", None),
    "GET /api/console": ("each", None),
    "GET /api/console/machine": ("admin", None),
    "GET /api/tracks": ("each", None),
    "POST /api/tracks/validate": ("each", None),
    "POST /api/tracks/import": ("each", None),
    "GET /api/tracks/{track}": ("own", None),
    "PUT /api/tracks/{track}": ("each", None),
    "DELETE /api/tracks/{track}": ("own", None),
    "GET /api/tracks/{track}/sketch": ("own", None),
    "GET /api/tracks/{track}/route.npy": ("own", None),
    "POST /api/tracks/{track}/restore": ("own", None),
    "POST /api/drives": ("own", {"track": "adas-track"}),
    "POST /api/drives/{drive_id}/steps": ("own", {"steering": 0.0, "speed": 1.0}),
    "DELETE /api/drives/{drive_id}": ("hidden", None),
    "GET /api/ghosts": ("own", "?track=adas-track"),
    "GET /api/ghosts/{key}": ("own", "?track=oval"),
    "GET /api/rewards": ("each", None),
    "GET /api/rewards/pictures": ("each", None),
    "GET /api/actions": ("each", None),
    "POST /api/rewards/check": (
        "own",
        {"source": REWARD, "track": "adas-track"},
    ),
    "GET /api/choices": ("each", None),
    "POST /api/models/import": ("each", None),
    "GET /api/models": ("each", None),
    "POST /api/models": ("each", None),
    "POST /api/models/starters/{starter}": ("each", None),
    "GET /api/sweeps": ("each", None),
    "POST /api/sweeps": ("each", None),
    **{
        label: ("own", body)
        for label, body in {
            "GET /api/models/{name}": None,
            "GET /api/models/{name}/archive": None,
            "GET /api/models/{name}/export": None,
            "GET /api/models/{name}/export/{target}": None,
            "PATCH /api/models/{name}": {"tags": ["x"]},
            "DELETE /api/models/{name}": None,
            "POST /api/models/{name}/restore": None,
            "POST /api/models/{name}/clone": {},
            "POST /api/models/{name}/train": {},
            "POST /api/models/{name}/stop": None,
            "GET /api/models/{name}/demonstration": None,
            "GET /api/models/{name}/again": None,
            "GET /api/models/{name}/evolution": None,
            "POST /api/models/{name}/evolution": None,
            "GET /api/models/{name}/history": None,
            "GET /api/models/{name}/files/{path}": None,
            "GET /api/models/{name}/evaluations": None,
            "POST /api/models/{name}/evaluations": {},
            "GET /api/models/{name}/evaluations/{stamp}/telemetry": None,
            "GET /api/models/{name}/evaluations/{stamp}/laps": None,
            "GET /api/models/{name}/evaluations/{stamp}/share.html": None,
            "GET /api/models/{name}/evaluations/{stamp}/share.png": None,
            "GET /api/models/{name}/evaluations/{stamp}/saliency": "?lap=1&row=1",
            "GET /api/models/{name}/evaluations/{stamp}/belief": "?lap=1&row=1",
            "GET /api/models/{name}/maps": "?first=0&last=1",
            "GET /api/models/{name}/report": None,
            "GET /api/sweeps/{name}": None,
            "POST /api/sweeps/{name}/stop": None,
            "POST /api/sweeps/{name}/go-on": None,
            "DELETE /api/sweeps/{name}": None,
            "GET /api/models/{name}/tunings": None,
            "POST /api/models/{name}/tunings": {"minutes": 1},
            "GET /api/models/{name}/tunings/space": None,
            "POST /api/models/{name}/tunings/{tuning}/keep": {},
            "DELETE /api/models/{name}/tunings/{tuning}": None,
            "GET /api/races/{race_id}": None,
            "PATCH /api/races/{race_id}": {"title": "x"},
            "DELETE /api/races/{race_id}": None,
            "POST /api/races/{race_id}/restore": None,
            "POST /api/races/{race_id}/entries": {"models": ["adas-model"]},
            "DELETE /api/races/{race_id}/entries/{entry_id}": None,
            "GET /api/races/{race_id}/race.json": None,
            "GET /api/races/{race_id}/entries/{entry_id}/video": None,
            "GET /api/races/{race_id}/entries/{entry_id}/replay": None,
            "GET /api/races/{race_id}/replay": "?entries=1",
            "GET /api/contests/ghosts": "?track=adas-track",
            "GET /api/contests/{contest}": None,
            "DELETE /api/contests/{contest}": None,
            "GET /api/contests/{contest}/video": None,
            "GET /api/contests/{contest}/replay.file": None,
            "GET /api/contests/{contest}/replay": None,
            "GET /api/contests/{contest}/share.html": None,
            "GET /api/contests/{contest}/share.png": None,
            "POST /api/contests/heats": {"models": [{"model": "adas-model"}] * 2, "track": "oval"},
            "POST /api/contests/ladders": {"models": [{"model": "adas-model"}] * 2, "tracks": ["oval"]},
            "GET /api/jobs/{job_id}": None,
            "POST /api/jobs/{job_id}/cancel": None,
            "GET /api/events/{name}": None,
        }.items()
    },
    "GET /api/contests": ("each", None),
    "GET /api/races": ("each", None),
    "GET /api/races/rules": ("each", None),
    "POST /api/races": ("each", None),
    "GET /api/jobs": ("each", None),
    "GET /api/health": ("open", None),
    "GET /api/door": ("open", None),
    "POST /api/door/sign-in": ("open", {"name": "nobody", "password": "x"}),
    "POST /api/door/card": ("open", {"secret": "x"}),
    "POST /api/door/join": ("open", {"code": "x", "name": "x"}),
    "POST /api/door/reset": ("open", {"secret": "x", "password": "correct horse"}),
    "POST /api/door/devices": ("open", None),
    "POST /api/door/devices/token": ("open", {"secret": "x"}),
    "POST /api/door/provider": ("provider", None),
    "POST /api/door/provider/arrival": ("provider", {"code": "x", "state": "x"}),
    "POST /api/door/provider/newcomer": ("provider", {"name": "x"}),
    "POST /api/door/provider/sign-out": ("provider", None),
    "GET /api/account/provider": ("me", None),
    "POST /api/account/provider": ("own", None),
    "DELETE /api/account/provider": ("own", None),
    "POST /api/account/devices": ("me", {"code": "x"}),
    "POST /api/door/sign-out": ("each", None),
    "GET /api/account": ("me", None),
    "DELETE /api/account": ("me", None),
    "PATCH /api/account": ("me", None),
    "PUT /api/account/password": ("me", None),
    "GET /api/account/sessions": ("me", None),
    "DELETE /api/account/sessions": ("me", None),
    "DELETE /api/account/sessions/{session_id}": ("own", None),
    "GET /api/account/data": ("me", None),
    "GET /api/account/tokens": ("me", None),
    "POST /api/account/tokens": ("me", None),
    "DELETE /api/account/tokens/{token_id}": ("own", None),
    "GET /api/groups": ("each", None),
    "POST /api/groups": ("organisers", {"title": "x"}),
    "POST /api/groups/join": ("each", None),
    "GET /api/groups/{group_id}": ("member", None),
    "PATCH /api/groups/{group_id}": ("organiser", {"title": "x"}),
    "POST /api/groups/{group_id}/joining": ("organiser", {}),
    "DELETE /api/groups/{group_id}/joining": ("organiser", None),
    "POST /api/groups/{group_id}/members": ("organiser", {"people": [{"name": "New"}]}),
    "PATCH /api/groups/{group_id}/members/{member}": ("organiser", {"real_name": "x"}),
    "DELETE /api/groups/{group_id}/members/{member}": ("herself", None),
    "POST /api/groups/{group_id}/members/{member}/revoke": ("organiser", None),
    "POST /api/groups/{group_id}/members/{member}/admit": ("organiser", None),
    "POST /api/groups/{group_id}/cards": ("organiser", {"members": [0]}),
    "GET /api/groups/{group_id}/models": ("organiser", None),
    "POST /api/groups/{group_id}/models/copy": ("organiser", {"member": 0, "model": "adas-model"}),
    "GET /api/comments": ("each", None),
    "DELETE /api/comments/{comment_id}": ("herself", None),
    "GET /api/groups/{group_id}/comments": ("organiser", "?member={member}"),
    "POST /api/groups/{group_id}/comments": ("organiser", {"member": 0, "model": "adas-model", "text": "x"}),
    "POST /api/invitations": ("admin", {}),
    "POST /api/resets": ("admin", {"person": "Ada"}),
    "GET /api/audit": ("admin", None),
    "GET /api/quota": ("me", None),
    "GET /api/quotas": ("admin", None),
    "PUT /api/quotas": ("admin", {"models": 100}),
    "PUT /api/quotas/groups/{group_id}": ("admin", {"models": 100}),
    "GET /api/groups/{group_id}/quota": ("organiser", None),
    "PUT /api/groups/{group_id}/quota": ("organiser", {"models": 100}),
    "PUT /api/groups/{group_id}/members/{member}/quota": ("organiser", {"models": 100}),
    "GET /api/league/races": ("each", None),
    "GET /api/groups/{group_id}/season": ("member", None),
    "POST /api/groups/{group_id}/races": ("organiser", RACE),
    "PATCH /api/league/races/{cup}": ("organiser", {"title": "x"}),
    "DELETE /api/league/races/{cup}": ("organiser", None),
    "POST /api/league/races/{cup}/follow": ("organiser", {"race": 1}),
    "DELETE /api/league/races/{cup}/follow": ("organiser", None),
    "POST /api/league/races/{cup}/submissions/{submission_id}/judge": ("organiser", None),
    "POST /api/league/races/{cup}/hold": ("organiser", None),
    "GET /api/boards/{cup}/final": ("hidden", None),
    "GET /api/boards/{cup}/duels/{duel}/heats/{heat}/film": ("hidden", None),
    "GET /api/boards/{cup}/duels/{duel}/heats/{heat}/replay": ("hidden", None),
    "GET /api/boards/{cup}": ("member", None),
    "GET /api/boards/{cup}/season": ("member", None),
    "GET /api/boards/{cup}/film": ("hidden", "?submissions=1"),
    "GET /api/boards/{cup}/race.json": ("member", None),
    "GET /api/boards/{cup}/replays/{submission_id}": ("hidden", None),
    "POST /api/league/races/{cup}/submissions": ("member", "?model=x"),
    "GET /api/league/races/{cup}/submissions": ("member", None),
    "POST /api/league/races/{cup}/enter": ("own", {"model": "adas-model"}),
    "GET /api/league/races/{cup}/submissions/{submission_id}": ("own", None),
    "PATCH /api/league/races/{cup}/submissions/{submission_id}": ("organiser", {"model": "x"}),
    "POST /api/league/races/{cup}/submissions/{submission_id}/disqualify": ("organiser", {"reason": "x"}),
    "POST /api/league/races/{cup}/submissions/{submission_id}/restore": ("organiser", None),
    "POST /api/league/races/{cup}/submissions/{submission_id}/accept": ("organiser", None),
    "GET /api/workers": ("worker", None),
    "GET /api/workers/news": ("worker", None),
    "POST /api/workers/{worker}/take": (
        "worker",
        {"slot": "other", "kinds": [], "machine": "x", "places": 1, "version": "x"},
    ),
    "GET /api/workers/{worker}/job": ("worker", None),
    "POST /api/workers/{worker}/heartbeat": ("worker", {"job": "x"}),
    "POST /api/workers/{worker}/finish": ("worker", {"job": "x", "state": "done"}),
    "POST /api/workers/{worker}/release": ("worker", {"why": "asked"}),
    "GET /api/workers/{worker}/objects/{key}": ("worker", None),
    "PUT /api/workers/{worker}/objects": ("worker", None),
    "PUT /api/workers/{worker}/objects/{key}": ("worker", None),
}
MAY = {  # who may do what is theirs by role; everybody else gets 404
    "own": ("ada",),
    "each": ("ada", "bob", "teacher", "other", "eve", "owner"),
    "me": ("ada", "bob", "teacher", "other", "eve", "owner"),
    "open": ("ada", "bob", "teacher", "other", "eve", "owner"),
    "member": ("ada", "bob", "teacher"),
    "organiser": ("teacher",),
    "herself": ("ada", "teacher"),
    "organisers": ("teacher", "other", "owner"),
    "admin": ("owner",),
    "hidden": (),
    "provider": (),  # there is none here
    "worker": (),  # whoever it is, without a token for workers
}
SLIPPERY = (
    "DELETE /api/drives/{drive_id}",
    "GET /api/boards/{cup}/replays/{submission_id}",
    "GET /api/boards/{cup}/film",
)
"""To get out of a car that is not there is no error; what was driven in a race that is on nobody sees."""


POWER: dict[str, Any] = {  # over a racer, of the group by which she came in alone; how, and a body that would do
    "POST /api/groups/{group_id}/cards": {"members": [0]},
    "PATCH /api/groups/{group_id}/members/{member}": {"name": "Rude"},
    "PUT /api/groups/{group_id}/members/{member}/quota": {"models": 100},
    "POST /api/groups/{group_id}/members/{member}/admit": None,
    "POST /api/groups/{group_id}/members/{member}/revoke": None,
    "POST /api/groups/{group_id}/models/copy": {"member": 0, "model": "adas-model"},
    "POST /api/groups/{group_id}/comments": {"member": 0, "model": "adas-model", "text": "x"},
}


def request(school: School, client: httpx.Client, label: str, **other: Any) -> httpx.Response:
    """Ask for what Ada has, but for what is told to be another thing."""
    method, path = label.split()
    body = other.pop("body", ROWS[label][1])
    objects = {**school.objects, **other}
    if isinstance(body, dict):
        body = {**body}
        body |= {"members": [school.objects["member"]]} if "members" in body else {}
        body |= {"member": school.objects["member"]} if "member" in body else {}
    query = body.format(**objects) if isinstance(body, str) else ""
    json = body if isinstance(body, dict) else None
    with client.stream(method, path.format(**objects) + query, json=json) as reply:
        if not reply.headers.get("content-type", "").startswith("text/event-stream"):
            reply.read()
        return reply


def test_every_route_has_a_row(school: School) -> None:
    paths = ok(school.league.owner.get("/api/openapi.json"))["paths"]
    operations = {label_of(f"{method.upper()} {path}") for path, item in paths.items() for method in item}
    assert operations == set(ROWS)


def test_what_is_not_yours_does_not_exist(school: School) -> None:
    found = {}
    for label, (kind, _) in ROWS.items():
        for role, client in school.people.items():
            if label in SLIPPERY or role in MAY[kind]:
                continue
            reply = request(school, client, label)
            if reply.status_code != 404:
                found[f"{role}: {label}"] = (reply.status_code, reply.text[:200])
    assert found == {}


def test_who_may_look_can_and_sees_nothing_of_others(school: School) -> None:
    found = {}
    for label, (kind, _) in ROWS.items():
        for role in MAY[kind]:
            if not label.startswith("GET") or kind == "own":
                continue
            reply = request(school, school.people[role], label)
            is_related = role in ("ada", "bob", "teacher") or label == "GET /api/audit"  # of what all do
            if reply.status_code not in (200, 204) or (not is_related and "adas-" in reply.text):
                found[f"{role}: {label}"] = (reply.status_code, reply.text[:200])
    assert found == {}


def test_what_is_hers_ada_finds(school: School) -> None:
    """So that the 404s above are about whose it is."""
    for label in (
        "GET /api/models/{name}",
        "GET /api/tracks/{track}",
        "GET /api/jobs/{job_id}",
        "GET /api/races/{race_id}",
        "GET /api/contests/{contest}",
        "GET /api/models/{name}/history",
        "GET /api/league/races/{cup}/submissions/{submission_id}",
        "GET /api/events/{name}",
    ):
        assert request(school, school.people["ada"], label).status_code == 200, label


def test_nobody_haunts_a_heat_with_what_anothers_model_drove(school: School) -> None:
    people = school.league.console.runs / ".racecraft" / "people"
    homes = {who: people / str(school.league.number(school.people[who])) for who in ("ada", "bob")}
    evaluate_run(homes["ada"] / "adas-model", laps=1, num_trials=1, max_resets=0, video=False)
    (evaluation,) = ok(school.people["ada"].get("/api/contests/ghosts?track=oval"))
    ghost = {name: evaluation[name] for name in ("model", "evaluation")}
    untrained_run(homes["bob"], "bobs-model")
    assert ok(school.people["bob"].get("/api/contests/ghosts?track=oval")) == []
    heats = {
        who: school.people[who].post(
            "/api/contests/heats",
            json={"models": [{"model": f"{who}s-model"}] * 2, "track": "oval", "max_resets": 0, "ghosts": [ghost]},
        )
        for who in homes
    }
    assert heats["ada"].status_code == 202
    assert (heats["bob"].status_code, heats["bob"].json()["error"]["message"]) == (
        404,
        "There is no model 'adas-model'.",
    )


def test_strangers_are_sent_to_the_door(school: School) -> None:
    with school.league.stranger() as stranger:
        for label, (kind, _) in ROWS.items():
            status = request(school, stranger, label).status_code
            is_board = label.startswith("GET /api/boards/")
            expected = (200, 201, 204, 401) if kind == "open" else (404,) if is_board or kind == "provider" else (401,)
            assert status in expected, (label, status)


def test_a_token_to_read_changes_nothing(school: School) -> None:
    secret = ok(school.people["ada"].post("/api/account/tokens", json={"scopes": ["read"]}), 201)["secret"]
    with plain_client(school.league.owner.base_url, headers={"authorization": f"Bearer {secret}"}) as program:
        for label in ROWS:
            status = request(school, program, label).status_code
            may = label.startswith("GET") and not label.startswith(("GET /api/account", "GET /api/workers"))
            assert (status != 403) == may, (label, status)


def test_a_group_cannot_be_looked_into_by_who_organises_another(school: School) -> None:
    for role in ("other", "eve", "bob", "owner"):
        for label, (kind, _) in ROWS.items():
            if label.startswith("GET") and kind == "own" and "account" not in label and "league" not in label:
                path = label.split()[1].format(**school.objects) + f"?of={school.objects['member']}"
                assert school.people[role].get(path).status_code == 404, (role, label)
    looked = school.people["teacher"].get(f"/api/models/adas-model?of={school.objects['member']}")
    assert looked.status_code == 200


def test_who_organises_another_group_of_hers_has_no_power_over_her(school: School) -> None:
    """Ada came in by the teacher's group, and joined the other's with the account that she has."""
    other, elsewhere = school.people["other"], school.objects["elsewhere"]
    for label, body in POWER.items():
        reply = request(school, other, label, group_id=elsewhere, body=body)
        assert (reply.status_code, "by another group" in reply.text) == (404, True), (label, reply.text)
    found = ok(other.get(f"/api/groups/{elsewhere}"))["members"]
    assert {member["name"]: member["is_home"] for member in found} == {"Other": False, "Ada": False, "Eve": True}
    assert [one["name"] for one in ok(other.get(f"/api/groups/{elsewhere}/models"))] == ["Eve"]
    both = {"members": [member["id"] for member in found if member["role"] == "racer"]}
    printed = ok(other.post(f"/api/groups/{elsewhere}/cards", json=both), 201)
    assert ([card["name"] for card in printed["cards"]], printed["left_out"]) == (["Eve"], ["Ada"])
    real_name = {"real_name": "Augusta"}
    label = "PATCH /api/groups/{group_id}/members/{member}"
    assert request(school, other, label, group_id=elsewhere, body=real_name).status_code == 204
    assert "Augusta" not in school.people["teacher"].get(f"/api/groups/{school.objects['group_id']}").text
    card = {"members": [school.objects["member"]]}
    ok(school.people["teacher"].post(f"/api/groups/{school.objects['group_id']}/cards", json=card), 201)
