"""The door of a league: in by password, card or code, and out."""

from __future__ import annotations

import sqlalchemy as sa
from fastapi import APIRouter, Request, Response

from racecraft.serve.context import Consoles, InConsoles, InLeague, InPerson
from racecraft.serve.door.guard import Guard, caller
from racecraft.serve.door.known_browsers import known_as, remember
from racecraft.serve.people.devices import SECONDS
from racecraft.serve.people.keys import has_password, shows_card
from racecraft.serve.people.links import address_of, card_of
from racecraft.serve.people.names import handle_of
from racecraft.serve.people.passwords import hash_password
from racecraft.serve.people.schemas import (
    Device,
    Door,
    Join,
    Joined,
    Me,
    ResetPassword,
    ShowCard,
    SignIn,
    TakenToken,
    TakeToken,
    me_of,
)
from racecraft.serve.problems import NotFound, NotLetIn
from racecraft.serve.settings import COOKIE

router = APIRouter(prefix="/api/door", tags=["door"])


@router.get("")
def look_at_door(request: Request, consoles: InLeague) -> Door:
    """Whether this is a league, and who is signed in."""
    user = request.state.user_id
    told = consoles.owner.settings.provider
    return Door(
        me=me_of(consoles.people.get(user)) if user is not None else None,
        provider=told.label if told is not None else None,
    )


@router.post("/sign-in")
def sign_in(request: Request, body: SignIn, response: Response, consoles: InLeague) -> Me:
    """In by name and password; a browser that was in with it before is counted by itself, whatever others try."""
    known = known_as(request, consoles.people, body.name)
    account, address = (f"known {known}", "") if known else (handle_of(body.name), caller(request))
    with consoles.tries.attempt(account=account, address=address) as attempt:
        found = consoles.people.by_password(body.name, body.password)
        if found is None:
            attempt.fail()
            write_down(request, consoles, _named(consoles, body.name), is_in=False)
            raise NotLetIn("There is nobody of that name with that password.")
    remember(request, response, consoles.people, found[0])
    return let_in(request, response, consoles, found[0], shown=has_password(*found))


@router.post("/card")
def show_card(request: Request, body: ShowCard, response: Response, consoles: InLeague) -> Me:
    """In by a login card."""
    user = consoles.keys.card_user(body.secret)
    if user is None:
        fail(request, consoles)
        raise NotLetIn(
            "There is no such card, or it is no longer good.", hint="Look at it again, or ask for a new one."
        )
    return let_in(request, response, consoles, user, shown=shows_card(body.secret))


@router.post("/join", status_code=201)
def join(request: Request, body: Join, response: Response, consoles: InLeague) -> Joined:
    """In by a group's code, as somebody new."""
    with consoles.tries.attempt(address=caller(request), way="code") as attempt:
        user = consoles.groups.join(body.code, body.name)
        if user is None:
            attempt.fail()
            write_down(request, consoles, None, is_in=False)
            raise NotLetIn("There is no such code, or it is no longer good.", hint="Look at the wall again.")
    me = let_in(request, response, consoles, user)
    secret = consoles.keys.print_card(user)
    address = address_of(request, consoles.owner.settings)
    return Joined(me=me, card=card_of(address, secret, user_id=user, name=me.name))


@router.post("/reset")
def reset_password(request: Request, body: ResetPassword, response: Response, consoles: InLeague) -> Me:
    """In by a link for a new password, which ends every session, card and token that there was."""
    user = None
    if consoles.keys.reset_user(body.secret) is not None:
        user = consoles.keys.use_reset(body.secret, hash_password(body.password))
    if user is None:
        fail(request, consoles)
        raise NotLetIn("This link is no longer good.", hint="Ask for a new one.")
    remember(request, response, consoles.people, user)
    return let_in(request, response, consoles, user)


@router.post("/devices", status_code=201)
def begin_device(request: Request, consoles: InLeague) -> Device:
    """A program wants to be let in: its code is typed into somebody's browser."""
    consoles.tries.begins("program", address=caller(request))
    secret, code = consoles.devices.begin()
    link = f"{address_of(request, consoles.owner.settings)}/me#{code}"
    return Device(secret=secret, code=f"{code[:4]}-{code[4:]}", link=link, seconds=SECONDS)


@router.post("/devices/token")
def take_token(request: Request, body: TakeToken, consoles: InLeague) -> TakenToken:
    """The token of a program that was let in; empty while it waits."""
    try:
        taken = consoles.devices.take(body.secret)
    except NotLetIn:
        fail(request, consoles)
        raise
    if taken is None:
        return TakenToken(token="")
    user, asked_in = taken
    try:
        made = consoles.keys.make_token(
            user, title="racecraft login", scopes=["read", "submit"], days=90, asked_in=asked_in
        )
    except NotLetIn as error:
        fail(request, consoles)
        raise NotLetIn("Whoever typed the code has signed out.", hint="Begin again.") from error
    return TakenToken(token=made[1])


@router.post("/sign-out", status_code=204)
def sign_out(request: Request, consoles: InConsoles, person: InPerson) -> Response:
    """Out."""
    write_down(request, consoles, person.id)
    consoles.keys.close_session(request.cookies.get(COOKIE, ""))
    response = Response(status_code=204)
    response.delete_cookie(COOKIE, path="/")
    return response


def let_in(
    request: Request,
    response: Response,
    consoles: Consoles,
    user: int,
    *,
    provider_session: str | None = None,
    shown: sa.ColumnElement[bool] | None = None,
) -> Me:
    """Give a browser a session of somebody; what it had ends.

    Args:
        request: Of the browser.
        response: To it.
        consoles: Of the league.
        user: Who comes in.
        provider_session: Of who came through a provider: its name for that.
        shown: What they came in by (`racecraft.serve.people.keys`); None of what there was only once.

    Raises:
        NotLetIn: They were shut out while they came.
    """
    guard: Guard = request.app.state.guard
    try:
        secret = consoles.keys.open_session(user, provider_session=provider_session, shown=shown)
    except NotLetIn:
        write_down(request, consoles, user, is_in=False)
        raise
    write_down(request, consoles, user)
    consoles.keys.close_session(request.cookies.get(COOKIE, ""))  # whoever was here before is so no longer
    guard.give_cookie(response, secret)
    return me_of(consoles.people.get(user))


def fail(request: Request, consoles: Consoles) -> None:
    """Count and keep that somebody was not let in by a secret that nobody guesses; nobody knows who they are.

    Raises:
        TooMany: There were too many such.
    """
    consoles.tries.wrong_secret(address=caller(request))
    write_down(request, consoles, None, is_in=False)


def write_down(request: Request, consoles: Consoles, user: int | None, *, is_in: bool = True) -> None:
    """Keep who came and from where; of who was not let in, whom they said they were, if there is such a one."""
    what = request.scope["route"].name + ("" if is_in else "_failed")
    consoles.audit.note(user, what, request.url.path, address=caller(request))


def _named(consoles: Consoles, name: str) -> int | None:
    try:
        return consoles.people.named(name).id
    except NotFound:
        return None
