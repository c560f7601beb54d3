import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from racecraft.errors import InUse, RunError
from racecraft.run.lock import exclusive_lock

ROOT = Path(__file__).parents[2]
HOLDER = """
import sys, time
from pathlib import Path
from racecraft.run.lock import exclusive_lock
with exclusive_lock(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


def test_second_holder_is_refused_with_the_first_one_named(tmp_path):
    path = tmp_path / ".lock"
    refused = pytest.raises(InUse, match=f"in use by process {os.getpid()}")
    with exclusive_lock(path), refused, exclusive_lock(path):
        pass
    with exclusive_lock(path):
        pass


def test_lock_of_a_killed_process_is_free(tmp_path):
    path = tmp_path / ".lock"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT / "src"), *sys.path])}
    with subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(path)], stdout=subprocess.PIPE, text=True, env=environment
    ) as process:
        assert process.stdout.readline() == "held\n"
        with pytest.raises(RunError, match=f"process {process.pid}"), exclusive_lock(path):
            pass
        process.send_signal(signal.SIGKILL)
    with exclusive_lock(path):
        assert str(os.getpid()) in path.read_text()


def test_lock_is_free_after_an_error(tmp_path):
    with pytest.raises(ZeroDivisionError), exclusive_lock(tmp_path / ".lock"):
        1 / 0  # noqa: B018
    with exclusive_lock(tmp_path / ".lock"):
        pass


def test_garbage_in_the_file_does_not_matter(tmp_path):
    (tmp_path / ".lock").write_bytes(b"\xff\x00garbage" * 99)
    with exclusive_lock(tmp_path / ".lock"):
        pass


def test_missing_folder(tmp_path):
    with pytest.raises(RunError, match="cannot be opened"), exclusive_lock(tmp_path / "none" / ".lock"):
        pass
