#!/usr/bin/python3
"""Calibrates displacements of coloured markers by their hue and place, and reads a press that it never saw.

Your own frames are arrays (height, width, 3) of uint8 in BGR order, with how far some markers were moved in each, as by a stage;
here a virtual sensor takes them, so that the truth is known.

    read_coloured_markers.py
"""

import pathlib
import tempfile
import time

import numpy as np
import touchstone as ts
import yaml

scenes = pathlib.Path(ts.scenes_folder())


def with_whole_paths(value):
    """A device's fields, whose files aren't beside this script."""
    if isinstance(value, dict):
        return {key: with_whole_paths(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [with_whole_paths(inner) for inner in value]
    return str((scenes / "devices" / value).resolve()) if isinstance(value, str) and value.startswith("../") else value


device = with_whole_paths(yaml.safe_load((scenes / "devices" / "chroma-compact.yaml").read_text()))
device["mesh"].update(fine_mm=1, coarse_mm=3)  # twice as coarse: set up in seconds
sensor = ts.Sensor(device)
rest = sensor.background()
reader = ts.ColourMarkerReader(rest, grid=(10, 10))


def press(radius_mm, depth_mm, at_mm, shear_mm, frame):
    ball = ts.Object({"name": "ball", "shape": {"type": "sphere", "radius_mm": radius_mm}, "friction": 1.0})
    return sensor.press(ball, depth_mm=depth_mm, at_mm=at_mm, shear_mm=shear_mm, frame=frame)


# Samples: of a reading, a marker's number by rows, how far it was moved (mm, a press is -z), and of which series.
samples = []
for series, (radius_mm, at_mm) in enumerate(((8, (0, 0)), (5, (3, 3)), (12, (-3, 0)))):
    for k, (depth_mm, shear_mm) in enumerate(((0.4, (0, 0)), (0.8, (0, 0)), (1.0, (0.4, 0)), (1.0, (0, 0.4)))):
        touch = press(radius_mm, depth_mm, at_mm, shear_mm, 10 * series + k + 1)
        reading = reader.read(touch.frame)
        samples += [(reading, marker, moved, series) for marker, moved in enumerate(touch.marker_displacement_mm)
                    if reading.flaws[marker] == "none" and reader.rest.flaws[marker] == "none"]
model = ts.calibrate_hue(reader.rest, samples, spacing_mm=3, form="best")
print(f"calibrated on {model.samples} samples: off by {1e3 * model.rms_error_mm:.0f} um (RMS)")
with tempfile.TemporaryDirectory() as folder:  # as a user would keep it
    path = str(pathlib.Path(folder) / "model.json")
    model.save(path)
    model = ts.HueModel.load(path)

estimator = ts.HueEstimator(model, reader.rest)
for radius_mm, depth_mm, at_mm, shear_mm in ((8, 0.6, (1, 0.7), (0, 0)), (10, 0.9, (-1, 1), (-0.2, 0.3))):
    touch = press(radius_mm, depth_mm, at_mm, shear_mm, 100)
    seen = estimator.estimate(reader.read(touch.frame))
    off = (seen.displacement_mm - touch.marker_displacement_mm)[seen.measured]
    rms = np.sqrt(np.mean(off ** 2, axis=0))
    print(f"a ball of {2 * radius_mm} mm, {depth_mm} mm deep: {seen.measured.sum()} of {len(seen.measured)} markers measured, off by "
          f"{np.round(1e3 * rms)} um (RMS, x, y, z)")
    assert seen.measured.mean() > 0.9 and max(rms[:2]) < 0.05 and rms[2] < 0.25, rms

frame = touch.frame
begin = time.perf_counter()
for k in range(100):
    estimator.estimate(reader.read(frame))
print(f"{100 / (time.perf_counter() - begin):.0f} frames of 120 x 120 a second")
