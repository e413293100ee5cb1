"""No argument of the public API ends the process, hangs it, or raises what isn't documented."""

import faulthandler
import json
import os
import selectors
import signal
import traceback

import pytest

pytest.importorskip("h5py")

import extreme_arguments  # noqa: E402

LONGEST_CALL_S = 30
NAMES = sorted(set(extreme_arguments.public_names()) - set(extreme_arguments.NOT_CALLED))


def test_every_public_name_is_called():
    called = set(extreme_arguments.table(extreme_arguments.Things(".")))
    assert called == set(NAMES), "extreme_arguments.py has a table; what is public has a line in it"
    assert set(extreme_arguments.NOT_CALLED) <= set(extreme_arguments.public_names())


class Child:
    """A process of its own that makes the calls. Forked, as to start Python and NumPy takes longer than most calls; this
    process itself calls nothing of the package, so that it has no threads that a child would miss."""

    def __init__(self, name, folder, shared, first):
        self.lines, write = os.pipe()
        self.pid = os.fork()
        if self.pid == 0:
            with open(folder / "stderr", "wb") as stderr:
                os.dup2(stderr.fileno(), 2)
            faulthandler.disable()
            try:
                extreme_arguments.make_calls(name, folder / "work", shared, first, os.fdopen(write, "w"))
            except BaseException:  # pylint: disable=broad-except
                os.write(2, traceback.format_exc().encode("utf-8", "replace"))
                os._exit(1)
            os._exit(0)
        os.close(write)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self.lines)
        self.code = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])

    def kill(self):
        os.kill(self.pid, signal.SIGKILL)


def lines_of(child):
    """Its lines, as long as one comes in time. Ends it when none does."""
    with selectors.DefaultSelector() as selector:
        selector.register(child.lines, selectors.EVENT_READ)
        rest = b""
        while True:
            if not selector.select(LONGEST_CALL_S):
                child.kill()
                yield {"hangs": True}
                return
            more = os.read(child.lines, 1 << 16)
            if not more:
                return
            *whole, rest = (rest + more).split(b"\n")
            yield from (json.loads(line) for line in whole)


def faults_of(name, folder, shared):
    faults, first, done, calls = [], 0, False, 0
    while not done:
        with Child(name, folder, shared, first) as child:
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
            signal.Signals(-child.code).name if child.code < 0 else f"code {child.code}")
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
