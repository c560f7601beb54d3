"""Strict reading of small text and JSON files of strangers, and one sentence for what is wrong in them.

Never accepted is a file that says two things at once (duplicate keys), or has numbers or letters that are none.
"""

from __future__ import annotations

import codecs
import errno
import json
import math
import os
import stat
import sys
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO, Final, NoReturn

from racecraft.errors import ConfigError

MAX_BYTES = 1 << 20  # bytes; the largest file AWS's console wrote is under 10 kB


def open_regular(path: str | Path) -> BinaryIO:
    """A regular file, to be read. Whoever reads a pipe waits for somebody to write, maybe for ever.

    Raises:
        OSError: Not readable, or no path, a folder, a pipe, a socket or a device.
    """
    if not isinstance(path, str | os.PathLike):  # a number would be the file that the process has open by it
        raise OSError(errno.EINVAL, "it is no path")
    try:
        mode = os.stat(path).st_mode
    except ValueError as error:  # a zero in it, or half a letter
        raise OSError(errno.EINVAL, "it is no path") from error
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "it is no regular file")
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    return open(handle, "rb")


def read_bytes(path: str | Path, *, max_bytes: int, name: str = "") -> bytes:
    """The content of a file; never more than one byte above `max_bytes` is read.

    Args:
        path: The file.
        max_bytes: How large it may be.
        name: What messages call it; its path where none is given.

    Raises:
        ConfigError: Not readable, no regular file, or too large.
    """
    try:
        with open_regular(path) as file:
            data = file.read(max_bytes + 1)
    except OSError as error:
        raise ConfigError(f"{name or path} cannot be read: {error.strerror or error}.") from error
    if len(data) > max_bytes:
        raise ConfigError(f"{name or path} is larger than {max_bytes:,} bytes, too large for a file of its kind.")
    return data


def read_text(path: str | Path, *, max_bytes: int = MAX_BYTES, name: str = "") -> str:
    """As :func:`read_bytes`, of UTF-8 text, with or without a byte order mark, or of UTF-16 with one.

    Raises:
        ConfigError: Not readable, too large, or neither.
    """
    data = read_bytes(path, max_bytes=max_bytes, name=name)
    if is_utf16(data):
        with suppress(UnicodeDecodeError):
            return data.decode("utf-16")
    return decode_text(data, name=name or str(path))


def is_utf16(data: bytes) -> bool:
    """Whether a file begins as those that a Windows shell's > writes."""
    return data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))


def decode_text(data: bytes, *, name: str) -> str:
    """UTF-8 text from memory, with or without a byte order mark; ``name`` is what messages call it."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ConfigError(f"{name} is not UTF-8 text: byte {error.start} is {data[error.start]:#04x}.") from error


def read_json_object(path: str | Path, *, max_bytes: int = MAX_BYTES) -> dict[str, Any]:
    """The JSON object in a file of text.

    Raises:
        ConfigError: Not readable, too large, not text, not a JSON object, or with duplicate keys, NaN or half letters.
    """
    return parse_json_object(read_text(path, max_bytes=max_bytes), name=str(path))


def parse_json_object(data: bytes | str, *, name: str) -> dict[str, Any]:
    """As :func:`read_json_object`, from memory; ``name`` is what messages call it."""
    text = decode_text(data, name=name) if isinstance(data, bytes) else data
    try:
        document = _DECODER.decode(text)
        if "\\u" in text:
            _check_pairs(document)
    except RecursionError as error:
        raise ConfigError(f"{name} is nested too deeply.") from error
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno}"
        raise ConfigError(f"{name} is not valid JSON: {error.msg} at {where}.") from error
    except ValueError as error:
        raise ConfigError(f"{name} is not valid: {error}.") from error
    if not isinstance(document, dict):
        raise ConfigError(f"{name} holds a JSON {_json_type(document)}, expected an object {{...}}.")
    return document


def parse_json_line(line: bytes) -> dict[str, Any] | None:
    """The object of a line of a file that grows line by line, or None where the line is damaged."""
    try:
        return parse_json_object(line, name="The line")
    except ConfigError:
        return None


def write_json_object(path: str | Path, document: Mapping[str, Any]) -> None:
    """Write a document as AWS's console does: UTF-8, two spaces.

    Raises:
        ConfigError: It is no path, or the file cannot be written.
    """
    try:
        if not isinstance(path, str | os.PathLike):
            raise OSError(errno.EINVAL, "it is no path")
        Path(path).write_text(json.dumps(document, indent=2), encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{path} cannot be written: {error.strerror or error}.") from error


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    document = dict(pairs)
    if len(document) < len(pairs):
        seen: set[str] = set()
        for name, _ in pairs:
            if name in seen:
                raise ValueError(f"field {name!r} is given twice")
            seen.add(name)
    return document


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a number that JSON allows")


def _finite_float(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text} is too large for a number")
    return value


def _finite_int(text: str) -> int:
    value = int(text)
    if abs(value) > sys.float_info.max:  # who computes with it would have infinity
        raise ValueError("a whole number is too large for a number")
    return value


_DECODER: Final = json.JSONDecoder(
    object_pairs_hook=_unique, parse_constant=_no_constant, parse_float=_finite_float, parse_int=_finite_int
)


def _check_pairs(document: object) -> None:
    try:
        json.dumps(document, ensure_ascii=False).encode()
    except UnicodeEncodeError as error:
        raise ValueError("a text has half of a surrogate pair, which can be neither shown nor stored") from error


def _json_type(value: object) -> str:
    if isinstance(value, list):
        return "array"
    return "string" if isinstance(value, str) else "value"
