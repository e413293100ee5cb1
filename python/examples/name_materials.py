#!/usr/bin/python3
"""Names what a gripper holds, by an event camera's events of the whole grasp.

Your own grasps are files of events of any kind that `read_events` reads: rest, touch, hold and release, three or more of each
material; here a virtual fingertip records them, 16 of four materials in some three minutes.

    name_materials.py
"""

import os
import pathlib
import shutil
import subprocess
import tempfile
import time

import numpy as np
import touchstone as ts

PROGRAM = os.environ.get("TOUCHSTONE_PROGRAM") or shutil.which("touchstone") or "build/release/apps/touchstone"
CACHE = os.environ.get("TOUCHSTONE_CACHE")
SIZE = (240, 180)

with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    command = [PROGRAM, "--quiet", *(["--cache", CACHE] if CACHE else []), "record", "dvs", "-o", folder / "grasps", "--grasps", "16"]
    subprocess.run(command, check=True)
    rows = [row.split(",") for row in (folder / "grasps" / "files.csv").read_text().splitlines()[1:]]  # events, forces, material
    grasps = [(ts.read_events(folder / "grasps" / events), material) for events, _, material in rows]

others = [grasps.pop(k) for k in (15, 11, 7, 3)]  # the last of each material
model, report = ts.train_event_material([events for events, _ in grasps], [material for _, material in grasps], size=SIZE)
print(f"learnt {', '.join(model.materials)} from {len(grasps)} grasps; of those left out in turn {100 * report['left_out_right']:.0f} % "
      "are named right")

right = 0
begin = time.perf_counter()
for events, material in others:
    share = model.classify(events, size=SIZE)
    named = model.materials[int(np.argmax(share))]
    print(f"  {named} ({100 * share.max():.0f} %); it is {material}")
    right += named == material
print(f"{right} of {len(others)} others are named right; {len(others) / (time.perf_counter() - begin):.0f} grasps a second")
assert right >= 2  # by chance one; [Naeini2020] names 79 % of 48 right, and confuses the soft ones
