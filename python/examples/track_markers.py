#!/usr/bin/python3
"""Follows printed markers through a press and a drag: how far each has moved, and which of them to believe.

Your own frames are arrays (height, width) or (height, width, 3) of uint8, as cv2.imread gives them; here a virtual sensor
with dots in no order takes them, so that the truth is known. The tracker knows nothing of it: how dots look and where
they lie is read from the frame at rest.

    track_markers.py
"""

import pathlib

import numpy as np
import touchstone as ts
import yaml

here = pathlib.Path(__file__).parent
device = yaml.safe_load((here / "quick-sensor.yaml").read_text())
device["coating"]["print"] = {"pattern": "scattered", "spacing_mm": 0.9, "diameter_mm": 0.35, "radius_mm": 3.0,
                              "seed": 4, "colour": 0.04}
device["camera"].update(width=320, height=240, pixel_pitch_um=5.5, full_well_e=12000)
device["camera"]["exposure_us"] *= 16  # a pixel is a sixteenth as large
sensor = ts.Sensor(device)
ball = ts.Object(here / "quick-ball.yaml")

tracker = ts.MarkerTracker(sensor.background())
print(f"{len(tracker.rest_px)} {tracker.polarity} markers, {tracker.diameter_px:.1f} px wide, "
      f"{tracker.spacing_px:.1f} px apart")

# What a user has: frames in the order of time. Here the ball goes in, and is dragged then.
steps = [(0.15, 0.0), (0.3, 0.0), (0.3, 0.1), (0.3, 0.2), (0.3, 0.3)]
for k, (depth_mm, drag_mm) in enumerate(steps):
    touch = sensor.press(ball, depth_mm=depth_mm, shear_mm=(drag_mm, 0.5 * drag_mm), frame=k)
    seen = tracker.track(touch.frame, t_us=40000 * (k + 1))
    moved = seen.displacement_px[seen.trusted]  # (markers, 2), x to the right, y down
    print(f"{depth_mm:.2f} mm deep, dragged by {drag_mm:.1f} mm: {seen.trusted.sum()} of {len(seen.trusted)} markers are "
          f"trusted; they moved by up to {np.linalg.norm(moved, axis=1).max():.2f} px")

# The truth, which only a virtual sensor has. Its map of pixels is that of the flat gel: along the view it errs a little.
rest = np.array([sensor.pixel_from_gel(place[:2]) for place in touch.markers_mm])
now = np.array([sensor.pixel_from_gel(place[:2]) for place in touch.markers_mm + touch.marker_displacement_mm])
distance = np.linalg.norm(rest[:, None] - tracker.rest_px[None], axis=2)
pairs = [(truth, int(distance[truth].argmin())) for truth in range(len(rest)) if distance[truth].min() < 2]
off = np.array([(now - rest)[truth] - seen.displacement_px[mark] for truth, mark in pairs if seen.trusted[mark]])
rms = float(np.sqrt((off**2).sum(axis=1).mean()))
print(f"beside the truth of {len(off)} markers the last frame's displacements are off by {rms:.2f} px (RMS)")
assert len(pairs) == len(tracker.rest_px) and len(off) > 0.9 * len(pairs) and rms < 1.0, (len(pairs), len(off), rms)
