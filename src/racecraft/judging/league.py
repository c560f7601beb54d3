"""A league on another machine: its races, a run that is sent to one, what it publishes of a race that is over.

Only what drives leaves this machine.
"""

from __future__ import annotations

import json
import os
import re
import urllib.error
import urllib.request
from collections.abc import Mapping
from http.client import HTTPException
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote, urlsplit

from pydantic import BaseModel, TypeAdapter, ValidationError

from racecraft.errors import ConfigError, RacecraftError, RunError, printable
from racecraft.json_file import parse_json_object, read_json_object
from racecraft.race.entry_file import pack_entry
from racecraft.replay.codec import MAX_FILE_BYTES
from racecraft.run import RunFolder
from racecraft.run.folder import sanitize_name

PATIENCE: Final = 60.0  # s
MOST: Final = 1 << 25  # bytes of an answer
WEIGHTS: Final = "application/octet-stream"
MARK: Final = re.compile(r"[!-~]+")
"""A token is one printable word."""


class LoginTold(BaseModel):
    """What a league has to say of a program that asks to be let in; this and the next may say more."""

    link: str
    code: str
    secret: str


class TokenTold(BaseModel):
    """The same when somebody has typed the code, or not yet."""

    token: str


class RaceTold(BaseModel):
    """The same of a race."""

    id: int
    state: str
    kind: str
    track: str
    title: str


class SubmissionTold(BaseModel):
    """The same of a submission."""

    id: int
    state: str
    ahead: int
    seconds_left: float | None
    score: float | None
    error: dict[str, Any] | None


class LeagueRefused(RunError):
    """The league said no; the message is its sentence."""


class _Straight(urllib.request.HTTPRedirectHandler):
    """Goes nowhere else: the token is for one address."""

    def redirect_request(self, *_: Any) -> None:
        """No."""


class League:
    """A league, as somebody with a token.

    Args:
        url: ``https://NAME`` or ``http://NAME:PORT``.
        token: From the page of one's account there; empty for who has no account, and sees what is public.

    Raises:
        ConfigError: The address is none.
    """

    def __init__(self, url: str, token: str = "") -> None:
        parts = urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.hostname or parts.path not in ("", "/"):
            raise ConfigError(f"The league's address is {url[:80]!r}; allowed are https://NAME and http://NAME:PORT.")
        if token and not MARK.fullmatch(token):
            raise ConfigError("A token is one word, which begins with rc_.", hint="Make one on your account's page.")
        self.url, self.token = f"{parts.scheme}://{parts.netloc}", token
        self._opener = urllib.request.build_opener(_Straight)

    def begin_login(self) -> dict[str, Any]:
        """Ask to be let in: the code to show, and the secret to wait with."""
        found: dict[str, Any] = self._ask(LoginTold, "POST", "/api/door/devices", b"")
        return found

    def take_token(self, secret: str) -> str:
        """The token, once somebody has typed the code; empty before.

        Raises:
            LeagueRefused: Nobody did in time.
        """
        data = json.dumps({"secret": secret}).encode()
        return str(self._ask(TokenTold, "POST", "/api/door/devices/token", data, kind="application/json")["token"])

    def races(self) -> list[dict[str, Any]]:
        """The races of one's groups, newest first.

        Raises:
            LeagueRefused: It does not answer, or does not know the token.
        """
        found: list[dict[str, Any]] = self._ask(list[RaceTold], "GET", "/api/league/races")
        return found

    def submit(self, run: RunFolder, race: int, *, checkpoint: str = "best") -> dict[str, Any]:
        """Send a run's checkpoint to a race; the submission as the league tells it.

        Raises:
            RacecraftError: The run has nothing to drive with, or the league refuses it.
        """
        data = pack_entry(run, checkpoint=checkpoint)
        name = sanitize_name(run.path.resolve().name)
        path = f"/api/league/races/{race}/submissions?model={quote(name)}"
        found: dict[str, Any] = self._ask(SubmissionTold, "POST", path, data)
        return found

    def submission(self, race: int, number: int) -> dict[str, Any]:
        """How a submission stands."""
        found: dict[str, Any] = self._ask(SubmissionTold, "GET", f"/api/league/races/{race}/submissions/{number}")
        return found

    def published(self, race: int) -> dict[str, Any]:
        """What is published of a race: its announcement, and when it is over its board.

        Raises:
            LeagueRefused: It does not answer, or does not show it.
            ConfigError: What it says is no JSON object.
        """
        return parse_json_object(self._fetch("GET", f"/api/boards/{race}/race.json", most=MOST), name="The board")

    def replay(self, race: int, submission: int) -> bytes:
        """A replay file, when the race is over.

        Raises:
            LeagueRefused: There is none.
        """
        return self._fetch("GET", f"/api/boards/{race}/replays/{submission}", most=MAX_FILE_BYTES + 1)

    def heat(self, race: int, duel: int, heat: int) -> bytes:
        """The replay file of a final's heat, when the race is over.

        Raises:
            LeagueRefused: There is none.
        """
        return self._fetch("GET", f"/api/boards/{race}/duels/{duel}/heats/{heat}/replay", most=MAX_FILE_BYTES + 1)

    def _ask(self, expected: Any, method: str, path: str, data: bytes | None = None, *, kind: str = WEIGHTS) -> Any:
        """An answer, as it is, where it says what is expected of it."""
        answer = self._fetch(method, path, data, most=MOST, kind=kind)
        try:
            told = json.loads(answer)
            TypeAdapter(expected).validate_python(told)
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(map(str, first["loc"])) or "the answer"
            raise LeagueRefused(f"{self.url} does not answer as a league does: {where}: {first['msg']}.") from error
        except (ValueError, RecursionError) as error:
            raise LeagueRefused(f"{self.url} does not answer as a league does: {str(error)[:200]}.") from error
        return _harmless(told)

    def _fetch(self, method: str, path: str, data: bytes | None = None, *, most: int, kind: str = WEIGHTS) -> bytes:
        headers = {"Content-Type": kind}
        if self.token:
            headers["Authorization"] = f"Bearer {self.token}"
        request = urllib.request.Request(self.url + path, data=data, headers=headers, method=method)
        try:
            with self._opener.open(request, timeout=PATIENCE) as reply:
                return bytes(reply.read(most))
        except urllib.error.HTTPError as error:
            with error:
                raise _refusal(error, self.url) from error
        except (OSError, HTTPException, ValueError) as error:
            reason = getattr(error, "reason", error)
            reason = getattr(reason, "strerror", None) or reason  # without its number
            raise LeagueRefused(f"{self.url} does not answer as a league does: {str(reason)[:200]}.") from error


def _refusal(error: urllib.error.HTTPError, url: str) -> RacecraftError:
    try:
        told: Mapping[str, Any] = json.loads(error.read(1 << 16))["error"]
        return LeagueRefused(str(told["message"])[:500], hint=str(told.get("hint") or "")[:500])
    except (ValueError, KeyError, TypeError, RecursionError):
        return LeagueRefused(f"{url} does not answer as a league does: status {error.code}.")


def _harmless(told: Any) -> Any:
    """The same without what could drive a terminal: titles are other people's words."""
    if isinstance(told, dict):
        return {_harmless(name): _harmless(value) for name, value in told.items()}
    if isinstance(told, list):
        return [_harmless(value) for value in told]
    return printable(told) if isinstance(told, str) else told


def remember_league(league: League) -> Path:
    """Keep address and token for this user, where nobody else can read them; the file."""
    path = _remembered()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    path.touch(mode=0o600)
    with os.fdopen(os.open(path, os.O_WRONLY), "w") as file:
        json.dump({"url": league.url, "token": league.token}, file)
    return path


def remembered_league() -> League:
    """The league that `remember_league` kept.

    Raises:
        RunError: There is none.
    """
    path = _remembered()
    if not path.is_file():
        raise RunError("No league is known to this machine.", hint="Begin with: racecraft login URL")
    kept = read_json_object(path)
    return League(str(kept.get("url", "")), str(kept.get("token", "")))


def remembered_token(url: str) -> str:
    """The token that opens the league at an address; empty where this machine knows none."""
    path = _remembered()
    kept = read_json_object(path) if path.is_file() else {}
    return str(kept.get("token", "")) if kept.get("url") == url else ""


def _remembered() -> Path:
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "racecraft" / "league.json"
