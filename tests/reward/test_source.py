"""Presets and files are found, and what is not found is answered with a suggestion."""

from __future__ import annotations

import os
import re

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
        "slalom",
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
        (b"# coding: latin-2\ny = '\xff'\n", "not UTF-8 text: see line 2"),
        (b"x = 1\n\n# coding: latin-1\ny = '\xff'\n", "not UTF-8 text: see line 4"),
        (b"x = 1\n# coding: latin-1\ny = '\xff'\n", "not UTF-8 text: see line 3"),
        ("x = 'ö'".encode("utf-16-le"), "not UTF-8 text: see line 1"),
        (b"\xff\xfex", "not UTF-8 text: see line 1"),
        (b"#" * (MAX_CHARACTERS + 1), "more than 140,000"),
        (("#" * (MAX_CHARACTERS + 1)).encode("utf-16"), "more than 140,000"),
        (b"\xff" * (4 * MAX_CHARACTERS + 10), "more than 140,000"),
    ],
)
def test_bad_files(tmp_path, data, text):
    path = tmp_path / "reward.py"
    path.write_bytes(data)
    with pytest.raises(RewardError, match=text):
        load_reward(path)


def test_a_file_of_one_byte_to_a_letter_is_told_what_to_do(tmp_path):
    path = tmp_path / "reward.py"
    path.write_bytes("# Größe\n".encode("cp1252"))
    with pytest.raises(RewardError) as caught:
        load_reward(path)
    (advised,) = re.findall(r"# -\*-.*-\*-", caught.value.hint)
    path.write_bytes(f"{advised}\n# Größe, 5 €\n".encode("cp1252"))
    assert load_reward(path) == "# -*- coding: utf-8 -*-\n# Größe, 5 €\n"


@pytest.mark.parametrize(
    ("text", "encoding", "read"),
    [
        ("x = 'ö€'\r\n", "utf-8-sig", "x = 'ö€'\r\n"),
        ("x = 'ö€'\r\n", "utf-16", "x = 'ö€'\r\n"),
        ("\ufeffx = 'ö€'\n", "utf-16-be", "x = 'ö€'\n"),
        ("# coding=ISO_8859-15\nx = 'ö€'\n", "iso-8859-15", "# coding=utf-8\nx = 'ö€'\n"),
        ("#!/usr/bin/python\n# vim: set fileencoding=latin-1 : ö\n", "latin-1", None),
        ("# Maße\r\n# coding: latin1\r\nx = 'ö'\r\n", "latin-1", "# Maße\r\n# coding: utf-8\r\nx = 'ö'\r\n"),
        ("# coding: latin-1\nx = 'ö'\n", "utf-8", "# coding: latin-1\nx = 'ö'\n"),  # it is not what it says
    ],
)
def test_what_editors_save_is_read(tmp_path, text, encoding, read):
    path = tmp_path / "reward.py"
    path.write_bytes(text.encode(encoding))
    assert load_reward(path) == (read or text.replace("latin-1", "utf-8"))


@pytest.mark.parametrize("name", ["", ".", "no such thing", "x" * 5000, "a\0b", "/dev/zero", "/", "../.."])
def test_names_that_are_no_file(name):
    with pytest.raises(RewardError) as caught:
        load_reward(name)
    assert len(str(caught.value)) < 400


def test_a_pipe_is_no_file(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(RewardError, match="it is no regular file"):
        load_reward(tmp_path / "pipe")
