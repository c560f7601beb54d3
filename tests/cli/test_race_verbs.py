"""`racecraft race`, `ladder`, `film` and `verify`."""

from __future__ import annotations

from pathlib import Path

from command_line import Run


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
