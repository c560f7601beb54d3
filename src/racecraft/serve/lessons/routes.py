"""Lessons: listed, read, answered; for organisers how far their group is."""

from __future__ import annotations

from functools import cache
from typing import Annotated, Final

from fastapi import APIRouter, Path, Response
from fastapi.responses import FileResponse

from racecraft.course.lesson import Lesson, lessons
from racecraft.course.page import LessonPage, facts_of, page_of
from racecraft.course.quiz import Language
from racecraft.course.shown import picture_path
from racecraft.serve.context import InConsoles, InPerson, InUser
from racecraft.serve.lessons.schemas import LessonCard, LessonProgress, LessonStep, MemberLessons
from racecraft.serve.lessons.studies import progress_of, record, with_solved
from racecraft.serve.problems import NotFound

router = APIRouter(prefix="/api", tags=["lessons"])

Number = Annotated[int, Path(ge=0, lt=100)]
Name = Annotated[str, Path(pattern=r"^[A-Za-z0-9_-]{1,64}$")]
Group = Annotated[int, Path(ge=0, lt=2**31)]
A_DAY: Final = {"Cache-Control": "private, max-age=86400"}


@router.get("/lessons")
def list_lessons(consoles: InConsoles, user: InUser) -> list[LessonCard]:
    """The course, and how far one is."""
    mine = progress_of(consoles.owner.database, [user])[user]
    cards = []
    for number, lesson in _all().items():
        progress = mine.get(number, LessonProgress())
        if not consoles.owner.settings.league:
            progress = with_solved(progress, number)
        cards.append(LessonCard(facts=facts_of(lesson), progress=progress))
    return cards


@router.get("/lessons/{lesson}")
def get_lesson(lesson: Number) -> LessonPage:
    """A lesson, whole."""
    return page_of(_find(lesson))


@router.get("/lessons/{lesson}/pictures/{picture}", response_class=FileResponse)
def get_lesson_picture(lesson: Number, picture: Name, language: Language = "en") -> Response:
    """A picture that a lesson made when it ran last, with words of a language."""
    path = picture_path(_find(lesson), picture, language)
    if not path.is_file():
        raise NotFound(f"Lesson {lesson} has no picture {picture!r}.")
    return FileResponse(path, media_type="image/webp", headers=A_DAY)


@router.put("/lessons/{lesson}/progress")
def record_lesson(lesson: Number, body: LessonStep, consoles: InConsoles, user: InUser) -> LessonProgress:
    """Somebody has read a lesson, or answered its questions."""
    found = _find(lesson)
    return record(consoles.owner.database, user, found, is_read=body.is_read, answers=body.answers)


@router.get("/groups/{group_id}/lessons")
def list_group_lessons(group_id: Group, consoles: InConsoles, person: InPerson) -> list[MemberLessons]:
    """How far the racers of a group are, for its organisers."""
    consoles.groups.require(group_id, person.id, organiser=True)
    racers = [member for member in consoles.groups.members(group_id) if member.role == "racer"]
    found = progress_of(consoles.owner.database, [member.id for member in racers])
    return [
        MemberLessons(id=member.id, name=member.name, real_name=member.real_name, lessons=found[member.id])
        for member in racers
    ]


@cache
def _all() -> dict[int, Lesson]:
    return {lesson.number: lesson for lesson in lessons()}


def _find(number: int) -> Lesson:
    try:
        return _all()[number]
    except KeyError as error:
        raise NotFound(f"There is no lesson {number}; there are {', '.join(map(str, _all()))}.") from error
