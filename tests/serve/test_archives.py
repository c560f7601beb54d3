"""Models in and out of the garage as files; hostile ones are refused with the one shape of errors."""

from __future__ import annotations

import asyncio
import io
import json
import os
import shutil
import socket
import tarfile
import time
import zipfile
from collections.abc import AsyncIterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from running_consoles import PATIENCE, RunningConsole

from racecraft.importing import import_run
from racecraft.run import RunFolder, archive_chunks
from racecraft.serve.app import create_app
from racecraft.serve.models import archives
from racecraft.serve.models.archives import UPLOADS
from racecraft.serve.settings import ServeSettings

pytestmark = pytest.mark.costly

REWARD = "def reward_function(params):\n    return float(params['progress'])\n"
METADATA = {
    "action_space": [{"steering_angle": angle, "speed": 1.0, "index": i} for i, angle in enumerate((-30, 0, 30))],
    "sensor": ["FRONT_FACING_CAMERA"],
    "version": "5",
}
AWS_MODEL = {
    "reward_function.py": REWARD,
    "model_metadata.json": json.dumps(METADATA),
    "hyperparameters.json": json.dumps({"batch_size": 64, "lr": 0.0003, "num_epochs": 3}),
    "training_params.yaml": "WORLD_NAME: oval\nJOB_TYPE: TRAINING\n",
}


def tar_of(files: dict[str, str | bytes]) -> bytes:
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w:gz") as tar:
        for name, content in files.items():
            data = content if isinstance(content, bytes) else content.encode()
            member = tarfile.TarInfo(name)
            member.size = len(data)
            tar.addfile(member, io.BytesIO(data))
    return out.getvalue()


def zip_of(files: dict[str, str]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return out.getvalue()


def members(data: bytes) -> dict[str, bytes]:
    with tarfile.open(fileobj=io.BytesIO(data)) as tar:
        return {member.name.partition("/")[2]: tar.extractfile(member).read() for member in tar}  # type: ignore[union-attr]


def upload(console: RunningConsole, filename: str, data: bytes, **query: str) -> httpx.Response:
    return console.client.post("/api/models/import", params={"filename": filename, **query}, content=data)


def error(reply: httpx.Response, status: int) -> dict[str, Any]:
    assert reply.status_code == status, reply.text
    assert set(reply.json()) == {"error"}
    return dict(reply.json()["error"])


@pytest.mark.parametrize("pack", [tar_of, zip_of])
def test_a_model_of_deepracer_becomes_a_model(console: RunningConsole, pack: Any) -> None:
    name = f"theirs-{pack.__name__}"
    done = upload(console, "my model.tar.gz" if pack is tar_of else "x.ZIP", pack(AWS_MODEL), name=name)
    assert done.status_code == 201, done.text
    report = done.json()
    assert report["model"]["name"] == name
    assert report["model"]["status"] == "new"
    assert report["model"]["track"] == "oval"
    assert "reward_function.py" in report["used"]
    assert console.client.get(f"/api/models/{name}").json()["reward"] == REWARD
    error(upload(console, "x.tar.gz", tar_of(AWS_MODEL), name=name), 409)


def test_a_second_download_has_its_number_before_the_last_ending(console: RunningConsole) -> None:
    done = upload(console, "my-car.tar(1).gz", tar_of(AWS_MODEL))
    assert done.status_code == 201, done.text
    assert done.json()["model"]["name"].startswith("my-car")


def test_a_reward_function_becomes_a_model(console: RunningConsole) -> None:
    done = upload(console, "C:\\Users\\me\\my best reward.py", REWARD.encode(), track="oval")
    assert done.status_code == 201, done.text
    assert done.json()["model"]["name"].startswith("my-best-reward")
    assert done.json()["model"]["track"] == "oval"


def test_a_model_goes_out_and_comes_back(console: RunningConsole) -> None:
    client = console.client
    name = console.create(name="traveller", until="1500 steps", track="oval")
    job = client.get("/api/jobs", params={"run": name}).json()[0]
    assert console.wait_for(console.job_ended(job["id"]))["state"] == "done"
    reply = client.get(f"/api/models/{name}/archive")
    assert reply.headers["content-disposition"] == 'attachment; filename="traveller.tar.gz"'
    files = members(reply.content)
    aws = {"model_metadata.json", "reward_function.py", "training_params.yaml", "ip/hyperparameters.json"}
    assert aws | {"run.json", "metrics/TrainingMetrics.json", "checkpoints/manifest.json"} <= set(files)
    assert any(path.startswith("training-simtrace/") for path in files)
    assert any(path.endswith(".safetensors") for path in files)
    done = upload(console, "traveller.tar.gz", reply.content, name="returned")
    assert done.status_code == 201, done.text
    assert done.json()["notes"] == []
    before, after = RunFolder(console.runs / name), RunFolder(console.runs / "returned")
    assert after.read_info().settings == before.read_info().settings
    old, new = before.checkpoints.load(), after.checkpoints.load()
    assert new.step == old.step
    for array in old.arrays:
        np.testing.assert_array_equal(new.arrays[array], old.arrays[array])
    assert client.get("/api/models/returned/history").json()["points"]
    on = client.post("/api/models/returned/train", json={"until": f"{old.step + 1000} steps"}).json()
    ended = console.wait_for(console.job_ended(on["id"]))
    assert ended["state"] == "done", ended
    assert ended["result"]["steps"] >= old.step + 1000


def test_a_model_with_weights_from_elsewhere_is_no_new_one(console: RunningConsole) -> None:
    """What AWS trained has driven no step here, and drives."""
    console.create(name="given", train=False, track="oval")
    assert console.client.get("/api/models/given").json()["status"] == "new"
    RunFolder(console.runs / "given").checkpoints.save(0, {"w": np.arange(4.0)})
    assert console.client.get("/api/models/given").json()["status"] == "finished"


@pytest.fixture(scope="module")
def own_archive(console: RunningConsole, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The files of an archive of ours, untrained, with a checkpoint that is whole."""
    console.create(name="mine", train=False, track="oval")
    copy = RunFolder(tmp_path_factory.mktemp("own") / "mine")
    shutil.copytree(console.runs / "mine", copy.path)
    copy.checkpoints.save(2000, {"w": np.arange(4.0)})
    return members(b"".join(archive_chunks(copy)))


def test_damaged_weights_are_left_out_and_told(own_archive: dict[str, bytes], tmp_path: Path) -> None:
    weights = next(path for path in own_archive if path.endswith(".safetensors"))
    path = tmp_path / "mine.tar.gz"
    path.write_bytes(tar_of(own_archive))
    assert RunFolder(import_run(path, root=tmp_path, name="whole").run).checkpoints.load().step == 2000
    for number, damage in enumerate((b"", own_archive[weights][:-1], b"\x80\x04cos\nsystem\n")):
        path.write_bytes(tar_of({**own_archive, weights: damage}))
        report = import_run(path, root=tmp_path, name=f"damaged-{number}")
        assert "fresh weights" in " ".join(report.notes)
        assert not RunFolder(report.run).checkpoints.entries()


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"track": "../../../etc/passwd"}, "not among"),
        ({"track": "/etc/hostname"}, "not among"),
        ({"track": "reinvent_2018"}, "not the one"),
        ({"seed": "x"}, "seed"),
        ({"settings": {}}, "lack"),
        ({"settings": []}, "damaged"),
        ({"settings": {"ppo": {"num_envs": 10**12}}}, "num_envs"),
    ],
)
def test_a_hostile_run_of_ours_is_refused(
    own_archive: dict[str, bytes], tmp_path: Path, change: dict[str, Any], text: str
) -> None:
    from racecraft.errors import RacecraftError

    document = json.loads(own_archive["run.json"])
    if change.get("settings"):
        settings = document["settings"]
        change = {"settings": {**settings, "ppo": {**settings["ppo"], **change["settings"]["ppo"]}}}
    (tmp_path / "mine.tar.gz").write_bytes(tar_of({**own_archive, "run.json": json.dumps({**document, **change})}))
    with pytest.raises(RacecraftError, match=text):
        import_run(tmp_path / "mine.tar.gz", root=tmp_path / "runs")
    assert not list((tmp_path / "runs").glob("*/run.json"))


@pytest.mark.costly
def test_hostile_uploads_are_refused(console: RunningConsole) -> None:
    before = {model["name"] for model in console.client.get("/api/models").json()}
    bomb = tar_of({**AWS_MODEL, "metrics/TrainingMetrics.json": b"\0" * (300 << 20)})
    for filename, data, status in (
        ("x.tar.gz", b"", 422),
        ("x.tar.gz", b"\x1f\x8b" + b"x" * 1000, 422),
        ("x.tar.gz", tar_of({"../../up.py": REWARD}), 422),
        ("x.tar.gz", tar_of({**AWS_MODEL, "/etc/cron.d/x": "x"}), 422),
        ("x.tar.gz", bomb, 422),
        ("x.zip", zip_of({"nothing.txt": "x"}), 422),
        ("x.py", b"import os\nos.system('true')\n", 422),
        ("x.py", b"\xff\xfe", 422),
        ("x.exe", b"MZ", 422),
        ("../../../etc/passwd", b"x", 422),
        ("", b"x", 422),
        ("x.tar.gz\0.py", REWARD.encode() + b"\n(", 422),
    ):
        error(upload(console, filename, data), status)
    for name in ("../up", ".racecraft", "x" * 65, "a/b", ""):
        error(upload(console, "x.py", REWARD.encode(), name=name), 422)
    error(upload(console, "x.py", REWARD.encode(), track="/etc/hostname"), 404)
    error(console.client.post("/api/models/import", content=REWARD.encode()), 422)
    assert {model["name"] for model in console.client.get("/api/models").json()} == before
    assert not list((console.runs / ".racecraft" / "uploads").iterdir())


def test_a_second_server_leaves_what_the_first_is_taking_in(tmp_path: Path) -> None:
    settings = ServeSettings(runs=tmp_path)
    pupil = settings.of(7).state / UPLOADS
    for uploads in (settings.state / UPLOADS, pupil):
        (uploads / "left").mkdir(parents=True)
        (uploads / "coming").mkdir()
        for path in (uploads / "left" / "a.zip", uploads / "left-file", uploads / "left", uploads / "coming"):
            if not path.exists():
                path.write_bytes(b"PK")
            os.utime(path, (0, 0))
        (uploads / "coming" / "b.zip").write_bytes(b"PK")
        (uploads / "coming-file").write_bytes(b"PK")
        os.utime(uploads / "coming", (0, 0))
    create_app(settings, hosts=set()).state.context.database.close()
    for uploads in (settings.state / UPLOADS, pupil):
        assert sorted(path.name for path in uploads.iterdir()) == ["coming", "coming-file"]


def test_a_huge_upload_is_refused_before_it_comes(console: RunningConsole) -> None:
    host = console.client.base_url.netloc.decode()
    import socket

    cookie = f"racecraft_session={console.client.cookies['racecraft_session']}"
    for length in (str(2 << 30), "9" * 30, "-1"):
        with socket.create_connection(host.split(":"), timeout=PATIENCE) as connection:  # type: ignore[arg-type]
            lines = [
                "POST /api/models/import?filename=x.py HTTP/1.1",
                f"Host: {host}",
                f"Cookie: {cookie}",
                f"Content-Length: {length}",
            ]
            connection.sendall("\r\n".join([*lines, "", "x"]).encode())
            assert connection.recv(100).split()[1] in (b"413", b"400")


def test_one_persons_uploads_come_two_at_a_time(console: RunningConsole) -> None:
    """Of a gigabyte each, ten that never end would fill the disk."""
    host, port = console.client.base_url.host, console.client.base_url.port
    cookie = console.client.cookies["racecraft_session"]
    head = f"POST /api/models/import?filename=x.tar HTTP/1.1\r\nHost: {host}:{port}\r\n"
    head += f"Cookie: racecraft_session={cookie}\r\nContent-Length: 1000000\r\n\r\nbegun"
    folder = console.runs / ".racecraft" / "uploads"
    with ExitStack() as stack:
        for _ in range(6):
            stack.enter_context(socket.create_connection((host, port))).sendall(head.encode())
        console.wait_for(lambda: len(list(folder.glob("*/x.tar"))) >= 2)
        time.sleep(1.0)  # for those who do not wait
        assert len(list(folder.glob("*/x.tar"))) == 2
    console.wait_for(lambda: not list(folder.glob("*")))


def test_a_file_that_never_arrives_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Slow:
        async def stream(self) -> AsyncIterator[bytes]:
            while True:
                yield b"x"
                await asyncio.sleep(0.01)

    monkeypatch.setattr(archives, "ARRIVES_S", 0.1)
    with pytest.raises(TimeoutError):
        asyncio.run(archives._take_in(Slow(), tmp_path / "x.tar"))  # type: ignore[arg-type]


def test_archives_hold_no_links(console: RunningConsole) -> None:
    name = console.create(name="linked", train=False)
    (console.runs / name / "metrics").mkdir(exist_ok=True)
    (console.runs / name / "metrics" / "passwd").symlink_to("/etc/passwd")
    (console.runs / name / "model" / "etc").symlink_to("/etc")
    files = members(console.client.get(f"/api/models/{name}/archive").content)
    assert "metrics/passwd" not in files
    assert not any(path.startswith("model/etc") for path in files)
    error(console.client.get("/api/models/nothing/archive"), 404)


def test_somebody_elses_reward_stays_somebody_elses(console: RunningConsole) -> None:
    """In a clone, and in a model that is made with the very same text; edited, it is the owner's."""
    name = upload(console, "theirs.tar.gz", tar_of(AWS_MODEL)).json()["model"]["name"]
    clone = console.client.post(f"/api/models/{name}/clone", json={}).json()["name"]
    same, edited = (console.create(reward=reward, train=False) for reward in (REWARD, REWARD + "# seen\n"))
    marks = [RunFolder.open(console.runs / run).read_info().foreign for run in (name, clone, same, edited)]
    assert marks == [True, True, True, False]
    verdict = console.client.post("/api/rewards/check", json={"source": REWARD, "track": "oval"}).json()
    assert verdict["ok"]

    mine = console.create(reward=REWARD + "# mine\n", track="oval", until="512 steps")
    (job,) = console.client.get("/api/jobs", params={"run": mine, "kind": "train"}).json()
    console.wait_for(console.job_ended(job["id"]))
    stretch = RunFolder.open(console.runs / mine).stretches / "1.json"
    stretch.write_text(json.dumps(json.loads(stretch.read_text()) | {"reward_function": REWARD}))
    (point, *_) = console.client.get(f"/api/models/{mine}").json()["checkpoints"]
    branch = console.client.post(f"/api/models/{mine}/clone", json={"step": point["step"]}).json()
    assert RunFolder.open(console.runs / branch["name"]).read_info().foreign
