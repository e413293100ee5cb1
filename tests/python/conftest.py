import os
import pathlib
import pickle

import numpy as np
import pytest

import touchstone as ts

pytest_plugins = ["pytester"]


def pytest_configure(config):
    config.addinivalue_line("markers", "long: left out of CI, as ctest's label")


EXAMPLES = pathlib.Path(__file__).parents[2] / "python" / "examples"


@pytest.fixture(scope="session")
def examples():
    return EXAMPLES


@pytest.fixture(scope="session")
def sensor():
    return ts.Sensor(EXAMPLES / "quick-sensor.yaml")


@pytest.fixture(scope="session")
def ball():
    return ts.Object(EXAMPLES / "quick-ball.yaml")


@pytest.fixture(scope="session")
def other_processes():
    """Checks that a data set gives a sample's wrench after pickling, and in a forked process."""
    def check(data, sample, wanted):
        assert np.array_equal(pickle.loads(pickle.dumps(data))[sample]["wrench"], wanted)
        read, write = os.pipe()
        child = os.fork()
        if child == 0:
            os.write(write, data[sample]["wrench"].tobytes())
            os._exit(0)
        assert os.waitpid(child, 0)[1] == 0
        assert os.read(read, 1000) == wanted.tobytes()
    return check
