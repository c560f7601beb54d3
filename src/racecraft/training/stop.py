"""When training ends: laps driven in evaluation, a lap time, no better one, minutes of wall clock, or camera steps."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import TYPE_CHECKING, Final

from racecraft.errors import ConfigError

if TYPE_CHECKING:
    from racecraft.training.progress import EvaluationReport

_UNITS: Final = {
    **dict.fromkeys(("lap", "laps"), ("laps", 1)),
    **dict.fromkeys(("step", "steps"), ("steps", 1)),
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), ("seconds", 1)),
    **dict.fromkeys(("min", "mins", "minute", "minutes"), ("seconds", 60)),
    **dict.fromkeys(("h", "hour", "hours"), ("seconds", 3600)),
    **dict.fromkeys(("s lap", "sec lap", "second lap", "seconds lap"), ("lap_time", 1)),
}
_LIMIT: Final = re.compile(r"\s*(\d{1,3}(?:[,_]\d{3})+|\d+)(\.\d+)?\s*([a-z]+(?:\s+lap)?)\s*", re.ASCII | re.IGNORECASE)
_NO_BETTER: Final = re.compile(r"\s*no\s+better\s+lap\s*", re.ASCII | re.IGNORECASE)
_EXAMPLES: Final = "'5 laps', '8.8 s lap', 'no better lap', '10 minutes', '90 s' or '200,000 steps'"
_MAX_TEXT: Final = 400  # characters
LEAST_WAIT: Final = 150_000  # camera steps without a better lap after which none is waited for
SHARE_WAIT: Final = 0.5  # the same, of the steps it took to the best


@dataclass(frozen=True, kw_only=True)
class Until:
    """Limits of a training; 0 means none. The first one reached ends it."""

    laps: int = 0
    """Trials of one evaluation that complete their lap."""
    lap_time: float = 0.0
    """s; some lap of an evaluation takes no longer."""
    seconds: float = 0.0
    """Wall clock since the run was started; when it is resumed, the time before counts."""
    steps: int = 0
    """Camera steps of the run, all cars together."""
    no_better_lap: bool = False
    """Every lap of some evaluation was complete, and for a good while none has been better."""

    @classmethod
    def parse(cls, text: str) -> Until:
        """Read ``"5 laps"``, ``"8.8 s lap"``, ``"no better lap"``, ``"10 minutes"``, ``"9 steps"``, some with ``or``.

        Raises:
            ConfigError: The text has another form, names a limit twice, or a number is out of range.
        """
        limits: dict[str, Decimal] = {}
        for part in re.split(r"\bor\b", text) if isinstance(text, str) and len(text) <= _MAX_TEXT else [""]:
            if _NO_BETTER.fullmatch(part):
                if "no_better_lap" in limits:
                    raise ConfigError(f"until is {text!r}; it asks twice for no better lap.")
                limits["no_better_lap"] = Decimal(1)
                continue
            match = _LIMIT.fullmatch(part)
            unit = _UNITS.get(" ".join(match[3].lower().split())) if match else None
            if match is None or unit is None:
                said = repr(text)[:_MAX_TEXT]
                raise ConfigError(f"until is {said}; write it like {_EXAMPLES}, or join several with 'or'.")
            name, factor = unit
            value = Decimal(re.sub("[,_]", "", match[1]) + (match[2] or "")) * factor
            if name in ("laps", "steps") and value != value.to_integral_value():
                raise ConfigError(f"until is {text!r}; the number of {name} must be whole.")
            if name in limits:
                raise ConfigError(f"until is {text!r}; it limits {name} twice.")
            limits[name] = value
        return cls(
            laps=int(limits.get("laps", 0)),
            lap_time=float(limits.get("lap_time", 0)),
            seconds=float(limits.get("seconds", 0)),
            steps=int(limits.get("steps", 0)),
            no_better_lap="no_better_lap" in limits,
        )

    def __post_init__(self) -> None:
        for name, value in (("laps", self.laps), ("steps", self.steps)):
            if isinstance(value, bool) or not isinstance(value, int):
                raise ConfigError(f"until asks for {value!r} {name}; allowed is a whole number.")
        if not 0 <= self.laps <= 100:
            raise ConfigError(f"until asks for {self.laps} laps; allowed is 1 to 100.")
        if not 0 <= self.lap_time <= 3600:
            raise ConfigError(f"until asks for a lap of {self.lap_time} s; allowed is up to an hour.")
        if not 0 <= self.seconds <= 30 * 86400:
            raise ConfigError(f"until asks for {self.seconds} s; allowed is up to 30 days.")
        if not 0 <= self.steps <= 10**12:
            raise ConfigError(f"until asks for {self.steps} steps; allowed is up to 10^12.")
        if not isinstance(self.no_better_lap, bool):
            raise ConfigError(f"until asks for no_better_lap {self.no_better_lap!r}; allowed is true or false.")
        if not (self.laps or self.lap_time or self.no_better_lap or self.seconds or self.steps):
            raise ConfigError(f"until sets no limit; write it like {_EXAMPLES}.")

    def reached(self, *, steps: int, seconds: float, last: EvaluationReport | None, has_settled: bool) -> str:
        """Which of them a training has come to, by the name of its field; empty where it goes on.

        Args:
            steps: Camera steps of the run.
            seconds: Wall clock of the run.
            last: The evaluation that counts; None before there is one.
            has_settled: Whether no lap has been better for a good while.
        """
        if self.laps and last is not None and last.laps_completed >= self.laps:
            return "laps"
        if self.lap_time and last is not None and last.best_lap is not None and last.best_lap <= self.lap_time:
            return "lap_time"
        if self.no_better_lap and last is not None and has_settled:
            return "no_better_lap"
        if self.steps and steps >= self.steps:
            return "steps"
        if self.seconds and seconds >= self.seconds:
            return "seconds"
        return ""

    def __str__(self) -> str:
        """The text that `parse` reads as the same limits, to the bit."""
        parts = []
        if self.laps:
            parts.append(f"{self.laps} laps")
        if self.lap_time:
            parts.append(f"{Decimal(repr(float(self.lap_time))):f} s lap")
        if self.no_better_lap:
            parts.append("no better lap")
        if self.seconds:
            seconds = Decimal(repr(float(self.seconds)))  # exact, and never in powers of ten as floats are
            parts.append(f"{int(seconds // 60)} minutes" if seconds % 60 == 0 else f"{seconds:f} s")
        if self.steps:
            parts.append(f"{self.steps} steps")
        return " or ".join(parts)


def settled(best_score: Sequence[float] | None, evaluated_at: int, gained_at: int) -> bool:
    """Whether the best evaluation was complete, and for a good while none has been better.

    Args:
        best_score: Of it, as `Evaluator.score` has it; None before there is one.
        evaluated_at: Camera steps of training behind the last evaluation.
        gained_at: The same behind the first that was as good as the best.
    """
    is_whole = best_score is not None and best_score[0] >= 1.0
    return is_whole and evaluated_at - gained_at >= max(LEAST_WAIT, SHARE_WAIT * gained_at)
