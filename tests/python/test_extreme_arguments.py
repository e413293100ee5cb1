"""No argument of the public API ends the process, hangs it, or raises what isn't documented."""

import json
import os
import pathlib
import selectors
import signal
import subprocess
import sys

import pytest

pytest.importorskip("h5py")

import extreme_arguments  # noqa: E402

CHILD = pathlib.Path(extreme_arguments.__file__)
LONGEST_CALL_S = 30
NAMES = sorted(set(extreme_arguments.public_names()) - set(extreme_arguments.NOT_CALLED))


def test_every_public_name_is_called():
    called = set(extreme_arguments.table(extreme_arguments.Things(".")))
    assert called == set(NAMES), "extreme_arguments.py has a table; what is public has a line in it"
    assert set(extreme_arguments.NOT_CALLED) <= set(extreme_arguments.public_names())


def lines_of(child):
    """Its lines, as long as one comes in time. Ends it when none does."""
    with selectors.DefaultSelector() as selector:
        selector.register(child.stdout, selectors.EVENT_READ)
        rest = b""
        while True:
            if not selector.select(LONGEST_CALL_S):
                child.kill()
                yield {"hangs": True}
                return
            more = os.read(child.stdout.fileno(), 1 << 16)
            if not more:
                return
            *whole, rest = (rest + more).split(b"\n")
            yield from (json.loads(line) for line in whole)


def faults_of(name, folder, shared):
    faults, first, done, calls = [], 0, False, 0
    while not done:
        with open(folder / "stderr", "wb") as stderr, subprocess.Popen(
                [sys.executable, str(CHILD), name, str(folder / "work"), str(shared), str(first)],
                stdout=subprocess.PIPE, stderr=stderr) as child:
            now, hangs = None, False
            for line in lines_of(child):
                hangs = "hangs" in line
                done = "done" in line
                if "case" in line:
                    now = line
                elif "outcome" in line:
                    calls += 1
                    if line["fault"]:
                        faults.append(f"{name}: {now['case']}: {line['fault']}: {line['outcome']}")
                    now = None
        if done:
            break
        said = (folder / "stderr").read_text(errors="replace").strip().splitlines()[-1:]
        end = f"runs for over {LONGEST_CALL_S} s" if hangs else "ends the process by " + (
            signal.Signals(-child.returncode).name if child.returncode < 0 else f"code {child.returncode}")
        faults.append(f"{name}: {now['case'] if now else 'between calls'}: {end}: {' '.join(said)}")
        if now is None:
            break
        first = now["k"] + 1
    return faults, calls


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    return tmp_path_factory.mktemp("shared")


@pytest.mark.parametrize("name", NAMES)
def test_extreme_arguments_are_refused(name, tmp_path, shared):
    faults, calls = faults_of(name, tmp_path, shared)
    assert not faults, "\n".join(faults)
    assert calls > 0
