"""Attacks that look: files, folders, the trainer's open files and environment, the machine."""

from __future__ import annotations

import os

from plot import attack, root_only


@attack
def the_published_one(scene):
    """The source of issue trackers: through an innocent module to the import machinery, and from there to C."""
    path = scene.file()
    result = yield f"""
        import re
        system = re.enum.sys
        importing = getattr(system.modules["built" + "ins"], "__imp" + "ort__")
        system.meta_path.append(system.modules["_frozen_importlib_external"].PathFinder)
        tool = importing("ct" + "ypes").CDLL
        found = ctypes.create_string_buffer(100)
        c = ctypes.pythonapi
        c.read(c.open({bytes(path)!r}, 0), found, 99)
        return number(found)
    """
    return result == scene.number


@attack
def read_a_file(scene):
    path = scene.file()
    result = yield f"return read({bytes(path)!r})"
    return result == scene.number


@attack
def read_a_file_by_python(scene):
    """Python's own functions, past the audit hook: it is a closure's default away."""
    path = scene.file()
    result = yield f"""
        import _io
        descriptor = libc.open({bytes(path)!r}, 0)
        return float(_io.FileIO(descriptor).read(100)) if descriptor >= 0 else 0.0
    """
    return result == scene.number


@attack
def read_through_a_folder(scene):
    path = scene.file()
    result = yield f"""
        folder = libc.open({bytes(scene.folder)!r}, 0o200000)
        found = ctypes.create_string_buffer(100)
        libc.read(libc.openat(folder, {path.name.encode()!r}, 0), found, 99)
        return number(found)
    """
    return result == scene.number


@attack
def map_a_file(scene):
    path = scene.file()
    result = yield f"""
        libc.mmap.restype = ctypes.c_void_p
        place = libc.mmap(None, ctypes.c_size_t(4096), 1, 2, libc.open({bytes(path)!r}, 0), ctypes.c_long(0))
        return number(ctypes.string_at(place, {len(str(scene.number))}))
    """
    return result == scene.number


@attack
def size_of_a_file(scene):
    """A stat, of which Landlock knows nothing."""
    path = scene.file(text="x" * scene.number)
    result = yield f"""
        found = ctypes.create_string_buffer(512)
        libc.stat({bytes(path)!r}, found)
        return float(struct.unpack_from("<Q", found, 48)[0])
    """
    return result == scene.number


@attack
def size_of_a_file_by_statx(scene):
    path = scene.file(text="x" * scene.number)
    result = yield f"""
        found = ctypes.create_string_buffer(512)
        libc.statx(-100, {bytes(path)!r}, 0, 0x7FF, found)
        return float(struct.unpack_from("<Q", found, 40)[0])
    """
    return result == scene.number


@attack
def whether_a_file_exists(scene):
    path = scene.file()
    result = yield f"return 1.0 + libc.access({bytes(path)!r}, 0)"
    return result == 1.0


@attack
def where_a_link_leads(scene):
    link = scene.folder / "link"
    link.symlink_to(f"{scene.number}")
    result = yield f"""
        found = ctypes.create_string_buffer(100)
        libc.readlink({bytes(link)!r}, found, 99)
        return number(found)
    """
    return result == scene.number


@attack
def list_a_folder(scene):
    inner = scene.folder / "inner"
    inner.mkdir()
    (inner / f"{scene.number}").touch()
    result = yield f"""
        found = ctypes.create_string_buffer(4096)
        size = call("getdents64", libc.open({bytes(inner)!r}, 0o200000), found, 4096)
        names = [part[1:] for part in found.raw[:max(size, 0)].split(b"\\0")]  # after the byte that says the kind
        return float(max((name for name in names if name.isdigit()), key=len, default=0))
    """
    return result == scene.number


@attack
def environment_of_the_trainer(scene):
    marker = os.environ["RACECRAFT_ATTACK"]  # which the program of this file was started with
    result = yield f"""
        found = ctypes.create_string_buffer(1 << 16)
        libc.read(libc.open(b"/proc/{os.getpid()}/environ", 0), found, 1 << 16)
        return number(found.raw.partition(b"RACECRAFT_ATTACK=")[2])
    """
    return result == float(marker)


@attack
def memory_map_of_the_trainer(scene):
    scene.ours()
    result = yield f"""
        found = ctypes.create_string_buffer(4096)
        return won(libc.read(libc.open(b"/proc/{os.getpid()}/maps", 0), found, 4095) - 1)
    """
    return result == 1.0


@attack
def a_file_the_trainer_has_open(scene):
    path = scene.file()
    descriptor = scene.keep(os.open(path, os.O_RDONLY))
    path.unlink()
    result = yield f"return read(b'/proc/{os.getpid()}/fd/{descriptor}')"
    return result == scene.number


@attack
def which_processes_there_are(scene):
    victim = scene.victim()
    result = yield f"return 1.0 + libc.access(b'/proc/{victim}', 0)"
    return result == 1.0


@attack
def time_another_process_has_used(scene):
    victim = scene.victim()
    result = yield f"return 1.0 + libc.clock_gettime({(~victim << 3) | 2}, ctypes.create_string_buffer(16))"
    return result == 1.0


@attack
def name_of_the_machine(scene):
    result = yield """
        found = ctypes.create_string_buffer(400)
        libc.uname(found)
        return float(sum(found.raw[65:130]))
    """
    return result == sum(os.uname().nodename.encode())


@attack
def log_of_the_kernel(scene):
    root_only()
    result = yield "return won(libc.klogctl(10, None, 0))"
    return result == 1.0


@attack
def watch_a_folder(scene):
    result = yield f"return won(libc.inotify_add_watch(libc.inotify_init(), {bytes(scene.folder)!r}, 0xFFF))"
    return result == 1.0


@attack
def an_inherited_descriptor(scene):
    path = scene.file()
    descriptor = scene.keep(os.open(path, os.O_RDONLY))
    scene.leaked.append(descriptor)
    result = yield f"""
        found = ctypes.create_string_buffer(100)
        return number(found) if libc.pread({descriptor}, found, 99, ctypes.c_long(0)) > 0 else 0.0
    """
    return result == scene.number
