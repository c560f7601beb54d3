"""Settings of boxes and bots: what is refused, what survives JSON, and those of DeepRacer for Cloud."""

from __future__ import annotations

import pytest

from racecraft.errors import ConfigError
from racecraft.sim import Bots, Objects, Obstacles, Simulation, objects_for_race, objects_from_aws
from racecraft.track import load_track

SEVERAL = Objects(
    obstacles=Obstacles(count=4, placement="random", min_distance=1.0),
    bots=Bots(count=2, placement="random", speed=0.8, changes_lane=True),
)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Obstacles(count=0), "Obstacles count is 0; allowed is a whole number from 1 to 32"),
        (lambda: Obstacles(count=33), "from 1 to 32"),
        (lambda: Obstacles(kind="bx"), "kind is 'bx'; allowed are box, car"),
        (lambda: Obstacles(placement="rnd"), "placement is 'rnd'; allowed are even, random, fixed"),
        (lambda: Obstacles(placement="fixed"), "with 0 fixed positions"),
        (lambda: Obstacles(positions="0.1,1"), "positions is '0.1,1'; allowed is a list"),
        (lambda: Obstacles(positions=(0.1,)), "position is 0.1; allowed is a pair"),
        (lambda: Obstacles(positions=((1.5, 1),)), "position is 1.5; allowed is a number from 0 to 1"),
        (lambda: Obstacles(positions=((0.5, 0),)), r"lane is 0; allowed is 1 \(inner\) or -1 \(outer\)"),
        (lambda: Obstacles(min_distance=-1.0), "min_distance is -1.0"),
        (lambda: Obstacles(min_distance=float("nan")), "min_distance is nan"),
        (lambda: Bots(speed=11.0), "Bots speed is 11.0; allowed is a number from 0 to 10"),
        (lambda: Bots(changes_lane="no"), "changes_lane is 'no'"),
        (lambda: Bots(shortest_stay=4.0, longest_stay=3.0), "longest_stay is 3.0; allowed is a number from 4 to"),
        (lambda: Objects(obstacles=6), "obstacles is 6; use racecraft.sim.Obstacles"),
        (lambda: Objects(obstacles=Obstacles(count=20), bots=Bots(count=20)), "has 40 objects; allowed are up to 32"),
        (lambda: Simulation(load_track("oval"), camera=None, objects=6), "objects is 6"),
        (lambda: objects_for_race("f1"), "Race type is 'f1'; allowed are time-trial"),
        (lambda: objects_for_race("time-trial", settings={"count": 3}), "A time trial has no objects"),
        (lambda: objects_from_aws(5), "settings is 5; allowed is a dict of AWS's names and values"),
        (lambda: objects_from_aws({5: "a"}), "settings is {5: 'a'}; allowed is a dict"),
        (lambda: objects_for_race("head-to-bot", settings={"sped": 3}), "Bots have no setting 'sped'"),
    ],
)
def test_what_cannot_be_is_refused_by_name_and_value(make, message):
    with pytest.raises(ConfigError, match=message):
        make()


def test_settings_survive_json():
    assert Objects.from_dict(SEVERAL.to_dict()) == SEVERAL
    assert Objects.from_dict({}) == Objects()
    with pytest.raises(ConfigError, match="allowed are the fields of Bots"):
        Objects.from_dict({"bots": {"count": 1, "wheels": 4}})


def test_deepracer_for_cloud_settings():
    assert objects_from_aws({}) == Objects()
    avoidance = {"DR_RACE_TYPE": "OBJECT_AVOIDANCE", "DR_OA_NUMBER_OF_OBSTACLES": "4", "DR_H2B_BOT_CAR_SPEED": "9"}
    assert objects_from_aws(avoidance) == Objects(obstacles=Obstacles(count=4))
    fixed = objects_from_aws({**avoidance, "DR_OA_OBJECT_POSITIONS": '"0.23,-1;0.46,1"'})
    assert fixed == Objects(obstacles=Obstacles(count=2, placement="fixed", positions=((0.23, -1), (0.46, 1))))
    cars = {"DR_OA_IS_OBSTACLE_BOT_CAR": "True", "DR_OA_RANDOMIZE_OBSTACLE_LOCATIONS": "True"}
    assert objects_from_aws({**avoidance, **cars}).obstacles == Obstacles(count=4, kind="car", placement="random")
    bot_settings = {
        "DR_RACE_TYPE": "HEAD_TO_BOT",
        "DR_H2B_NUMBER_OF_BOT_CARS": "5",
        "DR_H2B_BOT_CAR_SPEED": "0.6",
        "DR_H2B_IS_LANE_CHANGE": "True",
        "DR_H2B_LOWER_LANE_CHANGE_TIME": "2",
        "DR_H2B_UPPER_LANE_CHANGE_TIME": "6",
        "DR_H2B_LANE_CHANGE_DISTANCE": "1.5",
        "DR_H2B_MIN_DISTANCE_BETWEEN_BOT_CARS": "3",
        "DR_H2B_RANDOMIZE_BOT_CAR_LOCATIONS": "true",
    }
    assert objects_from_aws(bot_settings).bots == Bots(
        count=5,
        speed=0.6,
        changes_lane=True,
        shortest_stay=2.0,
        longest_stay=6.0,
        change_distance=1.5,
        min_distance=3.0,
        placement="random",
    )
    for name, value in (
        ("DR_H2B_BOT_CAR_SPEED", "fast"),
        ("DR_H2B_IS_LANE_CHANGE", "maybe"),
        ("DR_H2B_NUMBER_OF_BOT_CARS", "-1"),
    ):
        with pytest.raises(ConfigError, match=f"{name} is '{value}'"):
            objects_from_aws({**bot_settings, name: value})
    with pytest.raises(ConfigError, match="is '²'; allowed is a whole number"):
        objects_from_aws({**avoidance, "DR_OA_NUMBER_OF_OBSTACLES": "²"})
    with pytest.raises(ConfigError, match="DR_OA_OBJECT_POSITIONS"):
        objects_from_aws({**avoidance, "DR_OA_OBJECT_POSITIONS": "here"})
