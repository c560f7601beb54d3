"""The API's description, from which the client gets its types.

python -m racecraft.serve.openapi > web/openapi.json
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

from racecraft.serve.app import create_app
from racecraft.serve.settings import ServeSettings


def document() -> dict[str, Any]:
    """The OpenAPI, without the version, which changes with every release."""
    with tempfile.TemporaryDirectory() as folder:
        app = create_app(ServeSettings(runs=Path(folder)), hosts=set())
        described: dict[str, Any] = app.openapi()
        app.state.context.database.close()
    described["info"]["version"] = ""
    return described


if __name__ == "__main__":
    json.dump(document(), sys.stdout, indent=1)
    sys.stdout.write("\n")
