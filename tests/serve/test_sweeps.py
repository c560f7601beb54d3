"""Sweeps in the console: their trainings go through the queue, the board is read, and the page shows both."""

from __future__ import annotations

import json
from typing import Any

import pytest
from browsers import needs_axe, needs_browser, needs_pages, visiting
from running_consoles import RunningConsole

from racecraft.sweeping import Sweep

pytestmark = pytest.mark.costly

TEXT = """
seeds = [1, 2]
[all]
track = "oval"
until = "256 steps"
num_envs = 8
evaluate_every = 256
[settings.plain]
[settings.bold]
numbers = { learning_rate = 0.002 }
"""


def refused(reply: Any, status: int, text: str = "") -> None:
    assert reply.status_code == status, reply.text
    assert text in reply.json()["error"]["message"]


def ended(console: RunningConsole, name: str) -> dict[str, Any]:
    def over() -> Any:
        found = console.client.get(f"/api/sweeps/{name}").json()
        return found if not found["under_way"] else None

    found: dict[str, Any] = console.wait_for(over)
    return found


def test_a_sweep_is_trained_by_the_queue_and_ranked(console: RunningConsole) -> None:
    client = console.client
    made = client.post("/api/sweeps", json={"name": "s", "text": TEXT})
    assert made.status_code == 202, made.text
    assert [run["model"] for run in made.json()["runs"]] == [
        f"s-{setting}-{seed}" for setting in ("plain", "bold") for seed in (1, 2)
    ]
    assert {run["state"] for run in made.json()["runs"]} <= {"queued", "running"}  # the first may have begun
    refused(client.post("/api/sweeps", json={"name": "s", "text": TEXT}), 409, "already")
    found = ended(console, "s")
    assert (found["done"], {run["state"] for run in found["runs"]}) == (4, {"done"})
    assert {(row["setting"], row["seeds"]) for row in found["places"]} == {("plain", 2), ("bold", 2)}
    assert client.post("/api/sweeps/s/go-on").json()["under_way"] == 0  # all is done

    text = TEXT.replace("[1, 2]", "[3]").replace("256 steps", "10 minutes").replace("[settings.bold]", "")
    model = client.post(
        "/api/sweeps", json={"name": "t", "text": text.replace("plain]", "plain]\nreward = 's-bold-1'")}
    )
    assert model.status_code == 202, model.text
    assert client.post("/api/sweeps/t/stop").status_code == 202
    assert [run["state"] for run in ended(console, "t")["runs"]] == ["stopped"]
    assert client.post("/api/sweeps/t/go-on").json()["under_way"] == 1
    client.post("/api/sweeps/t/stop")
    ended(console, "t")
    assert [card["name"] for card in client.get("/api/sweeps").json()] == ["t", "s"]
    assert client.delete("/api/sweeps/t").status_code == 204
    assert client.get("/api/models/t-plain-3").status_code == 200  # the models stay
    refused(client.get("/api/sweeps/t"), 404, "no sweep")


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("model_metadata = '/etc/passwd'", "names a file"),
        ("from = '/somewhere'", "names a file"),
        ("vehicle = '/etc/passwd'", "vehicle is"),
        ("randomize = '/etc/passwd'", "randomize is"),
        ("track = '/etc/passwd'", "does not exist"),
        ("reward = '/etc/passwd'", "no model"),
        ("seeds = 1", "has no 'seeds'"),
    ],
)
def test_nobody_reads_the_servers_files(console: RunningConsole, line: str, says: str) -> None:
    text = f"seeds = [1]\n[settings.a]\n{line}\n"
    reply = console.client.post("/api/sweeps", json={"name": "files", "text": text})
    assert reply.status_code in (404, 422), reply.text
    assert says in reply.json()["error"]["message"]
    assert "root:" not in reply.text
    assert not list(console.runs.glob("files-*"))


def test_so_many_trainings_are_too_many(console: RunningConsole) -> None:
    rates = ", ".join(f"{0.001 + 0.0001 * number:.4f}" for number in range(50))
    text = f"seeds = '1..5'\n[vary]\nlearning_rate = [{rates}]\n"
    refused(console.client.post("/api/sweeps", json={"name": "many", "text": text}), 422, "at most 200")


@pytest.mark.slow
@needs_pages
@needs_browser
@needs_axe
def test_the_page_starts_a_sweep_and_shows_its_board(console: RunningConsole) -> None:
    with visiting(console) as tab:
        page = tab.open("/sweeps")
        page.get_by_label("Name").fill("paged")
        page.get_by_label("What is to be trained").fill(TEXT)
        page.get_by_role("button", name="Start the sweep").click()
        page.get_by_role("heading", name="paged").wait_for()
        page.get_by_text("4 of 4 trained").wait_for()
        assert page.get_by_role("link", name="Seed 2 · trained").count() == 2
        assert page.locator("tr.begun").count() == 2
        file = Sweep(console.runs, "paged").file  # as one that was made of files, by the command line
        told = {"notes": ["Setting 'bold': one.json: unknown field 'preview' has no effect."]}
        file.write_text(json.dumps(json.loads(file.read_text()) | told))
        tab.open("/sweeps/paged").get_by_text("What to know of its files").click()
        page.get_by_text("unknown field 'preview' has no effect.").wait_for()
        assert tab.complaints == []
        for theme, language in (("light", "en"), ("dark", "de")):
            tab.look(theme, language)
            assert tab.flaws("/sweeps") | tab.flaws("/sweeps/paged") == {}
