"""Estimators over a user's own arrays; their own tests are in tests/sensors."""

import os
import subprocess
import threading

import numpy as np
import pytest

import touchstone as ts


def beads_picture(places, size=(240, 320), radius=8.0):
    rows, columns = np.mgrid[:size[0], :size[1]] + 0.5
    cover = np.zeros(size)
    for x, y in places:
        cover = np.maximum(cover, np.clip(radius + 0.5 - np.hypot(columns - x, rows - y), 0, 1))
    return np.round(200 - 150 * cover).astype(np.uint8)


REST = np.array([(160 + 60 * i, 120 + 60 * j) for j in (-1, 0, 1) for i in (-1, 0, 1)], float)


def test_beads_are_followed_and_a_force_is_learnt_and_read():
    tracker = ts.BeadTracker(grid=3, roi_a_px=200)
    rest = tracker.track(beads_picture(REST), 0)
    assert rest.found == 9 and set(rest.status) == {"found"}
    assert abs(rest.positions_px - REST).max() < 0.1
    rng = np.random.default_rng(4)
    shifts = rng.uniform(-3, 3, (60, 2))
    spread = rng.uniform(0, 0.05, 60)
    positions = [rest.positions_px + shift + s * (REST - REST.mean(axis=0)) for shift, s in zip(shifts, spread)]
    forces = np.column_stack([0.3 * shifts, 20 * spread])
    trained = ts.train_stiffness(rest.positions_px, positions, forces)
    model = trained["model"]
    assert (trained["rms_error_N"] < 0.02).all() and (trained["r2"] > 0.99).all()
    moved = tracker.track(beads_picture(REST + (2.0, -1.0)), 33000)
    estimate = model.estimate(moved, rest=rest.positions_px)
    assert estimate.beads_missing == 0 and estimate.t_us == 33000
    assert estimate.force_N == pytest.approx([0.6, -0.3, 0], abs=0.08)
    with pytest.raises(ts.Error, match="times must increase"):
        tracker.track(beads_picture(REST), 33000)
    with pytest.raises(ts.Error, match="rest: 2 positions are given"):
        model.estimate(moved, rest=REST[:2])


def test_a_model_is_kept_to_the_bit(tmp_path):
    rest = REST
    positions = [rest + (k, 0.5 * k) + 0.01 * k * (rest - rest.mean(axis=0)) for k in range(6)]
    model = ts.train_stiffness(rest, positions, [(k, 0.5 * k, 2 * k) for k in range(6)])["model"]
    path = str(tmp_path / "model.json")
    model.save(path)
    again = ts.StiffnessForceModel.load(path)
    assert np.array_equal(again.rest_px, model.rest_px) and again.grid == 3
    (tmp_path / "model.json").write_text("{}")
    with pytest.raises(ts.Error, match="model.json"):
        ts.StiffnessForceModel.load(path)


def test_settings_out_of_range_name_themselves():
    with pytest.raises(ts.Error, match="polarity: 'grey' is not known"):
        ts.BeadTracker(polarity="grey")
    with pytest.raises(ts.Error, match="form: 'x' is not known"):
        ts.train_stiffness(REST, [REST], [(1, 0, 0)], form="x")
    with pytest.raises(ts.Error, match="grid"):
        ts.BeadTracker(grid=1)


def dots_picture(places, polarity="dark", size=(240, 320), radius=5.0):
    """Dots under light that falls off to the corners, antialiased."""
    rows, columns = np.mgrid[:size[0], :size[1]] + 0.5
    cover = np.zeros(size)
    for x, y in places:
        cover = np.maximum(cover, np.clip(radius + 0.5 - np.hypot(columns - x, rows - y), 0, 1))
    light = 1 - 0.4 * np.hypot((columns - 160) / 200, (rows - 120) / 200) ** 2
    levels = 190 - 170 * cover if polarity == "dark" else 10 + 180 * cover
    return np.round(light * levels).astype(np.uint8)


NINE_BY_NINE = np.array([(50.3 + 27 * i, 12.2 + 27 * j) for j in range(9) for i in range(9)])
RINGS = np.array([(160.4, 120.6)] + [(160.4 + 25 * k * np.cos(a), 120.6 + 25 * k * np.sin(a)) for k in (1, 2, 3, 4)
                                     for a in np.arange(6 * k) * np.pi / 3 / k])


@pytest.mark.parametrize("polarity", ["dark", "bright"])
@pytest.mark.parametrize("places", [NINE_BY_NINE, RINGS], ids=["nine by nine", "rings"])
def test_markers_of_any_layout_are_followed(places, polarity):
    tracker = ts.MarkerTracker(dots_picture(places, polarity))
    assert tracker.polarity == polarity and tracker.rest_px.shape == places.shape
    apart = np.linalg.norm(places[:, None] - places[None], axis=2) + 1e9 * np.eye(len(places))
    assert abs(tracker.diameter_px - 10) < 2.5 and abs(tracker.spacing_px - np.median(apart.min(axis=1))) < 0.5
    number = np.array([np.linalg.norm(tracker.rest_px - place, axis=1).argmin() for place in places])
    assert len(set(number)) == len(places)
    for k in range(1, 6):  # in all more than half of what lies between two
        moved = places + 3.5 * k * np.exp(-((places - (160, 120)) ** 2).sum(axis=1) / 8000)[:, None] * (0.8, -0.6)
        seen = tracker.track(dots_picture(moved, polarity))
        assert seen.trusted.all() and seen.found == len(places) and not seen.jumped and seen.light == "normal"
        error = seen.displacement_px[number] - (moved - places)
        assert np.sqrt((error ** 2).sum(axis=1).mean()) < 0.1
    assert seen.trusted.dtype == bool and set(seen.status) == {"found"}
    assert np.allclose(seen.positions_px - seen.rest_px, seen.displacement_px)

    hidden = 40 if len(places) == 81 else 10
    without = tracker.track(dots_picture(np.delete(moved, hidden, axis=0), polarity))
    assert not without.trusted[number[hidden]] and without.trusted.sum() == len(places) - 1
    assert without.status[number[hidden]] == "hidden"
    assert np.linalg.norm(without.positions_px[number[hidden]] - moved[hidden]) < 8, "held with its neighbours"
    assert tracker.track(dots_picture(moved, polarity)).status[number[hidden]] == "found again"
    dark = tracker.track(np.zeros((240, 320), np.uint8))
    assert dark.light == "dark" and not dark.trusted.any()


def test_a_frame_at_rest_that_was_touched_is_said():
    pressed = NINE_BY_NINE + 6 * np.exp(-((NINE_BY_NINE - (160, 120)) ** 2).sum(axis=1) / 4000)[:, None] * (0.8, -0.6)
    tracker = ts.MarkerTracker(dots_picture(NINE_BY_NINE))
    assert not tracker.track(dots_picture(pressed)).rest_was_touched
    assert not tracker.track(dots_picture(NINE_BY_NINE)).rest_was_touched
    wrong = ts.MarkerTracker(dots_picture(pressed))
    assert wrong.track(dots_picture(NINE_BY_NINE)).rest_was_touched
    assert wrong.track(dots_picture(pressed)).rest_was_touched, "it stays so"


def test_a_marker_tracker_keeps_time_and_starts_again():
    tracker = ts.MarkerTracker(dots_picture(NINE_BY_NINE))
    times = [tracker.track(dots_picture(NINE_BY_NINE), t).t_us for t in (None, None, 1000, None)]
    assert times == [0, 1, 1000, 1999]
    for bad in (1999, -5):
        with pytest.raises(ts.Error, match="time"):
            tracker.track(dots_picture(NINE_BY_NINE), bad)
    for bad in (1.5, "3", 2**64, float("nan")):
        with pytest.raises(ts.Error, match="^t_us: "):
            tracker.track(dots_picture(NINE_BY_NINE), bad)
    tracker.track(dots_picture(NINE_BY_NINE), 2**63 - 1)
    with pytest.raises(ts.Error, match="^t_us: it must be given"):
        tracker.track(dots_picture(NINE_BY_NINE))
    tracker.restart(dots_picture(RINGS))
    assert len(tracker.rest_px) == len(RINGS) and tracker.track(dots_picture(RINGS)).t_us == 0


def test_pictures_without_markers_are_refused_and_change_nothing():
    good = dots_picture(NINE_BY_NINE)
    tracker = ts.MarkerTracker(good)
    for bad, why in ((np.full((240, 320), 255, np.uint8), "saturated"), (np.zeros((240, 320), np.uint8), "dark"),
                     (dots_picture([]), "shows none"), (dots_picture([(160, 120)]), "shows none"),
                     (np.full((240, 320), np.nan), "rest"), (good.astype(np.float32), "rest"),
                     (good.astype(np.uint16), "8 bit"), (np.zeros((0, 3), np.uint8), ""), (None, "rest")):
        with pytest.raises(ts.Error, match=why):
            ts.MarkerTracker(bad)
        with pytest.raises(ts.Error, match=why):
            tracker.restart(bad)
    for bad, why in ((good[:100], "320 x 100 px, the first one was 320 x 240"), (np.full((240, 320), np.nan), "frame"),
                     (np.dstack([good] * 4), "frame")):
        with pytest.raises(ts.Error, match=why):
            tracker.track(bad)
    assert tracker.track(good).trusted.all()


def touched_picture(places, centre=(160, 120), radius=70.0):
    """Dots, and a disc that is brighter than the gel at rest."""
    rows, columns = np.mgrid[:240, :320] + 0.5
    disc = np.clip(radius + 0.5 - np.hypot(columns - centre[0], rows - centre[1]), 0, 1)
    return np.minimum(dots_picture(places) * (1 + 0.3 * disc), 255).astype(np.uint8)


def turned(places, degrees, shift=(0.0, 0.0)):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return (places - (160, 120)) @ np.array([[c, s], [-s, c]]) + (160, 120) + shift


def test_a_touch_is_read_from_pictures_alone():
    reader = ts.TouchReader(dots_picture(NINE_BY_NINE))
    nothing = reader.read(dots_picture(NINE_BY_NINE))
    assert not nothing.touched and nothing.slip == "no contact" and nothing.centre_px is None and nothing.trusted
    assert nothing.height_mm is None and np.isnan(nothing.force_N).all() and np.isnan(nothing.turn_deg)
    touch = reader.read(touched_picture(turned(NINE_BY_NINE, 4, (3, -2))))
    assert touch.touched and abs(touch.centre_px - (160, 120)).max() < 4
    assert touch.turn_deg == pytest.approx(4, abs=0.2) and 0 < touch.turn_error_deg < 0.2
    markers = touch.markers.positions_px
    on = np.linalg.norm(markers - touch.centre_px, axis=1) < 60
    assert abs(touch.moved_px - touch.markers.displacement_px[on].mean(axis=0)).max() < 1
    assert touch.moved_markers >= on.sum() and touch.light == "normal" and not touch.extrapolated
    dark = reader.read(np.zeros((240, 320), np.uint8))
    assert dark.light == "dark" and not dark.trusted
    reader.restart(dots_picture(NINE_BY_NINE))
    assert reader.read(dots_picture(NINE_BY_NINE)).t_us == 0


def test_shear_forces_are_learnt_from_touches_and_kept(tmp_path):
    rest = dots_picture(NINE_BY_NINE)
    reader = ts.TouchReader(rest, mm_per_px=0.05)
    shifts = [(1, 0), (2, 1), (-1, 2), (0, -2), (3, 3), (-2, -1)]
    readings = [reader.read(touched_picture(NINE_BY_NINE + shift)) for shift in shifts]
    forces = np.column_stack([-0.5 * np.array(shifts, float), np.ones(len(shifts))])  # on the object: 10 N a mm
    model, report = ts.fit_touch_forces(readings, forces, series=[0, 0, 0, 1, 1, 1], gel="my gel")
    assert model.shear_N_per_mm == pytest.approx(10, rel=0.02) and model.indenters == [] and model.gel == "my gel"
    assert report["samples"] == 6 and (report["left_out_error_N"][:2] < 0.05).all() and np.isnan(report["rms_error_N"][2])
    path = str(tmp_path / "force.json")
    model.save(path)
    reader = ts.TouchReader(rest, force=ts.GelForceModel.load(path))
    touch = reader.read(touched_picture(NINE_BY_NINE + (1.5, -1)))
    assert touch.force_N[:2] == pytest.approx([-0.75, 0.5], abs=0.03) and np.isnan(touch.force_N[2])
    assert (touch.force_error_N[:2] > 0).all() and not touch.extrapolated
    assert reader.read(touched_picture(NINE_BY_NINE + (5, 2))).extrapolated

    for bad, why in ((dict(mm_per_px=0.06, force=model), "0.05 mm a pixel"), (dict(indenter="ball"), "^indenter: "),
                     (dict(force=model, indenter="ball"), "height model"), (dict(mm_per_px=-1), "mm_per_px")):
        with pytest.raises(ts.Error, match=why):
            ts.TouchReader(rest, **bad)
    for bad, why in ((dict(forces_N=forces[:2]), "forces_N: 2 are given, there are 6"),
                     (dict(series=[1]), "series: 1 are given, there are 6"), (dict(readings=[1] * 6), "number 0 isn't"),
                     (dict(forces_N=forces[:, [1, 0, 2]] * (-1, 1, 1)), "don't go against the forces"),
                     (dict(readings=[]), "0 readings")):
        with pytest.raises(ts.Error, match=why):
            ts.fit_touch_forces(**{"readings": readings, "forces_N": forces, **bad})
    with pytest.raises(ts.Error, match="must be given heights or mm_per_px"):
        ts.fit_touch_forces([ts.TouchReader(rest).read(rest)], forces[:1])


def woven(period_mm, number, mm_per_px=0.05):
    rng = np.random.default_rng(number)
    x, y = turned(mm_per_px * np.mgrid[:100, :120].reshape(2, -1).T, rng.uniform(0, 360)).T.reshape(2, 100, 120)
    return 0.02 * np.sin(2 * np.pi * x / period_mm) * np.sin(2 * np.pi * y / period_mm) + rng.normal(0, 0.002, x.shape)


def test_materials_are_learnt_and_named(tmp_path):
    model = ts.TextureModel(mm_per_px=0.05, grey_step_mm=0.004)
    with pytest.raises(ts.Error, match="no sample"):
        model.classify(woven(0.6, 1))
    for name, period in (("linen", 0.6), ("denim", 1.1), ("silk", 0.35)):
        for k in range(5):
            model.learn(name, woven(period, k))
    assert model.materials == ["linen", "denim", "silk"] and model.samples == 15
    path = str(tmp_path / "model.texture")
    model.save(path)
    model = ts.TextureModel.load(path)
    for name, period in (("linen", 0.6), ("denim", 1.1), ("silk", 0.35)):
        match = model.classify(woven(period, 100), mm_per_px=0.05)
        assert match.material == name and match.votes >= 2 and match.distance < 0.3
    assert model.classify(np.zeros((100, 120))).distance > 2 * match.distance
    for bad, why in ((np.zeros((4, 4)), "at least 33 x 33"), (np.full((100, 100), np.nan), "finite"), (np.zeros(9), "height, width"),
                     (np.full((100, 100), "1"), "numbers"), (None, "height_mm"), (np.zeros((9000, 100)), "at most 8192")):
        with pytest.raises(ts.Error, match=why):
            model.classify(bad)
    with pytest.raises(ts.Error, match="0.06"):
        model.classify(woven(0.6, 1), mm_per_px=0.06)


def strewn(pose=(0.0, 0.0, 0.0), seed=3):
    """Studs and rings at random, seen at x, y (mm) and degrees: (240, 320) heights at 0.05 mm a pixel, with noise."""
    rng = np.random.default_rng(seed)
    rows, columns = np.mgrid[:240, :320]
    places = np.stack([(columns - 159.5).ravel(), (rows - 119.5).ravel()], axis=1) * 0.05
    c, s = np.cos(np.radians(pose[2])), np.sin(np.radians(pose[2]))
    places = places @ np.array([[c, s], [-s, c]]) + pose[:2]
    height = np.zeros(len(places))
    for x, y, ring, width, high in zip(rng.uniform(-12, 12, 250), rng.uniform(-12, 12, 250), rng.uniform(0, 0.9, 250),
                                       rng.uniform(0.1, 0.2, 250), rng.uniform(0.03, 0.09, 250)):
        from_ring = abs(np.hypot(places[:, 0] - x, places[:, 1] - y) - (ring if ring > 0.4 else 0)) / width
        height = np.maximum(height, high * np.exp(-0.5 * from_ring**2))
    return (0.1 + height + np.random.default_rng(abs(seed + int(100 * sum(pose)))).normal(0, 0.002, len(height))).reshape(240, 320)


def test_touches_are_placed_on_a_map(tmp_path):
    tactile_map = ts.TactileMap()
    assert tactile_map.touches == 0 and tactile_map.height_mm is None
    with pytest.raises(ts.Error, match="empty"):
        tactile_map.save(str(tmp_path / "map"))
    assert tactile_map.add(strewn(), mm_per_px=0.05, contact=np.ones((240, 320), bool)).localised
    assert tactile_map.add(strewn((2.0, 1.0, 10.0)), mm_per_px=0.05).localised and tactile_map.touches == 2
    path = str(tmp_path / "map")
    tactile_map.save(path)
    tactile_map = ts.TactileMap.load(path)
    assert tactile_map.touches == 2 and tactile_map.height_mm.shape[1] > 330 and tactile_map.origin_px.shape == (2,)
    found = tactile_map.localise(strewn((1.0, -0.5, -25.0)), mm_per_px=0.05)
    assert found.localised and found.outcome == "localised" and found.correlation > 0.9 and found.overlap > 0.8
    assert found.place_mm == pytest.approx([1.0, -0.5], abs=0.02) and found.angle_deg == pytest.approx(-25, abs=0.1)
    stranger = tactile_map.localise(strewn(seed=8), mm_per_px=0.05)
    assert not stranger.localised and stranger.place_mm is None and stranger.angle_deg is None
    for bad, why in ((dict(mm_per_px=0.07), "0.07"), (dict(mm_per_px=0), "mm_per_px"),
                     (dict(contact=np.ones((3, 3))), "contact: is 3 x 3, the heights are 240 x 320")):
        with pytest.raises(ts.Error, match=why):
            tactile_map.localise(strewn(), **{"mm_per_px": 0.05, **bad})


def grasp_events(number, start_us=10**9, power=0.5):
    """Events of a grasp by a formula, and its force in windows of 7 ms: rest, a rise in 22 windows, hold, release."""
    rng = np.random.default_rng(number)
    window = np.arange(180)
    peak, speed = rng.uniform(1.5, 3.5), rng.uniform(0.8, 1.2)
    force = np.where(window < 30, 0, peak * (1 - np.exp(-3 * speed * (window - 29) / 22)))
    force = np.where(window >= 152, peak * np.exp(-0.5 * np.clip(window - 151, 0, None)), force)
    change = 4000 * np.diff((np.maximum(force, 0) / 3.5)**power, prepend=0)
    off, on = rng.poisson(20 + np.maximum(change, 0)), rng.poisson(20 + np.maximum(-1.5 * change, 0))
    t_us = [np.sort(rng.integers(7000 * k, 7000 * (k + 1), off[k] + on[k])) for k in window]
    t_us[0][0] = 0
    events = np.empty(sum(map(len, t_us)), [("t_us", "i8"), ("x", "u2"), ("y", "u2"), ("on", "?")])
    events["t_us"] = np.concatenate(t_us) + start_us
    events["x"], events["y"] = rng.integers(0, 32, len(events)), rng.integers(0, 24, len(events))
    events["on"] = np.concatenate([rng.permutation(np.arange(off[k] + on[k]) < on[k]) for k in window])
    return events, force


def write_grasp(folder, number):
    events, force = grasp_events(number)
    np.savetxt(folder / f"{number}.txt", np.column_stack([events[name] for name in ("t_us", "x", "y", "on")]), fmt="%d",
               header="t x y p", comments="# ")
    middles = 10**9 + 7000 * np.arange(len(force)) + 3500
    np.savetxt(folder / f"{number}.csv", np.column_stack([middles, force]), fmt="%d,%.5f", header="t_us,force_N",
               comments="")


@pytest.mark.skipif("TOUCHSTONE_PROGRAM" not in os.environ, reason="the command makes the model")
def test_forces_of_events_are_read_as_they_come(tmp_path):
    for number in range(8):
        write_grasp(tmp_path, number)
    (tmp_path / "grasps.csv").write_text("events,forces,material\n" + "".join(f"{k}.txt,{k}.csv,\n" for k in range(8)))
    path = str(tmp_path / "force.json")
    subprocess.run([os.environ["TOUCHSTONE_PROGRAM"], "--quiet", "calibrate", "event-force", "--grasps",
                    str(tmp_path / "grasps.csv"), "--size", "32x24", "--left-out", "4", "-o", path], check=True)
    model = ts.EventForceModel.load(path)
    assert model.method == "process" and 0 < model.left_out_error_N < 0.5
    # Python learns the same, to the bit.
    tables = [np.loadtxt(tmp_path / f"{k}.csv", delimiter=",", skiprows=1) for k in range(8)]
    learnt, report = ts.train_event_force([grasp_events(k)[0] for k in range(8)],
                                          [(table[:, 0].astype(int), table[:, 1]) for table in tables], size=(32, 24), left_out=4)
    learnt.save(tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == (tmp_path / "force.json").read_bytes()
    assert report["left_out"] == 4 and report["left_out_error_N"] == model.left_out_error_N and report["windows"] > 300
    events, force = grasp_events(100)
    reader = ts.EventForceReader(model, size=(32, 24))
    for part in np.array_split(events, 50):
        reader.add(part)
    assert len(reader.force_N) == len(reader.t_us) >= 178
    assert (np.diff(reader.t_us) == 7000).all() and reader.t_us[0] == events["t_us"][0] + 7000
    assert not reader.touched[:30].any() and reader.touched[31:].all() and (reader.force_N[:30] == 0).all()
    off = reader.force_N[31:52] - force[31:52]
    assert np.sqrt((off**2).mean()) < 0.2 and (abs(off) < 2 * reader.force_error_N[31:52]).mean() > 0.6
    whole = reader.force_N
    reader.restart()
    assert len(reader.force_N) == 0
    reader.add(events)
    reader.end_at(10**9 + 2 * 10**6)
    assert np.array_equal(reader.force_N[:len(whole)], whole) and len(reader.force_N) > len(whole)
    with pytest.raises(ts.Error, match="event"):
        reader.add(events[:5])
    with pytest.raises(ts.Error, match="t_us, x, y and on"):
        reader.add(events["t_us"])
    with pytest.raises(ts.Error, match="^size: "):
        ts.EventForceReader(model, size=(0, 4))
    read = ts.read_events(str(tmp_path / "3.txt"), size=(32, 24))
    assert np.array_equal(read, grasp_events(3)[0])


def test_materials_of_events_are_learnt_and_named(tmp_path):
    powers = {"foam": 0.4, "steel": 0.85}
    names = [name for _ in range(12) for name in powers]
    grasps = [grasp_events(k, power=powers[name])[0] for k, name in enumerate(names)]
    model, report = ts.train_event_material(grasps, names, size=(32, 24))
    assert model.materials == ["foam", "steel"] and report["left_out_right"] > 0.8
    model.save(tmp_path / "material.json")
    model = ts.EventMaterialModel.load(tmp_path / "material.json")
    right = 0
    for k in range(100, 110):
        for label, power in enumerate(powers.values()):
            guess = model.classify(grasp_events(k, power=power)[0], size=(32, 24))
            assert guess.sum() == pytest.approx(1)
            right += guess.argmax() == label
    assert right >= 17  # of 20
    with pytest.raises(ts.Error, match="materials: 23 are given, there are more grasps"):
        ts.train_event_material(grasps, names[:-1], size=(32, 24))
    with pytest.raises(ts.Error, match="grasps: number 1: .*touch"):
        ts.train_event_material([grasps[0], grasps[1][:3000]], names[:2], size=(32, 24))
    with pytest.raises(ts.Error, match="readings: t_us must be an array of whole numbers"):
        ts.train_event_force(grasps[:3], [((0.5, 1.5), (0, 1))] * 3, size=(32, 24))
    with pytest.raises(ts.Error, match="readings: ends at 2000000000 us|readings: "):
        ts.train_event_force(grasps[:3], [(np.array([0, 5]), (0, 1))] * 3, size=(32, 24))


def markers_picture(shift=(0.0, 0.0), side=16.0, spacing=40.0, grid=4):
    """Yellow films of 20 px, soft magenta squares seen through them and beside them; rims are antialiased."""
    size = int(spacing * (grid + 1.5))
    rows, columns = np.mgrid[:size, :size] + 0.5

    def square(x, y, width):
        along = [np.clip(width / 2 + 0.5 - abs(at - c), 0, 1) for at, c in ((columns, x), (rows, y))]
        return along[0] * along[1]

    white = np.full((size, size, 3), 220.0)  # BGR
    for j in range(grid):
        for i in range(grid):
            x, y = spacing * (i + 1.25), spacing * (j + 1.25)
            ink = square(x + shift[0] + 4, y + shift[1] + 4, side)
            film = square(x, y, 20.0)
            white[..., 1] *= 1 - 0.85 * ink
            white[..., 0] *= 1 - 0.85 * film
    return np.round(white).astype(np.uint8)


def test_coloured_markers_are_read_and_their_motion_learnt(tmp_path):
    reader = ts.ColourMarkerReader(markers_picture(), grid=(4, 4))
    rest = reader.rest
    assert rest.grid == (4, 4) and set(rest.flaws) == {"none"}
    MM_PER_PX = 3.0 / 40.0
    samples = []
    for series, (x, y, growth) in enumerate((x, y, g) for x in (-3, 0, 3) for y in (-3, 0, 3) for g in (0, 1, 2)):
        reading = reader.read(markers_picture((x, y), 16.0 + growth))
        for marker in range(16):
            if reading.flaws[marker] == "none":
                samples.append((reading, marker, (x * MM_PER_PX, y * MM_PER_PX, -0.2 * growth), series))
    model = ts.calibrate_hue(rest, samples, spacing_mm=3.0)
    assert model.samples == len(samples) and model.rms_error_mm < 0.15
    path = str(tmp_path / "hue.json")
    model.save(path)
    estimator = ts.HueEstimator(ts.HueModel.load(path), rest)
    field = estimator.estimate(reader.read(markers_picture((2, -1), 17.0)))
    assert field.measured.all() and not field.extrapolated.any()
    wanted = (2 * MM_PER_PX, -1 * MM_PER_PX, -0.2)
    assert abs(field.displacement_mm.mean(axis=0) - wanted).max() < 0.06
    still = estimator.estimate(rest)
    assert abs(still.displacement_mm).max() < 1e-12
    with pytest.raises(ts.Error, match="marker 16"):
        ts.calibrate_hue(rest, [(rest, 16, (0, 0, 0), 0)], spacing_mm=3.0)
    larger = ts.ColourMarkerReader(markers_picture(grid=5), grid=(5, 5)).rest
    with pytest.raises(ts.Error, match="samples: sample 0 is of a grid of 5 x 5, the one at rest has 4 x 4"):
        ts.calibrate_hue(rest, [(larger, 24, (0, 0, 0), -1), *samples], spacing_mm=3.0, form="best")
    with pytest.raises(ts.Error, match="viewing_distance_mm: 1 is not allowed; allowed is 0 or from 10 to"):
        ts.calibrate_hue(rest, samples, spacing_mm=3.0, viewing_distance_mm=1)


def darkness_pictures(channels=3):
    """At rest, and with a ball of radius 2 mm pressed 0.8 mm deep, 0.05 mm a pixel."""
    rows, columns = 0.05 * (np.mgrid[:90, :120] + 0.5)
    cap = 0.8 - 2.0 + np.sqrt(np.maximum(0.0, 4.0 - (columns - 3.0)**2 - (rows - 2.2)**2))
    pressed = 160.0 * (1.0 - 0.2 * np.maximum(cap, 0.0))
    return [np.repeat(np.round(grey).astype(np.uint8)[..., None], channels, axis=2)
            for grey in (np.full_like(pressed, 160.0), pressed)]


def test_darkness_gives_heights(tmp_path):
    rest, pressed = darkness_pictures()
    model, report = ts.calibrate_darkness([pressed], [4.0], [rest], mm_per_px=0.05)
    assert report["depths_mm"][0] == pytest.approx(0.8, abs=0.03)
    assert report["circles"][0][:2] == pytest.approx((60.0, 44.0), abs=0.5)
    assert report["fitted"]["rms_mm"] < 0.01 and report["held_out"]["rms_mm"] < 0.03
    assert model.deepest_mm == pytest.approx(0.8, abs=0.06) and model.picture_shape == (90, 120)
    assert model.height_at(0.08) == pytest.approx(0.4, abs=0.03) and model.height_at(0.0) == 0.0
    model.save(str(tmp_path / "m.dark"))
    estimator = ts.DarknessEstimator(ts.DarknessModel.load(str(tmp_path / "m.dark")))
    result = estimator.estimate(pressed)
    assert result.height_mm.dtype == np.float32 and result.height_mm[44, 60] == pytest.approx(0.8, abs=0.03)
    assert result.contact.dtype == bool and result.contact.sum() == result.contact_pixels > 0
    assert result.doubt.dtype == np.uint8 and result.exposure_followed and result.exposure == pytest.approx(1.0)
    assert result.trusted and not result.contact_at_border
    kept = result.height_mm.copy()
    assert estimator.estimate(rest).contact_pixels == 0
    assert np.array_equal(result.height_mm, kept), "a result isn't overwritten by later frames"
    grey = [picture[..., 0] for picture in (rest, pressed)]
    assert ts.calibrate_darkness([grey[1]], [4.0], [grey[0]], mm_per_px=0.05)[1]["pixels"] == report["pixels"]
    with pytest.raises(ts.Error, match="the frame is grey; the rest picture is in colour"):
        estimator.estimate(grey[1])
    with pytest.raises(ts.Error, match="frame 0: where it's touched it is brighter than the rest picture"):
        ts.calibrate_darkness([rest], [4.0], [pressed], mm_per_px=0.05)
    near = ts.calibrate_darkness([pressed], [4.0], [rest], mm_per_px=0.05, camera_distance_mm=20)[0]
    assert near.height_at(0.08) > model.height_at(0.08) + 0.005, "before a near camera what is pressed in looks larger"
    with pytest.raises(ts.Error, match="camera_distance_mm: 0.5 is not allowed"):
        ts.calibrate_darkness([pressed], [4.0], [rest], mm_per_px=0.05, camera_distance_mm=0.5)
    with pytest.raises(ts.Error, match="smoothing_px: 11 is not allowed"):
        ts.calibrate_darkness([pressed], [4.0], [rest], mm_per_px=0.05, smoothing_px=11)
    with pytest.raises(ts.Error, match="circles: there are 2 for 1 frames"):
        ts.calibrate_darkness([pressed], [4.0], [rest], mm_per_px=0.05, circles=[None, None])


def test_heights_are_checked_and_shared_between_threads(sensor, ball):
    background = [sensor.background(frame=k) for k in range(2)]
    touch = sensor.press(ball, depth_mm=0.4)
    frame = touch.frame
    circle = (*sensor.pixel_from_gel((0, 0)), np.sqrt(touch.contact.sum() / np.pi))
    model, report = ts.calibrate_height([frame], [3.0], background, mm_per_px=sensor.mm_per_px, circles=[circle])
    assert report["pixels"] > 30 and model.picture_shape == sensor.picture_shape
    estimator = ts.HeightEstimator(model)
    one = estimator.estimate(frame)
    kept = one.height_mm.copy()
    many = [None] * 4
    threads = [threading.Thread(target=lambda k=k: many.__setitem__(k, estimator.estimate(background[k % 2])))
               for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert np.array_equal(one.height_mm, kept), "a result isn't overwritten by later frames"
    assert np.array_equal(many[0].height_mm, many[2].height_mm)
    assert one.contact.any() and not many[0].contact.any()
    with pytest.raises(ts.Error, match="80 x 60|60 x 80|size"):
        estimator.estimate(frame[:50])
    with pytest.raises(ts.Error, match="there are 2 for 1 frames"):
        ts.calibrate_height([frame], [3.0, 4.0], background, mm_per_px=0.1)
    with pytest.raises(ts.Error, match="no picture is given"):
        ts.calibrate_height([], [], background, mm_per_px=0.1)
    for diameter in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(ts.Error, match="ball_diameters_mm: number 0 of it is"):
            ts.calibrate_height([frame], [diameter], background, mm_per_px=0.1)
    for scale in (0.0, -1.0, 1e-9, 11.0, float("nan"), float("inf")):
        with pytest.raises(ts.Error, match="mm_per_px: .* is not allowed"):
            ts.calibrate_height([frame], [3.0], background, mm_per_px=scale)
    with pytest.raises(ts.Error, match="mm_per_px 0.001: with it the ball's radius is"):
        ts.calibrate_height([frame], [3.0], background, mm_per_px=1e-3)
    with pytest.raises(ts.Error, match="ball_diameters_mm: number 0 of it: a number is needed, this is 'x'"):
        ts.calibrate_height([frame], ["x"], background, mm_per_px=0.1)
    with pytest.raises(ts.Error, match="frames: a picture of shape .* is too large"):
        ts.calibrate_height([np.broadcast_to(np.uint8(1), (2**31, 2**20, 3))], [3.0], background, mm_per_px=0.1)
    with pytest.raises(ts.Error, match="border: 'open' is not known"):
        ts.HeightEstimator(model, border="open")
    with pytest.raises(ts.Error, match="follow_frames: -1 is not allowed"):
        ts.HeightEstimator(model, follow_frames=-1)
    # Light that has changed at once isn't followed, but new frames at rest are taken.
    estimator = ts.HeightEstimator(model, follow_frames=10)
    darker = [(0.8 * rest.astype(float)).astype(np.uint8) for rest in background]
    result = estimator.estimate(darker[0])
    assert result.rest_share < 0.05 and not result.trusted
    estimator.set_rest(darker)
    result = estimator.estimate(darker[0])
    assert result.rest_share > 0.95 and result.trusted and not result.contact.any()
