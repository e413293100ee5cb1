
import os
import shutil

import numpy as np
import pytest

import touchstone as ts

h5py = pytest.importorskip("h5py")

JOB = """
name: ten-touches
licence: CC0-1.0
seed: 5
samples: 10
samples_per_file: 3
membrane_um: 120
draw:
  device: {examples}/quick-sensor.yaml
  units: {{count: 2, vary: [{{path: 'lamps[*].power_W', times: {{uniform: [0.7, 1.3]}}}}]}}
  objects:
    - file: {examples}/quick-ball.yaml
  place_mm: {{x: {{uniform: [-1, 1]}}, y: {{uniform: [-1, 1]}}}}
  force_N: {{log_uniform: [0.1, 0.5]}}
outputs: [frame, height, contact]
splits: {{train: 0.5, test: 0.5, by: {by}}}
"""
COLUMNS = ("frame", "height", "contact", "background", "wrench", "pose", "sample", "drawn/force_N")


@pytest.fixture(scope="module")
def job(tmp_path_factory, examples):
    file = tmp_path_factory.mktemp("draw") / "job.yaml"
    file.write_text(JOB.format(examples=examples, by="unit"))
    return file


@pytest.fixture(scope="module")
def folder(tmp_path_factory, job):
    """Made in two shards."""
    out = tmp_path_factory.mktemp("drawn") / "out"
    with pytest.raises(ts.Error, match="holds nothing of this job"):
        ts.merge(job, out)
    first = ts.generate(job, out, shard="1/2")
    assert (first["samples"], first["made"], first["kept"]) == (5, 5, 0)
    with pytest.raises(ts.Error, match="2 of 4 files are missing"):
        ts.merge(job, out)
    assert ts.generate(job, out, shard="2/2")["made"] == 5
    assert ts.merge(job, out)["samples"] == 10
    assert ts.generate(job, out)["was_finished"]
    return out


@pytest.fixture(scope="module")
def truth(folder):
    """All blocks' arrays put together by h5py alone."""
    blocks = [h5py.File(path) for path in sorted((folder / "blocks").iterdir())]
    assert len(blocks) == 4
    return {name: np.concatenate([block[name][()] for block in blocks])
            for name in ("frame", "height", "contact", "wrench", "pose", "split", "unit", "sample", "drawn/force_N")}


def test_samples_columns_and_arrays_are_those_of_the_blocks(folder, truth):
    data = ts.Dataset(folder, columns=COLUMNS)
    assert len(data) == 10
    for i in (7, 0, 4, 9, 5, -1):
        sample = data[i]
        assert tuple(sample) == COLUMNS
        for name in ("height", "contact", "wrench", "pose", "sample", "drawn/force_N"):
            assert np.array_equal(sample[name], truth[name][i], equal_nan=name == "height"), (i, name)
        assert np.array_equal(sample["frame"], truth["frame"][i][..., ::-1]), "BGR, as sets of jobs with scenes"
        assert sample["frame"].flags.c_contiguous and sample["frame"].shape == (60, 80, 3)
    for name in ("wrench", "drawn/force_N", "contact"):
        assert np.array_equal(data.array(name), truth[name])
        assert data.array(name).dtype == truth[name].dtype
    assert np.array_equal(data.array("frame"), truth["frame"][..., ::-1])
    assert np.allclose(data.array("wrench")[:, 2], data.array("drawn/force_N"), rtol=1e-3)
    assert data.unit("wrench") == "N, N mm" and data.unit("height") == "mm"
    assert "gel_from_object" in data.meaning("pose")
    assert "drawn/tilt_deg" in data.array_names() and "drawn" not in data.array_names()
    assert ts.Dataset(folder, transform=lambda sample: sample["wrench"][2])[9] == truth["wrench"][9, 2]
    with pytest.raises(IndexError):
        data[10]
    data.verify()


def test_splits_and_groups_go_by_unit(folder, truth):
    parts = {name: ts.Dataset(folder, name, columns=("sample", "wrench")) for name in ("train", "validate", "test")}
    assert [len(part) for part in parts.values()] == [5, 0, 5]
    for number, part in enumerate(parts.values()):
        wanted = np.flatnonzero(truth["split"] == number)
        assert np.array_equal(part.array("sample"), wanted)
        assert np.array_equal(part.groups(), truth["unit"][wanted])
        assert part.array("wrench").shape == (len(wanted), 6)
    assert parts["test"][2]["sample"] == np.flatnonzero(truth["split"] == 2)[2]


def test_an_empty_split_has_columns_without_rows(folder):
    empty, whole = ts.Dataset(folder, "validate"), ts.Dataset(folder)
    assert len(empty) == 0 and empty.groups().shape == (0,)
    for name in ("frame", "height", "contact", "background", "wrench", "split", "drawn/force_N"):
        assert empty.array(name).shape == (0, *whole.array(name).shape[1:]), name
        assert empty.array(name).dtype == whole.array(name).dtype, name
    assert empty._files.column("events", []) == [], "of as many as each sample has: a list"


def test_splits_may_go_by_sample(tmp_path, examples):
    job = tmp_path / "job.yaml"
    job.write_text(JOB.format(examples=examples, by="sample"))
    ts.generate(job, tmp_path / "out")
    data = ts.Dataset(tmp_path / "out", columns=("split",))
    split = data.array("split")
    for number, name in ((0, "train"), (2, "test")):
        part = ts.Dataset(tmp_path / "out", name, columns=("sample",))
        assert np.array_equal(part.array("sample"), np.flatnonzero(split == number))


def test_units_have_a_background_and_a_device(folder):
    data = ts.Dataset(folder, columns=("frame", "background", "contact"))
    assert not np.array_equal(data.background(0), data.background(1))
    assert np.array_equal(data[9]["background"], data.background(1))
    sample = data[9]
    change = np.abs(sample["frame"].astype(int) - sample["background"]).max(axis=2)
    assert change[sample["contact"] == 1].mean() > 3 * change[:5].mean(), "a touch is what differs from it"
    assert "name: quick" in data.device_yaml(0) and data.device_yaml(0) != data.device_yaml(1)
    assert data.constant("object_name") == ["quick-ball"]
    with pytest.raises(ts.Error, match="unit 2 of .* allowed is 0 to 1"):
        data.background(2)
    with pytest.raises(ts.Error, match="isn't a row a sample"):
        ts.Dataset(folder, columns=("device_yaml",))
    with pytest.raises(ts.Error, match="isn't the same for all samples"):
        data.constant("wrench")


def test_a_sample_does_not_unpack_its_block(folder, monkeypatch):
    """Of pictures one row is asked of h5py, never more."""
    asked = []
    real = h5py.Dataset.__getitem__
    monkeypatch.setattr(h5py.Dataset, "__getitem__",
                        lambda self, key, **more: asked.append((self.name, key)) or real(self, key, **more))
    data = ts.Dataset(folder, columns=("frame", "height", "contact", "wrench"))
    data[4]
    assert [key for name, key in asked if name in ("/frame", "/height", "/contact")] == [1, 1, 1]
    with h5py.File(folder / "blocks" / "000000.h5") as file:
        assert file["frame"].chunks[0] == 1


def test_many_blocks_are_not_all_kept_open(folder, monkeypatch):
    monkeypatch.setattr("touchstone._drawn_files._MOST_OPEN", 2)
    data = ts.Dataset(folder, columns=("sample",))
    assert [data[i]["sample"] for i in (0, 9, 4, 1, 8, 5)] == [0, 9, 4, 1, 8, 5]
    assert len(data._files.handles()) == 2


def test_mistakes_and_damage_are_named(folder, job, tmp_path, examples):
    with pytest.raises(ts.Error, match="split: 'verify' is not known; allowed is one of: train, validate, test"):
        ts.Dataset(folder, "verify")
    with pytest.raises(ts.Error, match="'wrnch' is no array"):
        ts.Dataset(folder, columns=("wrnch",))
    with pytest.raises(ts.Error, match="isn't a shard"):
        ts.generate(job, tmp_path / "out", shard="3/2")
    with pytest.raises(ts.Error, match="only those have shards"):
        ts.generate(examples / "quick-job.yaml", tmp_path / "out", shard="1/2")
    with pytest.raises(ts.Error, match="only those have shards"):
        ts.merge(examples / "quick-job.yaml", tmp_path / "out")
    copy = tmp_path / "copy"
    (copy / "blocks").mkdir(parents=True)
    for path in folder.rglob("*"):
        if path.is_file():
            (copy / path.relative_to(folder)).write_bytes(path.read_bytes())
    block = copy / "blocks" / "000002.h5"
    bytes_ = bytearray(block.read_bytes())
    bytes_[len(bytes_) // 2] ^= 1
    block.write_bytes(bytes_)
    with pytest.raises(ts.Error, match="000002.h5: doesn't meet its checksum"):
        ts.Dataset(copy).verify()
    block.write_bytes(b"short")
    with pytest.raises(ts.Error, match="000002.h5: doesn't meet its checksum") as caught:
        ts.Dataset(copy)[6]
    assert caught.value.file == str(block)
    manifest = copy / "dataset.json"
    manifest.write_text(manifest.read_text().replace('"source": "draw"', '"source": "drew"'))
    with pytest.raises(ts.Error, match="content_sha256"):
        ts.Dataset(copy)


def test_a_drawn_set_can_go_to_other_processes(folder, other_processes):
    data = ts.Dataset(folder, "test", columns=("wrench", "frame"))
    wanted = data[3]["wrench"]
    other_processes(data, 3, wanted)


def test_torch_takes_a_drawn_set(folder):
    torch = pytest.importorskip("torch")
    loader = torch.utils.data.DataLoader(ts.Dataset(folder, "test"), batch_size=5, shuffle=True, num_workers=2)
    (batch,) = list(loader)
    assert tuple(batch["frame"].shape) == (5, 60, 80, 3) and tuple(batch["wrench"].shape) == (5, 6)


def test_no_flipped_bit_gives_numbers(folder, tmp_path):
    """A block is compared with its checksum at its first use, whatever the bit."""
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    block = copy / "blocks/000001.h5"
    whole = block.read_bytes()
    for k in range(40):
        damaged = bytearray(whole)
        damaged[(2 * k + 1) * len(whole) // 80] ^= 1 << k % 8
        block.write_bytes(damaged)
        data = ts.Dataset(copy, columns=("frame", "wrench", "background"))
        assert data[0]["frame"].size > 0, "another block is as it was"
        with pytest.raises(ts.Error, match="000001.h5: doesn't meet its checksum"):
            data[3]
    block.unlink()
    os.mkfifo(block)
    with pytest.raises(ts.Error, match="000001.h5: is a pipe or a device"):
        ts.Dataset(copy).array("wrench")
