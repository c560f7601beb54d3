"""What a console is started with."""

from __future__ import annotations

import socket
from dataclasses import dataclass, replace
from hashlib import sha256
from ipaddress import ip_network
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

from racecraft.checks import check_whole, require
from racecraft.errors import ConfigError
from racecraft.serve.provider_settings import ProviderSettings

STATE_FOLDER: Final = ".racecraft"
"""Inside the runs folder: the database and the tracks that were drawn or imported."""
DATABASE: Final = "RACECRAFT_DATABASE"
"""Environment variable that may hold the database's URL: others can read a command line, and a password in it."""
WORKERS: Final = "workers"
"""Inside the state folder: a file for each process that does a job, locked as long as it lives."""
INCOMING: Final = "incoming"
"""Inside the state folder: what comes out of the object store is put together there."""
TUNINGS: Final = "tunings"
"""Inside the state folder: a folder for each search of better numbers."""
ARTIFACTS: Final = "RACECRAFT_ARTIFACTS"
"""The same for where runs are copied to."""
SERVER: Final = "RACECRAFT_SERVER"
"""The same for the address of a console that a worker works for."""
TOKEN_FILE: Final = "RACECRAFT_TOKEN_FILE"
"""The same for the file that holds its token."""
OWNER: Final = 1
"""The user to whom the runs of the command line belong: whoever starts the server."""
PEOPLE: Final = "people"
"""Inside the state folder: a folder for each other person of a league, by number, that is like the runs folder."""
COOKIE: Final = "racecraft_session"
PROVIDER_COOKIE: Final = "racecraft_provider"
KNOWN_COOKIE: Final = "racecraft_known"
"""By which a browser is known that is at the provider, or chooses a name."""
PROVIDER_PAGE: Final = "/oidc"
"""Of the console, to which a provider sends people back."""
LOOPBACK: Final = ("127.0.0.1", "::1", "localhost")

MAX_MACHINE: Final = 64
"""Characters of a machine's name."""


@dataclass(frozen=True, kw_only=True)
class ServeSettings:
    """Settings of a console; paths are absolute."""

    runs: Path
    """Folder of the run folders, the same that the command line uses."""
    port: int = 8321
    """Of 127.0.0.1; 0 takes a free one."""
    database: str = ""
    """SQLAlchemy URL; by default SQLite in the state folder."""
    artifacts: str = ""
    """``s3://BUCKET/PREFIX`` or ``file:///FOLDER`` where runs are copied to; empty for nowhere."""
    training_slots: int = 1
    """Trainings at the same time on this machine; 0 leaves them to other machines."""
    other_slots: int = 1
    """Other jobs, such as evaluations, at the same time; they may need files that only the console's machine has."""
    machine: str = ""
    """Name of this machine among those that work on one queue; made from the host's name and the folder if empty."""
    league: bool = False
    """Whether others may have accounts."""
    host: str = "127.0.0.1"
    """Address that is listened at; another one only in a league."""
    address: str = ""
    """``https://NAME`` or ``http://NAME:PORT`` by which others call a league; by default where it listens."""
    plain_http: bool = False
    """Whether passwords and cards may cross a network unencrypted."""
    trusted_proxies: tuple[str, ...] = ()
    """Addresses, or networks such as ``10.0.0.0/24``, of proxies that are believed where a request comes from."""
    certificate: Path | None = None
    """PEM file with the chain of a league's own certificate, where no proxy has one."""
    key: Path | None = None
    """PEM file with its private key."""
    provider: ProviderSettings | None = None
    """A school's or company's provider, through which people of a league sign in."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "runs", self.runs.absolute())
        is_text = not any("\ud800" <= mark <= "\udfff" for mark in str(self.runs))  # for bytes that are none
        require("runs", str(self.runs), is_text, "a path in UTF-8")
        require("port", self.port, 0 <= self.port <= 65535, "0 to 65535, where 0 takes a free one")
        for name, places in (("trainings", self.training_slots), ("others", self.other_slots)):  # as the options are
            check_whole(name, places, 0, 64)
        if not self.machine:
            mark = sha256(str(self.runs).encode()).hexdigest()[:6]
            object.__setattr__(self, "machine", f"{socket.gethostname()[: MAX_MACHINE - 7]}-{mark}")
        is_name = len(self.machine) <= MAX_MACHINE and self.machine.isprintable()
        require("machine", self.machine, is_name, f"at most {MAX_MACHINE} printable characters")
        if self.artifacts and not self.artifacts.startswith(("s3://", "file:///")):
            raise ConfigError(
                f"artifacts is {self.artifacts.split('://')[0]!r}; allowed are s3://BUCKET/PREFIX and file:///FOLDER."
            )
        self._check_address()
        # a database in memory would be another one for every process
        is_file = self.database.startswith("sqlite:///") and self.database[10:] not in ("", ":memory:")
        if self.database and not is_file and not self.database.startswith("postgresql+psycopg://"):
            told = self.database if self.database.startswith("sqlite") else self.database.split(":")[0]  # no password
            raise ConfigError(
                f"database is {told[:40]!r}; allowed are sqlite:///FILE and postgresql+psycopg://USER@HOST/NAME."
            )

    def _check_address(self) -> None:
        """Refuse what would show secrets to a network, unless that was said twice."""
        parts = urlsplit(self.address)
        is_plain = parts.scheme in ("http", "https") and bool(parts.hostname) and parts.path in ("", "/")
        if self.address and (not is_plain or parts.query or parts.fragment or parts.username):
            raise ConfigError(f"address is {self.address[:80]!r}; allowed are https://NAME and http://NAME:PORT.")
        is_outside = self.host not in LOOPBACK or (bool(self.address) and parts.hostname not in LOOPBACK)
        if is_outside and not self.league:
            raise ConfigError("A console of one person answers only on 127.0.0.1.", hint="Add --league for accounts.")
        if is_outside and parts.scheme != "https" and not self.plain_http:
            raise ConfigError(
                "Passwords and cards would cross the network unencrypted.",
                hint="Give --address https://NAME of a proxy, or say --plain-http in a network that you trust.",
            )
        if (self.trusted_proxies or self.certificate or self.key) and not self.league:
            raise ConfigError("Proxies and certificates are for a league.", hint="Add --league for accounts.")
        if self.provider is not None and not self.league:
            raise ConfigError("Sign-in through a provider is for a league.", hint="Add --league for accounts.")
        for proxy in self.trusted_proxies:
            try:
                ip_network(proxy)
            except ValueError as error:
                raise ConfigError(
                    f"trusted_proxy is {proxy[:80]!r}; allowed are addresses and networks, such as 10.0.0.0/24."
                ) from error
        if (self.certificate is None) != (self.key is None):
            raise ConfigError("A certificate needs its key.", hint="Give both --certificate FILE and --key FILE.")
        if self.certificate is not None and parts.scheme != "https":
            raise ConfigError("A certificate is for a name.", hint="Give --address https://NAME:PORT that it is for.")
        is_open = self.host not in LOOPBACK and self.certificate is None and not self.trusted_proxies
        if is_open and not self.plain_http:
            raise ConfigError(
                f"At {self.host} the league would answer unencrypted beside its proxy.",
                hint="Leave --host out where the proxy runs here, or name it with --trusted-proxy ADDRESS.",
            )

    def of(self, user_id: int) -> ServeSettings:
        """The same for another person: a folder of runs of their own, on the same database, without copies."""
        if user_id == OWNER:
            return self
        return replace(self, runs=runs_of(self.runs, user_id), database=self.database_url, artifacts="")

    @property
    def needs_encryption(self) -> bool:
        """Whether who comes from another machine has to come through an encrypted connection."""
        return self.address.startswith("https://") and not self.plain_http

    @property
    def state(self) -> Path:
        """Folder of the console's own files."""
        return self.runs / STATE_FOLDER

    @property
    def incoming(self) -> Path:
        """Folder where what comes out of the object store is put together."""
        return self.state / INCOMING

    @property
    def tracks(self) -> Path:
        """Folder of the user's own tracks."""
        return self.state / "tracks"

    @property
    def database_url(self) -> str:
        """The database in use."""
        return self.database or f"sqlite:///{self.state / 'console.db'}"


def runs_of(runs: Path, user_id: int) -> Path:
    """The folder of somebody's runs, where `runs` is the owner's."""
    return runs if user_id == OWNER else runs / STATE_FOLDER / PEOPLE / str(user_id)
