"""Attacks on the built program: attacks_test.py PROGRAM WRITE_LOG SOURCE [CLASS]."""

import json
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

PROGRAM = ""
WRITE_LOG = ""
SOURCE = pathlib.Path()
NOBODY = 65534
PATIENCE_S = 120


class Attack(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="touchstone-attack-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.scenes = self.folder / "jobs"
        shutil.copytree(SOURCE / "tests/jobs", self.scenes)

    def run_program(self, *words, environment=None, **more):
        more = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **more}
        with_path = {"PATH": os.environ["PATH"], **(environment or {"HOME": str(self.folder)})}
        return subprocess.run(
            [PROGRAM, *map(str, words)], env=with_path, timeout=PATIENCE_S, encoding="utf-8", errors="replace", **more
        )

    def expect_refused(self, run, *parts):
        """One line on stderr that has all parts, and exit code 2."""
        self.assertEqual(run.returncode, 2, run.stderr)
        self.assertTrue(run.stderr.startswith("touchstone: "), run.stderr)
        self.assertEqual(run.stderr.count("\n"), 1, run.stderr)
        for part in parts:
            self.assertIn(str(part), run.stderr)


class FoldersOfSetUpResults(Attack):
    def plan(self, *words, **environment):
        environment = {name: str(value) for name, value in environment.items()}
        return self.run_program(*words, "plan", "--no-seconds", self.scenes / "beads-scene.yaml", environment=environment)

    def own(self):
        """HOME's folder of set-up results, of mode 0700."""
        folder = self.folder / ".cache/touchstone"
        folder.mkdir(parents=True)
        folder.chmod(0o700)
        return folder

    def test_without_a_home_it_is_made_for_this_user_alone(self):
        run = self.plan(TMPDIR=self.folder)
        self.assertEqual(run.returncode, 0, run.stderr)
        made = self.folder / f"touchstone-cache-{os.geteuid()}"
        self.assertEqual(made.stat().st_mode & 0o777, 0o700)

    def test_somebody_elses_is_refused(self):
        if os.geteuid() != 0:
            self.skipTest("only root can give a folder away")
        for name in ("touchstone-cache", "touchstone-cache-0"):
            (self.folder / name).mkdir(mode=0o755)
            os.chown(self.folder / name, NOBODY, NOBODY)
        self.expect_refused(self.plan(TMPDIR=self.folder), "touchstone-cache-0", "another user", "--cache")
        os.chown(self.own(), NOBODY, NOBODY)
        self.expect_refused(self.plan(HOME=self.folder), self.folder / ".cache/touchstone", "another user")

    def test_somebody_elses_link_is_refused(self):
        if os.geteuid() != 0:
            self.skipTest("only root can give a link away")
        target = self.folder / "private"
        target.mkdir(mode=0o700)
        link = self.folder / "touchstone-cache-0"
        link.symlink_to(target)
        os.chown(link, NOBODY, NOBODY, follow_symlinks=False)
        self.expect_refused(self.plan(TMPDIR=self.folder), link, "another user")

    def test_one_that_others_may_write_is_refused_unless_it_is_named(self):
        folder = self.own()
        for mode in (0o777, 0o770, 0o1777):
            folder.chmod(mode)
            self.expect_refused(self.plan(HOME=self.folder), folder, "written by others", "TOUCHSTONE_CACHE")
        self.assertEqual(self.plan(HOME=self.folder, TOUCHSTONE_CACHE=folder).returncode, 0)
        self.assertEqual(self.plan("--cache", folder, HOME=self.folder).returncode, 0)
        folder.chmod(0o755)
        self.assertEqual(self.plan(HOME=self.folder).returncode, 0)

    def test_help_needs_none(self):
        self.own().chmod(0o777)
        self.assertEqual(self.run_program("plan", "--help").returncode, 0)


class ClosedDescriptors(Attack):
    def test_no_file_of_a_run_becomes_stdout_or_stderr(self):
        out = self.folder / "set"
        command = 'exec "$0" --cache "$1" generate "$2" -o "$3" <&- >&- 2>&-'
        run = subprocess.Popen(
            ["/bin/bash", "-c", command, PROGRAM, self.folder / "cache", self.scenes / "beads.yaml", out],
            env={"PATH": os.environ["PATH"]},
        )
        held = set()
        end = time.monotonic() + PATIENCE_S
        while run.poll() is None and time.monotonic() < end:
            time.sleep(0.02)
            if not (out / ".unfinished/lock").exists():
                continue
            try:
                held.add(tuple(os.readlink(f"/proc/{run.pid}/fd/{number}") for number in range(3)))
            except FileNotFoundError:  # it has just ended
                continue
        run.kill()
        self.assertEqual(run.wait(), 0)
        self.assertEqual(held, {("/dev/null",) * 3})


class FullOutput(Attack):
    def test_a_full_stdout_is_said(self):
        with open("/dev/full", "w") as full:
            for words in (["--version"], ["schema", "device"], ["plan", "--no-seconds", self.scenes / "beads-scene.yaml"]):
                run = self.run_program(*words, stdout=full)
                self.assertEqual(run.returncode, 1, words)
                self.assertIn("touchstone: stdout: ", run.stderr)

    def test_a_limit_of_file_size_is_an_error_that_names_the_file(self):
        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (1024, 1024))

        run = self.run_program("schema", "-o", self.folder / "schemas", preexec_fn=limit)
        self.expect_refused(run, self.folder / "schemas", ".schema.json", "File too large")
        self.assertEqual(list((self.folder / "schemas").glob(".*")), [])


class LossOfPower(Attack):
    def test_a_manifest_has_its_name_when_all_is_on_the_disk(self):
        out = self.folder / "set"
        environment = {
            "HOME": str(self.folder),
            "LD_PRELOAD": WRITE_LOG,
            "ASAN_OPTIONS": "verify_asan_link_order=0",
            "TOUCHSTONE_WRITE_LOG": str(self.folder / "log"),
        }
        run = self.run_program("--quiet", "generate", self.scenes / "beads.yaml", "-o", out, environment=environment)
        self.assertEqual(run.returncode, 0, run.stderr)
        log = [line.split("\t") for line in (self.folder / "log").read_text().splitlines()]
        named = next(i for i, line in enumerate(log) if line[0] == "renamed" and line[2] == str(out / "dataset.json"))
        before = {line[1] for line in log[:named] if line[0] == "on disk"}
        wanted = {log[named][1]}  # its own bytes
        for file in json.loads((out / "dataset.json").read_text())["files"]:
            wanted |= {str(out / file["file"]), str((out / file["file"]).parent)}
        self.assertGreater(len(wanted), 10)
        self.assertEqual(wanted - before, set())
        self.assertIn(["on disk", str(out)], log[named:])


class Memory(Attack):
    """Limits of address space: refused by name before work begins, never waited at."""

    def render(self, megabytes):
        def limit():
            resource.setrlimit(resource.RLIMIT_AS, (megabytes * 10**6, megabytes * 10**6))

        words = ["--threads", "2", "--cache", self.folder / "cache", "render", SOURCE / "scenes/vhs/ball-press.yaml"]
        return self.run_program(*words, "--frame", "0", "-o", self.folder / "frame.png", preexec_fn=limit)

    def test_too_little_to_begin_is_said(self):
        for megabytes in (300, 354, 450):
            self.expect_refused(self.render(megabytes), "500 MB of address space", "ulimit -v")

    def test_too_little_for_threads_and_for_a_gel_is_said_with_both_amounts(self):
        self.expect_refused(self.render(614), "2 threads", "needs about 420 MB", "are left by the address space")
        for megabytes in (920, 1020):  # what is mapped at first differs by a buffer of 131 MB
            self.expect_refused(self.render(megabytes), "tetrahedra needs about 772 MB", "are left by the address space")

    def test_python_is_refused_before_it_waits_for_ever(self):
        module = pathlib.Path(PROGRAM).parent.parent / "python"
        if not (module / "touchstone").is_dir():
            self.skipTest("this build has no Python module")

        def limit():
            resource.setrlimit(resource.RLIMIT_AS, (340 * 10**6, 340 * 10**6))

        run = subprocess.run(["/usr/bin/python3", "-c", "import touchstone"], env={"PYTHONPATH": str(module)}, preexec_fn=limit,
                             timeout=PATIENCE_S, stderr=subprocess.PIPE, encoding="utf-8")
        self.assertEqual(run.returncode, 1, run.stderr)
        self.assertIn("500 MB of address space", run.stderr)

    def test_a_job_of_too_many_files_is_refused(self):
        job = self.scenes / "draw.yaml"
        text = job.read_text().replace("../../scenes", str(SOURCE / "scenes"))
        job.write_text(text.replace("samples: 20", "samples: 2000000000"))
        self.expect_refused(self.run_program("plan", job), "draw.yaml:", "samples: 2000000000", "allowed are 900000 files")


class Refusals(Attack):
    def change(self, name, old, new):
        text = (self.scenes / name).read_text()
        self.assertIn(old, text)
        (self.scenes / name).write_text(text.replace(old, new))

    def plan(self, scene="beads-scene.yaml"):
        return self.run_program("plan", "--no-seconds", self.scenes / scene)

    def test_a_pixel_that_holds_no_electron(self):
        self.change("beads-device.yaml", "full_well_e: 50000", "full_well_e: 1e-300")
        self.expect_refused(self.plan(), "beads-device.yaml:", "full_well_e: 1e-300", "from 1 to")

    def test_pipes_and_devices_in_the_place_of_files(self):
        self.expect_refused(self.run_program("plan", "/dev/zero"), "/dev/zero: can't be read", "only files are read")
        for name in ("beads-device.yaml", "probe.yaml", "beads-motion.yaml", "beads-scene.yaml"):
            (self.scenes / name).unlink()
            os.mkfifo(self.scenes / name)
            self.expect_refused(self.plan(), name, "is a pipe or a device; only files are read")
            (self.scenes / name).unlink()
            shutil.copy(SOURCE / "tests/jobs" / name, self.scenes)
        os.mkfifo(self.scenes / "body.stl")
        self.change("probe.yaml", "shape: {", "shape: {type: mesh, file: body.stl} #")
        self.expect_refused(self.plan(), "probe.yaml:2: shape.file:", "body.stl: can't be read", "only files are read")

    def test_pixels_smaller_than_light_or_larger_than_a_sensor(self):
        for pitch in ("1e-300", "1e300"):
            shutil.copy(SOURCE / "tests/jobs/beads-device.yaml", self.scenes)
            self.change("beads-device.yaml", "pixel_pitch_um: 30", f"pixel_pitch_um: {pitch}")
            self.expect_refused(self.plan(), "beads-device.yaml:", f"pixel_pitch_um: {pitch}", "from 0.01 to 10000")

    def test_long_values_are_cut(self):
        for long in ("x" * 1000000, "1" * 1000000, "\u00e4" * 500000):
            shutil.copy(SOURCE / "tests/jobs/beads-device.yaml", self.scenes)
            self.change("beads-device.yaml", "thickness_mm: 4", f"thickness_mm: {long}")
            run = self.plan()
            self.expect_refused(run, "beads-device.yaml:2: gel.thickness_mm")
            self.assertLess(len(run.stderr), 500)
        shutil.copy(SOURCE / "tests/jobs/beads-device.yaml", self.scenes)
        self.change("beads-device.yaml", "room_radiance:", "x" * 1000 + ":")
        run = self.plan()
        self.expect_refused(run, "beads-device.yaml:", "unknown key 'xxx")
        self.assertLess(len(run.stderr), 500)

    def test_control_characters_are_shown(self):
        self.change("beads-device.yaml", "thickness_mm: 4", 'thickness_mm: "\\e[2J"')
        run = self.plan()
        self.expect_refused(run, r"'\x1b[2J'")


if __name__ == "__main__":
    PROGRAM, WRITE_LOG, SOURCE = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
    unittest.main(argv=sys.argv[:1] + sys.argv[4:], verbosity=1)
