"""Recipes: a name for settings, which what is given besides goes before."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from racecraft.cli.entry import every_verb
from racecraft.errors import ConfigError
from racecraft.learn import DistillConfig
from racecraft.reward import load_reward
from racecraft.run import RunFolder
from racecraft.track import load_tracks
from racecraft.training import train
from racecraft.training.recipes import FOLDED_ROADS, MOSTLY_STRONG, RECIPES, TRAFFIC, WIDE_ROADS, with_recipe
from racecraft.training.start import read_settings


def test_what_is_given_goes_before_the_recipe() -> None:
    made = with_recipe("everywhere", {"track": "oval", "reward": None, "until": "", "seed": 3})
    assert made == {**RECIPES["everywhere"], "track": "oval", "seed": 3}
    assert with_recipe("", {"track": None}) == {"track": None}


def test_a_recipe_that_does_not_exist() -> None:
    with pytest.raises(ConfigError, match="recipe is 'everwhere'; allowed are steady, everywhere, traffic") as caught:
        train(recipe="everwhere")
    assert "everywhere" in caught.value.hint


@pytest.mark.costly
def test_the_command_trains_with_what_the_recipe_says(tmp_path: Path) -> None:
    command = ["train", "--recipe", "everywhere", "--track", "oval", "--track", "kidney", "--direction", "forward"]
    done = CliRunner().invoke(
        every_verb(), [*command, "--until", "1 second", "--num-threads", "1", "--runs", str(tmp_path), "--json"]
    )
    assert done.exit_code == 0, done.output
    folder = RunFolder.open(json.loads(done.stdout.splitlines()[-1])["run"])
    settings = read_settings(folder)
    assert (settings.algorithm, settings.direction, settings.track) == ("distill", "forward", "oval + kidney")
    assert settings.distill == RECIPES["everywhere"]["distill"] != DistillConfig()
    assert settings.randomize == MOSTLY_STRONG
    assert settings.randomize.friction == (0.6, 1.3)  # strong
    assert folder.read_reward_function() == load_reward("touring")
    assert folder.read_model_metadata().action_space.kind == "continuous"


def test_traffic_is_learned_on_roads_with_room(tmp_path: Path) -> None:
    command = ["train", "--recipe", "traffic", "--track", "oval", "--until", "1 second", "--num-threads", "1"]
    done = CliRunner().invoke(every_verb(), [*command, "--runs", str(tmp_path), "--json"])
    assert done.exit_code == 0, done.output
    folder = RunFolder.open(json.loads(done.stdout.splitlines()[-1])["run"])
    settings = read_settings(folder)
    assert settings.objects == TRAFFIC
    assert settings.distill == RECIPES["traffic"]["distill"]
    assert folder.read_reward_function() == load_reward("dodge")
    assert [track for track in load_tracks(WIDE_ROADS) if not 0.89 < track.mean_width < 1.11] == []


@pytest.mark.costly
def test_everywhere_is_learned_on_folded_roads_too() -> None:
    assert RECIPES["everywhere"]["track"] == FOLDED_ROADS
    tracks = load_tracks(FOLDED_ROADS)
    assert len({track.digest for track in tracks}) == len(tracks) == 82
    folded = {track.name: track.mean_width for track in tracks if "verge=0.3" in track.name}
    assert sorted({round(width, 2) for width in folded.values()}) == [0.7, 1.07]
    assert sum(width > 1.0 for width in folded.values()) == 20
