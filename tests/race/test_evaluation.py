import json

import numpy as np
import pytest

from racecraft.errors import ConfigError, NonFiniteAction, ShapeError
from racecraft.race import Autopilot, RaceRules, Recording, completion, evaluate, generalize, trial_simulation
from racecraft.race.default_reward import centerline_rewards
from racecraft.race.placement import line_up, reset_pose, start_pose
from racecraft.replay.header import header_of
from racecraft.sim import ROW_COLUMNS, STATE_COLUMNS, Vehicle
from racecraft.sim.columns import STATUS_NAMES
from racecraft.track import Track, load_track

OVAL, RING, STRAIGHT = load_track("oval"), load_track("reinvent_2018"), load_track("straight")
DT = 1 / 15
EVEN = Vehicle(steering_bias=0.0, speed_gain=1.0)  # drives straight on, as fast as it is told


class Constant:
    """Always the same command."""

    def __init__(self, steering, speed):
        self.command = np.float32([steering, speed])

    def __call__(self, sight):
        return np.tile(self.command, (len(sight), 1))


class Tiring(Autopilot):
    """Drives slower with every step that it has driven."""

    def __init__(self):
        super().__init__()
        object.__setattr__(self, "steps", 0)

    def __call__(self, state, cars=None):
        object.__setattr__(self, "steps", self.steps + 1)
        return super().__call__(state) * np.float32([1.0, 1.0 - 0.001 * self.steps])

    def forget(self):
        object.__setattr__(self, "steps", 0)


def drive(driver, track=OVAL, *, num_trials=1, seed=0, **rules):
    rules = RaceRules(**rules)
    return evaluate(driver, track, rules=rules, num_trials=num_trials, seed=seed, sees="state", vehicle=EVEN)


def runs_of(statuses):
    """[(status, how often in a row)]"""
    runs = []
    for status in statuses:
        if runs and runs[-1][0] == status:
            runs[-1][1] += 1
        else:
            runs.append([status, 1])
    return [tuple(run) for run in runs]


# --- laps and their times


def test_flying_laps_share_one_clock():
    evaluation = drive(Autopilot(), laps=3)
    (trial,) = evaluation.trials
    recording = trial.recording
    crossings = recording.clock[recording.column("status") == 2]
    assert [lap.time for lap in trial.laps] == pytest.approx(np.diff(crossings, prepend=0.0))
    assert [lap.start_time for lap in trial.laps] == pytest.approx([0.0, *crossings[:-1]])
    assert trial.time == pytest.approx(len(recording) * DT)  # every step counts, the one that prepares included
    assert trial.laps[1].time < trial.laps[0].time  # the first has a standing start
    assert runs_of(recording.statuses)[0] == ("prepare", 1)
    assert trial.is_finished
    assert trial.completion == 1.0


def test_standing_laps_are_alike_and_each_has_its_own_start():
    evaluation = drive(Autopilot(), laps=3, is_continuous=False, lateral_jitter=0.0, heading_jitter=0.0)
    (trial,) = evaluation.trials
    times = [lap.time for lap in trial.laps]
    assert times == pytest.approx([times[0]] * 3)
    assert trial.recording.statuses.count("prepare") == 3
    assert np.diff(trial.recording.clock) == pytest.approx(DT)
    assert trial.recording.lap_numbers[0] == 1
    assert [len(trial.recording.lap(number)) * DT for number in (1, 2, 3)] == pytest.approx(times)


def test_laps_of_an_open_track_have_standing_starts():
    evaluation = drive(Autopilot(), STRAIGHT, laps=2, is_continuous=True)
    assert evaluation.laps_completed == 2
    assert evaluation.trials[0].recording.statuses.count("prepare") == 2


def test_lap_time_is_distance_over_speed():
    (trial,) = drive(Autopilot(speed=1.0), laps=2).trials
    (first, second) = trial.laps
    driven = np.hypot(*np.diff(trial.recording.lap(2).origins, axis=0).T)
    assert second.time == pytest.approx(driven.sum() / trial.recording.lap(2).column("actual_speed").mean(), rel=0.01)
    assert driven.sum() == pytest.approx(OVAL.length, rel=0.05)  # it cuts the bends a little
    assert second.time == pytest.approx(OVAL.length / 1.0, rel=0.03)
    assert first.time == pytest.approx(OVAL.length / 1.0, abs=0.5)


def test_the_other_direction_takes_as_long():
    forward, reverse = (drive(Autopilot(), RING, laps=1, direction=way) for way in ("forward", "reverse"))
    assert reverse.best_lap == pytest.approx(forward.best_lap, abs=0.2)
    headings = [evaluation.trials[0].recording.column("heading")[0] for evaluation in (forward, reverse)]
    assert np.cos(headings[0] - headings[1]) < -0.9


def test_a_start_elsewhere():
    evaluation = drive(Autopilot(), laps=1, start_offset=0.4)
    recording = evaluation.trials[0].recording
    assert recording.column("projection_distance")[0] == pytest.approx(0.4 * OVAL.length + 0.14, abs=0.01)
    assert recording.column("progress")[0] == pytest.approx(0.14 / OVAL.length, abs=0.001)
    assert evaluation.laps_completed == 1


# --- mistakes


def test_off_track_by_hand():
    evaluation = drive(Constant(0.0, 2.0), laps=1, max_resets=1, offtrack_penalty=2.0)
    (trial,) = evaluation.trials
    rows, statuses = trial.recording.rows, trial.recording.statuses
    (prepare, _), (first, _), off, pause, second, end = runs_of(statuses)
    assert (prepare, first, second[0]) == ("prepare", "in_progress", "in_progress")
    assert off == end == ("off_track", 1)
    assert pause == ("pause", 30)  # 2 s

    mistake = statuses.index("off_track")
    before, stands = rows[mistake - 1], rows[mistake + 1]
    column = ROW_COLUMNS.index
    # it stands in the lane it was nearest to, where it was a step before, along the track and at rest
    lane = np.sign(before[column("offset")]) * OVAL.width_at(before[column("projection_distance")]) / 4
    origin = trial.recording.origins[mistake + 1]
    s, offset = OVAL.project(origin)
    assert s == pytest.approx(before[column("projection_distance")], abs=0.03)
    assert offset == pytest.approx(lane, abs=0.01)
    assert stands[column("heading")] == pytest.approx(OVAL.heading_at(s), abs=0.05)
    assert stands[column("actual_speed")] == 0.0
    assert stands[column("progress")] == pytest.approx(stands[column("projection_distance")] / OVAL.length)
    paused = rows[mistake + 1 : mistake + 31]
    assert (np.ptp(paused[:, [column("x"), column("y"), column("heading"), column("progress")]], axis=0) == 0).all()

    (lap,) = trial.laps
    assert (lap.status, lap.off_track_count, lap.resets, lap.penalty_seconds) == ("off_track", 2, 1, 2.0)
    assert lap.time == pytest.approx(len(rows) * DT)
    assert trial.status == "off_track"
    assert 0.0 < trial.completion < 1.0


@pytest.mark.parametrize("penalty", [0.0, 1.0, 3.0])
def test_penalties_add_to_the_lap_time_and_to_nothing_else(penalty):
    driver = Constant(0.0, 1.0)
    free = drive(driver, laps=1, offtrack_penalty=0.0, max_resets=1000)
    paid = drive(driver, laps=1, offtrack_penalty=penalty, max_resets=1000)
    (lap,), (free_lap,) = paid.trials[0].laps, free.trials[0].laps
    assert lap.is_complete
    assert not lap.is_clean
    assert lap.resets == lap.off_track_count == free_lap.resets > 3
    assert lap.penalty_seconds == pytest.approx(penalty * lap.resets)
    assert lap.time == pytest.approx(free_lap.time + penalty * lap.resets)
    assert paid.clean_lap_rate == 0.0
    assert paid.summary()["penalty_seconds"] == pytest.approx(penalty * lap.resets)


def test_immobilized_by_hand():
    # the steps 2 to 16 do not move, and neither do the 15 after each reset
    evaluation = drive(Constant(0.0, 0.0), laps=1, max_resets=2)
    (lap,) = evaluation.trials[0].laps
    assert (lap.status, lap.immobilized_count, lap.resets) == ("immobilized", 3, 2)
    assert lap.penalty_seconds == 0.0
    assert lap.time == pytest.approx(46 * DT)


def test_immobilized_with_a_penalty():
    evaluation = drive(Constant(0.0, 0.0), laps=1, max_resets=1, immobilized_penalty=1.0)
    assert evaluation.trials[0].time == pytest.approx((31 + 15) * DT)


def test_driving_the_wrong_way_costs_as_much_as_leaving_the_track():
    sine, cosine = STATE_COLUMNS.index("sin_heading_error"), STATE_COLUMNS.index("cos_heading_error")

    def turn_round(state):
        steering = 2.0 * np.arctan2(state[:, sine], -state[:, cosine])  # zero on the way back
        return np.stack([steering.clip(-0.5, 0.5), np.full(len(state), 0.6)], axis=1).astype(np.float32)

    s = np.arange(21.0)
    wide = Track("wide", *(np.stack([s, np.full(21, y)], axis=1) for y in (0.0, 3.0, -3.0)))
    evaluation = drive(turn_round, wide, laps=1, max_resets=1, offtrack_penalty=2.0)
    (lap,) = evaluation.trials[0].laps
    assert (lap.reversed_count + lap.off_track_count, lap.resets, lap.penalty_seconds) == (2, 1, 2.0)
    _, _, mistake, pause, *_ = runs_of(evaluation.trials[0].recording.statuses)
    assert (mistake, pause) == (("reversed", 1), ("pause", 30))


def test_without_resets_the_first_mistake_ends_the_trial():
    evaluation = drive(Constant(0.0, 2.0), laps=3, max_resets=0)
    (trial,) = evaluation.trials
    assert trial.status == "off_track"
    assert [(lap.off_track_count, lap.resets) for lap in trial.laps] == [(1, 0)]
    assert trial.completion == pytest.approx(trial.laps[0].completion / 3)
    assert evaluation.best_lap is evaluation.mean_lap is evaluation.total_time is None


def test_resets_are_counted_over_a_flying_race_but_anew_for_standing_laps():
    needed = drive(Constant(0.0, 1.0), laps=1, offtrack_penalty=0.0, max_resets=1000).trials[0].laps[0].resets
    rules = {"laps": 2, "offtrack_penalty": 0.0, "max_resets": needed}
    assert drive(Constant(0.0, 1.0), is_continuous=True, **rules).laps_completed == 1
    rules |= {"lateral_jitter": 0.0, "heading_jitter": 0.0}
    assert drive(Constant(0.0, 1.0), is_continuous=False, **rules).laps_completed == 2


@pytest.mark.parametrize("is_continuous", [True, False])
def test_time_is_up(is_continuous):
    evaluation = drive(Autopilot(), laps=3, is_continuous=is_continuous, time_limit=20.0)
    (trial,) = evaluation.trials
    assert trial.status == trial.laps[-1].status == trial.recording.statuses[-1] == "time_up"
    assert trial.time == pytest.approx(20.0)
    assert [lap.is_complete for lap in trial.laps] == [True, False]
    assert trial.completion == pytest.approx((1 + trial.laps[1].completion) / 3)


def test_the_clock_runs_while_a_car_stands():
    evaluation = drive(Constant(0.0, 2.0), laps=1, offtrack_penalty=60.0, time_limit=30.0)
    assert evaluation.trials[0].status == "time_up"
    assert evaluation.trials[0].time == pytest.approx(30.0)


# --- repeatable, and the same from every side


def tables(evaluation):
    return [trial.recording.rows for trial in evaluation.trials]


def test_a_seed_repeats_an_evaluation_whatever_the_number_of_trials():
    three = drive(Autopilot(speed=2.0), RING, num_trials=3, seed=5, laps=1)
    again = drive(Autopilot(speed=2.0), RING, num_trials=3, seed=5, laps=1)
    seven = drive(Autopilot(speed=2.0), RING, num_trials=7, seed=5, laps=1)
    other = drive(Autopilot(speed=2.0), RING, num_trials=3, seed=6, laps=1)
    for mine, same, among_seven in zip(tables(three), tables(again), tables(seven), strict=False):
        np.testing.assert_array_equal(mine, same)
        np.testing.assert_array_equal(mine, among_seven)
    np.testing.assert_array_equal(tables(three)[0], tables(other)[0])  # trial 0 starts exactly, whatever the seed
    assert tables(three)[1][0, 2:4].tolist() != tables(other)[1][0, 2:4].tolist()


def test_a_driver_says_itself_that_it_sees_the_state():
    rules = RaceRules(laps=1)
    said = evaluate(Autopilot(), OVAL, rules=rules, num_trials=1, vehicle=EVEN, num_threads=1)
    assert said.summary() == drive(Autopilot(), laps=1).summary()
    assert said.conditions.camera is None
    with_a_camera = trial_simulation(OVAL, num_trials=1)
    blind = trial_simulation(OVAL, num_trials=1, camera=None)
    laps = {completion(Autopilot(), simulation).best_lap for simulation in (with_a_camera, blind)}
    assert len(laps) == 1
    (result,) = generalize(Autopilot(), [OVAL], directions="forward", num_threads=1).results
    assert laps == set(result.lap_times)


@pytest.mark.parametrize(
    ("settings", "words"), [({"track": "oval"}, "track is 'oval'; get"), ({"rules": "drfc"}, "rules is 'drfc'; use")]
)
def test_what_is_no_track_and_no_rules_is_told(settings, words):
    with pytest.raises(ConfigError, match=words):
        evaluate(Autopilot(), **{"track": OVAL, **settings})


def test_a_seed_of_numpys_is_told_as_json_knows_it():
    evaluation = drive(Autopilot(), laps=1, seed=np.int64(3))
    assert json.loads(json.dumps(evaluation.summary()))["seed"] == 3
    assert json.loads(json.dumps(header_of(evaluation.conditions)))["seed"] == 3
    assert evaluation.summary() == drive(Autopilot(), laps=1, seed=3).summary()


def test_a_driver_that_remembers_begins_every_evaluation_anew():
    driver = Tiring()
    times = [drive(driver, laps=1).trials[0].lap_times for _ in range(3)]
    assert times == [times[0]] * 3
    assert times[0] > drive(Autopilot(), laps=1).trials[0].lap_times  # it does tire
    simulation = trial_simulation(OVAL, num_trials=1, camera=None)
    laps = [completion(driver, simulation, sees="state").best_lap for _ in range(2)]
    assert laps[0] == laps[1]


def test_starts_differ_by_no_more_than_the_jitter():
    rules = RaceRules()
    exact = start_pose(OVAL, rules, seed=1, trial=0)
    assert exact[:2] == pytest.approx(tuple(OVAL.centerline[0]))
    offsets, turns = [], []
    for trial in range(1, 200):
        pose = start_pose(OVAL, rules, seed=1, trial=trial)
        offsets.append(float(OVAL.project(pose[:2])[1]))
        turns.append(pose.heading - exact.heading)
    for values, limit in ((offsets, rules.lateral_jitter), (turns, rules.heading_jitter)):
        assert max(map(abs, values)) <= limit + 1e-9
        assert max(values) > 0.9 * limit
        assert min(values) < -0.9 * limit


def test_a_mirrored_track_gives_mirrored_times():
    mirror = np.array([1.0, -1.0])
    mirrored = Track("mirrored", *(line * mirror for line in (RING.centerline, RING.inner, RING.outer)))
    for driver, resets in ((Autopilot(speed=2.5), 0), (Constant(0.0, 1.5), 50)):
        one, two = (drive(driver, track, laps=2, max_resets=resets).trials[0] for track in (RING, mirrored))
        assert two.lap_times == pytest.approx(one.lap_times, abs=1e-9)
        assert [lap.resets for lap in two.laps] == [lap.resets for lap in one.laps]
        np.testing.assert_allclose(two.recording.origins, one.recording.origins * mirror, atol=1e-3)


def test_lanes_lie_midway_between_centre_line_and_border():
    row = np.zeros(len(ROW_COLUMNS))
    row[ROW_COLUMNS.index("projection_distance")] = RING.arc_length[40]
    for offset, border in ((0.3, RING.left), (-0.3, RING.right)):
        row[ROW_COLUMNS.index("offset")] = offset
        pose = reset_pose(RING, row)
        assert pose[:2] == pytest.approx(tuple((RING.centerline[40] + border[40]) / 2))
        assert pose.heading == pytest.approx(float(RING.heading_at(RING.arc_length[40])))


# --- what policies see, and bad ones


def test_a_policy_sees_frames():
    shapes = set()

    def blind(frames):
        shapes.add((frames.shape, frames.dtype.name))
        return np.tile(np.float32([0.0, 1.0]), (len(frames), 1))

    evaluate(blind, OVAL, rules=RaceRules(laps=1, max_resets=0), num_trials=2)
    assert shapes == {((2, 120, 160), "uint8")}


def test_bad_commands_and_settings():
    with pytest.raises(ShapeError, match=r"\(3,\).*\(1, 2\)"):
        drive(lambda state: np.zeros(3))
    with pytest.raises(NonFiniteAction):
        drive(Constant(np.nan, 1.0))
    with pytest.raises(ConfigError, match="policy is 5; allowed is a driver, called with what its sensors read"):
        evaluate(5, OVAL)
    with pytest.raises(ConfigError, match="sees"):
        evaluate(Constant(0.0, 1.0), OVAL, sees="pictures")
    for num_trials in (0, 1001, 2.0, True):
        with pytest.raises(ConfigError, match="num_trials"):
            drive(Autopilot(), num_trials=num_trials)


# --- the quick form


def test_completion_agrees_with_an_evaluation_of_the_first_lap():
    rules = RaceRules(laps=1, max_resets=0)
    simulation = trial_simulation(RING, rules=rules, num_trials=4, camera=None, vehicle=EVEN)
    for driver in (Autopilot(speed=2.0), Constant(0.0, 1.0), Autopilot(speed=1.0)):
        quick = completion(driver, simulation, rules=rules, seed=3, sees="state")
        whole = drive(driver, RING, num_trials=4, seed=3, laps=1, max_resets=0)
        assert quick.completions == pytest.approx(whole.completions)
        assert quick.statuses == tuple(trial.status for trial in whole.trials)
        assert quick.laps_completed == whole.laps_completed
        assert quick.best_lap == whole.best_lap
        times = [trial.lap_times[0] if trial.lap_times else np.nan for trial in whole.trials]
        np.testing.assert_array_equal(quick.lap_times, times)
        assert quick.mean_completion == pytest.approx(whole.mean_completion)
        rewards = [trial.recording.rewards.sum() for trial in whole.trials]  # a car that is out earns nothing more
        assert quick.rewards == pytest.approx(rewards)


def test_on_several_tracks_every_trial_starts_off_its_own():
    tracks = (OVAL, RING, STRAIGHT)
    for direction, driven in (("forward", tracks), ("reverse", [track.reversed() for track in tracks])):
        rules = RaceRules(laps=1, direction=direction)
        simulation = trial_simulation(tracks, rules=rules, num_trials=6, camera=None, vehicle=EVEN)
        line_up(simulation, rules, seed=4)
        for trial in range(6):
            pose = start_pose(driven[trial % 3], rules, seed=4, trial=trial)
            assert simulation.vehicles[:3, trial] == pytest.approx(pose, abs=1e-5), (direction, trial)


def test_laps_flow_on_where_every_track_is_a_circuit():
    laps = {
        tracks: trial_simulation(tracks, rules=RaceRules(laps=3), camera=None).laps
        for tracks in ((OVAL, RING), (OVAL, STRAIGHT), (STRAIGHT,))
    }
    assert list(laps.values()) == [3, 1, 1]


@pytest.mark.parametrize("starts", ["line", "lap"])
def test_every_start_is_logged_in_its_lap_and_progress_goes_on_after_a_mistake(starts):
    (trial,) = drive(
        Constant(0.0, 1.0), laps=2, is_continuous=False, max_resets=1000, offtrack_penalty=1.0, starts=starts, seed=3
    ).trials
    recording = trial.recording
    statuses, progress, place = (
        recording.statuses,
        recording.column("progress"),
        recording.column("projection_distance"),
    )
    begun = [step for step, status in enumerate(statuses) if status == "prepare"]
    assert recording.column("lap")[begun].tolist() == [0, 1]
    mistakes = [step for step, status in enumerate(statuses) if status == "off_track"]
    assert len(mistakes) > 4
    for step in mistakes:
        assert statuses[step + 1] == "pause"
        moved = (place[step + 1] - place[step - 1] + OVAL.length / 2) % OVAL.length - OVAL.length / 2
        assert progress[step + 1] - progress[step - 1] == pytest.approx(moved / OVAL.length, abs=1e-4)


def test_the_default_reward_by_hand():
    """AWS's: full up to and at a tenth of the width from the centre line, on either side, and less in steps."""
    offsets = np.array([0.0, 0.2, -0.2, 0.21, 0.5, -0.51, 1.0, 1.01])
    rows = np.zeros((len(offsets), len(ROW_COLUMNS)))
    rows[:, ROW_COLUMNS.index("offset")], rows[:, ROW_COLUMNS.index("track_width")] = offsets, 2.0
    assert centerline_rewards(rows).tolist() == [1.0, 1.0, 1.0, 0.5, 0.5, 0.1, 0.1, 1e-3]


def test_distances_times_and_rewards_of_a_recording_by_hand():
    statuses = ("prepare", "in_progress", "pause", "lap_complete", "in_progress")
    rows = np.zeros((5, len(ROW_COLUMNS)))
    values = {
        "status": [STATUS_NAMES.index(status) for status in statuses],
        "lap": [0, 0, 0, 1, 1],
        "progress": [-0.1, 0.5, 1.2, 1.0, 0.25],
        "track_width": [1.0] * 5,
    }
    for name, column in values.items():
        rows[:, ROW_COLUMNS.index(name)] = column
    clock = np.arange(5) * DT
    recording = Recording(OVAL, rows, clock, np.zeros((5, 2), np.float32))
    assert recording.distances.tolist() == [0.0, 0.5, 1.0, 1.0, 1.25]
    # the last step begun: half a step of slack, as clocks count steps
    asked = np.array([-1.0, 0.0, 0.4 * DT, 0.6 * DT, DT, 3.4 * DT, 99.0])
    assert recording.steps_at(asked).tolist() == [0, 0, 0, 1, 1, 3, 4]
    assert recording.rewards.tolist() == [0.0, 1.0, 0.0, 1.0, 1.0]  # none while it stands


def test_completion_stops_a_slow_car():
    simulation = trial_simulation(OVAL, num_trials=2, camera=None, vehicle=EVEN)
    slow = completion(Constant(0.0, 0.1), simulation, sees="state", max_seconds=2.0)
    assert slow.statuses == ("in_progress",) * 2
    assert slow.laps_completed == 0
    assert slow.best_lap is None
    assert (slow.completions < 0.05).all()


def test_completion_wants_a_fitting_simulation():
    with pytest.raises(ConfigError, match="camera"):
        completion(Autopilot(), trial_simulation(OVAL, camera=None), sees="frames")
    two_laps = trial_simulation(OVAL, rules=RaceRules(laps=2), camera=None)
    with pytest.raises(ConfigError, match="one lap"):
        completion(Autopilot(), two_laps, sees="state")


# --- results


def test_a_summary_adds_up():
    evaluation = drive(Autopilot(speed=2.0), RING, num_trials=3, laps=2)
    summary = evaluation.summary()
    assert summary["laps_begun"] == summary["laps_completed"] == summary["laps_clean"] == 6
    assert summary["total_seconds"] == pytest.approx(2 * summary["mean_lap_seconds"])
    assert summary["best_lap_seconds"] <= summary["mean_lap_seconds"]
    assert summary["completion_interval"] == [1.0, 1.0]
    assert summary["clean_lap_interval"] == list(evaluation.clean_lap_interval)
    assert evaluation.best_trial.time == min(trial.time for trial in evaluation.trials)
