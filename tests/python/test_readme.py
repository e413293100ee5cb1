"""What README.md promises a newcomer: a data set open in NumPy within five commands."""

import os
import pathlib
import re
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def commands():
    """The lines of README.md's block."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    block = re.search(r"tests/python/test_readme\.py.*?```sh\n(.*?)```", text, re.DOTALL)
    assert block, "README.md has lost the block that this test runs"
    return block.group(1).strip().splitlines()


def test_a_newcomer_has_a_data_set_in_numpy_within_five_commands(tmp_path):
    lines = commands()
    assert len(lines) <= 5
    assert lines[0] == "script/build"
    program = os.environ.get("TOUCHSTONE_PROGRAM")
    if not program:
        pytest.skip("the command isn't built")
    build = pathlib.Path(program).parents[1]
    script = "\n".join(["set -e", *lines[1:]])
    assert "build/release" in script
    script = script.replace("build/release", str(build)).replace("scenes/", f"{ROOT}/scenes/")
    ran = subprocess.run(["bash", "-c", script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    shape, forces = re.search(r"(\(.*?\)) \[(.*?)\] N", ran.stdout).groups()
    assert shape == "(60, 240, 320, 3)"
    assert all(0.05 < float(force) < 2.1 for force in forces.split())
    assert "CC0-1.0" in (tmp_path / "first-set" / "README.md").read_text(encoding="utf-8")
