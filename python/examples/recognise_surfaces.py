#!/usr/bin/python3
"""Names materials by their texture, and finds where on an object's face a touch lies: both from height maps.

Your own height maps are arrays (height, width) of mm, as HeightEstimator and DarknessEstimator make them of frames; here a
virtual sensor takes the frames, so that the truth is known.

    recognise_surfaces.py
"""

import pathlib
import tempfile
import time

import numpy as np
import touchstone as ts
import yaml

here = pathlib.Path(__file__).parent
device = yaml.safe_load((here / "quick-sensor.yaml").read_text())
device["camera"].update(width=240, height=180, pixel_pitch_um=22 / 3, full_well_e=12000)
device["camera"]["exposure_us"] *= 9  # a pixel is a ninth as large
sensor = ts.Sensor(device)

# Heights, as in estimate_own_frames.py. What is touched below runs out of the picture: free borders.
DIAMETER_MM = 4.0
ball = ts.Object({"name": "ball", "shape": {"type": "sphere", "radius_mm": DIAMETER_MM / 2}})
touches = [sensor.press(ball, depth_mm=0.4, at_mm=at) for at in ((-0.9, -0.6), (0.9, -0.6), (-0.9, 0.6), (0.9, 0.6))]
model, _ = ts.calibrate_height([touch.frame for touch in touches], [DIAMETER_MM] * len(touches),
                               [sensor.background(frame=k) for k in range(4)], mm_per_px=sensor.mm_per_px,
                               circles=[(*sensor.pixel_from_gel(touch.pose[:2, 3]), np.sqrt(touch.contact.sum() / np.pi))
                                        for touch in touches])
estimator = ts.HeightEstimator(model, border="free")


def surface(name, relief):
    return ts.Object({"name": name, "shape": {"type": "rounded_cylinder", "radius_mm": 3.5, "edge_radius_mm": 0.5,
                                              "height_mm": 4.0}, "relief": relief})


def heights_of(thing, **how):
    touch = sensor.press(thing, depth_mm=0.25, **how)
    return estimator.estimate(touch.frame).height_mm


# Materials: each is learnt from three pieces of it and named on a fourth, all turned at random.
MATERIALS = {
    "canvas": {"type": "fabric", "weave": "plain", "pitch_mm": [0.62, 0.72], "yarn_mm": [0.6, 0.64],
               "thickness_mm": 0.36, "warp_crimp": 0.55},
    "corduroy": {"type": "fabric", "weave": "corduroy", "pitch_mm": [1.4, 0.5], "yarn_mm": [1.2, 0.4],
                 "thickness_mm": 0.5},
    "sandpaper": {"type": "sandpaper", "grit": 60},
    "leather": {"type": "plastic", "pebble_mm": 0.9, "valley_mm": 0.25, "depth_um": 90},
}
SQUARE = 100  # px: the middle of the picture, where the whole surface touches
rng = np.random.default_rng(1)


def piece(name, seed):
    thing = surface(name, {**MATERIALS[name], "seed": seed})
    heights = heights_of(thing, angles_deg=(0, 0, rng.uniform(0, 360)), frame=seed)
    top, left = (heights.shape[0] - SQUARE) // 2, (heights.shape[1] - SQUARE) // 2
    return heights[top:top + SQUARE, left:left + SQUARE]


textures = ts.TextureModel(mm_per_px=sensor.mm_per_px)
for name in MATERIALS:
    for seed in range(3):
        textures.learn(name, piece(name, seed))
with tempfile.TemporaryDirectory() as folder:  # as a user would keep it
    path = str(pathlib.Path(folder) / "model.texture")
    textures.save(path)
    textures = ts.TextureModel.load(path)
right = 0
for name in MATERIALS:
    unseen = piece(name, 50)
    match = textures.classify(unseen)
    right += match.material == name
    print(f"{name}: named {match.material}, at a distance of {match.distance:.3f}")
assert right >= 3, right
begin = time.perf_counter()
for _ in range(20):
    textures.classify(unseen)
print(f"{20 / (time.perf_counter() - begin):.0f} squares of {SQUARE} x {SQUARE} a second\n")

# Places: a coin is touched a few times where the touches overlap; then once more.
coin = ts.Object({"name": "coin", "shape": {"type": "rounded_cylinder", "radius_mm": 5.5, "edge_radius_mm": 0.2,
                                            "height_mm": 1.75},
                  "relief": {"type": "coin", "diameter_mm": 11, "rim_um": 150, "art_um": 150, "seed": 7}})
tactile_map = ts.TactileMap()


def touch_coin(x_mm, y_mm, turn_deg, frame):
    return heights_of(coin, at_mm=(x_mm, y_mm), angles_deg=(0, 0, turn_deg), frame=frame)


for k, (x_mm, y_mm, turn_deg) in enumerate(((0.0, 0.0, 0.0), (1.0, 0.5, 5.0), (-1.0, 0.3, -6.0))):
    added = tactile_map.add(touch_coin(x_mm, y_mm, turn_deg, 600 + k), mm_per_px=sensor.mm_per_px)
    print(f"touch {k}: {added.outcome}")
print(f"a map of {tactile_map.touches} touches")
heights = touch_coin(0.4, -0.3, 8.0, 700)
begin = time.perf_counter()
found = tactile_map.localise(heights, mm_per_px=sensor.mm_per_px)
took_s = time.perf_counter() - begin
print(f"one more: {found.outcome} in {took_s:.2f} s")
assert found.localised
# The coin lay at (0.4, -0.3) mm, turned by 8 degrees: so the sensor's middle is there on the coin's face.
turn = np.radians(-8.0)
truth = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ (-0.4, 0.3)
off_mm = np.linalg.norm(found.place_mm - truth)
print(f"place {np.round(found.place_mm, 3)} mm, {found.angle_deg:.2f} deg; off by {1e3 * off_mm:.0f} um and "
      f"{abs(found.angle_deg + 8):.2f} deg")
assert off_mm < 0.3 and abs(found.angle_deg + 8) < 3
