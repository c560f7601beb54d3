"""What the files that a racer brings along may hold, and one sentence for what is wrong in them.

Consoles, scripts and people wrote these files for years, so values may come as strings and fields may be
missing.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields
from typing import Annotated, Any, TypeVar, get_origin, get_type_hints

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, create_model

from racecraft.checks import check_type
from racecraft.errors import ConfigError, did_you_mean

MAX_SHOWN = 60  # characters of a wrong value in a message

_Model = TypeVar("_Model", bound=BaseModel)


def _not_a_bool(value: object) -> object:
    if isinstance(value, bool):
        raise ValueError("true and false are not numbers")
    return value


Number = Annotated[float, BeforeValidator(_not_a_bool)]
"""A finite float, or a string that holds one, as old files have it."""

Whole = Annotated[int, BeforeValidator(_not_a_bool)]
"""An integer, or a string or float that holds one."""


_NAMES = {"BeforeValidator": BeforeValidator, "Field": Field, "Number": Number, "Whole": Whole}


class AwsModel(BaseModel):
    """Base of the file models: numbers may come as strings, unknown fields are kept in ``model_extra``.

    Every field carries a ``description`` that says what is allowed; messages quote it.
    """

    model_config = ConfigDict(extra="allow", frozen=True, allow_inf_nan=False)

    @property
    def unknown(self) -> tuple[str, ...]:
        """Fields that the file has and nobody here knows."""
        return tuple(self.model_extra or ())


def file_model(settings: type[Any], *, rename: Callable[[str], str] = str) -> type[AwsModel]:
    """The file model of a dataclass: its ``Annotated`` fields, which say what a file may hold.

    Its module need not import the names that they say it with, and so can be there before pydantic is.

    Args:
        settings: The dataclass.
        rename: From a field's name to the file's name for it.
    """
    hints = get_type_hints(settings, localns=_NAMES, include_extras=True)
    from_file = {
        rename(f.name): (hints[f.name], f.default) for f in fields(settings) if get_origin(hints[f.name]) is Annotated
    }
    model: type[AwsModel] = create_model(settings.__name__, __base__=AwsModel, **from_file)  # type: ignore[call-overload]
    return model


def validate(model: type[_Model], document: Mapping[str, Any], *, name: str) -> _Model:
    """The document as a model.

    Raises:
        ConfigError: Names each field at fault, its value, and what is allowed.
    """
    check_type(name, document, Mapping, "allowed is an object of named fields")
    try:
        return model.model_validate(document)
    except ValidationError as error:
        faults = [_sentence(model, fault, document) for fault in error.errors(include_url=False)]
        more = f" (and {len(faults) - 3} more)" if len(faults) > 3 else ""
        message = "; ".join(dict.fromkeys(faults[:3]))
        raise ConfigError(f"{name}: {message}{more}.") from error


def unknown_fields(model: AwsModel, *, name: str) -> tuple[str, ...]:
    """A sentence for every field the file has and the model does not, at any depth; such fields have no effect."""
    return tuple(
        f"{name}: unknown field {show(place)} has no effect. {did_you_mean(field, known)}".rstrip()
        for place, field, known in _unknown(model)
    )


def _unknown(model: AwsModel) -> Iterator[tuple[str, str, list[str]]]:
    """Where unknown fields are, their names, and those that are known there.

    What several entries of a list have is told once, as ``list[].field``: a habit of who wrote the file, not a slip.
    """
    known = list(type(model).model_fields)
    for field in model.unknown:
        yield field, field, known
    for outer in known:
        value = getattr(model, outer)
        if isinstance(value, AwsModel):
            for place, field, others in _unknown(value):
                yield f"{outer}.{place}", field, others
        elif isinstance(value, list):
            found: dict[str, list[tuple[int, str, list[str]]]] = {}
            for index, entry in enumerate(value):
                for place, field, others in _unknown(entry) if isinstance(entry, AwsModel) else ():
                    found.setdefault(place, []).append((index, field, others))
            for place, (first, *more) in found.items():
                index, field, others = first
                yield f"{outer}[{'' if more else index}].{place}", field, others


def show(value: object) -> str:
    """A value for a message: its repr, shortened."""
    text = repr(value)
    return text if len(text) <= MAX_SHOWN else text[: MAX_SHOWN - 3] + "..."


def _sentence(model: type[BaseModel], fault: Any, document: Any) -> str:
    location: tuple[str | int, ...] = fault["loc"]
    where = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location).lstrip(".")
    allowed = _description(model, location)
    if fault["type"] == "missing":
        return f"{where} is missing{f'; allowed is {allowed}' if allowed else ''}"
    value = show(_written(document, location, fault["input"]))
    suggestion = ""
    if fault["type"] == "literal_error":
        choices = re.findall("'([^']+)'", fault["ctx"]["expected"])
        allowed = allowed or ", ".join(choices)
        suggestion = did_you_mean(fault["input"], choices) if isinstance(fault["input"], str) else ""
    return f"{where} is {value}; allowed is {allowed or fault['msg']}" + (f" ({suggestion})" if suggestion else "")


def _written(document: Any, location: tuple[str | int, ...], read: object) -> object:
    """A value as its file has it, be it read in small letters; where it is not found, as it was read."""
    try:
        for part in location:
            document = document[part]
    except (LookupError, TypeError):
        return read
    return document


def _description(model: type[BaseModel], location: tuple[str | int, ...]) -> str:
    """What the innermost model field on the way to ``location`` allows."""
    description, current = "", model
    for part in location:
        field = current.model_fields.get(str(part)) if isinstance(part, str) else None
        if field is None:
            continue
        description = field.description or description
        inner = _inner_model(field.annotation)
        current = inner if inner is not None else current
    return description


def _inner_model(annotation: Any) -> type[BaseModel] | None:
    """The model inside ``Model``, ``list[Model]`` or ``Model | None``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in getattr(annotation, "__args__", ()):
        found = _inner_model(argument)
        if found is not None:
            return found
    return None
