"""Who signed what a provider says: by a key that only it has."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from joserfc import jwt
from joserfc.errors import BadSignatureError, InvalidKeyIdError, JoseError
from joserfc.jwk import KeySet
from joserfc.jws import JWSRegistry

from racecraft.serve.problems import NotLetIn

ALGORITHMS: Final = ("RS256", "RS384", "RS512", "PS256", "PS384", "PS512", "ES256", "ES384", "ES512")
"""Signatures by a key that only the provider has: neither ``none`` nor by a secret that is shared."""
LEEWAY: Final = 60  # s by which two clocks may differ
MAX_NAMED: Final = 255
"""Characters of a provider's name for somebody, or for a sign-in."""


def decoded_of(token: str, keys: Callable[[bool], KeySet], label: str) -> jwt.Token:
    """A token whose signature is true; what it says is still to be looked at.

    Args:
        token: As it came.
        keys: The provider's; anew, if asked so.
        label: What people call the provider.

    Raises:
        NotLetIn: It is not signed, or not by the provider.
    """
    registry = JWSRegistry(algorithms=ALGORITHMS, strict_check_header=False)
    try:
        try:
            return jwt.decode(token, keys(False), algorithms=ALGORITHMS, registry=registry)
        except InvalidKeyIdError:  # it may have begun to sign with another one
            return jwt.decode(token, keys(True), algorithms=ALGORITHMS, registry=registry)
    except (BadSignatureError, InvalidKeyIdError) as error:
        raise NotLetIn(f"What came back is not signed by {label}.") from error
    except (JoseError, ValueError, TypeError, KeyError) as error:
        raise NotLetIn(f"What came back is not signed in a way that proves anything of {label}.") from error
