"""A race as it is announced: everything that decides it in one document, and a promise of its starts.

    document     rules, vehicle, track, objects, trials, ranking, as canonical JSON
    secret       32 random bytes, known to nobody but who holds the race while it is open
    commitment   SHA-256(secret + document), published when the race opens
    seed         the first 8 bytes, little-endian, of SHA-256(secret + "seed"): of starts, objects and randomisation
    frames seed  the same of SHA-256(secret + "frames"): of hidden frames, by which a league knows copies
    duel seeds   the same of SHA-256(secret + "duel 0"), "duel 1", …: of a final in which two meet at a time

When the race is over its secret is published. Then everybody can see that the starts were drawn before anybody entered
(the commitment is that of this secret and document) and that every entry was driven from them (a replay's conditions
are the document's, its seed is the secret's). A race whose seed is known to all has it in its document and no secret.

Canonical JSON: UTF-8, keys sorted, no spaces, whole numbers without a fraction.
"""

from __future__ import annotations

import hashlib
import json
import re
import secrets
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

from racecraft.checks import require
from racecraft.errors import ConfigError, RacecraftError
from racecraft.race.conditions import Conditions
from racecraft.race.rules import RaceRules
from racecraft.sim.objects import Objects
from racecraft.sim.randomization import Randomization
from racecraft.sim.vehicle import Vehicle
from racecraft.track.track import Track

SECRET_BYTES: Final = 32
FORM: Final = 1
"""Of the document."""
MAX_DUELS: Final = 32
"""Of a final."""
_DIGEST: Final = re.compile(r"[0-9a-f]{64}")


def draw_secret() -> bytes:
    """A secret for a race, from the operating system's random numbers."""
    return secrets.token_bytes(SECRET_BYTES)


@dataclass(frozen=True, kw_only=True)
class Announcement:
    """What is published of a race: at once all but the secret, and when it is over that, too."""

    document: Mapping[str, Any]
    """Everything that decides the race, as JSON; `seed` is in it where there is no secret."""
    commitment: str
    """SHA-256 of secret and document, 64 hexadecimal digits."""
    secret: str = ""
    """64 hexadecimal digits; empty while it is one, and where there is none."""

    @classmethod
    def of(
        cls,
        conditions: Conditions,
        *,
        kind: str,
        ranking: str,
        minimum_laps: int,
        num_trials: int,
        secret: bytes | None,
        final: Mapping[str, Any] | None = None,
    ) -> Announcement:
        """Announce a race.

        Args:
            conditions: What everybody drives under; their seed counts where there is no secret.
            kind: Of race.
            ranking: What trials are ranked by.
            minimum_laps: Completed laps that a trial must have for a score.
            num_trials: Of each entry.
            secret: 32 bytes, or None for a race whose seed everybody may know.
            final: What else is announced of a race in which two meet at a time, see `racecraft.contest.finals`.

        Raises:
            ConfigError: The secret is no 32 bytes.
        """
        if secret is not None:  # of another one nobody could read the announcement
            size = len(secret) if isinstance(secret, bytes) else 0
            require("The number of bytes of a secret", size, size == SECRET_BYTES, f"{SECRET_BYTES}")
        document: dict[str, Any] = {
            "form": FORM,
            "kind": kind,
            "ranking": ranking,
            "minimum_laps": minimum_laps,
            "trials": num_trials,
            **_settings(conditions),
        }
        if secret is None:
            document["seed"] = conditions.seed
        if final is not None:
            document["final"] = final
        document = _whole(document)
        return cls(
            document=document,
            commitment=commitment_of(document, secret or b""),
            secret="" if secret is None else secret.hex(),
        )

    @classmethod
    def from_dict(cls, found: Mapping[str, Any]) -> Announcement:
        """From what `to_dict` gave, or a stranger wrote.

        Raises:
            ConfigError: It is none, or its commitment is not that of its secret and document.
        """
        document, commitment, secret = (found.get(name) for name in ("document", "commitment", "secret"))
        if not isinstance(document, Mapping) or not isinstance(commitment, str) or not _DIGEST.fullmatch(commitment):
            raise ConfigError("A race's announcement has a document and a commitment of 64 hexadecimal digits.")
        if document.get("form") != FORM:
            raise ConfigError(f"The race's document has the form {document.get('form')!r}; this version knows {FORM}.")
        for name, kind in (("kind", str), ("ranking", str), ("minimum_laps", int), ("trials", int)):
            if type(document.get(name)) is not kind:
                raise ConfigError(f"The race's document has the {name} {str(document.get(name))[:40]!r}.")
        if not isinstance(secret, str) or (secret and not _DIGEST.fullmatch(secret)):
            raise ConfigError("A race's secret is 64 hexadecimal digits, or empty.")
        seed = document.get("seed", 0)
        if type(seed) is not int or not 0 <= seed < 2**64 or (secret and "seed" in document):
            raise ConfigError("A race has a secret, or a seed from 0 to 2**64 - 1 in its document.")
        try:
            is_kept = commitment_of(document, bytes.fromhex(secret)) == commitment
        except (RecursionError, ValueError) as error:
            raise ConfigError(f"The race's document is not allowed: {error}.") from error
        if (secret or "seed" in document) and not is_kept:
            raise ConfigError(
                "The race's commitment is not that of its secret and its document: one of them was changed.",
                hint="Compare them with what was published.",
            )
        return cls(document=document, commitment=commitment, secret=secret)

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {"document": dict(self.document), "commitment": self.commitment, "secret": self.secret}

    @property
    def is_secret(self) -> bool:
        """Whether its starts are not known yet."""
        return not self.secret and "seed" not in self.document

    @property
    def seed(self) -> int | None:
        """Of starts, objects and randomisation; None while it is a secret."""
        if self.is_secret:
            return None
        return seed_of(bytes.fromhex(self.secret)) if self.secret else int(self.document["seed"])

    @property
    def frames_seed(self) -> int:
        """Of hidden frames; hidden from nobody where the race has no secret, or none is known here."""
        return _drawn(bytes.fromhex(self.secret), b"frames")

    def duel_seed(self, number: int) -> int:
        """Of starts and objects of a final's duel, from 0; of a race whose secret is known here, or that has none."""
        source = bytes.fromhex(self.secret) if self.secret else canonical(self.document)
        return _drawn(source, f"duel {number}".encode())

    def conditions(self, track: Track) -> Conditions:
        """What everybody drives under, on the track that the document names; with seed 0 while that is a secret.

        Raises:
            ConfigError: The document has a setting that is not one of ours, or it is another track.
        """
        named, cars = self.document.get("track"), self.document.get("cars_per_race")
        if not isinstance(named, Mapping) or named.get("digest") != track.digest:
            raise ConfigError(f"The track {track.name!r} is not the one that the race was announced on.")
        if type(cars) is not int or not 1 <= cars <= 8:
            raise ConfigError(f"The race's document is not allowed: cars_per_race is {cars!r}; allowed are 1 to 8.")
        try:
            return Conditions(
                track=track,
                rules=RaceRules.from_dict(self.document["rules"]),
                seed=self.seed or 0,
                vehicle=Vehicle(**self.document["vehicle"]),
                objects=Objects.from_dict(self.document["objects"]),
                randomize=Randomization(**self.document["randomize"]),
                cars_per_race=cars,
            )
        except (RacecraftError, KeyError, TypeError, ValueError) as error:
            raise ConfigError(f"The race's document is not allowed: {error}") from error

    def mismatch(self, conditions: Conditions, *, num_cars: int) -> str:
        """What something driven has otherwise than its race, in words; empty where it is of this race.

        Args:
            conditions: That it was driven under.
            num_cars: How many cars it has: the trials of one entry, or all cars of one road.
        """
        named = self.document.get("track")
        if not isinstance(named, Mapping) or named.get("digest") != conditions.track.digest:
            return "it was driven on another track"
        try:
            expected = self.conditions(conditions.track)
        except ConfigError as error:
            return str(error).rstrip(".")
        ours, theirs = (dict(_leaves(_settings(one))) for one in (expected, conditions))
        for name in sorted(ours.keys() | theirs.keys()):
            if ours.get(name) != theirs.get(name):
                return f"{name} is {theirs.get(name)} in the replay and {ours.get(name)} in its race"
        due = expected.cars_per_race if expected.cars_per_race > 1 else self.document.get("trials")
        if num_cars != due:
            return f"it has {num_cars} cars and its race asks for {due}"
        if self.is_secret:
            return ""
        if "final" in self.document:
            if conditions.seed not in map(self.duel_seed, range(MAX_DUELS)):
                return f"it was driven from the seed {conditions.seed}, which none of its race's duels has"
        elif conditions.seed != self.seed:
            return f"it was driven from the seed {conditions.seed} and its race has {self.seed}"
        return ""


def canonical(document: Mapping[str, Any]) -> bytes:
    """A document's bytes, the same whoever writes it."""
    text = json.dumps(_whole(document), sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return text.encode(errors="surrogatepass")


def commitment_of(document: Mapping[str, Any], secret: bytes) -> str:
    """What is published of a secret."""
    return hashlib.sha256(secret + canonical(document)).hexdigest()


def seed_of(secret: bytes) -> int:
    """What a race is drawn from."""
    return _drawn(secret, b"seed")


def _drawn(secret: bytes, purpose: bytes) -> int:
    return int.from_bytes(hashlib.sha256(secret + purpose).digest()[:8], "little")


def _settings(conditions: Conditions) -> dict[str, Any]:
    """Everything of conditions that a race decides: all but the seed and each entry's own lens."""
    return {
        "track": {"name": conditions.track.name, "digest": conditions.track.digest},
        "rules": conditions.rules.to_dict(),
        "vehicle": asdict(conditions.vehicle),
        "objects": conditions.objects.to_dict(),
        "randomize": {name: list(ends) for name, ends in asdict(conditions.randomize).items()},
        "cars_per_race": conditions.cars_per_race,
    }


def _whole(value: Any) -> Any:
    """The same with whole numbers as integers, which every language writes alike."""
    if isinstance(value, Mapping):
        return {name: _whole(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_whole(one) for one in value]
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _leaves(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Every setting by the last two of its names."""
    if isinstance(value, Mapping):
        for key, one in value.items():
            yield from _leaves(one, f"{name} {key}".strip() if name else str(key))
    else:
        yield name, value
