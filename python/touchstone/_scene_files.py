"""Data sets of jobs with `scenes`: truth.h5, and pictures as PNG files in a folder a scene."""

from ._core import read_image
from ._errors import Error
from ._set_files import SetFiles, errors_of, open_h5, text_of

_PICTURES = {"frame": "frames", "ideal": "ideal"}  # what samples call them, and the folders they are in


class SceneFiles(SetFiles):
    def __init__(self, folder, manifest):
        super().__init__(folder, manifest)
        self._scenes = manifest["scenes"]
        self.samples = int(manifest["samples"])
        self._arrays = [one["path"].lstrip("/") for one in manifest["arrays"]]
        self._place = {scene["first_sample"] + k: (number, k)
                       for number, scene in enumerate(self._scenes) for k in range(scene["samples"])}

    @property
    def scenes(self):
        return [scene["name"] for scene in self._scenes]

    def rows(self, split):
        return [scene["first_sample"] + k for scene in self._scenes if split in (None, scene["split"])
                for k in range(scene["samples"])]

    def group(self, row):
        return self._place[row][0]

    def array_names(self):
        return list(self._arrays)

    def _array(self, name):
        if name not in self._arrays:
            raise self.no_array(name)
        handles = self.handles()
        if "truth.h5" not in handles:
            handles["truth.h5"] = open_h5(self.checked("truth.h5"))
        with errors_of(self.folder / "truth.h5"):
            return handles["truth.h5"][name]

    def _values(self, name, rows):
        array = self._array(name)
        with errors_of(self.folder / "truth.h5"):
            return array[rows]

    def check_column(self, name):
        if name in _PICTURES:
            start = _PICTURES[name] + "/"
            if not any(one["file"].startswith(start) for one in self.manifest["files"]):
                raise Error(f"{self.folder} has no pictures '{name}'; its outputs say what was asked for")
            return
        shape = self._array(name).shape
        if not shape or shape[0] != self.samples:
            raise Error(f"'{name}' of {self.folder} has shape {shape}, which isn't a row a sample; use constant()")

    def read(self, name, row):
        if name not in _PICTURES:
            return self._values(name, row)
        scene, frame = self._place[row]
        return read_image(str(self.checked(f"{_PICTURES[name]}/{self._scenes[scene]['name']}/{frame:06d}.png")))

    def column(self, name, rows):
        if name in _PICTURES:
            import numpy
            if not rows:
                first = self.read(name, 0)
                return numpy.empty((0, *first.shape), first.dtype)
            return numpy.stack([self.read(name, row) for row in rows])
        return self._values(name, () if len(rows) == self._array(name).shape[0] else rows)

    def constant(self, name):
        return self._values(name, ())

    def unit(self, name):
        return text_of(self._array(name), "unit")

    def meaning(self, name):
        return text_of(self._array(name), "meaning")

    def background(self, unit):
        raise Error(f"{self.folder} is of a job with scenes, which keeps no backgrounds; only jobs that draw do")

    def device_yaml(self, unit):
        raise Error(f"{self.folder} is of a job with scenes, which keeps no device files; only jobs that draw do")
