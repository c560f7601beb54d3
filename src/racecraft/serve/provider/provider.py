"""A provider, as a league uses it: sends people there, and finds out who came back.

    begin ──▶ the provider's page ──code──▶ arrive ──code, proof──▶ ID token, verified ──▶ who it is
    the provider itself, later ──logout token, verified──▶ whom it has signed out

OpenID Connect's authorization code flow with PKCE, a state and a nonce. Nothing of what it answers is kept but its name
for somebody; e-mail addresses are looked at and forgotten.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass
from typing import Any, Final
from urllib.parse import quote

from authlib.oauth2.auth import ClientAuth
from authlib.oauth2.rfc6749.parameters import prepare_grant_uri, prepare_token_request
from authlib.oauth2.rfc7636 import create_s256_code_challenge
from joserfc.jwk import KeySet

from racecraft.serve.problems import NotLetIn, TooMany, Unreachable
from racecraft.serve.provider.discovery import Discovery, Endpoints
from racecraft.serve.provider.fetch import ERROR, NoAnswer, Refused, fetch
from racecraft.serve.provider.id_token import verified
from racecraft.serve.provider.logout_token import SignedOut, signed_out
from racecraft.serve.provider.signature import MAX_NAMED
from racecraft.serve.provider.visits import Newcomers, Visit, Visits, Whom
from racecraft.serve.provider_settings import ProviderSettings

AT_ONCE: Final = 8
"""Sign-ins that ask the provider at the same time; who waits for a place has no thread, so others are not delayed."""
PATIENCE: Final = 15.0  # s for a place among them
MAX_NAME: Final = 100
MAX_LOGGED: Final = 300  # characters of a reason, which may be what the provider sent
FORM: Final = {"Content-Type": "application/x-www-form-urlencoded"}


@dataclass(frozen=True)
class Answer:
    """What a browser brings back."""

    code: str = ""
    state: str = ""
    error: str = ""
    iss: str = ""


class Provider:
    """A school's or company's provider.

    Args:
        settings: Of it.
    """

    def __init__(self, settings: ProviderSettings) -> None:
        self.settings = settings
        self.label, self.issuer = settings.label, settings.issuer
        self.newcomers = Newcomers()
        self._discovery = Discovery(settings)
        self._visits = Visits()
        self._places = asyncio.Semaphore(AT_ONCE)

    @asynccontextmanager
    async def place(self) -> AsyncIterator[None]:
        """To be held while the provider is asked; of the server's event loop.

        Raises:
            TooMany: Others wait for it already.
        """
        try:
            async with asyncio.timeout(PATIENCE):
                await self._places.acquire()
        except TimeoutError as error:
            raise TooMany(
                f"Too many people sign in through {self.label} now.", hint="Try again in a moment."
            ) from error
        try:
            yield
        finally:
            self._places.release()

    def begin(self, *, back: str, user_id: int | None) -> tuple[str, str]:
        """Somebody goes there.

        Args:
            back: Our address to come back to.
            user_id: Who adds the provider to their account; None for who comes in.

        Returns:
            The address to go to, and a secret for the browser.

        Raises:
            Unreachable: The provider does not answer.
        """
        with self._asking():
            endpoints = self._discovery.endpoints()
        state, browser, visit = self._visits.begin(back=back, user_id=user_id)
        more = {"prompt": "select_account"} if endpoints.can_ask_who else {}
        address = prepare_grant_uri(
            endpoints.authorization,
            client_id=self.settings.client,
            response_type="code",
            redirect_uri=back,
            scope=self._scope(),
            state=state,
            nonce=visit.nonce,
            code_challenge=create_s256_code_challenge(visit.verifier),
            code_challenge_method="S256",
            **more,
        )
        return str(address), browser

    def arrive(self, answer: Answer, *, browser: str, user_id: int | None) -> tuple[Whom, bool]:
        """Somebody is back.

        Args:
            answer: What they bring.
            browser: The secret of their browser.
            user_id: Who is signed in there.

        Returns:
            Who it is, and whether they came to add the provider to their account.

        Raises:
            NotLetIn: They are not let in, for a reason that a sentence tells.
            Unreachable: The provider does not answer as it should.
        """
        visit = self._visits.take(answer.state, browser)
        if visit.user_id is not None and visit.user_id != user_id:
            raise NotLetIn("You are no longer signed in as who began this.", hint="Sign in, and begin again.")
        with self._asking():
            endpoints = self._discovery.endpoints()
            if (answer.iss or endpoints.names_itself) and answer.iss != self.issuer:
                raise NotLetIn(f"What came back is of another provider than {self.label}.")
            if answer.error:
                raise self._failed(answer.error)
            if not answer.code:
                raise NotLetIn(f"{self.label} did not say who you are.")
            claims = self._claims(endpoints, visit, answer.code)
        self._require_wanted(claims)
        name = claims.get("name")
        real_name = " ".join(name.split())[:MAX_NAME] if isinstance(name, str) and name.isprintable() else ""
        told = claims.get("sid")
        session = told if isinstance(told, str) and told.isprintable() and len(told) <= MAX_NAMED else ""
        return Whom(self.issuer, claims["sub"], real_name, session), visit.user_id is not None

    def signed_out(self, token: object) -> SignedOut:
        """Whom the provider has signed out, by what it sent itself.

        Raises:
            NotLetIn: It is not what it should be, with a sentence.
            Unreachable: The provider does not answer when asked for its keys.
        """
        with self._asking():
            return signed_out(token, self._keys, label=self.label, issuer=self.issuer, client=self.settings.client)

    def _scope(self) -> str:
        """No more than is needed."""
        asked = ["openid"]
        asked += ["profile"] if self.settings.group is not None or self.settings.claims else []
        asked += ["email"] if self.settings.domains else []
        return " ".join(asked)

    def _claims(self, endpoints: Endpoints, visit: Visit, code: str) -> dict[str, Any]:
        try:
            told = self._exchange(endpoints, visit, code)
        except Refused as error:
            self._log(error)
            if error.error == "invalid_grant":
                raise NotLetIn("This sign-in is over, or was used already.", hint="Begin again.") from error
            if error.error in ("invalid_client", "unauthorized_client"):
                raise Unreachable(
                    f"{self.label} does not know this league.",
                    hint="Whoever holds the league looks at its client id and secret.",
                ) from error
            raise
        access_token = told.get("access_token")
        access_token = access_token if isinstance(access_token, str) and access_token.isascii() else ""
        claims = verified(
            told.get("id_token"),
            self._keys,
            label=self.label,
            issuer=self.issuer,
            client=self.settings.client,
            nonce=visit.nonce,
            access_token=access_token,
        )
        if self._scope() == "openid" or not endpoints.userinfo or not access_token.isprintable():
            return claims
        more = fetch(
            endpoints.userinfo, headers={"Authorization": f"Bearer {access_token}"}, is_here=self.settings.is_here
        )
        if more.get("sub") != claims["sub"]:
            raise NotLetIn(f"What {self.label} says of you cannot be read.")
        return _together(claims, more)

    def _keys(self, anew: bool) -> KeySet:
        return self._discovery.keys(anew=anew)

    def _exchange(self, endpoints: Endpoints, visit: Visit, code: str) -> dict[str, Any]:
        body = prepare_token_request(
            "authorization_code", code=code, redirect_uri=visit.back, code_verifier=visit.verifier
        )
        client, secret = self.settings.client, self.settings.secret
        method = "none" if not secret else "client_secret_basic" if endpoints.takes_basic else "client_secret_post"
        if method == "client_secret_basic":  # both are written as in a form, and then put together
            client, secret = quote(client, safe=""), quote(secret, safe="")
        url, headers, body = ClientAuth(client, secret, method).prepare("POST", endpoints.token, dict(FORM), body)
        return fetch(url, body=body, headers=headers, is_here=self.settings.is_here)

    def _require_wanted(self, claims: dict[str, Any]) -> None:
        """Make sure that the league wants somebody.

        Raises:
            NotLetIn: It does not.
        """
        if self.settings.domains:
            address = claims.get("email")
            person, _, domain = address.rpartition("@") if isinstance(address, str) else ("", "", "")
            if not person or claims.get("email_verified") is not True or domain.lower() not in self.settings.domains:
                raise NotLetIn(
                    f"Your account of {self.label} is not one of those that this league lets in.",
                    hint="It has to have a confirmed address of the school or company.",
                )
        for name, wanted in self.settings.claims:
            found = claims.get(name)
            values = found if isinstance(found, list) else [found]
            if wanted not in map(_written, values):
                raise NotLetIn(
                    f"Your account of {self.label} is not one of those that this league lets in.",
                    hint="Ask whoever holds the league.",
                )

    def _failed(self, error: str) -> Exception:
        """What to say of an error that a browser brought; its words are anybody's, so only known ones are repeated."""
        if error == "access_denied":
            return NotLetIn(f"You did not sign in at {self.label}.", hint="Begin again, or come in another way.")
        word = error if ERROR.fullmatch(error) else "something else"
        self._log(NoAnswer(f"it sent somebody back with {word}"))
        return Unreachable(
            f"{self.label} could not sign you in.", hint="Try again in a moment, or come in another way."
        )

    @contextmanager
    def _asking(self) -> Iterator[None]:
        """Talk to the provider.

        Raises:
            Unreachable: It does not answer as it should.
        """
        try:
            yield
        except NoAnswer as error:
            self._log(error)
            raise Unreachable(
                f"{self.label} does not answer as it should.", hint="Try again in a moment, or come in another way."
            ) from error

    def _log(self, error: NoAnswer) -> None:
        why = " ".join(str(error).split())[:MAX_LOGGED]
        logging.getLogger("racecraft.serve").warning("Sign-in through %s: %s", self.label, why)


def _together(claims: dict[str, Any], more: dict[str, Any]) -> dict[str, Any]:
    """What two answers say of somebody, the first before the second; an address is confirmed by who names it alone."""
    told = {**more, **claims}
    if "email" in told:
        named = [one for one in (claims, more) if one.get("email") == told["email"]]
        told["email_verified"] = next((one["email_verified"] for one in named if "email_verified" in one), None)
    return told


def _written(value: object) -> str | None:
    """A claim's value as in JSON, and as whoever holds the league types it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value) if isinstance(value, int | str) else None
