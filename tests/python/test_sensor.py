import gc
import os
import pathlib
import struct
import subprocess
import sys
import threading
import zlib

import numpy as np
import pytest

import touchstone as ts


def test_a_touch_has_pictures_and_truth_that_belong_together(sensor, ball):
    touch = sensor.press(ball, force_N=0.4, at_mm=(0.5, -0.3))
    height, width = sensor.picture_shape
    assert touch.frame.shape == (height, width, 3) and touch.frame.dtype == np.uint8
    assert touch.ideal.shape == touch.frame.shape
    assert touch.height_mm.dtype == np.float32 and touch.contact.dtype == bool
    assert touch.force_N[2] == pytest.approx(0.4, rel=1e-5)
    assert (touch.force_error_N > 0).all() and touch.force_error_N[2] < 0.1
    assert np.array_equal(touch.wrench[:3], touch.force_N)
    assert touch.pose.shape == (3, 4) and np.array_equal(touch.pose[:, :3], np.eye(3))
    # The deepest pixel is where the ball is, as deep as it is.
    row, column = np.unravel_index(np.nanargmax(touch.height_mm), touch.height_mm.shape)
    assert np.linalg.norm(sensor.gel_from_pixel((column + 0.5, row + 0.5)) - (0.5, -0.3)) < 0.2
    depth = sensor.touch_height_mm(ball) - touch.pose[2, 3]
    assert np.nanmax(touch.height_mm) == pytest.approx(depth, abs=0.03)
    # Equilibrium: the tractions on the gel are the force on the object, turned round. Weights are a third of the areas.
    corners = sensor.gel_vertices_mm[sensor.gel_triangles]
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    weights = np.zeros(len(sensor.gel_vertices_mm))
    np.add.at(weights, sensor.gel_triangles, areas[:, None] / 3)
    assert -(weights @ touch.traction_MPa) == pytest.approx(touch.force_N, abs=1e-6)
    assert ((touch.node_state > 0) == (touch.traction_MPa != 0).any(axis=1)).all()
    assert touch.bead_displacement_mm is None


def test_arrays_are_the_touchs_own_memory_and_outlive_it(sensor, ball):
    touch = sensor.press(ball, depth_mm=0.2)
    assert np.shares_memory(touch.frame, touch.frame)
    assert np.shares_memory(touch.traction_MPa, touch.traction_MPa)
    assert np.shares_memory(sensor.gel_vertices_mm, sensor.gel_vertices_mm)
    frame, traction = touch.frame, touch.traction_MPa
    wanted = frame.copy(), traction.copy()
    del touch
    gc.collect()
    again = [sensor.press(ball, depth_mm=0.25, look=False) for _ in range(3)]  # whoever freed the memory, reuses it
    assert np.array_equal(frame, wanted[0]) and np.array_equal(traction, wanted[1])
    assert again[0].frame is None and again[0].height_mm is None and again[0].contact is None


def test_depth_pose_and_shear_are_one_way_to_the_same_place(sensor, ball):
    depth = sensor.press(ball, depth_mm=0.3, at_mm=(0.2, 0.1), look=False)
    pose = np.eye(4)
    pose[:3, 3] = 0.2, 0.1, sensor.touch_height_mm(ball, at_mm=(0.2, 0.1)) - 0.3
    posed = sensor.press(ball, pose=pose, look=False)
    assert np.array_equal(depth.wrench, posed.wrench)
    sheared = sensor.press(ball, depth_mm=0.3, at_mm=(0.1, 0.1), shear_mm=(0.1, 0), look=False)
    assert np.allclose(sheared.pose, posed.pose)
    assert sheared.force_N[0] < -0.01, "the gel pulls back"
    pulled = sensor.press(ball, force_N=0.4, shear_N=(-0.1, 0.05), look=False)
    assert pulled.force_N == pytest.approx([-0.1, 0.05, 0.4], abs=1e-5)


def test_noise_is_a_pure_function_of_seed_and_frame(sensor, ball):
    def frame(**how):
        return sensor.press(ball, depth_mm=0.2, truth=False, **how).frame
    assert np.array_equal(frame(noise_seed=3, frame=5), frame(noise_seed=3, frame=5))
    assert not np.array_equal(frame(noise_seed=3, frame=5), frame(noise_seed=3, frame=6))
    assert not np.array_equal(frame(noise_seed=3, frame=5), frame(noise_seed=4, frame=5))
    assert np.array_equal(sensor.background(frame=1), sensor.background(frame=1))


def test_other_threads_run_while_a_press_computes(sensor, ball):
    gate, ran = threading.Lock(), threading.Event()
    gate.acquire()

    def other():
        gate.acquire()
        ran.set()

    thread = threading.Thread(target=other)
    thread.start()
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e5)  # nobody is made to give the GIL away
    try:
        gate.release()
        for _ in range(200):
            if ran.is_set():
                break
            sensor.press(ball, depth_mm=0.3, look=False)
    finally:
        sys.setswitchinterval(before)
        thread.join()
    assert ran.is_set()


def test_presses_from_many_threads_are_those_of_one(sensor, ball):
    places = [(0.1 * k, -0.1 * k) for k in range(6)]
    alone = [sensor.press(ball, depth_mm=0.3, at_mm=place) for place in places]
    together = [None] * len(places)

    def press(k):
        together[k] = sensor.press(ball, depth_mm=0.3, at_mm=places[k])

    threads = [threading.Thread(target=press, args=(k,)) for k in range(len(places))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for a, b in zip(alone, together):
        assert np.array_equal(a.wrench, b.wrench) and np.array_equal(a.frame, b.frame)
        assert np.array_equal(a.height_mm, b.height_mm, equal_nan=True)


BALL = {"name": "ball", "shape": {"type": "sphere", "radius_mm": 2}}


@pytest.mark.parametrize("how, message", [
    ({}, "exactly one of depth_mm, force_N and pose"),
    ({"depth_mm": 0.1, "force_N": 1}, "2 of them are given"),
    ({"force_N": -1.0}, "allowed are numbers above 0"),
    ({"depth_mm": float("nan")}, "depth_mm is nan"),
    ({"depth_mm": 0.1, "at_mm": (0, 0, 0)}, "at_mm: 2 numbers are needed, this has shape (3)"),
    ({"depth_mm": 0.1, "at_mm": (float("inf"), 0)}, "at_mm: number 0 of it is inf"),
    ({"depth_mm": 0.1, "at_mm": (50, 0)}, "isn't over the gel"),
    ({"pose": np.eye(3)}, "(3, 4) or (4, 4)"),
    ({"pose": 2 * np.eye(4)}, "last row"),
    ({"pose": [[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 1.8]]}, "rotation isn't one"),
    ({"depth_mm": 0.1, "shear_mm": (0, 0), "shear_N": (0, 0)}, "exclude each other"),
    ({"force_N": 0.3, "shear_N": (0.1, 0)}, "gross slip"),
    ({"depth_mm": 1.8}, "beyond the 1.2 mm in"),
    ({"depth_mm": 0.1, "seconds": 0}, "seconds is 0"),
    ({"depth_mm": 0.1, "frame": -1}, "frame: -1 is not allowed; allowed is from 0 to"),
    ({"depth_mm": 0.1, "shear_mm": (1e6, 0)}, "shear_mm: (1000000, 0) is 1e+06 mm long; allowed is at most 100 mm"),
])
def test_a_bad_press_is_refused(sensor, how, message):
    with pytest.raises(ts.Error) as caught:
        sensor.press(BALL, **how)
    assert message in str(caught.value)


def test_errors_tell_file_line_and_field(tmp_path):
    file = tmp_path / "ball.yaml"
    file.write_text("name: ball\nshape: {type: sphere,\n  radius_mm: -2}\n")
    with pytest.raises(ts.Error) as caught:
        ts.Object(file)
    assert (caught.value.file, caught.value.line, caught.value.field) == (str(file), 3, "shape.radius_mm")
    assert "allowed is above 0" in str(caught.value) and isinstance(caught.value, ValueError)
    with pytest.raises(ts.Error) as caught:
        ts.Object({"name": "ball", "shape": {"type": "sphere", "radius_mm": 1}, "frictoin": 1})
    assert caught.value.field == "frictoin" and "friction" in str(caught.value)
    with pytest.raises(ts.Error, match="gelsight-flat"):
        ts.Sensor("gelsight-flatt")
    with pytest.raises(ts.Error, match="deepest_mm: -1.* is not allowed"):
        ts.Sensor("gelsight-flat", deepest_mm=-1)
    with pytest.raises(ts.Error):
        ts.Object(tmp_path / "nothing.yaml")
    with pytest.raises(ts.Error, match="objects: a path is needed"):
        ts.Object(3)
    import pickle
    again = pickle.loads(pickle.dumps(caught.value))
    assert again.field == caught.value.field and str(again) == str(caught.value)


def test_a_session_refuses_an_elastic_object(sensor):
    soft = dict(BALL, elastic={"youngs_modulus_MPa": 1, "poisson_ratio": 0.3, "mesh_mm": 0.5})
    with pytest.raises(ts.Error, match="is elastic"):
        ts.Session(sensor, soft)


def test_pictures_are_checked(tmp_path):
    path = str(tmp_path / "a.png")
    rng = np.random.default_rng(1)
    for shape, kind in (((5, 7, 3), np.uint8), ((5, 7), np.uint8), ((5, 7), np.uint16)):
        picture = rng.integers(0, 255, shape).astype(kind)
        ts.write_png(path, picture)
        assert np.array_equal(ts.read_image(path), picture)
        ts.write_png(path, picture[::-1, ::2])  # rows that aren't packed
        assert np.array_equal(ts.read_image(path), picture[::-1, ::2])
    for bad in (np.zeros((5, 7)), np.zeros((5, 7, 4), np.uint8), np.zeros((0, 7), np.uint8), np.zeros(5, np.uint8)):
        with pytest.raises(ts.Error, match="image: a picture is an array of uint8 or uint16"):
            ts.write_png(path, bad)
    with pytest.raises(ts.Error, match="a NumPy array is needed"):
        ts.write_png(path, [[1, 2]])


def test_a_session_steps_slips_and_refuses(sensor, ball):
    session = ts.Session(sensor, ball)
    pose = np.eye(4)
    pose[2, 3] = sensor.touch_height_mm(ball) + 0.1
    reading = session.step(pose, 0.01)
    assert (reading.step, reading.contact, reading.touching) == (1, "none", False)
    assert np.isnan(reading.centre_mm).all() and not reading.force_N.any()
    pose[2, 3] -= 0.4
    pressed = session.step(pose, 0.01)
    assert pressed.touching and pressed.force_N[2] > 0 and (pressed.force_error_N > 0).all()
    states = []
    while not states or states[-1] != "sliding":
        pose[0, 3] += 0.02
        states.append(session.step(pose, 0.01).contact)
    assert "partly_slipping" in states and len(states) < 100
    reading = session.reading
    assert np.linalg.norm(reading.force_N[:2]) == pytest.approx(ball.friction * reading.force_N[2], rel=0.01)
    touch = session.look()
    assert np.array_equal(touch.wrench, reading.wrench) and touch.contact.any()
    assert touch.contact_state == "sliding" and touch.slipping_share == 1.0
    with pytest.raises(ts.Error, match="in one step"):
        session.step(np.diag([1, 1, 1, 1]) + np.array([[0, 0, 0, 30], [0] * 4, [0] * 4, [0] * 4]), 0.01)
    with pytest.raises(ts.Error, match="finite time above 0"):
        session.step(pose, 0)
    far = pose.copy()
    far[2, 3] = 1e6
    with pytest.raises(ts.Error, match="allowed are 100000 parts a step"):
        session.step(far, 0.01)
    with pytest.raises(TypeError):
        ts.Session(None, ball)
    assert session.reading.step == reading.step
    session.restart()
    assert session.reading.step == 0


def test_a_session_is_for_one_thread_at_a_time(sensor, ball):
    session = ts.Session(sensor, ball)
    pose = np.eye(4)
    pose[2, 3] = sensor.touch_height_mm(ball) - 0.3
    outcomes = []

    def drive():
        for _ in range(40):
            try:
                session.step(pose, 0.01)
                outcomes.append("done")
            except ts.Error as error:
                assert "at work in another thread" in str(error)
                outcomes.append("refused")

    threads = [threading.Thread(target=drive) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert session.reading.step == outcomes.count("done") and len(outcomes) == 120


def test_a_device_without_a_coating_tells_forces(tmp_path):
    device = {"name": "bare", "gel": {"size_x_mm": 8, "size_y_mm": 8, "thickness_mm": 3, "youngs_modulus_MPa": 0.3,
                                      "refractive_index": 1.4}, "plate": {"thickness_mm": 1, "refractive_index": 1.5},
              "mesh": {"fine_mm": 0.8, "coarse_mm": 2, "fine_half_extent_mm": [2, 2], "fine_depth_mm": 1}}
    bare = ts.Sensor(device, cache=str(tmp_path))
    assert bare.picture_shape is None
    assert bare.press(BALL, force_N=1.0, look=False).force_N[2] == pytest.approx(1.0)
    with pytest.raises(ts.Error, match="no camera"):
        bare.press(BALL, force_N=1.0)


def test_a_slow_blas_is_warned_of(tmp_path):
    """Its variable makes OpenBLAS take this processor for an old one, as it does by itself with new ones."""
    if ts._core.vector_instructions() == "baseline":
        pytest.skip("this processor has no better kernels")
    script = "import touchstone"
    package = str(pathlib.Path(ts.__file__).parents[1])
    for core, warned in (("Prescott", True), ("Haswell", False)):
        run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True,
                             env={"PYTHONPATH": package, "OPENBLAS_CORETYPE": core, "PATH": os.environ["PATH"]})
        assert ("will be slow" in run.stderr) == warned, run.stderr


def test_a_sensors_own_arrays_cant_be_written(sensor, ball):
    before = sensor.press(ball, force_N=0.3, look=False).force_N
    for array in (sensor.gel_vertices_mm, sensor.gel_triangles):
        with pytest.raises(ValueError, match="read-only"):
            array += 1
        with pytest.raises(ValueError):
            array.setflags(write=True)
    # What a touch has is the caller's: no later press knows of it.
    touch = sensor.press(ball, force_N=0.3)
    for array in (touch.frame, touch.background, touch.height_mm, touch.surface_displacement_mm, touch.traction_MPa):
        array[...] = 0
    again = sensor.press(ball, force_N=0.3)
    assert np.array_equal(again.force_N, before) and again.frame.max() > 0 and np.nanmax(again.height_mm) > 0
    assert np.abs(again.surface_displacement_mm).max() > 0 and sensor.background().max() > 0


def _grey_png(file, grey):
    """A picture of 8 x 8 pixels."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + bytes([grey] * 4 + [0] * 4) for _ in range(8))
    file.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 8, 8, 8, 0, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def _changed(file, write):
    """Written by `write`, at a time that differs."""
    was = file.stat().st_mtime_ns
    write()
    os.utime(file, ns=(was + 10**9, was + 10**9))


def test_a_named_object_is_read_again_once_its_files_change(sensor, tmp_path):
    picture, file = tmp_path / "steps.png", tmp_path / "stamp.yaml"
    text = ("name: stamp\nshape: {{type: sphere, radius_mm: {}}}\n"
            "relief: {{type: image, file: steps.png, size_mm: [4, 4], amplitude_um: 100}}\n")
    _grey_png(picture, 255)
    file.write_text(text.format(2))

    def pressed(of):
        return sensor.press(of, depth_mm=0.1).height_mm

    def same(one, other):
        return np.array_equal(one, other, equal_nan=True)

    first = pressed(file)
    assert same(pressed(str(file)), first)
    _changed(picture, lambda: _grey_png(picture, 60))
    second = pressed(file)
    assert not same(second, first)
    assert same(second, pressed(ts.Object(file)))
    _changed(file, lambda: file.write_text(text.format(1)))
    third = pressed(file)
    assert not same(third, second)
    assert same(third, pressed(ts.Object(file)))
    file.unlink()
    with pytest.raises(ts.Error, match="stamp.yaml"):
        pressed(file)
