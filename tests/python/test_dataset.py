import contextlib
import hashlib
import os
import pathlib
import shutil
import signal
import threading

import numpy as np
import pytest

import touchstone as ts

h5py = pytest.importorskip("h5py")


def contents(folder):
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.fixture(scope="module")
def job(tmp_path_factory, examples):
    """Three presses of the examples' job."""
    file = tmp_path_factory.mktemp("job") / "job.yaml"
    file.write_text(f"""
name: three-presses
seed: 7
scenes:
  - {{name: one, scene: {examples}/quick-scene.yaml, start_mm: [-1.6, -0.8, 1.55], split: train}}
  - {{name: two, scene: {examples}/quick-scene.yaml, start_mm: [0.3, 0.8, 1.55], split: train}}
  - {{name: three, scene: {examples}/quick-scene.yaml, start_mm: [0.9, -0.5, 1.55], split: test}}
""")
    return file


@pytest.fixture(scope="module")
def folder(tmp_path_factory, job):
    out = tmp_path_factory.mktemp("set") / "out"
    stages = []
    report = ts.generate(job, out, timings=False,
                         progress=lambda stage, done, total: stages.append((stage, done, total)))
    assert report == {"was_finished": False, "samples": 24, "made": 24, "kept": 0, "warning": "",
                      "damaged_blocks": 0, "drawn_again": 0}
    assert ("frames", 24, 24) in stages
    return out


def test_a_finished_set_is_verified_not_made_again(folder, job):
    before = contents(folder)
    assert ts.generate(job, folder)["was_finished"]
    assert contents(folder) == before


def test_splits_samples_and_columns_agree(folder):
    data = ts.Dataset(folder, columns=("frame", "ideal", "wrench", "pose", "surface_displacement_mm", "error/force_N"))
    train, test = ts.Dataset(folder, "train"), ts.Dataset(folder, "test")
    assert (len(data), len(train), len(test), len(ts.Dataset(folder, "validate"))) == (24, 16, 8, 0)
    with h5py.File(folder / "truth.h5") as file:
        wrench = file["wrench"][()]
        assert np.array_equal(data.array("wrench"), wrench)
        assert np.array_equal(test.array("wrench"), wrench[file["split"][()] == 2])
        sample = data[13]
        assert np.array_equal(sample["surface_displacement_mm"], file["surface_displacement_mm"][13])
        assert np.array_equal(data.constant("gel_vertices_mm"), file["gel_vertices_mm"][()])
        assert np.array_equal(data.groups(), file["scene"][()])
    assert np.array_equal(sample["frame"], ts.read_image(str(folder / "frames" / data.scenes[1] / "000005.png")))
    assert np.array_equal(data[-1]["wrench"], data[23]["wrench"])
    frames = test.array("frame")
    assert frames.shape == (8, 60, 80, 3) and np.array_equal(frames[5], test[5]["frame"])
    assert test[0].keys() == {"frame", "wrench"}
    assert data.unit("wrench") == "N, N mm" and isinstance(data.meaning("wrench"), str)
    assert "wrench" in data.array_names()
    assert ts.Dataset(folder, transform=lambda sample: sample["wrench"][2])[9] == wrench[9, 2]
    data.verify()
    empty = ts.Dataset(folder, "validate", columns=("frame", "ideal", "wrench"))
    for name in ("frame", "ideal", "wrench", "surface_displacement_mm", "scene"):
        assert empty.array(name).shape == (0, *data.array(name).shape[1:]), name
        assert empty.array(name).dtype == data.array(name).dtype, name
    assert empty.groups().shape == (0,) and list(empty) == []


def test_forces_of_frames_are_those_of_presses(folder):
    """The same press by the other way, touch by touch, has the force that the motion asked for."""
    data = ts.Dataset(folder, "train", columns=("wrench", "frame"))
    assert data.array("frame").std() > 5
    assert max(abs(data.array("wrench")[:, 2] - 0.5)) <= 0.5 + 1e-6
    assert data.array("wrench")[5, 2] == pytest.approx(0.5, abs=1e-5)


def test_what_is_not_there_is_refused(folder, tmp_path):
    with pytest.raises(ts.Error, match="split: 'tset' is not known"):
        ts.Dataset(folder, "tset")
    with pytest.raises(ts.Error, match="'wrnch' is no array"):
        ts.Dataset(folder, columns=("wrnch",))
    with pytest.raises(ts.Error, match="isn't a row a sample"):
        ts.Dataset(folder, columns=("gel_vertices_mm",))
    with pytest.raises(IndexError):
        ts.Dataset(folder)[24]
    with pytest.raises(ts.Error, match="once it is finished") as caught:
        ts.Dataset(tmp_path)
    assert caught.value.file == str(tmp_path / "dataset.json")
    (tmp_path / "dataset.json").write_text("{}")
    with pytest.raises(ts.Error, match="isn't the manifest"):
        ts.Dataset(tmp_path)


def test_damage_is_found(folder, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    manifest = copy / "dataset.json"
    text = manifest.read_text()
    manifest.write_text(text.replace('"seed": 7', '"seed": 8'))
    with pytest.raises(ts.Error, match="content_sha256"):
        ts.Dataset(copy)
    manifest.write_text(text)
    picture = copy / "frames" / "one" / "000003.png"
    picture.write_bytes(picture.read_bytes()[:-1])
    with pytest.raises(ts.Error, match="000003.png: doesn't meet its checksum"):
        ts.Dataset(copy).verify()
    picture.unlink()
    with pytest.raises(ts.Error, match="000003.png"):
        ts.Dataset(copy).verify()


def test_a_set_can_go_to_other_processes(folder, other_processes):
    data = ts.Dataset(folder, "test")
    wanted = data[3]["wrench"]
    other_processes(data, 3, wanted)


def test_torch_takes_it(folder):
    torch = pytest.importorskip("torch")
    loader = torch.utils.data.DataLoader(ts.Dataset(folder, "test"), batch_size=4)
    batches = list(loader)
    assert len(batches) == 2 and tuple(batches[0]["frame"].shape) == (4, 60, 80, 3)


@contextlib.contextmanager
def read_by_two_threads(file):
    """What h5py reads meanwhile is what it read before, in every read."""
    stop, reads, wrong = threading.Event(), [], []
    with h5py.File(file) as before:
        wanted = before["surface_displacement_mm"][()]

    def read():
        while not stop.wait(0.02):
            with h5py.File(file) as again:
                same = np.array_equal(again["surface_displacement_mm"][()], wanted)
            (reads if same else wrong).append(file)

    readers = [threading.Thread(target=read) for _ in range(2)]
    for reader in readers:
        reader.start()
    try:
        yield
    finally:
        stop.set()
        for reader in readers:
            reader.join()
    assert reads and not wrong


def test_ctrl_c_breaks_it_off_and_the_same_call_goes_on_while_h5py_reads(folder, tmp_path, job):
    out = tmp_path / "out"

    def interrupt(stage, done, total):
        if stage == "frames" and done == 5:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        ts.generate(job, out, timings=False, progress=interrupt)
    assert not (out / "dataset.json").exists()

    class Stop(Exception):
        pass

    def stop(stage, done, total):
        if stage == "frames" and done == 5:
            raise Stop("enough")

    with pytest.raises(Stop, match="enough"):
        ts.generate(job, out, timings=False, progress=stop)
    with read_by_two_threads(folder / "truth.h5"):
        report = ts.generate(job, out, timings=False)
    assert report["kept"] >= 5 and report["kept"] + report["made"] == 24
    assert contents(out) == contents(folder)


def test_a_mistake_in_a_job_writes_nothing(tmp_path):
    job = tmp_path / "job.yaml"
    job.write_text("name: x\nseed: 1\nscenes:\n  - {name: a, scene: nothing.yaml, split: train}\n")
    with pytest.raises(ts.Error, match="nothing.yaml"):
        ts.generate(job, tmp_path / "out")
    with pytest.raises(ts.Error, match="threads: -1"):
        ts.generate(job, tmp_path / "out", threads=-1)
    assert not (tmp_path / "out").exists()
