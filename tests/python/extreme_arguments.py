"""The whole public API, an argument at a time given extreme values: what test_extreme_arguments.py runs, in children.

    python3 extreme_arguments.py NAME FOLDER SHARED [FIRST]

makes all calls of one public name, from number FIRST on, and writes a line of JSON before each and after each. A call
may succeed or raise what its entry allows; whether it ends at all is for the parent to see. In FOLDER it may write what
it likes; data sets are made once in SHARED.
"""

import hashlib
import inspect
import itertools
import json
import math
import os
import pathlib
import resource
import sys
import types
import warnings

import numpy as np

import touchstone as ts
from touchstone import testing

HERE = pathlib.Path(__file__).resolve().parent
EXAMPLES = HERE.parents[1] / "python" / "examples"
MEMORY_BYTES = 8 << 30  # of address space: what wants more by its argument gets a MemoryError, which fails

# Public names that are not called, and why.
NOT_CALLED = {
    "testing.VirtualDevice": "made by the fixture virtual_device alone; its methods are called",
    "testing.virtual_device": "a fixture of pytest; tests/python/test_testing.py uses it",
}


# ---- extreme values ---------------------------------------------------------------------------------------------

NAN, INF = float("nan"), float("inf")
STRANGE = [None, "x", b"x", [], (), {}, object(), 1 + 2j]


def numbers(valid):
    """In place of a float or an int."""
    return [0, -0.0, -1, 1, 0.5, NAN, INF, -INF, 1e300, -1e300, 1e-300, 1e9, 1e-9, 2**31 - 1, 2**31, -2**31 - 1, 2**32,
            2**63, 2**64, 10**400, True, np.float64(0.5), np.int64(3), np.array(1.0), np.array([1.0, 2.0]), "1",
            *STRANGE]


def texts(valid):
    return ["", " ", "x", "\0", f"{valid}\0", "\ud800", "\U0001f600", "é" * 300, "x" * 5000, "%s{}{0}\n\"'\\",
            valid.upper(), valid + " ", 0, NAN, *STRANGE]


def paths(valid):
    """Only of the child's own folder: some are written to."""
    return ["", " ", "x", "x.png", "\0", f"{valid}\0", f"{valid}\0x", "\ud800", "\U0001f600", "x" * 5000, "x" * 300,
            "missing/x", "folder", "folder/", f"{valid}/x", "~", "%s{}", pathlib.Path("x"), b"x\xff", 0, NAN, *STRANGE]


def bad_paths(valid):
    """Where a new folder would take its time."""
    return ["", "\0", f"{valid}\0", "\ud800", "x" * 5000, "x" * 300, "folder/../../x" * 400, f"{valid}/dataset.json/x",
            b"x\xff" * 999, 0, NAN, *(value for value in STRANGE if value not in ("x", b"x"))]


def arrays(valid):
    """In place of an array of numbers."""
    valid = np.asarray(valid, float)
    wide = np.zeros((2 * valid.shape[0], *valid.shape[1:]))
    wide[::2] = valid
    values = [valid.tolist(), wide[::2], valid[::-1], valid.astype(np.float32), valid.astype(int), valid.astype(">f8"),
              valid.astype(object), valid.astype(str), valid + 0j, np.zeros_like(valid), valid[:0], valid[:-1],
              np.concatenate([valid, valid]), valid[None], valid[..., None], valid.ravel(), 0.0, [[]], [[1, 2], [3]],
              [10**400] * valid.size, [NAN], np.zeros(0), np.zeros((0, 2)), np.zeros((0, 3)),
              np.broadcast_to(0.0, (2**31, 2**20)), np.broadcast_to(0.0, (2**31, *valid.shape[1:])),
              np.datetime64("2020-01-01"), np.full(valid.shape, None)]
    for number in (NAN, INF, -INF, 1e300, -1e300, 1e150, 1e-300, 1e-150, 1e9, 1e6, -1.0, 2.0**31, 2.0**63):
        values.append(np.full_like(valid, number))
        one = valid.copy()
        one.flat[-1] = number
        values.append(one)
    return values + STRANGE


def poses(valid):
    """In place of a pose: its translation is changed, too, which leaves the rotation one."""
    values = arrays(valid)
    for number in (0, -1, 0.01, 10, -10, 900, 1e4, -1e4, 1e5, 1e6, 2.0**31, 2.0**32, 1e9, 1e20, 1e150, 1e160, 1e300,
                   -1e300, 1e308, 1e-300):
        for axis in range(3):
            values.append(valid.copy())
            values[-1][axis, 3] = number
            values.append(values[-1][:3])
    return [*values, -valid, valid[:, [1, 0, 2, 3]], valid * (1 + 1e-7)]


def pictures(valid):
    """In place of a picture."""
    noise = np.random.default_rng(1).integers(0, 256, valid.shape).astype(np.uint8)
    wide = np.zeros((2 * valid.shape[0], *valid.shape[1:]), valid.dtype)
    wide[::2] = valid
    values = [wide[::2], valid[::-1], valid[:, ::-1], valid.T, np.asfortranarray(valid), np.zeros_like(valid),
              np.full_like(valid, 255), np.full_like(valid, 128), noise, valid[:-1], valid[:, :-1], valid[:1],
              valid[:, :1], valid[:1, :1], valid[:0], valid.ravel(), valid[None], valid[..., None],
              valid.astype(np.uint16), (valid.astype(np.uint16) << 8), valid.astype(">u2"), valid.astype(np.int8),
              valid.astype(np.int32), valid.astype(float), valid > 99, valid.astype(object), valid.astype(str),
              valid.tolist(), np.zeros((), np.uint8), np.zeros((7, 1), np.uint8), np.zeros((1, 7, 3), np.uint8),
              np.zeros((5, 7, 4), np.uint8), np.zeros((5, 7, 3, 1), np.uint8), np.zeros((1, 100000, 3), np.uint8),
              np.zeros((100000, 9, 3), np.uint8), np.broadcast_to(np.uint8(7), valid.shape),
              np.broadcast_to(np.uint8(7), (2**31, 2**31)), np.broadcast_to(np.uint8(7), (2**31, 2**29, 3)),
              np.broadcast_to(np.uint8(7), (2**31, 1)), np.broadcast_to(np.uint8(7), (1, 2**32, 3)), 0, NAN]
    if valid.ndim == 3:
        values += [valid[..., 0], valid[..., :1], valid[..., ::-1], np.moveaxis(valid, 2, 0)]
    else:
        values += [np.stack([valid] * 3, 2)]
    return values + STRANGE


def lists_of(values_of):
    """In place of a list: lists of extreme items, and what is no list."""
    def values(valid):
        some = list(valid)
        changed = [[*some[:-1], item] for item in values_of(some[-1])]
        return [tuple(some), [], some[:-1], some + some[-1:], some[:1], iter(some), dict(enumerate(some)), 0, NAN,
                [None], [[]], *changed, *STRANGE]
    return values


def only(*values):
    return lambda valid: list(values)


def flags(valid):
    return [True, False, 0, 1, 2, "yes", None, [], np.bool_(True), np.array([True, False])]


def callbacks(valid):
    def raises(*_):
        raise KeyError("from progress")
    return [None, 0, "x", [], raises, lambda: None, lambda stage, done, total: None]


def leaves(value, way=()):
    yield way, value
    if isinstance(value, dict):
        for key in value:
            yield from leaves(value[key], (*way, key))
    elif isinstance(value, list):
        for i, item in enumerate(value):
            yield from leaves(item, (*way, i))


def with_leaf(value, way, leaf):
    if not way:
        return leaf
    copy = dict(value) if isinstance(value, dict) else list(value)
    copy[way[0]] = with_leaf(copy[way[0]], way[1:], leaf)
    return copy


class ChangedDict(dict):
    """A dict that knows where it was changed."""

    def __init__(self, valid, way, leaf):
        super().__init__(with_leaf(valid, way, leaf))
        self.change = f"{'.'.join(str(step) for step in way)} = {leaf!r}"


def changed_fields(valid, among=None):
    """The dict with each field in turn changed; `among`: only fields below these."""
    values = []
    for way, leaf in leaves(valid):
        if not way or among and way[0] not in among:
            continue
        number = isinstance(leaf, (int, float)) and not isinstance(leaf, bool)
        others = [0, -1, 1e300, 1e-300, NAN, 2**63, "x", None, []] if number else [None, 0, "x", [], {}]
        values += [ChangedDict(valid, way, other) for other in others]
    return values


def descriptions(valid):
    """In place of a dict of a file's fields."""
    deep = {}
    for _ in range(100000):
        deep = {"a": deep}
    less_deep = {}
    for _ in range(300):
        less_deep = {"a": less_deep}
    ring = {"name": "ring"}
    ring["shape"] = ring
    values = [{}, deep, less_deep, ring, {"name": "\ud800"}, {1: 2}, {(1, 2): 3}, {None: None},
              {**valid, "x" * 5000: 1},
              {**valid, "name": "\U0001f600 \0 \x85 '%{}"}, {**valid, "name": np.float64(1)}, {"name": object()}]
    return values + changed_fields(valid)


def described(valid):
    return [*descriptions(valid), *paths("gelsight-flat")]


# ---- what calls need --------------------------------------------------------------------------------------------

BALL = {"name": "ball", "shape": {"type": "sphere", "radius_mm": 1.5}, "friction": 0.6}
BARE = {"name": "bare", "gel": {"size_x_mm": 6, "size_y_mm": 6, "thickness_mm": 3, "youngs_modulus_MPa": 0.3,
                                "refractive_index": 1.4}, "plate": {"thickness_mm": 1, "refractive_index": 1.5},
        "mesh": {"fine_mm": 1.5, "coarse_mm": 3, "fine_half_extent_mm": [2, 2], "fine_depth_mm": 1}}
QUICK = {"name": "quick", "gel": {"size_x_mm": 12, "size_y_mm": 12, "thickness_mm": 3, "youngs_modulus_MPa": 0.5,
                                  "poisson_ratio": 0.49, "refractive_index": 1.41},
         "mesh": {"fine_mm": 0.5, "coarse_mm": 2, "fine_half_extent_mm": [3, 2.5], "fine_depth_mm": 1},
         "plate": {"thickness_mm": 3, "refractive_index": 1.49}, "coating": {"type": "matt", "albedo": 0.4},
         "lamps": [{"type": "led", "position_mm": [-8, -7, -5.8], "target_mm": [0, 0, 0], "viewing_angle_deg": 120,
                    "power_W": [0.02, 0.02, 0.02]}],
         "camera": {"type": "lens", "width": 80, "height": 60, "pixel_pitch_um": 22, "focal_length_mm": 3,
                    "f_number": 4, "focus_distance_mm": 17, "lens_position_mm": [0, 0, -19], "look_at_mm": [0, 0, 0],
                    "exposure_us": 55, "full_well_e": 12000,
                    "read_noise_e": 8, "bayer": "rggb"}}  # quick-sensor.yaml with one lamp
SHAPES = [
    {"type": "sphere", "radius_mm": 2},
    {"type": "rounded_cylinder", "radius_mm": 2, "height_mm": 5, "edge_radius_mm": 1},
    {"type": "box", "size_mm": [2, 2, 2]}, {"type": "egg", "radius_mm": 2, "blunt_mm": 2, "sharp_mm": 3},
    {"type": "shell", "axes_mm": [2, 2], "thickness_mm": 0.5, "curvature_per_mm": [0.01, 0.02]},
    {"type": "hexagon", "across_flats_mm": 2, "length_mm": 4}, {"type": "mesh", "file": "x.glb"}]
REST = np.array([(160 + 60 * i, 120 + 60 * j) for j in (-1, 0, 1) for i in (-1, 0, 1)], float)
JOB = """
name: one-press
seed: 7
scenes:
  - {{name: one, scene: {examples}/quick-scene.yaml, start_mm: [-1.6, -0.8, 1.55], split: train}}
"""
DRAW = """
name: two-touches
licence: CC0-1.0
seed: 5
samples: 2
samples_per_file: 1
membrane_um: 200
draw:
  device: {examples}/quick-sensor.yaml
  units: {{count: 1, vary: [{{path: 'lamps[*].power_W', times: {{uniform: [0.7, 1.3]}}}}]}}
  objects:
    - file: {examples}/quick-ball.yaml
  place_mm: {{x: {{uniform: [-1, 1]}}, y: {{uniform: [-1, 1]}}}}
  force_N: {{log_uniform: [0.1, 0.5]}}
outputs: [frame]
splits: {{train: 1.0, by: unit}}
"""


def beads_picture(places=REST, size=(240, 320), radius=8.0):
    rows, columns = np.mgrid[:size[0], :size[1]] + 0.5
    cover = np.zeros(size)
    for x, y in places:
        cover = np.maximum(cover, np.clip(radius + 0.5 - np.hypot(columns - x, rows - y), 0, 1))
    return np.round(200 - 150 * cover).astype(np.uint8)


def dots_picture():
    return beads_picture([(60 + 25 * i, 40 + 25 * j) for j in range(6) for i in range(8)], radius=5.0)


def touched_dots(shift):
    """The dots moved, and a brighter disc in their middle."""
    rows, columns = np.mgrid[:240, :320]
    disc = 1 + 0.4 * (np.hypot(columns - 150, rows - 105) < 60)
    places = [(60 + shift[0] + 25 * i, 40 + shift[1] + 25 * j) for j in range(6) for i in range(8)]
    return np.minimum(beads_picture(places, radius=5.0) * disc, 255).astype(np.uint8)


def sealed(name, model):
    pathlib.Path(name).write_text(json.dumps(with_checksum(model)))
    return name


def with_checksum(model):
    """Of a model's text without blanks, names in order."""
    text = json.dumps(model, sort_keys=True, separators=(",", ":"))
    return {**model, "sha256": hashlib.sha256(text.encode()).hexdigest()}


def records(valid):
    """In place of events."""
    values = [valid[::-1], valid[:0], valid[:1], valid[None], valid.tolist(), valid["t_us"], 0, NAN, *STRANGE]
    for field, kinds in (("t_us", ("f8", "u8", "U5", "O", "i4")), ("x", ("i8", "f4", "O")), ("on", ("u1", "f8", "O"))):
        for kind in kinds:
            names = [(name, kind if name == field else valid.dtype[name]) for name in valid.dtype.names]
            values.append(valid.astype(names))
        values.append(valid[[name for name in valid.dtype.names if name != field]])
    for t_us in (-2**63, 2**63 - 1, -1, 2**40):
        changed = valid.copy()
        changed["t_us"][-1] = t_us
        values += [changed, changed[-1:]]
    far = valid.copy()
    far["x"][3] = 60000
    return [*values, far]


def sizes(valid):
    return [(0, 1), (-1, 4), (1, 1), (8192, 8192), (8193, 1), (2**40, 2), (1.5, 2), (240,), (1, 2, 3), "ab", 7, NAN, *STRANGE]


def rough_heights(size=(60, 80)):
    return np.random.default_rng(2).normal(0, 0.02, size)


def markers_picture(shift=(0.0, 0.0), side=16.0, spacing=40.0, grid=4):
    """As test_estimators.py has it."""
    size = int(spacing * (grid + 1.5))
    rows, columns = np.mgrid[:size, :size] + 0.5

    def square(x, y, width):
        along = [np.clip(width / 2 + 0.5 - abs(at - c), 0, 1) for at, c in ((columns, x), (rows, y))]
        return along[0] * along[1]

    white = np.full((size, size, 3), 220.0)
    for j in range(grid):
        for i in range(grid):
            x, y = spacing * (i + 1.25), spacing * (j + 1.25)
            white[..., 1] *= 1 - 0.85 * square(x + shift[0] + 4, y + shift[1] + 4, side)
            white[..., 0] *= 1 - 0.85 * square(x, y, 20.0)
    return np.round(white).astype(np.uint8)


def chip_picture(shift=(0.0, 0.0), growth=1.0):
    """Dots as a motion chip sees them."""
    rows, columns = np.mgrid[:18, :18] - 8.5
    picture = np.full((18, 18), 6.0)
    for x, y in [(4.3 * i + 0.5 * (j % 2), 4.3 * j - 0.3 * (i % 2)) for i in range(-3, 4) for j in range(-3, 4)]:
        away = np.hypot(columns - growth * x - shift[0], rows - growth * y - shift[1])
        picture = np.maximum(picture, 6 + 30 * np.clip(growth * 1.1 + 0.5 - away, 0, 1))
    return np.round(picture).astype(np.uint8)


def skin_picture(colour):
    return np.broadcast_to(np.array(colour, np.uint8), (60, 80, 3)).copy()


def statistics(valid):
    """In place of a chip's statistics."""
    values = [np.zeros(1, [(name, "i4") for name in valid])[0], np.zeros(3), [], [1, 2], valid["dx"], *STRANGE]
    for name in valid:
        values.append({key: value for key, value in valid.items() if key != name})
        values += [{**valid, name: value} for value in numbers(0)]
    return values


def chip_records(valid):
    """In place of one recording, and in place of one of several."""
    one = valid[0]
    changed = [one[:0], one[:1], one[None], one.tolist(), one["dx"], 0, NAN, *STRANGE]
    for name in one.dtype.names:
        changed.append(one[[other for other in one.dtype.names if other != name]])
        for kind in ("i8", "f8", "U5", "O", "u1"):
            changed.append(one.astype([(other, kind if other == name else one.dtype[other]) for other in one.dtype.names]))
        for number in (-2**31, 2**31 - 1, 255, 0):
            other = one.copy()
            other[name][50:] = number
            changed.append(other)
    return [[], valid[:1], valid * 3, valid[0], 0, *STRANGE, *([valid[0], other] for other in changed)]


def regions(valid):
    return [(0, 0, 0, 0), (-1, 0, 5, 5), (79, 59, 1, 1), (80, 0, 1, 1), (0, 0, 2**31 - 1, 1), (2**40, 0, 1, 1), (1.5, 0, 5, 5),
            (1, 2, 3), np.ones((60, 80), bool), np.zeros((60, 80), bool), np.ones((60, 80), float), np.ones((60, 80), int),
            np.ones((59, 80), bool), np.ones((60, 80, 1), bool), np.broadcast_to(True, (2**31, 2**20)),
            np.broadcast_to(np.int64(1), 2**40), "abcd", 7, NAN, *STRANGE]


def patch_lists(valid):
    frame, region, lab = valid[0]
    changed = [(frame, region), (frame, region, lab, 1), 0, *STRANGE]
    changed += [(frame, one, lab) for one in regions(region)]
    changed += [(one, region, lab) for one in pictures(frame)]
    changed += [(frame, region, one) for one in arrays(lab)]
    return [[], valid[:2], valid * 2, valid[0], 0, *STRANGE, *([one, *valid[1:]] for one in changed)]


def darkness_pictures():
    """As test_estimators.py has them: at rest, and with a ball of radius 2 mm pressed 0.8 mm deep, 0.05 mm a pixel."""
    rows, columns = 0.05 * (np.mgrid[:90, :120] + 0.5)
    cap = 0.8 - 2.0 + np.sqrt(np.maximum(0.0, 4.0 - (columns - 3.0)**2 - (rows - 2.2)**2))
    pressed = 160.0 * (1.0 - 0.2 * np.maximum(cap, 0.0))
    return [np.repeat(np.round(grey).astype(np.uint8)[..., None], 3, axis=2)
            for grey in (np.full_like(pressed, 160.0), pressed)]


class Things:
    """What is made once a child, when it's first asked for; data sets once for all of them, in the folder `shared`."""

    def __init__(self, folder, shared="."):
        self.folder, self.shared = pathlib.Path(folder), pathlib.Path(shared).resolve()

    def __getattr__(self, name):
        value = getattr(type(self), "make_" + name)(self)
        setattr(self, name, value)
        return value

    def make_sensor(self):
        return ts.Sensor(EXAMPLES / "quick-sensor.yaml")

    def make_bare(self):
        return ts.Sensor(BARE)

    def make_ball(self):
        return ts.Object(BALL)

    def make_pose(self):
        pose = np.eye(4)
        pose[2, 3] = self.sensor.touch_height_mm(self.ball) - 0.2
        return pose

    def session(self, pressed=True):
        """Another one each time."""
        session = ts.Session(self.sensor, self.ball)
        if pressed:
            session.step(self.pose, 0.01)
        return session

    def make_backgrounds(self):
        return [self.sensor.background(frame=k) for k in range(2)]

    def make_touch(self):
        return self.sensor.press(self.ball, depth_mm=0.4)

    def make_circle(self):
        return (*self.sensor.pixel_from_gel((0, 0)), np.sqrt(self.touch.contact.sum() / np.pi))

    def make_heights(self):
        """Frames, diameters, backgrounds, settings."""
        return (([self.touch.frame], [3.0], self.backgrounds),
                {"mm_per_px": self.sensor.mm_per_px, "circles": [self.circle]})

    def make_darkness(self):
        """Frames, diameters, frames at rest, settings."""
        rest, pressed = darkness_pictures()
        return ([pressed], [4.0], [rest]), {"mm_per_px": 0.05, "circles": [(60.0, 44.0, 32.0)]}

    def make_darkness_model(self):
        return ts.calibrate_darkness(*self.darkness[0], **self.darkness[1])[0]

    def make_darkness_file(self):
        self.darkness_model.save("darkness.model")
        return "darkness.model"

    def make_height_model(self):
        return ts.calibrate_height(*self.heights[0], **self.heights[1])[0]

    def make_height_file(self):
        self.height_model.save("height.model")
        return "height.model"

    def tracker(self):
        tracker = ts.BeadTracker(roi_a_px=200)
        tracker.track(beads_picture(), 0)
        return tracker

    def make_beads(self):
        return ts.BeadTracker(roi_a_px=200).track(beads_picture(), 0)

    def make_training(self):
        positions = [REST + (k, 0.5 * k) + 0.01 * k * (REST - REST.mean(axis=0)) for k in range(6)]
        return REST, positions, np.array([(k, 0.5 * k, 2 * k) for k in range(6)], float)

    def make_stiffness(self):
        return ts.train_stiffness(*self.training)["model"]

    def make_stiffness_file(self):
        self.stiffness.save("stiffness.model")
        return "stiffness.model"

    def make_readings(self):
        reader = ts.TouchReader(dots_picture(), mm_per_px=0.05)
        return [reader.read(touched_dots(shift)) for shift in ((1, 0), (0, 1), (2, 2), (-2, 1))]

    def make_gel_force(self):
        return ts.fit_touch_forces(self.readings, [(-1, 0, 1), (0, -1, 1), (-2, -2, 1), (2, -1, 1)])[0]

    def make_gel_force_file(self):
        self.gel_force.save("gel.model")
        return "gel.model"

    def textures(self):
        model = ts.TextureModel(mm_per_px=0.05)
        model.learn("sand", rough_heights())
        return model

    def make_texture_file(self):
        self.textures().save("texture.model")
        return "texture.model"

    def tactile_map(self):
        made = ts.TactileMap()
        made.add(rough_heights(), mm_per_px=0.05)
        return made

    def make_tactile_file(self):
        self.tactile_map().save("tactile.map")
        return "tactile.map"

    def make_events(self):
        events = np.zeros(400, [("t_us", "i8"), ("x", "u2"), ("y", "u2"), ("on", "?")])
        events["t_us"] = np.arange(400) * 1000
        return events

    def make_event_force_file(self):
        weights = [{"weights": [[0.5] * 2], "biases": [0.0]}, {"weights": [[1.0]], "biases": [0.0]}]
        return sealed("event-force.json", {
            "format": "touchstone.grasp_force_model", "version": 1, "error": {"left_out_N": 0.5, "absolute_N": 0.1, "relative": 0.2},
            "estimator": with_checksum({
                "format": "touchstone.time_delay_network", "version": 1, "delays": 1,
                "features": {"low": [0.0, 0.0], "high": [9.0, 9.0]}, "force_N": {"low": [0.0], "high": [1.0]},
                "network": {"sigmoid": "tanh", "layers": weights}})})

    def make_event_material_file(self):
        weights = [{"weights": [[0.5] * 88], "biases": [0.0]}, {"weights": [[1.0], [-1.0]], "biases": [0.0, 0.0]}]
        return sealed("event-material.json", {
            "format": "touchstone.material_classifier", "version": 1, "materials": ["foam", "wood"],
            "features": {"low": [0.0] * 88, "high": [9.0] * 88}, "network": {"sigmoid": "tanh", "layers": weights}})

    def make_events_file(self):
        pathlib.Path("events.txt").write_text("".join(f"{t} 3 4 1\n" for t in range(10)))
        return "events.txt"

    def make_event_force(self):
        return ts.EventForceModel.load(self.event_force_file)

    def make_registers(self):
        """Recordings, and the force of each frame."""
        fields = [("dx", "i4"), ("dy", "i4"), ("squal", "i4"), ("maximum", "i4"), ("minimum", "i4"), ("average", "f8")]
        recordings, forces = [], []
        for axis in (0, 1):
            normal = np.maximum(0, 3 * np.sin(np.arange(120) / 20))
            records = np.zeros(120, fields)
            records["squal"], records["minimum"] = 90, 6
            records["maximum"], records["average"] = np.round(36 + 2 * normal), 15 + 1.5 * normal
            records["dx" if axis == 0 else "dy"][normal > 0] = 1
            shear = np.zeros((120, 2))
            shear[:, axis] = 0.01 * np.cumsum(normal > 0)
            recordings.append(records)
            forces.append(np.column_stack([shear, normal]))
        return recordings, forces

    def make_reflex(self):
        return ts.calibrate_reflex(*self.registers)[0]

    def make_reflex_file(self):
        self.reflex.save("reflex.model")
        return "reflex.model"

    def make_dot_readings(self):
        tracker = ts.ExploreTracker(chip_picture())
        return [tracker.track(chip_picture(shift, growth)) for growth in (1.0, 1.05, 1.1, 1.15)
                for shift in ((0, 0), (0.5, 0), (0, 0.5), (0.5, 0.5))]

    def make_known_dots(self):
        """Presses, forces, lateral displacements, series."""
        press = [1.0 * (k // 4) for k in range(16)]
        lateral = np.array([(0.25 * (k % 2), 0.25 * (k // 2 % 2)) for k in range(16)])
        return press, np.column_stack([0.5 * lateral, np.expm1(0.5 * np.array(press))]), lateral, [k % 2 for k in range(16)]

    def make_explore(self):
        press, forces, lateral, _ = self.known_dots
        return ts.calibrate_explore(self.dot_readings, press, forces, lateral_mm=lateral, terms=1)[0]

    def make_explore_file(self):
        self.explore.save("explore.model")
        return "explore.model"

    def make_colour_patches(self):
        return [(skin_picture(colour), (10, 10, 20, 20), lab)
                for colour, lab in (((40, 60, 180), (45, 50, 30)), ((50, 160, 60), (60, -40, 35)), ((190, 60, 40), (35, 20, -50)),
                                    ((90, 90, 90), (55, 0, 0)))]

    def make_colour(self):
        return ts.calibrate_colour([skin_picture((200, 210, 220))], self.colour_patches)[0]

    def make_colour_file(self):
        self.colour.save("colour.model")
        return "colour.model"

    def make_grasps(self):
        """Events of grasps, readings of forces, materials: rest, touch, hold, release."""
        grasps, readings, materials = [], [], []
        for k in range(6):
            counts = np.full(160, 3)
            counts[30:52] += 40 + 5 * k
            counts[110:132] += 30 + 10 * (k % 2)
            t_us = np.concatenate([7000 * w + np.linspace(0, 6990, n).astype(int) for w, n in enumerate(counts)])
            events = np.zeros(len(t_us), [("t_us", "i8"), ("x", "u2"), ("y", "u2"), ("on", "?")])
            events["t_us"], events["on"] = t_us, np.arange(len(t_us)) % 2
            grasps.append(events)
            times = np.arange(0, 160 * 7000, 7000)
            readings.append((times, np.clip((times / 7000 - 30) / 22, 0, 1) * (0.5 + 0.2 * k)))
            materials.append("wood" if k % 2 else "foam")
        return grasps, readings, materials

    def make_presses(self):
        """Forces over time, and levels."""
        t_s = np.arange(300) / 250
        press = [np.maximum(0, 2 * (1 - np.exp(-(t_s - 0.2) / (0.3 / (1 + k % 2))))) + 0.001 * k for k in range(6)]
        return press, ["hard" if k % 2 else "soft" for k in range(6)]

    def make_softness(self):
        return ts.calibrate_softness(*self.presses, 250.0, trigger_N=0.2, networks=1)[0]

    def make_softness_file(self):
        self.softness.save("softness.model")
        return "softness.model"

    def make_reader(self):
        return ts.ColourMarkerReader(markers_picture(), grid=(4, 4))

    def make_small_reading(self):
        return ts.ColourMarkerReader(markers_picture(grid=3), grid=(3, 3)).rest

    def make_large_reading(self):
        return ts.ColourMarkerReader(markers_picture(grid=5), grid=(5, 5)).rest

    def make_hue_samples(self):
        samples = []
        for series, (x, y, growth) in enumerate((x, y, g) for x in (-3, 0, 3) for y in (-3, 3) for g in (0, 2)):
            reading = self.reader.read(markers_picture((x, y), 16.0 + growth))
            samples += [(reading, marker, (0.075 * x, 0.075 * y, -0.2 * growth), series)
                        for marker in range(16) if reading.flaws[marker] == "none"]
        return samples

    def make_hue_model(self):
        return ts.calibrate_hue(self.reader.rest, self.hue_samples, spacing_mm=3.0)

    def make_hue_file(self):
        self.hue_model.save("hue.model")
        return "hue.model"

    def make_png(self):
        ts.write_png("ok.png", markers_picture())
        return "ok.png"

    def job_file(self, name, text):
        file = self.shared / name
        if not file.exists():
            file.write_text(text.format(examples=EXAMPLES))
        return str(file)

    def make_job(self):
        return self.job_file("job.yaml", JOB)

    def make_draw(self):
        return self.job_file("draw.yaml", DRAW)

    def make_scene_set(self):
        ts.generate(self.job, self.shared / "set")
        return str(self.shared / "set")

    def make_drawn_set(self):
        ts.generate(self.draw, self.shared / "drawn")
        return str(self.shared / "drawn")

    def hue_lists(self, valid):
        """Of samples for calibrate_hue: the last of them changed in each of its parts."""
        reading, marker, displacement, series = valid[-1]
        changed = [(other, marker, displacement, series)
                   for other in (self.small_reading, self.large_reading, *STRANGE)]
        changed += [(reading, other, displacement, series) for other in (-1, 15, 16, *numbers(0))]
        changed += [(reading, marker, other, series) for other in arrays(displacement)]
        changed += [(reading, marker, displacement, other) for other in numbers(0)]
        # A marker that only the series has which is left out first, and that isn't in the grid at rest.
        wide = (self.large_reading, 24, displacement, -1)
        return [[], valid[:1], valid[:20], tuple(valid), iter(valid), [wide, *valid], 0, *STRANGE,
                *([*valid[:-1], sample] for sample in changed), *([sample] for sample in changed[:5])]


# ---- the table --------------------------------------------------------------------------------------------------

class Call:
    """A valid call, and what its arguments are changed to.

    make: gives the function; called anew for each case. values: name of each argument to (what it is in the valid
    call, the function that gives its extreme values). allowed: what else may be raised. after: called with what the
    function gives. refused: the call is one that raises an Error as it stands.
    """

    def __init__(self, make, values=None, allowed=(), after=None, refused=False):
        self.make, self.values, self.after, self.refused = make, values or {}, after, refused
        self.allowed = (ts.Error, TypeError, *allowed)

    def cases(self):
        valid = {name: value for name, (value, _) in self.values.items()}
        yield "as it should be", None, valid
        for name, (value, extremes) in self.values.items():
            for extreme in extremes(value):
                yield name, extreme, {**valid, name: extreme}


def table(t):
    """Public name -> function that makes its list of calls. Keys of methods are Class.method."""
    frame = (0, numbers)
    seed = (0, numbers)
    place, angles = ((0.0, 0.0), arrays), ((0.0, 0.0, 0.0), arrays)
    touched = (BALL, only(*descriptions(BALL), *paths("ball-8mm"), t.folder))
    samples = ("frame", "wrench")
    down = np.array([[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0.1]])

    def pressed_gently(obj):
        assert math.isfinite(t.bare.touch_height_mm(obj))
        t.bare.press(obj, depth_mm=0.01, look=False)

    def press(**how):
        return Call(lambda: t.sensor.press, {"object": (t.ball, only()), **how})

    def virtual(name):
        return lambda: getattr(testing.VirtualDevice(t.sensor), name)

    names = ("wrench", texts)

    def of_sets(method, values=None, allowed=(), refused=()):
        return lambda: [Call(lambda which=which: getattr(ts.Dataset(getattr(t, which)), method), values, allowed,
                             refused=which in refused) for which in ("scene_set", "drawn_set")]

    return {
        "Error": lambda: [Call(lambda: ts.Error, {"message": ("x", texts), "file": ("x", texts), "line": (1, numbers),
                                                  "field": ("x", texts)})],
        "Object": lambda: [Call(lambda: ts.Object, {"of": (BALL, described)}, after=pressed_gently),
                           *(Call(lambda: ts.Object, {"of": ({"name": "it", "shape": shape}, descriptions)},
                                  after=pressed_gently) for shape in SHAPES[:-1])],
        "Sensor": lambda: [Call(lambda: ts.Sensor, {
            "device": (BARE, described), "unit": (1, numbers), "deepest_mm": (1.2, numbers),
            "widest_mm": (0.5, numbers), "membrane_um": (40.0, numbers), "friction": (False, flags),
            "cache": ("cache", paths), "progress": (None, callbacks)},
            allowed=(KeyError,)),
            Call(lambda: ts.Sensor, {"device": (QUICK, lambda valid: changed_fields(valid, (
                "name", "coating", "lamps", "camera")))})],
        "Sensor.gel_from_pixel": lambda: [Call(lambda: t.sensor.gel_from_pixel, {"pixel": ((40, 30), arrays)})],
        "Sensor.pixel_from_gel": lambda: [Call(lambda: t.sensor.pixel_from_gel, {"place_mm": ((0, 0), arrays)})],
        "Sensor.background": lambda: [Call(lambda: t.sensor.background, {"noise_seed": seed, "frame": frame})],
        "Sensor.touch_height_mm": lambda: [Call(lambda: t.sensor.touch_height_mm, {
            "object": touched, "at_mm": place, "angles_deg": angles})],
        "Sensor.press": lambda: [
            press(depth_mm=(0.2, numbers), at_mm=place, angles_deg=angles, seconds=(0.1, numbers), noise_seed=seed,
                  frame=frame, look=(True, flags), truth=(True, flags)),
            press(force_N=(0.3, numbers), shear_N=((0.01, 0.0), arrays), look=(False, only())),
            press(depth_mm=(0.2, only()), shear_mm=((0.05, 0.0), arrays), look=(False, only())),
            press(pose=(t.pose, poses)),
            Call(lambda: t.sensor.press, {"object": touched, "depth_mm": (0.1, only()), "look": (False, only())})],
        "Session": lambda: [Call(lambda: ts.Session, {
            "sensor": (t.sensor, only(*STRANGE)), "object": touched, "largest_step_mm": (5.0, numbers),
            "largest_part_mm": (0.1, numbers)},
            after=lambda session: [session.step(pose, 0.01) for pose in (t.pose[:3], t.pose[:3] - down)])],
        "Session.step": lambda: [Call(lambda pressed=pressed: t.session(pressed).step, {
            "pose": (t.pose, poses), "dt_s": (0.01, numbers)}) for pressed in (True, False)],
        "Session.look": lambda: [Call(lambda: t.session().look, {
            "noise_seed": seed, "frame": (0, numbers), "picture": (True, flags), "truth": (True, flags)})],
        "Session.restart": lambda: [Call(lambda: t.session().restart)],
        "HeightModel.load": lambda: [Call(lambda: ts.HeightModel.load, {"path": (t.height_file, paths)})],
        "HeightModel.save": lambda: [Call(lambda: t.height_model.save, {"path": ("y", paths)})],
        "HeightEstimator": lambda: [Call(lambda: ts.HeightEstimator, {
            "model": (t.height_model, only(*STRANGE)), "border": ("free", texts), "follow_frames": (30.0, numbers)})],
        "HeightEstimator.estimate": lambda: [
            Call(lambda border=border: ts.HeightEstimator(t.height_model, border=border).estimate, {
                "frame": (t.touch.frame, pictures)}) for border in ("zero", "free")],
        "HeightEstimator.set_rest": lambda: [Call(lambda: ts.HeightEstimator(t.height_model).set_rest, {
            "frames": (t.heights[0][2], lists_of(pictures))})],
        "HeightEstimator.doubts": lambda: [Call(lambda: ts.HeightEstimator(t.height_model).doubts, {
            "frame": (t.touch.frame, pictures)})],
        "calibrate_height": lambda: [Call(lambda: ts.calibrate_height, {
            "frames": (t.heights[0][0], lists_of(pictures)), "ball_diameters_mm": (t.heights[0][1], lists_of(numbers)),
            "background": (t.heights[0][2], lists_of(pictures)), "mm_per_px": (t.sensor.mm_per_px, numbers),
            "circles": (circles, lists_of(arrays)), "correction": ("none", texts), "slopes": ("table", texts),
            "gel_thickness_mm": (4.0, numbers)})
            for circles in ([t.circle],)] + [
            Call(lambda: ts.calibrate_height, {
                "frames": (t.heights[0][0], lists_of(pictures)), "ball_diameters_mm": ([diameter], lists_of(numbers)),
                "background": (t.heights[0][2], only()), "mm_per_px": (scale, numbers),
                "circles": (circles, only(None, [None]))}, refused=diameter != 3.0)
            for diameter, scale, circles in ((3.0, t.sensor.mm_per_px, None), (1e-170, 1e-172, [t.circle]),
                                             (1e300, 1e300, [t.circle]), (1e300, 1e300, None))],
        "DarknessModel.load": lambda: [Call(lambda: ts.DarknessModel.load, {"path": (t.darkness_file, paths)})],
        "DarknessModel.save": lambda: [Call(lambda: t.darkness_model.save, {"path": ("y", paths)})],
        "DarknessModel.height_at": lambda: [Call(lambda: t.darkness_model.height_at, {"darkening": (0.1, numbers)})],
        "DarknessEstimator": lambda: [Call(lambda: ts.DarknessEstimator, {
            "model": (t.darkness_model, only(*STRANGE))})],
        "DarknessEstimator.estimate": lambda: [Call(lambda: ts.DarknessEstimator(t.darkness_model).estimate, {
            "frame": (t.darkness[0][0][0], pictures)})],
        "calibrate_darkness": lambda: [Call(lambda: ts.calibrate_darkness, {
            "frames": (t.darkness[0][0], lists_of(pictures)),
            "ball_diameters_mm": ([diameter], lists_of(numbers)), "rest": (t.darkness[0][2], lists_of(pictures)),
            "mm_per_px": (scale, numbers), "circles": (circles, changed), "camera_distance_mm": (17.0, numbers),
            "smoothing_px": (1.5, numbers),
            "follow_exposure": (True, flags)}, refused=diameter != 4.0)
            for diameter, scale, circles, changed in (
                (4.0, 0.05, [(60.0, 44.0, 32.0)], lists_of(arrays)), (4.0, 0.05, [None], only(None)),
                (1e-170, 1e-172, [(60.0, 44.0, 32.0)], lists_of(arrays)), (1e300, 1e300, [None], only(None)))],
        "BeadTracker": lambda: [Call(lambda: ts.BeadTracker, {
            "grid": (3, numbers), "roi_a_px": (200, numbers), "roi_b_px": (30, numbers), "polarity": ("dark", texts),
            "centre_px": ((160, 120), arrays)}, after=lambda tracker: tracker.track(beads_picture(), 0) and None)],
        "BeadTracker.track": lambda: [Call(lambda: t.tracker().track, {
            "frame": (beads_picture(), pictures), "t_us": (1000, numbers)}),
            Call(lambda: ts.BeadTracker(roi_a_px=200).track, {
                "frame": (beads_picture(), pictures), "t_us": (0, numbers)})],
        "BeadTracker.restart": lambda: [Call(lambda: t.tracker().restart)],
        "MarkerTracker": lambda: [Call(lambda: ts.MarkerTracker, {"rest": (dots_picture(), pictures)},
                                       after=lambda tracker: tracker.track(dots_picture()) and None)],
        "MarkerTracker.track": lambda: [Call(lambda: ts.MarkerTracker(dots_picture()).track, {
            "frame": (dots_picture(), pictures), "t_us": (1000, numbers)})],
        "MarkerTracker.restart": lambda: [Call(lambda: ts.MarkerTracker(dots_picture()).restart, {
            "rest": (dots_picture(), pictures)})],
        "TouchReader": lambda: [Call(lambda: ts.TouchReader, {
            "rest": (rest, pictures), "heights": (heights, only(*STRANGE)), "force": (force, only(*STRANGE)),
            "indenter": (None, lambda valid: texts("ball")), "mm_per_px": (mm_per_px, numbers)},
            after=lambda reader, rest=rest: reader.read(rest) and None)
            for rest, heights, force, mm_per_px in ((dots_picture(), None, t.gel_force, 0.05),
                                                    (dots_picture(), None, None, None))],
        "TouchReader.read": lambda: [Call(lambda: ts.TouchReader(dots_picture(), force=t.gel_force).read, {
            "frame": (touched_dots((1, 1)), pictures), "t_us": (1000, numbers)})],
        "TouchReader.restart": lambda: [Call(lambda: ts.TouchReader(dots_picture()).restart, {
            "rest": (dots_picture(), pictures)})],
        "GelForceModel.load": lambda: [Call(lambda: ts.GelForceModel.load, {"path": (t.gel_force_file, paths)})],
        "GelForceModel.save": lambda: [Call(lambda: t.gel_force.save, {"path": ("y", paths)})],
        "fit_touch_forces": lambda: [Call(lambda: ts.fit_touch_forces, {
            "readings": (t.readings, lists_of(lambda valid: STRANGE)),
            "forces_N": ([(-1, 0, 1), (0, -1, 1), (-2, -2, 1), (2, -1, 1)], arrays), "indenter": ("ball", texts),
            "series": ([0, 0, 1, 1], lists_of(numbers)), "gel": ("gel", texts)})],
        "TextureModel": lambda: [Call(lambda: ts.TextureModel, {
            "mm_per_px": (0.05, numbers), "grey_step_mm": (0.002, numbers)})],
        "TextureModel.load": lambda: [Call(lambda: ts.TextureModel.load, {"path": (t.texture_file, paths)})],
        "TextureModel.save": lambda: [Call(lambda: t.textures().save, {"path": ("y", paths)})],
        "TextureModel.learn": lambda: [Call(lambda: t.textures().learn, {
            "material": ("sand", texts), "height_mm": (rough_heights(), arrays)})],
        "TextureModel.classify": lambda: [Call(lambda: t.textures().classify, {
            "height_mm": (rough_heights(), arrays), "mm_per_px": (0.05, numbers)})],
        "TactileMap": lambda: [Call(lambda: ts.TactileMap)],
        "TactileMap.load": lambda: [Call(lambda: ts.TactileMap.load, {"path": (t.tactile_file, paths)})],
        "TactileMap.save": lambda: [Call(lambda: t.tactile_map().save, {"path": ("y", paths)})],
        **{f"TactileMap.{name}": lambda name=name: [Call(lambda: getattr(t.tactile_map(), name), {
            "height_mm": (rough_heights(), arrays), "mm_per_px": (0.05, numbers),
            "contact": (rough_heights() > 0, arrays)})] for name in ("add", "localise")},
        "EventForceModel.load": lambda: [Call(lambda: ts.EventForceModel.load, {"path": (t.event_force_file, paths)})],
        "EventForceReader": lambda: [Call(lambda: ts.EventForceReader, {
            "model": (t.event_force, only(*STRANGE)), "size": ((240, 180), sizes)},
            after=lambda reader: reader.add(t.events))],
        "EventForceReader.add": lambda: [Call(lambda: ts.EventForceReader(t.event_force, size=(240, 180)).add, {
            "events": (t.events, records)})],
        "EventForceReader.end_at": lambda: [Call(lambda: begun(ts.EventForceReader(t.event_force, size=(240, 180)), t.events)
                                                 .end_at, {"t_us": (500000, numbers)})],
        "EventForceReader.restart": lambda: [Call(lambda: ts.EventForceReader(t.event_force, size=(240, 180)).restart)],
        "EventMaterialModel.load": lambda: [Call(lambda: ts.EventMaterialModel.load,
                                                 {"path": (t.event_material_file, paths)})],
        "EventMaterialModel.classify": lambda: [Call(lambda: ts.EventMaterialModel.load(t.event_material_file).classify, {
            "events": (t.events, records), "size": ((240, 180), sizes)}, refused=True)],
        "ReflexModel.load": lambda: [Call(lambda: ts.ReflexModel.load, {"path": (t.reflex_file, paths)})],
        "ReflexModel.save": lambda: [Call(lambda: t.reflex.save, {"path": ("y", paths)})],
        "ReflexReader": lambda: [Call(lambda: ts.ReflexReader, {
            "model": (t.reflex, only(*STRANGE)), "stop_above_N": (0.0, numbers), "stop_frames": (1, numbers),
            "release_frames": (15, numbers), "stop_when_blind": (True, flags), "blind_frames": (3, numbers)})],
        "ReflexReader.read": lambda: [Call(lambda: ts.ReflexReader(t.reflex).read, {
            "statistics": ({"dx": 1, "dy": 0, "squal": 90, "maximum": 36, "minimum": 6, "average": 15.0}, statistics)})],
        "ReflexReader.restart": lambda: [Call(lambda: ts.ReflexReader(t.reflex).restart)],
        "calibrate_reflex": lambda: [Call(lambda: ts.calibrate_reflex, {
            "recordings": (t.registers[0], chip_records), "forces_N": (t.registers[1], lists_of(arrays)),
            "contact_N": (0.02, numbers), "degree": (1, numbers)})],
        "ExploreTracker": lambda: [Call(lambda: ts.ExploreTracker, {
            "rest": (chip_picture(), pictures), "white": (63.0, numbers), "pixel_rate_Hz": (1500.0, numbers)},
            after=lambda tracker: tracker.track(chip_picture(), t_us=0) and None),
            Call(lambda: ts.ExploreTracker, {"rest": ([chip_picture()] * 2, lists_of(pictures))})],
        "ExploreTracker.track": lambda: [Call(lambda: ts.ExploreTracker(chip_picture()).track, {
            "frame": (chip_picture((0.5, 0)), pictures), "t_us": (1000, numbers)})],
        "ExploreTracker.restart": lambda: [Call(lambda: ts.ExploreTracker(chip_picture()).restart, {
            "rest": (chip_picture(), pictures)})],
        "ExploreModel.load": lambda: [Call(lambda: ts.ExploreModel.load, {"path": (t.explore_file, paths)})],
        "ExploreModel.save": lambda: [Call(lambda: t.explore.save, {"path": ("y", paths)})],
        "ExploreModel.estimate": lambda: [Call(lambda: t.explore.estimate, {
            "reading": (t.dot_readings[5], only(*STRANGE))})],
        "calibrate_explore": lambda: [Call(lambda: ts.calibrate_explore, {
            "readings": (t.dot_readings, lists_of(lambda valid: STRANGE)), "press_mm": (t.known_dots[0], arrays),
            "forces_N": (t.known_dots[1], arrays), "lateral_mm": (t.known_dots[2], arrays),
            "series": (t.known_dots[3], lists_of(numbers)), "terms": (1, numbers)})],
        "ColourModel.load": lambda: [Call(lambda: ts.ColourModel.load, {"path": (t.colour_file, paths)})],
        "ColourModel.save": lambda: [Call(lambda: t.colour.save, {"path": ("y", paths)})],
        "ColourModel.lab": lambda: [Call(lambda: t.colour.lab, {
            "frame": (skin_picture((40, 60, 180)), pictures), "region": ((10, 10, 20, 20), regions)})],
        "calibrate_colour": lambda: [Call(lambda: ts.calibrate_colour, {
            "card": ([skin_picture((200, 210, 220))], lists_of(pictures)), "patches": (t.colour_patches, patch_lists),
            "smooth_px": (4.0, numbers)})],
        "skin_marks": lambda: [Call(lambda: ts.skin_marks, {
            "before": (markers_picture(), pictures), "pressed": (markers_picture(), pictures),
            **{name: (usual, numbers) for name, usual in (("smooth_px", 4), ("least_index", 3), ("least_area_px", 300), ("rim_px", 8),
                                                           ("ring_px", 16), ("bead_px", 44), ("blanched_share", 0.5),
                                                           ("wetted_part", 0.8))}})],
        "force_spectrogram": lambda: [Call(lambda: ts.force_spectrogram, {
            "force_N": (np.linspace(0, 3, 400), arrays), "rate_Hz": (500.0, numbers), "window_s": (0.064, numbers),
            "hop_s": (0.032, numbers), "length_s": (0.768, numbers), "trigger_N": (0.05, numbers), "before_s": (0.032, numbers),
            "floor_N": (1e-3, numbers)})],
        "SoftnessModel.load": lambda: [Call(lambda: ts.SoftnessModel.load, {"path": (t.softness_file, paths)})],
        "SoftnessModel.save": lambda: [Call(lambda: t.softness.save, {"path": ("y", paths)})],
        "SoftnessModel.classify": lambda: [Call(lambda: t.softness.classify, {"force_N": (t.presses[0][0], arrays)})],
        "calibrate_softness": lambda: [Call(lambda: ts.calibrate_softness, {
            "presses": (t.presses[0], lists_of(arrays)), "levels": (t.presses[1], lists_of(texts)),
            "rate_Hz": (250.0, numbers), "trigger_N": (0.2, numbers), "highest_Hz": (0.0, numbers), "units": (3, numbers),
            "networks": (1, numbers), "threads": (1, numbers)})],
        "EventForceModel.save": lambda: [Call(lambda: t.event_force.save, {"path": ("y", paths)})],
        "EventMaterialModel.save": lambda: [Call(lambda: ts.EventMaterialModel.load(t.event_material_file).save,
                                                 {"path": ("y", paths)})],
        "train_event_force": lambda: [Call(lambda: ts.train_event_force, {
            "grasps": (t.grasps[0], lists_of(records)), "readings": (t.grasps[1], lists_of(lambda valid: [
                (), (valid[0],), (valid[1], valid[0]), *((valid[0], one) for one in arrays(valid[1])),
                *((one, valid[1]) for one in arrays(valid[0])), *STRANGE])), "size": ((240, 180), sizes),
            "method": ("process", texts), "left_out": (0, only(-1, 1, 2**31, NAN, *STRANGE)), "hidden_layers": (1, numbers),
            "units": (2, only(0, -1, 201, 2**31, NAN, *STRANGE)), "threads": (1, numbers)})],
        "train_event_material": lambda: [Call(lambda: ts.train_event_material, {
            "grasps": (t.grasps[0], lists_of(records)), "materials": (t.grasps[2], lists_of(texts)),
            "size": ((240, 180), sizes), "units": (2, only(0, -1, 201, 2**31, NAN, *STRANGE)), "threads": (1, numbers)})],
        "read_events": lambda: [Call(lambda: ts.read_events, {"path": (t.events_file, paths), "size": ((240, 180), sizes)})],
        "StiffnessForceModel.load": lambda: [Call(lambda: ts.StiffnessForceModel.load,
                                                  {"path": (t.stiffness_file, paths)})],
        "StiffnessForceModel.save": lambda: [Call(lambda: t.stiffness.save, {"path": ("y", paths)})],
        "StiffnessForceModel.estimate": lambda: [Call(lambda: t.stiffness.estimate, {
            "beads": (t.beads, only(ts.BeadTracker(grid=2, roi_a_px=200).track(beads_picture(), 0), *STRANGE)),
            "rest": (REST, arrays)})],
        "train_stiffness": lambda: [Call(lambda: ts.train_stiffness, {
            "rest": (t.training[0], arrays), "positions": (t.training[1], lists_of(arrays)),
            "forces_N": (t.training[2], arrays), "grid": (3, numbers), "form": ("diagonal", texts)})],
        "ColourMarkerReader": lambda: [Call(lambda: ts.ColourMarkerReader, {
            "rest": (markers_picture(), pictures), "grid": ((4, 4), arrays)})],
        "ColourMarkerReader.read": lambda: [Call(lambda: t.reader.read, {"frame": (markers_picture(), pictures)})],
        "HueModel.load": lambda: [Call(lambda: ts.HueModel.load, {"path": (t.hue_file, paths)})],
        "HueModel.save": lambda: [Call(lambda: t.hue_model.save, {"path": ("y", paths)})],
        "calibrate_hue": lambda: [Call(lambda: ts.calibrate_hue, {
            "rest": (t.reader.rest, only(t.small_reading, t.large_reading, *STRANGE)),
            "samples": (t.hue_samples, t.hue_lists), "spacing_mm": (3.0, numbers),
            "viewing_distance_mm": (0.0, numbers), "form": ("isotropic", texts)}),
            Call(lambda: ts.calibrate_hue, {
                "rest": (t.reader.rest, only()), "spacing_mm": (3.0, only()), "form": ("best", only()),
                "samples": (t.hue_samples[::5], only([(t.large_reading, 24, (0, 0, 0), -1), *t.hue_samples[::5]]))})],
        "HueEstimator": lambda: [Call(lambda: ts.HueEstimator, {
            "model": (t.hue_model, only(*STRANGE)),
            "rest": (t.reader.rest, only(t.small_reading, t.large_reading, *STRANGE))})],
        "HueEstimator.estimate": lambda: [Call(lambda: ts.HueEstimator(t.hue_model, t.reader.rest).estimate, {
            "reading": (t.reader.rest, only(t.small_reading, t.large_reading, *STRANGE))})],
        "read_image": lambda: [Call(lambda: ts.read_image, {"path": (t.png, paths)})],
        "frames": lambda: [
            Call(lambda: lambda **how: list(ts.frames(**how)), {
                "source": (t.png, paths), "rate": (30.0, numbers), "count": (1, numbers), "seconds": (1.0, numbers),
                "timeout": (1.0, numbers)}),
            Call(lambda: lambda **how: list(ts.frames(**how)), {
                "source": (t.png, only()), "times": (None, paths)}),
            Call(lambda: lambda **how: list(ts.frames(**how)), {
                "source": (t.scene_set, only()), "split": ("all", texts)})],
        "write_png": lambda: [Call(lambda: ts.write_png, {"path": ("y.png", paths), "image": (image, pictures)})
                              for image in (markers_picture(), beads_picture())],
        "scenes_folder": lambda: [Call(lambda: ts.scenes_folder)],
        "generate": lambda: [Call(lambda: ts.generate, {
            "job": (t.job, paths), "out": (t.scene_set, bad_paths), "threads": (1, numbers), "timings": (True, flags),
            "cache": (None, paths), "shard": (None, texts_of_shards), "progress": (None, callbacks)},
            allowed=(KeyError,)),
            Call(lambda: ts.generate, {"job": (t.draw, only()), "out": (t.drawn_set, only()),
                                       "shard": ("1/1", texts_of_shards)}),
            Call(lambda: ts.generate, {"job": (t.job, only()), "out": ("many", only()), "threads": (4096, only())})],
        "merge": lambda: [Call(lambda: ts.merge, {"job": (t.draw, paths), "out": (t.drawn_set, paths),
                                                  "progress": (None, callbacks)}, allowed=(KeyError,))],
        "Dataset": lambda: [Call(lambda: ts.Dataset, {
            "folder": (folder, paths), "split": ("train", texts), "columns": (samples, lists_of(texts)),
            "transform": (None, only(0, "x", [], len))}, after=lambda data: len(data) and None)
            for folder in (t.scene_set, t.drawn_set)],
        "Dataset.array_names": of_sets("array_names"),
        "Dataset.unit": of_sets("unit", {"name": names}),
        "Dataset.meaning": of_sets("meaning", {"name": names}),
        "Dataset.array": of_sets("array", {"name": ("wrench", lambda valid: ["frame", "events", "background", "ideal",
                                                                             *texts(valid)])}),
        "Dataset.constant": of_sets("constant", {"name": ("object_name", texts)}, refused=("scene_set",)),
        "Dataset.groups": of_sets("groups"),
        "Dataset.background": of_sets("background", {"unit": (0, numbers)}, refused=("scene_set",)),
        "Dataset.device_yaml": of_sets("device_yaml", {"unit": (0, numbers)}, refused=("scene_set",)),
        "Dataset.verify": of_sets("verify"),
        "Dataset.__len__": of_sets("__len__"),
        "Dataset.__getitem__": of_sets("__getitem__", {"index": (0, numbers)}, (IndexError,)),
        "testing.assert_close": lambda: [Call(lambda: testing.assert_close, {
            "estimate": (value, arrays), "truth": (value, arrays), "allowed": (1.0, numbers), "error_bar": (0.0, bars),
            "sigmas": (2.0, numbers), "unit": ("N", texts), "what": ("x", texts)}, allowed=(AssertionError,))
            for value in (np.zeros(3), np.zeros((2, 3))) for bars in (numbers, arrays_of_bars)],
        "testing.VirtualDevice.press": lambda: [Call(virtual("press"), {
            "obj": (t.ball, only(*STRANGE)), "depth_mm": (0.1, only(-1, NAN)), "look": (False, only()),
            "frame": (0, numbers)})],
        "testing.VirtualDevice.background": lambda: [Call(virtual("background"))],
        "testing.VirtualDevice.session": lambda: [Call(virtual("session"), {
            "obj": (t.ball, only(*STRANGE)), "largest_part_mm": (0.1, numbers)})],
    }


def texts_of_shards(valid):
    return ["0/1", "2/1", "1/0", "-1/2", "1/2/3", "1/", "/1", "1/99999999999", "1/2147483647", *texts("1/1")]


def begun(reader, events):
    reader.add(events)
    return reader


def arrays_of_bars(valid):
    return arrays(np.zeros(3))


def public_names():
    """All that users can call: functions, constructors, methods (of those with __ the ones below)."""
    def of_class(prefix, cls):
        own = vars(cls)
        if not isinstance(own.get("__init__"), (type(None), types.WrapperDescriptorType)):  # that of what isn't made
            yield prefix
        for name, member in own.items():
            if isinstance(member, property) or not (inspect.isroutine(member) or isinstance(member, staticmethod)):
                continue
            if not name.startswith("_") or name in ("__getitem__", "__len__", "__call__"):
                yield f"{prefix}.{name}"

    for name in ts.__all__:
        thing = getattr(ts, name)
        yield from of_class(name, thing) if inspect.isclass(thing) else [name]
    for name, thing in vars(testing).items():
        if name.startswith("_") or getattr(thing, "__module__", None) != testing.__name__ or name in ts.__all__:
            continue
        yield from of_class(f"testing.{name}", thing) if inspect.isclass(thing) else [f"testing.{name}"]


# ---- the child --------------------------------------------------------------------------------------------------

def shown(value):
    """The value in few letters."""
    if isinstance(value, np.ndarray):
        few = value.ravel()[:3].tolist() if value.size <= 100 else "..."
        return f"array {few} of {value.dtype}, shape {value.shape}"
    if isinstance(value, ChangedDict):
        return f"dict with {value.change}"
    if isinstance(value, ts.ColourMarkerReading):
        return "reading of {} x {}".format(*value.grid)
    if isinstance(value, (list, tuple)) and value:
        few = [shown(item) for item in (value if len(value) <= 4 else (value[0], value[-1]))]
        return f"[{', '.join(few)}]" if len(value) <= 4 else f"[{few[0]}, ..., {few[1]}] of {len(value)}"
    try:
        text = repr(value)
    except RecursionError:
        text = "(too deep to show)"
    return text if len(text) < 120 else text[:117] + "..."


def read_all(value):
    """Reads all properties of what a call gave, which compute some of it only then."""
    for one in value if isinstance(value, (tuple, list)) else value.values() if isinstance(value, dict) else [value]:
        if type(one).__module__.startswith("touchstone"):
            for name, member in vars(type(one)).items():
                if isinstance(member, property) and not isinstance(one, ts.Sensor):
                    try:
                        getattr(one, name)
                    except ts.Error:
                        pass
            repr(one)


def make_calls(name, folder, shared, first, out):
    """All calls of one public name, from number `first` on. Changes the process: its limits and its working folder."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    warnings.simplefilter("ignore")
    os.makedirs(folder, exist_ok=True)
    shared = os.path.abspath(shared)
    os.chdir(folder)
    os.makedirs("folder", exist_ok=True)
    things = Things(folder, shared)

    def tell(**what):
        out.write(json.dumps(what) + "\n")
        out.flush()

    number = itertools.count()
    for call in table(things)[name]():
        for argument, value, arguments in call.cases():
            k = next(number)
            if k < first:
                continue
            arguments = dict(arguments)
            function = call.make()
            tell(k=k, case=f"{argument}={shown(value)}" if value is not None or argument != "as it should be"
                 else argument)
            try:
                result = function(*arguments.values()) if name == "Dataset.__getitem__" else function(**arguments)
                read_all(result)
                if call.after:
                    call.after(result)
                outcome, fault = "fine", None
            except BaseException as error:  # pylint: disable=broad-except
                allowed = isinstance(error, call.allowed)
                outcome = f"{type(error).__name__}: {error}"[:300].encode("utf-8", "replace").decode()
                fault = None
                if argument == "as it should be" and not call.refused:
                    fault = "a valid call is refused"
                elif not allowed:
                    fault = "raises what isn't documented"
            tell(k=k, outcome=outcome, fault=fault)
    tell(done=True)


if __name__ == "__main__":
    make_calls(*sys.argv[1:4], int(sys.argv[4]) if len(sys.argv) > 4 else 0, os.fdopen(os.dup(1), "w"))
