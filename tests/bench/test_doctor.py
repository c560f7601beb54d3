from __future__ import annotations

import json

import pytest

from racecraft.bench import doctor


def test_this_machine_is_healthy() -> None:
    findings = doctor.examine()
    assert [finding.name for finding in findings] == [name for name, _, _ in doctor.CHECKS]
    assert not [finding for finding in findings if not finding.ok]
    json.dumps([finding.to_dict() for finding in findings])


def test_what_is_broken_is_reported_with_a_hint_and_the_rest_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken() -> str:
        raise ImportError("no such library")

    checks = [("one", lambda: "fine", "unused"), ("two", broken, "Install it."), ("three", lambda: "fine", "")]
    monkeypatch.setattr(doctor, "CHECKS", checks)
    one, two, three = doctor.examine()
    assert (one.ok, one.hint) == (True, "")
    assert (two.ok, two.text, two.hint) == (False, "ImportError: no such library", "Install it.")
    assert three.ok
