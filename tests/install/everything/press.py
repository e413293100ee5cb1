"""press.py DEVICE DATA_SET PREFIX: docs/python.md in a script of somebody else's."""

import pathlib
import sys
import tempfile

import numpy as np

import touchstone as ts
from touchstone.testing import assert_close

device, data_set, prefix = sys.argv[1:]
for place in (ts.__file__, ts._core.__file__, ts.scenes_folder()):
    assert pathlib.Path(place).is_relative_to(prefix), f"{place} isn't below {prefix}"

touch = ts.Sensor(device).press("ball-4mm", force_N=0.5, at_mm=(0.2, 0))
assert_close(touch.force_N[2], 0.5, allowed=1e-4, error_bar=touch.force_error_N[2], unit="N")
with tempfile.TemporaryDirectory() as folder:
    picture = f"{folder}/frame.png"
    ts.write_png(picture, touch.frame)
    assert np.array_equal(ts.read_image(picture), touch.frame)
    pathlib.Path(f"{folder}/clip.avi").write_text("no video")
    try:
        ts.frames(f"{folder}/clip.avi")
    except ts.Error as error:
        assert "can't be read as a video" in str(error), error
for module in ("image", "video"):
    loaded = [line for line in pathlib.Path("/proc/self/maps").read_text().splitlines()
              if f"touchstone_{module}_module" in line]
    assert loaded and all(f"{prefix}/lib" in line for line in loaded), f"{loaded[:1]} isn't below {prefix}"

data = ts.Dataset(data_set, "train")
assert data.array("frame").shape[1:] == touch.frame.shape and len(data) > 0
print(f"press.py: {touch.force_N[2]:.5f} N, 0.5 N were asked for; a data set of {len(data)} frames; {ts.__file__}")
