"""What browser, command line and server tell each other about a league's races."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import Field

from racecraft.serve.conditions import AskedVehicle
from racecraft.serve.races.schemas import NewRace, RaceKind, RaceState, Ranking, Title
from racecraft.serve.schemas import Message, Moment, RunName

RaceForm = Literal["alone", "head-to-head", "bracket"]
"""Everybody against the clock, or two at a time: everyone against everyone, or who loses is out."""


class NewLeagueRace(NewRace):
    """A race for a group; a final in which two meet at a time is announced with the race that it follows."""

    form: RaceForm = "alone"
    after: int | None = Field(None, ge=0, lt=2**31)
    """The race whose first drive in this one."""
    best: int = Field(8, ge=1, le=500)
    """How many of its first: 2 to 8 where everyone meets everyone, 2 to 32 in a bracket."""


class LeagueRace(Message):
    """A race that several people enter."""

    id: int
    title: str
    description: str
    group: int
    group_title: str
    part: Literal["organiser", "racer", "spectator"]
    """What who looks is to it."""
    is_public: bool
    """Whether its board is shown to everybody."""
    kind: RaceKind
    form: RaceForm
    is_practice: bool
    """Whether everybody knows where it starts."""
    track: str
    track_title: str
    """What people call it, also who may not see the list of tracks."""
    laps: int
    time_limit: float
    """s on the clock after which a trial is over; 0 for none, as in races that were made before there was one."""
    direction: str
    """``forward`` or ``reverse``."""
    ranking: Ranking
    minimum_laps: int
    trials: int
    vehicle: AskedVehicle
    opens: datetime
    closes: datetime | None
    attempts_per_day: int
    """Of each person; 0 for as many as they like."""
    is_frozen: bool
    """Whether nobody may enter for the time being."""
    after: int | None
    """The race whose first drive in this one."""
    best_of_it: int
    state: RaceState
    commitment: str
    secret: str
    """64 hexadecimal digits, once the race is over."""


class LeagueRaceChange(Message):
    """What an organiser may change while a race is on."""

    title: Title | None = None
    description: str | None = Field(None, max_length=500)
    closes: Moment | None = None
    is_over: Literal[True] | None = None
    """To end it now, by the server's clock: that of whoever asks may be wrong."""
    is_public: bool | None = None
    is_frozen: bool | None = None
    attempts_per_day: int | None = Field(None, ge=0, le=1000)


class Stage(Message):
    """The race that another one follows, and how many of its first go on."""

    race: Annotated[int, Field(ge=0, lt=2**31)]
    best: int = Field(8, ge=1, le=500)


class SeasonResult(Message):
    """What somebody did in a race that is over."""

    race: int
    title: str
    place: int
    points: int
    """0 in qualifying, whose final gives them."""
    gap: float | None
    """Behind the first, as a fraction of its score; None of a final in which two meet at a time."""


class SeasonRow(Message):
    """Somebody's season in a group so far."""

    name: str
    points: int
    races: int
    """In which they have points."""
    wins: int
    is_me: bool
    results: list[SeasonResult]
    """The earliest race first, qualifying among them."""


class BoardRow(Message):
    """Somebody's best submission."""

    place: int | None
    """None without enough completed laps."""
    row: int
    """From 1; of equals, who was first."""
    submission: int
    name: str
    model: str
    is_me: bool
    score: float | None
    """s"""
    gap: float | None
    """s behind the first."""
    best_lap: float | None
    """s"""
    medal: str
    """Of its best lap on this track, ``author`` to ``bronze``; empty where it has none or the track has no times."""
    resets: int
    completion: float


class BoardPage(Message):
    """The board: the first ones, then the neighbours of whoever looks."""

    race: LeagueRace
    entrants: int
    """With a judged submission."""
    ranked: int
    running: int
    """Submissions that are not judged yet."""
    rows: list[BoardRow]
    mine: int | None
    """The row of whoever looks."""
    beaten: float | None
    """Per cent of the other entrants that they are ahead of."""


class Likeness(Message):
    """Whose earlier entry a submission drives like."""

    submission: int
    name: str
    model: str
    likeness: float
    """Of what both choose on hidden frames: 1 for the same, 0 for what chance gives."""


class SubmissionInfo(Message):
    """One's own submission, or for an organiser anybody's."""

    id: int
    name: str
    model: str
    digest: str
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    ahead: int
    """Submissions and evaluations that are driven before it."""
    seconds_left: float | None
    """About how long until it is judged, from how long the last ones took."""
    score: float | None
    best_lap: float | None
    completion: float
    error: dict[str, Any] | None
    disqualified: str
    """The reason."""
    is_looked_at: bool
    """Whether a person is to look at it, as it drives like somebody else's; it counts meanwhile."""
    like: Likeness | None
    """Whose, for an organiser who sees everybody's."""
    created: datetime
    has_replay: bool


class EnterModel(Message):
    """A model of one's own garage."""

    model: RunName
    checkpoint: Literal["best", "last"] = "best"


class SubmissionChange(Message):
    """What an organiser changes about somebody's submission."""

    model: RunName


class Disqualify(Message):
    """Why somebody's submission does not count."""

    reason: Annotated[str, Field(min_length=1, max_length=200, pattern=r"\S")]
