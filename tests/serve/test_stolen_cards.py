"""Who has somebody's card is out as soon as their organiser says so, whatever they did with it before."""

from __future__ import annotations

import json
import socket
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count
from typing import Any

import httpx
import pytest
from leagues import RunningLeague, ok, refused, running_league

from racecraft.serve.door.bodies import SOON

pytestmark = pytest.mark.costly

PASSWORD = "of the thief"
NUMBERS = count(1)


@pytest.fixture(scope="module")
def league(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningLeague]:
    with running_league(tmp_path_factory.mktemp("stolen") / "runs") as league:
        yield league


@dataclass
class Pupil:
    """Somebody of a class whose card is in other hands."""

    league: RunningLeague
    group: int
    id: int
    name: str
    card: str

    def by_card(self, status: int = 200) -> httpx.Client:
        client = self.league.stranger()
        ok(client.post("/api/door/card", json={"secret": self.card}), status)
        return client

    def by_password(self, password: str = PASSWORD) -> httpx.Response:
        asked = {"name": self.name, "password": password}
        return self.league.stranger().post("/api/door/sign-in", json=asked)

    def teacher(self, what: str) -> httpx.Response:
        return self.league.owner.post(f"/api/groups/{self.group}/members/{self.id}/{what}")

    @property
    def row(self) -> dict[str, object]:
        members = ok(self.league.owner.get(f"/api/groups/{self.group}"))["members"]
        return next(one for one in members if one["id"] == self.id)


@pytest.fixture
def pupil(league: RunningLeague) -> Pupil:
    name = f"Pupil {next(NUMBERS)}"
    group = league.group(f"Class of {name}")
    (card,) = ok(league.owner.post(f"/api/groups/{group}/members", json={"people": [{"name": name}]}), 201)
    return Pupil(league, group, card["id"], name, card["link"].split("#")[1])


def give_password(client: httpx.Client, password: str = PASSWORD, *, old: str = "") -> None:
    ok(client.put("/api/account/password", json={"old": old, "new": password}), 204)


def test_a_password_that_a_thief_has_set_keeps_nobody_in(pupil: Pupil) -> None:
    thief = pupil.by_card()
    give_password(thief)
    assert (pupil.row["has_password"], pupil.row["is_locked"]) == (True, False)
    ok(pupil.teacher("revoke"), 204)
    assert pupil.row["is_locked"]
    refused(thief.get("/api/account"), 401)
    pupil.by_card(401)
    assert "locked out" in refused(pupil.by_password(), 401)
    assert "that password" in refused(pupil.by_password("another password"), 401), "and it tells nobody who is"
    ok(pupil.teacher("admit"), 204)
    assert ok(pupil.by_password())["name"] == pupil.name


def test_an_admins_link_lets_the_owner_in_again(pupil: Pupil) -> None:
    give_password(pupil.by_card())
    ok(pupil.teacher("revoke"), 204)
    link = ok(pupil.league.owner.post("/api/resets", json={"person": pupil.name}), 201)["link"]
    fresh = {"secret": link.split("#")[1], "password": "of the owner"}
    ok(pupil.league.stranger().post("/api/door/reset", json=fresh))
    ok(pupil.by_password("of the owner"))
    refused(pupil.by_password(), 401)


def test_who_has_no_password_is_let_in_by_a_new_card_alone(pupil: Pupil) -> None:
    ok(pupil.teacher("revoke"), 204)
    assert not pupil.row["is_locked"]
    printed = ok(pupil.league.owner.post(f"/api/groups/{pupil.group}/cards", json={"members": [pupil.id]}), 201)
    pupil.card = printed["cards"][0]["link"].split("#")[1]
    give_password(pupil.by_card())
    ok(pupil.by_password())


def test_nobody_takes_an_account_out_of_its_organisers_hands(pupil: Pupil) -> None:
    thief = pupil.by_card()
    address = f"/api/groups/{pupil.group}/members/{pupil.id}"
    assert "came in by this group" in refused(thief.delete(address), 409)
    ok(pupil.league.owner.delete(address), 204)  # who organises it may put them out


def test_another_password_ends_the_card(pupil: Pupil) -> None:
    owner = pupil.by_card()
    give_password(owner, "of the owner")
    pupil.by_card()  # a first one is another way in beside it
    give_password(owner, "another of the owner", old="of the owner")
    pupil.by_card(401)
    ok(owner.get("/api/account"))


@pytest.mark.parametrize("end", ["revoke", "everywhere", "reset"])
def test_a_program_that_waits_is_not_let_in_later(pupil: Pupil, end: str) -> None:
    thief = pupil.by_card()
    asked = ok(thief.post("/api/door/devices"), 201)
    ok(thief.post("/api/account/devices", json={"code": asked["code"]}), 204)
    if end == "revoke":
        ok(pupil.teacher("revoke"), 204)
    elif end == "everywhere":
        ok(pupil.by_card().delete("/api/account/sessions"), 204)
    else:
        link = ok(pupil.league.owner.post("/api/resets", json={"person": pupil.name}), 201)["link"]
        fresh = {"secret": link.split("#")[1], "password": "of the owner"}
        ok(pupil.league.stranger().post("/api/door/reset", json=fresh))
    stranger = pupil.league.stranger()
    told = refused(stranger.post("/api/door/devices/token", json={"secret": asked["secret"]}), 401)
    assert "has signed out" in told


def test_who_has_a_password_gives_it_to_remove_the_account(pupil: Pupil) -> None:
    client = pupil.by_card()
    give_password(client)
    for wrong in ({}, {"password": "wrong"}):
        assert "not your password" in refused(client.request("DELETE", "/api/account", json=wrong), 422)
    assert "not your password" in refused(client.delete("/api/account"), 422)
    ok(client.request("DELETE", "/api/account", json={"password": PASSWORD}), 204)
    refused(pupil.by_password(), 401)


def test_another_organiser_locks_nobody_out(pupil: Pupil) -> None:
    other = pupil.league.organiser(f"Other {pupil.name}")
    refused(other.post(f"/api/groups/{pupil.group}/members/{pupil.id}/revoke"), 404)
    club = ok(other.post("/api/groups", json={"title": "Club"}), 201)["id"]
    code = ok(other.post(f"/api/groups/{club}/joining", json={"uses": 2}))["code"]
    member = pupil.by_card()
    ok(member.post("/api/groups/join", json={"code": code}))
    assert "another group" in refused(other.post(f"/api/groups/{club}/members/{pupil.id}/revoke"), 404)


def test_who_is_in_already_uses_no_place_up(pupil: Pupil) -> None:
    league = pupil.league
    code = ok(league.owner.post(f"/api/groups/{pupil.group}/joining", json={"uses": 2}))["code"]
    member = pupil.by_card()
    for _ in range(4):
        ok(member.post("/api/groups/join", json={"code": code}))
    assert ok(league.owner.get(f"/api/groups/{pupil.group}"))["joining"]["uses_left"] == 2
    league.join(code, f"Friend of {pupil.name}")


@pytest.mark.parametrize("path", ["/api/door/sign-in", "/api/door/card", "/api/door/join", "/api/door/reset"])
def test_strangers_say_little(league: RunningLeague, path: str) -> None:
    stranger = league.stranger()
    assert "64 kB" in refused(stranger.post(path, content=b"x" * 70_000), 413)

    def drip() -> Iterator[bytes]:  # without a length told before
        for _ in range(70):
            yield b"x" * 1000

    refused(stranger.post(path, content=drip()), 413)


class Pending:
    """A request of somebody who was let in, of which all but the end has come."""

    def __init__(self, client: httpx.Client, method: str, path: str, asked: dict[str, Any]) -> None:
        whole = json.dumps(asked).encode().rjust(2000)
        assert client.base_url.port is not None
        self._socket = socket.create_connection((client.base_url.host, client.base_url.port))
        head = client.build_request(method, path, headers={"Content-Type": "application/json", "Connection": "close"})
        lines = [f"{method} {path} HTTP/1.1", *(f"{name}: {value}" for name, value in head.headers.items())]
        lines = [line for line in lines if not line.lower().startswith("content-length")]
        self._socket.sendall("\r\n".join([*lines, f"Content-Length: {len(whole)}", "", ""]).encode() + whole[:1000])
        self._rest = whole[1000:]

    def status(self) -> int:
        """Of the answer to all of it."""
        with self._socket:
            self._socket.sendall(self._rest)
            answer = self._socket.makefile("rb").read()
        return int(answer.split()[1])


def test_a_thief_who_keeps_a_request_back_is_given_no_key_once_shut_out(pupil: Pupil) -> None:
    thief = pupil.by_card()
    token = {"title": "", "scopes": ["read"], "days": 7}
    kept_back = [
        Pending(thief, "PUT", "/api/account/password", {"old": "", "new": PASSWORD}),
        Pending(thief, "POST", "/api/account/tokens", token),
        Pending(thief, "POST", "/api/models", {"track": "oval", "until": "64 steps"}),
    ]
    time.sleep(2 * SOON)
    ok(pupil.teacher("revoke"), 204)
    assert [one.status() for one in kept_back] == [401] * 3
    assert "that password" in refused(pupil.by_password(), 401)
    assert not pupil.row["has_password"]
