#!/usr/bin/python3
"""Calibrates heights of a milky gel under a black skin on frames of a pressed ball, and reads frames that it never saw.

Your own frames are arrays (height, width) or (height, width, 3) of uint8; here a virtual sensor takes them, so that the truth
is known.

    read_darkness.py
"""

import pathlib
import tempfile
import time

import numpy as np
import touchstone as ts
import yaml

device = yaml.safe_load((pathlib.Path(ts.scenes_folder()) / "devices" / "9dtact.yaml").read_text())
device["mesh"].update(fine_mm=1, coarse_mm=2.5)
# A 41st of the pixels, each as much larger: light through milk takes minutes a picture else.
device["camera"].update(width=72, height=54, pixel_pitch_um=35.8, full_well_e=409000)
sensor = ts.Sensor(device, friction=False)


def ball(diameter_mm):
    return ts.Object({"name": "ball", "shape": {"type": "sphere", "radius_mm": diameter_mm / 2}})


DIAMETER_MM = 10
rest = [sensor.background(frame=k) for k in range(2)]
known = [sensor.press(ball(DIAMETER_MM), depth_mm=depth, at_mm=at, frame=10 + k)
         for k, (depth, at) in enumerate(((0.6, (-3, 0)), (0.9, (0, 2)), (1.2, (3, -1))))]
# The outline of the touched part, as one would draw it by hand: u, v, radius in pixels.
circles = [(*sensor.pixel_from_gel(touch.pose[:2, 3]), np.sqrt(touch.contact.sum() / np.pi)) for touch in known]
model, report = ts.calibrate_darkness([touch.frame for touch in known], [DIAMETER_MM] * len(known), rest,
                                      mm_per_px=sensor.mm_per_px, circles=circles, smoothing_px=1)
print(f"calibrated on {model.presses} presses to {model.deepest_mm:.2f} mm; heights over rings are off by "
      f"{report['held_out']['rms_mm']:.3f} mm (RMS) on halves of contacts that were held out")
with tempfile.TemporaryDirectory() as folder:  # as a user would keep it
    path = str(pathlib.Path(folder) / "model.dark")
    model.save(path)
    model = ts.DarknessModel.load(path)

estimator = ts.DarknessEstimator(model)
for diameter, depth in ((6, 0.7), (16, 0.8)):
    touch = sensor.press(ball(diameter), depth_mm=depth, at_mm=(1, 1), frame=100 + diameter)
    seen = estimator.estimate(touch.frame)
    rms = float(np.sqrt(np.nanmean((seen.height_mm - touch.height_mm) ** 2)))
    deepest = float(np.nanmax(touch.height_mm))
    print(f"a ball of {diameter} mm: pressed in by {deepest:.3f} mm, estimated {seen.height_mm.max():.3f} mm; over the picture "
          f"off by {1e3 * rms:.0f} um (RMS); darker than any known press: {100 * seen.deeper_share:.1f} %")
    assert seen.trusted and rms < 0.1 * deepest and abs(seen.height_mm.max() - deepest) < 0.25 * deepest, (diameter, rms)

begin = time.perf_counter()
for k in range(200):
    estimator.estimate(touch.frame)
print(f"{200 / (time.perf_counter() - begin):.0f} frames of 72 x 54 a second")
