"""Where kernels run: on the CPU everywhere, and on a GPU where there is one."""

from __future__ import annotations

import pytest
from host_device import HostDevice

from racecraft.errors import ConfigError
from racecraft.gpu import open_device


@pytest.fixture(params=["host", "gpu"])
def device(request):
    """The kernels' own text on the CPU, and the real thing."""
    if request.param == "host":
        return HostDevice()
    try:
        return open_device("cuda")
    except ConfigError as reason:
        pytest.skip(str(reason))
