#!/usr/bin/python3
"""Reads a gel with printed markers: contact, force with its error, turn and slip of each frame.

Your own frames are arrays (height, width, 3) of uint8 in BGR order, as cv2.imread gives them, with what a force sensor said;
here a virtual sensor takes them, so that the truth is known. Three steps: heights are calibrated with a ball on a gel without
markers, forces on some presses and drags, and then frames are read that neither has seen.

    read_touches.py
"""

import copy
import pathlib
import tempfile
import time

import numpy as np
import touchstone as ts
import yaml

here = pathlib.Path(__file__).parent
plain = yaml.safe_load((here / "quick-sensor.yaml").read_text())
plain["camera"].update(width=320, height=240, pixel_pitch_um=5.5, full_well_e=12000)
plain["camera"]["exposure_us"] *= 16  # a pixel is a sixteenth as large
marked = copy.deepcopy(plain)
marked["coating"]["print"] = {"grid": [9, 7], "spacing_mm": [0.55, 0.55], "diameter_mm": 0.2, "colour": 0.04}
flat, sensor = ts.Sensor(plain), ts.Sensor(marked)

# Heights, as in estimate_own_frames.py.
DIAMETER_MM = 4.0
ball = ts.Object({"name": "ball", "shape": {"type": "sphere", "radius_mm": DIAMETER_MM / 2}, "friction": 0.8})
presses = [flat.press(ball, depth_mm=0.4, at_mm=(x, y), frame=10 + k)
           for k, (x, y) in enumerate((x, y) for x in (-0.9, 0.9) for y in (-0.6, 0.6))]
circles = [(*flat.pixel_from_gel(touch.pose[:2, 3]), np.sqrt(touch.contact.sum() / np.pi)) for touch in presses]
heights, _ = ts.calibrate_height([touch.frame for touch in presses], [DIAMETER_MM] * len(presses),
                                 [flat.background(frame=k) for k in range(4)], mm_per_px=flat.mm_per_px, circles=circles)

# Forces: frames whose force is known, read by a reader that knows heights only.
rest = sensor.background()
reader = ts.TouchReader(rest, heights=heights)
readings, forces, series = [], [], []
for one, (x, y) in enumerate(((-0.3, -0.2), (0.3, 0.2), (0.0, 0.1))):
    for depth_mm, shear_mm in ((0.15, (0, 0)), (0.25, (0, 0)), (0.35, (0, 0)), (0.3, (0.08, 0)), (0.3, (0.0, 0.08)),
                               (0.3, (-0.06, 0.06))):
        touch = sensor.press(ball, depth_mm=depth_mm, at_mm=(x, y), shear_mm=shear_mm, frame=100 + len(forces))
        readings.append(reader.read(touch.frame))
        forces.append(touch.force_N)
        series.append(one)
model, report = ts.fit_touch_forces(readings, forces, indenter="ball 4 mm", series=series)
print(f"forces from {report['samples']} frames: off by {np.round(report['rms_error_N'], 3)} N (RMS), on presses left out by "
      f"{np.round(report['left_out_error_N'], 3)} N")

with tempfile.TemporaryDirectory() as folder:  # as a user would keep it
    path = str(pathlib.Path(folder) / "force.json")
    model.save(path)
    model = ts.GelForceModel.load(path)

# Frames that were never seen.
reader = ts.TouchReader(rest, heights=heights, force=model)
print("\n       true N                 read N                 +-")
off = []
for k, (depth_mm, shear_mm) in enumerate(((0.2, (0, 0)), (0.3, (0.05, 0.03)), (0.33, (-0.05, 0.04)))):
    touch = sensor.press(ball, depth_mm=depth_mm, at_mm=(0.15, -0.1), shear_mm=shear_mm, frame=500 + k)
    seen = reader.read(touch.frame)
    off.append(np.abs(seen.force_N - touch.force_N) / seen.force_error_N)
    print("  ", *(f"{value:6.3f}" for value in (*touch.force_N, *seen.force_N, *seen.force_error_N)), seen.slip)
    assert seen.touched and seen.trusted and not seen.extrapolated, k
assert np.median(off) < 2, off

# A contact that turns while it sticks, and one that is dragged until it slides.
session = ts.Session(sensor, ball)
pose = np.eye(3, 4)


def step(depth_mm, x_mm=0.0, turn_deg=0.0):
    angle = np.radians(turn_deg)
    pose[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    pose[:, 3] = x_mm, 0, touching_mm - depth_mm
    state = session.step(pose, dt_s=0.04)
    return state, reader.read(session.look().frame)


touching_mm = presses[0].pose[2, 3] + 0.4  # where the ball just touches
reader.restart(rest)
step(-0.05)
step(0.2)
step(0.35)
print()
for turn_deg in (2, 4, 6):
    state, seen = step(0.35, turn_deg=turn_deg)
    print(f"turned by {turn_deg} deg, {state.contact}: markers turned by {seen.turn_deg:.1f} +- {seen.turn_error_deg:.1f} deg")
session.restart()
reader.restart(rest)
step(-0.05)
step(0.35)
for k in range(1, 13):
    state, seen = step(0.35, x_mm=0.06 * k)
    print(f"dragged by {0.06 * k:.2f} mm, {state.contact:<15} the frames say {seen.slip}")

begin = time.perf_counter()
for k in range(20):
    reader.read(touch.frame)
print(f"\n{20 / (time.perf_counter() - begin):.0f} frames of 320 x 240 a second")
