"""Replay files: everything that was driven, to be shown again, and driven again to prove it."""

from racecraft.replay.replay import Replay, read_replay, write_replay
from racecraft.replay.verification import Verification, verify

__all__ = ["Replay", "Verification", "read_replay", "verify", "write_replay"]
