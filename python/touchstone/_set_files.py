"""What all data sets have on disk: a manifest that knows every file's checksum (docs/file-formats.md)."""

import contextlib
import hashlib
import json
import os
import pathlib
import re
import stat

from ._errors import Error


SPLITS = ("train", "validate", "test")


def read_manifest(folder):
    """dataset.json as a dict. Raises Error if there is none, or if it doesn't meet its own content_sha256."""
    path = folder / "dataset.json"
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise Error(f"{path}: {error.strerror}; a data set has this file once it is finished", str(path)) from None
    except ValueError as error:  # a zero byte in the path, or what isn't UTF-8 in the file
        raise Error(f"{path}: can't be read ({error})", str(path)) from None
    try:
        manifest = json.loads(text)
        # As the checksum is over text, numbers must stay as they were written.
        content = json.loads(text, parse_float=lambda number: "\0" + number)
        stated = content.pop("content_sha256", None)
        for beside in ("run", "timings"):  # don't belong to what the set holds
            content.pop(beside, None)
    except (ValueError, AttributeError) as error:
        raise Error(f"{path}: isn't the manifest of a data set ({error!r})", str(path)) from None
    compact = re.sub(r'"\\u0000([^"]*)"', r"\1", json.dumps(content, separators=(",", ":"), ensure_ascii=False))
    if stated is None:
        raise Error(f"{path}: isn't the manifest of a data set (it has no content_sha256)", str(path))
    if stated != hashlib.sha256(compact.encode()).hexdigest():
        raise Error(f"{path}: doesn't meet its own content_sha256; it was changed or damaged", str(path))
    return manifest


def import_h5py():
    try:
        import h5py
    except ImportError:
        raise Error("a data set's truth is read by h5py, which isn't there (Debian: python3-h5py)") from None
    return h5py


def sha256_of(path):
    """Of a file's bytes. Raises Error that names it if it can't be read, or is a pipe or a device."""
    digest = hashlib.sha256()
    try:
        # Non-blocking: a pipe that nobody writes into is opened at once, and can be refused.
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise Error(f"{path}: is a pipe or a device; only files are read", str(path))
            for block in iter(lambda: file.read(1 << 20), b""):
                digest.update(block)
    except OSError as error:
        raise Error(f"{path}: {error.strerror}", str(path)) from None
    return digest.hexdigest()


@contextlib.contextmanager
def errors_of(path):
    """What HDF5 says of a file that it can't read becomes an Error that names the file."""
    try:
        yield
    except Error:
        raise
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        raise Error(f"{path}: can't be read: {error}", str(path)) from None


def open_h5(path):
    """An h5py.File for reading. Raises Error that names the file."""
    h5py = import_h5py()
    try:
        return h5py.File(path, "r")
    except OSError as error:
        raise Error(f"{path}: can't be read: {error}", str(path)) from None


def text_of(item, attribute):
    """A text attribute of an h5py object; ours have a fixed length, which h5py gives as bytes."""
    value = item.attrs[attribute]
    return value.decode("utf-8", "backslashreplace") if isinstance(value, bytes) else str(value)


class SetFiles:
    """What Dataset asks of a folder; _scene_files.py and _drawn_files.py are the two kinds.

    A row is a sample's number in the whole set. The kinds have: `samples`, `scenes` (names),
    rows(split), group(row), array_names(), check_column(name), read(name, row), column(name, rows), constant(name),
    unit(name), meaning(name), background(unit), device_yaml(unit).
    """

    def __init__(self, folder, manifest):
        self.folder = pathlib.Path(folder)
        self.manifest = manifest
        self._open = None
        self._process = None
        self._digests = None
        self._checked = set()  # names of files that met their checksums

    def checked(self, name):
        """The path of one of the set's files, compared with its SHA-256 in the manifest at its first use. Raises Error
        that names the file if it isn't there, isn't a file, or differs."""
        path = self.folder / name
        if name not in self._checked:
            if self._digests is None:
                self._digests = {one["file"]: one["sha256"] for one in self.manifest["files"]}
            if name not in self._digests:
                raise Error(f"{path}: isn't one of the files in dataset.json", str(path))
            if sha256_of(path) != self._digests[name]:
                raise Error(f"{path}: doesn't meet its checksum in dataset.json", str(path))
            self._checked.add(name)
        return path

    def handles(self):
        """This process's open files, in a dict by path: a forked worker must not share its parent's."""
        if self._open is None or self._process != os.getpid():
            self._open = {}
            self._process = os.getpid()
        return self._open

    def __getstate__(self):
        state = dict(self.__dict__)
        state["_open"] = state["_process"] = None
        return state

    def no_array(self, name):
        return Error(f"'{name}' is no array of {self.folder}; there are: {', '.join(self.array_names())}")

    def verify(self):
        """Compares every file with its SHA-256 in the manifest. Raises Error that names the first that differs."""
        for one in self.manifest["files"]:
            path = self.folder / one["file"]
            if sha256_of(path) != one["sha256"]:
                raise Error(f"{path}: doesn't meet its checksum in dataset.json", str(path))
