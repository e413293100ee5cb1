"""A fingertip on a motion chip: registers and pictures of dots, by formulas; their own tests are in tests/sensors."""

import numpy as np
import pytest

import touchstone as ts

FIELDS = [("dx", "i4"), ("dy", "i4"), ("squal", "i4"), ("maximum", "i4"), ("minimum", "i4"), ("average", "f8")]


def recording(peak_N, towards, seed):
    """Statistics that follow the force, with 40 counts of shear to and fro; (records, forces)."""
    rng = np.random.default_rng(seed)
    part = (np.arange(600) - 100) / 400
    normal = np.where((part > 0) & (part < 1), peak_N * np.sin(np.pi * part), 0)
    reach = np.where((part > 0.2) & (part < 0.8), 40 * (1 - abs(part - 0.5) / 0.3), 0)
    counts = np.round(reach[:, None] * np.array([np.cos(towards), np.sin(towards)])).astype(int)
    records = np.zeros(600, FIELDS)
    steps = np.diff(counts, axis=0, prepend=0)
    records["dx"], records["dy"] = steps.T
    for name, at_rest, per_N in (("squal", 90, -4), ("maximum", 36, 2), ("minimum", 6, 0.5)):
        records[name] = np.round(at_rest + per_N * normal + 0.3 * rng.normal(size=600))
    records["average"] = 15 + 1.5 * normal
    shear = (0.01 + 0.002 * normal)[:, None] * counts
    return records, np.column_stack([shear, normal])


def test_registers_with_forces_are_learnt_and_others_read(tmp_path):
    known = [recording(2 + k, 0.5 * np.pi * (k % 2), k) for k in range(4)]
    model, report = ts.calibrate_reflex([records for records, _ in known], [forces for _, forces in known])
    assert model.knows_shear and model.degree == 1 and report["no_shear"] == "" and "AVG" in model.rule + "AVG"
    assert report["frames"] == 2400 and report["left_out"]["rms_error_N"] < 0.05
    model.save(tmp_path / "reflex.json")
    reader = ts.ReflexReader(ts.ReflexModel.load(tmp_path / "reflex.json"), stop_above_N=2)
    records, forces = recording(3.5, 0.25 * np.pi, 10)
    read = [reader.read(record) for record in records]
    got = np.array([one.force_N for one in read])
    assert np.sqrt(((got - forces)**2).sum(axis=1).mean()) < 0.05
    stopped = np.array([one.stop for one in read])
    assert (stopped == np.maximum.accumulate(got[:, 2] > 2)).all() and stopped[-1]
    assert {one.fault for one in read} == {"none"} and read[300].force_present and not read[0].force_present
    reader.restart()
    dark = reader.read({"dx": 0, "dy": 0, "squal": 0, "maximum": 0, "minimum": 0, "average": 0.0})
    assert dark.fault == "dark" and not dark.stop
    with pytest.raises(ts.Error, match="statistics: 'average' is missing"):
        reader.read({"dx": 0, "dy": 0, "squal": 0, "maximum": 0, "minimum": 0})
    with pytest.raises(ts.Error, match="statistics: dx"):
        reader.read({**{name: 0 for name, _ in FIELDS}, "dx": 0.5})

    blind, report = ts.calibrate_reflex([records], [forces[:, 2]], degree=2)
    assert not blind.knows_shear and report["left_out"] is None and "not every frame's" in report["no_shear"]
    assert np.isnan(ts.ReflexReader(blind).read(records[300]).force_N[:2]).all()
    with pytest.raises(ts.Error, match="forces_N: 599 are given for a recording of 600 frames"):
        ts.calibrate_reflex([records], [forces[:-1]])
    with pytest.raises(ts.Error, match="are given for 2 recordings, there are 1"):
        ts.calibrate_reflex([records], [forces, forces])
    with pytest.raises(ts.Error, match="records with the fields dx, dy"):
        ts.calibrate_reflex([np.zeros(600)], [forces])


def dots(press_mm, lateral_mm=(0, 0), seed=0):
    """Dots 16 mm before a pinhole, 0.47 mm a pixel, as a chip of 18 x 18 pixels sees them."""
    places = np.random.default_rng(1).uniform(-0.6, 0.6, (81, 2)) + [(4.3 * i, 4.3 * j) for i in range(-4, 5) for j in range(-4, 5)]
    dilation = 16 / (16 - press_mm)
    fine = (np.arange(18 * 4) + 0.5) / 4 - 9
    at = (np.stack(np.meshgrid(fine, fine), axis=-1) - dilation / 0.47 * np.array(lateral_mm)) / dilation
    away = np.linalg.norm(at[:, :, None] - places, axis=-1).min(axis=-1)
    light = 3 + 33 * np.clip((1.06 - away) / 0.5 + 0.5, 0, 1)
    picture = light.reshape(18, 4, 18, 4).mean(axis=(1, 3)) + 0.3 * np.random.default_rng(seed).normal(size=(18, 18))
    return np.clip(np.round(picture), 0, 63).astype(np.uint8)


def force_N(press_mm):
    return 1.1293 * np.expm1(0.4677 * press_mm)


def presses(depths_and_axes):
    """Down, sideways to and fro, up: (press_mm, (x, y)) of each picture, in small steps."""
    steps = []
    for depth, axis in depths_and_axes:
        steps += [(z, (0, 0)) for z in np.arange(0, depth, 0.25)]
        steps += [(depth, tuple(side * np.array(axis))) for side in (0, 0.3, 0.6, 0.9, 0.6, 0.3, 0, -0.3, -0.6, -0.3)]
        steps += [(z, (0, 0)) for z in np.arange(depth, 0, -0.25)]
    return steps


def test_dots_of_known_presses_are_learnt_and_others_read(tmp_path):
    rest = [dots(0, seed=k) for k in range(100, 104)]
    readings, press, lateral, series = [], [], [], []
    for number, run in enumerate(([(2, (1, 0)), (4, (0, 1))], [(3.5, (1, 0)), (2.5, (0, 1))])):
        tracker = ts.ExploreTracker(rest)
        for k, (z, side) in enumerate(presses(run)):
            readings.append(tracker.track(dots(z, side, seed=k), t_us=200000 * k))
            press.append(z), lateral.append(side), series.append(number)
    forces = np.column_stack([0.5 * np.array(lateral), force_N(np.array(press))])
    model, report = ts.calibrate_explore(readings, press, forces, lateral_mm=lateral, series=series)
    assert model.knows_shear and report["left_out"]["press_rms_error_mm"] < 0.1
    model.save(tmp_path / "explore.json")
    model = ts.ExploreModel.load(tmp_path / "explore.json")

    tracker = ts.ExploreTracker(rest)
    others = presses([(3, (0.7, 0.7))])
    found = [model.estimate(tracker.track(dots(z, side, seed=500 + k))) for k, (z, side) in enumerate(others)]
    off = np.array([(f.press_mm - z, *(f.force_N - (*(0.5 * np.array(side)), force_N(z)))) for f, (z, side) in zip(found, others)])
    rms = np.sqrt((off**2).mean(axis=0))
    assert rms[0] < 0.1 and rms[1] < 0.05 and rms[2] < 0.05 and rms[3] < 0.2, rms
    assert abs(np.array(found[15].lateral_mm)).max() > 0.1
    held = tracker.track(np.zeros((18, 18), np.uint8))
    assert held.mode == "held" and held.fault == "dark" and held.t_us == len(others)
    assert tracker.track(dots(0)).mode == "absolute"
    tracker.restart(rest[0])
    assert tracker.track(dots(1)).dilation == pytest.approx(16 / 15, abs=0.01)
    with pytest.raises(ts.Error, match="t_us: with pixel_rate_Hz it must be given"):
        ts.ExploreTracker(rest, pixel_rate_Hz=1500).track(dots(0))
    with pytest.raises(ts.Error, match="flat"):
        ts.ExploreTracker(np.full((18, 18), 20, np.uint8))
    with pytest.raises(ts.Error, match="press_mm: 2 are given, there are"):
        ts.calibrate_explore(readings, press[:2], forces)
