import numpy as np
import pytest

import touchstone as ts
from touchstone.testing import assert_close


def test_what_is_within_its_bars_passes():
    assert_close(2.1, 2.0, allowed=0.1)
    assert_close(2.3, 2.0, allowed=0.1, error_bar=0.1)
    assert_close(np.array([1.0, 5.0]), np.array([1.05, np.nan]), allowed=0.1)


@pytest.mark.parametrize("estimate, truth, how, message", [
    (2.5, 2.0, {"allowed": 0.1, "error_bar": 0.1, "unit": "N"}, "is 2.5 N, the truth 2 +- 0.1 N: off by 0.5 N, granted "
                                                                "are 0.3 N"),
    (float("nan"), 2.0, {"allowed": 9}, "is nan"),
    ([1, 2, 3.5], [1, 2, 3], {"allowed": 0.1, "what": "force"}, "force at (2,) is 3.5"),
])
def test_what_is_not_fails_and_says_how(estimate, truth, how, message):
    with pytest.raises(AssertionError) as caught:
        assert_close(estimate, truth, **how)
    assert message in str(caught.value)


@pytest.mark.parametrize("estimate, truth, how", [
    ([1, 2], [1], {"allowed": 1}), (1, 1, {"allowed": -1}), (1, 1, {"allowed": 1, "error_bar": float("inf")}),
    (1, float("nan"), {"allowed": 1}),
])
def test_what_cannot_be_compared_is_refused(estimate, truth, how):
    with pytest.raises(ts.Error):
        assert_close(estimate, truth, **how)


def test_the_plugin_gives_a_users_tests_a_device(pytester, examples):
    pytester.makeconftest('pytest_plugins = ["touchstone.testing"]')
    pytester.makepyfile(f"""
        from touchstone.testing import assert_close

        DEVICE = {str(examples / 'quick-sensor.yaml')!r}
        BALL = {str(examples / 'quick-ball.yaml')!r}

        def brightness(frame, rest):
            return abs(frame.astype(float) - rest).mean()

        def test_half_a_newton(virtual_device):
            device = virtual_device(DEVICE)
            touch = device.press(BALL, force_N=0.5)
            assert_close(touch.force_N[2], 0.5, error_bar=touch.force_error_N[2], allowed=1e-4)
            assert brightness(touch.frame, device.background()) > 1

        def test_an_estimator_that_is_wrong(virtual_device):
            touch = virtual_device(DEVICE).press(BALL, force_N=0.5)
            assert_close(touch.force_N[2] + 0.2, touch.force_N[2], error_bar=touch.force_error_N[2], allowed=0.01,
                         unit="N", what="force")

        def test_devices_are_set_up_once_and_frames_differ(virtual_device):
            one, other = virtual_device(DEVICE), virtual_device(DEVICE)
            assert one.sensor is other.sensor
            assert (one.background() != one.background()).any()
            session = one.session(BALL)
            assert session.reading.step == 0
    """)
    result = pytester.runpytest_inprocess("-p", "no:cacheprovider")
    result.assert_outcomes(passed=2, failed=1)
    result.stdout.fnmatch_lines(["*AssertionError: force is 0.7 N, the truth 0.5 +- * N: off by 0.2 N*"])
