#!/usr/bin/python3
"""Reads the force of a grasp from an event camera's events as they come.

Your own grasps are files of events of any kind that `read_events` reads, each with what a force sensor said, in a table
(docs/file-formats.md, "Force and material from event files"); here a virtual fingertip records them, so that the truth is
known. The model is learnt of all but one of them, as the command `touchstone calibrate event-force` does it.

    read_grasps.py
"""

import csv
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


def run(*words):
    subprocess.run([PROGRAM, "--quiet", *(["--cache", CACHE] if CACHE else []), *map(str, words)], check=True)


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    run("record", "dvs", "-o", folder / "grasps", "--grasps", 8)
    rows = (folder / "grasps" / "files.csv").read_text().splitlines()  # events, forces, material; the last grasp is kept
    grasps = [ts.read_events(folder / "grasps" / row.split(",")[0]) for row in rows[1:-1]]
    tables = [np.loadtxt(folder / "grasps" / row.split(",")[1], delimiter=",", skiprows=1) for row in rows[1:-1]]
    model, _ = ts.train_event_force(grasps, [(table[:, 0].astype(int), table[:, 1]) for table in tables], size=(240, 180))
    print(f"a {model.method}; on grasps left out it was off by {model.left_out_error_N:.3f} N (RMS)")

    events = ts.read_events(folder / "grasps" / "grasp-07.h5")
    with open(folder / "grasps" / "grasp-07.csv") as file:
        truth = {int(row["end_ms"]): float(row["true_N"]) for row in csv.DictReader(file)}

reader = ts.EventForceReader(model, size=(240, 180))
begin = time.perf_counter()
for some in np.array_split(events, 200):  # as a camera delivers them
    reader.add(some)
took_s = time.perf_counter() - begin
assert reader.touched.any() and not reader.touched[:20].any()

first = int(np.argmax(reader.touched))
print(f"first touch in the window that ends at {reader.t_us[first] / 1e3:.0f} ms\n\n  ms    read N     +-   true N")
off = []
for k in range(first, min(first + 22, len(reader.t_us)), 3):
    true_N = truth[int(round(reader.t_us[k] / 7e3)) * 7]
    off.append(reader.force_N[k] - true_N)
    print(f"{reader.t_us[k] / 1e3:6.0f} {reader.force_N[k]:7.3f} {reader.force_error_N[k]:7.3f} {true_N:8.3f}")
rms_N = float(np.sqrt(np.mean(np.square(off))))
print(f"\noff by {rms_N:.3f} N (RMS) while it was grasped; {len(reader.t_us) / took_s:.0f} windows, "
      f"{len(events) / took_s:.0f} events a second")
assert rms_N < 3 * model.left_out_error_N, rms_N
