"""Runs every attack twice, in a worker without walls and in one as users get it, as the user that runs this program.

    python run_attacks.py [UID]  ->  {"attack": {"here": true, "unconfined": true, "confined": false, "told": "..."}}

With a number it becomes that user first; this takes root. The trainer that the attacks are aimed at is this process.
"""

from __future__ import annotations

import ctypes
import json
import os
import secrets
import subprocess
import sys
import textwrap
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

CLONE_NEWNS, MS_BIND, MS_REC, MS_PRIVATE = 0x20000, 0x1000, 0x4000, 0x40000
REACHED = (sys.base_prefix, sys.prefix, str(Path(__file__).parents[3]))


def become(user: int) -> None:
    """Start this program again as another user, to whom the way to the interpreter is opened in a private view."""
    closed = {parent for path in REACHED for parent in Path(path).parents if not parent.stat().st_mode & 0o001}
    if closed:
        libc = ctypes.CDLL(None, use_errno=True)

        def must(result: int) -> None:
            if result:
                raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))

        def mount(source: str, target: str, kind: bytes | None, flags: int, data: bytes | None = None) -> None:
            must(libc.mount(source.encode(), target.encode(), kind, ctypes.c_ulong(flags), data))

        must(libc.unshare(CLONE_NEWNS))
        mount("none", "/", None, MS_REC | MS_PRIVATE)
        held = {path: os.open(path, os.O_PATH) for path in REACHED}
        for folder in sorted(closed):
            mount("none", str(folder), b"tmpfs", 0, b"mode=755")
        for path, place in held.items():
            if not os.path.exists(path):
                os.makedirs(path)
                mount(f"/proc/self/fd/{place}", path, None, MS_BIND | MS_REC)
            os.close(place)
    os.setgroups([])
    os.setgid(user)
    os.setuid(user)
    os.execv(sys.executable, [sys.executable, __file__])


def main() -> None:
    """Try them all and print what came of it."""
    from plot import PRELUDE, ROOT, every_attack
    from scene import NotHere, Scene

    from racecraft.errors import RewardError
    from racecraft.reward import RewardWorker, launch, situations
    from racecraft.reward.sandbox import UNCONFINED, find_confinement
    from racecraft.track import load_track

    sys.path.insert(0, str(Path(__file__).parents[3] / "tools"))
    from syscall_filter import NUMBERS

    attacks = every_attack()
    track = load_track("oval")
    row = situations(track)[1].row[None]
    # Without bubblewrap, which would hide from sight whether the walls that everybody has hold.
    confined = replace(find_confinement(), bubblewrap="")
    numbers = NUMBERS.get(os.uname().machine, {})

    def try_out(name: str, confinement: object) -> tuple[bool, str]:
        with Scene() as scene:
            plot = attacks[name](scene)
            body = textwrap.indent(textwrap.dedent(next(plot)), "    ")
            source = f"{PRELUDE}\nNR = {numbers}\ndef reward_function(params):\n{body}\n"
            start = subprocess.Popen

            def leaking(*arguments: object, **options: object) -> object:
                return start(*arguments, **options | {"pass_fds": (*options["pass_fds"], *scene.leaked)})

            reward, told = None, ""
            try:
                with (
                    patch.object(launch.subprocess, "Popen", leaking),
                    RewardWorker(source, track, timeout_s=5.0, confinement=confinement) as worker,
                ):
                    reward = float(worker(row)[0])
            except RewardError as error:
                told = str(error).partition("\n")[0]
            try:
                plot.send(reward)
            except StopIteration as end:
                return bool(end.value), told
        raise AssertionError(f"{name} has a second body")

    found = {}
    for name in attacks:
        try:
            open_door, _ = try_out(name, UNCONFINED)
            shut_door, told = try_out(name, confined)
        except NotHere as reason:
            found[name] = {"here": False, "told": str(reason)}
            continue
        found[name] = {"here": True, "unconfined": open_door, "confined": shut_door, "told": told}
    print(json.dumps({"root": ROOT, "attacks": found}))


if __name__ == "__main__":
    os.environ.setdefault("RACECRAFT_ATTACK", str(secrets.randbelow(9000) + 1000))
    if len(sys.argv) > 1:
        become(int(sys.argv[1]))
    elif "RACECRAFT_ATTACKING" not in os.environ:  # begun anew, so that the environment can be read
        os.environ["RACECRAFT_ATTACKING"] = "1"
        os.execv(sys.executable, [sys.executable, __file__])
    main()
