"""`racecraft race`, `ladder`, `film` and `verify`."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import Run


@pytest.mark.costly
def test_race_verify_and_ladder(racecraft: Run, trained: Path, tmp_path: Path) -> None:
    short = ("--track", "oval", "--time-limit", "4", "--no-video", "--laps", "1")
    document = racecraft("race", str(trained), f"{trained}@64", *short, "--json").document
    assert [result["place"] for result in document["results"]] == [None, None]
    replays = [path for name, path in document["files"].items() if name.startswith("replay")]
    assert len(replays) == 2
    for replay in replays:
        assert racecraft("verify", replay, "--json").document["is_genuine"]
    told = racecraft("verify", replays[0])
    assert told.status == 0
    assert "bit for bit" in told.out
    table = racecraft("race", str(trained), "--type", "object-avoidance", "--objects", "2", *short)
    assert table.status == 0
    assert "crashes" in table.out

    rated = racecraft("ladder", str(trained), f"{trained}@64", "-t", "oval", "--starts", "1", "--time-limit", "4")
    assert rated.status == 0
    assert "rating" in rated.out
    assert racecraft("race", str(trained), "--bots", "2", *short).err.startswith("ConfigError: --bots goes with --type")

    filmed = racecraft("film", replays[0], "--ghost", replays[1], "--ghost", "best-lap", "--json").document
    assert Path(filmed["video"]).stat().st_size > 10_000
    assert racecraft("film", replays[0], "--car", "6").err.startswith("ConfigError: Car 6")

    from racecraft.replay import read_replay, write_replay

    forged = read_replay(replays[0])
    forged.rewards[0][5] += 1.0
    path = write_replay(forged, tmp_path / "forged.replay")
    refused = racecraft("verify", str(path))
    assert refused.status == 1
    assert "step 5" in refused.out
    document = racecraft("verify", str(path), "--json").document
    assert (document["is_genuine"], document["difference"]["step"]) == (False, 5)
    assert racecraft("verify", str(tmp_path / "none.replay")).err.startswith("ReplayError")


def test_options_that_do_nothing_are_refused(racecraft: Run, tmp_path: Path) -> None:
    for option in (("--car", "2"), ("--ghost", "best-lap")):
        refused = racecraft("film", str(tmp_path), *option)
        assert (refused.status, "--car and --ghost are for a replay file" in refused.err) == (2, True)
    told = racecraft("share", str(tmp_path), "--language", "fr")
    assert told.err == "ConfigError: language is 'fr'; allowed are en, de.\n"


@pytest.mark.costly
def test_a_table_of_a_drive_among_boxes_fits_into_80_characters(racecraft: Run, trained: Path) -> None:
    short = ("--track", "oval", "--laps", "10", "--trials", "1", "--max-resets", "200", "--no-video")
    told = racecraft("evaluate", str(trained), *short, "--race", "object-avoidance").out
    assert "crashes" in told
    assert "…" not in told


@pytest.mark.costly
def test_a_race_of_a_secret_is_announced_held_and_checked(racecraft: Run, trained: Path, tmp_path: Path) -> None:
    short = ("--track", "oval", "--time-limit", "3", "--no-video", "--laps", "1", "--trials", "3")
    held = racecraft("race", str(trained), f"{trained}@64", *short, "--secret")
    assert held.status == 0, held.err
    (commitment,) = (line.split()[1] for line in held.err.splitlines() if line.startswith("Commitment"))
    assert f"Commitment:  {commitment}" in held.out
    (secret,) = (line.split()[1] for line in held.out.splitlines() if line.startswith("Secret:"))
    (folder,) = (tmp_path / "races").iterdir()
    checked = racecraft("verify", str(folder))
    assert checked.status == 0
    assert f"Commitment {commitment}" in checked.out
    assert "Genuine: replays, starts and result are what the race says." in checked.out
    document = racecraft("verify", str(folder / "race.json"), "--json").document
    assert (document["is_genuine"], document["commitment"]) == (True, commitment)

    replay = next(folder.glob("*.replay"))
    told = racecraft("verify", str(replay), "--race", commitment)
    assert told.status == 0
    assert f"Of the race {commitment}: its secret gives these starts." in told.out
    refused = racecraft("verify", str(replay), "--race", secret)
    assert refused.status == 1
    assert "Not of its race: its race has the commitment" in refused.out
    again = racecraft("race", str(trained), *short, "--json").document
    assert racecraft("verify", str(replay), "--race", str(again["folder"]), "--json").status == 1
    assert racecraft("verify", str(again["folder"]), "--race", commitment).status == 1
    nonsense = racecraft("verify", str(replay), "--race", commitment[1:])
    assert nonsense.err.startswith("ConfigError: There is no race")
    assert "64 signs of 0 to 9 and a to f" in nonsense.err
    filmed = racecraft("film", str(replay), "-o", str(tmp_path / "our films" / "ü.mp4"))
    assert (filmed.status, (tmp_path / "our films" / "ü.mp4").is_file()) == (0, True)

    both = racecraft("race", str(trained), *short, "--secret", "--seed", "4")
    assert both.status == 2
    assert "--secret and --seed" in both.err
    many = racecraft("race", str(trained), str(trained), "--type", "grid", *short)
    assert many.err.startswith("ConfigError: A grid race has 3 trials")

    results = folder / "race.json"
    results.write_text(results.read_text().replace('"place": null', '"place": 1', 1))
    forged = racecraft("verify", str(folder))
    assert forged.status == 1
    assert "is not what its replay leads to" in forged.out
    results.write_text('{"files": {"replay": "' + replay.name + '"}}')
    old = racecraft("verify", str(folder))
    assert old.status == 0
    assert "Driven under the old rules" in old.out


@pytest.mark.parametrize("option", ["--race", "--commitment"])
def test_an_empty_name_of_a_race_is_not_passed_over(racecraft: Run, option: str) -> None:
    outcome = racecraft("verify", "race.replay", option, "")
    assert outcome.status == 2
    assert f"{option} is empty" in outcome.err
