"""`verify_race`: a whole race checked from its files alone: what was announced, every replay, and the result.

race.json ─▶ announcement: commitment == SHA-256(secret + document), seed == that of the secret
   └─▶ every replay: of this race, and the same to the bit when driven again
         └─▶ classified anew == the results in race.json
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from racecraft.checks import shown
from racecraft.contest.classification import classify
from racecraft.contest.contest import result_rows
from racecraft.contest.terms import TOGETHER
from racecraft.errors import ConfigError, ReplayError, typed
from racecraft.json_file import parse_json_object, read_bytes
from racecraft.judging.race import FORMAT, RESULTS
from racecraft.race.announcement import Announcement
from racecraft.race.results import Trial
from racecraft.replay.replay import Replay, read_replay
from racecraft.replay.verification import Verification, verify

MAX_BYTES: Final = 64 << 20
_REPLAY: Final = "replay of "

OLD_RULES: Final = (
    "Driven under the old rules: once, from a line that everybody knew, in the car of the first model's own run.json."
)


@dataclass(frozen=True, kw_only=True)
class RaceVerification:
    """What came of checking a race."""

    path: Path
    """Its race.json."""
    announcement: Announcement | None
    """What it was held by; None of a race under the old rules."""
    verifications: dict[str, Verification]
    """Of every replay, by what race.json calls it."""
    foul: str
    """What else does not fit; empty if nothing."""

    @property
    def is_old(self) -> bool:
        """Whether it was driven under the rules of before there were announcements."""
        return self.announcement is None

    @property
    def is_genuine(self) -> bool:
        """Whether everything is as it says."""
        return not self.foul and all(one.is_genuine for one in self.verifications.values())

    def to_dict(self) -> dict[str, Any]:
        """As JSON."""
        return {
            "is_genuine": self.is_genuine,
            "is_old": self.is_old,
            "commitment": None if self.announcement is None else self.announcement.commitment,
            "foul": self.foul,
            "replays": {name: one.to_dict() for name, one in self.verifications.items()},
        }


def verify_race(path: str | Path, *, race: str = "", num_threads: int = 0) -> RaceVerification:
    """Check a race.

    Args:
        path: Its folder, or the race.json in it.
        race: What was published of it: another race.json, or its commitment; by default it is believed what it says.
        num_threads: 0 takes one per core.

    Raises:
        ConfigError: It is no race.
        ReplayError: A replay of it cannot be read.
    """
    path = _results_of(Path(path))
    document = _read(path)
    if "format" not in document:
        old = {name: verify(replay, num_threads=num_threads) for name, replay in _replays(path, document).items()}
        foul = "it was driven under the old rules, and announced by nobody" if race else ""
        return RaceVerification(path=path, announcement=None, verifications=old, foul=foul)
    announcement = _announcement(document, path)
    expected = published(race) if race else announcement
    wanted = expected.commitment if isinstance(expected, Announcement) else expected
    replays = _replays(path, document)
    foul = "" if wanted == announcement.commitment else f"its commitment is {announcement.commitment}, not {wanted}"
    verifications = {
        name: verify(replay, race=announcement, num_threads=num_threads) for name, replay in replays.items()
    }
    return RaceVerification(
        path=path,
        announcement=announcement,
        verifications=verifications,
        foul=foul or _unlike_results(document, announcement, replays),
    )


def published(race: str) -> Announcement | str:
    """What was published of a race: the announcement in a race.json or in the folder of one, or a commitment.

    Raises:
        ConfigError: It is none of those.
    """
    if len(race) == 64 and all(digit in "0123456789abcdef" for digit in race) and not Path(race).exists():
        return race
    if not os.path.exists(race):
        hint = "Give a race.json, the folder of one, or a commitment: 64 signs of 0 to 9 and a to f."
        raise ConfigError(f"There is no race {shown(race)}.", hint=hint)
    path = _results_of(Path(race))
    return _announcement(_read(path), path)


def _results_of(path: Path) -> Path:
    if not path.is_dir():
        return path
    if not (results := path / RESULTS).exists():
        replays = sorted(path.glob("evaluation-*/evaluation.replay"))  # it may be a run's folder
        hint = f"Its last evaluation's replay: racecraft verify {typed(replays[-1])}" if replays else ""
        raise ConfigError(f"{path} holds no race: {RESULTS} is missing.", hint=hint)
    return results


def _read(path: Path) -> dict[str, Any]:
    return parse_json_object(read_bytes(path, max_bytes=MAX_BYTES), name=str(path))


def _announcement(document: Mapping[str, Any], path: Path) -> Announcement:
    if document.get("format") != FORMAT:
        raise ConfigError(f"{path} is of a version {document.get('format')!r}; this Racecraft reads {FORMAT}.")
    try:
        return Announcement.from_dict(document)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}", hint=error.hint) from error


def _replays(path: Path, document: Mapping[str, Any]) -> dict[str, Replay]:
    """The replays that race.json names, which lie beside it."""
    files = document.get("files")
    found = {}
    for name, file in files.items() if isinstance(files, Mapping) else ():
        if name != "replay" and not name.startswith(_REPLAY):
            continue
        if not isinstance(file, str) or Path(file).name != file:
            raise ReplayError(f"{path} says that {name!r} is {file!r}, which is no file beside it.")
        found[name] = read_replay(path.with_name(file))
    if not found:
        raise ReplayError(f"{path} names no replay.", hint="Give a replay file, or a race's folder.")
    return found


def _unlike_results(document: Mapping[str, Any], announcement: Announcement, replays: Mapping[str, Replay]) -> str:
    """What the results say otherwise than the replays do."""
    terms = announcement.document
    shares_road = terms["kind"] in TOGETHER
    driven: dict[str, tuple[Trial, ...]] = {}
    for name, replay in replays.items():
        if shares_road:
            driven |= {who: (car,) for who, car in zip(replay.names, replay.cars, strict=True)}
        else:
            driven[name.removeprefix(_REPLAY)] = replay.cars
    names, trials = list(driven), list(driven.values())
    standings = classify(trials, ranking=terms["ranking"], minimum_laps=terms["minimum_laps"], ranks_all=shares_road)
    given = document.get("results")
    if not isinstance(given, list) or len(given) != len(names):
        return "its results are not one for each replay"
    for expected in result_rows(names, trials, standings):
        if expected not in given:
            return f"the result of {expected['name']} is not what its replay leads to"
    return ""
