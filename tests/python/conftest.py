import pathlib

import pytest

import touchstone as ts

pytest_plugins = ["pytester"]

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
