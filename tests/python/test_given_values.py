"""What Python may give: paths of any bytes, numbers of other libraries, and what is refused by name."""

import fractions
import json
import os
import pathlib

import numpy as np
import pytest

import touchstone as ts

BALL = {"name": "ball", "shape": {"type": "sphere", "radius_mm": 2.0}, "friction": 0.5}
ODD_NAMES = ["a?b", "a*b", "a[b]", "a%41b", "a#b", "a b", "a'b", 'a"b', "a\nb", "a\u00e9b", "a\udcffb", "a\\b", "-a", "~", "%04d",
             "a?b=1.png"]


class Named:
    """A path of its own kind."""

    def __init__(self, path):
        self.path = path

    def __fspath__(self):
        return self.path


@pytest.mark.parametrize("name", ODD_NAMES, ids=ascii)
def test_pictures_of_any_name_are_written_and_read(tmp_path, name):
    picture = np.arange(48, dtype=np.uint8).reshape(4, 4, 3)
    folder = tmp_path / name
    folder.mkdir()
    path = str(folder / (name + ".png"))
    for form in (path, os.fsencode(path), pathlib.Path(path), Named(path), Named(os.fsencode(path))):
        ts.write_png(form, picture)
        assert np.array_equal(ts.read_image(form), picture)
        os.remove(path)
    with pytest.raises(ts.Error, match="no such file"):
        ts.read_image(path)


@pytest.mark.parametrize("name", ["a?b", "a\udcffb", "a\nb"], ids=ascii)
def test_data_sets_in_folders_of_any_name(tmp_path, examples, name):
    pytest.importorskip("h5py")
    folder = tmp_path / name
    folder.mkdir()
    job = folder / (name + ".yaml")
    job.write_bytes(b"\xef\xbb\xbf" + f"""# in Latin-1: \u00b5
name: one-press
seed: 7
scenes:
  - {{name: one, scene: {examples}/quick-scene.yaml, start_mm: [-1.6, -0.8, 1.55], split: train}}
""".replace("\n", "\r\n").encode("latin-1"))
    out = os.fsencode(folder / "out")
    assert ts.generate(os.fsencode(job), out)["samples"] == 8
    for form in (out, pathlib.Path(os.fsdecode(out)), Named(out)):
        data = ts.Dataset(form)
        assert data.array("frame").shape == (8, 60, 80, 3) and data.array("wrench").shape == (8, 6)
        data.verify()
        assert ts.generate(job, form)["was_finished"]


def test_paths_that_are_none_are_refused_by_name():
    for call, what in ((lambda bad: ts.read_image(bad), "path"), (lambda bad: ts.HeightModel.load(bad), "path"),
                       (lambda bad: ts.Dataset(bad), "folder"), (lambda bad: ts.generate(bad, "x"), "job"),
                       (lambda bad: ts.merge("x", bad), "out"), (lambda bad: ts.Object(bad), "objects")):
        for bad in (3, None, 1.5, ["a"], object()):
            with pytest.raises(ts.Error, match=f"^{what}: a path is needed"):
                call(bad)
    with pytest.raises(ts.Error, match="zero byte"):
        ts.read_image("a\0.png")


def test_dicts_may_have_numbers_of_other_libraries(tmp_path):
    def made(**shape):
        return ts.Object({**BALL, "shape": shape})

    for two in (np.float64(2), np.float32(2), np.int64(2), np.uint8(2), np.array(2.0), fractions.Fraction(2)):
        assert made(type="sphere", radius_mm=two).name == "ball"
        assert ts.Object({**BALL, "friction": two}).friction == 2
    for size in (np.array([2.0, 3.0, 4.0]), (2, 3, 4), [np.int32(2), 3, np.float16(4)], np.array([2, 3, 4])):
        made(type="box", size_mm=size)
    assert ts.Object({**BALL, np.str_("name"): np.str_("b")}).name == "b"
    mesh = tmp_path / "none.stl"
    for form in (mesh, os.fsencode(mesh), Named(str(mesh))):
        with pytest.raises(ts.Error, match="none.stl"):
            made(type="mesh", file=form) if not isinstance(form, bytes) else ts.Object(form)
    for bad in (object(), {1, 2}, b"x", 1j, np.datetime64("2020-01-01"), [object()]):
        with pytest.raises(ts.Error, match="dict: "):
            ts.Object({**BALL, "friction": bad})
    for key in (b"name", (1, 2), np.int64(1)):
        with pytest.raises(ts.Error, match="dict: "):
            ts.Object({**BALL, key: 1})


WRONG = [-1, 2**64, 10**5000, 1.5, 2.0, np.float64(3), float("nan"), "3", None, [1], object()]


def test_whole_numbers_are_refused_by_name(sensor, ball, examples, tmp_path):
    picture = np.zeros((240, 320), np.uint8)
    session = ts.Session(sensor, ball)
    calls = {
        "noise_seed": [lambda bad: sensor.background(noise_seed=bad), lambda bad: sensor.press(ball, depth_mm=0.1,
                       look=False, noise_seed=bad), lambda bad: session.look(noise_seed=bad)],
        "frame": [lambda bad: sensor.background(frame=bad), lambda bad: sensor.press(ball, depth_mm=0.1, look=False,
                  frame=bad)],
        "unit": [lambda bad: ts.Sensor(examples / "quick-sensor.yaml", unit=bad)],
        "grid": [lambda bad: ts.BeadTracker(grid=bad), lambda bad: ts.train_stiffness([[0, 0]], [], np.zeros((0, 3)),
                 grid=bad)],
        "roi_a_px": [lambda bad: ts.BeadTracker(roi_a_px=bad)],
        "roi_b_px": [lambda bad: ts.BeadTracker(roi_b_px=bad)],
        "threads": [lambda bad: ts.generate("none.yaml", tmp_path / "out", threads=bad)],
        "t_us": [lambda bad: ts.BeadTracker().track(picture, bad)],  # of MarkerTracker None is one: test_estimators.py
    }
    for name, of_name in calls.items():
        for call in of_name:
            for bad in WRONG:
                if name == "t_us" and bad == -1:
                    continue
                with pytest.raises(ts.Error, match=name):
                    call(bad)
    with pytest.raises(ts.Error, match="^noise_seed: -1 is not allowed; allowed is from 0 to 18446744073709551615$"):
        sensor.background(noise_seed=-1)
    with pytest.raises(ts.Error, match="^frame: a whole number is needed, this is 1.5 of <class 'float'>$"):
        sensor.background(frame=1.5)
    for good in (0, 2**64 - 1, np.uint64(2**63), np.int8(3), True):
        assert sensor.background(noise_seed=good).shape == (60, 80, 3)


def test_names_that_are_no_text_are_refused_by_name(tmp_path):
    points = np.zeros((4, 2))
    for bad in ("\udcff", "\ud800", b"dark", 3, None, ["dark"]):
        for name, call in (("polarity", lambda: ts.BeadTracker(polarity=bad)),
                           ("form", lambda: ts.train_stiffness(points, [points], np.zeros((1, 3)), grid=2, form=bad)),
                           ("correction", lambda: ts.calibrate_height([np.zeros((9, 9, 3), np.uint8)], [2.0],
                            [np.zeros((9, 9, 3), np.uint8)], mm_per_px=0.1, correction=bad))):
            with pytest.raises(ts.Error, match=f"^{name}: "):
                call()
    with pytest.raises(ts.Error, match="^shard: "):
        ts.generate("job.yaml", tmp_path / "out", shard="\udcff")


def test_bytes_that_arent_utf8_are_named(tmp_path):
    file = tmp_path / "ball.yaml"
    file.write_bytes(b"name: b\xe4ll # \xb5\nshape: {type: sphere, radius_mm: 2}\n")
    with pytest.raises(ts.Error, match="isn't UTF-8; save the file as UTF-8") as caught:
        ts.Object(file)
    assert (caught.value.file, caught.value.line, caught.value.field) == (str(file), 1, "name")
    file.write_bytes(b"name: ball # \xb5\nshape: {type: sphere, radius_mm: 2}\n")
    assert ts.Object(file).name == "ball"
    for bad in ("\udcff", "\ud800"):
        with pytest.raises(ts.Error, match="dict: "):
            ts.Object({**BALL, "name": bad})
        with pytest.raises(ts.Error, match="dict: "):
            ts.Object({**BALL, bad: 1})


def test_off_survives_yaml_and_json(tmp_path, examples):
    pytest.importorskip("h5py")
    yaml = pytest.importorskip("yaml")
    scene = yaml.safe_load((examples / "quick-scene.yaml").read_text())
    scene["effects"]["interreflection"] = yaml.safe_load("off")
    for key in ("device", "object", "motion"):
        scene[key] = str(examples / scene[key])
    assert scene["effects"] == {"direct_light": True, "interreflection": False}
    for number, text in enumerate((yaml.safe_dump(scene), json.dumps(scene))):
        (tmp_path / "scene.yaml").write_text(text)
        (tmp_path / "job.yaml").write_text("name: x\nseed: 1\nscenes:\n  - {name: a, scene: scene.yaml, split: test}\n")
        ts.generate(tmp_path / "job.yaml", tmp_path / f"out{number}")
        plan = ts.Dataset(tmp_path / f"out{number}").manifest["scenes"][0]["plan"]
        assert [row["on"] for row in plan if row["effect"] == "interreflection"] == [False]
