"""Frames of any source as arrays; the sources' own tests are in tests/datasets/sources."""

import http.server
import os
import signal
import subprocess
import sys
import threading
import time
import warnings

import numpy as np
import pytest

import touchstone as ts


def picture(i):
    frame = np.full((48, 64, 3), (30, 60, 90), np.uint8)
    frame[10:20, 2 * i:2 * i + 10] = (200, 150, 10 * i)
    return frame


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "frames"
    made.mkdir()
    for i in (0, 1, 2, 10):
        ts.write_png(made / f"{i}.png", picture(i))
    return made


def test_a_folder_in_natural_order(folder):
    frames = ts.frames(folder)
    assert frames.count == 4 and iter(frames) is frames
    seen = [(seconds, frames.name, frames.number, image) for seconds, image in frames]
    assert [one[:3] for one in seen] == [(None, "0", 0), (None, "1", 1), (None, "2", 2), (None, "10", 3)]
    assert np.array_equal(seen[3][3], picture(10))
    assert frames.sequence == "frames" and frames.rest is None and frames.force_N is None
    with pytest.raises(StopIteration):
        next(frames)


def test_times_are_a_rates_or_a_tables(folder, tmp_path):
    assert [s for s, _ in ts.frames(folder, rate=20)] == [0.0, 0.05, 0.1, 0.15]
    table = tmp_path / "times.csv"
    table.write_text("frame,t_s\n0,1\n1,1.5\n2,2\n3,9\n")
    assert [s for s, _ in ts.frames(str(folder), times=table)] == [1.0, 1.5, 2.0, 9.0]
    assert [s for s, _ in ts.frames(folder, rate=20, count=2)] == [0.0, 0.05]
    assert len(list(ts.frames(folder, rate=20, seconds=0.1))) == 2
    table.write_text("frame,t_s\n0,1\n1,one\n")
    with pytest.raises(ts.Error) as caught:
        ts.frames(folder, times=table)
    assert caught.value.file == str(table) and caught.value.line == 3


def test_a_damaged_frame_is_left_out_with_a_warning(folder):
    (folder / "1.png").write_bytes((folder / "2.png").read_bytes()[:60])
    frames = ts.frames(folder)
    with pytest.warns(UserWarning, match="1.png: can't be read"):
        assert len(list(frames)) == 3
    assert len(frames.faults) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(UserWarning):
            list(ts.frames(folder))


def test_what_is_no_source_is_an_error(folder, tmp_path):
    (tmp_path / "clip.mp4").write_text("no video")
    for source, message in [(tmp_path / "none", "there is no such folder or file"), (63, "camera 63: there is no"),
                            (tmp_path / "clip.mp4", "can't be read as a video"), ("ftp://x/y", "isn't read from")]:
        with pytest.raises(ts.Error, match=message):
            ts.frames(source)
    with pytest.raises(ts.Error, match="127.0.0.1:9"):
        next(ts.frames("http://127.0.0.1:9/x", timeout=2))
    for wrong in [dict(rate=0), dict(rate=-1), dict(count=0), dict(split="half"), dict(timeout=0), dict(seconds="x")]:
        with pytest.raises(ts.Error):
            ts.frames(folder, **wrong)


def test_a_served_sensor_is_a_source():
    program = os.environ.get("TOUCHSTONE_PROGRAM")
    if not program:
        pytest.skip("the program isn't built")
    device = os.path.join(os.path.dirname(__file__), "../../python/examples/quick-sensor.yaml")
    served = subprocess.Popen([program, "--quiet", "serve", device, "--port", "0"],
                              stdout=subprocess.PIPE, text=True)
    try:
        address = next(line for line in served.stdout if line.startswith("frames: ")).split()[1]
        times = []
        for seconds, image in ts.frames(address, count=5, timeout=60):
            assert image.dtype == np.uint8 and image.ndim == 3 and image.std() > 0
            times.append(seconds)
        assert len(times) == 5 and times[0] == 0.0 and np.all(np.diff(times) > 0)
    finally:
        served.send_signal(signal.SIGINT)
        served.wait(60)


def serve_jpegs(frames):
    """Sends JPEGs, then nothing more."""
    done = threading.Event()

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
            self.end_headers()
            for jpeg in frames:
                self.wfile.write(b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(jpeg))
                self.wfile.write(jpeg + b"\r\n")
            done.wait(60)

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server, done


def test_ctrl_c_ends_the_wait_for_a_frame_that_never_comes():
    server, done = serve_jpegs([])
    program = ("import sys, touchstone as ts\n"
               "print('waits', flush=True)\n"
               "try:\n    next(ts.frames(sys.argv[1], timeout=60))\n"
               "except (KeyboardInterrupt, ts.Error) as error:\n    print(type(error).__name__)\n")
    address = f"http://127.0.0.1:{server.server_address[1]}/x"
    waiting = subprocess.Popen([sys.executable, "-c", program, address], stdout=subprocess.PIPE, text=True)
    try:
        assert waiting.stdout.readline() == "waits\n"
        time.sleep(0.5)
        waiting.send_signal(signal.SIGINT)
        assert waiting.communicate(timeout=50)[0] == "KeyboardInterrupt\n"
    finally:
        waiting.kill()
        done.set()
        server.shutdown()
