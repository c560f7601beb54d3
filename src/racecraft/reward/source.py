"""Where reward functions come from: the presets that ship with Racecraft, and files."""

from __future__ import annotations

import codecs
import re
from pathlib import Path

from racecraft.errors import ConfigError, RewardError, did_you_mean

MAX_CHARACTERS = 140_000  # longest source that AWS accepts
CODINGS = {
    **dict.fromkeys(("latin-1", "latin1", "iso-8859-1", "iso8859-1"), "latin-1"),
    **dict.fromkeys(("latin-9", "latin9", "iso-8859-15", "iso8859-15"), "iso-8859-15"),
    **dict.fromkeys(("cp1252", "windows-1252"), "cp1252"),
}
"""What a coding line may say that is not UTF-8: one byte to a character, as editors save."""
_CODING = re.compile(rb"((?:[ \t\f]*(?:#[^\r\n]*)?\r?\n)?[ \t\f]*#[^\r\n]*?coding[:=][ \t]*)([-\w.]+)")
_PRESETS = Path(__file__).with_name("presets")


def preset_names() -> list[str]:
    """Names of the rewards that ship with Racecraft, in alphabetical order."""
    return sorted(path.stem for path in _PRESETS.glob("*.py"))


def load_preset(name: str) -> str:
    """The source of a preset.

    Raises:
        RewardError: There is none of this name.
    """
    if name not in preset_names():
        raise RewardError(
            f"Reward preset {name!r} does not exist. {did_you_mean(name, preset_names())}".rstrip(),
            hint=f"The presets are {', '.join(preset_names())}.",
        )
    return (_PRESETS / f"{name}.py").read_text(encoding="utf-8")


def load_reward(name_or_path: str | Path) -> str:
    """The source of a reward function.

    Args:
        name_or_path: A preset's name, or the path of a ``reward_function.py``. A preset goes before a file of
            the same name; write ``./racing`` to mean the file.

    Raises:
        ConfigError: It is a function: only the environments take one, as a training's runs in a process of its own.
        RewardError: It is neither, or the file is not text of 1 to 140,000 characters, see `decode_reward`.
    """
    if not isinstance(name_or_path, str | Path):  # checked here, as a browser's tab has no `racecraft.checks`
        advice = "use a preset's name or a file's path; only environments take a function"
        raise ConfigError(f"reward is {repr(name_or_path)[:100]}; {advice}.")
    if str(name_or_path) in preset_names():
        return load_preset(str(name_or_path))
    path = Path(name_or_path).expanduser()
    try:
        is_file, is_folder, is_there = path.is_file(), path.is_dir(), path.exists()
    except (OSError, ValueError):  # a name too long, or with a NUL in it
        is_file = is_folder = is_there = False
    if is_folder:
        inside = path / "reward_function.py"
        hint = f"Did you mean '{inside}'?" if inside.is_file() else "Name the file inside it."
        raise RewardError(f"'{path}' is a folder, expected a reward function's file.", hint=hint)
    if is_there and not is_file:  # a pipe that nobody writes to would be waited for
        raise RewardError(f"Reward function '{path}' cannot be read: it is no regular file.")
    if not is_file:
        suggestion = did_you_mean(str(name_or_path), [*preset_names(), *_python_files_beside(path)])
        raise RewardError(
            f"Reward {str(name_or_path)[:200]!r} is neither a preset nor a file. {suggestion}".rstrip(),
            hint=f"The presets are {', '.join(preset_names())}.",
        )
    try:
        with path.open("rb") as file:
            data = file.read(4 * MAX_CHARACTERS + 1)
        source = decode_reward(data)
    except OSError as error:
        raise RewardError(f"Reward function '{path}' cannot be read: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        if len(data) > 4 * MAX_CHARACTERS:
            raise RewardError(_too_long(path)) from error
        line = data[: error.start].count(b"\n") + 1
        raise RewardError(
            f"Reward function '{path}' is not UTF-8 text: see line {line}.",
            line=line,
            hint="Save it as UTF-8, or let its first line say what it is, such as: # -*- coding: cp1252 -*-",
        ) from error
    if len(source) > MAX_CHARACTERS:
        raise RewardError(_too_long(path))
    return source


def decode_reward(data: bytes) -> str:
    """A source's text: in UTF-8, in UTF-16 with a byte order mark, or in what its coding line says (PEP 263).

    That line may name an encoding of `CODINGS`; in the text it says UTF-8, as which the text is kept.

    Raises:
        UnicodeDecodeError: It is none of them.
    """
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):  # as a Windows shell's > writes
        return data.decode("utf-16")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        said = _CODING.match(data)
        if said is None or (coding := CODINGS.get(said[2].decode().lower().replace("_", "-"))) is None:
            raise
        before, after = data[: said.start(2)], data[said.end(2) :]
        return f"{before.decode(coding)}utf-8{after.decode(coding)}"


def _too_long(path: Path) -> str:
    return f"Reward function '{path}' has more than {MAX_CHARACTERS:,} characters, the most that AWS accepts."


def _python_files_beside(path: Path) -> list[str]:
    """Paths that the user may have meant, as they would have written them."""
    try:
        return [str(file) for file in sorted(path.parent.glob("*.py"))[:100]]
    except (OSError, ValueError):
        return []
