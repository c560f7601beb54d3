"""What a league is told of a school's or company's provider, through which people sign in."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from ipaddress import ip_address
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

from racecraft.errors import ConfigError

SECRET: Final = "RACECRAFT_PROVIDER_SECRET"
"""Environment variable that may hold the client's secret: others can read a command line."""
MAX_SECRET: Final = 4096  # characters
MAX_LABEL: Final = 40
DOMAIN: Final = re.compile(r"[a-z0-9-]+(\.[a-z0-9-]+)+")


@dataclass(frozen=True, kw_only=True)
class ProviderSettings:
    """A provider of OpenID Connect, and whom of those that it knows a league lets in."""

    issuer: str
    """``https://…``, exactly as the provider calls itself; plain HTTP on this machine only."""
    client: str
    """What the league is called there."""
    secret: str = field(default="", repr=False)
    """What it proves that with; empty for a client that has none."""
    label: str = ""
    """On the button; by default the provider's name on the network."""
    domains: tuple[str, ...] = ()
    """Of the e-mail addresses that may come in; empty for whoever the provider lets in."""
    claims: tuple[tuple[str, str], ...] = ()
    """What the provider has to say of who comes in: a claim and its value, or one of its values."""
    group: int | None = None
    """The group that newcomers join."""

    def __post_init__(self) -> None:
        parts = urlsplit(self.issuer)
        if not is_safe(self.issuer, on_this_machine=True) or parts.query or parts.fragment:
            raise ConfigError(
                f"provider is {self.issuer[:80]!r}; allowed are https://NAME with a path, and http:// on this machine."
            )
        if not self.client or not self.client.isprintable():
            raise ConfigError("The provider knows the league by a client id.", hint="Give it with --provider-client.")
        if not self.label:
            object.__setattr__(self, "label", (parts.hostname or "")[:MAX_LABEL])
        if len(self.label) > MAX_LABEL or not self.label.isprintable():
            raise ConfigError(f"provider_name is {self.label[:80]!r}; allowed are {MAX_LABEL} printable characters.")
        object.__setattr__(self, "domains", tuple(domain.lower().removeprefix("@") for domain in self.domains))
        for domain in self.domains:
            if not DOMAIN.fullmatch(domain):
                raise ConfigError(f"provider_domain is {domain[:80]!r}; allowed are names such as school.example.")

    @property
    def is_here(self) -> bool:
        """Whether the provider runs on this machine."""
        return _is_loopback(urlsplit(self.issuer).hostname or "")


def is_safe(url: str, *, on_this_machine: bool) -> bool:
    """Whether what is sent to an address can be read by nobody on the way.

    Args:
        url: The address.
        on_this_machine: Whether this machine will do, where nothing has to be encrypted.
    """
    try:
        parts = urlsplit(url)
        parts.port  # noqa: B018 (raises where it is no number)
    except ValueError:
        return False
    if not parts.hostname or parts.username is not None or not url.isascii() or not url.isprintable() or " " in url:
        return False
    return parts.scheme == "https" or (on_this_machine and parts.scheme == "http" and _is_loopback(parts.hostname))


def claim_of(text: str) -> tuple[str, str]:
    """A claim and its value, of ``NAME=VALUE``.

    Raises:
        ConfigError: It is none.
    """
    name, sign, value = text.partition("=")
    if not name or not sign or not value:
        raise ConfigError(f"provider_claim is {text[:80]!r}; allowed is NAME=VALUE, such as role=pupil.")
    return name, value


def secret_of(file: Path | None) -> str:
    """The client's secret: of a file, else of the environment, out of which it is taken, so that no job inherits it.

    Raises:
        ConfigError: The file cannot be read, or both have one.
    """
    told = os.environ.pop(SECRET, "")
    if file is None:
        return told
    if told:
        raise ConfigError(f"The provider's secret is in {SECRET} and in a file.", hint="Give one of them.")
    try:
        secret = file.read_text(encoding="utf-8").strip()
    except (OSError, ValueError) as error:
        raise ConfigError(f"The provider's secret cannot be read: {file}.") from error
    if not 0 < len(secret) <= MAX_SECRET:
        raise ConfigError(f"The file {file} holds no secret: it has {len(secret)} characters.")
    return secret


def _is_loopback(host: str) -> bool:
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
