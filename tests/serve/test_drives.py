"""Who has the cars that people drive themselves, when more are asked for than there are."""

from __future__ import annotations

from threading import Event, Thread
from typing import Any

import pytest

from racecraft.serve.driving import drives as drives_module
from racecraft.serve.driving.drives import MAX_DRIVES, Drives
from racecraft.serve.problems import Conflict, NotFound
from racecraft.track import Track, load_track

ADA, BOB, GREEDY = 2, 3, 4


class Car:
    """A car that is driven, as far as the others know."""

    def __init__(self, track: Track, *, user_id: int, **_: Any) -> None:
        self.user_id = user_id


@pytest.fixture
def oval(monkeypatch: pytest.MonkeyPatch) -> Track:
    monkeypatch.setattr(drives_module, "DrivenCar", Car)
    return load_track("oval")


def begin(drives: Drives, track: Track, user_id: int) -> str:
    return drives.begin(track, vehicle="v5", direction="forward", user_id=user_id)[0]


def test_who_has_all_cars_gives_one_to_who_has_none(oval: Track) -> None:
    drives = Drives()
    taken = [begin(drives, oval, GREEDY) for _ in range(MAX_DRIVES)]
    drives.car(begin(drives, oval, ADA), user_id=ADA)
    with pytest.raises(NotFound):
        drives.car(taken[0], user_id=GREEDY)
    drives.car(taken[1], user_id=GREEDY)


def test_who_has_one_car_keeps_it(oval: Track) -> None:
    drives = Drives()
    cars = [begin(drives, oval, 10 + number) for number in range(MAX_DRIVES)]
    with pytest.raises(Conflict):
        begin(drives, oval, ADA)
    begin(drives, oval, 10)
    drives.car(cars[1], user_id=11)


def test_others_drive_on_while_somebodys_road_takes_long(oval: Track, monkeypatch: pytest.MonkeyPatch) -> None:
    drives, is_at_it, goes_on = Drives(), Event(), Event()
    car = begin(drives, oval, ADA)

    class Slow(Car):
        def __init__(self, track: Track, *, user_id: int, **_: Any) -> None:
            is_at_it.set()
            assert goes_on.wait(60.0)
            super().__init__(track, user_id=user_id)

    monkeypatch.setattr(drives_module, "DrivenCar", Slow)
    slow = Thread(target=begin, args=(drives, oval, BOB))
    slow.start()
    assert is_at_it.wait(60.0)
    driven = Event()

    def drive_on() -> None:
        drives.car(car, user_id=ADA)
        driven.set()

    Thread(target=drive_on, daemon=True).start()
    is_driven = driven.wait(30.0)
    goes_on.set()
    slow.join()
    assert is_driven
