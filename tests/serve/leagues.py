"""A real league in its own process, and its people: each a client of their own."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
from running_consoles import RunningConsole, plain_client, running_console

from racecraft.agent import ModelMetadata, action_space
from racecraft.learn import NetworkSpec, make_learner
from racecraft.race.policy import WEIGHTS
from racecraft.reward import load_preset
from racecraft.run import RunFolder
from racecraft.training.settings import make_settings
from racecraft.training.start import start_run


@dataclass
class RunningLeague:
    """The server, its owner's client, and whoever came in."""

    console: RunningConsole
    strangers: list[httpx.Client] = field(default_factory=list)

    @property
    def owner(self) -> httpx.Client:
        return self.console.client

    def stranger(self) -> httpx.Client:
        self.strangers.append(plain_client(self.owner.base_url))
        return self.strangers[-1]

    def group(self, title: str, by: httpx.Client | None = None) -> int:
        return int(ok((by or self.owner).post("/api/groups", json={"title": title}), 201)["id"])

    def code(self, group: int, by: httpx.Client | None = None, **settings: Any) -> str:
        return str(ok((by or self.owner).post(f"/api/groups/{group}/joining", json=settings))["code"])

    def join(self, code: str, name: str) -> httpx.Client:
        client = self.stranger()
        ok(client.post("/api/door/join", json={"code": code, "name": name}), 201)
        return client

    def organiser(self, name: str) -> httpx.Client:
        return self.join(str(ok(self.owner.post("/api/invitations", json={"uses": 1}), 201)["code"]), name)

    def number(self, client: httpx.Client) -> int:
        return int(ok(client.get("/api/account"))["id"])


@contextmanager
def running_league(runs: Path, *options: str) -> Iterator[RunningLeague]:
    with running_console(runs, "--league", *options) as console:
        league = RunningLeague(console)
        try:
            yield league
        finally:
            for client in league.strangers:
                client.close()


def ok(reply: httpx.Response, status: int = 200) -> Any:
    assert reply.status_code == status, reply.text
    return reply.json() if reply.content else None


def refused(reply: httpx.Response, status: int) -> str:
    assert reply.status_code == status, reply.text
    assert set(reply.json()) == {"error"}
    return str(reply.json()["error"]["message"])


def untrained_run(
    root: Path,
    name: str,
    *,
    seed: int = 1,
    sensors: tuple[str, ...] = ("FRONT_FACING_CAMERA",),
    actions: str = "default",
    network: str = "RACECRAFT_SMALL",
) -> RunFolder:
    """A run with a checkpoint of a network that was never trained: it drives, badly."""
    metadata = ModelMetadata(action_space=action_space(actions), neural_network="RACECRAFT_SMALL", sensors=sensors)
    settings = make_settings(metadata=metadata, track="oval", seed=seed, network=network)
    folder = start_run(settings, reward=load_preset("racing"), metadata=metadata, root=root, name=name)
    spec = NetworkSpec(
        name=network,
        num_actions=metadata.action_space.size,
        is_discrete=actions != "continuous",
        lidar_size=metadata.suite.lidar_size,
    )
    weights = make_learner(spec, seed=seed, num_threads=1).weights()
    described = {"name": spec.name, "num_actions": spec.num_actions, "is_discrete": spec.is_discrete}
    described["frame_shape"] = [120, 160]
    described |= {"lidar_size": spec.lidar_size} if spec.lidar_size else {}
    arrays = {f"{WEIGHTS}{key}": array for key, array in weights.items()}
    folder.checkpoints.save(64 * seed, arrays, metadata={"network": described})
    return folder
