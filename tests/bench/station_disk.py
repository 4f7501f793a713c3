"""A disk that has lost its power: replays the calls that tests/bench/station/disk_calls.cpp has logged and keeps only
synced data.

A file's content is durable as of its last fsync; a folder's entries, its files' names, as of the folder's own last fsync.
Nothing else is durable. That is less than what ext4 or xfs keep.
"""
import atexit
import pathlib
import shutil
import tempfile

MEMORY = pathlib.Path("/dev/shm")


def quick_folder(otherwise):
    """A folder in memory, where syncing costs nothing, removed at the end; `otherwise` where there is none. A kill
    leaves there the same as on a disk; the result of a power cut is calculated."""
    if not MEMORY.is_dir() or shutil.disk_usage(MEMORY).free < 256 << 20:
        return pathlib.Path(otherwise)
    folder = pathlib.Path(tempfile.mkdtemp(dir=MEMORY, prefix="scanrig-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


class File:
    def __init__(self):
        self.data, self.durable = bytearray(), b""


class Folder:
    def __init__(self):
        self.entries, self.durable = {}, {}


class Disk:
    """`root` exists and is durable from the start."""

    def __init__(self, root):
        self.root_path, self.root = root.rstrip("/"), Folder()

    def _find(self, path):
        node = self.root
        for name in path[len(self.root_path):].strip("/").split("/"):
            if name:
                node = node.entries[name]
        return node

    def _parent(self, path):
        folder, name = path.rsplit("/", 1)
        return self._find(folder), name

    def apply(self, kind, path, other, data):
        if path == self.root_path:
            assert kind == "sync", f"{kind} of the root"
            self.root.durable = dict(self.root.entries)
            return
        folder, name = self._parent(path)
        if kind in ("create", "truncate"):
            node = folder.entries.setdefault(name, File())
            if kind == "truncate":
                node.data = bytearray()
        elif kind == "write":
            at, content = int(other), self._find(path)
            content.data.extend(b"\0" * (at - len(content.data)))
            content.data[at:at + len(data)] = data
        elif kind == "resize":
            size, content = int(other), self._find(path)
            del content.data[size:]
            content.data.extend(b"\0" * (size - len(content.data)))
        elif kind == "sync":
            node = self._find(path)
            node.durable = dict(node.entries) if isinstance(node, Folder) else bytes(node.data)
        elif kind == "mkdir":
            folder.entries[name] = Folder()
        elif kind == "remove":
            del folder.entries[name]
        elif kind == "rename":
            there, new_name = self._parent(other)
            there.entries[new_name] = folder.entries.pop(name)
        elif kind == "exchange":
            there, new_name = self._parent(other)
            there.entries[new_name], folder.entries[name] = folder.entries[name], there.entries[new_name]
        else:
            raise ValueError(kind)

    def write_durable(self, target, node=None):
        """Makes the folder `target` with the content that a restarted machine finds."""
        target.mkdir(parents=True)
        for name, entry in (node or self.root).durable.items():
            if isinstance(entry, Folder):
                self.write_durable(target / name, entry)
            else:
                (target / name).write_bytes(entry.durable)


def read_log(file):
    for line in file.read_text().splitlines():
        kind, path, other, data = line.split("\t")
        yield kind, path, other, bytes.fromhex(data)
