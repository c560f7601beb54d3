"""A real console for each file of tests."""

from collections.abc import Iterator

import pytest
from running_consoles import RunningConsole, running_console


@pytest.fixture(scope="module")
def console(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningConsole]:
    pytest.importorskip("fastapi")
    with running_console(tmp_path_factory.mktemp("console") / "runs") as running:
        yield running
