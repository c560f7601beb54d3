"""What workers say came of a job: true or not, it is of the types that pages compute with."""

from __future__ import annotations

from typing import Any

import pytest

from racecraft.errors import RunError
from racecraft.serve.workers.results import check_result

ROW = {"place": 1, "name": "a", "car": 0, "score": 9.5, "gap": 0.0, "best": None, "laps": 1}
ROW |= {"off_tracks": 0, "crashes": 0, "resets": 0, "penalty": 0.0}
PLACE = {"place": 1, "name": "a", "rating": 25.0, "deviation": 8.3, "wins": 0, "draws": 0, "losses": 0}
MATCH = {"track": "oval", "start": 0, "models": ["a", "b"], "places": [1, 2], "seconds": [9.5, None]}


@pytest.mark.parametrize(
    ("kind", "result"),
    [
        ("train", {"reason": "interrupted", "steps": 4096, "run": "a"}),
        ("train", None),
        ("race", {"lap_seconds": [[9.5, 9], []], "mean_completion": 1.0, "resets": 0, "step": 64}),
        ("heat", {"heat": [ROW, {**ROW, "place": None, "car": 1}]}),
        ("ladder", {"ladder": [PLACE], "matches": [MATCH]}),
        ("evaluate", {"steps": "x"}),  # with which no page computes
    ],
)
def test_what_comes_of_jobs_is_taken(kind: str, result: dict[str, Any] | None) -> None:
    check_result(kind, result)


@pytest.mark.parametrize(
    ("kind", "result", "where"),
    [
        ("train", {"steps": "x"}, "steps"),
        ("train", {"steps": -1}, "steps"),
        ("train", {"reason": 7}, "reason"),
        ("race", {"lap_seconds": 7}, "lap_seconds"),
        ("race", {"lap_seconds": [["x"]]}, "lap_seconds.0.0"),
        ("race", {"lap_seconds": [[-1.0]]}, "lap_seconds.0.0"),
        ("race", {"resets": {}}, "resets"),
        ("heat", {"heat": []}, "heat"),
        ("heat", None, "heat"),
        ("heat", {"heat": [{**ROW, "car": 10**9}]}, "heat.0.car"),
        ("heat", {"heat": [{**ROW, "car": -1}]}, "heat.0.car"),
        ("heat", {"heat": [{**ROW, "place": "first"}]}, "heat.0.place"),
        ("ladder", {"ladder": [7], "matches": []}, "ladder.0"),
        ("ladder", {"ladder": [PLACE], "matches": [{**MATCH, "places": []}]}, "matches.0"),
    ],
)
def test_what_no_page_could_show_is_refused(kind: str, result: dict[str, Any] | None, where: str) -> None:
    with pytest.raises(RunError, match=f"of kind '{kind}': it is wrong at '{where}'"):
        check_result(kind, result)
