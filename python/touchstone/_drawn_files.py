"""Data sets of jobs that draw: blocks/000012.h5, each with samples of one unit (docs/datasets.md)."""

import bisect

from ._errors import Error
from ._set_files import SPLITS, SetFiles, errors_of, import_h5py, open_h5, text_of

_MOST_OPEN = 64  # blocks that a process keeps open
_KEPT_ROW_BYTES = 1024  # columns of smaller rows are read whole and kept, of others (pictures) a row


def _as_opencv(picture):
    """Red, green, blue as they lie in a file to BGR; grey pictures lose their last axis, as read_image gives them."""
    if picture.shape[-1] == 1:
        return picture[..., 0]
    return picture[..., ::-1].copy()  # torch takes no negative strides


class _Block:
    def __init__(self, path):
        self.file = open_h5(path)
        self._kept = {}

    def array(self, name):
        try:
            return self.file[name]
        except KeyError as error:
            raise Error(f"{self.file.filename}: has no array '{name}' ({error})", self.file.filename) from None

    def _whole(self, name):
        """A column of small rows, or what the block has once, read at the first use."""
        if name not in self._kept:
            array = self.array(name)
            with errors_of(self.file.filename):
                self._kept[name] = array[()]
        return self._kept[name]

    def events(self, k):
        """Sample k's events, a structured array as Touch.events has it."""
        import numpy
        ends = numpy.cumsum(self._whole("events/count"))
        first, end = (ends[k - 1] if k > 0 else 0), ends[k]
        dtype = [("t_us", "i8"), ("x", "u2"), ("y", "u2"), ("on", "?")]
        records = numpy.empty(end - first, dtype)
        for name, _ in dtype:
            array = self.array(f"events/{name}")
            with errors_of(self.file.filename):
                records[name] = array[first:end]
        return records

    def row(self, name, k):
        if name == "events":
            return self.events(k)
        array = self.array(name)
        if name == "frame" or array.nbytes > _KEPT_ROW_BYTES * array.shape[0]:
            with errors_of(self.file.filename):
                row = array[k]
            return _as_opencv(row) if name == "frame" else row
        return self._whole(name)[k].copy()

    def background(self):
        return _as_opencv(self._whole("background")).copy()

    def text(self, name):
        return [one.decode("utf-8", "backslashreplace").rstrip("\0") for one in self._whole(name)]


class DrawnFiles(SetFiles):
    def __init__(self, folder, manifest):
        super().__init__(folder, manifest)
        self.samples = int(manifest["samples"])
        self._blocks = [one for one in manifest["files"] if "first_sample" in one]
        self._firsts = [one["first_sample"] for one in self._blocks]
        self._first_of_unit = {}
        for number, block in enumerate(self._blocks):
            self._first_of_unit.setdefault(block["unit"], number)
        expected = 0
        for block in self._blocks:
            if block["first_sample"] != expected:
                raise ValueError(f"files: sample {expected} is in none")
            expected += block["samples"]
        if expected != self.samples:
            raise ValueError(f"files: hold {expected} samples of {self.samples}")
        self._shapes = None

    @property
    def scenes(self):
        raise Error(f"{self.folder} is of a job that draws; it has units, not scenes (see manifest['units'])")

    def _block(self, number):
        handles = self.handles()
        block = handles.pop(number, None) or _Block(self.checked(self._blocks[number]["file"]))
        handles[number] = block  # the last used stands last
        if len(handles) > _MOST_OPEN:
            handles.pop(next(iter(handles)), None)
        return block

    def _place(self, row):
        number = bisect.bisect_right(self._firsts, row) - 1
        return number, row - self._firsts[number]

    def _described(self):
        """Name of each array of a block, whether it has a row a sample, unit and meaning: alike in all blocks."""
        if self._shapes is None:
            block = self._block(0)
            found = {}

            def note(name, item):
                if isinstance(item, import_h5py().Dataset):
                    axes = text_of(item, "shape")
                    found[name] = (axes.split(" x ")[0] == "samples", text_of(item, "unit"), text_of(item, "meaning"))

            block.file.visititems(note)
            self._shapes = found
        return self._shapes

    def _of(self, name):
        described = self._described()
        if name not in described:
            raise self.no_array(name)
        return described[name]

    def rows(self, split):
        if split is None:
            return list(range(self.samples))
        if self.manifest["splits"]["by"] == "unit":
            chosen = {one["unit"] for one in self.manifest["units"] if one["split"] == split}
            return [block["first_sample"] + k for block in self._blocks if block["unit"] in chosen
                    for k in range(block["samples"])]
        wanted = SPLITS.index(split)
        return [block["first_sample"] + k for number, block in enumerate(self._blocks)
                for k in range(block["samples"]) if self._block(number).row("split", k) == wanted]

    def group(self, row):
        return self._blocks[self._place(row)[0]]["unit"]

    def array_names(self):
        return sorted(self._described())

    def check_column(self, name):
        if name == "background" or name == "events" and "events/count" in self._described():
            return
        a_row_a_sample, _, _ = self._of(name)
        if not a_row_a_sample:
            raise Error(f"'{name}' of {self.folder} isn't a row a sample; use device_yaml() or constant()")

    def read(self, name, row):
        number, k = self._place(row)
        block = self._block(number)
        return block.background() if name == "background" else block.row(name, k)

    def column(self, name, rows):
        import numpy
        rows = list(rows)
        if name == "events":  # of as many as each sample has
            return [self.read(name, row) for row in rows]
        if not rows:
            like = numpy.asarray(self.read(name, 0))
            return numpy.empty((0, *like.shape), like.dtype)
        result = None
        for place, row in enumerate(rows):
            value = self.read(name, row)
            if result is None:
                result = numpy.empty((len(rows), *numpy.shape(value)), numpy.asarray(value).dtype)
            result[place] = value
        return result

    def constant(self, name):
        if name == "object_name":
            return self._block(0).text(name)
        if name in ("bead_places", "marker_places", "gel_vertices") and name in self._described():
            return self._block(0).array(name)[()]
        self._of(name)
        raise Error(f"'{name}' of {self.folder} isn't the same for all samples; use array(), background(unit) or "
                    "device_yaml(unit)")

    def unit(self, name):
        return self._of(name)[1]

    def meaning(self, name):
        return self._of(name)[2]

    def _block_of_unit(self, unit):
        if unit not in self._first_of_unit:
            raise Error(f"unit {unit} of {self.folder} isn't there; allowed is 0 to {max(self._first_of_unit)}")
        return self._block(self._first_of_unit[unit])

    def background(self, unit):
        return self._block_of_unit(unit).background()

    def device_yaml(self, unit):
        return self._block_of_unit(unit).text("device_yaml")[0]
