"""What the files that a racer brings along may hold, and one sentence for what is wrong in them.

Consoles, scripts and people wrote these files for years, so values may come as strings and fields may be
missing.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Annotated, Any, TypeVar, get_origin, get_type_hints

from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError, create_model

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


class AwsModel(BaseModel):
    """Base of the file models: numbers may come as strings, unknown fields are kept in ``model_extra``.

    Every field carries a ``description`` that says what is allowed; messages quote it.
    """

    model_config = ConfigDict(extra="allow", frozen=True, allow_inf_nan=False)


def file_model(settings: type[Any], *, rename: Callable[[str], str] = str) -> type[AwsModel]:
    """The file model of a dataclass: its ``Annotated`` fields, which say what a file may hold.

    Args:
        settings: The dataclass.
        rename: From a field's name to the file's name for it.
    """
    hints = get_type_hints(settings, include_extras=True)
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
    try:
        return model.model_validate(document)
    except ValidationError as error:
        faults = [_sentence(model, fault) for fault in error.errors(include_url=False)]
        more = f" (and {len(faults) - 3} more)" if len(faults) > 3 else ""
        message = "; ".join(dict.fromkeys(faults[:3]))
        raise ConfigError(f"{name}: {message}{more}.") from error


def unknown_fields(model: BaseModel, *, name: str) -> tuple[str, ...]:
    """A sentence for every field the file has and the model does not; such fields have no effect."""
    known = list(type(model).model_fields)
    return tuple(
        f"{name}: unknown field {show(field)} has no effect. {did_you_mean(field, known)}".rstrip()
        for field in model.model_extra or {}
    )


def show(value: object) -> str:
    """A value for a message: its repr, shortened."""
    text = repr(value)
    return text if len(text) <= MAX_SHOWN else text[: MAX_SHOWN - 3] + "..."


def _sentence(model: type[BaseModel], fault: Any) -> str:
    location: tuple[str | int, ...] = fault["loc"]
    where = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location).lstrip(".")
    allowed = _description(model, location)
    if fault["type"] == "missing":
        return f"{where} is missing{f'; allowed is {allowed}' if allowed else ''}"
    value = show(fault["input"])
    suggestion = ""
    if fault["type"] == "literal_error":
        choices = re.findall("'([^']+)'", fault["ctx"]["expected"])
        allowed = allowed or ", ".join(choices)
        suggestion = did_you_mean(fault["input"], choices) if isinstance(fault["input"], str) else ""
    return f"{where} is {value}; allowed is {allowed or fault['msg']}" + (f" ({suggestion})" if suggestion else "")


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
