"""The entry point: every verb registered, every error told in one sentence."""

from __future__ import annotations

import codecs
import gc
import importlib
import os
import sys
import traceback
import warnings
from collections.abc import Sequence
from contextlib import suppress
from copy import copy
from io import TextIOWrapper
from typing import Any, cast

import typer
from typer.main import get_command_name
from typer.models import CommandInfo

from racecraft.cli.app import INTERRUPTED, app, print_json, text
from racecraft.errors import ConfigError, RacecraftError, printable_lines
from racecraft.extras import not_installed

UsageError = cast(type[Exception], typer.BadParameter.__mro__[1])  # typer hands out no name for this base

VERBS = (
    "train",
    "imports",
    "evaluate",
    "races",
    "league",
    "report",
    "export",
    "car",
    "perceive",
    "tracks",
    "reward",
    "tune",
    "sweep",
    "learn",
    "lessons",
    "logs",
    "serve",
    "operate",
    "machine",
)
"""Files of verbs in the order of ``--help``; to import one is to register its verbs."""
ALONE = frozenset({"train", "evaluate", "report", "export", "learn", "perceive", "sweep", "tune"})
"""Verbs that are all that the file of their name holds: who types one waits for no other file."""
VERSION_OPTIONS = frozenset({"--version", "--json"})

GARBAGE = 50_000, 10, 10
"""New objects before they are searched for garbage: by the default of 700 a start looks through what it has just
imported over and over, a tenth of its time."""


def every_verb() -> typer.Typer:
    """The application with all its verbs."""
    return _with(VERBS)


def _with(names: Sequence[str]) -> typer.Typer:
    """The application, the verbs of these files among its own."""
    for name in names:
        importlib.import_module(f"racecraft.cli.{name}")
    return app


def application(arguments: Sequence[str]) -> typer.Typer:
    """The application with the verb that the arguments begin with, or with all of them where that is none.

    Typer builds the options of every verb that it is given before it looks at what was typed: half of a short verb's
    time. The version asks for none of them.
    """
    if "--version" in arguments and VERSION_OPTIONS.issuperset(arguments):
        return app
    verb = arguments[0] if arguments else ""
    whole = _with([verb]) if verb in ALONE else every_verb()
    asked = copy(whole)
    asked.registered_commands = [one for one in whole.registered_commands if _word(one) == verb]
    asked.registered_groups = [one for one in whole.registered_groups if one.name == verb]
    return asked if asked.registered_commands or asked.registered_groups else whole


def _word(verb: CommandInfo) -> str:
    """What is typed for a verb."""
    return verb.name or get_command_name(verb.callback.__name__ if verb.callback is not None else "")


def main() -> None:
    """Run the command line.

    The exit status is 0; 1 for a mistake in what the user gave, told in one sentence; 2 for wrong usage; 130 when
    interrupted. With ``--json`` an error is a JSON object on stdout, too. ``--debug`` shows the stack trace.
    """
    gc.set_threshold(*GARBAGE)
    _hold_standard_files()
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # or every package installed is asked for one
    arguments = [argument for argument in sys.argv[1:] if argument != "--debug"]
    is_debug, is_json = len(arguments) < len(sys.argv) - 1, "--json" in arguments
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper) and _can_fail(stream):  # who lacks a sign sees another for it
            stream.reconfigure(errors="replace")
    warnings.showwarning = lambda message, *_, **__: typer.echo(f"warning: {printable_lines(str(message))}", err=True)
    try:
        status = application(arguments)(arguments, prog_name="racecraft", standalone_mode=False)
    except UsageError as error:
        usage: Any = error
        if is_json:
            verb = usage.ctx.command_path if usage.ctx is not None else "racecraft"
            print_error("UsageError", usage.format_message(), f"See '{verb} --help'.")
        usage.show()
        sys.exit(2)
    except (typer.Abort, KeyboardInterrupt):  # the latter while the verbs are still being built
        sys.exit(INTERRUPTED)
    except Exception as error:
        told = _known(error) or error
        is_expected = isinstance(told, RacecraftError | OSError)
        code, message = type(told).__name__, _sentence(told)
        hint = getattr(told, "hint", "") if is_expected else "This is a bug in Racecraft. --debug shows where."
        if is_debug:
            traceback.print_exc()
        if is_json:
            with suppress(OSError):  # which may be what is told
                print_error(code, message, hint)
        if not is_debug:
            text().say_error(code, message, hint)
        sys.exit(1)
    sys.exit(status if isinstance(status, int) else 0)


def _hold_standard_files() -> None:
    """Put nothing where one of the three was closed: a file of ours would take its number, and what others write to it.

    Whoever starts a program with ``<&-`` does so; a process that we start could have a pipe of ours for its stderr.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)


def _can_fail(stream: TextIOWrapper) -> bool:
    """Whether a sign may be one that a stream cannot write; in UTF-8 even half a name can be, byte for byte."""
    is_utf8 = codecs.lookup(stream.encoding).name == "utf-8"
    return stream.errors == "strict" or (stream.errors == "surrogateescape" and not is_utf8)


def _known(error: Exception) -> ConfigError | None:
    """What an import that failed asks of the user; None of everything else."""
    if isinstance(error, ModuleNotFoundError):
        return not_installed(error.name or "")
    if isinstance(error, ImportError) and str(error).startswith("Instruction set"):
        return ConfigError(str(error), hint="The variable RACECRAFT_ISA asks for it; without it the best is taken.")
    return None


def _sentence(error: Exception) -> str:
    """What an error says; of a file that cannot be used, its path and the system's reason."""
    if isinstance(error, OSError) and isinstance(error.filename, str) and error.strerror:
        return f"{error.filename} cannot be used: {error.strerror}."
    return str(error)


def print_error(code: str, message: str, hint: str) -> None:
    """An error as one JSON object on stdout."""
    print_json({"error": {"code": code, "message": message, "hint": hint}})
