#!/usr/bin/python3
"""Reads a fingertip that a mouse's chip looks into: force and a stop by its registers, press and force by pictures.

Your own registers are what you read out of the chip at each frame, and your own pictures arrays (18, 18) of uint8; here a
virtual fingertip gives both, so that the truth is known. A plate presses it, and drags its skin.

    read_fingertip.py
"""

import pathlib
import time

import numpy as np
import touchstone as ts
import yaml

device = yaml.safe_load((pathlib.Path(ts.scenes_folder()) / "devices" / "reflex.yaml").read_text())
device["mesh"].update(fine_mm=2, coarse_mm=4.5)  # twice as coarse: set up in seconds
sensor = ts.Sensor(device, deepest_mm=1.6)
plate = ts.Object({"name": "plate", "shape": {"type": "box", "size_mm": [40, 40, 4]}, "friction": 0.5})
over_mm = sensor.touch_height_mm(plate) + 0.3
FIELDS = ("dx", "dy", "squal", "maximum", "minimum", "average")


def press(depth_mm, drag_mm=(0, 0), frame=0):
    """A press from above; without depth the plate stays over the fingertip."""
    if depth_mm > 0:
        return sensor.press(plate, depth_mm=depth_mm, shear_mm=drag_mm, frame=frame)
    return sensor.press(plate, pose=np.column_stack([np.eye(3), (0, 0, over_mm)]), frame=frame)


def registers(touches):
    """Records as the chip gives them."""
    records = np.zeros(len(touches), [(name, "f8" if name == "average" else "i4") for name in FIELDS])
    for record, touch in zip(records, touches):
        for name in FIELDS:
            record[name] = touch.statistics[name]
    return records


# Each recording: at rest, and pressed. Its forces are what a force sensor under the plate says.
at_rest = press(0)
drags = [(0, 0), (0.25, 0), (0, 0.25), (-0.25, 0)]
depths = np.linspace(0.1, 1.5, 18)
begin = time.perf_counter()
known = [press(depth, drags[k % 4], frame=1 + k) for k, depth in enumerate(depths)]
others = [press(depth, drag, frame=100 + k) for k, (depth, drag) in enumerate([(0.45, (0, 0)), (0.85, (0.15, 0.15)), (1.25, (0, -0.2))])]
print(f"a press is simulated in {(time.perf_counter() - begin) / (len(known) + len(others)):.2f} s")

# By the registers.
model, report = ts.calibrate_reflex([registers([at_rest, touch]) for touch in known],
                                    [[at_rest.force_N, touch.force_N] for touch in known])
print(f"a force is present if {model.rule}; on recordings left out in turn it was off by "
      f"{report['left_out']['rms_error_N']:.3f} N")
off = []
for touch in others:
    reader = ts.ReflexReader(model, stop_above_N=0.3)
    for record in registers([at_rest, touch]):  # as they come
        seen = reader.read(record)
    off.append(seen.force_N[2] - touch.force_N[2])
    print(f"  registers: {seen.force_N[2]:.3f} N, true {touch.force_N[2]:.3f} N{', stop' if seen.stop else ''}")
    assert seen.force_present and seen.stop == (seen.force_N[2] > 0.3)
assert max(map(abs, off)) < 3 * report["left_out"]["rms_error_N"] + 0.05, off
records = registers([at_rest, others[0]] * 500)
reader = ts.ReflexReader(model)
begin = time.perf_counter()
for record in records:
    reader.read(record)
print(f"  {len(records) / (time.perf_counter() - begin):.0f} frames a second; the chip gives 1500")

# By pictures of the dots. Presses are known to the motor that makes them.
tracker = ts.ExploreTracker([at_rest.frame, sensor.background()])
readings = [tracker.track(touch.frame) for touch in (at_rest, *known)]
presses, forces = [0, *depths], [at_rest.force_N, *(touch.force_N for touch in known)]
model, report = ts.calibrate_explore(readings, presses, forces,
                                     lateral_mm=[(0, 0)] + [drags[k % 4] for k in range(len(known))])
for touch in others:
    begin = time.perf_counter()
    reading = tracker.track(touch.frame)
    took_s = time.perf_counter() - begin
    seen = model.estimate(reading)
    print(f"  dots: {reading.mode}, {seen.press_mm:.2f} mm, {np.round(seen.force_N, 3)} N, true {np.round(touch.force_N, 3)} N; "
          f"{1e3 * took_s:.1f} ms")
    assert reading.mode == "absolute" and abs(seen.force_N - touch.force_N)[2] < 0.1
