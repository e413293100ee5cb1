"""Presses a sensor many times in Python and looks whether the process grows: presses_in_python.py [PRESSES].

Each touch's arrays are dropped before the next press. Exit code 1 if the memory grew by more than 40 MB after the
first tenth of the presses, in which what is needed once is made.
"""

import gc
import pathlib
import re
import sys
import tempfile

import touchstone as ts

MOST_GROWTH_MB = 40
SOURCE = pathlib.Path(__file__).resolve().parent.parent.parent


def memory_mb():
    status = pathlib.Path("/proc/self/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+) kB", status).group(1)) * 1024 / 1e6


def main(presses):
    with tempfile.TemporaryDirectory(prefix="touchstone-presses-") as folder:
        sensor = ts.Sensor(str(SOURCE / "tests/jobs/coated-device.yaml"), cache=folder)
        after_a_tenth = None
        for i in range(presses):
            touch = sensor.press("ball-8mm", force_N=0.1 + 0.1 * (i % 5), at_mm=(0.1 * (i % 3), 0))
            assert touch.frame.size > 0 and touch.height_mm.size > 0
            del touch
            if i + 1 == max(1, presses // 10):
                gc.collect()
                after_a_tenth = memory_mb()
        gc.collect()
        last = memory_mb()
    print(f"{presses} presses: {after_a_tenth:.0f} MB after a tenth, {last:.0f} MB at last")
    return 0 if last - after_a_tenth < MOST_GROWTH_MB else 1


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 100))
