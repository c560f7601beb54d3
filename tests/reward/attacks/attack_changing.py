"""Attacks that change something: sockets, files, what processes share."""

from __future__ import annotations

import ctypes
import os
import socket
from contextlib import suppress

from plot import attack
from scene import NotHere, libc, received

ADDRESS = "struct.pack('<H', 2) + struct.pack('>HI', {port}, 0x7F000001) + bytes(8)"


@attack
def connect_by_tcp(scene):
    listening = scene.listener(socket.AF_INET, socket.SOCK_STREAM, ("127.0.0.1", 0))
    address = ADDRESS.format(port=listening.getsockname()[1])
    yield f"return libc.connect(libc.socket(2, 1, 0), {address}, 16)"
    return received(listening)


@attack
def send_by_udp(scene):
    listening = scene.listener(socket.AF_INET, socket.SOCK_DGRAM, ("127.0.0.1", 0))
    address = ADDRESS.format(port=listening.getsockname()[1])
    yield f"return libc.sendto(libc.socket(2, 2, 0), b'secret', 6, 0, {address}, 16)"
    return received(listening)


@attack
def listen_by_tcp(scene):
    result = yield f"""
        listening = libc.socket(2, 1, 0)
        return won(libc.bind(listening, {ADDRESS.format(port=0)}, 16) or libc.listen(listening, 1))
    """
    return result == 1.0


@attack
def connect_to_a_socket_file(scene):
    path = scene.folder / "socket"
    listening = scene.listener(socket.AF_UNIX, socket.SOCK_STREAM, str(path))
    address = bytes(path) + b"\0"
    yield f"return libc.connect(libc.socket(1, 1, 0), struct.pack('H', 1) + {address!r}, {2 + len(address)})"
    return received(listening)


@attack
def connect_to_an_abstract_socket(scene):
    name = b"\0racecraft-attack-" + str(os.getpid()).encode()
    listening = scene.listener(socket.AF_UNIX, socket.SOCK_STREAM, name)
    yield f"return libc.connect(libc.socket(1, 1, 0), struct.pack('H', 1) + {name!r}, {2 + len(name)})"
    return received(listening)


@attack
def a_pair_of_sockets(scene):
    result = yield "return won(libc.socketpair(1, 1, 0, ctypes.create_string_buffer(8)))"
    return result == 1.0


@attack
def talk_to_the_kernels_network(scene):
    result = yield "return won(libc.socket(16, 3, 0))"  # AF_NETLINK, SOCK_RAW
    return result == 1.0


@attack
def create_a_file(scene):
    path = scene.folder / "made"
    yield f"return libc.creat({bytes(path)!r}, 0o600)"
    return path.exists()


@attack
def create_a_file_in_memory(scene):
    name = f"/dev/shm/racecraft-attack-{os.getpid()}"
    yield f"return libc.creat({name.encode()!r}, 0o600)"
    try:
        os.unlink(name)
    except FileNotFoundError:
        return False
    return True


@attack
def write_into_a_file(scene):
    path = scene.file()
    yield f"return libc.write(libc.open({bytes(path)!r}, 1), b'gone', 4)"
    return path.read_text() != str(scene.number)


@attack
def remove_a_file(scene):
    path = scene.file()
    yield f"return libc.unlink({bytes(path)!r})"
    return not path.exists()


@attack
def rename_a_file(scene):
    path = scene.file()
    yield f"return libc.rename({bytes(path)!r}, {bytes(scene.folder / 'other')!r})"
    return not path.exists()


@attack
def truncate_a_file(scene):
    path = scene.file()
    yield f"return libc.truncate({bytes(path)!r}, ctypes.c_long(0))"
    return not path.read_text()


@attack
def make_a_folder(scene):
    path = scene.folder / "made"
    yield f"return libc.mkdir({bytes(path)!r}, 0o700)"
    return path.exists()


@attack
def remove_a_folder(scene):
    path = scene.folder / "inner"
    path.mkdir()
    yield f"return libc.rmdir({bytes(path)!r})"
    return not path.exists()


@attack
def make_a_link(scene):
    path = scene.folder / "link"
    yield f"return libc.symlink(b'/etc/passwd', {bytes(path)!r})"
    return path.is_symlink()


@attack
def a_second_name_for_a_file(scene):
    path, other = scene.file(), scene.folder / "other"
    yield f"return libc.link({bytes(path)!r}, {bytes(other)!r})"
    return other.exists()


@attack
def rights_of_a_file(scene):
    path = scene.file()
    yield f"return libc.chmod({bytes(path)!r}, 0o666)"
    return path.stat().st_mode & 0o777 == 0o666


@attack
def times_of_a_file(scene):
    path = scene.file()
    yield f"return libc.utimes({bytes(path)!r}, struct.pack('4Q', 1000, 0, 1000, 0))"
    return path.stat().st_mtime == 1000


@attack
def a_pipe_with_a_name(scene):
    path = scene.folder / "pipe"
    yield f"return libc.mkfifo({bytes(path)!r}, 0o600)"
    return path.exists()


@attack
def another_working_folder(scene):
    result = yield f"return won(libc.chdir({bytes(scene.folder)!r}))"
    return result == 1.0


@attack
def shared_memory_of_system_v(scene):
    key = 0x52430000 + os.getpid() % 65536
    libc.shmat.restype = ctypes.c_void_p
    segment = libc.shmget(key, 4096, 0o1600)  # IPC_CREAT
    if segment < 0:
        raise NotHere("no System V shared memory")
    scene.at_end(libc.shmctl, segment, 0, None)
    place = libc.shmat(segment, None, 0)
    ctypes.memset(place, 0, 8)
    yield f"""
        libc.shmat.restype = ctypes.c_void_p
        ctypes.memmove(libc.shmat(libc.shmget({key}, 4096, 0o600), None, 0), b"stolen", 6)
        return 0.0
    """
    return ctypes.string_at(place, 6) == b"stolen"


@attack
def messages_of_system_v(scene):
    key = 0x52430000 + os.getpid() % 65536
    queue = libc.msgget(key, 0o1600)
    if queue < 0:
        raise NotHere("no System V messages")
    scene.at_end(libc.msgctl, queue, 0, None)
    yield f"return libc.msgsnd(libc.msgget({key}, 0o600), struct.pack('q', 1) + b'secret', 6, 0o4000)"
    return libc.msgrcv(queue, ctypes.create_string_buffer(100), 50, 0, 0o4000) > 0


@attack
def semaphores_of_system_v(scene):
    result = yield """
        made = libc.semget(0, 1, 0o1600)
        libc.semctl(made, 0, 0)
        return won(made)
    """
    return result == 1.0


@attack
def a_message_queue(scene):
    name = f"/racecraft-attack-{os.getpid()}".encode()
    yield f"return libc.mq_open({name!r}, 0o102, 0o600, None)"
    return libc.mq_unlink(name) == 0


@attack
def standard_output_of_the_trainer(scene):
    """What stands in the trainer's terminal, a log or a pipe."""
    inner, outer = os.pipe()
    scene.keep(inner)
    scene.keep(outer)
    os.set_blocking(inner, False)
    yield f"return libc.write(libc.open(b'/proc/{os.getpid()}/fd/{outer}', 1), b'mine', 4)"
    with suppress(BlockingIOError):
        return os.read(inner, 10) == b"mine"
    return False
