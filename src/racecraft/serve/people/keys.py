"""What opens the door: sessions of browsers, printed cards, tokens of programs. Only hashes of them are kept.

Each holds 256 random bits (a card 128, as it has to be scanned), so a plain SHA-256 is hash enough.
"""

from __future__ import annotations

import hashlib
import secrets
from collections.abc import Collection
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, Final, Literal

import sqlalchemy as sa
from sqlalchemy.orm import Session as Transaction

from racecraft.errors import RunError
from racecraft.serve.problems import Conflict, NotFound, NotLetIn
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import Card, Identity, Reset, Session, Token, User, now

Scope = Literal["read", "submit", "worker"]
WORKER: Final = "worker"
SESSION_DAYS: Final = 30
MAX_SESSIONS: Final = 20  # of a person; the oldest makes room
SESSION_ID: Final = 16
"""Signs of a session's digest that it is known by."""
RESET_HOURS: Final = 24
MAX_TOKENS: Final = 20
SIGNS: Final = "23456789ABCDEFGHJKMNPQRSTUVWXYZ"
"""Of what people type, codes and cards: none of them is taken for another."""
CARD_LENGTH: Final = 26
"""26 of 31 signs hold 128 bits."""
OPENERS: Final = (Card, Reset, Session, Token)
"""Tables of what opens the door by itself."""
OUT: Final = "You are not signed in."
TOKEN_MARK: Final = "rc_"
"""What tokens begin with, so that whoever finds one knows what it is."""
# what every request asks is put together once, as that takes longer than the answer
_SESSION: Final = sa.select(Session.user_id).where(
    Session.digest == sa.bindparam("digest"),
    sa.or_(Session.expires.is_(None), Session.expires > sa.bindparam("moment", type_=Session.expires.type)),
)
_BEARER: Final = (
    sa.select(Token.user_id, Token.scopes, Token.id, User.role)
    .join(User, User.id == Token.user_id)
    .where(Token.digest == sa.bindparam("digest"), Token.expires > sa.bindparam("moment", type_=Token.expires.type))
    .where(User.deleted.is_(None))
)


@dataclass(frozen=True)
class TokenCard:
    """A token as its owner sees it."""

    id: int
    title: str
    scopes: list[str]
    created: datetime
    expires: datetime


@dataclass(frozen=True)
class Bearer:
    """Who shows a token."""

    user_id: int
    scopes: list[str]
    """What it may be used for."""
    token: int
    """Its number."""


@dataclass(frozen=True)
class OpenSession:
    """A browser that is signed in."""

    id: str
    """The beginning of what is kept of its cookie, which opens nothing."""
    created: datetime
    expires: datetime | None
    is_this: bool


class Keys:
    """Everybody's sessions, cards and tokens."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def open_session(
        self,
        user_id: int,
        *,
        days: int | None = SESSION_DAYS,
        provider_session: str | None = None,
        shown: sa.ColumnElement[bool] | None = None,
    ) -> str:
        """Let a browser in; its cookie.

        Args:
            user_id: Who comes in.
            days: That they stay.
            provider_session: Of one that came through a provider, its name for the sign-in, or empty.
            shown: What they came in by, which has to be good still: it was looked at before, and who was shut out
                since would have a session that nobody ends.

        Raises:
            NotLetIn: They were shut out meanwhile.
        """
        secret = secrets.token_urlsafe(32)
        expires = None if days is None else now() + timedelta(days=days)
        with self._database.transaction() as session:
            hold_account(session, user_id)
            user = session.get_one(User, user_id)
            is_shown = shown is None or session.scalar(sa.select(shown))
            if user.is_locked or user.deleted is not None or not is_shown:
                raise NotLetIn("You are locked out.", hint="Ask whoever holds your group.")
            mine = Session(digest=digest_of(secret), user_id=user_id, expires=expires)
            mine.provider_session = provider_session
            session.add(mine)
            session.execute(sa.delete(Session).where(Session.expires < now()))
            session.flush()
            if days is not None:
                ordered = sa.select(Session.digest).where(Session.user_id == user_id).order_by(Session.created.desc())
                for digest in session.scalars(ordered.offset(MAX_SESSIONS)).all():
                    session.execute(sa.delete(Session).where(Session.digest == digest))
        return secret

    def session_user(self, secret: str) -> int | None:
        """Whose cookie it is."""
        with self._database.asking() as connection:
            found: int | None = connection.scalar(_SESSION, {"digest": digest_of(secret), "moment": now()})
        return found

    def open_sessions(self, secrets: Collection[str]) -> set[str]:
        """Those of some cookies that are somebody's, by one question."""
        by_digest = {digest_of(secret): secret for secret in secrets}
        is_valid = sa.or_(Session.expires.is_(None), Session.expires > now())
        query = sa.select(Session.digest).where(Session.digest.in_(by_digest), is_valid)
        with self._database.transaction() as session:
            return {by_digest[digest] for digest in session.scalars(query)}

    def close_session(self, secret: str) -> None:
        """Sign a browser out."""
        with self._database.transaction() as session:
            session.execute(sa.delete(Session).where(Session.digest == digest_of(secret)))

    def sessions(self, user_id: int, *, this: str) -> list[OpenSession]:
        """Somebody's browsers, newest first; `this` is the cookie of the one that asks."""
        is_valid = sa.or_(Session.expires.is_(None), Session.expires > now())
        query = sa.select(Session).where(Session.user_id == user_id, is_valid).order_by(Session.created.desc())
        with self._database.transaction() as session:
            found = session.scalars(query).all()
        mine = digest_of(this)
        return [OpenSession(s.digest[:SESSION_ID], s.created, s.expires, s.digest == mine) for s in found]

    def end_session(self, user_id: int, session_id: str) -> None:
        """Sign one browser out.

        Raises:
            NotFound: There is none of this number.
        """
        is_it = sa.and_(Session.user_id == user_id, sa.func.substr(Session.digest, 1, SESSION_ID) == session_id)
        with self._database.transaction() as session:
            if session.execute(sa.delete(Session).where(is_it)).rowcount == 0:  # type: ignore[attr-defined]
                raise NotFound("There is no such session.")

    def end_provider_sessions(self, issuer: str, *, subject: str, provider_session: str, before: datetime) -> list[int]:
        """A provider has signed somebody out: so are the browsers that came through it, with what it still goes by.

        Args:
            issuer: The provider.
            subject: Its name for somebody; empty if it names the sign-in alone.
            provider_session: Its name for the sign-in; empty for all of theirs.
            before: What began later is another sign-in.

        Returns:
            Whose they were.
        """
        theirs = sa.select(Identity.user_id).where(Identity.issuer == issuer)
        if subject:
            theirs = theirs.where(Identity.subject == subject)
        names = (provider_session, "") if subject else (provider_session,)
        is_it = sa.and_(
            Session.user_id.in_(theirs),
            Session.provider_session.in_(names) if provider_session else Session.provider_session.is_not(None),
            Session.created <= before,
        )
        with self._database.transaction() as session:
            found = session.scalars(sa.select(Session.user_id).where(is_it).distinct()).all()
            session.execute(sa.delete(Session).where(is_it))
        return list(found)

    def close_sessions(self, user_id: int) -> None:
        """Sign somebody out everywhere."""
        with self._database.transaction() as session:
            session.execute(sa.delete(Session).where(Session.user_id == user_id))

    def print_card(self, user_id: int) -> str:
        """A new card's secret; an earlier card of the same person is worth nothing from now on."""
        secret = "".join(secrets.choice(SIGNS) for _ in range(CARD_LENGTH))
        with self._database.transaction() as session:
            hold_account(session, user_id)  # of two at the same moment the second finds the other's
            session.execute(sa.delete(Card).where(Card.user_id == user_id))
            session.add(Card(digest=digest_of(secret), user_id=user_id))
        return secret

    def card_user(self, secret: str) -> int | None:
        """Whose card it is."""
        return self._user(sa.select(Card.user_id).where(Card.digest == digest_of(plain_code(secret))))

    def make_reset(self, user_id: int) -> str:
        """The secret of a link for a new password; an earlier one is worth nothing from now on."""
        secret = secrets.token_urlsafe(32)
        with self._database.transaction() as session:
            hold_account(session, user_id)  # of two at the same moment the second finds the other's
            session.execute(sa.delete(Reset).where(Reset.user_id == user_id))
            expires = now() + timedelta(hours=RESET_HOURS)
            session.add(Reset(digest=digest_of(secret), user_id=user_id, expires=expires))
        return secret

    def reset_user(self, secret: str) -> int | None:
        """Who may give themselves a new password with it."""
        return self._user(sa.select(Reset.user_id).where(Reset.digest == digest_of(secret), Reset.expires > now()))

    def use_reset(self, secret: str, password: str) -> int | None:
        """A new password, given as its hash; all that opened the door before is worth nothing from now on."""
        is_it = sa.and_(Reset.digest == digest_of(secret), Reset.expires > now())
        with self._database.transaction() as session:
            user_id: int | None = session.scalar(sa.select(Reset.user_id).where(is_it))
            if user_id is None or session.execute(sa.delete(Reset).where(is_it)).rowcount != 1:  # type: ignore[attr-defined]
                return None
            hold_account(session, user_id)
            revoke_all(session, user_id)
            user = session.get_one(User, user_id)
            user.password, user.is_locked = password, False
        return user_id

    def revoke(self, user_id: int) -> None:
        """All that opens the door to somebody: cards, sessions, tokens; provider and password do so no longer."""
        with self._database.transaction() as session:
            hold_account(session, user_id)
            for table in OPENERS:
                session.execute(sa.delete(table).where(table.user_id == user_id))
            session.execute(sa.update(Identity).where(Identity.user_id == user_id).values(is_locked=True))
            user = session.get_one(User, user_id)
            user.is_locked = bool(user.password)  # who has none is let in again by a new card

    def admit(self, user_id: int) -> None:
        """Somebody who was locked out comes in by password and through a provider again."""
        with self._database.transaction() as session:
            session.execute(sa.update(Identity).where(Identity.user_id == user_id).values(is_locked=False))
            session.get_one(User, user_id).is_locked = False

    def make_token(
        self, user_id: int, *, title: str, scopes: list[Scope], days: int, asked_in: str = ""
    ) -> tuple[int, str]:
        """A token's number and secret, which is shown once.

        Args:
            user_id: Whose.
            title: Of it.
            scopes: What it is for.
            days: That it is good.
            asked_in: The digest of the session in which somebody asks for it; empty for the command line.

        Raises:
            Conflict: There are too many.
            NotLetIn: That session is over.
            RunError: It is for a worker, and for something else, too, or not an admin's.
        """
        if WORKER in scopes and len(set(scopes)) > 1:
            raise RunError("A worker's token is for nothing else.", hint="Make another one for that.")
        secret = TOKEN_MARK + secrets.token_urlsafe(32)
        with self._database.transaction() as session:
            require_still_in(session, user_id, asked_in)
            if WORKER in scopes and session.get_one(User, user_id).role != "admin":
                raise RunError("Only whoever holds the league makes tokens for workers.")
            session.execute(sa.delete(Token).where(Token.expires < now()))
            count = session.scalar(sa.select(sa.func.count(Token.id)).where(Token.user_id == user_id)) or 0
            if count >= MAX_TOKENS:
                raise Conflict(f"You have {MAX_TOKENS} tokens already.", hint="Remove one that you no longer need.")
            token = Token(
                digest=digest_of(secret),
                user_id=user_id,
                title=title,
                scopes=list(dict.fromkeys(scopes)),
                expires=now() + timedelta(days=days),
            )
            session.add(token)
            session.flush()
            return token.id, secret

    def tokens(self, user_id: int) -> list[TokenCard]:
        """Somebody's tokens, newest first."""
        query = sa.select(Token).where(Token.user_id == user_id, Token.expires > now()).order_by(Token.id.desc())
        with self._database.transaction() as session:
            return [TokenCard(t.id, t.title, t.scopes, t.created, t.expires) for t in session.scalars(query)]

    def remove_token(self, user_id: int, token_id: int) -> None:
        """A token is worth nothing from now on.

        Raises:
            NotFound: There is none of this number.
        """
        gone = sa.delete(Token).where(Token.id == token_id, Token.user_id == user_id)
        with self._database.transaction() as session:
            if session.execute(gone).rowcount != 1:  # type: ignore[attr-defined]
                raise NotFound(f"There is no token {token_id}.")

    def bearer(self, secret: str) -> Bearer | None:
        """Whose token it is, and what it may be used for now: workers are those of an admin."""
        with self._database.asking() as connection:
            found = connection.execute(_BEARER, {"digest": digest_of(secret), "moment": now()}).first()
        if found is None:
            return None
        user_id, scopes, number, role = found
        return Bearer(user_id, [scope for scope in scopes if scope != WORKER or role == "admin"], number)

    def worker_tokens(self) -> set[int]:
        """The numbers of the tokens that workers may show."""
        query = sa.select(Token.id, Token.scopes).join(User, User.id == Token.user_id)
        query = query.where(Token.expires > now(), User.deleted.is_(None), User.role == "admin")
        with self._database.transaction() as session:
            return {number for number, scopes in session.execute(query) if WORKER in scopes}

    def _user(self, query: sa.Select[Any]) -> int | None:
        with self._database.transaction() as session:
            found: int | None = session.scalar(query)
        return found


def hold_account(session: Transaction, user_id: int) -> None:
    """Keep others from giving somebody keys, or taking them, until the transaction ends, in either database."""
    session.execute(sa.update(User).where(User.id == user_id).values(name=User.name))


def require_still_in(session: Transaction, user_id: int, asked_in: str) -> None:
    """Hold an account in which something is to be kept that opens the door, and look once more who asked for it.

    A request that was let in may take long: its body comes slowly, a password is hashed, a provider is asked. Whoever
    is shut out meanwhile must not find a key in hand.

    Args:
        session: A transaction that has read nothing yet of the account.
        user_id: Whose account.
        asked_in: The digest of the session of the request; empty where it has none, as on the command line.

    Raises:
        NotLetIn: That session is over.
    """
    hold_account(session, user_id)
    is_valid = sa.or_(Session.expires.is_(None), Session.expires > now())
    is_it = sa.and_(Session.digest == asked_in, Session.user_id == user_id, is_valid)
    if asked_in and session.scalar(sa.select(Session.user_id).where(is_it)) is None:
        raise NotLetIn(OUT)


def shows_card(secret: str) -> sa.ColumnElement[bool]:
    """Whether a card is good."""
    return sa.exists().where(Card.digest == digest_of(plain_code(secret)))


def has_password(user_id: int, kept: str) -> sa.ColumnElement[bool]:
    """Whether somebody's password is that of which this is kept."""
    return sa.exists().where(User.id == user_id, User.password == kept)


def comes_through(issuer: str, subject: str) -> sa.ColumnElement[bool]:
    """Whether a provider lets somebody in."""
    return sa.exists().where(Identity.issuer == issuer, Identity.subject == subject, Identity.is_locked.is_(False))


def revoke_all(session: Transaction, user_id: int) -> None:
    """Remove all keys of somebody, and that they come in through a provider."""
    for table in (*OPENERS, Identity):
        session.execute(sa.delete(table).where(table.user_id == user_id))


def plain_code(typed: str) -> str:
    """A code or a card's secret as it is kept, however it was typed: ``abcd-efgh`` is ``ABCDEFGH``."""
    return "".join(sign for sign in typed.upper() if sign in SIGNS)


def digest_of(secret: str) -> str:
    """What is kept of a secret."""
    return hashlib.sha256(secret.encode(errors="surrogatepass")).hexdigest()
