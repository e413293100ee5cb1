#!/usr/bin/python3
"""Calibrates the height estimator on frames of pressed balls and reads a frame that it never saw.

Your own frames are arrays (height, width, 3) of uint8 in BGR order, as cv2.imread gives them; here a virtual sensor
takes them, so that the truth is known.

    estimate_own_frames.py
"""

import pathlib
import tempfile

import numpy as np
import touchstone as ts

here = pathlib.Path(__file__).parent
sensor = ts.Sensor(here / "quick-sensor.yaml")
DIAMETER_MM, DEPTH_MM = 4.0, 0.55
ball = ts.Object({"name": "ball", "shape": {"type": "sphere", "radius_mm": DIAMETER_MM / 2}})

# What a user has: frames of the untouched gel, and of a ball pressed at some places.
background = [sensor.background(frame=k) for k in range(8)]
frames, circles = [], []
for x in (-1.2, 0.0, 1.2):
    for y in (-0.9, 0.0, 0.9):
        touch = sensor.press(ball, depth_mm=DEPTH_MM, at_mm=(x, y), frame=100 + len(frames))
        frames.append(touch.frame)
        # The outline of the touched part, as one would draw it by hand: u, v, radius in pixels.
        circles.append((*sensor.pixel_from_gel((x, y)), np.sqrt(touch.contact.sum() / np.pi)))

model, report = ts.calibrate_height(frames, [DIAMETER_MM] * len(frames), background, mm_per_px=sensor.mm_per_px,
                                    circles=circles)
print(f"calibrated on {model.presses} presses, {report['pixels']} pixels: slopes within "
      f"{report['rms_slope_error']:.3f}, correction '{report['correction']}'")

with tempfile.TemporaryDirectory() as folder:  # as a user would keep it
    path = str(pathlib.Path(folder) / "model.gel")
    model.save(path)
    model = ts.HeightModel.load(path)

estimator = ts.HeightEstimator(model)
bar = ts.Object({"name": "bar", "shape": {"type": "rounded_cylinder", "radius_mm": 1.0, "edge_radius_mm": 0.4,
                                          "height_mm": 3.0}})
for name, thing, how in (("the ball elsewhere", ball, {"at_mm": (0.5, 0.4)}), ("a rounded punch", bar, {})):
    touch = sensor.press(thing, depth_mm=0.3, frame=500, **how)
    result = estimator.estimate(touch.frame)
    off = result.height_mm - touch.height_mm
    rms = float(np.sqrt(np.nanmean(off**2)))
    deepest = float(np.nanmax(touch.height_mm))
    print(f"{name}: pressed in by {deepest:.3f} mm, estimated {result.height_mm.max():.3f} mm; over the picture off by "
          f"{1e3 * rms:.0f} um (RMS); to be trusted: {result.trusted}")
    assert result.trusted and rms < 0.25 * deepest, (name, rms, deepest)
