"""An organiser who copies a model twice at the same moment has it whole, and once."""

from __future__ import annotations

import shutil
import threading
from pathlib import Path
from typing import Any

import pytest
from leagues import untrained_run

from racecraft.errors import RacecraftError
from racecraft.serve.app import create_app
from racecraft.serve.groups.routes import copy_model
from racecraft.serve.groups.schemas import CopyModel
from racecraft.serve.people.people import add_person
from racecraft.serve.settings import OWNER, ServeSettings
from racecraft.serve.store.tables import Member

PATIENCE = 60.0  # s


def test_a_model_that_is_copied_twice_at_once_is_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    app = create_app(ServeSettings(runs=tmp_path / "runs", league=True), hosts={"league"})
    consoles = app.state.consoles
    teacher = consoles.people.get(OWNER)
    group = consoles.groups.create("Class", by=teacher)
    with app.state.context.database.transaction() as session:
        ada = add_person(session, "Ada")
        session.add(Member(group_id=group, user_id=ada, role="racer", is_home=True))
    source = untrained_run(consoles.of(ada).garage.runs, "swift")
    body = CopyModel(member=ada, model="swift", name="of-ada")
    copied, has_second_begun = shutil.copytree, threading.Event()
    refused: list[RacecraftError] = []

    def again() -> None:
        try:
            copy_model(group, body, consoles, teacher)
        except RacecraftError as error:
            refused.append(error)

    second = threading.Thread(target=again)

    def slowly(start: Any, end: Any, *more: Any, **settings: Any) -> Any:
        is_whole_model, is_second = Path(start) == source.path, threading.current_thread() is second
        if is_whole_model and is_second:  # it has begun, and no more, when the first is there
            Path(end).mkdir(parents=True)
            has_second_begun.set()
            second_may_go_on.wait(PATIENCE)
            shutil.rmtree(end, ignore_errors=True)
        found = copied(start, end, *more, **settings)
        if is_whole_model and not is_second:
            second.start()
            assert has_second_begun.wait(PATIENCE)
        return found

    second_may_go_on = threading.Event()
    monkeypatch.setattr(shutil, "copytree", slowly)
    copy_model(group, body, consoles, teacher)
    second_may_go_on.set()
    second.join(PATIENCE)
    there = consoles.of(OWNER).garage.folder("of-ada").path
    assert {file.name for file in there.iterdir()} >= {file.name for file in source.path.iterdir()} - {".lock"}
    assert len(refused) == 1
    assert not list(consoles.of(OWNER).settings.incoming.iterdir())
    app.state.context.database.close()
