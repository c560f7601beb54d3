"""Groups: who is in them and as what, and the codes by which people come in.

    invitation ──code──▶ join: an account, and a member of the group      (a class scans the code from the wall)
    organiser ──names──▶ members with cards                               (a class gets printed cards)

To who is not in a group it does not exist. One that is closed keeps all that it has: nobody comes in, and no race is
made.
"""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final, Literal

import sqlalchemy as sa
from sqlalchemy.orm import Session, aliased

from racecraft.serve.people.identities import add_identity
from racecraft.serve.people.keys import SIGNS, hold_account, plain_code
from racecraft.serve.people.names import checked_name
from racecraft.serve.people.people import Person, Role, add_person, use_invitation
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.races.state import state_of
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Card, Group, Identity, Invitation, Member, Race, User, now

Part = Literal["organiser", "racer"]
CODE_LENGTH: Final = 8
"""Eight of 31 signs are some 10**12 codes: with 200 tries in ten minutes from an address, finding one of ten takes
it eight thousand years on average."""
MAX_GROUPS: Final = 100  # of an organiser
MAX_MEMBERS: Final = 500


@dataclass(frozen=True)
class GroupMember:
    """Somebody in a group."""

    id: int
    name: str
    role: Part
    real_name: str
    has_card: bool
    comes_by_provider: bool
    is_locked: bool
    """Whether they were locked out, and neither password nor provider lets them in."""
    is_home: bool
    """Whether they came in here."""
    has_password: bool


@dataclass(frozen=True)
class GroupOfMine:
    """A group as one of those that somebody is in."""

    id: int
    title: str
    part: Part
    racers: int
    closed: datetime | None


@dataclass(frozen=True)
class Joining:
    """A code by which people come in."""

    code: str
    uses_left: int
    expires: datetime


class Groups:
    """All groups.

    Args:
        database: That they are in.
        issuer: The provider through which people sign in; empty where there is none.
    """

    def __init__(self, database: Database, *, issuer: str = "") -> None:
        self._database, self._issuer = database, issuer

    def create(self, title: str, *, by: Person) -> int:
        """A new group, whose organiser is who makes it; its number.

        Raises:
            NotFound: Only organisers may.
            Conflict: There are too many.
        """
        if not by.may_organise:
            raise NotFound("Only organisers make groups.")
        with self._database.transaction() as session:
            hold_account(session, by.id)  # two at the same moment count each other
            count = session.scalar(sa.select(sa.func.count()).where(Member.user_id == by.id)) or 0
            if count >= MAX_GROUPS:
                raise Conflict(f"You are in {MAX_GROUPS} groups already.")
            group = Group(title=title.strip())
            session.add(group)
            session.flush()
            session.add(Member(group_id=group.id, user_id=by.id, role="organiser"))
            return group.id

    def of(self, user_id: int) -> list[GroupOfMine]:
        """The groups that somebody is in, those that are closed last, else the newest first."""
        others = aliased(Member)
        racers = sa.select(sa.func.count()).where(others.group_id == Group.id, others.role == "racer")
        query = sa.select(Group.id, Group.title, Member.role, racers.scalar_subquery(), Group.closed)
        query = query.join(Member, Member.group_id == Group.id).where(Member.user_id == user_id)
        query = query.order_by(sa.case((Group.closed.is_(None), 0), else_=1), Group.id.desc())
        with self._database.transaction() as session:
            return [
                GroupOfMine(id=row[0], title=row[1], part=_part(row[2]), racers=row[3], closed=row[4])
                for row in session.execute(query)
            ]

    def change(self, group_id: int, *, title: str | None = None, is_closed: bool | None = None) -> None:
        """Call a group otherwise, close it or open it again; None leaves it as it is. Its code is gone with closing.

        Raises:
            Conflict: It is to be closed, and not all of its races are over.
        """
        with self._database.transaction() as session:
            hold_group(session, group_id)  # nobody comes in meanwhile, nor is a race made
            group = session.get_one(Group, group_id)
            if title is not None:
                group.title = title.strip()
            if is_closed is False:
                group.closed = None
            if is_closed and group.closed is None:
                _require_over(session, group_id)
                session.execute(sa.delete(Invitation).where(Invitation.group_id == group_id))
                group.closed = now()

    def closed(self, group_id: int) -> datetime | None:
        """Since when a group is closed; None of one that is open."""
        with self._database.transaction() as session:
            return session.get_one(Group, group_id).closed

    def title(self, group_id: int) -> str:
        """Of a group."""
        with self._database.transaction() as session:
            return session.get_one(Group, group_id).title

    def known(self, group_id: int) -> int:
        """A group's number.

        Raises:
            NotFound: There is no such group.
        """
        with self._database.transaction() as session:
            if session.get(Group, group_id) is None:
                raise NotFound(f"There is no group {group_id}.")
        return group_id

    def part(self, group_id: int, user_id: int) -> Part | None:
        """What somebody is in a group; None for who is not in it."""
        with self._database.transaction() as session:
            member = session.get(Member, (group_id, user_id))
            return None if member is None else _part(member.role)

    def require(self, group_id: int, user_id: int, *, organiser: bool = False) -> Part:
        """What somebody is in a group.

        Raises:
            NotFound: They are not in it, or not its organiser where that is asked for.
        """
        part = self.part(group_id, user_id)
        if part is None or (organiser and part != "organiser"):
            raise NotFound(f"There is no group {group_id} {'of yours' if organiser else 'that you are in'}.")
        return part

    def may_look(self, user_id: int, other: int) -> bool:
        """Whether somebody organises the group by which the other one came in."""
        mine, theirs = aliased(Member), aliased(Member)
        query = sa.select(mine.group_id).join(theirs, mine.group_id == theirs.group_id)
        query = query.where(mine.user_id == user_id, mine.role == "organiser")
        query = query.where(theirs.user_id == other, theirs.role == "racer", theirs.is_home).limit(1)
        with self._database.transaction() as session:
            return session.scalar(query) is not None

    def members(self, group_id: int) -> list[GroupMember]:
        """Everybody in a group, organisers first, by name."""
        has_card = sa.exists().where(Card.user_id == User.id)
        has_password = User.password != ""
        columns = (Member.role, Member.real_name, has_card, Identity.is_locked, Member.is_home, has_password)
        query = sa.select(User.id, User.name, *columns, User.is_locked)
        query = query.join(Member, Member.user_id == User.id).where(Member.group_id == group_id)
        mine = sa.and_(Identity.user_id == User.id, Identity.issuer == self._issuer)
        query = query.outerjoin(Identity, mine)
        with self._database.transaction() as session:
            rows = session.execute(query.order_by(Member.role, User.name)).all()
        return [
            GroupMember(
                id=row[0],
                name=row[1],
                role=_part(row[2]),
                real_name=row[3],
                has_card=bool(row[4]),
                comes_by_provider=row[5] is not None,
                is_locked=bool(row[5]) or row[8],
                is_home=row[6],
                has_password=bool(row[7]),
            )
            for row in rows
        ]

    def add(self, group_id: int, people: list[tuple[str, str]]) -> list[int]:
        """New accounts in a group, by name and real name; their numbers.

        Raises:
            Conflict: A name is taken, or the group is full or closed; nobody is added.
        """
        with self._database.transaction() as session:
            _require_room(session, group_id, len(people))
            numbers = []
            for name, real_name in people:
                user_id = add_person(session, name)
                session.add(_newcomer(group_id, user_id, real_name.strip()))
                numbers.append(user_id)
            return numbers

    def racer(self, group_id: int, user_id: int) -> None:
        """Make sure that somebody races in a group.

        Raises:
            NotFound: They do not.
        """
        if self.part(group_id, user_id) != "racer":
            raise NotFound(f"There is no racer {user_id} in this group.")

    def ward(self, group_id: int, user_id: int) -> None:
        """Make sure that somebody races in a group and came in by it.

        Raises:
            NotFound: They do not, or by another one.
        """
        with self._database.transaction() as session:
            member = session.get(Member, (group_id, user_id))
            if member is None or _part(member.role) != "racer":
                raise NotFound(f"There is no racer {user_id} in this group.")
            if not member.is_home:
                raise NotFound("They came in by another group, whose organisers do that.")

    def set_real_name(self, group_id: int, user_id: int, real_name: str) -> None:
        """What only the organisers see."""
        with self._database.transaction() as session:
            session.get_one(Member, (group_id, user_id)).real_name = real_name.strip()

    def leave(self, group_id: int, user_id: int) -> None:
        """Somebody leaves a group by themselves.

        Raises:
            Conflict: They came in by it and have no password: whoever held their card could take them out of its hands.
        """
        with self._database.transaction() as session:
            is_home = session.get_one(Member, (group_id, user_id)).is_home
            if is_home and not session.get_one(User, user_id).password:
                raise Conflict(
                    "You came in by this group.", hint="Ask who organises it, or give yourself a password first."
                )
        self.remove(group_id, user_id)

    def remove(self, group_id: int, user_id: int) -> None:
        """Somebody leaves a group."""
        with self._database.transaction() as session:
            session.execute(sa.delete(Member).where(Member.group_id == group_id, Member.user_id == user_id))

    def open(self, group_id: int | None, *, role: Role, uses: int, hours: int) -> Joining:
        """A new code; of a group an earlier one is worth nothing from now on.

        Raises:
            Conflict: The group is closed.
        """
        code = "".join(secrets.choice(SIGNS) for _ in range(CODE_LENGTH))
        invitation = Invitation(
            code=code, group_id=group_id, role=role, uses_left=uses, expires=now() + timedelta(hours=hours)
        )
        with self._database.transaction() as session:
            if group_id is not None:
                require_open(session, group_id)  # of two at the same moment the second finds the other's
                session.execute(sa.delete(Invitation).where(Invitation.group_id == group_id))
            session.add(invitation)
        return Joining(code, uses, invitation.expires)

    def joining(self, group_id: int) -> Joining | None:
        """The code of a group that is good now."""
        is_good = sa.and_(Invitation.group_id == group_id, Invitation.uses_left > 0, Invitation.expires > now())
        with self._database.transaction() as session:
            found = session.scalars(sa.select(Invitation).where(is_good)).first()
        return None if found is None else Joining(found.code, found.uses_left, found.expires)

    def close(self, group_id: int) -> None:
        """Nobody comes in by code any more."""
        with self._database.transaction() as session:
            session.execute(sa.delete(Invitation).where(Invitation.group_id == group_id))

    def join(self, code: str, name: str) -> int | None:
        """A new account by a code; its number, or None where the code is wrong, used up or too old.

        Raises:
            Conflict: The name is taken or the group is full; that costs no use.
        """
        checked_name(name)
        with self._database.transaction() as session:
            invitation = use_invitation(session, plain_code(code))
            if invitation is None:
                return None
            role: Role = "organiser" if invitation.role == "organiser" else "racer"
            user_id = add_person(session, name, role=role)
            if invitation.group_id is not None:
                _require_room(session, invitation.group_id, 1)
                session.add(_newcomer(invitation.group_id, user_id))
            return user_id

    def welcome(self, name: str, whom: tuple[str, str], *, group_id: int | None, real_name: str) -> int:
        """A new account of somebody whom a provider knows; its number.

        Args:
            name: That they chose.
            whom: The provider's name, and its name for them.
            group_id: That they join.
            real_name: For its organisers; of who joins none it is not kept.

        Raises:
            Conflict: The name is taken, the group is full or not there, or they have an account.
        """
        with self._database.transaction() as session:
            user_id = add_person(session, name)
            add_identity(session, user_id, *whom)
            if group_id is not None:
                if session.get(Group, group_id) is None:
                    raise Conflict(
                        f"Newcomers join group {group_id}, which does not exist.",
                        hint="Whoever holds the league looks at --provider-group.",
                    )
                _require_room(session, group_id, 1)
                session.add(_newcomer(group_id, user_id, real_name))
            return user_id

    def join_on(self, code: str, user_id: int) -> int | None:
        """Into a group by its code, with an account that there is; the group's number, or None for a wrong code.

        A racer whom no group took in, or who left the one that did, has come in by this one from now on; who has a
        password or makes groups belongs to nobody.
        """
        with self._database.transaction() as session:
            invitation = use_invitation(session, plain_code(code))
            if invitation is None:
                return None
            if invitation.group_id is None:
                raise Conflict("This code makes an account; you have one.")  # and it keeps its use
            member = session.get(Member, (invitation.group_id, user_id))
            if member is None:
                _require_room(session, invitation.group_id, 1)
                member = Member(group_id=invitation.group_id, user_id=user_id, role="racer")
                session.add(member)
            else:  # who is in already takes nobody's place
                invitation.uses_left += 1
            if member.role == "racer" and _needs_home(session, user_id):
                member.is_home = True
            return invitation.group_id


def _newcomer(group_id: int, user_id: int, real_name: str = "") -> Member:
    """Somebody who comes in by a group."""
    return Member(group_id=group_id, user_id=user_id, role="racer", real_name=real_name, is_home=True)


def _needs_home(session: Session, user_id: int) -> bool:
    """Whether somebody belongs to no group and may belong to one."""
    user = session.get_one(User, user_id)
    has_home = sa.select(sa.exists().where(Member.user_id == user_id, Member.is_home))
    return user.role == "racer" and not user.password and not session.scalar(has_home)


def hold_group(session: Session, group_id: int) -> None:
    """Keep others from letting people into a group, and its races from following others, until the transaction ends."""
    session.execute(sa.update(Group).where(Group.id == group_id).values(title=Group.title))


def require_open(session: Session, group_id: int) -> None:
    """Refuse what a group that is closed does not do, and keep it from being closed until the transaction ends.

    Raises:
        Conflict: It is closed.
    """
    hold_group(session, group_id)
    if session.get_one(Group, group_id, populate_existing=True).closed is not None:
        raise Conflict("The group is closed.", hint="Who organises it can open it again.")


def _require_over(session: Session, group_id: int) -> None:
    """Refuse as long as a race of a group can be entered, now or later.

    Raises:
        Conflict: One can.
    """
    races = session.scalars(sa.select(Race).where(Race.group_id == group_id, Race.deleted.is_(None)).order_by(Race.id))
    titles = [repr(race.title) for race in races if state_of(race) != "closed"]
    if titles:
        raise Conflict(
            f"A group is closed when its races are over; these are not: {', '.join(titles)}.",
            hint="End them or put them away first.",
        )


def _require_room(session: Session, group_id: int, more: int) -> None:
    """Refuse more members than a group may have, or any if it is closed; nobody else comes in until all is written."""
    require_open(session, group_id)
    count = session.scalar(sa.select(sa.func.count()).where(Member.group_id == group_id)) or 0
    if count + more > MAX_MEMBERS:
        raise Conflict(f"A group has at most {MAX_MEMBERS} members; this one has {count}.")


def _part(role: str) -> Part:
    return "organiser" if role == "organiser" else "racer"
