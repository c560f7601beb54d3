"""What a reward pays along a track, as the page paints it, against the console's painting of the same reward."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest
from test_core_bits import in_node

from racecraft.reward import load_preset
from racecraft.reward.painting import paint_reward
from racecraft.sim import NO_OBJECTS, Bots, Objects, Obstacles
from racecraft.site.__main__ import python_files
from racecraft.site.javascript import javascript
from racecraft.site.plan import plan, track_file
from racecraft.track import load_track

pytestmark = pytest.mark.slow
TRACKS = ("reinvent_2018", "straight")  # closed and open, with four and two steps from place to place
PRESETS = ("centerline", "racing", "stay_inside", "dodge")
RACES = {
    "time-trial": NO_OBJECTS,
    "object-avoidance": Objects(obstacles=Obstacles(count=3, placement="even")),
    "head-to-bot": Objects(bots=Bots(count=2, placement="even", speed=0.7)),
}
OWN = """seen = []


def reward_function(params):
    seen.append(params["heading"])
    ahead = params["waypoints"][params["closest_waypoints"][1]]
    share = params["distance_from_center"] / params["track_width"]
    near = 0.0
    if params["objects_location"]:
        behind, ahead_of_it = params["closest_objects"]
        x, y = params["objects_location"][ahead_of_it]
        near = abs(params["x"] - x) + abs(params["y"] - y) + params["objects_speed"][behind]
    return 5 * params["all_wheels_on_track"] - share + params["progress"] * 0.01 + ahead[0] + near + 0.001 * len(seen)
"""


def test_a_reward_is_painted_as_in_the_console_among_the_objects_of_its_race(tmp_path: Path) -> None:
    told = plan()
    about = {name: told[name] for name in ("vehicle", "statuses", "objectColumns")}
    case = {
        "what": "paintings",
        "files": python_files(),
        "tracks": [track_file(name) for name in TRACKS],
        "among": [
            {**about, "objects": objects.to_dict(), "trials": told["races"][race]["trials"]}
            for race, objects in RACES.items()
        ],
        "rewards": javascript({name: load_preset(name) for name in PRESETS}),
        "presets": PRESETS,
        "source": OWN,
    }
    (theirs,) = in_node("core", [case], tmp_path)["results"]
    asked = product(TRACKS, RACES.values(), (*map(load_preset, PRESETS), OWN))
    for (name, objects, source), painted in zip(asked, theirs, strict=True):
        ours = paint_reward(source, load_track(name), objects=objects)
        np.testing.assert_allclose(np.reshape(painted["objects"], (-1, 2)), ours.objects, atol=6e-4)
        assert len(ours.objects) == objects.count
        assert painted["offsets"] == ours.offsets.tolist()
        np.testing.assert_allclose(painted["places"], ours.places, atol=6e-4)
        np.testing.assert_allclose(painted["points"], ours.points, atol=6e-4)
        assert np.isfinite(ours.rewards).all()
        np.testing.assert_allclose(np.array(painted["rewards"], float), ours.rewards, rtol=1e-9, atol=1e-9)
