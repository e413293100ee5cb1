"""Reading data sets that `touchstone generate` or touchstone.generate made (docs/file-formats.md)."""

import hashlib
import json
import os
import pathlib

from ._core import read_image
from ._errors import Error

_SPLITS = ("train", "verify", "test")
_PICTURES = {"frame": "frames", "ideal": "ideal"}  # what samples call them, and the folders they are in


class Files:
    """All that knows how a data set lies on disk: the manifest, arrays of truth.h5 and pictures.

    The rest of this module goes through `arrays`, `rows`, `picture_file` and `scenes`.
    """

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        path = self.folder / "dataset.json"
        try:
            text = path.read_text(encoding="utf-8")
        except OSError as error:
            raise Error(f"{path}: {error.strerror}; a data set has this file once it is finished", str(path)) from None
        try:
            self.manifest = json.loads(text)
            self.scenes = self.manifest["scenes"]
            self.samples = int(self.manifest["samples"])
        except (ValueError, KeyError, TypeError) as error:
            raise Error(f"{path}: isn't the manifest of a data set ({error!r})", str(path)) from None
        self._check_content(path)
        self._truth = None
        self._process = None

    def _check_content(self, path):
        content = dict(self.manifest)
        stated = content.pop("content_sha256", None)
        content.pop("timings", None)
        text = json.dumps(content, separators=(",", ":"), ensure_ascii=False)
        if stated != hashlib.sha256(text.encode()).hexdigest():
            raise Error(f"{path}: doesn't meet its own content_sha256; it was changed or damaged", str(path))

    @property
    def truth(self):
        """truth.h5, opened by h5py once in each process: a forked worker must not share it."""
        if self._truth is None or self._process != os.getpid():
            try:
                import h5py
            except ImportError:
                raise Error("a data set's truth is read by h5py, which isn't there (Debian: python3-h5py)") from None
            path = self.folder / "truth.h5"
            try:
                self._truth = h5py.File(path, "r")
            except OSError as error:
                raise Error(f"{path}: can't be read: {error}", str(path)) from None
            self._process = os.getpid()
        return self._truth

    def __getstate__(self):
        state = dict(self.__dict__)
        state["_truth"] = state["_process"] = None
        return state

    def array_names(self):
        return [one["path"].lstrip("/") for one in self.manifest["arrays"]]

    def array(self, name):
        if name not in self.array_names():
            raise Error(f"'{name}' is no array of {self.folder}; there are: {', '.join(self.array_names())}")
        return self.truth[name]

    def picture_file(self, kind, scene, frame):
        return self.folder / _PICTURES[kind] / self.scenes[scene]["name"] / f"{frame:06d}.png"

    def has_pictures(self, kind):
        start = _PICTURES[kind] + "/"
        return any(one["file"].startswith(start) for one in self.manifest["files"])


class Dataset:
    """A finished data set, or one split of it, sample by sample: for NumPy, scikit-learn and PyTorch's DataLoader.

    `len(data)` and `data[i]`, a dict of NumPy arrays, make it a map-style data set as torch.utils.data takes them;
    it can be pickled and used by workers. `data.array("wrench")` gives a whole column at once.

    folder: of the data set.
    split: "train", "verify" or "test"; None: all.
    columns: what a sample holds: "frame" and "ideal" (pictures, uint8, BGR) and arrays of truth.h5 ("wrench", "pose",
      "surface_displacement_mm", "error/force_N", ...) that have a row a sample.
    transform: called on each sample's dict; what it returns is the sample.

    Raises Error for a folder that isn't a finished data set, a damaged manifest, a column that isn't there.
    """

    def __init__(self, folder, split=None, *, columns=("frame", "wrench"), transform=None):
        if split is not None and split not in _SPLITS:
            raise Error(f"split: '{split}' is not known; allowed is one of: {', '.join(_SPLITS)}")
        self._files = Files(folder)
        self.folder = self._files.folder
        self.split = split
        self.columns = tuple(columns)
        self.transform = transform
        for name in self.columns:
            self._check_column(name)
        self._rows = [scene["first_sample"] + k
                      for scene in self._files.scenes if split in (None, scene["split"])
                      for k in range(scene["samples"])]
        self._place = {}
        for number, scene in enumerate(self._files.scenes):
            for k in range(scene["samples"]):
                self._place[scene["first_sample"] + k] = (number, k)

    def _check_column(self, name):
        if name in _PICTURES:
            if not self._files.has_pictures(name):
                raise Error(f"{self.folder} has no pictures '{name}'; its outputs say what was asked for")
            return
        shape = self._files.array(name).shape
        if not shape or shape[0] != self._files.samples:
            raise Error(f"'{name}' of {self.folder} has shape {shape}, which isn't a row a sample; use constant()")

    @property
    def manifest(self):
        """dataset.json as a dict."""
        return self._files.manifest

    @property
    def scenes(self):
        """The scenes' names, in the job's order."""
        return [scene["name"] for scene in self._files.scenes]

    def array_names(self):
        """The arrays of truth.h5."""
        return self._files.array_names()

    def unit(self, name):
        """The unit of an array: "N", "mm"; "1" for pure numbers. Of "wrench": "N, N mm"."""
        return self._files.array(name).attrs["unit"]

    def meaning(self, name):
        """One sentence on an array."""
        return self._files.array(name).attrs["meaning"]

    def __len__(self):
        return len(self._rows)

    def __getitem__(self, index):
        if not -len(self) <= index < len(self):
            raise IndexError(f"sample {index} of {len(self)}")
        row = self._rows[index]
        sample = {}
        for name in self.columns:
            if name in _PICTURES:
                scene, frame = self._place[row]
                sample[name] = read_image(str(self._files.picture_file(name, scene, frame)))
            else:
                sample[name] = self._files.array(name)[row]
        return self.transform(sample) if self.transform is not None else sample

    def array(self, name):
        """A column of this split, a row a sample, read at once."""
        self._check_column(name)
        if name in _PICTURES:
            import numpy
            return numpy.stack([read_image(str(self._files.picture_file(name, *self._place[row])))
                                for row in self._rows])
        array = self._files.array(name)
        whole = len(self._rows) == array.shape[0]
        return array[()] if whole else array[self._rows]

    def constant(self, name):
        """An array of truth.h5 that is the same for all samples, as "gel_vertices_mm"."""
        return self._files.array(name)[()]

    def groups(self):
        """For each sample the number of its scene: samples of one press belong together when data is split."""
        import numpy
        return numpy.array([self._place[row][0] for row in self._rows])

    def verify(self):
        """Compares every file with its SHA-256 in the manifest. Raises Error that names the first that differs."""
        for one in self._files.manifest["files"]:
            path = self.folder / one["file"]
            digest = hashlib.sha256()
            try:
                with open(path, "rb") as file:
                    for block in iter(lambda: file.read(1 << 20), b""):
                        digest.update(block)
            except OSError as error:
                raise Error(f"{path}: {error.strerror}", str(path)) from None
            if digest.hexdigest() != one["sha256"]:
                raise Error(f"{path}: doesn't meet its checksum in dataset.json", str(path))

    def __repr__(self):
        split = f", split '{self.split}'" if self.split else ""
        return f"<touchstone.Dataset '{self.folder}'{split}: {len(self)} samples of {', '.join(self.columns)}>"
