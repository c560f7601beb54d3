"""Who tries too often at a league's door: whom that keeps out, and whom it must not."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import httpx
import pytest
from leagues import RunningLeague, ok, refused, running_league
from running_consoles import PATIENCE

from racecraft.serve.door import known_browsers
from racecraft.serve.door.known_browsers import make_mark
from racecraft.serve.people.tries import Tries, network_of
from racecraft.serve.problems import TooMany
from racecraft.serve.settings import COOKIE, KNOWN_COOKIE

RIGHT = "a long password"


@pytest.fixture(scope="module")
def league(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningLeague]:
    with running_league(tmp_path_factory.mktemp("league") / "runs") as league:
        yield league


def statuses_of(client: httpx.Client, path: str, count: int, body: dict[str, str] | None = None) -> list[int]:
    return [client.post(path, json=body).status_code for _ in range(count)]


def sign_in(client: httpx.Client, name: str, password: str) -> httpx.Response:
    return client.post("/api/door/sign-in", json={"name": name, "password": password})


@pytest.mark.costly
def test_one_pupil_does_not_lock_out_the_class_that_shares_an_address(tmp_path: Path) -> None:
    with running_league(tmp_path / "runs") as league:
        teacher = league.organiser("Ms Frizzle")
        ok(teacher.put("/api/account/password", json={"new": RIGHT}), 204)
        group = league.group("5b", teacher)
        code = league.code(group, teacher)
        people = {"people": [{"name": "Ada"}, {"name": "Bob"}]}
        cards = ok(teacher.post(f"/api/groups/{group}/members", json=people), 201)
        shown = [{"secret": card["link"].split("#")[1]} for card in cards]
        pupil, other = league.stranger(), league.stranger()
        assert statuses_of(pupil, "/api/door/devices", 201) == [201] * 200 + [429]
        assert statuses_of(pupil, "/api/door/card", 201, {"secret": "wrong"}) == [401] * 200 + [429]
        assert statuses_of(pupil, "/api/door/devices/token", 1, {"secret": "wrong"}) == [429], "counted with the cards"
        ok(other.post("/api/door/card", json=shown[0]))
        ok(other.post("/api/door/join", json={"code": code, "name": "Carl"}), 201)
        guessed = statuses_of(pupil, "/api/door/join", 201, {"code": "WRNG-CODE", "name": "Eve"})
        assert guessed == [401] * 200 + [429]
        assert "too many" in refused(other.post("/api/door/join", json={"code": code, "name": "Dora"}), 429)
        ok(other.post("/api/door/card", json=shown[1]))
        ok(sign_in(league.stranger(), "Ms Frizzle", RIGHT))
        ok(teacher.get("/api/groups"))


@pytest.mark.costly
def test_who_is_in_and_guesses_codes_is_stopped_by_account(league: RunningLeague) -> None:
    guesser, other = league.organiser("Guesser"), league.organiser("Guest")
    assert statuses_of(guesser, "/api/groups/join", 11, {"code": "WRNG-CODE"}) == [401] * 10 + [429]
    assert statuses_of(other, "/api/groups/join", 1, {"code": "WRNG-CODE"}) == [401]


@pytest.mark.costly
def test_who_signed_in_here_before_is_not_locked_out_by_who_guesses_elsewhere(league: RunningLeague) -> None:
    home = league.organiser("Mr Chips")
    ok(home.put("/api/account/password", json={"new": RIGHT}), 204)
    ok(home.post("/api/door/sign-out"), 204)
    mark = home.cookies[KNOWN_COOKIE]
    with league.stranger() as thief:
        thief.cookies.set(KNOWN_COOKIE, mark[:-1] + ("0" if mark[-1] != "0" else "1"))
        assert [sign_in(thief, "Mr Chips", "guess").status_code for _ in range(11)] == [401] * 10 + [429]
        refused(sign_in(thief, "Mr Chips", RIGHT), 429)
        kept = ok(sign_in(home, "mr chips", RIGHT))
        assert (kept["name"], home.cookies[KNOWN_COOKIE] == mark) == ("Mr Chips", False)
        ok(home.put("/api/account/password", json={"new": "another password", "old": RIGHT}), 204)
        thief.cookies.clear()
        thief.cookies.set(KNOWN_COOKIE, mark)
        refused(sign_in(thief, "Mr Chips", RIGHT), 429)  # another password makes every browser unknown but this one
        assert [sign_in(home, "Mr Chips", "guess").status_code for _ in range(11)] == [401] * 10 + [429]


@pytest.mark.costly
def test_who_may_not_enter_is_told_before_a_file_is_read(league: RunningLeague) -> None:
    teacher, url = league.organiser("Mr Nosy"), league.owner.base_url
    race = {"title": "Cup", "track": "oval", "laps": 1, "trials": 1}
    theirs = ok(league.owner.post(f"/api/groups/{league.group('Theirs')}/races", json=race), 201)["id"]
    own = ok(teacher.post(f"/api/groups/{league.group('Own', teacher)}/races", json=race), 201)["id"]
    for number in (theirs, 99999):
        with socket.create_connection((url.host, url.port), timeout=PATIENCE) as line:
            head = f"POST /api/league/races/{number}/submissions?model=x HTTP/1.1\r\nHost: {url.host}:{url.port}\r\n"
            head += f"Cookie: {COOKIE}={teacher.cookies[COOKIE]}\r\nContent-Length: {32 << 20}\r\n\r\n"
            line.sendall(head.encode())
            assert line.recv(4096).split()[1] == b"404"
    address = f"/api/league/races/{theirs}/submissions?model=x"
    assert "no race" in refused(teacher.post(address, content=bytes(20 << 20)), 404)  # and who sends on all the same
    endless = (bytes(1 << 20) for _ in range(33))  # whose length is not told
    address = f"/api/league/races/{own}/submissions?model=x"
    assert "at most 32 MB" in refused(teacher.post(address, content=endless), 413)


def test_a_mark_is_of_one_account_with_one_password_for_half_a_year(monkeypatch: pytest.MonkeyPatch) -> None:
    mark = make_mark(7, "kept")
    assert known_browsers.is_mark(mark, 7, "kept")
    assert not known_browsers.is_mark(mark, 8, "kept")
    assert not known_browsers.is_mark(mark, 7, "another")
    assert not known_browsers.is_mark("8" + mark[1:], 8, "kept")
    for wrong in ("", ".", "7", "7.9999999999.x.", "\udcff.\udcff", "ä.ö"):
        assert not known_browsers.is_mark(wrong, 7, "kept")
    later = known_browsers.time.time() + known_browsers.SECONDS + 1
    monkeypatch.setattr(known_browsers.time, "time", lambda: later)
    assert not known_browsers.is_mark(mark, 7, "kept")


def test_forty_tries_at_once_are_not_more_than_ten() -> None:
    tries, together = Tries(), threading.Barrier(40)
    found: list[str] = []

    def guess() -> None:
        together.wait()
        try:
            with tries.attempt(account="ada", address="192.0.2.1") as attempt:
                under_way.wait(PATIENCE)
                attempt.fail()
            found.append("tried")
        except TooMany:
            found.append("refused")
            if found.count("refused") == 30:
                under_way.set()

    under_way = threading.Event()
    threads = [threading.Thread(target=guess) for _ in range(40)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (found.count("tried"), found.count("refused")) == (10, 30)


def test_what_succeeds_costs_nothing_and_what_breaks_neither() -> None:
    tries = Tries()
    for _ in range(30):
        with tries.attempt(account="ada", address="192.0.2.1"):
            pass
        with pytest.raises(ZeroDivisionError), tries.attempt(account="ada", address="192.0.2.1"):
            _ = 1 / 0
    for _ in range(10):
        with tries.attempt(account="ada", address="192.0.2.1") as attempt:
            attempt.fail()
    with pytest.raises(TooMany), tries.attempt(account="ada", address="192.0.2.2"):
        pass
    with tries.attempt(account="bob", address="192.0.2.1"):
        pass


def test_every_way_in_has_its_number_for_each_network() -> None:
    tries = Tries()

    def password(*, address: str) -> None:
        with tries.attempt(address=address) as attempt:
            attempt.fail()

    program, provider = (partial(tries.begins, what) for what in ("program", "provider"))
    for ask, most in ((password, 200), (tries.wrong_secret, 200), (program, 200), (provider, 600)):
        for _ in range(most):
            ask(address="2001:db8::1")
        with pytest.raises(TooMany):
            ask(address="2001:db8::2")
        ask(address="2001:db8:0:1::1")


def test_an_ipv6_network_counts_as_one_address() -> None:
    assert network_of("2001:db8:1:2:3:4:5:6") == network_of("2001:db8:1:2::") == "2001:db8:1:2::/64"
    assert network_of("2001:db8:1:3::1") != network_of("2001:db8:1:2::1")
    assert network_of("::ffff:192.0.2.1") == network_of("192.0.2.1") == "192.0.2.1"
    assert network_of("192.0.2.1") != network_of("192.0.2.2")
    assert (network_of("fe80::1%eth0"), network_of("testclient"), network_of("")) == ("fe80::/64", "testclient", "")
    tries = Tries()
    for number in range(200):
        with tries.attempt(address=f"2001:db8::{number:x}", way="code") as attempt:
            attempt.fail()
    with pytest.raises(TooMany), tries.attempt(address="2001:db8::ffff", way="code"):
        pass
    with tries.attempt(address="2001:db8::ffff", way="password"):
        pass
    with tries.attempt(address="2001:db8:0:1::1", way="code"):
        pass
