"""Every shipped device is pressed by a ball, and delivers what its kind delivers, beside the truth."""

import os
import pathlib

import numpy as np
import pytest

import touchstone as ts

SCENES = pathlib.Path(os.environ["TOUCHSTONE_SCENES"])
DEVICES = sorted(path.stem for path in (SCENES / "devices").glob("*.yaml"))
CLEAR = {"vhs", "vhs-spectral"}
PRINTED = {"chroma", "chroma-compact", "evetac", "gelsight-markers", "gelsight-mini-markers", "reflex", "tactip"}
EVENTS = {"dvs-grasp", "evetac"}
FORCE_N = 0.5
# Of each kind at least one; others are long tests. (Devices that differ in optics alone share a gel.)
QUICK = {"dvs-grasp", "gelsight-portable", "gelsight-webcam", "reflex", "vhs-spectral"}


@pytest.fixture(scope="module", params=[pytest.param(name, marks=() if name in QUICK else pytest.mark.long)
                                        for name in DEVICES])
def touched(request):
    sensor = ts.Sensor(request.param)
    return request.param, sensor, sensor.press("ball-8mm", force_N=FORCE_N)


def test_their_number():
    assert len(DEVICES) == 17 and QUICK < set(DEVICES)


def test_names_of_shipped_objects():
    for path in (SCENES / "objects").glob("*.yaml"):
        assert ts.Object(path.stem).name == ts.Object(path).name  # "cylinder-8.5mm" has no ending
    with pytest.raises(ts.Error, match="cylinder-8.4mm.*did you mean 'cylinder-8.5mm'"):
        ts.Object("cylinder-8.4mm")
    with pytest.raises(ts.Error, match="ball.yaml: can't be read"):
        ts.Object("ball.yaml")


def test_a_ball_makes_a_frame_with_its_force(touched):
    name, sensor, touch = touched
    assert touch.frame.shape[:2] == sensor.picture_shape and touch.frame.dtype == np.uint8
    assert touch.force_N[2] == pytest.approx(FORCE_N, rel=1e-4)
    assert 0 < touch.force_error_N[2] < 0.2 * FORCE_N
    # The picture shows the press: it differs from the untouched one by more than two untouched ones do.
    background = touch.background.astype(float)
    off = np.abs(touch.frame.astype(float) - background).max()
    noise = np.abs(background - sensor.background(noise_seed=7).astype(float)) if name not in CLEAR else 0
    assert off > 3 * np.mean(noise)
    # Where it should: the contact's middle is seen under the ball, at the gel's middle.
    if sensor.picture_shape[0] > 18:
        rows, columns = np.nonzero(touch.contact)
        assert len(rows) > 10
        middle = sensor.gel_from_pixel((columns.mean() + 0.5, rows.mean() + 0.5))
        assert np.linalg.norm(middle) < 0.5


def test_truth_of_its_kind(touched):
    name, sensor, touch = touched
    assert (touch.bead_displacement_mm is not None) == (name in CLEAR)
    if name in CLEAR:
        assert touch.height_mm is None
        assert touch.bead_displacement_mm[:, 2].min() < -0.01
    else:
        assert np.nanmax(touch.height_mm) > 0.02
    assert (touch.markers_mm is not None) == (name in PRINTED)
    if name in PRINTED:
        # The marker nearest to the ball goes in, and all go with the gel: none further than the deepest vertex.
        nearest = np.argmin(np.linalg.norm(touch.markers_mm[:, :2], axis=1))
        deepest = -touch.surface_displacement_mm[:, 2].min()
        assert 0 < -touch.marker_displacement_mm[nearest, 2] <= deepest
        assert np.abs(touch.marker_displacement_mm).max() <= np.abs(touch.surface_displacement_mm).max()


def test_events_of_the_press(touched):
    name, sensor, touch = touched
    if name not in EVENTS:
        assert len(touch.events) == 0
        return
    assert (np.diff(touch.events["t_us"]) >= 0).all()
    if name == "evetac":
        # Dots go with the gel: most events are at their outlines, 11 pixels from their middles, and near the ball.
        events = touch.events
        middles = np.array([sensor.pixel_from_gel(place[:2]) for place in touch.markers_mm])
        places = np.stack([events["x"], events["y"]], axis=1) + 0.5
        nearest = np.linalg.norm(places[:, None] - middles[None], axis=2).min(axis=1)
        assert len(events) > 200 and (np.abs(nearest - 11.4) < 3).mean() > 0.5
        return
    # A dark ball makes the membrane darker where it touches: OFF events there, and no ON event. (The shipped ball is a
    # light grey one, which changes little; elsewhere there is the pixels' own noise.)
    dark = {"name": "dark", "shape": {"type": "sphere", "radius_mm": 4}, "albedo": 0.04}
    events = sensor.press(dark, force_N=2.0).events
    x, y = sensor.pixel_from_gel((0, 0))
    near = np.hypot(events["x"] + 0.5 - x, events["y"] + 0.5 - y) < 12
    assert near.sum() > 200 and not events["on"][near].any()


def test_the_chips_statistics(touched):
    name, sensor, touch = touched
    assert (touch.statistics is not None) == (name == "reflex")
    if name == "reflex":
        statistics = touch.statistics
        assert statistics["maximum"] == touch.frame.max() and statistics["minimum"] == touch.frame.min()
        assert abs(statistics["average"] - touch.frame.mean()) < 128 / 324 + 1e-9


def test_the_same_press_gives_the_same_bytes(touched):
    name, sensor, touch = touched
    again = sensor.press("ball-8mm", force_N=FORCE_N)
    assert np.array_equal(again.frame, touch.frame) and np.array_equal(again.wrench, touch.wrench)
    assert np.array_equal(again.events, touch.events)


def test_a_spectral_device_shows_colour(touched):
    name, sensor, touch = touched
    if name != "vhs-spectral":
        return
    red_ball = {"name": "red", "shape": {"type": "sphere", "radius_mm": 4}, "albedo": "#c02020"}
    coloured = sensor.press(red_ball, force_N=FORCE_N)
    means = coloured.frame[touch.contact > 0].reshape(-1, 3).astype(float).mean(axis=0)
    grey = touch.frame[touch.contact > 0].reshape(-1, 3).astype(float).mean(axis=0)
    blue, green, red = means / grey  # by what a grey ball of 0.6 gives, which is near white
    assert red > 1.1 * green > 1.1 * 1.05 * blue
    # A grey of three equal numbers is one number; three others aren't bands of a spectrum.
    even, one = (sensor.press(dict(red_ball, albedo=albedo), force_N=FORCE_N) for albedo in ([0.6, 0.6, 0.6], 0.6))
    assert np.array_equal(even.frame, one.frame)
    with pytest.raises(ts.Error, match="has 3 numbers, but the scene has"):
        sensor.press(dict(red_ball, albedo=[0.7, 0.6, 0.5]), force_N=FORCE_N)


def test_mechanics_need_no_optics(tmp_path):
    sensor = ts.Sensor({
        "name": "pad",
        "gel": {"size_x_mm": 10, "size_y_mm": 10, "thickness_mm": 3, "youngs_modulus_MPa": 0.2},
        "mesh": {"fine_mm": 0.8, "coarse_mm": 2, "fine_half_extent_mm": [3, 3], "fine_depth_mm": 1},
    })
    touch = sensor.press("ball-8mm", force_N=0.3, look=False)
    assert touch.force_N[2] == pytest.approx(0.3, rel=1e-4) and touch.frame is None
    with pytest.raises(ts.Error, match="no camera"):
        sensor.press("ball-8mm", force_N=0.3)


def test_with_friction_the_gel_sticks_to_a_ball():
    pad = {
        "name": "pad",
        "gel": {"size_x_mm": 14, "size_y_mm": 14, "thickness_mm": 2.5, "youngs_modulus_MPa": 0.2, "poisson_ratio": 0.49},
        "mesh": {"fine_mm": 0.7, "coarse_mm": 2, "fine_half_extent_mm": [4, 4], "fine_depth_mm": 1},
    }
    slid = []
    for friction in (False, True):
        sensor = ts.Sensor(pad, friction=friction)
        touch = sensor.press("ball-8mm", depth_mm=1.0, look=False)
        middle = np.hypot(*sensor.gel_vertices_mm[:, :2].T) < 1.5
        slid.append(np.hypot(*touch.surface_displacement_mm[middle, :2].T).max())
    assert slid[1] < 0.3 * slid[0]
