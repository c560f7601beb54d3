"""A league whose people come in through a real, certified provider, without browsers."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from identity_providers import (
    CLIENT,
    SECRET,
    identity_provider,
    needs_identity_provider,
    sign_in_there,
    sign_out_there,
)
from leagues import RunningLeague, ok, refused, running_league
from running_consoles import plain_client

pytestmark = [pytest.mark.costly, needs_identity_provider]

NAME = "Hill School"


@pytest.fixture(scope="module")
def league(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningLeague]:
    folder = tmp_path_factory.mktemp("school")
    with identity_provider() as issuer, running_league(folder / "runs", *options(issuer, folder)) as league:
        assert league.group("Class 7b") == 1
        yield league


def options(issuer: str, folder: Path) -> list[str]:
    """Of a league that takes who has an address of the school and is a pupil, into group 1."""
    secret = folder / "provider.secret"
    secret.write_text(f"{SECRET}\n")
    told = {"": issuer, "-client": CLIENT, "-secret-file": secret, "-name": NAME, "-group": 1}
    told |= {"-domain": "school.example", "-claim": "groups=pupils"}
    return [str(part) for name, value in told.items() for part in (f"--provider{name}", value)]


def come(client: httpx.Client, name: str, *, browser: httpx.Client | None = None) -> httpx.Response:
    """There and back."""
    answer = sign_in_there(ok(client.post("/api/door/provider"))["to"], name, browser=browser)
    return client.post("/api/door/provider/arrival", json=answer)


def newcomer(league: RunningLeague, name: str, chosen: str) -> httpx.Client:
    client = league.stranger()
    assert ok(come(client, name)) == {"me": None, "is_linked": False}
    assert ok(client.post("/api/door/provider/newcomer", json={"name": chosen}), 201)["name"] == chosen
    return client


def member(league: RunningLeague, name: str) -> dict[str, Any]:
    return next(one for one in ok(league.owner.get("/api/groups/1"))["members"] if one["name"] == name)


def test_somebody_new_chooses_a_name_and_comes_again(league: RunningLeague) -> None:
    stranger = league.stranger()
    assert ok(stranger.get("/api/door"))["provider"] == NAME
    ok(come(stranger, "ada"))
    taken = league.join(league.code(1), "Comet")
    assert "looks like one that is" in refused(
        stranger.post("/api/door/provider/newcomer", json={"name": "Comet"}), 409
    )
    ok(stranger.post("/api/door/provider/newcomer", json={"name": "Rocket"}), 201)
    assert "is over" in refused(stranger.post("/api/door/provider/newcomer", json={"name": "Rocket 2"}), 401)
    found = member(league, "Rocket")
    assert (found["real_name"], found["comes_by_provider"], found["has_card"]) == ("ada of the school", True, False)
    theirs = ok(taken.get("/api/groups/1"))["members"]
    assert not any(one["real_name"] or one["comes_by_provider"] for one in theirs), "only organisers see that"
    again = league.stranger()
    assert ok(come(again, "ada"))["me"]["name"] == "Rocket"
    assert league.number(again) == league.number(stranger)
    kept = ok(again.get("/api/account/data"))["identities"]
    assert [one["subject"] for one in kept] == ["ada"]
    assert "school.example" not in again.get("/api/account/data").text, "no address is kept"


def test_who_is_not_wanted_stays_outside(league: RunningLeague) -> None:
    client = league.stranger()
    assert "lets in" in refused(come(client, "eve-elsewhere"), 401)
    refused(client.post("/api/door/provider/newcomer", json={"name": "Eve"}), 401)
    answer = sign_in_there(ok(client.post("/api/door/provider"))["to"], "bob")
    with league.stranger() as another:  # who has the answer, and not the browser
        ok(another.post("/api/door/provider"))
        assert "another browser" in refused(another.post("/api/door/provider/arrival", json=answer), 401)
    ok(client.post("/api/door/provider/arrival", json=answer))
    assert "used already" in refused(client.post("/api/door/provider/arrival", json=answer), 401)
    forged = {**answer, "iss": "https://elsewhere.example"}
    answer = sign_in_there(ok(client.post("/api/door/provider"))["to"], "bob")
    assert "another provider" in refused(
        client.post("/api/door/provider/arrival", json={**forged, "state": answer["state"]}), 401
    )


def test_an_organiser_locks_out_and_lets_in_again(league: RunningLeague) -> None:
    pupil = newcomer(league, "carl", "Turbo")
    number = league.number(pupil)
    assert "through a provider" in refused(league.owner.post("/api/groups/1/cards", json={"members": [number]}), 404)
    people = {"people": [{"name": "Wheel"}]}
    wheel = ok(league.owner.post("/api/groups/1/members", json=people), 201)[0]["id"]
    printed = ok(league.owner.post("/api/groups/1/cards", json={"members": [number, wheel]}), 201)
    assert ([card["name"] for card in printed["cards"]], printed["left_out"]) == (["Wheel"], ["Turbo"])
    ok(league.owner.post(f"/api/groups/1/members/{number}/revoke"), 204)
    refused(pupil.get("/api/account"), 401)
    assert "locked out" in refused(come(pupil, "carl"), 401)
    assert member(league, "Turbo")["is_locked"]
    ok(league.owner.post(f"/api/groups/1/members/{number}/admit"), 204)
    assert ok(come(pupil, "carl"))["me"]["id"] == number


def test_who_signs_out_there_is_signed_out_here(league: RunningLeague) -> None:
    pupil = newcomer(league, "hugo", "Comet 2")
    ok(pupil.put("/api/account/password", json={"old": "", "new": "correct horse"}), 204)
    with plain_client() as browser, league.stranger() as by_password, league.stranger() as elsewhere:
        ok(come(pupil, "hugo", browser=browser))
        ok(come(elsewhere, "hugo"))
        ok(by_password.post("/api/door/sign-in", json={"name": "Comet 2", "password": "correct horse"}))
        other = newcomer(league, "ida", "Comet 3")
        issuer = sign_in_there(ok(league.stranger().post("/api/door/provider"))["to"], "hugo")["iss"]
        sign_out_there(issuer, browser)
        assert "not signed in" in refused(pupil.get("/api/account"), 401)
        for still in (by_password, other, elsewhere):  # another way, somebody else, another sign-in there
            ok(still.get("/api/account"))
        assert ok(come(pupil, "hugo"))["me"]["name"] == "Comet 2", "and who signs in again is in again"
    assert "sign_out_by_provider" in {line["what"] for line in ok(league.owner.get("/api/audit?count=500"))}


@pytest.mark.parametrize("form", [{}, {"logout_token": "x.y.z"}, {"logout_token": "x" * 20_000}])
def test_nobody_else_signs_people_out(league: RunningLeague, form: dict[str, str]) -> None:
    stranger = league.stranger()
    assert "logout token" in refused(stranger.post("/api/door/provider/sign-out", data=form), 400) or "x.y.z" in str(
        form
    )
    twice = "logout_token=x&logout_token=y"
    kind = {"content-type": "application/x-www-form-urlencoded"}
    refused(stranger.post("/api/door/provider/sign-out", content=twice, headers=kind), 400)
    refused(stranger.post("/api/door/provider/sign-out", content=b"\xff\0" * 9, headers=kind), 400)


def test_an_account_is_linked_and_unlinked(league: RunningLeague) -> None:
    pupil = league.join(league.code(1), "Meteor")
    number = league.number(pupil)
    link = ok(pupil.get("/api/account/provider"))
    assert link == {"label": NAME, "since": None, "may_unlink": False}

    def connect(name: str) -> httpx.Response:
        answer = sign_in_there(ok(pupil.post("/api/account/provider"))["to"], name)
        return pupil.post("/api/door/provider/arrival", json=answer)

    newcomer(league, "dora", "Planet")
    assert "Somebody else" in refused(connect("dora"), 409)
    assert ok(connect("emil"))["is_linked"]
    assert "another account" in refused(connect("fred"), 409)
    assert ok(come(league.stranger(), "emil"))["me"]["id"] == number
    assert ok(pupil.get("/api/account/provider"))["may_unlink"], "there is a card"
    ok(pupil.delete("/api/account/provider"), 204)
    assert ok(come(league.stranger(), "emil"))["me"] is None
    alone = league.stranger()
    assert ok(come(alone, "dora"))["me"]["name"] == "Planet"
    assert "no other way" in refused(alone.delete("/api/account/provider"), 409)
    ok(alone.put("/api/account/password", json={"old": "", "new": "correct horse"}), 204)
    ok(alone.delete("/api/account/provider"), 204)
    log = ok(league.owner.get("/api/audit?count=500"))
    assert {"link_provider", "unlink_provider", "sign_in_by_provider", "sign_in_by_provider_failed"} <= {
        line["what"] for line in log
    }


def test_who_deletes_an_account_is_new_again(league: RunningLeague) -> None:
    client = newcomer(league, "gina", "Nova")
    ok(client.delete("/api/account"), 204)
    assert ok(come(client, "gina")) == {"me": None, "is_linked": False}


def test_a_league_that_the_provider_does_not_know(league: RunningLeague, tmp_path: Path) -> None:
    """Its secret is wrong: the certified provider refuses, and whoever holds the league is told where to look."""
    from racecraft.serve.problems import Unreachable
    from racecraft.serve.provider.provider import Answer, Provider
    from racecraft.serve.provider_settings import ProviderSettings

    issuer = sign_in_there(ok(league.stranger().post("/api/door/provider"))["to"], "ada")["iss"]
    provider = Provider(ProviderSettings(issuer=issuer, client=CLIENT, secret="wrong", label=NAME))
    to, browser = provider.begin(back=f"{league.owner.base_url}/oidc", user_id=None)
    with pytest.raises(Unreachable, match="does not know this league"):
        provider.arrive(Answer(**sign_in_there(to, "ada")), browser=browser, user_id=None)
