"""A car that somebody drives in the page against one on the console's server: the same answers to the same controls."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_core_bits import in_node

from racecraft.serve.driving.drives import DrivenCar
from racecraft.serve.driving.schemas import Controls
from racecraft.site.plan import plan, track_file
from racecraft.track import load_track

pytestmark = pytest.mark.slow
DRIVES = (("hairpin", "v5", "forward"), ("oval", "v4", "reverse"), ("straight", "v6", "forward"))


def controls(track: str) -> list[dict[str, float]]:
    """Of a driver who leaves the road now and then, waits for a while, and on an open road arrives."""
    rng = np.random.default_rng(4)
    straight = [{"steering": 0.0, "speed": 4.0, "steps": 5}] * 40
    if track == "straight":
        return straight
    wild = [
        {"steering": float(rng.uniform(-0.4, 0.4)), "speed": float(rng.uniform(0, 3)), "steps": int(rng.integers(1, 5))}
        for _ in range(150)
    ]
    return [*wild, *[{"steering": 0.0, "speed": 0.0, "steps": 15}] * 12, *straight]


def test_a_car_driven_in_the_page_answers_as_the_servers(tmp_path: Path) -> None:
    told = plan()
    cases = [
        {
            **{"what": "driven", "plan": told, "track": track_file(name), "controls": controls(name)},
            "settings": {"vehicle": vehicle, "direction": direction},
        }
        for name, vehicle, direction in DRIVES
    ]
    results = in_node("core", cases, tmp_path)["results"]
    seen: dict[str, Any] = {"mistakes": 0, "laps": 0}
    for (name, vehicle, direction), theirs in zip(DRIVES, results, strict=True):
        car = DrivenCar(load_track(name), vehicle=vehicle, direction=direction, user_id=1)
        assert theirs["start"] == car.pose
        for asked, answer in zip(controls(name), theirs["answers"], strict=True):
            state, trace = car.step(Controls(**asked))
            assert answer == {"state": state.model_dump(), "trace": trace}
            seen["mistakes"] += bool(state.mistake)
            seen["laps"] += state.finished is not None
    assert seen["mistakes"] > 3
    assert seen["laps"] > 1
