"""What became of faults: a log that a run goes on from, and their sum."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "build" / "mutants"


@dataclass(frozen=True)
class Outcome:
    """What became of one fault."""

    module: str
    line: int
    before: str
    after: str
    noticed: str
    """The test that noticed, empty if none did."""
    key: str
    """Changes with the fault and with what stands around it."""
    covered_by: str
    """Changes with the tests."""
    seconds: float
    """Of CPU that it took."""

    def __str__(self) -> str:
        before, after = (" ".join(text.split())[:60] for text in (self.before, self.after))
        return f"{self.module}:{self.line}  {before}  ->  {after}"


def digest(*parts: object) -> str:
    """A short name for all of this."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:12]


class Log:
    """The outcomes of every run so far."""

    def __init__(self, name: str) -> None:
        FOLDER.mkdir(parents=True, exist_ok=True)
        self._path = FOLDER / f"{name}.jsonl"

    def forget(self) -> None:
        """Begin anew."""
        self._path.unlink(missing_ok=True)

    def add(self, outcome: Outcome) -> None:
        """Keep an outcome, and show it."""
        with self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(asdict(outcome)) + "\n")
        print("noticed " if outcome.noticed else "SURVIVED", outcome, flush=True)

    def find(self, key: str, covered_by: str) -> Outcome | None:
        """What became of a fault; nothing if nobody noticed it and its tests have changed since."""
        found = None
        for line in self._path.read_text(encoding="utf-8").splitlines() if self._path.exists() else []:
            outcome = Outcome(**json.loads(line))
            if outcome.key == key and (outcome.noticed or outcome.covered_by == covered_by):
                found = outcome
        return found


def report(kind: str, outcomes: list[Outcome]) -> None:
    """Print the survivors and the share that was noticed."""
    survivors = [outcome for outcome in outcomes if not outcome.noticed]
    for name, count in Counter(outcome.module for outcome in survivors).most_common():
        print(f"\n{name}: {count} survived")
        print("\n".join(f"  {outcome}" for outcome in survivors if outcome.module == name))
    share = 1 - len(survivors) / max(len(outcomes), 1)
    print(f"\n{kind}: {len(outcomes)} faults planted, {len(outcomes) - len(survivors)} noticed, {share:.1%}")
