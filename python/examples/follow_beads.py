#!/usr/bin/python3
"""Reads forces from a gel with beads: trains a stiffness matrix on presses whose forces are known, and reads others.

Your own frames are arrays (height, width) or (height, width, 3) of uint8, in the order of time, with what a force sensor said;
here a virtual sensor takes them, so that the truth is known. It takes about a minute, since each frame is traced.

    follow_beads.py
"""

import pathlib
import tempfile
import time

import numpy as np
import touchstone as ts
import yaml

scenes = pathlib.Path(ts.scenes_folder())
device = yaml.safe_load((scenes / "devices" / "vhs.yaml").read_text())
device["mesh"].update(fine_mm=1, coarse_mm=3)  # twice as coarse, and a quarter of the pixels
device["camera"].update(width=320, height=240, pixel_pitch_um=13.8, active_area_um2=47.6, full_well_e=42000)
sensor = ts.Sensor(device, deepest_mm=1.0)
probe = ts.Object(scenes / "objects" / "probe-6mm.yaml")

# Beads are seen before what is about to press: at rest it stands just over the gel.
over = np.column_stack([np.eye(3), (0, 0, sensor.touch_height_mm(probe) + 0.05)])
at_rest = sensor.press(probe, pose=over).frame
tracker = ts.BeadTracker(grid=3, roi_a_px=111, roi_b_px=34)
rest = tracker.track(at_rest, 0)
assert rest.found == 9


def presses(loads, first_frame):
    """Followed beads and true forces of each load: normal and shear force, N."""
    beads, forces = [], []
    for k, (normal_N, shear_N) in enumerate(loads, first_frame):
        touch = sensor.press(probe, force_N=normal_N, shear_N=shear_N, frame=k)
        beads.append(tracker.track(touch.frame, 20000 * k))
        forces.append(touch.force_N)
    return beads, np.array(forces)


# A load cycle in a few steps: down, and sheared each way under two loads. (With shear under the largest alone normal forces were off
# by 0.35 to 0.4 N: what sideways motion of beads means is learnt from it.)
four_ways = [(np.cos(a), np.sin(a)) for a in np.arange(4) * np.pi / 2]
loads = [(0.5 * k, (0, 0)) for k in range(1, 9)] + [(n, (0.2 * n * x, 0.2 * n * y)) for n in (2, 4) for x, y in four_ways]
beads, forces = presses(loads, 1)
trained = ts.train_stiffness(rest.positions_px, [one.positions_px for one in beads], forces)
print(f"trained on {len(forces)} frames: off by {np.round(trained['rms_error_N'], 3)} N (RMS)")
with tempfile.TemporaryDirectory() as folder:  # as a user would keep it
    path = str(pathlib.Path(folder) / "model.json")
    trained["model"].save(path)
    model = ts.StiffnessForceModel.load(path)

beads, forces = presses([(1.3, (0.1, 0.0)), (2.6, (0.0, -0.3)), (3.4, (0.3, 0.3)), (3.8, (-0.5, 0.2))], 100)
off = []
for one, true in zip(beads, forces):
    seen = model.estimate(one)
    off.append(seen.force_N - true)
    print("  true", np.round(true, 3), "N, read", np.round(seen.force_N, 3), "N")
    assert seen.beads_missing == 0
off = np.sqrt(np.mean(np.square(off), axis=0))
print(f"forces that it wasn't trained on are off by {np.round(off, 3)} N (RMS)")
assert max(off[:2]) < 0.05 and off[2] < 0.3, off  # a square matrix of 9 beads is linear; a gel that swells isn't

begin = time.perf_counter()
for k in range(300):
    tracker.track(at_rest, 10**7 + 1000 * k)
print(f"{300 / (time.perf_counter() - begin):.0f} frames of 320 x 240 a second")
