"""What lies in deploy/: checked by what reads it, and run here as far as that goes; with the real proxy where it is."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import ssl
import subprocess
import sys
import time
from collections.abc import Iterator
from configparser import RawConfigParser
from ipaddress import ip_address, ip_network
from itertools import pairwise
from pathlib import Path

import httpx
import pytest
import yaml
from leagues import ok
from postgres_servers import PostgresServer
from running_consoles import PATIENCE, RunningConsole, running_console

from free_ports import free_port
from racecraft.serve.settings import ServeSettings

pytestmark = pytest.mark.costly

DEPLOY = Path(__file__).parents[2] / "deploy"
CADDY = shutil.which("caddy")
FORGED = "203.0.113.5"


def unit() -> RawConfigParser:
    parser = RawConfigParser()
    parser.optionxform = str  # type: ignore[assignment, method-assign]
    parser.read(DEPLOY / "racecraft.service")
    return parser


def options_of(command: list[str], *, address: str = "") -> list[str]:
    """What a command starts a league with, but for its folder, and at another address if one is given."""
    assert command[1:2] == ["serve"]
    options = [option for option in command[2:] if option != "--no-browser"]
    place = options.index("--runs")
    assert options[place + 1].startswith("/var/lib/racecraft")
    del options[place : place + 2]
    if address:
        options[options.index("--address") + 1] = address
    return options


def line_of(name: str) -> str:
    """An instruction of the container file."""
    (line,) = [line for line in (DEPLOY / "Containerfile").read_text().splitlines() if line.startswith(f"{name} ")]
    return line[line.index("[") :]


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd-analyze is not installed")
def test_systemd_takes_the_unit(tmp_path: Path) -> None:
    text = (DEPLOY / "racecraft.service").read_text()
    path = tmp_path / "racecraft.service"
    path.write_text(text.replace("/opt/racecraft/bin/racecraft", sys.executable).replace("User=racecraft", "User=root"))
    done = subprocess.run(["systemd-analyze", "verify", str(path)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[RunningConsole, str]]:
    """A league as the unit starts it, and where its proxy is to be."""
    address = f"https://localhost:{free_port()}"
    options = options_of(unit()["Service"]["ExecStart"].split(), address=address)
    with running_console(tmp_path_factory.mktemp("service") / "runs", *options) as console:
        yield console, address


def test_the_units_command_serves(service: tuple[RunningConsole, str]) -> None:
    ok(httpx.get(f"{service[0].client.base_url}/api/health", timeout=PATIENCE), 204)


@pytest.fixture
def through_caddy(service: tuple[RunningConsole, str], tmp_path: Path) -> Iterator[httpx.Client]:
    """Somebody who calls the league by the real proxy, with the example's file but for names and ports."""
    if CADDY is None:
        pytest.skip("Caddy is not installed: apt-get install caddy")
    console, address = service
    example = (DEPLOY / "Caddyfile").read_text()
    assert "racing.example.org {\n" in example
    own = example.replace("racing.example.org {\n", f"{address} {{\n\ttls internal\n")
    path = tmp_path / "Caddyfile"
    ours = ("grace_period 1s", "admin off", "auto_https disable_redirects", "skip_install_trust")
    path.write_text("\n\t".join(["{", *ours]) + "\n}\n" + own)
    environment = {
        **os.environ,
        "HOME": str(tmp_path),
        "XDG_DATA_HOME": str(tmp_path),
        "XDG_CONFIG_HOME": str(tmp_path),
        "LEAGUE": console.client.base_url.netloc.decode(),
    }
    root = tmp_path / "caddy" / "pki" / "authorities" / "local" / "root.crt"
    with (tmp_path / "log").open("w") as log:
        command = [CADDY, "run", "--config", str(path), "--adapter", "caddyfile"]
        process = subprocess.Popen(command, env=environment, stdout=log, stderr=log)
    try:
        deadline = time.monotonic() + PATIENCE
        while True:
            try:
                with httpx.Client(base_url=address, verify=ssl.create_default_context(cafile=root)) as client:
                    client.timeout = httpx.Timeout(PATIENCE)
                    client.get("/api/health")
                    yield client
                    return
            except (OSError, httpx.TransportError):
                assert process.poll() is None, (tmp_path / "log").read_text()
                assert time.monotonic() < deadline, (tmp_path / "log").read_text()
                time.sleep(0.1)
    finally:
        process.terminate()
        process.wait(PATIENCE)


def test_the_league_is_played_through_the_real_proxy(
    service: tuple[RunningConsole, str], through_caddy: httpx.Client
) -> None:
    console, address = service
    client = through_caddy
    owner = {"cookie": f"racecraft_session={secret_of(console)}"}
    assert ok(client.get("/api/account", headers=owner))["role"] == "admin"
    code = ok(client.post("/api/invitations", json={"uses": 1}, headers={**owner, "origin": address}), 201)
    assert code["link"].startswith(f"{address}/join#")
    joined = client.post(
        "/api/door/join", json={"code": code["code"], "name": "Ada"}, headers={"x-forwarded-for": FORGED}
    )
    ok(joined, 201)
    assert "Secure" in joined.headers["set-cookie"].split("; ")
    assert joined.headers["strict-transport-security"] == "max-age=31536000"
    assert "content-encoding" not in joined.headers
    ok(client.post("/api/models", json={"name": "one", "train": False, "track": "oval"}), 201)
    began = time.monotonic()
    with client.stream("GET", "/api/events/one") as stream:
        next(line for line in stream.iter_lines() if line)
    assert time.monotonic() - began < 10, "what is live is not kept back"
    (line,) = ok(client.get("/api/audit?what=join", headers=owner))
    assert line["details"] == {"address": "127.0.0.1"}, "the proxy tells who called, not what the caller says"


def secret_of(console: RunningConsole) -> str:
    """The owner's cookie: a program keeps it from plain HTTP, as a browser would."""
    (found,) = [cookie.value for cookie in console.client.cookies.jar if cookie.name == "racecraft_session"]
    assert found is not None
    return found


@pytest.mark.skipif(CADDY is None, reason="Caddy is not installed: apt-get install caddy")
@pytest.mark.parametrize("place", ["machine", "composed"])
def test_caddy_takes_the_example_as_it_is(place: str) -> None:
    proxy = yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"]["proxy"]
    own = {"LEAGUE": ""} if place == "machine" else proxy["environment"]
    command = [str(CADDY), "adapt", "--config", str(DEPLOY / "Caddyfile"), "--adapter", "caddyfile"]
    environment = {name: value for name, value in {**os.environ, **own}.items() if value}
    told = json.loads(subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout)
    (server,) = told["apps"]["http"]["servers"].values()
    assert server["listen"] == [":443"]
    (route,) = server["routes"]
    assert route["match"] == [{"host": ["racing.example.org"]}]
    handlers = {one["handler"]: one for inner in route["handle"][0]["routes"] for one in inner["handle"]}
    assert handlers["headers"]["response"]["set"] == {"Strict-Transport-Security": ["max-age=31536000"]}
    dial = "127.0.0.1:8321" if place == "machine" else f"league:{ServeSettings.port}"
    assert handlers["reverse_proxy"]["upstreams"] == [{"dial": dial}]


def test_the_container_serves_on_postgresql_and_tells_whether_it_is_well(
    postgres: PostgresServer, tmp_path: Path
) -> None:
    """What the container runs, without the container."""
    compose = yaml.safe_load((DEPLOY / "compose.yaml").read_text())
    options = options_of(json.loads(line_of("ENTRYPOINT")) + compose["services"]["league"]["command"])
    python, *rest = json.loads(line_of("HEALTHCHECK"))
    assert python == "/opt/racecraft/bin/python"

    def is_well(port: str) -> bool:
        command = [sys.executable, *(part.replace("8321", port) for part in rest)]
        return subprocess.run(command, capture_output=True, check=False).returncode == 0

    options += ["--trusted-proxy", "127.0.0.1"]  # in place of the container's network
    with running_console(tmp_path / "runs", *options, "--database", postgres.new_database()) as console:
        port = str(console.client.base_url.port)
        assert is_well(port)
        owner = {"cookie": f"racecraft_session={secret_of(console)}", "origin": "https://racing.example.org"}
        proxy = {"host": "racing.example.org", "x-forwarded-proto": "https", "x-forwarded-for": "10.1.2.3"}
        url = f"http://127.0.0.1:{port}/api"
        code = ok(httpx.post(f"{url}/invitations", json={"uses": 1}, headers={**proxy, **owner}), 201)["code"]
        ok(httpx.post(f"{url}/door/join", json={"code": code, "name": "Ada"}, headers=proxy), 201)
        (line,) = ok(httpx.get(f"{url}/audit?what=join", headers={**proxy, **owner}))
        assert line["details"] == {"address": "10.1.2.3"}, "who calls from a school's own network is told apart"
    assert not is_well(port)


@pytest.mark.costly
def test_the_composed_parts_fit_together() -> None:
    compose = yaml.safe_load((DEPLOY / "compose.yaml").read_text())
    services = compose["services"]
    for name, service in services.items():
        assert set(service.get("depends_on", ())) <= set(services), name
        for volume in (volume.split(":")[0] for volume in service.get("volumes", ())):
            assert volume in compose["volumes"] or (volume.startswith("./") and (DEPLOY / volume).is_file()), name
        assert "ports" not in service or name == "proxy", "only the proxy is reached from outside"
        assert service["restart"] == "always", "podman-restart starts no others with the machine"
    command = services["league"]["command"]
    trusted = [ip_network(value) for option, value in pairwise(command) if option == "--trusted-proxy"]
    assert "ipam" not in (compose["networks"]["inside"] or {}), "podman-compose 1.0.3 takes no notice of it"
    for taken in ("10.89.0.2", "172.18.0.2", "192.168.32.2"):  # what podman takes first, Docker first, and Docker later
        assert any(ip_address(taken) in network for network in trusted), taken
    assert not any(ip_address(FORGED) in network for network in trusted)
    address = command[command.index("--address") + 1]
    read = services["proxy"]["command"][services["proxy"]["command"].index("--config") + 1]
    assert f"./Caddyfile:{read}:ro" in services["proxy"]["volumes"]
    assert f"{address.removeprefix('https://')} {{" in (DEPLOY / "Caddyfile").read_text().splitlines()
    assert "-h" in services["database"]["healthcheck"]["test"], "the server that sets the database up is not it yet"
    health = dict(services["league"]["healthcheck"])
    assert shlex.split(health.pop("test")) == json.loads(line_of("HEALTHCHECK"))  # a list is quoted wrongly on its way
    told = [line for line in (DEPLOY / "Containerfile").read_text().splitlines() if line.startswith("HEALTHCHECK")]
    assert {f"--{name.replace('_', '-')}={value}" for name, value in health.items()} < set(told[0].split())
    password = re.compile(r"\$\{POSTGRES_PASSWORD(:\?choose one)?\}")
    assert password.search(services["database"]["environment"]["POSTGRES_PASSWORD"])
    league = services["league"]["environment"]
    assert password.fullmatch(league["PGPASSWORD"])  # which psycopg takes whatever its characters
    assert league["RACECRAFT_DATABASE"] == "postgresql+psycopg://racecraft@database/racecraft"
