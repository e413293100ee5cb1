#!/usr/bin/python3
"""Looks through a clear gel at what it touches: colours of a printed chart, and marks of skin that fade or stay.

Your own frames are arrays (height, width, 3) of uint8, BGR, linear in light, of one exposure; here a virtual sensor takes
them, so that the truth is known: a vhs of 160 x 120 pixels with light in bands of the spectrum.

    look_at_skin.py
"""

import colorsys
import pathlib
import time

import numpy as np
import touchstone as ts
import yaml

devices = pathlib.Path(ts.scenes_folder()) / "devices"
device = yaml.safe_load((devices / "vhs-spectral.yaml").read_text())
for lamp in device["lamps"]:
    lamp["spectrum"] = str(devices / lamp["spectrum"])  # in a dict, of the working folder
SCALE = 4  # pixels are that much larger than the sensor's
camera = device["camera"]
camera.update(width=160, height=120, pixel_pitch_um=6.9 * SCALE, active_area_um2=11.9 * SCALE**2,
              full_well_e=10500 * SCALE**2, exposure_us=300)
sensor = ts.Sensor(device)


def card(name, *prints):
    return ts.Object({"name": name, "shape": {"type": "box", "size_mm": [30, 30, 1]}, "albedo": 0.85, "friction": 0.3,
                      "print": list(prints)})


def frame_of(thing, **how):
    begin = time.perf_counter()
    frame = sensor.press(thing, **how).frame
    print(f"  {thing.name}: a frame in {time.perf_counter() - begin:.1f} s, up to {frame.max()}")
    return frame


frame_of(card("white card"), depth_mm=0.05)
