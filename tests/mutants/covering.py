"""Which modules get faults, how many, and the tests of behaviour that are to notice: cheap ones first, no goldens.

Chosen are the modules where a small slip gives a wrong number and no error: rules, placing, learning, judging, what
runs and replays say. A few tests of many cover each, so that a fault costs seconds.
"""

from __future__ import annotations

from typing import Final

Tests = tuple[str, ...]

PUT_BACK: Final = "tests/contest/test_races_together.py::test_two_that_are_put_back_at_once_do_not_stand_in_each_other"
LEARN: Final[Tests] = ("tests/learn/test_ppo.py", "-k", "not learns")
SERVE: Final[Tests] = (
    "tests/serve/test_races.py",
    "tests/serve/test_races_api.py",
    "-k",
    "not beginning_to_end and not postgresql",
)
QUEUE: Final[Tests] = (
    "tests/serve/test_leases.py",
    "tests/serve/test_jobs.py",
    "-k",
    "not a_stopped_server and not a_killed_server and not postgresql",
)
POOL: Final = "tests/training/test_self_play.py::test_the_pool_spans_the_training_evenly"
PRINTS: Final = "tests/training/test_faults.py::test_prints_are_kept_up_to_the_one_before_the_error"
ENVIRONMENT: Final[Tests] = ("tests/training/test_teacher.py", "tests/training/test_many_tracks.py", PRINTS)
LESSONS: Final = "tests/classic/test_learn.py"
NUMBERS: Final = "tests/classic/test_network.py"
REMEMBERED: Final = "tests/classic/test_remembered.py"
PROVIDER: Final[Tests] = ("tests/serve/test_provider.py",)
PEOPLE: Final = "tests/serve/test_league_people.py"
DOOR: Final = "tests/serve/test_league_door.py"
KEYS: Final[Tests] = ("tests/serve/test_keys.py", PEOPLE, "-k", "test_keys or code_has or stolen or tokens or anew")
GROUPS: Final[Tests] = (
    "tests/serve/test_homes.py",
    PEOPLE,
    "-k",
    "not postgresql and (homes or names_can or code_has or new_cards)",
)
ENTRIES: Final[Tests] = ("tests/serve/test_submission_limits.py", "-k", "not postgresql")
VERDICTS: Final[Tests] = ("tests/serve/test_judge.py", "tests/serve/test_benches.py", "tests/serve/test_verdicts.py")
BOARD: Final = "tests/serve/test_boards.py::test_the_board_places_by_the_rules_of_every_race"
TOKENS: Final[Tests] = (
    "tests/serve/test_token_workers.py",
    "-k",
    "test_leases or reads_and_writes or too_large or opens_nothing",
)
MEMORY: Final = "tests/perception/test_memory.py"
PERCEIVED: Final = "tests/perception/test_training.py"
TRUTH: Final = "tests/perception/test_truth.py"
WAYS: Final[Tests] = ("tests/training/test_algorithms.py", "tests/training/test_lap_view.py")

COVERING: Final[dict[str, tuple[int, Tests]]] = {
    # a race: rules, placing, judging
    "race/marshal.py": (8, ("tests/race/test_evaluation.py", "tests/race/test_object_races.py")),
    "race/placement.py": (8, ("tests/race/test_object_races.py", "tests/race/test_evaluation.py", PUT_BACK)),
    "race/evaluation.py": (6, ("tests/race/test_evaluation.py", "tests/contest/test_starts.py")),
    "race/results.py": (6, ("tests/race/test_evaluation.py",)),
    "race/statistics.py": (4, ("tests/race/test_statistics.py",)),
    "race/rules.py": (4, ("tests/race/test_rules.py", "tests/race/test_evaluation.py")),
    "race/recording.py": (4, ("tests/race/test_evaluation.py", "tests/race/test_object_races.py")),
    "race/default_reward.py": (2, ("tests/race/test_evaluation.py",)),
    "race/entry.py": (2, ("tests/film/test_ghosts.py", "tests/race/test_entry.py")),
    "race/yardstick.py": (5, ("tests/race/test_yardstick.py",)),
    # contests
    "contest/classification.py": (4, ("tests/contest/test_classification.py",)),
    "contest/standings.py": (5, ("tests/contest/test_standings.py", "tests/contest/test_classification.py")),
    "contest/schedule.py": (5, ("tests/contest/test_schedule.py", "tests/contest/test_ladder.py")),
    "contest/ladder.py": (8, ("tests/contest/test_ladder.py", "tests/contest/test_contest.py", "-k", "ladder")),
    "contest/ratings.py": (3, ("tests/contest/test_schedule.py",)),
    "contest/contest.py": (4, ("tests/contest/test_contest.py",)),
    # replays, and logs of the original
    "replay/codec.py": (5, ("tests/replay/test_race_replay.py",)),
    "replay/replay.py": (5, ("tests/replay/test_race_replay.py",)),
    "replay/verification.py": (5, ("tests/replay/test_race_replay.py", "tests/judging/test_race_verification.py")),
    "fidelity/differences.py": (3, ("tests/fidelity/test_fidelity.py", "tests/fidelity/test_replay.py")),
    "fidelity/rules.py": (4, ("tests/fidelity/test_replay.py", "tests/fidelity/test_fidelity.py")),
    "fidelity/logs.py": (
        4,
        ("tests/fidelity/test_replay.py", "tests/fidelity/test_refused_logs.py", "tests/fidelity/test_fidelity.py"),
    ),
    # learning
    "learn/native_loop.py": (2, ("tests/learn/test_ppo_bits.py",)),
    "learn/ppo.py": (12, LEARN),
    "learn/average.py": (3, ("tests/learn/test_average.py",)),
    "learn/distill.py": (8, ("tests/learn/test_distill.py",)),
    "learn/sac.py": (6, ("tests/learn/test_sac.py",)),
    "learn/replay_buffer.py": (3, ("tests/learn/test_sac.py",)),
    "learn/distributions.py": (4, ("tests/learn/test_distributions.py",)),
    # trainings and runs
    "training/evaluator.py": (5, ("tests/training/test_evaluator.py", "tests/training/test_many_tracks.py")),
    "training/environment.py": (4, (*ENVIRONMENT, "tests/training/test_job.py")),
    "training/stop.py": (3, ("tests/training/test_stop.py", "tests/training/test_job.py")),
    "training/progress.py": (3, ("tests/training/test_progress.py", "tests/training/test_stop.py")),
    "training/job.py": (6, ("tests/training/test_job.py", *WAYS, POOL, "tests/training/test_resume.py")),
    "training/session.py": (
        6,
        ("tests/training/test_stretches.py", "tests/training/test_resume.py", "tests/training/test_many_tracks.py"),
    ),
    "training/regimes.py": (
        6,
        (
            "tests/training/test_regimes.py",
            "tests/training/test_training_settings.py",
            "tests/training/test_refused_settings.py",
        ),
    ),
    "run/stretches.py": (5, ("tests/training/test_stretches.py", "tests/training/test_aws_tools.py")),
    "run/judged.py": (4, ("tests/run/test_judged.py",)),
    "run/closing.py": (1, ("tests/run/test_events.py", "tests/run/test_simtrace.py", "tests/run/test_print_log.py")),
    "run/episodes.py": (4, ("tests/run/test_episodes.py",)),
    "run/checkpoint.py": (6, ("tests/run/test_checkpoint.py", "-k", "not kill")),
    "run/simtrace.py": (5, ("tests/run/test_simtrace.py",)),
    "run/metrics.py": (4, ("tests/run/test_run_metrics.py",)),
    "run/history.py": (3, ("tests/run/test_history.py",)),
    # rewards, actions and sensors
    "reward/params.py": (5, ("tests/reward/test_params.py", "tests/reward/test_object_params.py")),
    "reward/dry_run.py": (4, ("tests/reward/test_dry_run.py",)),
    "reward/keys.py": (5, ("tests/reward/test_check.py",)),
    "reward/rehearsal.py": (4, ("tests/reward/test_dry_run.py",)),
    "reward/worker.py": (4, ("tests/reward/test_worker.py", "tests/reward/test_worker_faults.py")),
    "agent/action_space.py": (5, ("tests/agent/test_action_space.py",)),
    "agent/lidar.py": (3, ("tests/agent/test_observe_lidar.py", "tests/agent/test_sensors.py")),
    "agent/hyperparameters.py": (3, ("tests/agent/test_hyperparameters.py",)),
    "limits/road.py": (4, ("tests/limits/test_limits.py",)),
    "limits/limit.py": (3, ("tests/limits/test_limits.py", "-m", "")),  # what computes a limit is slow
    # the physical car
    "car/archive.py": (2, ("tests/car/test_export.py",)),
    "car/calibration.py": (5, ("tests/car/test_calibration.py",)),
    "car/command.py": (3, ("tests/car/test_driving.py", "tests/car/test_car_metadata.py")),
    "car/driving.py": (3, ("tests/car/test_driving.py",)),
    "car/evaluation.py": (2, ("tests/car/test_driving.py",)),
    "car/export.py": (2, ("tests/car/test_export.py", "tests/car/test_onnx.py")),
    "car/graph_writer.py": (2, ("tests/car/test_policy_graph.py",)),
    "car/metadata.py": (3, ("tests/car/test_car_metadata.py",)),
    "car/onnx_writer.py": (2, ("tests/car/test_onnx.py",)),
    "car/policy_graph.py": (3, ("tests/car/test_policy_graph.py", "tests/car/test_onnx.py")),
    # what is learned with a page of code
    "classic/a2c.py": (2, (NUMBERS, LESSONS, "-k", "test_network or a2c")),
    "classic/distributions.py": (3, (NUMBERS,)),
    "classic/dqn.py": (3, ("tests/classic/test_dqn.py", LESSONS, "-k", "dqn")),
    "classic/job.py": (4, ("tests/classic/test_dqn.py", LESSONS)),
    "classic/network.py": (4, (NUMBERS,)),
    "classic/policy.py": (3, (NUMBERS, "tests/classic/test_tables.py", LESSONS, "-k", "not test_learn or reinforce")),
    "classic/ppo.py": (3, (NUMBERS, LESSONS, "-k", "test_network or ppo")),
    "classic/q_table.py": (3, ("tests/classic/test_tables.py",)),
    "classic/reinforce.py": (3, (NUMBERS, REMEMBERED, LESSONS, "-k", "not test_learn or reinforce")),
    "classic/replay.py": (2, (REMEMBERED, LESSONS, "-k", "test_remembered or dqn or sac")),
    "classic/rollout.py": (3, (NUMBERS, REMEMBERED, LESSONS, "-k", "not test_learn or a2c or ppo")),
    "classic/sac.py": (4, (NUMBERS, "tests/classic/test_dqn.py", LESSONS, "-k", "test_network or sac")),
    "classic/sarsa.py": (2, ("tests/classic/test_tables.py",)),
    "classic/saved.py": (2, (LESSONS, "-k", "saved or changed or damaged or taken or interrupted")),
    "classic/until.py": (2, (LESSONS, "-k", "stop or ends")),
    "classic/views.py": (4, ("tests/classic/test_worlds.py",)),
    "classic/worlds.py": (4, ("tests/classic/test_worlds.py",)),
    # the course
    "course/page.py": (4, ("tests/serve/test_lessons_api.py",)),
    "course/percent.py": (3, ("tests/course/test_course.py", "-k", "cells")),
    "course/progress.py": (2, ("tests/course/test_course.py", "-k", "progress")),
    "course/quiz.py": (2, ("tests/course/test_course.py", "tests/cli/test_lessons_verb.py", "-k", "quiz")),
    "course/lesson.py": (2, ("tests/course/test_course.py", "tests/course/test_translation.py")),
    "course/driving.py": (3, ("tests/course/test_lesson_drives.py",)),
    "course/drivers.py": (2, ("tests/course/test_lesson_drives.py",)),
    "course/pictures/charts.py": (2, ("tests/course/test_course.py", "-k", "chart or picture")),
    "serve/lessons/studies.py": (3, ("tests/serve/test_lessons_api.py",)),
    # what comes from outside, what is shown
    "importing/archive_guard.py": (5, ("tests/importing/test_archive.py", "tests/importing/test_damaged_archives.py")),
    "importing/tar_reader.py": (4, ("tests/importing/test_archive.py", "tests/importing/test_damaged_archives.py")),
    "importing/zip_reader.py": (3, ("tests/importing/test_archive.py", "tests/importing/test_damaged_archives.py")),
    "importing/env_file.py": (3, ("tests/importing/test_env_file.py",)),
    "importing/crc32c.py": (1, ("tests/importing/test_crc32c.py",)),
    "importing/drfc.py": (4, ("tests/importing/test_imported_settings.py", "tests/importing/test_import_run.py")),
    "importing/frozen_graph.py": (3, ("tests/importing/test_frozen_graph.py",)),
    "importing/tf_bundle.py": (3, ("tests/importing/test_tf_bundle.py",)),
    "importing/policy_weights.py": (4, ("tests/importing/test_policy_weights.py",)),
    "importing/history.py": (2, ("tests/importing/test_imported_history.py",)),
    "run/starters.py": (2, ("tests/run/test_starters.py", "-k", "unpacked or exist or folder or there")),
    # what is seen in a picture of the road
    "perception/belief.py": (
        3,
        ("tests/perception/test_belief.py", "tests/perception/test_mirror.py"),
    ),
    "perceiving/driving.py": (3, ("tests/perception/test_perception_driving.py", "-k", "not laps_roads")),
    "perception/lessons.py": (2, (PERCEIVED, MEMORY, "-k", "limits or learns")),
    "perceiving/looking.py": (2, ("tests/perception/test_reading.py", "tests/cli/test_perceive_verb.py")),
    "perception/losses.py": (5, (PERCEIVED, MEMORY, "-k", "slopes or expected_error or column_that")),
    "perception/memory.py": (
        8,
        (
            MEMORY,
            "-k",
            "corrects or told or together or exact or mirror or slopes or another_memory or lenses or knows",
        ),
    ),
    "perception/mirror.py": (2, ("tests/perception/test_mirror.py",)),
    "perception/network.py": (4, ("tests/perception/test_reading.py", "tests/perception/test_training.py")),
    "perception/packing.py": (
        3,
        (PERCEIVED, "-k", "brought_along or half_a_step or whole_numbers or too_long or none_are"),
    ),
    "perceiving/painting.py": (3, ("tests/perception/test_reading.py",)),
    "perceiving/reading.py": (3, ("tests/perception/test_reading.py",)),
    "perception/recalling.py": (6, (MEMORY, "-k", "slopes or before_a_beginning or learns_what")),
    "perception/store.py": (3, (PERCEIVED, "-k", "store")),
    "perception/training.py": (4, ("tests/perception/test_training.py",)),
    "perception/truth.py": (4, (TRUTH,)),
    "perception/watching.py": (4, (MEMORY, "-k", "lenses or goes_on or without_a_memory")),
    "perception/worlds.py": (4, (TRUTH, "tests/perception/test_perceiving.py", "-k", "dashes or stands_in")),
    # the page that needs no installation
    "site/javascript.py": (5, ("tests/site/test_javascript.py",)),
    "analysis/laps.py": (4, ("tests/analysis/test_laps.py",)),
    "analysis/corners.py": (4, ("tests/analysis/test_laps.py",)),
    "serve/races/races.py": (6, SERVE),
    "serve/jobs/queue.py": (5, QUEUE),
    "serve/jobs/turns.py": (3, ("tests/serve/test_turns.py",)),
    "serve/store/artifacts.py": (4, ("tests/serve/test_artifact_store.py",)),
    # a league: who comes in, what is sent in, how much of the machine is whose, who lends one
    "serve/door/guard.py": (4, ("tests/serve/test_door.py", "-k", "not postgresql")),
    "serve/door/known_browsers.py": (3, (DOOR, "-k", "mark or signed_in_here")),
    "serve/door/routes.py": (3, ("tests/serve/test_audit.py", DOOR, PEOPLE, "-k", "came_in or one_pupil or anew")),
    "serve/people/tries.py": (4, (DOOR, "-k", "forty or succeeds or every_way or ipv6")),
    "serve/people/keys.py": (4, KEYS),
    "serve/people/names.py": (1, (PEOPLE, "-k", "names")),
    "serve/provider/discovery.py": (3, PROVIDER),
    "serve/provider/fetch.py": (3, PROVIDER),
    "serve/provider/id_token.py": (4, PROVIDER),
    "serve/provider/provider.py": (4, PROVIDER),
    "serve/provider/visits.py": (4, PROVIDER),
    "serve/quotas/quotas.py": (6, ("tests/serve/test_quotas.py", "-k", "not postgresql")),
    "serve/groups/groups.py": (5, GROUPS),
    "serve/submissions/admission.py": (3, ENTRIES),
    "serve/submissions/bench.py": (8, VERDICTS),
    "serve/submissions/judge.py": (12, VERDICTS),
    "serve/submissions/walls.py": (3, VERDICTS),
    "serve/submissions/board.py": (4, (BOARD,)),
    "serve/submissions/copies.py": (2, ("tests/serve/test_copies.py",)),
    "serve/submissions/entries.py": (4, ENTRIES),
    "serve/submissions/league.py": (4, (*ENTRIES, BOARD)),
    "serve/submissions/season.py": (8, ("tests/serve/test_seasons.py",)),
    "serve/workers/leases.py": (4, ("tests/serve/test_leases.py", *TOKENS)),
    "serve/workers/parcels.py": (4, TOKENS),
}
