"""Groups: made, filled, opened by a code; cards; and what their members have made."""

from __future__ import annotations

import shutil
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory
from typing import Annotated, Final

from fastapi import APIRouter, Path, Request, Response

from racecraft.errors import RunError
from racecraft.serve.context import Consoles, InConsoles, InPerson
from racecraft.serve.door.guard import caller
from racecraft.serve.groups.groups import Joining
from racecraft.serve.groups.schemas import (
    CopyModel,
    GroupCard,
    GroupChange,
    GroupDetail,
    JoiningInfo,
    MemberChange,
    MemberInfo,
    MemberModels,
    NewGroup,
    NewMembers,
    OpenGroup,
    PrintCards,
    PrintedCards,
)
from racecraft.serve.live.cars import NAME as LIVE
from racecraft.serve.models.schemas import ModelCard
from racecraft.serve.people.links import address_of, card_of, picture
from racecraft.serve.people.people import Person
from racecraft.serve.people.schemas import JoinOn, LoginCard, NewReset, ResetLink
from racecraft.serve.problems import NotFound, NotLetIn

router = APIRouter(prefix="/api", tags=["groups"])

KEYS: Final = ("has_card", "has_password", "comes_by_provider", "is_locked", "is_home")
HIDDEN: Final = {"real_name": "", **dict.fromkeys(KEYS, False)}
"""What racers see of a member that only organisers know."""
Id = Annotated[int, Path(ge=0, lt=2**31)]


@router.get("/groups")
def list_groups(consoles: InConsoles, person: InPerson) -> list[GroupCard]:
    """The groups that one is in, those that are closed last, else the newest first."""
    return [GroupCard(**vars(group)) for group in consoles.groups.of(person.id)]


@router.post("/groups", status_code=201)
def create_group(request: NewGroup, consoles: InConsoles, person: InPerson) -> GroupCard:
    """A new group; only organisers make them."""
    number = consoles.groups.create(request.title, by=person)
    return GroupCard(id=number, title=request.title.strip(), part="organiser", racers=0, closed=None)


@router.post("/groups/join")
def join_group(body: JoinOn, request: Request, consoles: InConsoles, person: InPerson) -> GroupCard:
    """Into another group by its code, with the account that one has."""
    with consoles.tries.attempt(account=f"code {person.id}", address=caller(request), way="code") as attempt:
        number = consoles.groups.join_on(body.code, person.id)
        if number is None:
            attempt.fail()
            raise NotLetIn("There is no such code, or it is no longer good.", hint="Look at the wall again.")
    return next(card for card in list_groups(consoles, person) if card.id == number)


@router.get("/groups/{group_id}")
def get_group(group_id: Id, request: Request, consoles: InConsoles, person: InPerson) -> GroupDetail:
    """A group with its members; real names and the code are for its organisers."""
    part = consoles.groups.require(group_id, person.id)
    members = consoles.groups.members(group_id)
    joining = consoles.groups.joining(group_id) if part == "organiser" else None
    return GroupDetail(
        id=group_id,
        title=consoles.groups.title(group_id),
        part=part,
        racers=sum(member.role == "racer" for member in members),
        closed=consoles.groups.closed(group_id),
        members=[MemberInfo(**{**vars(member), **({} if part == "organiser" else HIDDEN)}) for member in members],
        joining=_joining(request, consoles, joining) if joining is not None else None,
    )


@router.patch("/groups/{group_id}", status_code=204)
def change_group(group_id: Id, body: GroupChange, consoles: InConsoles, person: InPerson) -> Response:
    """Another title; or close a group whose races are over, so that nobody comes in and no race is made; or open it."""
    consoles.groups.require(group_id, person.id, organiser=True)
    consoles.groups.change(group_id, title=body.title, is_closed=body.is_closed)
    return Response(status_code=204)


@router.post("/groups/{group_id}/joining")
def open_group(group_id: Id, body: OpenGroup, request: Request, consoles: InConsoles, person: InPerson) -> JoiningInfo:
    """A new code by which people come in; an earlier one is worth nothing from now on."""
    consoles.groups.require(group_id, person.id, organiser=True)
    return _joining(request, consoles, consoles.groups.open(group_id, role="racer", uses=body.uses, hours=body.hours))


@router.delete("/groups/{group_id}/joining", status_code=204)
def close_group(group_id: Id, consoles: InConsoles, person: InPerson) -> Response:
    """Nobody comes in by code any more."""
    consoles.groups.require(group_id, person.id, organiser=True)
    consoles.groups.close(group_id)
    return Response(status_code=204)


@router.post("/groups/{group_id}/members", status_code=201)
def add_members(
    group_id: Id, body: NewMembers, request: Request, consoles: InConsoles, person: InPerson
) -> list[LoginCard]:
    """Accounts for a class, and their cards."""
    consoles.groups.require(group_id, person.id, organiser=True)
    numbers = consoles.groups.add(group_id, [(one.name, one.real_name) for one in body.people])
    return _cards(request, consoles, numbers)


@router.patch("/groups/{group_id}/members/{member}", status_code=204)
def change_member(group_id: Id, member: Id, body: MemberChange, consoles: InConsoles, person: InPerson) -> Response:
    """Another name for somebody, which then stays, or a real name, which is each group's own."""
    consoles.groups.require(group_id, person.id, organiser=True)
    consoles.groups.racer(group_id, member)
    if body.name is not None:
        _require_own_racer(consoles, group_id, member, person.id)
        consoles.people.rename(member, body.name, by_organiser=True)
    if body.real_name is not None:
        consoles.groups.set_real_name(group_id, member, body.real_name)
    return Response(status_code=204)


@router.delete("/groups/{group_id}/members/{member}", status_code=204)
def remove_member(group_id: Id, member: Id, consoles: InConsoles, person: InPerson) -> Response:
    """Somebody leaves: put out by an organiser, or by themselves."""
    if member != person.id:
        consoles.groups.require(group_id, person.id, organiser=True)
        consoles.groups.racer(group_id, member)
        consoles.groups.remove(group_id, member)
        return Response(status_code=204)
    if consoles.groups.require(group_id, person.id) == "organiser":
        raise NotFound("An organiser does not leave the group.")
    consoles.groups.leave(group_id, member)
    return Response(status_code=204)


@router.post("/groups/{group_id}/members/{member}/revoke", status_code=204)
def revoke_member(group_id: Id, member: Id, consoles: InConsoles, person: InPerson) -> Response:
    """A lost card: it, all sessions and tokens of its owner are worth nothing; no password or provider lets them in."""
    _require_own_racer(consoles, group_id, member, person.id)
    consoles.keys.revoke(member)
    return Response(status_code=204)


@router.post("/groups/{group_id}/members/{member}/admit", status_code=204)
def admit_member(group_id: Id, member: Id, consoles: InConsoles, person: InPerson) -> Response:
    """Who was locked out is let in again, by the password or the provider that there was."""
    _require_own_racer(consoles, group_id, member, person.id)
    consoles.keys.admit(member)
    return Response(status_code=204)


@router.post("/groups/{group_id}/cards", status_code=201)
def print_cards(
    group_id: Id, body: PrintCards, request: Request, consoles: InConsoles, person: InPerson
) -> PrintedCards:
    """New cards for members who came in by a group and have no accounts of their own; earlier cards are worthless."""
    consoles.groups.require(group_id, person.id, organiser=True)
    members = consoles.groups.members(group_id)
    by_provider = {member.id for member in members if member.comes_by_provider}
    guests = {member.id for member in members if not member.is_home}
    wards: list[Person] = []
    others: list[Person] = []
    for member in dict.fromkeys(body.members):
        consoles.groups.racer(group_id, member)
        one = consoles.people.get(member)
        (others if member in by_provider | guests or _is_independent(one) else wards).append(one)
    if not wards:
        if others[0].id in by_provider:
            raise NotFound(f"{others[0].name} has an account of their own, through a provider.")
        _require_ward(consoles, group_id, others[0].id, person.id)
    cards = _cards(request, consoles, [ward.id for ward in wards])
    return PrintedCards(cards=cards, left_out=[one.name for one in others])


@router.get("/groups/{group_id}/models")
def list_group_models(group_id: Id, consoles: InConsoles, person: InPerson) -> list[MemberModels]:
    """What the racers have made who came in by a group, for its organisers."""
    consoles.groups.require(group_id, person.id, organiser=True)
    return [
        MemberModels(id=member.id, name=member.name, models=consoles.of(member.id).garage.cards())
        for member in consoles.groups.members(group_id)
        if member.role == "racer" and member.is_home
    ]


@router.post("/groups/{group_id}/models/copy", status_code=201)
def copy_model(group_id: Id, body: CopyModel, consoles: InConsoles, person: InPerson) -> ModelCard:
    """A racer's model, as it is, into an organiser's own garage, where nothing that is done to it is the racer's."""
    consoles.groups.require(group_id, person.id, organiser=True)
    consoles.groups.ward(group_id, body.member)
    theirs, ours = consoles.of(body.member).garage, consoles.of(person.id).garage
    source = theirs.folder(body.model)
    name = body.name or ours.name_beside(body.model)
    ours.require_new(name)
    incoming = consoles.of(person.id).settings.incoming
    try:
        incoming.mkdir(parents=True, exist_ok=True)
        # a folder of its own: who asks twice, or trains under that name, has another one arrive there meanwhile
        with TemporaryDirectory(prefix=f"{name}.", dir=incoming, ignore_cleanup_errors=True) as folder:
            copy = FilePath(folder) / name
            shutil.copytree(source.path, copy, ignore=shutil.ignore_patterns(".lock", f"{LIVE}*"))
            copy.rename(ours.runs / name)
    except (OSError, shutil.Error) as error:
        raise RunError(f"Model {body.model!r} cannot be copied now.", hint="Wait until its job has ended.") from error
    return ours.card(name)


@router.post("/invitations", status_code=201)
def invite_organisers(body: OpenGroup, request: Request, consoles: InConsoles, person: InPerson) -> JoiningInfo:
    """A code by which organisers come in; only an admin gives it."""
    if person.role != "admin":
        raise NotFound("Only whoever holds the league invites organisers.")
    return _joining(request, consoles, consoles.groups.open(None, role="organiser", uses=body.uses, hours=body.hours))


@router.post("/resets", status_code=201)
def make_reset(body: NewReset, request: Request, consoles: InConsoles, person: InPerson) -> ResetLink:
    """A link by which somebody gives themselves a new password, once. It is a way to be them, so an admin makes it."""
    if person.role != "admin":
        raise NotFound("Only whoever holds the league makes such a link.")
    found = consoles.people.named(body.person)
    address = address_of(request, consoles.owner.settings)
    return ResetLink(name=found.name, link=f"{address}/reset#{consoles.keys.make_reset(found.id)}")


def _joining(request: Request, consoles: Consoles, joining: Joining) -> JoiningInfo:
    link = f"{address_of(request, consoles.owner.settings)}/join#{joining.code}"
    return JoiningInfo(**vars(joining), link=link, picture=picture(link))


def _cards(request: Request, consoles: Consoles, members: list[int]) -> list[LoginCard]:
    address = address_of(request, consoles.owner.settings)
    return [
        card_of(address, consoles.keys.print_card(member), user_id=member, name=consoles.people.get(member).name)
        for member in members
    ]


def _require_ward(consoles: Consoles, group_id: int, member: int, user_id: int) -> None:
    """Make sure that somebody organises a group and a member is theirs to let in.

    Who has a password or makes groups is not, wherever they race, nor who came in by another group: a card would be a
    way to be them.

    Raises:
        NotFound: They are not.
    """
    consoles.groups.require(group_id, user_id, organiser=True)
    consoles.groups.racer(group_id, member)
    ward = consoles.people.get(member)
    if _is_independent(ward):
        raise NotFound(f"{ward.name} has an account of their own, with a password.")
    consoles.groups.ward(group_id, member)


def _require_own_racer(consoles: Consoles, group_id: int, member: int, user_id: int) -> None:
    """Make sure that somebody organises a group and a racer came in by it.

    Its organisers name them and lock them out, also with a password: neither is a way to be them.

    Raises:
        NotFound: They do not, or the racer did not, or has power.
    """
    consoles.groups.require(group_id, user_id, organiser=True)
    consoles.groups.ward(group_id, member)
    if (one := consoles.people.get(member)).may_organise:
        raise NotFound(f"{one.name} organises groups.")


def _is_independent(person: Person) -> bool:
    """Whether somebody is nobody's to let in, as they have a password or power."""
    return person.has_password or person.may_organise
