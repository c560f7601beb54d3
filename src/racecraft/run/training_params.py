"""AWS's ``training_params.yaml``: where and how to race. Keys that mean nothing here are kept."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, get_args

from racecraft.errors import ConfigError
from racecraft.json_file import read_text
from racecraft.run.atomic import write_file

if TYPE_CHECKING:  # `file_model` knows these names: pydantic and YAML's reader are for whom a file is there
    from pydantic import Field

    from racecraft.agent.aws_file import AwsModel, Number, Whole

MAX_BYTES = 1 << 18
MAX_DEPTH = 20  # of nested YAML
MAX_PLAIN = 1000  # characters of a value without quotes, which may be read as a number
_REFUSED = {"AliasToken": "a YAML alias (*...)", "TagToken": "a YAML tag (!...)"}
_WORD: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,99}")
_DECIMAL: Final = re.compile(r"-?\d+\.\d+")
_WORDS_OF_YAML: Final = frozenset(("yes", "no", "true", "false", "on", "off", "null", "y", "n"))
RaceType = Literal["TIME_TRIAL", "OBJECT_AVOIDANCE", "HEAD_TO_BOT", "HEAD_TO_MODEL", "F1"]
_YES_NO = "true or false"


@dataclass(frozen=True)
class TrainingParams:
    """The settings of a training job; each field is the AWS key of the same name in capitals."""

    world_name: Annotated[str, Field(min_length=1, max_length=200, description="a track's name")] = "reinvent_base"
    """Track."""
    race_type: Annotated[RaceType, Field(description=", ".join(get_args(RaceType)))] = "TIME_TRIAL"
    """What else is on the track."""
    reverse_dir: Annotated[bool, Field(description=_YES_NO)] = False
    """Drive against the track's direction."""
    alternate_driving_direction: Annotated[bool, Field(description=_YES_NO)] = False
    """Change direction with every training episode."""
    change_start_position: Annotated[bool, Field(description=_YES_NO)] = True
    """Start every training episode a little further on."""
    round_robin_advance_dist: Annotated[Number, Field(ge=0, le=1, description="0 to 1, a share of the lap")] = 0.05
    """How much further."""
    start_position_offset: Annotated[Number, Field(ge=0, le=1, description="0 to 1, a share of the lap")] = 0.0
    """Where the first episode starts."""
    enable_domain_randomization: Annotated[bool, Field(description=_YES_NO)] = False
    """Change light and colours with every episode."""
    min_eval_trials: Annotated[Whole, Field(ge=1, le=1000, description="1 to 1000")] = 5
    """Evaluation episodes after each iteration."""
    best_model_metric: Annotated[
        Literal["progress", "reward", "laptime"], Field(description="'progress', 'reward' or 'laptime'")
    ] = "progress"
    """What makes a checkpoint the best."""

    extra: Mapping[str, Any] = field(default_factory=dict, hash=False)
    """Keys of the file that mean nothing here; kept and written back."""

    given: frozenset[str] = field(default=frozenset(), compare=False, repr=False)
    """Fields that the file really had; the others have their defaults."""

    @classmethod
    def load(cls, path: str | Path) -> TrainingParams:
        """From AWS's file.

        Raises:
            ConfigError: Names the file, the key, its value and what is allowed.
        """
        return cls.from_yaml(read_text(path, max_bytes=MAX_BYTES), name=str(path))

    @classmethod
    def from_yaml(cls, text: str, *, name: str = "training_params") -> TrainingParams:
        """From the file's text; ``name`` is what messages call it. A list of one is taken for its element."""
        import yaml

        from racecraft.agent.aws_file import validate

        try:
            depth, keys, is_key = 0, set[str](), False  # the stream is a level of its own
            for token in yaml.scan(text, Loader=yaml.SafeLoader):
                kind = type(token).__name__
                depth += kind.endswith("StartToken") - kind.endswith("EndToken")
                if depth > MAX_DEPTH:  # before the parser, which takes quadratic time in the depth
                    raise ConfigError(f"{name} is nested too deeply.")
                if is_key and depth == 2 and isinstance(token, yaml.ScalarToken):
                    if token.value in keys:
                        raise ConfigError(f"{name} gives {token.value[:80]!r} twice.")
                    keys.add(token.value)
                is_key = kind == "KeyToken"
                if kind in _REFUSED:
                    raise ConfigError(f"{name} has {_REFUSED[kind]}, which is not allowed.")
                if isinstance(token, yaml.ScalarToken) and token.plain and len(token.value) > MAX_PLAIN:
                    raise ConfigError(f"{name} has a value of {len(token.value):,} characters without quotes.")
            document = yaml.safe_load(text)
        except ConfigError:
            raise
        except (yaml.YAMLError, ValueError) as error:
            mark = getattr(error, "problem_mark", None)
            where = f" at line {mark.line + 1}, column {mark.column + 1}" if mark else ""
            raise ConfigError(f"{name} is not valid YAML{where}.") from error
        if document is None:
            document = {}
        if not isinstance(document, dict) or not all(isinstance(key, str) for key in document):
            raise ConfigError(f"{name} is not a list of settings such as 'WORLD_NAME: oval'.")
        single = {k: v[0] if isinstance(v, list) and len(v) == 1 else v for k, v in document.items()}
        known = {key: single[key] for key in _file().model_fields if key in single}
        checked = validate(_file(), known, name=name)
        values = {key.lower(): getattr(checked, key) for key in _file().model_fields}
        extra = {key: value for key, value in document.items() if key not in known}
        return cls(**values, extra=extra, given=frozenset(key.lower() for key in known))

    def to_yaml(self) -> str:
        """The text of AWS's file."""
        own = {f.name.upper(): getattr(self, f.name) for f in fields(self) if f.name not in ("extra", "given")}
        document = {**own, **self.extra}
        if all(_is_plain(key) and _is_plain(value) for key, value in document.items()):
            return "".join(f"{key}: {_scalar(value)}\n" for key, value in document.items())
        import yaml  # a start in which it has nothing to quote does not wait for it

        return str(yaml.safe_dump(document, sort_keys=False))

    def save(self, path: str | Path) -> None:
        """Write AWS's file."""
        try:
            write_file(Path(path), self.to_yaml().encode())
        except OSError as error:
            raise ConfigError(f"{path} cannot be written: {error.strerror or error}.") from error


def _is_plain(value: object) -> bool:
    """Whether YAML writes it as one does by hand: a flag, a short number, or a word that could be nothing else."""
    if isinstance(value, str):
        return bool(_WORD.fullmatch(value)) and value.lower() not in _WORDS_OF_YAML
    return isinstance(value, bool | int) or (isinstance(value, float) and bool(_DECIMAL.fullmatch(repr(value))))


def _scalar(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


@cache
def _file() -> type[AwsModel]:
    from racecraft.agent.aws_file import file_model

    return file_model(TrainingParams, rename=str.upper)
