"""Where a provider does what, and the keys that it signs with: as it publishes them, kept for an hour."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, Generic, TypeVar

from joserfc.errors import JoseError
from joserfc.jwk import JWKRegistry, Key, KeySet

from racecraft.serve.provider.fetch import NoAnswer, fetch
from racecraft.serve.provider_settings import ProviderSettings, is_safe

PATH: Final = "/.well-known/openid-configuration"
KEPT: Final = 3600.0  # s
REST: Final = 5.0  # s between two questions of the same kind: a provider that fails is not asked by all who wait
KINDS: Final = ("RSA", "EC")
"""Of keys that can sign; a shared secret is none of them."""
MIN_BITS: Final = 2048  # of RSA

T = TypeVar("T")


@dataclass(frozen=True)
class Endpoints:
    """A provider's addresses and habits."""

    authorization: str
    token: str
    keys: str
    userinfo: str
    """Empty where it has none."""
    takes_basic: bool
    """Whether the client's secret goes into a header, else into the form."""
    can_ask_who: bool
    """Whether it can be told to let people choose which account they mean."""
    names_itself: bool
    """Whether its answers carry its name."""


class Discovery:
    """What a provider publishes of itself."""

    def __init__(self, settings: ProviderSettings) -> None:
        self._settings = settings
        self._endpoints = _Kept(self._find)
        self._keys = _Kept(self._load)

    def endpoints(self) -> Endpoints:
        """Its addresses.

        Raises:
            NoAnswer: They cannot be read, or are not safe to send anything to.
        """
        return self._endpoints.get()

    def keys(self, *, anew: bool = False) -> KeySet:
        """Its keys; `anew` after one was used that is not among them.

        Raises:
            NoAnswer: They cannot be read.
        """
        return self._keys.get(older_than=REST if anew else KEPT)

    def _find(self) -> Endpoints:
        issuer = self._settings.issuer
        told = fetch(issuer.rstrip("/") + PATH, is_here=self._settings.is_here)
        if told.get("issuer") != issuer:
            raise NoAnswer(f"it calls itself {str(told.get('issuer'))[:200]!r}")
        places = {}
        for name in ("authorization_endpoint", "token_endpoint", "jwks_uri", "userinfo_endpoint"):
            place = told.get(name, "" if name == "userinfo_endpoint" else None)
            if place != "" and not (isinstance(place, str) and is_safe(place, on_this_machine=self._settings.is_here)):
                raise NoAnswer(f"its {name} is {str(place)[:200]!r}")
            places[name] = place
        methods = told.get("token_endpoint_auth_methods_supported")
        return Endpoints(
            authorization=places["authorization_endpoint"],
            token=places["token_endpoint"],
            keys=places["jwks_uri"],
            userinfo=places["userinfo_endpoint"],
            takes_basic=not isinstance(methods, list) or "client_secret_basic" in methods,
            can_ask_who="select_account" in _list(told.get("prompt_values_supported")),
            names_itself=told.get("authorization_response_iss_parameter_supported") is True,
        )

    def _load(self) -> KeySet:
        told = fetch(self.endpoints().keys, is_here=self._settings.is_here)
        keys = [key for key in map(_key, _list(told.get("keys"))) if key is not None]
        if not keys:
            raise NoAnswer("it publishes no key to sign with")
        return KeySet(keys)


class _Kept(Generic[T]):
    """Something that is asked for by one at a time, and kept; a failure as well, for a moment."""

    def __init__(self, ask: Callable[[], T]) -> None:
        self._ask = ask
        self._lock = threading.Lock()
        self._value: T | None = None
        self._failure: NoAnswer | None = None
        self._at = 0.0

    def get(self, *, older_than: float = KEPT) -> T:
        with self._lock:
            age = time.monotonic() - self._at
            if self._failure is not None and age < REST:
                raise NoAnswer(str(self._failure))
            if self._value is None or self._failure is not None or age >= older_than:
                try:
                    self._value, self._failure = self._ask(), None
                except NoAnswer as error:
                    self._failure = error
                    raise
                finally:
                    self._at = time.monotonic()
            return self._value


def _list(told: Any) -> list[Any]:
    return told if isinstance(told, list) else []


def _key(told: Any) -> Key | None:
    """A key that can sign; None for what is no such key, which providers may publish beside them."""
    if not isinstance(told, dict) or told.get("kty") not in KINDS or told.get("use", "sig") != "sig":
        return None
    if told["kty"] == "RSA" and len(str(told.get("n"))) * 6 < MIN_BITS:  # too small, of which joserfc would warn
        return None
    try:
        key = JWKRegistry.import_key(told)
        public: Any = key.public_key
    except (JoseError, ValueError, TypeError):
        return None
    return key if public.key_size >= (MIN_BITS if told["kty"] == "RSA" else 0) else None
