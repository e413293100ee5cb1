"""Damaged files of every kind that the program reads: mutated_inputs.py PROGRAM SOURCE [--count N] [--seed S] [--keep FOLDER].

Each run damages one file of a sound set of them (bytes turned, cut out, doubled, put in; numbers and lines of texts
made extreme, left out, exchanged) and gives it to the command that reads it. Such a run ends within a minute, by 0 or
as a refusal (2) of one line that names one of its files. The damage depends on the seed and the run's number alone.
"""

import argparse
import os
import pathlib
import random
import re
import resource
import shutil
import struct
import subprocess
import sys
import tempfile
import zlib

PATIENCE_S = 60
MOST_MEMORY_MB = 3000
EXTREMES = [b"-1", b"0", b"1e308", b"-1e308", b"1e-308", b"nan", b".inf", b"99999999999999999999", b"2147483648", b"''", b"[]", b"{}",
            b"1.5", b"~", b"!!binary x", b"\xff\xfe", b"../../../etc/passwd", b"&a [*a]", b"%", b"\x00"]


class Case:
    """A sound set of files: those that are damaged, all whose names count in a refusal, and the command."""

    def __init__(self, name, folder, damaged, command, named=()):
        self.name = name
        self.files = [folder / one for one in damaged]
        self.names = {pathlib.Path(one).name for one in (*damaged, *named)}
        self.command = [str(word) for word in command]


def grey_png(width, height):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + bytes((x * y) % 256 for x in range(width) for _ in range(3)) for y in range(height))
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def yaml_cases(folder, source):
    jobs = folder / "tests/jobs"
    shutil.copytree(source / "tests/jobs", jobs)
    for part in ("studies", "devices", "objects", "motions", "spectra", "vhs", "jobs"):
        shutil.copytree(source / "scenes" / part, folder / "scenes" / part)
    scene = ["beads-scene.yaml", "beads-device.yaml", "beads-motion.yaml", "probe.yaml"]
    yield Case("scene", jobs, scene, ["plan", "--no-seconds", jobs / "beads-scene.yaml"])
    yield Case("job of scenes", jobs, ["beads.yaml"], ["plan", "--no-seconds", jobs / "beads.yaml"], scene)
    yield Case("job that draws", jobs, ["draw.yaml", "coated-device.yaml"], ["plan", "--no-seconds", jobs / "draw.yaml"],
               ["ball-4mm.yaml", "cylinder-8.5mm.yaml", "coin-penny.yaml"])
    studies = folder / "scenes/studies"
    yield Case("study", studies, ["vhs-thickness-spacing.yaml"], ["plan", "--no-seconds", studies / "vhs-thickness-spacing.yaml"],
               [path.name for path in (folder / "scenes/vhs").iterdir()])
    (jobs / "fit.yaml").write_text(
        "name: unit\ndevice: coated-device.yaml\nunknowns:\n  - {path: 'lamps[0].power_W[0]', times: [0.5, 2]}\n"
        "presses:\n  - {picture: missing.png, object: ../../scenes/objects/ball-4mm.yaml, place_mm: [0, 0], depth_mm: 0.2}\n")
    yield Case("fit", jobs, ["fit.yaml"], ["fit", jobs / "fit.yaml", "-o", folder / "fit-out"],
               ["missing.png", "coated-device.yaml", "ball-4mm.yaml"])


def mesh_cases(folder, source):
    jobs = folder / "tests/jobs"
    for mesh in sorted([*(source / "tests/fuzz/corpus/plain_mesh").iterdir(), *(source / "tests/fuzz/corpus/gltf").iterdir()]):
        shutil.copy(mesh, jobs / mesh.name)
        stem = mesh.name.replace(".", "-")
        (jobs / f"{stem}.yaml").write_text(f"name: body\nshape: {{type: mesh, file: {mesh.name}}}\nradiance: 1\n")
        text = (source / "tests/jobs/beads-scene.yaml").read_text().replace("probe.yaml", f"{stem}.yaml")
        (jobs / f"{stem}-scene.yaml").write_text(text)
        yield Case(f"mesh {mesh.name}", jobs, [mesh.name], ["plan", "--no-seconds", jobs / f"{stem}-scene.yaml"],
                   [f"{stem}.yaml", f"{stem}-scene.yaml"])


def event_cases(folder, source):
    events = folder / "events"
    events.mkdir()
    for file in sorted([*(source / "tests/fuzz/corpus/events").iterdir(), source / "tests/fuzz/corpus/event_hdf5/dsec.h5"]):
        shutil.copy(file, events / file.name)
        yield Case(f"events {file.name}", events, [file.name],
                   ["export", "events", events / file.name, "-o", events / "out.txt", "--width", 640, "--height", 480])


def picture_cases(folder, source):
    pictures = folder / "pictures"
    pictures.mkdir()
    (pictures / "press.png").write_bytes(grey_png(40, 30))
    shutil.copy(source / "docs/images/digit.jpg", pictures / "press.jpg")
    (pictures / "rest.png").write_bytes(grey_png(40, 30))
    (pictures / "presses.csv").write_text("file,u_px,v_px,radius_px,ball_diameter_mm\npress.png,20,15,8,4.7\npress.png,,,,4.7\n")
    for kind, file in (("gelsight", "height.gel"), ("9dtact", "darkness.dark")):
        shutil.copy(source / "tests/fuzz/corpus/models" / file, pictures / file)
        for frame in ("press.png", "press.jpg"):
            frames = folder / f"frames-{kind}-{frame[-3:]}"
            frames.mkdir()
            shutil.copy(pictures / frame, frames / frame)
            command = ["estimate", kind, "--model", pictures / file, "--frames", frames, "-o", folder / "heights"]
            yield Case(f"{frame[-3:]} for {kind}", frames, [frame], command, [file])
        yield Case(f"model {file}", pictures, [file], command, ["press.jpg"])
    command = ["calibrate", "gelsight", "--frames", pictures, "--annotations", pictures / "presses.csv", "--background",
               pictures / "rest.png", "--mm-per-px", 0.1, "-o", folder / "table.gel"]
    yield Case("csv", pictures, ["presses.csv", "rest.png"], command, ["press.png"])


def set_cases(folder, program):
    made = folder / "set"
    subprocess.run([program, "--quiet", "generate", folder / "tests/jobs/beads.yaml", "-o", made], check=True,
                   stdout=subprocess.DEVNULL, env=environment(folder))
    files = [str(path.relative_to(made)) for path in sorted(made.rglob("*")) if path.is_file() and ".yaml" not in path.name]
    yield Case("data set", made, files, ["inspect", made, "-o", folder / "page.html", "--job", folder / "tests/jobs/beads.yaml"],
               ["beads.yaml"])


def environment(folder):
    # HDF5 1.10 forgets some memory when it gives up on a damaged file: a sanitizer is to pass over that.
    leaks = folder / "leaks-of-others.txt"
    leaks.write_text("leak:libhdf5\n")
    return {"PATH": os.environ["PATH"], "HOME": str(folder), "ASAN_OPTIONS": os.environ.get("ASAN_OPTIONS", ""),
            "LSAN_OPTIONS": f"suppressions={leaks}:print_suppressions=0"}


def damaged(data, numbers):
    """The bytes with one to three damages."""
    for _ in range(numbers.randint(1, 3)):
        at = numbers.randrange(len(data) + 1)
        length = numbers.choice([1, 2, 4, 16, 64, 1024])
        kind = numbers.randrange(9)
        if kind == 0 and data:
            at = min(at, len(data) - 1)
            data = data[:at] + bytes([data[at] ^ 1 << numbers.randrange(8)]) + data[at + 1:]
        elif kind == 1:
            data = data[:at]
        elif kind == 2:
            data = data[:at] + data[at + length:]
        elif kind == 3:
            data = data[:at] + data[at:at + length] * 2 + data[at + length:]
        elif kind == 4:
            data = data[:at] + numbers.randbytes(length) + data[at:]
        elif kind == 5:
            data = data[:at] + b"\xff" * length + data[at + length:]
        elif kind in (6, 7):
            found = list(re.finditer(rb"-?\d+\.?\d*(?:e[-+]?\d+)?", data[:20000]))
            if found:
                one = numbers.choice(found)
                data = data[:one.start()] + numbers.choice(EXTREMES) + data[one.end():]
        else:
            lines = data.split(b"\n")
            one, other = numbers.randrange(len(lines)), numbers.randrange(len(lines))
            lines[one], lines[other] = lines[other], numbers.choice([lines[one], b"", lines[other]])
            data = b"\n".join(lines)
    return data


def fault_of(case, program, folder, ends):
    """What is wrong with how the command ends, or None. How it ends is counted in `ends`."""
    try:
        run = subprocess.run([program, "--quiet", *case.command], env=environment(folder), timeout=PATIENCE_S,
                             capture_output=True, encoding="utf-8", errors="replace")
    except subprocess.TimeoutExpired:
        return f"still runs after {PATIENCE_S} s"
    ends[run.returncode] = ends.get(run.returncode, 0) + 1
    if run.returncode == 0:
        return None
    if run.returncode != 2:
        return f"ended with {run.returncode}: {run.stderr[-300:]}"
    lines = run.stderr.rstrip("\n").split("\n")
    refusal = lines[-1]
    if not refusal.startswith("touchstone: "):
        return f"no refusal: {run.stderr[-300:]}"
    if not any(name in refusal for name in case.names):
        return f"names no file: {refusal[:300]}"
    if len(refusal) > 2000:
        return f"a refusal of {len(refusal)} bytes"
    return None


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("program", type=pathlib.Path)
    options.add_argument("source", type=pathlib.Path)
    options.add_argument("--count", type=int, default=100)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--only", default="", help="cases whose name begins so")
    options.add_argument("--keep", type=pathlib.Path, help="folder for the files that were at fault")
    given = options.parse_args()
    with tempfile.TemporaryDirectory(prefix="touchstone-mutated-") as name:
        folder = pathlib.Path(name)
        cases = [*yaml_cases(folder, given.source), *mesh_cases(folder, given.source), *event_cases(folder, given.source),
                 *picture_cases(folder, given.source), *set_cases(folder, given.program)]
        cases = [case for case in cases if case.name.startswith(given.only)]
        faults = []
        for case in cases:
            fault = fault_of(case, given.program, folder, {})
            if fault:
                faults.append(f"{case.name}, sound: {fault}")
        ends = {}
        for number in range(given.count):
            numbers = random.Random(given.seed * 1_000_003 + number)
            case = cases[number % len(cases)]
            file = numbers.choice(case.files)
            sound = file.read_bytes()
            file.write_bytes(damaged(sound, numbers))
            fault = fault_of(case, given.program, folder, ends)
            if fault:
                faults.append(f"run {number}, {case.name}, {file.name}: {fault}")
                if given.keep:
                    given.keep.mkdir(parents=True, exist_ok=True)
                    (given.keep / f"{number}-{file.name}").write_bytes(file.read_bytes())
            file.write_bytes(sound)
        most_mb = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
        if most_mb > MOST_MEMORY_MB:
            faults.append(f"a run took {most_mb:.0f} MB")
        print(f"{given.count} damaged files of {len(cases)} kinds: {ends.get(0, 0)} taken, {ends.get(2, 0)} refused, "
              f"{len(faults)} faults, at most {most_mb:.0f} MB")
        for fault in faults:
            print(fault)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
