"""Runs a filter of system calls as the kernel would, so that those of other processors can be tested here."""

from __future__ import annotations

import struct
from dataclasses import dataclass

ALLOW, EPERM, KILL = 0x7FFF0000, 0x00050001, 0x80000000


@dataclass(frozen=True)
class Call:
    """One system call; arguments are 64 bits wide."""

    number: int
    arguments: tuple[int, ...] = ()
    architecture: int = 0

    def pack(self) -> bytes:
        """As struct seccomp_data."""
        padded = (*self.arguments, *(0,) * (6 - len(self.arguments)))
        wide = [value % 2**64 for value in padded]
        return struct.pack("<IIQ6Q", self.number % 2**32, self.architecture, 0x7F0000000000, *wide)


def run(program: bytes, call: Call) -> int:
    """What the filter answers."""
    instructions = list(struct.iter_unpack("<HBBI", program))
    data, accumulator, place = call.pack(), 0, 0
    while True:
        code, if_true, if_false, value = instructions[place]
        place += 1
        match code:
            case 0x20:
                (accumulator,) = struct.unpack_from("<I", data, value)
            case 0x54:
                accumulator &= value
            case 0x15:
                place += if_true if accumulator == value else if_false
            case 0x25:
                place += if_true if accumulator > value else if_false
            case 0x35:
                place += if_true if accumulator >= value else if_false
            case 0x06:
                return value
            case _:
                raise AssertionError(f"instruction {code:#x} at {place - 1}")
