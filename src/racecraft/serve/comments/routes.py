"""Comments on models: organisers write them, whose models they are about reads them."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Query, Response

from racecraft.serve.comments.schemas import CommentInfo, NewComment
from racecraft.serve.context import InConsoles, InPerson

router = APIRouter(prefix="/api", tags=["league"])

Id = Annotated[int, Path(ge=0, lt=2**31)]
Member = Annotated[int, Query(ge=1, lt=2**31)]


@router.get("/comments")
def list_comments(consoles: InConsoles, person: InPerson) -> list[CommentInfo]:
    """What is said about one's own models, newest first."""
    return _about(consoles, person.id, user_id=person.id)


@router.delete("/comments/{comment_id}", status_code=204)
def remove_comment(comment_id: Id, consoles: InConsoles, person: InPerson) -> Response:
    """Take one back that one has written, or that is about a model of one's own."""
    consoles.comments.remove(comment_id, user_id=person.id)
    return Response(status_code=204)


@router.get("/groups/{group_id}/comments")
def list_group_comments(group_id: Id, member: Member, consoles: InConsoles, person: InPerson) -> list[CommentInfo]:
    """What is said about the models of a racer who came in by a group, for its organisers."""
    consoles.groups.require(group_id, person.id, organiser=True)
    consoles.groups.ward(group_id, member)
    return _about(consoles, member, user_id=person.id)


@router.post("/groups/{group_id}/comments", status_code=201)
def comment_on_model(group_id: Id, body: NewComment, consoles: InConsoles, person: InPerson) -> list[CommentInfo]:
    """Say something about a racer's model; all that is said about their models then."""
    consoles.groups.require(group_id, person.id, organiser=True)
    consoles.groups.ward(group_id, body.member)
    consoles.of(body.member).garage.folder(body.model)
    consoles.comments.add(body.member, body.model, body.text, author_id=person.id)
    return _about(consoles, body.member, user_id=person.id)


def _about(consoles: InConsoles, owner_id: int, *, user_id: int) -> list[CommentInfo]:
    names = [card.name for card in consoles.of(owner_id).garage.cards()]
    return consoles.comments.about(owner_id, names, user_id=user_id)
