#!/usr/bin/python3
"""Looks through a clear gel at what it touches: colours of a printed chart, and marks of skin that fade or stay.

Your own frames are arrays (height, width, 3) of uint8, BGR, linear in light, of one exposure; here a virtual sensor takes
them, so that the truth is known: a vhs with few and large pixels, under light in bands of the spectrum.

    look_at_skin.py
"""

import colorsys
import os
import pathlib
import time

import numpy as np
import touchstone as ts
import yaml

devices = pathlib.Path(ts.scenes_folder()) / "devices"
device = yaml.safe_load((devices / "vhs-spectral.yaml").read_text())
os.chdir(devices)  # files that a dict names, here spectra, are relative to the working folder
LARGER = 8  # pixels, than the sensor's
device["camera"].update(width=80, height=60, pixel_pitch_um=6.9 * LARGER, active_area_um2=11.9 * LARGER**2,
                        full_well_e=10500 * LARGER**2, exposure_us=300)
device["mesh"] = {"fine_mm": 1.0, "coarse_mm": 3, "fine_half_extent_mm": [4.75, 4.75], "fine_depth_mm": 1.5}
sensor = ts.Sensor(device)


def card(name, *prints):
    return ts.Object({"name": name, "shape": {"type": "box", "size_mm": [30, 30, 1]}, "albedo": 0.85, "friction": 0.3,
                      "print": list(prints)})


def lab(srgb):
    """CIE L*a*b* under D65 of an sRGB colour, 0 to 1."""
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055)**2.4)
    xyz = np.array([[0.4123908, 0.3575843, 0.1804808], [0.212639, 0.7151687, 0.0721923],
                    [0.0193308, 0.1191948, 0.9505322]]) @ linear / [0.95047, 1, 1.08883]
    f = np.cbrt(xyz)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


# Colours. A chart of ten hues: five of them are known, the others are read.
white = sensor.press(card("white card"), depth_mm=0.05).frame
chart = sensor.press(card("chart", {"type": "hue_circle", "patches": 10, "radius_mm": 4, "diameter_mm": 2,
                                    "saturation": 0.6, "lightness": 0.5}), depth_mm=0.05).frame
rows, columns = np.mgrid[:60, :80] + 0.5
px_per_mm = np.linalg.norm(np.subtract(sensor.pixel_from_gel((1, 0)), sensor.pixel_from_gel((0, 0))))
patches = []
for k in range(10):
    x, y = sensor.pixel_from_gel((4 * np.cos(0.2 * np.pi * k), 4 * np.sin(0.2 * np.pi * k)))
    inside = np.hypot(columns - x, rows - y) < 0.6 * px_per_mm  # of 1 mm: the pinhole blurs the rim
    patches.append((chart, inside, lab(np.array(colorsys.hls_to_rgb(k / 10, 0.5, 0.6)))))
model, report = ts.calibrate_colour([white], patches[::2], smooth_px=1)
print(f"colours of five known patches are off by {report['mean_error_de2000']:.1f} CIEDE2000 in the mean")
off = []
for frame, inside, true in patches[1::2]:
    seen = model.lab(frame, inside)
    off.append(np.linalg.norm(seen - true))
    print(f"  L*a*b* {np.round(seen, 1)}, true {np.round(true, 1)}")
print(f"the others are off by {np.mean(off):.1f} in L*a*b*")
assert np.mean(off) < 10, off

# Marks: those that pressure takes the blood from are erythema, the others purpura.
skin = ts.Object("skin")
before, pressed = (sensor.press(skin, **how).frame for how in ({"depth_mm": 0.02}, {"force_N": 5}))
begin = time.perf_counter()
marks = ts.skin_marks(before, pressed, smooth_px=4 / LARGER, least_area_px=60, rim_px=8 / LARGER, ring_px=16 / LARGER,
                      bead_px=44 / LARGER)
print(f"{len(marks)} marks in {1e3 * (time.perf_counter() - begin):.1f} ms")
kinds = {}
for mark in marks:
    x, y = (mark.centre_px - (40, 30)) / px_per_mm
    print(f"  {mark.kind} at ({x:.1f}, {y:.1f}) mm: {100 * mark.blanched:.0f} % of its redness is gone under 5 N")
    kinds[round(x)] = mark.kind
assert kinds == {-4: "erythema", 4: "purpura"}, kinds  # as scenes/objects/skin.yaml has them
