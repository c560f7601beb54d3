"""In which car, and under what otherwise than they know, models drive: settings that requests and pages have alike.

request -> *vehicle_of*, *randomization_of* -> simulation -> *told_vehicle*, *told_randomization* -> page

A name is a preset's and never a path; everything else is said in numbers.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, fields
from typing import Annotated, Any, Final

from pydantic import BeforeValidator, Field

from racecraft.checks import check_number, require, shown
from racecraft.errors import ConfigError, did_you_mean
from racecraft.sim.randomization import LIMITS as MOST
from racecraft.sim.randomization import PRESETS as RANDOMIZATIONS
from racecraft.sim.randomization import Randomization
from racecraft.sim.vehicle import LIMITS, PRESETS, Vehicle

NO_PARAMETER: Final = "A vehicle has no parameter"
NO_QUANTITY: Final = "randomize has no quantity"
VEHICLES: Final = ("v5", "v4", "v6")
"""The usual one first."""


def _car_in_numbers(asked: Any) -> Any:
    """Refuse what is neither a name nor numbers by name; Pydantic would say it in words of its own."""
    if not isinstance(asked, str | dict):
        raise ConfigError(f"vehicle is {shown(asked)}; allowed are v4, v5 and v6.")
    for name, value in asked.items() if isinstance(asked, dict) else ():
        if not _is_numeric(value):
            _check_names([name], LIMITS, NO_PARAMETER)
            check_number(f"Vehicle parameter {name}", value, *LIMITS[name])
    return asked


def _ranges_in_numbers(asked: Any) -> Any:
    """The same of ranges."""
    if not isinstance(asked, str | dict):
        raise ConfigError(f"randomize is {shown(asked)}; allowed are {', '.join(RANDOMIZATIONS)}.")
    for name, ends in asked.items() if isinstance(asked, dict) else ():
        _check_names([name], MOST, NO_QUANTITY)
        is_pair = isinstance(ends, list | tuple) and len(ends) == 2
        require(f"Randomization {name}", ends, is_pair, "two numbers, least and most")
        for number in ends:
            if not _is_numeric(number):
                check_number(f"Randomization {name}", number, *MOST[name])
    return asked


def _is_numeric(value: Any) -> bool:
    """Whether Pydantic makes a number of it, as it does of the text of one."""
    try:
        float(value)
    except (TypeError, ValueError, OverflowError):
        return False
    return not isinstance(value, bool)


Name = Annotated[str, Field(max_length=40)]
AskedVehicle = Annotated[Name | dict[Name, float], BeforeValidator(_car_in_numbers)]
"""``v4``, ``v5``, ``v6`` or parameters of one's own, in the units of `Vehicle`; those left out are v5's."""
AskedRanges = Annotated[Name | dict[Name, tuple[float, float]], BeforeValidator(_ranges_in_numbers)]
"""A preset, or least and most of quantities, in the units of `Randomization`; those left out do not change."""


def vehicle_of(asked: AskedVehicle) -> Vehicle:
    """The car that a request asks for.

    Raises:
        ConfigError: There is no such preset or parameter, or one is outside its range.
    """
    if isinstance(asked, str):
        if asked not in VEHICLES:
            raise ConfigError(f"vehicle is {asked[:40]!r}; allowed are v4, v5 and v6.")
        return PRESETS[asked]
    _check_names(asked, (field.name for field in fields(Vehicle)), NO_PARAMETER)
    return Vehicle(**asked)


def randomization_of(asked: AskedRanges) -> Randomization:
    """The ranges that a request asks for.

    Raises:
        ConfigError: There is no such preset or quantity, or a range is none, or not allowed.
    """
    if isinstance(asked, str):
        if asked not in RANDOMIZATIONS:
            raise ConfigError(f"randomize is {asked[:40]!r}; allowed are {', '.join(RANDOMIZATIONS)}.")
        return RANDOMIZATIONS[asked]
    _check_names(asked, (field.name for field in fields(Randomization)), NO_QUANTITY)
    return Randomization(**asked)


def told_vehicle(vehicle: Vehicle) -> AskedVehicle:
    """As a request would ask for it: a preset, or what differs from v5."""
    usual = asdict(PRESETS["v5"])
    own = {name: float(value) for name, value in asdict(vehicle).items() if value != usual[name]}
    return next((name for name in VEHICLES if PRESETS[name] == vehicle), own)


def told_randomization(ranges: Randomization) -> AskedRanges:
    """As a request would ask for it: a preset, or the ranges that change something."""
    nothing = asdict(RANDOMIZATIONS["none"])
    own = {name: ends for name, ends in asdict(ranges).items() if ends != nothing[name]}
    return next((name for name, one in RANDOMIZATIONS.items() if one == ranges), own)


def _check_names(asked: Iterable[str], known: Iterable[str], sentence: str) -> None:
    names = list(known)
    for name in asked:
        if name not in names:
            raise ConfigError(f"{sentence} {name[:40]!r}.", hint=did_you_mean(name, names))
