"""Python's warnings within a block, of one thread at a time.

What holds for warnings is the whole process's until Python 3.14: of two threads in `warnings.catch_warnings` at once
each is told the other's, and who leaves last may leave the other's filters behind for good.
"""

from __future__ import annotations

import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final, Literal

_ONE_AT_A_TIME: Final = threading.RLock()


@contextmanager
def scoped_warnings(
    action: Literal["always", "error", "ignore"], category: type[Warning] = Warning
) -> Iterator[list[warnings.WarningMessage]]:
    """What is done about warnings of a category within; with ``"always"`` the list fills, and nothing is shown.

    In that list are warnings of other categories, too: of whatever Python collects meanwhile.
    """
    with _ONE_AT_A_TIME, warnings.catch_warnings(record=action == "always") as caught:
        warnings.simplefilter(action, category)
        yield [] if caught is None else caught
