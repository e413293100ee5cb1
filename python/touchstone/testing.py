"""A virtual device in a user's own pytest tests: press, take the frame, hold an estimate against the truth.

    # conftest.py
    pytest_plugins = ["touchstone.testing"]

    # test_my_estimator.py
    def test_two_newtons(virtual_device):
        device = virtual_device("gelsight-flat")
        touch = device.press("ball-8mm", force_N=2.0, at_mm=(1, 0))
        assert_close(my_force(touch.frame), touch.force_N[2], error_bar=touch.force_error_N[2], allowed=0.2, unit="N")
"""

import math

from . import Sensor
from ._errors import Error

try:
    import pytest
except ImportError:  # assert_close is of use without it, too
    pytest = None


def assert_close(estimate, truth, *, allowed, error_bar=0.0, sigmas=2.0, unit="", what="estimate"):
    """Passes where the estimate is within `allowed` of the truth, which itself is only known within its error bar.

    estimate, truth: numbers, or arrays of one shape; NaN in the truth (a pixel that sees nothing) is left out.
    allowed: what the estimator may be off by.
    error_bar: one standard error of the truth (Touch.force_error_N, ...): `sigmas` of them are granted on top.

    Raises AssertionError that says by how much it is off, where, and what was granted; Error for arguments that can't
    be compared (an estimate of NaN is an AssertionError).
    """
    import numpy
    try:
        got, true, bar = (numpy.asarray(value, dtype=float) for value in (estimate, truth, error_bar))
        allowed, sigmas = float(allowed), float(sigmas)
    except (ValueError, OverflowError) as error:
        raise Error(f"{what}: numbers are needed ({error})") from None
    if got.shape != true.shape:
        raise Error(f"{what}: the estimate has shape {got.shape}, the truth {true.shape}")
    try:
        numpy.broadcast_to(bar, true.shape)
    except ValueError:
        raise Error(f"{what}: error_bar has shape {bar.shape}, the truth {true.shape}") from None
    if not (math.isfinite(allowed) and allowed >= 0 and math.isfinite(sigmas) and sigmas >= 0):
        raise Error(f"allowed is {allowed} and sigmas {sigmas}; both must be finite and at least 0")
    if not (numpy.isfinite(bar).all() and (bar >= 0).all()):
        raise Error("error_bar must be finite and at least 0")
    known = ~numpy.isnan(true)
    if not known.any():
        raise Error(f"{what}: no truth is known")
    rounding = 1e-12 * numpy.abs(numpy.where(known, true, 0))
    granted = numpy.broadcast_to(allowed + sigmas * bar, true.shape) + rounding
    off = numpy.abs(got - true)
    excess = numpy.where(known, numpy.where(numpy.isnan(off), numpy.inf, off - granted), -numpy.inf)
    if (excess <= 0).all():
        return
    at = numpy.unravel_index(numpy.argmax(excess), true.shape)
    place = f" at {tuple(int(i) for i in at)}" if true.ndim else ""
    bar_here = float(numpy.broadcast_to(bar, true.shape)[at])
    unit = f" {unit}" if unit else ""
    raise AssertionError(
        f"{what}{place} is {got[at]:.6g}{unit}, the truth {true[at]:.6g} +- {bar_here:.2g}{unit}: off by "
        f"{off[at]:.4g}{unit}, granted are {granted[at]:.4g}{unit} (allowed {allowed:.4g} + {sigmas:g} x error bar); "
        f"{int((excess > 0).sum())} of {int(known.sum())} values are off by more")


class VirtualDevice:
    """A Sensor that counts its frames, so that each has noise of its own, the same in every run of a test."""

    def __init__(self, sensor):
        self.sensor = sensor
        self._frame = 0

    def press(self, obj, **how):
        """Sensor.press with the next frame's noise."""
        how.setdefault("frame", self._next())
        return self.sensor.press(obj, **how)

    def background(self):
        """The next frame of the untouched device."""
        return self.sensor.background(frame=self._next())

    def session(self, obj, **settings):
        """A contact session for a control loop (touchstone.Session)."""
        from . import Object, Session
        return Session(self.sensor, obj if isinstance(obj, Object) else Object(obj), **settings)

    def _next(self):
        self._frame += 1
        return self._frame

    def __getattr__(self, name):
        return getattr(self.sensor, name)


if pytest is not None:

    @pytest.fixture(scope="session")
    def _touchstone_sensors():
        return {}

    @pytest.fixture
    def virtual_device(_touchstone_sensors):
        """A function (device, **settings of touchstone.Sensor) -> VirtualDevice. Devices are set up once a session."""

        def make(device, **settings):
            key = repr((device, sorted(settings.items())))
            if key not in _touchstone_sensors:
                _touchstone_sensors[key] = Sensor(device, **settings)
            return VirtualDevice(_touchstone_sensors[key])

        return make
