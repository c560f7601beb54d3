"""One's own account."""

from __future__ import annotations

import shutil
from typing import Annotated

from fastapi import APIRouter, Path, Request, Response

from racecraft.errors import ConfigError
from racecraft.serve.context import AsksProvider, InConsoles, InPerson
from racecraft.serve.door.guard import Guard, caller
from racecraft.serve.door.known_browsers import remember
from racecraft.serve.people.keys import SESSION_ID, digest_of
from racecraft.serve.people.links import address_of
from racecraft.serve.people.schemas import (
    AccountChange,
    Farewell,
    LetIn,
    MadeToken,
    Me,
    NewPassword,
    NewToken,
    ProviderLink,
    SessionInfo,
    TokenInfo,
    ToProvider,
    me_of,
)
from racecraft.serve.problems import NotFound
from racecraft.serve.provider.visits import SECONDS
from racecraft.serve.settings import COOKIE, PROVIDER_PAGE

router = APIRouter(prefix="/api/account", tags=["account"])


@router.get("")
def get_account(person: InPerson) -> Me:
    """Who is signed in."""
    return me_of(person)


@router.patch("")
def change_account(request: AccountChange, consoles: InConsoles, person: InPerson) -> Me:
    """Another name."""
    consoles.people.rename(person.id, request.name)
    return me_of(consoles.people.get(person.id))


@router.put("/password", status_code=204)
def set_password(body: NewPassword, request: Request, consoles: InConsoles, person: InPerson) -> Response:
    """A first password, or another one, which ends a card; wrong old ones count like wrong ones at the door."""
    with consoles.tries.attempt(account=f"password {person.id}") as attempt:
        if not consoles.people.set_password(person.id, body.new, old=body.old, asked_in=_session(request)):
            attempt.fail()
            raise ConfigError("That is not your password.")
    response = Response(status_code=204)
    remember(request, response, consoles.people, person.id)
    return response


@router.get("/sessions")
def list_sessions(request: Request, consoles: InConsoles, person: InPerson) -> list[SessionInfo]:
    """The browsers that are signed in, newest first."""
    found = consoles.keys.sessions(person.id, this=request.cookies.get(COOKIE, ""))
    return [SessionInfo(**vars(session)) for session in found]


@router.delete("/sessions/{session_id}", status_code=204)
def end_session(
    session_id: Annotated[str, Path(pattern=f"^[0-9a-f]{{{SESSION_ID}}}$")], consoles: InConsoles, person: InPerson
) -> Response:
    """Sign one browser out."""
    consoles.keys.end_session(person.id, session_id)
    return Response(status_code=204)


@router.delete("/sessions", status_code=204)
def end_sessions(consoles: InConsoles, person: InPerson) -> Response:
    """Sign out everywhere, here too."""
    consoles.keys.close_sessions(person.id)
    return Response(status_code=204)


@router.post("/devices", status_code=204)
def let_device_in(body: LetIn, request: Request, consoles: InConsoles, person: InPerson) -> Response:
    """A program that shows this code gets a token of one's own."""
    with consoles.tries.attempt(account=f"device {person.id}") as attempt:
        try:
            consoles.devices.confirm(body.code, person.id, session=_session(request))
        except NotFound:
            attempt.fail()
            raise
    return Response(status_code=204)


@router.get("/provider")
def get_provider(consoles: InConsoles, person: InPerson) -> ProviderLink | None:
    """Whether one comes in through the league's provider; null where it has none."""
    if consoles.owner.settings.provider is None:
        return None
    link = consoles.identities.of(person.id, consoles.provider.issuer)
    return ProviderLink(
        label=consoles.provider.label,
        since=link.since if link is not None else None,
        may_unlink=link is not None and not link.is_only_way,
    )


@router.post("/provider", dependencies=[AsksProvider])
def begin_link(request: Request, response: Response, consoles: InConsoles, person: InPerson) -> ToProvider:
    """To the provider, so that one comes in through it from now on, too."""
    consoles.tries.begins("provider", address=caller(request))
    back = address_of(request, consoles.owner.settings) + PROVIDER_PAGE
    to, secret = consoles.provider.begin(back=back, user_id=person.id)
    guard: Guard = request.app.state.guard
    guard.send_away(response, secret, seconds=SECONDS)
    return ToProvider(to=to)


@router.delete("/provider", status_code=204)
def unlink_provider(consoles: InConsoles, person: InPerson) -> Response:
    """One no longer comes in through the provider."""
    consoles.identities.unlink(person.id, consoles.provider.issuer)
    return Response(status_code=204)


@router.get("/tokens")
def list_tokens(consoles: InConsoles, person: InPerson) -> list[TokenInfo]:
    """One's tokens, newest first."""
    return [TokenInfo(**vars(token)) for token in consoles.keys.tokens(person.id)]


@router.post("/tokens", status_code=201)
def make_token(body: NewToken, request: Request, consoles: InConsoles, person: InPerson) -> MadeToken:
    """A token for a program; its secret is shown this once."""
    number, secret = consoles.keys.make_token(
        person.id, title=body.title, scopes=body.scopes, days=body.days, asked_in=_session(request)
    )
    return MadeToken(id=number, secret=secret)


@router.delete("/tokens/{token_id}", status_code=204)
def remove_token(token_id: Annotated[int, Path(ge=0, lt=2**31)], consoles: InConsoles, person: InPerson) -> Response:
    """A token is worth nothing from now on."""
    consoles.keys.remove_token(person.id, token_id)
    return Response(status_code=204)


@router.delete("", status_code=204)
def remove_account(consoles: InConsoles, person: InPerson, body: Farewell | None = None) -> Response:
    """Forget somebody with all that is theirs; download it first. Who has a password gives it."""
    with consoles.tries.attempt(account=f"password {person.id}") as attempt:
        if not consoles.people.confirms(person.id, body.password if body is not None else ""):
            attempt.fail()
            raise ConfigError("That is not your password.")
    console = consoles.of(person.id)
    consoles.people.remove(person.id)
    consoles.entries.forget(person.id)
    consoles.forget(person.id)
    shutil.rmtree(console.settings.runs, ignore_errors=True)
    console.mirror.forget_all()
    return Response(status_code=204)


def _session(request: Request) -> str:
    """The digest of the session in which somebody asks."""
    return digest_of(request.cookies.get(COOKIE, ""))
