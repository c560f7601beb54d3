"""What a provider says of somebody, and whether it is true: its ID token."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from authlib.oidc.core import CodeIDToken
from joserfc.errors import ClaimError, ExpiredTokenError, JoseError
from joserfc.jwk import KeySet

from racecraft.serve.problems import NotLetIn
from racecraft.serve.provider.signature import LEEWAY, MAX_NAMED, decoded_of

TIMES: Final = ("exp", "iat", "nbf")


def verified(
    token: object,
    keys: Callable[[bool], KeySet],
    *,
    label: str,
    issuer: str,
    client: str,
    nonce: str,
    access_token: str,
) -> dict[str, Any]:
    """The claims of a token, once all of it was verified.

    Args:
        token: As it came.
        keys: The provider's; anew, if asked so.
        label: What people call the provider.
        issuer: Who must have signed it.
        client: Whom it must be meant for.
        nonce: Which sign-in it must belong to.
        access_token: That came with it.

    Raises:
        NotLetIn: It is not what it should be, with a sentence.
    """
    if not isinstance(token, str) or not token.isascii():
        raise NotLetIn(f"{label} did not say who you are.")
    decoded = decoded_of(token, keys, label)
    options: dict[str, Any] = {
        "iss": {"essential": True, "value": issuer},
        "aud": {"essential": True, "value": client},
        "sub": {"essential": True},
        "nonce": {"essential": True, "value": nonce},
    }
    params = {"client_id": client, "nonce": nonce, "access_token": access_token}
    claims = CodeIDToken(decoded.claims, decoded.header, options, params)
    try:
        claims.validate(leeway=LEEWAY)
    except ExpiredTokenError as error:
        raise _of_another_time(label) from error
    except ClaimError as error:
        raise _untrue(error, label) from error
    except (JoseError, ValueError, TypeError, AttributeError) as error:
        raise NotLetIn(f"What {label} says of you cannot be read.") from error
    subject = claims["sub"]
    if not isinstance(subject, str) or not 0 < len(subject) <= MAX_NAMED or not subject.isprintable():
        raise NotLetIn(f"What {label} says of you cannot be read.")
    return dict(claims)


def _untrue(error: ClaimError, label: str) -> NotLetIn:
    claim = error.claim.split(",")[0]
    if claim in TIMES:
        return _of_another_time(label)
    if claim == "iss":
        return NotLetIn(f"What came back is of another provider than {label}.")
    if claim in ("aud", "azp"):
        return NotLetIn(f"What {label} says is meant for somebody else than this league.")
    if claim == "nonce":
        return NotLetIn("What came back belongs to another sign-in.", hint="Begin again.")
    return NotLetIn(f"What {label} says of you cannot be read.")


def _of_another_time(label: str) -> NotLetIn:
    return NotLetIn(
        f"What {label} says is of another time than it is here.",
        hint="Begin again; if that does not help, one of the two clocks is wrong.",
    )
