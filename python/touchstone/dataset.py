"""Reading data sets that `touchstone generate` or touchstone.generate made (docs/file-formats.md, docs/datasets.md)."""

import operator
import os
import pathlib

from ._drawn_files import DrawnFiles
from ._errors import Error
from ._scene_files import SceneFiles
from ._set_files import SPLITS, read_manifest

_FORMAT, _VERSION = "touchstone-dataset", 2
_SOURCES = {"scenes": SceneFiles, "draw": DrawnFiles}


def _open_set(folder):
    try:
        path = pathlib.Path(os.fsdecode(folder)) / "dataset.json"
    except (TypeError, ValueError) as error:
        raise Error(f"folder: a path is needed, this is {folder!r:.60} ({error})") from None
    manifest = read_manifest(path.parent)
    if manifest.get("format") != _FORMAT:
        raise Error(f"{path}: format: '{manifest.get('format')}' isn't a data set's; allowed is '{_FORMAT}'", str(path))
    if manifest.get("format_version") != _VERSION:
        raise Error(f"{path}: has format version {manifest.get('format_version')}; this program reads {_VERSION}",
                    str(path))
    source = manifest.get("source")
    if source not in _SOURCES:
        raise Error(f"{path}: source: '{source}' is not known; allowed is one of: {', '.join(_SOURCES)}", str(path))
    try:
        return _SOURCES[source](path.parent, manifest)
    except (ValueError, KeyError, TypeError) as error:
        if isinstance(error, Error):
            raise
        raise Error(f"{path}: isn't the manifest of a data set ({error!r})", str(path)) from None


class Dataset:
    """A finished data set, or one split of it, sample by sample: for NumPy, scikit-learn and PyTorch's DataLoader.

    `len(data)` and `data[i]`, a dict of NumPy arrays, make it a map-style data set as torch.utils.data takes them;
    it can be pickled and used by workers. `data.array("wrench")` gives a whole column at once. Sets of jobs with
    scenes and of jobs that draw are read alike; pictures are BGR in both, also where files hold red, green, blue.

    folder: of the data set.
    split: "train", "validate" or "test"; None: all.
    columns: what a sample holds: pictures ("frame"; with scenes "ideal"; drawn "height", "contact", and
      "background", the frame of the sample's unit untouched) and arrays that have a row a sample ("wrench", "pose",
      "error/force_N", "drawn/force_N", ...; array_names() has them all).
    transform: called on each sample's dict; what it returns is the sample.

    Raises Error for a folder that isn't a finished data set, a damaged manifest, a column that isn't there.
    """

    def __init__(self, folder, split=None, *, columns=("frame", "wrench"), transform=None):
        self._files = _open_set(folder)
        if split is not None and split not in SPLITS:
            raise Error(f"split: '{split}' is not known; allowed is one of: {', '.join(SPLITS)}")
        self.folder = self._files.folder
        self.split = split
        self.columns = tuple(columns)
        self.transform = transform
        for name in self.columns:
            self._files.check_column(name)
        self._rows = self._files.rows(split)

    @property
    def manifest(self):
        """dataset.json as a dict."""
        return self._files.manifest

    @property
    def scenes(self):
        """The scenes' names, in the job's order. Raises Error for a set that was drawn."""
        return self._files.scenes

    def array_names(self):
        """The arrays of truth.h5, or of a block."""
        return self._files.array_names()

    def unit(self, name):
        """The unit of an array: "N", "mm"; "1" for pure numbers. Of "wrench": "N, N mm"."""
        return self._files.unit(name)

    def meaning(self, name):
        """One sentence on an array."""
        return self._files.meaning(name)

    def __len__(self):
        return len(self._rows)

    def __getitem__(self, index):
        index = operator.index(index)
        if not -len(self) <= index < len(self):
            raise IndexError(f"sample {index} of {len(self)}")
        row = self._rows[index]
        sample = {name: self._files.read(name, row) for name in self.columns}
        return self.transform(sample) if self.transform is not None else sample

    def array(self, name):
        """A column of this split, a row a sample, read at once."""
        self._files.check_column(name)
        return self._files.column(name, self._rows)

    def constant(self, name):
        """What is the same for all samples: an array of truth.h5 as "gel_vertices_mm"; of a drawn set "object_name",
        a list of texts."""
        return self._files.constant(name)

    def groups(self):
        """For each sample the number of its scene, or of its unit in a drawn set: samples of one press, or of one
        sensor, belong together when data is split."""
        import numpy
        return numpy.array([self._files.group(row) for row in self._rows], dtype=int)

    def background(self, unit):
        """The frame of a drawn set's sensor `unit` (0, 1, ...) untouched, as "frame". Raises Error for other sets."""
        return self._files.background(unit)

    def device_yaml(self, unit):
        """The whole device file of a drawn set's sensor `unit`, as drawn. Raises Error for other sets."""
        return self._files.device_yaml(unit)

    def verify(self):
        """Compares every file with its SHA-256 in the manifest. Raises Error that names the first that differs."""
        self._files.verify()

    def __repr__(self):
        split = f", split '{self.split}'" if self.split else ""
        return f"<touchstone.Dataset '{self.folder}'{split}: {len(self)} samples of {', '.join(self.columns)}>"
