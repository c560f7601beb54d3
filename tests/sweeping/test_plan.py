"""The file of a sweep: what it says, and what it must not."""

from __future__ import annotations

from pathlib import Path

import pytest

from racecraft.errors import ConfigError, RacecraftError, RewardError, RunError
from racecraft.sweeping import Sweep, make_sweep, read_sweep
from racecraft.tuning import Tuning, find_constants

FILE = """
seeds = "3..4"
goal = "lap_time"

[all]
track = "oval"
until = "512 steps"
numbers = { gamma = 0.95 }

[settings.plain]

[settings.bold]
reward = "racing"
numbers = { learning_rate = 0.002, BORDER_LOSS = 0.25 }
"""


def test_settings_have_what_all_have_and_what_they_say_themselves() -> None:
    plan = read_sweep(FILE)
    assert (plan.seeds, plan.goal) == ((3, 4), "lap_time")
    plain, bold = plan.settings
    assert (plain.name, bold.name) == ("plain", "bold")
    for setting in plan.settings:
        assert setting.plan.settings.track == "oval"
        assert setting.plan.settings.until.steps == 512
        assert setting.plan.settings.ppo.gamma == 0.95
    assert bold.plan.settings.ppo.learning_rate == 0.002 != plain.plan.settings.ppo.learning_rate
    assert find_constants(bold.plan.reward)["BORDER_LOSS"] == 0.25
    assert bold.words == {
        "track": "oval",
        "until": "512 steps",
        "reward": "racing",
        "numbers": {"gamma": 0.95, "learning_rate": 0.002, "BORDER_LOSS": 0.25},
    }


def test_what_varies_makes_every_combination() -> None:
    plan = read_sweep('[settings.a]\n[settings.b]\n[vary]\ncritic = ["camera", "lap"]\ngamma = [0.9, 0.95]')
    assert [setting.name for setting in plan.settings][:4] == [
        "a-camera-0.9",
        "a-camera-0.95",
        "a-lap-0.9",
        "a-lap-0.95",
    ]
    assert len(plan.settings) == 8
    assert plan.settings[-1].plan.settings.critic == "lap"
    assert plan.settings[-1].plan.settings.ppo.gamma == 0.95
    assert [setting.name for setting in read_sweep("seeds = [1]").settings] == ["plain"]


def test_constants_of_the_reward_vary_as_hyperparameters_do() -> None:
    plan = read_sweep(
        '[settings.a]\nreward = "racing"\nnumbers = { gamma = 0.9 }\n'
        "[vary]\nBORDER_LOSS = [0.25, 0.5]\nOFF_TRACK_PENALTY = [-1.5]\nclip_coef = [0.1]"
    )
    assert [setting.name for setting in plan.settings] == ["a-0.25--1.5-0.1", "a-0.5--1.5-0.1"]
    assert [find_constants(setting.plan.reward)["BORDER_LOSS"] for setting in plan.settings] == [0.25, 0.5]
    assert all(setting.plan.settings.ppo.gamma == 0.9 for setting in plan.settings)


FIVE = ("gamma", "learning_rate", "update_epochs", "clip_coef", "gae_lambda")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("seeds = ", "not TOML"),
        ("", "says nothing"),
        ("# a note\n", "says nothing"),
        ('seeds = "5..1"', "seeds is '5..1'"),
        ("seeds = [1, 1]", "seeds is"),
        ("seeds = [1.5]", "seeds"),
        ("speed = 3", "has no 'speed'"),
        ("[all]\nnumbers = 3", "numbers"),
        ("[settings.a]\ntrak = 'oval'", "has no 'trak'"),
        ("[settings.a]\ntrack = 'nowhere'", "nowhere"),
        ("[settings.a]\nnumbers = { speling = 1 }", "The list of numbers has no 'speling'."),
        ("[settings.a]\nalgorithm = 'sac'\nactions = 'continuous'\nnumbers = { gamma = 0.9 }", "number of ppo"),
        ("settings = 3", "settings is 3"),
        ("[vary]\ncritic = 'lap'", "vary.critic"),
        ("[vary]\ncritc = ['lap']", "has no 'critc'.Did you mean 'critic'?"),
        ("[vary]\nBORDER_LOS = [1.0]", "has no 'BORDER_LOS'.Did you mean 'BORDER_LOSS'?"),
        ("[vary]\nnumbers = [1.0]", "has no 'numbers'"),
        ("[vary]\ncritic = ['lap', 'lap']", "Two settings"),
        (
            "[settings.'ä']\n[settings.'ö']",
            "called 'run'.Give them names under [settings] that differ in their first 40",
        ),
        ("goal = 'points'", "goal"),
        ("[settings.a]\ntrack = 5", "track is 5; allowed is a text, or a list of them"),
        ("[settings.a]\ntrack = []", "track is []; allowed is a text, or a list of them"),
        ("[settings.a]\ntrack = ['oval', 5]", "track is ['oval', 5]; allowed is a text, or a list of them"),
        ("[settings.a]\nactions = {}", "actions is {}; allowed is a text"),
        ('[settings.a]\nhyperparameters = "\\u0000"', "hyperparameters is '\\x00'; allowed is a text"),
        ("[vary]\nalgorithm = [['ppo']]", "algorithm is ['ppo']; allowed is a text"),
        ("[settings.a]\nnumbers = { BORDER_LOSS = 'x' }", "BORDER_LOSS is 'x'; allowed is a finite number"),
        ("[settings.a]\nnumbers = { BORDER_LOSS = true }", "BORDER_LOSS is True; allowed is a finite number"),
        (
            "seeds = '1..100'\n[vary]\ngamma = [0.9, 0.91, 0.92, 0.93, 0.94, 0.95, 0.96, 0.97, 0.98, 0.99, 0.995]",
            "A sweep of 1100 trainings, settings times seeds, is too long; allowed are 1000.",
        ),
        ("[vary]\n" + "\n".join(f"{name} = {list(range(30))}" for name in FIVE), "24300000 settings are more than 64"),
        ("[settings]\n" + "\n".join(f"a{number} = {{}}" for number in range(65)), "65 settings are more than 64"),
        ("a = " + 5000 * "[", "nested too deeply"),
        ("[all]\n" + ".".join(5000 * "a") + " = 1", "nested too deeply"),
        (f"seeds = [{5000 * '9'}]", "not TOML"),
        (100_001 * "#", "has 100,001 characters"),
    ],
)
def test_what_is_no_sweep_is_refused_in_a_sentence(text: str, says: str) -> None:
    with pytest.raises(RacecraftError) as told:
        read_sweep(text)
    assert says in str(told.value) + told.value.hint


def test_who_reads_it_may_refuse_a_word() -> None:
    def refuse(word: str, value: object) -> object:
        raise ConfigError(f"{word} is nobody's business.")

    with pytest.raises(ConfigError, match="Setting 'a': track is nobody's"):
        read_sweep("[settings.a]\ntrack = 'oval'", resolve=refuse)


def test_a_reward_that_is_none_is_told_with_its_setting(tmp_path: Path) -> None:
    (tmp_path / "none.py").write_text("def reward(params):\n    return 1.0\n")
    text = f"[settings.a]\n[settings.b]\nreward = '{tmp_path / 'none.py'}'"
    with pytest.raises(RewardError, match=r"^Setting 'b': ") as told:
        make_sweep(read_sweep(text), runs=tmp_path, name="s")
    assert "reward_function" in str(told.value)
    with pytest.raises(RewardError, match=r"^Setting 'b': .*'racign'") as told:
        read_sweep("[settings.a]\n[settings.b]\nreward = 'racign'")
    assert "racing" in told.value.hint


@pytest.mark.parametrize("name", ["none", "x" * 5000, "a\0b", ""])
def test_a_sweep_that_there_is_not_is_told(name: str, tmp_path: Path) -> None:
    with pytest.raises(RunError, match="There is no sweep") as told:
        Sweep(tmp_path, name)
    assert len(str(told.value)) < 600
    with pytest.raises((RunError, ConfigError), match=r"holds no tuning|use the path of a search's folder"):
        Tuning(tmp_path / name)
