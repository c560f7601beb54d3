"""The dry run shows what a reward function does with the moments of a real track."""

from __future__ import annotations

import numpy as np
import pytest

from racecraft.errors import RewardError, RewardTimeout
from racecraft.reward.dry_run import dry_run, moment, situations
from racecraft.reward.source import load_preset, preset_names
from racecraft.sim.columns import ROW_COLUMNS


def column(situation, name):
    return situation.row[ROW_COLUMNS.index(name)]


def test_situations_cover_what_training_meets(track):
    by_name = {situation.name: situation for situation in situations(track)}
    assert {
        "start",
        "straight",
        "bend left",
        "bend right",
        "left edge",
        "off track",
        "other way",
        "finish",
    } <= set(by_name)
    assert len(by_name) == len(situations(track))
    assert column(by_name["start"], "steps") == 2.0
    assert column(by_name["finish"], "progress") == 1.0
    assert column(by_name["off track"], "is_offtrack") == 1.0
    assert column(by_name["left edge"], "offset") > 0.0 > column(by_name["right edge"], "offset")
    assert column(by_name["other way"], "track_index") == 1.0
    speeds = [column(by_name[name], "speed") for name in ("slow", "straight", "fast")]
    assert speeds == [0.5, 1.5, 4.0]
    pace = by_name["on pace"]
    assert (column(pace, "steps"), column(pace, "progress")) == (100, 2 / 3)
    assert column(pace, "projection_distance") == pytest.approx(track.length * 2 / 3)
    for situation in by_name.values():
        assert situation.row.shape == (len(ROW_COLUMNS),)
        assert np.isfinite(situation.row).all()
        assert situation.description.endswith(".")


def test_rows_agree_with_the_track(track):
    for situation in situations(track):
        road = track.reversed() if column(situation, "track_index") else track
        s, offset = road.project([column(situation, "x"), column(situation, "y")])
        assert offset == pytest.approx(column(situation, "offset"), abs=1e-9)
        assert s % track.length == pytest.approx(column(situation, "projection_distance"), abs=1e-9)
        behind, ahead = int(column(situation, "closest_prev")), int(column(situation, "closest_next"))
        assert ahead == behind + 1
        assert (
            road.arc_length[behind] - 1e-9 <= column(situation, "projection_distance") <= road.arc_length[ahead] + 1e-9
        )


def test_every_place_lies_between_its_two_waypoints(track):
    last = len(track.arc_length) - 1
    for place in np.linspace(0.0, track.length, 200, endpoint=False):
        row = dict(zip(ROW_COLUMNS, moment(track, float(place)), strict=True))
        before, after = int(row["closest_prev"]), int(row["closest_next"])
        assert 0 <= before < after <= last
        assert track.arc_length[before] - 1e-9 <= place <= track.arc_length[after] + 1e-9


@pytest.mark.parametrize("name", preset_names())
def test_presets_manage_every_situation(track, name):
    for outcome in dry_run(load_preset(name), track):
        assert outcome.error is None
        assert isinstance(outcome.reward, float)
        assert outcome.printed == ""


def test_racing_prefers_what_is_right(track):
    reward = {outcome.situation.name: outcome.reward for outcome in dry_run(load_preset("racing"), track)}
    assert reward["fast"] > reward["straight"] > reward["slow"] > 0.0 > reward["backwards"]
    assert reward["straight"] > reward["left edge"] > reward["sideways"] > reward["off track"] == -1.0
    assert reward["other way"] == pytest.approx(reward["straight"])


def test_one_failing_situation_does_not_hide_the_others(track):
    source = (
        "def reward_function(params):\n    print(params['steps'])\n"
        "    assert not params['is_offtrack'], 'off'\n    return params['progress']\n"
    )
    outcomes = dry_run(source, track)
    failed = [outcome for outcome in outcomes if outcome.error is not None]
    assert [outcome.situation.name for outcome in failed] == ["off track"]
    assert failed[0].reward is None
    assert failed[0].error.line == 3
    assert failed[0].error.params == failed[0].params
    assert all(outcome.printed == f"{outcome.params['steps']}\n" for outcome in outcomes)


def test_a_call_that_does_not_return_is_waited_for_once(track):
    outcomes = dry_run("def reward_function(params):\n    while True:\n        pass\n", track, timeout_s=0.2)
    assert [type(outcome.error) for outcome in outcomes] == [RewardTimeout]
    assert outcomes[0].error.line in (2, 3)


def test_a_source_that_does_not_load(track):
    with pytest.raises(RewardError):
        dry_run("x = 1", track)
