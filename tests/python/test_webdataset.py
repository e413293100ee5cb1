"""`touchstone export webdataset`, read by Python's own tarfile and held against the blocks."""

import collections
import hashlib
import io
import json
import os
import subprocess
import tarfile

import numpy as np
import pytest
from test_drawn_dataset import JOB

import touchstone as ts

h5py = pytest.importorskip("h5py")
PROGRAM = os.environ.get("TOUCHSTONE_PROGRAM")
pytestmark = pytest.mark.skipif(not PROGRAM, reason="TOUCHSTONE_PROGRAM, the program of this build, isn't set")


def export(folder, out, *options):
    return subprocess.run([PROGRAM, "--quiet", "export", "webdataset", folder, "-o", out, *options],
                          capture_output=True, text=True)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, examples):
    place = tmp_path_factory.mktemp("web")
    (place / "job.yaml").write_text(JOB.format(examples=examples, by="sample"))
    ts.generate(place / "job.yaml", place / "set")
    return place / "set"


def samples_of(tar):
    """As WebDataset groups them: by all before the first dot."""
    found = collections.OrderedDict()
    with tarfile.open(tar) as file:
        for member in file:
            assert (member.mtime, member.uid, member.gid, member.mode) == (0, 0, 0, 0o644)
            key, ending = member.name.split(".", 1)
            found.setdefault(key, {})[ending] = file.extractfile(member).read()
    return found


def picture(content, tmp_path):
    (tmp_path / "picture.png").write_bytes(content)
    return ts.read_image(str(tmp_path / "picture.png"))


def test_tars_hold_what_the_blocks_hold(folder, tmp_path):
    run = export(folder, tmp_path / "out", "--samples-per-tar", "3")
    assert run.returncode == 0, run.stderr
    index = json.loads((tmp_path / "out" / "index.json").read_text())
    seen = []
    for split, of in index["splits"].items():
        data = ts.Dataset(folder, split, columns=("frame", "height", "contact", "background", "wrench", "wrench_error",
                                                  "pose", "sample", "unit", "seed", "drawn/force_N"))
        by_number = {int(sample["sample"]): sample for sample in (data[i] for i in range(len(data)))}
        assert of["samples"] == len(data) == sum(file["samples"] for file in of["files"])
        for file in of["files"]:
            path = tmp_path / "out" / file["file"]
            assert file["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
            assert file["bytes"] == path.stat().st_size and file["samples"] <= 3
            for key, parts in samples_of(path).items():
                wanted = by_number[int(key)]
                seen.append(int(key))
                assert list(parts) == ["frame.png", "height.npy", "contact.png", "json"]
                assert np.array_equal(picture(parts["frame.png"], tmp_path), wanted["frame"])
                assert np.array_equal(picture(parts["contact.png"], tmp_path) == 255, wanted["contact"] == 1)
                height = np.load(io.BytesIO(parts["height.npy"]))
                assert height.dtype == np.float32 and np.array_equal(height, wanted["height"], equal_nan=True)
                labels = json.loads(parts["json"])
                assert labels["force_N"] + labels["torque_N_mm"] == list(wanted["wrench"])
                assert labels["force_error_N"] == list(wanted["wrench_error"])
                assert np.array_equal(labels["gel_from_object_rotation"], wanted["pose"][:, :3])
                assert np.array_equal(labels["gel_from_object_position_mm"], wanted["pose"][:, 3])
                assert labels["drawn"]["force_N"] == wanted["drawn/force_N"] and labels["drawn"]["depth_mm"] is None
                assert (labels["seed"], labels["split"]) == (int(wanted["seed"]), split)
                unit = index["units"][labels["unit"]]
                background = ts.read_image(str(tmp_path / "out" / unit["background"]))
                assert np.array_equal(background, wanted["background"])
                assert (tmp_path / "out" / unit["device"]).read_text() == data.device_yaml(labels["unit"])
    assert sorted(seen) == list(range(10))


def test_the_same_set_gives_the_same_bytes(folder, tmp_path):
    for out, threads in (("one", "1"), ("two", "2")):
        run = subprocess.run([PROGRAM, "--quiet", "--threads", threads, "export", "webdataset", folder, "-o",
                              tmp_path / out], capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
    files = sorted(path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*") if path.is_file())
    assert len(files) >= 6
    for file in files:
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes(), file
    assert not list((tmp_path / "two").rglob("scratch*"))


def test_mistakes_are_one_line_and_killed_exports_are_written_over(folder, tmp_path, examples):
    def refused(message, *arguments):
        run = export(*arguments)
        assert run.returncode != 0 and message in run.stderr, run.stderr

    refused("split 'tset' is not known",
            folder, tmp_path / "out", "--split", "tset")
    refused("'validate' of", folder, tmp_path / "out", "--split", "validate")
    refused("--samples-per-tar: 0 is not allowed", folder, tmp_path / "out", "--samples-per-tar", "0")
    refused("isn't a data set; it has no dataset.json", examples, tmp_path / "out")
    assert not (tmp_path / "out").exists()
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "train-000009.tar").write_text("of a killed export")
    assert export(folder, tmp_path / "out", "--split", "test").returncode == 0
    tars = [path.name for path in (tmp_path / "out").glob("*.tar")]
    assert tars == ["test-000000.tar"]
    refused("holds a finished export", folder, tmp_path / "out")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("mine")
    refused("'notes.txt' is in it", folder, tmp_path / "mine")
    copy = tmp_path / "copy"
    for path in folder.rglob("*"):
        if path.is_file():
            (copy / path.relative_to(folder)).parent.mkdir(parents=True, exist_ok=True)
            (copy / path.relative_to(folder)).write_bytes(path.read_bytes())
    (copy / "blocks" / "000001.h5").write_bytes(b"short")
    refused("000001.h5: was changed", copy, tmp_path / "out2")
