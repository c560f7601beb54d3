"""What a perceiver is made of and given, and what is said of anything else."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from racecraft.errors import ConfigError, ShapeError
from racecraft.perception import Perceiver


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"num_threads": "a"}, "num_threads is 'a'; allowed is a whole number from 0 to 1024."),
        ({"num_threads": -1}, "num_threads is -1; allowed is a whole number from 0 to 1024."),
        ({"weights": None, "seed": "a"}, "seed is 'a'; allowed is a whole number from 0 to 9223372036854775807."),
    ],
)
def test_settings_that_are_none_are_told(given: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError) as told:
        Perceiver(**given)
    assert str(told.value) == says


def test_what_is_no_pictures_and_no_path_is_told(tmp_path: Path) -> None:
    perceiver = Perceiver(None, num_threads=1)
    for frames in ([], None, "a"):
        with pytest.raises(ShapeError, match=r"^frames are .*, expected an array of uint8, \(N, 120, 160\)\.$"):
            perceiver(frames)  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match=r"^path is 5; use a file's path\.$"):
        perceiver.save(5)  # type: ignore[arg-type]
    perceiver.save(str(tmp_path / "w"))
    Perceiver(tmp_path / "w", num_threads=1)
