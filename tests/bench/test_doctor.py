from __future__ import annotations

import json

import pytest

from racecraft import _native
from racecraft.bench import doctor
from racecraft.reward.sandbox import Confinement


def test_this_machine_is_healthy() -> None:
    findings = doctor.examine()
    assert [finding.name for finding in findings] == [name for name, _, _ in doctor.CHECKS]
    assert not [finding for finding in findings if not finding.ok]
    json.dumps([finding.to_dict() for finding in findings])


def test_a_kernel_without_walls_is_a_warning_and_no_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("racecraft.reward.sandbox.find_confinement", lambda: Confinement(syscalls="x86_64"))
    (found,) = [finding for finding in doctor.examine() if finding.name == "reward sandbox"]
    assert (found.ok, found.warns) == (True, True)
    assert "no Landlock" in found.text
    assert "Somebody else's are refused" in found.hint
    walls = Confinement(landlock=7, syscalls="x86_64")
    monkeypatch.setattr("racecraft.reward.sandbox.find_confinement", lambda: walls)
    (found,) = [finding for finding in doctor.examine() if finding.name == "reward sandbox"]
    assert (found.ok, found.warns, found.hint) == (True, False, "")
    assert "locked in: Landlock 7, filtered system calls, hard limits; bubblewrap could" in found.text


def test_a_core_that_could_be_faster_is_a_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    before = _native.isa()
    _native.set_isa("portable")
    try:
        (found,) = [finding for finding in doctor.examine() if finding.name == "native core"]
    finally:
        _native.set_isa(before)
    if _native.best_isa() == "portable":
        pytest.skip("this machine has nothing better")
    assert (found.ok, found.warns) == (True, True)
    assert "instruction set portable" in found.text
    assert f"not on this machine's {_native.best_isa()}" in found.hint
    monkeypatch.setattr(_native, "isa", lambda: "portable")
    monkeypatch.setattr(_native, "best_isa", lambda: "portable")
    monkeypatch.setattr("platform.machine", lambda: "x86_64")
    (found,) = [finding for finding in doctor.examine() if finding.name == "native core"]
    assert found.warns
    assert "no AVX2 and FMA" in found.hint


def test_what_is_broken_is_reported_with_a_hint_and_the_rest_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken() -> str:
        raise ImportError("no such library")

    checks = [("one", lambda: "fine", "unused"), ("two", broken, "Install it."), ("three", lambda: "fine", "")]
    monkeypatch.setattr(doctor, "CHECKS", checks)
    one, two, three = doctor.examine()
    assert (one.ok, one.hint) == (True, "")
    assert (two.ok, two.text, two.hint) == (False, "ImportError: no such library", "Install it.")
    assert three.ok
