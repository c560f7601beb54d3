"""What a training's clock says of its pace, that of a teacher before it included."""

from __future__ import annotations

import time
from dataclasses import replace

import pytest

from racecraft.learn import IterationStats, UpdateStats
from racecraft.training.meter import PACE, Meter
from racecraft.training.stop import Until

NOTHING = UpdateStats(policy_loss=0.0, value_loss=0.0, entropy=0.0, approx_kl=0.0, clip_fraction=0.0, grad_norm=0.0)
STATS = IterationStats(
    iteration=1,
    total_steps=0,
    num_steps=0,
    ended=(),
    losses=NOTHING,
    explained_variance=0.0,
    environment_seconds=0.0,
    policy_seconds=0.0,
    update_seconds=0.0,
)


def test_a_teachers_pace_is_its_own_and_its_students_begins_after_it(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = 100.0
    monkeypatch.setattr(time, "monotonic", lambda: clock)
    meter = Meter(Until.parse("60000 steps"), started=clock)
    meter.begin(steps=0)
    lessons = []
    for number in range(1, 2 * PACE):
        clock += 0.5
        report = meter.report(STATS, episodes=0, taught=(4096 * number, 20 * 4096))
        assert report.lesson is not None
        assert report.steps_per_second == 0.0  # of camera steps
        lessons.append(report.lesson)
    assert lessons[0].steps_per_second != lessons[0].steps_per_second  # not known yet
    assert {lesson.steps_per_second for lesson in lessons[1:]} == {8192.0}
    assert (lessons[0].share, lessons[9].share, lessons[-1].share) == (0.05, 0.5, 1.0)
    for number in range(1, 4):
        clock += 0.25
        driven = replace(STATS, total_steps=500 * number, num_steps=500)
        report = meter.report(driven, episodes=0)
        assert report.lesson is None
        assert report.steps_per_second == 2000.0  # the seconds of its teacher do not make it slower
        assert report.remaining == (60_000 - 500 * number) / 2000.0
