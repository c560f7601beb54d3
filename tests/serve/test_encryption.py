"""A league that others reach: behind a proxy that is trusted or not, and with a certificate of its own."""

from __future__ import annotations

import json
import ssl
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from leagues import ok, refused
from running_consoles import PATIENCE, RunningConsole, end, plain_client, running_console
from running_workers import running_worker

from free_ports import free_port
from racecraft.errors import ConfigError
from racecraft.serve.server import serve
from racecraft.serve.settings import ServeSettings

pytestmark = pytest.mark.costly

ADDRESS = "https://school.example"
PROXY = {"host": "school.example", "x-forwarded-proto": "https", "x-forwarded-for": "203.0.113.9"}


@pytest.fixture(scope="module")
def behind(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningConsole]:
    """A league whose proxy is on this machine, and believed."""
    options = ("--league", "--address", ADDRESS, "--trusted-proxy", "127.0.0.1")
    with running_console(tmp_path_factory.mktemp("behind") / "runs", *options) as console:
        yield console


def make_certificate(folder: Path, name: str = "localhost") -> tuple[Path, Path]:
    certificate, key = folder / "certificate.pem", folder / "key.pem"
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", f"/CN={name}"]
    command += ["-addext", f"subjectAltName=DNS:{name}", "-keyout", str(key), "-out", str(certificate)]
    subprocess.run(command, check=True, capture_output=True)
    return certificate, key


def test_a_trusted_proxy_tells_who_calls(behind: RunningConsole) -> None:
    card = {"secret": "wrong"}
    with plain_client(behind.client.base_url) as client:
        for _ in range(200):
            refused(client.post("/api/door/card", json=card, headers=PROXY), 401)
        assert "too many" in refused(client.post("/api/door/card", json=card, headers=PROXY), 429)
        another = {**PROXY, "x-forwarded-for": "203.0.113.10"}
        refused(client.post("/api/door/card", json=card, headers=another), 401)
        forged = {**PROXY, "x-forwarded-for": "203.0.113.77, 203.0.113.9"}  # the proxy adds to what it was sent
        refused(client.post("/api/door/card", json=card, headers=forged), 429)


def test_who_comes_unencrypted_through_the_proxy_is_refused(behind: RunningConsole) -> None:
    with plain_client(behind.client.base_url) as client:
        plain = {**PROXY, "x-forwarded-proto": "http"}
        for path in ("/", "/api/door", "/api/health"):
            assert "https only" in refused(client.get(path, headers=plain), 403)
        assert ok(client.get("/api/door", headers=PROXY)) == {"is_league": True, "me": None, "provider": None}
        ok(client.get("/api/health"), 204)  # a supervisor on this machine
        refused(client.get("/api/door", headers={**PROXY, "origin": "http://school.example"}), 403)


@pytest.mark.costly
def test_a_proxy_that_is_not_trusted_is_not_believed(tmp_path: Path) -> None:
    with running_console(tmp_path / "runs", "--league", "--address", ADDRESS) as console:
        plain = {**PROXY, "x-forwarded-proto": "http"}
        ok(
            httpx.get(f"{console.client.base_url}/api/door", headers=plain, timeout=PATIENCE)
        )  # of this machine, whatever it says


@pytest.mark.costly
def test_a_league_with_a_certificate_of_its_own(tmp_path: Path) -> None:
    certificate, key = make_certificate(tmp_path)
    port = free_port()
    command = [sys.executable, "-m", "racecraft", "serve", "--json", "--league", "--runs", str(tmp_path / "runs")]
    command += ["--port", str(port), "--address", f"https://localhost:{port}"]
    command += ["--certificate", str(certificate), "--key", str(key)]
    command += ["--artifacts", f"file://{tmp_path}/store", "--trainings", "0"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        link = json.loads(process.stdout.readline())["link"]
        assert link.startswith(f"https://localhost:{port}/?ticket=")
        trusting = ssl.create_default_context(cafile=certificate)
        with httpx.Client(base_url=f"https://localhost:{port}", verify=trusting, timeout=PATIENCE) as client:
            let_in = client.get(link)
            assert "Secure" in let_in.headers["set-cookie"].split("; ")
            assert ok(client.get("/api/account"))["role"] == "admin"
            with pytest.raises(httpx.HTTPError):
                httpx.get(f"http://localhost:{port}/api/door")
            work_encrypted(client, certificate, tmp_path)
            with running_worker(tmp_path / "idle", *worker_options(client, tmp_path), trusted=certificate):
                time.sleep(1.0)  # it waits for news now
                process.terminate()
                _, said = process.communicate(timeout=PATIENCE)
        assert "Traceback" not in said, "a server that stops sends home who waits for news"
        assert "Cancel 0" in said or not said, said
    finally:
        end(process)


def worker_options(client: httpx.Client, folder: Path) -> tuple[str, ...]:
    file = folder / "token"
    file.write_text(ok(client.post("/api/account/tokens", json={"scopes": ["worker"]}), 201)["secret"])
    return ("--server", str(client.base_url).rstrip("/"), "--token-file", str(file))


def work_encrypted(client: httpx.Client, certificate: Path, folder: Path) -> None:
    """A worker does a job through that certificate, and nothing where it does not know it: no token is sent."""
    options = worker_options(client, folder)
    command = [sys.executable, "-m", "racecraft", "worker", "--runs", str(folder / "no"), "--machine", "no", *options]
    strange = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert strange.returncode == 1
    assert "certificate verify failed" in strange.stderr
    ok(client.post("/api/models", json={"name": "away", "track": "oval", "until": "1024 steps"}), 201)
    with running_worker(folder / "lab", *options, trusted=certificate):
        deadline = time.monotonic() + PATIENCE
        while (job := ok(client.get("/api/jobs"))[0])["state"] != "done" and time.monotonic() < deadline:
            time.sleep(0.1)
        assert (job["state"], job["machine"].partition("#")[0]) == ("done", "lab")


@pytest.mark.costly
def test_files_that_are_no_certificate_are_named(tmp_path: Path) -> None:
    certificate, _ = make_certificate(tmp_path)
    for key, text in ((certificate, "cannot be used"), (tmp_path / "none.pem", "No such file")):
        settings = ServeSettings(
            runs=tmp_path, port=0, league=True, address="https://localhost:1", certificate=certificate, key=key
        )
        with pytest.raises(ConfigError, match=text):
            serve(settings, on_ready=print)
