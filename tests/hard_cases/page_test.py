"""The page of hard cases says what reports say, and ends with 1 for whatever doesn't hold. Reports here are made up."""
import contextlib
import io
import json
import os
import pathlib
import stat
import sys
import tempfile
import textwrap
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "script"))
import hard_cases_page as page  # noqa: E402


def entry(name, did="it measured 3e-9", **more):
    return {"name": name, "status": "RUN", "result": "COMPLETED", "time": "0.25s", **({"did": did} if did else {}), **more}


def good_report():
    """All cases, each with one test."""
    return {"testsuites": [{"name": f"HardCase{number}", "testsuite": [entry("Holds")]}
                           for number in range(1, len(page.CASES) + 1)]}


class PageTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.page = self.folder / "page.html"

    def make(self, how, *files):
        """The code it ends with, and what it says."""
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            code = page.main(["-o", str(self.page), "--date", "a Monday", how, *map(str, files)])
        return code, said.getvalue()

    def read(self, report):
        file = self.folder / "report.json"
        file.write_text(json.dumps(report))
        return self.make("read", file)

    def row(self, number):
        lines = self.page.with_suffix(".md").read_text().splitlines()
        return next(line for line in lines if line.startswith(f"| {number} |"))

    def program(self, text):
        file = self.folder / "program"
        file.write_text("#!/usr/bin/python3\nimport json, os, signal, sys\n" + textwrap.dedent(text))
        file.chmod(file.stat().st_mode | stat.S_IXUSR)
        return file

    def test_the_list_has_forty_six_cases(self):
        self.assertEqual(len(page.CASES), 46)

    def test_a_whole_run_holds_and_shows_its_numbers(self):
        report = good_report()
        report["testsuites"][6]["testsuite"] = [entry("A", "force 0 N\nbeads 0 mm"), entry("B", 'refused: "5 | 6 < 7"')]
        code, said = self.read(report)
        self.assertEqual(code, 0, said)
        self.assertIn(f"{len(page.CASES)} of {len(page.CASES)} cases hold.", said)
        self.assertIn(r'force 0 N<br>beads 0 mm<br>refused: "5 \| 6 \< 7" | yes | 0.5 |', self.row(7))
        self.assertIn("<li>refused: &quot;5 | 6 &lt; 7&quot;</li>", self.page.read_text())
        self.assertIn("a Monday", self.page.read_text())

    def test_a_suite_may_bear_a_topic_after_its_number(self):
        report = good_report()
        report["testsuites"][26]["name"] = "HardCase27Media"
        self.assertEqual(self.read(report)[0], 0)

    def test_what_does_not_hold_is_said(self):
        spoilt = {
            "failed: far too much": entry("X", failures=[{"failure": "a_test.cpp:7\nfar too much", "type": ""}]),
            "without a word": entry("X", did=None),
            "was skipped": entry("X", result="SKIPPED"),
            "wasn't run": entry("X", did=None, status="NOTRUN", result="SUPPRESSED"),
        }
        for fault, test in spoilt.items():
            with self.subTest(fault):
                report = good_report()
                report["testsuites"][11]["testsuite"].append(test)
                code, said = self.read(report)
                self.assertEqual(code, 1)
                self.assertIn(f"{len(page.CASES) - 1} of {len(page.CASES)} cases hold.", said)
                self.assertIn(f"HardCase12.X {fault}" if fault != "without a word" else fault, self.row(12))
                self.assertIn("| **NO** |", self.row(12))

    def test_a_case_without_a_test_does_not_hold(self):
        report = good_report()
        del report["testsuites"][4]
        code, _ = self.read(report)
        self.assertEqual(code, 1)
        self.assertIn("no test of it was run", self.row(5))

    def test_a_test_of_no_case_is_named(self):
        for name in ["Press", f"HardCase{len(page.CASES) + 1}", "HardCase0"]:
            report = good_report()
            report["testsuites"].append({"name": name, "testsuite": [entry("Lost")]})
            code, said = self.read(report)
            self.assertEqual(code, 1)
            self.assertIn(f"{name}.Lost", said)

    def test_a_report_that_is_not_there_is_named(self):
        code, said = self.make("read", self.folder / "none.json")
        self.assertEqual(code, 1)
        self.assertIn("none.json: there is no such file", said)

    def test_a_program_is_run_and_one_that_dies_is_reported(self):
        program = self.program("""
            tests = [{"name": "HardCase3", "testsuite": [{"name": "A"}, {"name": "B"}, {"name": "C"}]}]
            out = next(a for a in sys.argv if a.startswith("--gtest_output=json:")).split(":", 1)[1]
            if "--gtest_list_tests" in sys.argv:
                open(out, "w").write(json.dumps({"testsuites": tests}))
            else:
                print("[ RUN      ] HardCase3.A\\n[       OK ] HardCase3.A\\n[ RUN      ] HardCase3.B", flush=True)
                os.kill(os.getpid(), signal.SIGKILL)
            """)
        code, _ = self.make("run", program)
        self.assertEqual(code, 1)
        self.assertIn("HardCase3.B ended its program by SIGKILL", self.row(3))
        self.assertIn("HardCase3.C was lost", self.row(3))

    def test_markdown_alone_is_written_where_it_is_asked_for(self):
        self.page = self.folder / "only.md"
        self.assertEqual(self.read(good_report())[0], 0)
        self.assertIn(f"| {len(page.CASES)} |", self.page.read_text())
        self.assertFalse(self.page.with_suffix(".html").exists())

    def test_another_ending_is_refused(self):
        with self.assertRaises(SystemExit), contextlib.redirect_stderr(io.StringIO()):
            page.main(["-o", "page.txt", "read", os.devnull])


if __name__ == "__main__":
    sys.dont_write_bytecode = True
    unittest.main()
