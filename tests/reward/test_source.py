"""Presets and files are found, and what is not found is answered with a suggestion."""

from __future__ import annotations

import os

import pytest

from racecraft.errors import ConfigError, RewardError
from racecraft.reward.source import MAX_CHARACTERS, load_preset, load_reward, preset_names


def test_the_presets():
    assert preset_names() == [
        "anti_zigzag",
        "centerline",
        "dodge",
        "duel",
        "heading",
        "lap_time",
        "object_avoidance",
        "overtake",
        "progress_pace",
        "racing",
        "speed_gate",
        "stay_inside",
        "touring",
    ]
    for name in preset_names():
        assert "def reward_function(params):" in load_preset(name)
        assert load_reward(name) == load_preset(name)


@pytest.mark.parametrize("load", [load_preset, load_reward])
def test_misspelt_presets(load):
    with pytest.raises(RewardError, match="Did you mean 'centerline'") as caught:
        load("centreline")
    assert "stay_inside" in caught.value.hint


def test_a_function_is_none_of_them():
    with pytest.raises(ConfigError, match=r"reward is <built-in function max>; .* only environments take a function"):
        load_reward(max)


def test_files(tmp_path, monkeypatch):
    path = tmp_path / "reward_function.py"
    path.write_bytes(b"\xef\xbb\xbfx = '\xc3\xbc'\r\n")
    assert load_reward(path) == load_reward(str(path)) == "x = 'ü'\r\n"
    with pytest.raises(RewardError, match=r"Did you mean '.*reward_function\.py'"):
        load_reward(tmp_path / "reward_functoin.py")
    with pytest.raises(RewardError, match="is a folder") as caught:
        load_reward(tmp_path)
    assert "reward_function.py" in caught.value.hint
    monkeypatch.chdir(tmp_path)
    (tmp_path / "racing").write_text("mine")
    assert load_reward("./racing") == "mine"
    assert load_reward("racing") == load_preset("racing")


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"x = 1\ny = '\xff'\n", "not UTF-8 text: see line 2"),
        (b"#" * (MAX_CHARACTERS + 1), "more than 140,000"),
        (b"\xff" * (4 * MAX_CHARACTERS + 10), "more than 140,000"),
    ],
)
def test_bad_files(tmp_path, data, text):
    path = tmp_path / "reward.py"
    path.write_bytes(data)
    with pytest.raises(RewardError, match=text):
        load_reward(path)


@pytest.mark.parametrize("name", ["", ".", "no such thing", "x" * 5000, "a\0b", "/dev/zero", "/", "../.."])
def test_names_that_are_no_file(name):
    with pytest.raises(RewardError) as caught:
        load_reward(name)
    assert len(str(caught.value)) < 400


def test_a_pipe_is_no_file(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(RewardError, match="it is no regular file"):
        load_reward(tmp_path / "pipe")
