#!/usr/bin/python3
"""Drives a contact session from a robot's stream of poses: touch, press to a wanted force, drag until it slips, lift.

The robot here is a loop with a lag of one step; with a real simulator, `poses` is what it sends, at its own rate.

    robot_loop.py [DEVICE] [--rate HZ]
"""

import argparse
import pathlib
import time

import numpy as np
import touchstone as ts

here = pathlib.Path(__file__).parent
parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("device", nargs="?", default=here / "quick-sensor.yaml")
parser.add_argument("--rate", type=float, default=100.0, help="of the control loop, Hz")
options = parser.parse_args()

sensor = ts.Sensor(options.device)
ball = ts.Object(here / "quick-ball.yaml")
session = ts.Session(sensor, ball)
dt = 1.0 / options.rate

WANTED_N = 0.3
APPROACH_MM_S, DRAG_MM_S, LIFT_MM_S = 4.0, 2.0, 30.0
COMPLIANCE_MM_N = 0.3  # of the admittance loop

pose = np.eye(4)
pose[2, 3] = sensor.touch_height_mm(ball) + 0.3
phase, slid_at, took = "approach", None, []
while phase != "done":
    begun = time.perf_counter()
    reading = session.step(pose, dt)
    took.append(time.perf_counter() - begun)
    force = reading.force_N[2]
    if phase == "approach":
        pose[2, 3] -= APPROACH_MM_S * dt
        if force > 0.5 * WANTED_N:
            phase = "press"
    elif phase == "press":
        pose[2, 3] -= 0.5 * COMPLIANCE_MM_N * (WANTED_N - force)
        if abs(force - WANTED_N) < 0.01 * WANTED_N:
            phase = "drag"
            pressed = session.look()
    elif phase == "drag":
        pose[0, 3] += DRAG_MM_S * dt
        pose[2, 3] -= 0.2 * COMPLIANCE_MM_N * (WANTED_N - force)
        if reading.contact == "partly_slipping" and slid_at is None:
            slid_at = pose[0, 3]
        if reading.contact == "sliding" or pose[0, 3] > 2.0:
            phase = "lift"
            dragged = session.look()
    elif phase == "lift":
        pose[2, 3] += LIFT_MM_S * dt
        if not reading.touching:
            phase = "done"

steps = session.reading.step
print(f"{steps} steps at {options.rate:g} Hz; a step took {1e3 * np.median(took):.2f} ms in the median, "
      f"{1e3 * max(took):.1f} ms at most, without pictures")
print(f"pressed: {pressed.force_N[2]:.3f} N, {pressed.contact_state}; "
      f"slip began at {slid_at if slid_at is not None else float('nan'):.3f} mm of drag")
ratio = np.hypot(*dragged.force_N[:2]) / dragged.force_N[2]
print(f"dragged: {dragged.contact_state}, shear over normal force {ratio:.3f} (friction {ball.friction})")
print(f"the picture moved by {abs(dragged.frame.astype(int) - pressed.frame).mean():.2f} DN in the mean")
assert dragged.contact_state == "sliding" and abs(ratio - ball.friction) < 0.02

try:
    wrong = pose.copy()
    wrong[:3, :3] *= 1.5
    session.step(wrong, dt)
except ts.Error as error:
    print(f"refused: {error}")
