"""What a provider says when somebody has signed out there, or may no longer sign in: its logout token.

OpenID Connect Back-Channel Logout 1.0, 2.4 and 2.6: https://openid.net/specs/openid-connect-backchannel-1_0.html
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any, Final

from joserfc import jwt
from joserfc.errors import ClaimError, ExpiredTokenError, JoseError
from joserfc.jwk import KeySet

from racecraft.serve.problems import NotLetIn
from racecraft.serve.provider.signature import LEEWAY, MAX_NAMED, decoded_of

EVENT: Final = "http://schemas.openid.net/event/backchannel-logout"
MAX_TOKEN: Final = 1 << 14
"""Characters; those of the large providers have a thousand."""
MAX_AGE: Final = 600  # s; who tries again for longer has a log that says so


@dataclass(frozen=True)
class SignedOut:
    """Whom a provider has signed out."""

    subject: str
    """Its name for them; empty if it names the sign-in alone."""
    session: str
    """Its name for the sign-in; empty for all of theirs."""
    before: datetime
    """What began later is another sign-in: a token that somebody sends again ends none of those."""


def signed_out(token: object, keys: Callable[[bool], KeySet], *, label: str, issuer: str, client: str) -> SignedOut:
    """What a token says, once all of it was verified.

    Args:
        token: As it came.
        keys: The provider's; anew, if asked so.
        label: What people call the provider.
        issuer: Who must have signed it.
        client: Whom it must be meant for.

    Raises:
        NotLetIn: It is not what it should be, with a sentence.
    """
    if not isinstance(token, str) or not token.isascii() or not 0 < len(token) <= MAX_TOKEN:
        raise NotLetIn("There is no logout token.", hint="It is the field logout_token of a form.")
    claims = decoded_of(token, keys, label).claims
    registry = jwt.JWTClaimsRegistry(
        leeway=LEEWAY,
        iss={"essential": True, "value": issuer},
        aud={"essential": True, "value": client},
        iat={"essential": True},
        jti={"essential": True},
    )
    try:
        registry.validate(claims)
        issued = datetime.fromtimestamp(claims["iat"], UTC)
    except ExpiredTokenError as error:
        raise _no_longer(label) from error
    except ClaimError as error:
        raise NotLetIn(f"The logout token of {label} has another {error.claim} than it should.") from error
    except (JoseError, ValueError, TypeError, OverflowError, OSError) as error:
        raise NotLetIn(f"The logout token of {label} cannot be read.") from error
    if datetime.now(UTC) - issued > timedelta(seconds=MAX_AGE + LEEWAY):
        raise _no_longer(label)
    events = claims.get("events")
    if not isinstance(events, dict) or not isinstance(events.get(EVENT), dict) or "nonce" in claims:
        raise NotLetIn(f"What {label} sent is no logout token.")  # an ID token, for one, signs nobody out
    subject, session = _name(claims, "sub", label), _name(claims, "sid", label)
    if not subject and not session:
        raise NotLetIn(f"The logout token of {label} names nobody.")
    return SignedOut(subject, session, issued + timedelta(seconds=LEEWAY))


def _name(claims: dict[str, Any], claim: str, label: str) -> str:
    name = claims.get(claim, "")
    if not isinstance(name, str) or len(name) > MAX_NAMED or not name.isprintable():
        raise NotLetIn(f"The logout token of {label} cannot be read.")
    return name


def _no_longer(label: str) -> NotLetIn:
    return NotLetIn(f"The logout token of {label} is no longer good.")
