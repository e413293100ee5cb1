#!/usr/bin/python3
"""Tells how soft what is pressed is, by its force over time: learns three levels from pieces that are known.

Your own presses are forces, evenly in time, from before the touch on; here lumps of different moduli press a virtual gel, so
that the answer is known. The forces are those of slow presses: what a fast one adds (inertia, relaxing, the motor's shaking) isn't in them.

    tell_softness.py
"""

import pathlib
import tempfile

import numpy as np
import touchstone as ts
import yaml

RATE_HZ, SPEED_MM_S, DEEPEST_MM = 250, 10.0, 1.6
LEVELS = {"soft": (0.03, 0.06), "elastic": (0.2, 0.5), "hard": (3.0, 8.0)}  # moduli in MPa, from and to

device = yaml.safe_load((pathlib.Path(ts.scenes_folder()) / "devices" / "vhs.yaml").read_text())
device["mesh"].update(fine_mm=1, coarse_mm=3)  # twice as coarse
sensor = ts.Sensor(device)
random = np.random.default_rng(7)


def lump(modulus_MPa):
    """A ball of 18 mm, held at its upper half."""
    return ts.Object({"name": f"lump of {modulus_MPa:.3g} MPa", "shape": {"type": "sphere", "radius_mm": 9.0}, "friction": 0.5,
                      "elastic": {"youngs_modulus_MPa": float(modulus_MPa), "poisson_ratio": 0.49, "mesh_mm": 1.5}})


def force_over_time(modulus_MPa):
    """Newtons of a press at a given speed to a given depth, and of holding it; with the noise of a force sensor."""
    depths = np.linspace(0.2, DEEPEST_MM, 6)
    piece = lump(modulus_MPa)
    forces = [sensor.press(piece, depth_mm=depth, look=False).force_N[2] for depth in depths]
    speed = SPEED_MM_S * np.exp(0.03 * random.standard_normal())
    time_s = np.arange(0, 1.0, 1 / RATE_HZ)
    depth_mm = np.clip(speed * (time_s - 0.08), 0, DEEPEST_MM)
    # Force grows as a power of depth between those that were simulated (1.5 for a ball on a half space).
    force = np.exp(np.interp(np.log(np.maximum(depth_mm, 1e-9)), np.log(depths), np.log(forces)))
    below = depth_mm < depths[0]
    force[below] = forces[0] * (depth_mm[below] / depths[0]) ** 1.5
    return force + 0.003 * random.standard_normal(len(force))


def modulus(level):
    low, high = LEVELS[level]
    return low * (high / low) ** random.random()


known = [level for level in LEVELS for _ in range(8)]  # with four of each, five of six others were named right
model, report = ts.calibrate_softness([force_over_time(modulus(level)) for level in known], known, RATE_HZ, networks=3)
print(f"learnt from {len(known)} presses; of presses left out {100 * report['left_out_right']:.0f} % are named right")
with tempfile.TemporaryDirectory() as folder:  # as a user would keep it
    path = pathlib.Path(folder) / "softness.json"
    model.save(path)
    model = ts.SoftnessModel.load(path)

right = 0
for level in LEVELS:
    for _ in range(3):
        one = modulus(level)
        share = model.classify(force_over_time(one))
        named = model.levels[int(np.argmax(share))]
        print(f"  {one:8.3f} MPa: {named} ({100 * share.max():.0f} %); it is {level}")
        right += named == level
print(f"{right} of 9 others are named right")
assert right >= 8
