#!/usr/bin/python3
"""Presses a ball on a virtual sensor and prints what its camera sees and what is true.

    press_by_force.py [DEVICE] [-o FOLDER]     DEVICE: a file, or a shipped device's name as gelsight-flat
"""

import argparse
import pathlib

import touchstone as ts

here = pathlib.Path(__file__).parent
parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("device", nargs="?", default=here / "quick-sensor.yaml")
parser.add_argument("-o", "--out", type=pathlib.Path, help="folder for the frames as PNG")
options = parser.parse_args()

sensor = ts.Sensor(options.device)
ball = ts.Object({"name": "ball", "shape": {"type": "sphere", "radius_mm": 2.0}, "friction": 0.5})
print(f"{sensor.name}: pictures of {sensor.picture_shape}, {sensor.mm_per_px:.4f} mm a pixel; light: {sensor.light}")
print(f"{'force z N':>20} {'depth mm':>9} {'contact mm2':>12} {'seen mm2':>9} {'mean change DN':>15}")

background = sensor.background().astype(float)
for force in (0.1, 0.3, 0.6):
    touch = sensor.press(ball, force_N=force, at_mm=(0.3, -0.2))
    depth = sensor.touch_height_mm(ball, at_mm=(0.3, -0.2)) - touch.pose[2, 3]
    seen = touch.contact.sum() * sensor.mm_per_px**2
    change = abs(touch.frame - background).mean()
    print(f"{touch.force_N[2]:9.3f} +- {touch.force_error_N[2]:6.4f} {depth:9.3f} {touch.contact_area_mm2:12.2f} "
          f"{seen:9.2f} {change:15.2f}")
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        ts.write_png(str(options.out / f"press-{force}N.png"), touch.frame)

# Arrays are views of the touch's own memory, and it is kept as long as any of them.
height = touch.height_mm
del touch
print(f"deepest pixel: {height[height == height].max():.3f} mm")
