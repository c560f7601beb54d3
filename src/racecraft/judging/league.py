"""A league on another machine: its races, and a run that is sent to one. Only what drives leaves this machine."""

from __future__ import annotations

import json
import os
import urllib.error
import urllib.request
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote, urlsplit

from racecraft.errors import ConfigError, RacecraftError, RunError
from racecraft.json_file import read_json_object
from racecraft.race.entry_file import pack_entry
from racecraft.run import RunFolder
from racecraft.run.folder import sanitize_name

PATIENCE: Final = 60.0  # s
MOST: Final = 1 << 24  # bytes of an answer


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
        token: From the page of one's account there.

    Raises:
        ConfigError: The address is none.
    """

    def __init__(self, url: str, token: str) -> None:
        parts = urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.hostname or parts.path not in ("", "/"):
            raise ConfigError(f"The league's address is {url[:80]!r}; allowed are https://NAME and http://NAME:PORT.")
        if not token.isascii() or not token.isprintable() or not token:
            raise ConfigError("A token is one word, which begins with rc_.", hint="Make one on your account's page.")
        self.url, self.token = f"{parts.scheme}://{parts.netloc}", token
        self._opener = urllib.request.build_opener(_Straight)

    def races(self) -> list[dict[str, Any]]:
        """The races of one's groups, newest first.

        Raises:
            LeagueRefused: It does not answer, or does not know the token.
        """
        found: list[dict[str, Any]] = self._ask("GET", "/api/league/races")
        return found

    def submit(self, run: RunFolder, race: int, *, checkpoint: str = "best") -> dict[str, Any]:
        """Send a run's checkpoint to a race; the submission as the league tells it.

        Raises:
            RacecraftError: The run has nothing to drive with, or the league refuses it.
        """
        data = pack_entry(run, checkpoint=checkpoint)
        name = sanitize_name(run.path.resolve().name)
        found: dict[str, Any] = self._ask("POST", f"/api/league/races/{race}/submissions?model={quote(name)}", data)
        return found

    def submission(self, race: int, number: int) -> dict[str, Any]:
        """How a submission stands."""
        found: dict[str, Any] = self._ask("GET", f"/api/league/races/{race}/submissions/{number}")
        return found

    def _ask(self, method: str, path: str, data: bytes | None = None) -> Any:
        headers = {"Authorization": f"Bearer {self.token}", "Content-Type": "application/octet-stream"}
        request = urllib.request.Request(self.url + path, data=data, headers=headers, method=method)
        try:
            with self._opener.open(request, timeout=PATIENCE) as reply:
                return json.loads(reply.read(MOST))
        except urllib.error.HTTPError as error:
            with error:
                raise _refusal(error, self.url) from error
        except (OSError, ValueError) as error:
            reason = getattr(error, "reason", error)
            raise LeagueRefused(f"{self.url} does not answer as a league does: {str(reason)[:200]}.") from error


def _refusal(error: urllib.error.HTTPError, url: str) -> RacecraftError:
    try:
        told: Mapping[str, Any] = json.loads(error.read(1 << 16))["error"]
        return LeagueRefused(str(told["message"])[:500], hint=str(told.get("hint") or "")[:500])
    except (ValueError, KeyError, TypeError):
        return LeagueRefused(f"{url} does not answer as a league does: status {error.code}.")


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


def _remembered() -> Path:
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "racecraft" / "league.json"
