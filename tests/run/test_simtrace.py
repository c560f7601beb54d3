import csv
import re
from pathlib import Path

import numpy as np
import pytest

from racecraft.agent import DiscreteActionSpace, ModelMetadata, action_space
from racecraft.errors import RunError
from racecraft.run import Episode, EpisodeCounter, SimTraceWriter, read_simtrace
from racecraft.run.simtrace import COLUMNS, WRITTEN
from racecraft.sim.columns import ROW_COLUMNS, STATUS_NAMES
from racecraft.track.track import Track

SHARED = Path(__file__).parents[3] / "shared"
DRFC, DROA = SHARED / "logs" / "drfc", SHARED / "logs" / "droa"
needs_logs = pytest.mark.skipif(not DRFC.exists(), reason="shared/logs is not there")


@pytest.fixture(scope="module")
def ring():
    angle = np.linspace(0, 2 * np.pi, 61)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    circle[-1] = circle[0]
    return Track("ring", 3 * circle, 2.5 * circle, 3.5 * circle)


def make_rows(num_envs, **values):
    rows = np.zeros((num_envs, len(ROW_COLUMNS)))
    for name, value in {"track_length": 18.8, "status": 1, "closest_next": 1, **values}.items():
        rows[:, ROW_COLUMNS.index(name)] = value
    return rows


def drive(writer, counter, lengths, rng, steps=60, step=None):
    """Cars whose episodes last ``lengths`` steps, over and over; returns the ended episodes."""
    step, ended = np.full(len(lengths), 2) if step is None else step, []
    for _ in range(steps):
        done = step == lengths
        rows = make_rows(len(lengths), steps=step, time=step / 15, progress=step / 100, x=rng.normal(size=len(lengths)))
        rows[done, ROW_COLUMNS.index("status")] = STATUS_NAMES.index("off_track")
        rewards = rng.normal(size=len(lengths))
        now = counter.update(rows, rewards, done)
        writer.write(rows, actions=rng.integers(0, 10, len(lengths)), rewards=rewards, ended=now)
        ended += now
        step[:] = np.where(done, 2, step + 1)
    return ended


@pytest.mark.costly
@needs_logs
def test_real_episodes_come_out_as_aws_wrote_them(tmp_path):
    real = (DRFC / "training-simtrace-20-iteration.csv").read_text().splitlines()
    header, *lines = (line.split(",") for line in real)
    route = np.load(SHARED / "tracks" / "reinvent_base.npy")
    track = Track("reinvent_base", route[:, :2], route[:, 2:4], route[:, 4:6])
    episodes = {}
    for line in lines:
        episodes.setdefault(int(line[0]), []).append(dict(zip(header, line, strict=True)))
    space = ModelMetadata.load(DRFC / "model_metadata.json").action_space
    writer = SimTraceWriter(tmp_path, num_envs=len(episodes), tracks=[track], action_space=space)
    longest = max(map(len, episodes.values()))
    for step in range(1, longest):  # all cars side by side, each one episode
        rows, actions, rewards, ended = make_rows(len(episodes)), np.zeros(len(episodes), int), [], []
        for car, (number, steps) in enumerate(episodes.items()):
            at = steps[min(step, len(steps) - 1)]
            start = float(steps[0]["tstamp"]) - 1 / 15
            arc, _ = track.project(np.array([float(at["X"]), float(at["Y"])]))
            following = int(np.searchsorted(track.arc_length, arc, side="right"))
            rows[car] = make_rows(
                1,
                steps=float(at["steps"]),
                x=float(at["X"]),
                y=float(at["Y"]),
                heading=np.radians(float(at["yaw"])),
                progress=float(at["progress"]) / 100,
                closest_prev=following - 1,
                closest_next=following,
                all_wheels_on_track=at["all_wheels_on_track"] == "True",
                status=STATUS_NAMES.index(at["episode_status"]),
                time=float(at["tstamp"]) - start,
                track_length=float(at["track_len"]),
            )[0]
            actions[car] = int(at["action"])
            rewards.append(float(at["reward"]))
            if step == len(steps) - 1:
                ended.append(Episode(number, car, len(steps), 0, 0, at["episode_status"], start, 0))
        writer.write(rows, actions=actions, rewards=rewards, ended=sorted(ended, key=lambda e: e.number))
    writer.close()

    ours = (tmp_path / "20-iteration.csv").read_text().splitlines()
    assert ours[0] == ",".join(WRITTEN) == ",".join([*header, "obstacle_crash_counter"])
    written = {}
    for line in ours[1:]:
        written.setdefault(int(line.split(",")[0]), []).append(dict(zip(WRITTEN, line.split(","), strict=True)))
    assert written.keys() == episodes.keys()
    rounded = {"yaw": 1e-9, "progress": 1e-9, "tstamp": 6e-4}
    for number, steps in episodes.items():
        assert len(written[number]) == len(steps)
        for mine, theirs in zip(written[number][1:], steps[1:], strict=True):
            for name in header:
                if name in rounded:
                    assert float(mine[name]) == pytest.approx(float(theirs[name]), abs=rounded[name])
                else:
                    assert mine[name] == theirs[name], (name, number, theirs["steps"])
        for name in ("steps", "reward", "done", "episode_status", "pause_duration"):
            assert written[number][0][name] == steps[0][name]


FLOAT = re.compile(r"-?\d+\.\d+(e[-+]\d+)?|-?\d(\.\d+)?e[-+]\d+")
FORMATS = {
    **dict.fromkeys(("steps", "X", "Y", "yaw", "steer", "throttle", "reward", "track_len", "pause_duration"), FLOAT),
    **dict.fromkeys(("episode", "action", "closest_waypoint", "obstacle_crash_counter"), re.compile(r"\d+")),
    **dict.fromkeys(("done", "all_wheels_on_track"), re.compile("True|False")),
    "progress": re.compile(f"{FLOAT.pattern}|100"),
    "tstamp": FLOAT,
    "wall_clock": FLOAT,
    "episode_status": re.compile("|".join(STATUS_NAMES)),
}


def assert_formats(path):
    with path.open(newline="") as file:
        for row in csv.DictReader(file):
            for name, text in row.items():
                assert FORMATS[name].fullmatch(text), (name, text)


@needs_logs
def test_number_formats_are_those_of_real_files(tmp_path, ring):
    for path in (*DRFC.glob("*.csv"), *DROA.glob("*.csv")):
        assert_formats(path)
    writer = SimTraceWriter(tmp_path, num_envs=3, tracks=[ring], action_space=action_space("default"))
    drive(writer, EpisodeCounter(3), np.array([5, 9, 30]), np.random.default_rng(0))
    writer.close()
    assert_formats(tmp_path / "0-iteration.csv")


def test_episodes_are_whole_in_sequence_and_agree_with_the_counter(tmp_path, ring):
    counter, rng = EpisodeCounter(4, number=40, clock=100.0), np.random.default_rng(1)
    writer = SimTraceWriter(tmp_path, num_envs=4, tracks=[ring], action_space=action_space("default"), episodes=40)
    lengths, step = np.array([7, 11, 13, 50]), np.full(4, 2)
    ended = drive(writer, counter, lengths, rng, steps=70, step=step)
    ended += drive(writer, counter, lengths, rng, steps=70, step=step)
    writer.close()
    assert 60 > len(ended) > 41
    files = [read_simtrace(tmp_path / f"{iteration}-iteration.csv") for iteration in (2, 3, 4)]
    assert [set(file["episode"] // 20) for file in files] == [{2}, {3}, {4}]
    table = {name: np.concatenate([file[name] for file in files]) for name in WRITTEN}
    numbers = table["episode"]
    assert np.array_equal(np.unique(numbers), np.arange(40, 40 + len(ended)))
    assert (np.diff(numbers) >= 0).all()
    assert (np.diff(table["tstamp"]) > 0).all()
    for episode in ended:
        rows = {name: values[numbers == episode.number] for name, values in table.items()}
        assert rows["steps"].tolist() == list(range(1, episode.steps + 1))
        assert rows["episode_status"][0] == "prepare"
        assert rows["episode_status"][-1] == episode.status == "off_track"
        assert rows["done"].tolist() == [False] * (len(rows["done"]) - 1) + [True]
        assert rows["reward"][0] == 0.0
        assert rows["tstamp"][-1] == pytest.approx(episode.end_time, abs=1e-3)
        assert rows["reward"].sum() == pytest.approx(episode.reward)


def test_full_lap_prints_100_and_the_nearest_waypoint_counts(tmp_path, ring):
    writer = SimTraceWriter(tmp_path, num_envs=1, tracks=[ring], action_space=action_space("default"))
    near_start = ring.centerline[0] + [0.01, 0.0]
    rows = make_rows(
        1,
        steps=2,
        progress=1.0,
        x=near_start[0],
        y=near_start[1],
        closest_prev=59,
        closest_next=60,
        heading=4.0,
    )
    rows[0, ROW_COLUMNS.index("status")] = STATUS_NAMES.index("lap_complete")
    (episode,) = EpisodeCounter(1).update(rows, [1.0], np.array([True]))
    writer.write(rows, actions=[4], rewards=[1.0], ended=[episode])
    writer.close()
    last = (tmp_path / "0-iteration.csv").read_text().splitlines()[-1].split(",")
    assert last[COLUMNS.index("progress")] == "100"
    assert last[COLUMNS.index("closest_waypoint")] == "60"
    assert last[COLUMNS.index("steer")] == "0.0"
    assert float(last[COLUMNS.index("yaw")]) == pytest.approx(np.degrees(4.0) - 360)


def test_continuous_actions_are_bracketed(tmp_path, ring):
    space = action_space("continuous")
    writer = SimTraceWriter(tmp_path, num_envs=1, tracks=[ring], action_space=space)
    rows = make_rows(1, steps=2, steering_angle=np.radians(-12.5), speed=1.25)
    (episode,) = EpisodeCounter(1).update(rows, [1.0], np.array([True]))
    writer.write(rows, actions=[[0.1, 0.2]], rewards=[1.0], ended=[episode])
    writer.close()
    assert re.search(r",\[-12.5 1.25\],", (tmp_path / "0-iteration.csv").read_text())
    np.testing.assert_allclose(read_simtrace(tmp_path / "0-iteration.csv")["action"], [[-12.5, 1.25]] * 2)


def test_very_long_episodes_are_bounded(tmp_path, ring, monkeypatch):
    monkeypatch.setattr("racecraft.run.simtrace.MAX_EPISODE_ROWS", 1000)
    writer = SimTraceWriter(
        tmp_path, num_envs=2, tracks=[ring], action_space=action_space("default"), episodes_per_iteration=0
    )
    drive(writer, EpisodeCounter(2), np.array([5000, 10]), np.random.default_rng(0), steps=5001)
    writer.close()
    steps = read_simtrace(tmp_path / "0-iteration.csv")["steps"]
    assert 1000 < (steps > 10).sum() < 2500
    assert steps.max() == 5000


def test_files_stay_within_their_budget_and_cover_the_run(tmp_path, ring):
    writer = SimTraceWriter(
        tmp_path,
        num_envs=2,
        tracks=[ring],
        action_space=DiscreteActionSpace([[0, 1], [0, 2]] * 5),
        max_bytes=100_000,
    )
    counter, rng = EpisodeCounter(2), np.random.default_rng(0)
    for _ in range(64):
        drive(writer, counter, np.array([7, 11]), rng)
    writer.close()
    files = sorted(int(path.name.split("-")[0]) for path in tmp_path.iterdir())
    assert sum(path.stat().st_size for path in tmp_path.iterdir()) < 130_000
    assert files[0] == 0
    assert files[-1] >= 0.9 * (counter.number // 20)
    assert len(set(np.diff(files))) == 1


@pytest.mark.parametrize("kept", [0, 13, 20, 47, 60])
def test_a_resumed_run_goes_on_where_its_checkpoint_was(tmp_path, ring, kept):
    def log(folder, rows, **options):
        """Writes some of the same episodes, one after the other."""
        writer = SimTraceWriter(folder, num_envs=1, tracks=[ring], action_space=action_space("default"), **options)
        for number in rows:
            last = make_rows(1, steps=2, progress=number / 100)
            episode = Episode(number, 0, 2, 0, 0, "off_track", float(number), 1 / 15)
            writer.write(last, actions=[0], rewards=[number], ended=[episode])
        return writer

    log(tmp_path / "whole", range(70)).close()
    log(tmp_path / "killed", range(65)).close()
    with (tmp_path / "killed" / "3-iteration.csv").open("a") as file:
        file.write("65,1.0,0.")  # in the middle of a row
    if not kept:
        (tmp_path / "killed" / "0-iteration.csv").write_text("episode,st")
    log(tmp_path / "killed", range(kept, 70), episodes=kept).close()
    whole, killed = (
        {path.name: path.read_text() for path in (tmp_path / name).iterdir()} for name in ("whole", "killed")
    )
    assert whole == killed
    assert len(whole) == 4


def test_pause_duration_counts_down_the_penalty(tmp_path, ring):
    writer = SimTraceWriter(tmp_path, num_envs=1, tracks=[ring], action_space=action_space("default"))
    statuses = ["in_progress", "off_track", "pause", "pause", "pause", "in_progress", "lap_complete"]
    for step, status in enumerate(statuses):
        rows = make_rows(1, steps=step + 2, status=STATUS_NAMES.index(status))
        ended = [Episode(0, 0, 8, 0, 1, status, 0.0, 0.5)] if step == len(statuses) - 1 else []
        writer.write(rows, actions=[0], rewards=[0], ended=ended)
    writer.close()
    pauses = read_simtrace(tmp_path / "0-iteration.csv")["pause_duration"]
    assert pauses == pytest.approx([0, 0, 3 / 15, 2 / 15, 1 / 15, 0, 0, 0], abs=1e-3)


def test_nothing_is_written_before_an_episode_ends(tmp_path, ring):
    writer = SimTraceWriter(tmp_path / "x", num_envs=2, tracks=[ring], action_space=action_space("default"))
    writer.write(make_rows(2), actions=[0, 1], rewards=[0, 0])
    writer.close()
    assert not (tmp_path / "x").exists()


def test_folder_that_is_a_file(tmp_path, ring):
    (tmp_path / "x").write_text("")
    writer = SimTraceWriter(tmp_path / "x", num_envs=1, tracks=[ring], action_space=action_space("default"))
    with pytest.raises(RunError, match="cannot be written"):
        drive(writer, EpisodeCounter(1), np.array([3]), np.random.default_rng(0))


@needs_logs
@pytest.mark.parametrize(
    ("path", "columns", "rows"),
    [
        (DRFC / "training-simtrace-0-iteration.csv", 17, 529),
        (DRFC / "evaluation-simtrace-0-iteration.csv", 18, 650),
        (DROA / "evaluation-simtrace-0-iteration.csv", 19, 1302),
    ],
)
def test_reader_takes_every_era(path, columns, rows, tmp_path):
    table = read_simtrace(path)
    assert list(table) == list(COLUMNS[:columns])
    assert {len(values) for values in table.values()} == {rows}
    assert table["steps"][0] == 1
    assert table["done"].dtype == bool
    assert table["action"].dtype == table["closest_waypoint"].dtype == np.int64
    oldest = tmp_path / "2019.csv"
    lines = path.read_text().splitlines()
    oldest.write_text("\n".join(",".join(line.split(",")[:15]) for line in lines[1:]))
    bare = read_simtrace(oldest)
    assert list(bare) == list(COLUMNS[:15])
    np.testing.assert_array_equal(bare["X"], table["X"])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("a,b\n", "has 2 columns, a sim-trace has 15 to 19"),
        (",".join(WRITTEN) + "\n1,2\n", "has 2 columns in line 2, expected 18"),
        (",".join(WRITTEN) + "\n" + ",".join(["x"] * 18), "is not a sim-trace"),
        (
            ",".join(WRITTEN) + "\n" + ",".join(["1"] * 9 + ["yes"] + ["1"] * 8),
            "done is 'yes'; allowed is True or False",
        ),
        (",".join(WRITTEN) + "\n" + ",".join(["1.5"] + ["1"] * 17), "episode is not a whole number"),
        (",".join(WRITTEN) + "\n" + ",".join(["1", "1", "inf"] + ["1"] * 15), "X is not a finite number"),
        (",".join(WRITTEN) + "\n" + '"' + "x" * 200_000, "is not a sim-trace"),
        (",".join(WRITTEN) + "\n" + ",".join(["1"] * 9 + ["0"] * 6 + ["x" * 9000, "1", "1"]), "9,000 characters"),
        ((",".join(["1"] * 15) + "\n") * 11, "more than 10 rows"),
    ],
)
def test_reader_refuses_what_is_no_simtrace(tmp_path, text, words):
    (tmp_path / "x.csv").write_text(text)
    with pytest.raises(RunError) as error:
        read_simtrace(tmp_path / "x.csv", max_rows=10)
    assert words in str(error.value)


def test_reader_takes_a_header_alone_and_refuses_bytes(tmp_path):
    (tmp_path / "x.csv").write_text(",".join(WRITTEN) + "\n")
    assert {values.shape for values in read_simtrace(tmp_path / "x.csv").values()} == {(0,)}
    (tmp_path / "x.csv").write_bytes(b"\xff\xfe")
    for path in (tmp_path / "x.csv", tmp_path, tmp_path / "none"):
        with pytest.raises(RunError):
            read_simtrace(path)
