"""The door through a school's or company's provider: there, back, and a name for who is new.

The provider sends browsers back to a page of the console, which brings what it was given: no address is ever taken from
anybody, so nobody is led elsewhere.
"""

from __future__ import annotations

from urllib.parse import parse_qsl

from fastapi import APIRouter, Request, Response
from fastapi.concurrency import run_in_threadpool

from racecraft.serve.context import AsksProvider, Consoles, InLeague
from racecraft.serve.door.guard import Guard, caller
from racecraft.serve.door.routes import fail, let_in, write_down
from racecraft.serve.people.keys import comes_through, digest_of
from racecraft.serve.people.links import address_of
from racecraft.serve.people.schemas import Arrived, FromProvider, Me, Newcomer, ToProvider, me_of
from racecraft.serve.problems import NotLetIn
from racecraft.serve.provider.visits import SECONDS
from racecraft.serve.replies import problem
from racecraft.serve.settings import COOKIE, PROVIDER_COOKIE, PROVIDER_PAGE

router = APIRouter(prefix="/api/door/provider", tags=["door"])


@router.post("", dependencies=[AsksProvider])
def begin_provider(request: Request, response: Response, consoles: InLeague) -> ToProvider:
    """To the provider's page."""
    provider = consoles.provider
    consoles.tries.begins("provider", address=caller(request))
    back = address_of(request, consoles.owner.settings) + PROVIDER_PAGE
    to, secret = provider.begin(back=back, user_id=None)
    guard: Guard = request.app.state.guard
    guard.send_away(response, secret, seconds=SECONDS)
    return ToProvider(to=to)


@router.post("/arrival", dependencies=[AsksProvider])
def sign_in_by_provider(request: Request, body: FromProvider, response: Response, consoles: InLeague) -> Arrived:
    """Back from there: in, or as somebody new, who has to choose a name; or with an account that is linked now."""
    from racecraft.serve.provider.provider import Answer  # there is one

    provider, here = consoles.provider, request.state.user_id
    browser = request.cookies.get(PROVIDER_COOKIE, "")
    try:
        whom, is_link = provider.arrive(Answer(**body.model_dump()), browser=browser, user_id=here)
        if is_link:
            asked_in = digest_of(request.cookies.get(COOKIE, ""))
            consoles.identities.link(here, whom.issuer, whom.subject, asked_in=asked_in)
            consoles.audit.note(here, "link_provider", request.url.path, address=caller(request))
            return Arrived(me=me_of(consoles.people.get(here)), is_linked=True)
        user = consoles.identities.user(whom.issuer, whom.subject)
    except NotLetIn:
        fail(request, consoles)
        raise
    if user is None:
        provider.newcomers.meet(browser, whom)
        return Arrived(me=None, is_linked=False)
    shown = comes_through(whom.issuer, whom.subject)
    me = let_in(request, response, consoles, user, provider_session=whom.session, shown=shown)
    return Arrived(me=me, is_linked=False)


@router.post("/newcomer", status_code=201)
def join_by_provider(request: Request, body: Newcomer, response: Response, consoles: InLeague) -> Me:
    """In for the first time, under a name that one chose."""
    provider = consoles.provider
    browser = request.cookies.get(PROVIDER_COOKIE, "")
    try:
        whom = provider.newcomers.who(browser)
    except NotLetIn:
        fail(request, consoles)
        raise
    user = consoles.groups.welcome(
        body.name, (whom.issuer, whom.subject), group_id=provider.settings.group, real_name=whom.real_name
    )
    provider.newcomers.forget(browser)
    return let_in(request, response, consoles, user, provider_session=whom.session)


@router.post(
    "/sign-out",
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {
                "application/x-www-form-urlencoded": {
                    "schema": {
                        "type": "object",
                        "required": ["logout_token"],
                        "properties": {"logout_token": {"type": "string", "title": "Logout Token"}},
                    }
                }
            },
        }
    },
)
async def sign_out_by_provider(request: Request, consoles: InLeague) -> Response:
    """From the provider itself: it has signed somebody out, and so does the league (*back-channel logout*)."""
    body = await request.body()  # before a place is taken: it may be long in coming
    async with consoles.provider.place():
        return await run_in_threadpool(_sign_out, request, consoles, body)


def _sign_out(request: Request, consoles: Consoles, body: bytes) -> Response:
    provider = consoles.provider
    try:
        out = provider.signed_out(_logout_token(body))
    except NotLetIn as error:
        fail(request, consoles)
        return problem(400, "NotLetIn", str(error), error.hint)  # as the standard has it
    ended = consoles.keys.end_provider_sessions(
        provider.issuer, subject=out.subject, provider_session=out.session, before=out.before
    )
    for user in ended:
        write_down(request, consoles, user)
    return Response(status_code=200)


def _logout_token(body: bytes) -> str | None:
    """What a form has in that field, once."""
    try:
        found = [value for name, value in parse_qsl(body.decode("ascii"), max_num_fields=20) if name == "logout_token"]
    except ValueError:
        return None
    return found[0] if len(found) == 1 else None
