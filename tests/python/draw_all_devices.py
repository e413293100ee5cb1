#!/usr/bin/python3
"""For each shipped device a drawn set of 20 samples, made whole and in two shards: the same bytes. Long: minutes each.

    draw_all_devices.py PROGRAM SCENES [DEVICE...]
"""

import json
import pathlib
import subprocess
import sys
import tempfile
import time

OUTPUTS = {
    "vhs": ["frame", "contact", "beads", "traction"],
    "vhs-spectral": ["frame", "contact", "beads", "traction"],
    "chroma": ["frame", "height", "contact", "markers", "traction"],
    "chroma-compact": ["frame", "height", "contact", "markers", "traction"],
    "dvs-grasp": ["frame", "height", "contact", "events"],
    "reflex": ["frame", "statistics", "markers"],
    "tactip": ["frame", "height", "contact", "markers"],
    "gelsight-markers": ["frame", "height", "contact", "markers"],
    "evetac": ["frame", "height", "contact", "markers", "events"],
    "gelsight-mini-markers": ["frame", "height", "contact", "markers"],
}
OTHERS = ["frame", "height", "contact"]
JOB = """
name: {device}
seed: 5
samples: 20
samples_per_file: 5
draw:
  device: {scenes}/devices/{device}.yaml
  units: {{count: 2, vary: [{{path: gel.youngs_modulus_MPa, times: {{uniform: [0.9, 1.1]}}}}]}}
  objects:
    - {{file: {scenes}/objects/ball-8mm.yaml, vary: [{{path: shape.radius_mm, set: {{uniform: [2, 5]}}}}]}}
  place_mm: {{x: {{uniform: [-1, 1]}}, y: {{uniform: [-1, 1]}}}}
  force_N: {{log_uniform: [0.2, 0.8]}}
  drag_mm: {{uniform: [0, 0.1]}}
outputs: [{outputs}]
splits: {{train: 0.8, test: 0.2}}
"""


def blocks(folder):
    return {path.name: path.read_bytes() for path in sorted((folder / "blocks").iterdir())}


def main():
    program, scenes, *devices = sys.argv[1:]
    scenes = pathlib.Path(scenes).resolve()
    devices = devices or sorted(path.stem for path in (scenes / "devices").glob("*.yaml"))
    wrong = 0
    for device in devices:
        with tempfile.TemporaryDirectory() as scratch:
            folder = pathlib.Path(scratch)
            job = folder / "job.yaml"
            job.write_text(JOB.format(device=device, scenes=scenes, outputs=", ".join(OUTPUTS.get(device, OTHERS))))
            begun = time.time()
            run = lambda *words: subprocess.run([program, *words], check=True, capture_output=True, text=True)
            try:
                run("generate", job, "-o", folder / "whole")
                whole_s = time.time() - begun
                run("generate", job, "-o", folder / "parts", "--shard", "1/2")
                run("generate", job, "-o", folder / "parts", "--shard", "2/2")
                run("merge", job, "-o", folder / "parts")
            except subprocess.CalledProcessError as error:
                print(f"{device}: {error.stderr.strip()}")
                wrong += 1
                continue
            same = blocks(folder / "whole") == blocks(folder / "parts")
            content = [json.loads((folder / name / "dataset.json").read_text())["content_sha256"]
                       for name in ("whole", "parts")]
            verdict = "the same bytes" if same and content[0] == content[1] else "OTHER BYTES"
            wrong += verdict != "the same bytes"
            print(f"{device}: 20 samples, whole in {whole_s:.0f} s, and in two shards: {verdict}", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
