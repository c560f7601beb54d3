"""What may be used: said by whoever holds the league and by organisers, seen by everybody of themselves."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Response

from racecraft.serve.context import Consoles, InConsoles, InPerson, OnlyAdmin
from racecraft.serve.quotas.quotas import Limits
from racecraft.serve.quotas.schemas import GroupQuota, MemberUsage, OwnQuota, QuotaInfo, UsageInfo

router = APIRouter(prefix="/api", tags=["quotas"])

Id = Annotated[int, Path(ge=0, lt=2**31)]


@router.get("/quota")
def get_quota(consoles: InConsoles, person: InPerson) -> OwnQuota:
    """What one may use, and does; null is without a limit."""
    return OwnQuota(
        limits=QuotaInfo(**vars(consoles.quotas.limits(person.id))),
        used=UsageInfo(**vars(consoles.quotas.usage([person.id]))),
    )


@router.get("/quotas", dependencies=[OnlyAdmin])
def get_everybodys_quota(consoles: InConsoles, person: InPerson) -> QuotaInfo:
    """What every racer may use, where nothing else is said."""
    return QuotaInfo(**vars(consoles.quotas.said("everybody")))


@router.put("/quotas", status_code=204, dependencies=[OnlyAdmin])
def set_everybodys_quota(body: QuotaInfo, consoles: InConsoles, person: InPerson) -> Response:
    """Say it."""
    consoles.quotas.say("everybody", _limits(body))
    return Response(status_code=204)


@router.put("/quotas/groups/{group_id}", status_code=204, dependencies=[OnlyAdmin])
def set_quota_together(group_id: Id, body: QuotaInfo, consoles: InConsoles, person: InPerson) -> Response:
    """What all racers of a group may use together; who holds the league need not be in it."""
    consoles.quotas.say("group", _limits(body), consoles.groups.known(group_id))
    return Response(status_code=204)


@router.get("/groups/{group_id}/quota")
def get_group_quota(group_id: Id, consoles: InConsoles, person: InPerson) -> GroupQuota:
    """What a group's racers may use and do, for its organisers."""
    consoles.groups.require(group_id, person.id, organiser=True)
    racers = [member.id for member in consoles.groups.members(group_id) if member.role == "racer"]
    return GroupQuota(
        each=QuotaInfo(**vars(consoles.quotas.said("each", group_id))),
        together=QuotaInfo(**vars(consoles.quotas.said("group", group_id))),
        used=UsageInfo(**vars(consoles.quotas.usage_together(group_id))),
        racers=[_member(consoles, racer) for racer in racers],
    )


@router.put("/groups/{group_id}/quota", status_code=204)
def set_group_quota(group_id: Id, body: QuotaInfo, consoles: InConsoles, person: InPerson) -> Response:
    """What each racer of a group may use."""
    consoles.groups.require(group_id, person.id, organiser=True)
    consoles.quotas.say("each", _limits(body), group_id)
    return Response(status_code=204)


@router.put("/groups/{group_id}/members/{member}/quota", status_code=204)
def set_member_quota(group_id: Id, member: Id, body: QuotaInfo, consoles: InConsoles, person: InPerson) -> Response:
    """What one racer may use who came in by a group, whatever is said of the others."""
    consoles.groups.require(group_id, person.id, organiser=True)
    consoles.groups.ward(group_id, member)
    consoles.quotas.say("person", _limits(body), member)
    return Response(status_code=204)


def _member(consoles: Consoles, racer: int) -> MemberUsage:
    quotas = consoles.quotas
    return MemberUsage(
        id=racer,
        said=QuotaInfo(**vars(quotas.said("person", racer))),
        limits=QuotaInfo(**vars(quotas.limits(racer))),
        used=UsageInfo(**vars(quotas.usage([racer]))),
    )


def _limits(said: QuotaInfo) -> Limits:
    return Limits(minutes=said.minutes, models=said.models, places=said.places)
