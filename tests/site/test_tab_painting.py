"""What a reward pays along a track, as the page paints it, against the console's painting of the same reward."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_core_bits import in_node

from racecraft.reward import load_preset
from racecraft.reward.painting import paint_reward
from racecraft.sim.columns import STATUS_NAMES
from racecraft.site.__main__ import python_files
from racecraft.site.javascript import javascript
from racecraft.site.plan import track_file
from racecraft.track import load_track

pytestmark = pytest.mark.slow
TRACKS = ("reinvent_2018", "hairpin", "straight")
PRESETS = ("centerline", "racing", "stay_inside")
OWN = """seen = []


def reward_function(params):
    seen.append(params["heading"])
    ahead = params["waypoints"][params["closest_waypoints"][1]]
    share = params["distance_from_center"] / params["track_width"]
    return 5 * params["all_wheels_on_track"] - share + params["progress"] * 0.01 + ahead[0] + 0.001 * len(seen)
"""


def test_a_reward_is_painted_as_in_the_console(tmp_path: Path) -> None:
    case = {
        "what": "paintings",
        "files": python_files(),
        "tracks": [track_file(name) for name in TRACKS],
        "statuses": list(STATUS_NAMES),
        "rewards": javascript({name: load_preset(name) for name in PRESETS}),
        "presets": PRESETS,
        "source": OWN,
    }
    (theirs,) = in_node("core", [case], tmp_path)["results"]
    asked = [(name, source) for name in TRACKS for source in (*map(load_preset, PRESETS), OWN)]
    for (name, source), painted in zip(asked, theirs, strict=True):
        ours = paint_reward(source, load_track(name))
        assert painted["offsets"] == ours.offsets.tolist()
        np.testing.assert_allclose(painted["places"], ours.places, atol=6e-4)
        np.testing.assert_allclose(painted["points"], ours.points, atol=6e-4)
        assert np.isfinite(ours.rewards).all()
        np.testing.assert_allclose(np.array(painted["rewards"], float), ours.rewards, rtol=1e-9, atol=1e-9)
