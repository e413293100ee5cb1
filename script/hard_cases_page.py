"""The hard cases as a page: each case, what a good program does with it, and what ours did, with the numbers of a run.

    hard_cases_page.py -o PAGE [--date TEXT] run PROGRAM...    runs these test programs
    hard_cases_page.py -o PAGE [--date TEXT] read REPORT...    takes their reports: GoogleTest's --gtest_output=json

PAGE ends with .html, and the Markdown form is put beside it, or with .md. A test belongs to the case whose number its suite's name bears (HardCase27Media) and has
said what it measured by did() of tests/hard_cases/hard_case.h. Ends with 1 if a case doesn't hold: one of its tests
failed, wasn't run or said nothing, or it has none.
"""
import argparse
import collections
import html
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile

Case = collections.namedtuple("Case", "title good")

# In the order of the list, whose first number is 1.
CASES = [
    Case("Poisson's ratio of exactly 0.5",
         "Gives the answer of a gel with 0.5 - 1e-8 to 0.5 - 1e-6: incompressibility is a limit, not a division by zero."),
    Case("Poisson's ratio from 0.3 to 0.5",
         "Gives forces that rise smoothly and meet the closed form over the whole range; elements don't lock."),
    Case("Sliver tetrahedra",
         "Reports the mesh's smallest dihedral angle, and gives right results on such a mesh or refuses it."),
    Case("A very thin layer (thinner than a tenth of the contact's radius)",
         "Meets the layer's solution in closed form, or says that the mesh doesn't resolve it."),
    Case("A sharp flat punch",
         "The force converges as the mesh gets finer. The highest pressure is infinite in theory: it grows, and isn't given as a result."),
    Case("Contact at or over the pad's edge", "Gives a finite force, smaller than in the middle."),
    Case("A miss", "Gives a force of exactly zero."),
    Case("Overlap deeper than the gel", "Refuses it and says why; the press stays as it was."),
    Case("No friction (mu = 0)", "Gives the frictionless answer, bit for bit."),
    Case("Friction of mu = 5", "Converges, or says that it didn't."),
    Case("Infinite friction", "Is the bonded limit: nothing slips, and the larger mu is, the closer the result is to it."),
    Case("The same problem in m and Pa, in mm and MPa, and scaled by a million",
         "Gives the same answer after scaling."),
    Case("Vertices that coincide or nearly do (1e-9 mm)", "Refuses them and names the vertices."),
    Case("NaN or infinity in the input", "Refuses it where it comes in, and names the field."),
    Case("A boundary that crosses itself", "Refuses it and names where."),
    Case("No thickness", "Refuses it."),
    Case("A pad a thousand times as wide as thick", "Has a budget, and refuses what is beyond it."),
    Case("A surface that is open or not manifold", "Refuses it and names the edge, or defines the gap."),
    Case("Two objects at once", "Gives what the joint problem gives."),
    Case("Stick-slip and reversal", "Converges as the steps are halved, and keeps the laws of contact in each."),
    Case("Uniform pressure on quadratic faces", "Gives uniform contact pressures back."),
    Case("Contact smaller than an element", "Doesn't oscillate, and warns."),
    Case("Unloading", "Leaves no force if the material has no history."),
    Case("Rotation, mirror and another order of vertices",
         "Changes only the frame; the compliance is symmetric and positive definite."),
    Case("Shear at the limit of friction", "Reports gross slip, and meets any smaller shear."),
    Case("An object moved by 1e-9 mm", "Changes the answer as little: contact doesn't switch on and off."),
    Case("A camera inside the gel, coincident or index-matched faces, grazing light, a black membrane, a lamp in view, "
         "triangles without area, thick scattering",
         "Gives finite pictures without fireflies that make no energy (under a sky of radiance 1, loss-free scenes are 1 in "
         "every pixel), the same on any number of threads; or refuses by name."),
    Case("No light, too much light, a sensor of one pixel, no exposure",
         "Gives black level, full well and the mean of the light, or refuses what no camera can be, and names it."),
    Case("Event pixels: no light, thresholds near zero, steps of 1e6 to 1, two events in a microsecond",
         "Gives no events in the dark, counts a step's events by its logarithm, and refuses impossible thresholds."),
    Case("An estimator given frames that are black, saturated, constant or of another size",
         "Reports it, keeps its last result, and goes on with the next good frame."),
    Case("A thin layer (a tenth of the contact's radius) with Poisson's ratio from 0.45 to 0.5",
         "Meets the thin layer's theory from the compressible to the incompressible end; elements don't lock and pressure doesn't oscillate; a layer "
         "that is too thin for a mesh is refused."),
    Case("Stick-slip and reversal at finite strain",
         "Converges as the steps are halved, keeps the friction cone in each, and only dissipates."),
    Case("A sharp flat punch at finite strain, to a fifth of the thickness",
         "Tends to the small-strain answer at small depth, stiffens as it goes deeper, and converges with the mesh."),
    Case("A stiff skin on a soft gel, shortened until it wrinkles",
         "Answers, and says from which strain on the skin would wrinkle, which no press computes."),
    Case("A socket that fits the gel, with a clearance down to none",
         "Converges to a finite force, keeps the laws of contact, and agrees with a finer mesh."),
    Case("Needle, cone and knife edge", "Gives a finite force that converges with the mesh to the theory's, and says where the mesh doesn't resolve the contact."),
    Case("A gel that folds onto itself or reaches into the object's side",
         "Says so, or refuses it: contact of the gel with itself isn't solved."),
    Case("Excitation at the gel's resonance without damping",
         "Grows beside it as an oscillator in closed form; at it, where there is no steady answer, refuses it by name: never "
         "NaN, nor an amplitude that rounding made."),
    Case("Relaxation times 10^6 apart, in steps far longer than the shortest",
         "Gives the closed form's relaxation and creep, in steps of any length."),
    Case("10^4 cycles of stick and slip", "Gives the force of the tenth cycle in the last, and keeps the laws of contact in each."),
    Case("An object a thousandth as stiff as the gel", "Tends to the force of that object on a rigid plane."),
    Case("A plate led by torque that rocks onto its edge",
         "Meets force and moment, turns continuously until it stands on its edge, and refuses what no edge can hold."),
    Case("Fits whose rows repeat: a Gaussian process with duplicate rows, one class, one kind of row, too low a rank",
         "Gives the regularised or least-norm answer, or refuses and names what is missing."),
    Case("Time stamps that are equal or go backward",
         "Refuses them by name with its state kept, or says what they mean: no division by zero, no garbage."),
    Case("Lamps that flicker with the mains before event pixels",
         "Gives the events of the swing's logarithm, and no force that is wrong because of them without saying so."),
    Case("Light at the critical angle, exactly and last digits beside it",
         "Is finite and conserves energy, continuous from both sides, for rays, lamps, rough faces and light guides."),
]

STYLE = """
body { font-family: sans-serif; margin: 2em auto; max-width: 80em; padding: 0 1em; color: #222; background: #fff; }
table { border-collapse: collapse; width: 100%; font-size: 0.9em; }
th, td { text-align: left; padding: 0.3em 0.6em; border-bottom: 1px solid #ddd; vertical-align: top; }
th { border-bottom: 2px solid #888; }
td.number { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
td.yes { color: #006b4f; }
td.no { color: #fff; background: #b3261e; font-weight: bold; }
ul { margin: 0; padding-left: 1.1em; }
li.fault { color: #b3261e; font-weight: bold; }
"""


class Test:
    """One test: what it measured, and what is wrong, if anything is."""

    def __init__(self, suite, name):
        self.suite, self.name = suite, name
        self.did, self.faults, self.seconds = [], [], 0.0

    def id(self):
        return f"{self.suite}.{self.name}"

    def case(self):
        """The number of its case; nothing for a test of another name."""
        match = re.match(r"HardCase(\d+)(?![0-9])", self.suite)
        return int(match.group(1)) if match else None


def seconds_of(text):
    return float(text.rstrip("s"))


def tests_of(report):
    """The tests of a GoogleTest report, which is as it stands in the JSON file."""
    tests = []
    for suite in report.get("testsuites", []):
        for entry in suite["testsuite"]:
            test = Test(suite["name"], entry["name"])
            test.seconds = seconds_of(entry.get("time", "0s"))
            test.did = [line for line in entry.get("did", "").split("\n") if line]
            for failure in entry.get("failures", []):
                test.faults.append("failed: " + failure["failure"].split("\n", 1)[-1].strip())
            if entry.get("result") != "COMPLETED" or entry.get("status") != "RUN":
                test.faults.append("wasn't run" if entry.get("result") != "SKIPPED" else "was skipped")
            if not test.did and not test.faults:
                test.faults.append("passed without a word on what it measured")
            tests.append(test)
    return tests


def how_it_ended(code):
    if code >= 0:
        return f"with {code}"
    try:
        return f"by {signal.Signals(-code).name}"
    except ValueError:
        return f"by signal {-code}"


def run(program):
    """Runs a test program. What it would have run is asked first: a test that a crash swallows is missed."""
    with tempfile.TemporaryDirectory() as folder:
        listing = pathlib.Path(folder) / "listing.json"
        subprocess.run([program, "--gtest_list_tests", f"--gtest_output=json:{listing}"], check=True,
                       stdout=subprocess.DEVNULL)
        names = [(suite["name"], test["name"]) for suite in json.loads(listing.read_text())["testsuites"]
                 for test in suite["testsuite"]]
        report = pathlib.Path(folder) / "report.json"
        done = subprocess.run([program, f"--gtest_output=json:{report}"], stdout=subprocess.PIPE, text=True, errors="replace")
        if report.exists():
            return tests_of(json.loads(report.read_text()))
    begun = re.findall(r"^\[ RUN +\] (\S+)", done.stdout, re.MULTILINE)
    tests = [Test(*name) for name in names]
    for test in tests:
        last = begun and begun[-1] == test.id()
        test.faults.append(f"ended its program {how_it_ended(done.returncode)}" if last
                           else "was lost: another test ended the program")
    return tests


def by_case(tests):
    """For each case of the list its tests, and the tests that belong to none."""
    cases = [[test for test in tests if test.case() == number] for number in range(1, len(CASES) + 1)]
    placed = {id(test) for case in cases for test in case}
    return cases, [test for test in tests if id(test) not in placed]


def holds(tests):
    return bool(tests) and not any(test.faults for test in tests)


def lines_of(tests):
    """What a case's tests did, in one list: pairs of text and whether it is a fault."""
    if not tests:
        return [("no test of it was run", True)]
    lines = []
    for test in tests:
        lines += [(text, False) for text in test.did]
        lines += [(f"{test.id()} {fault}", True) for fault in test.faults]
    return lines


def summary(cases):
    return f"{sum(holds(tests) for tests in cases)} of {len(cases)} cases hold."


INTRO = ("Made by script/hard_cases. Tests of tests/hard_cases run each case; what is written under 'ours' was measured by them in "
         "that run. Errors are quoted in full; a number in brackets is what the test allows.")


def to_html(cases, header):
    rows = []
    for number, (case, tests) in enumerate(zip(CASES, cases), 1):
        items = "".join(f'<li{" class=fault" if fault else ""}>{html.escape(text)}</li>' for text, fault in lines_of(tests))
        rows.append(f'<tr><td class="number">{number}</td><td>{html.escape(case.title)}</td><td>{html.escape(case.good)}</td>'
                    f'<td><ul>{items}</ul></td><td class="{"yes" if holds(tests) else "no"}">'
                    f'{"yes" if holds(tests) else "NO"}</td><td class="number">{sum(t.seconds for t in tests):.1f}</td></tr>\n')
    heads = "".join(f"<th>{head}</th>" for head in HEADS)
    paragraphs = "".join(f"<p>{html.escape(line)}</p>\n" for line in [*header, summary(cases), INTRO])
    return (f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<title>Touchstone: hard cases</title>\n'
            f"<style>{STYLE}</style>\n</head>\n<body>\n<h1>Hard cases</h1>\n{paragraphs}<table>\n<tr>{heads}</tr>\n"
            f'{"".join(rows)}</table>\n</body>\n</html>\n')


HEADS = ["", "case", "a good program", "ours", "holds?", "seconds"]


def cell(text):
    """Text in a table's cell: no line ends, markup escaped."""
    return re.sub(r"([|\\*_`<\[])", r"\\\1", text.replace("\n", " ").replace("\r", " "))


def to_markdown(cases, header):
    lines = ["# Hard cases", "", *(f"- {cell(line)}" for line in header), f"- {summary(cases)}", "", INTRO, "",
             f"| {' | '.join(HEADS).strip()} |", "|" + " --- |" * len(HEADS)]
    for number, (case, tests) in enumerate(zip(CASES, cases), 1):
        did = "<br>".join(f"**{cell(text)}**" if fault else cell(text) for text, fault in lines_of(tests))
        lines.append(f"| {number} | {cell(case.title)} | {cell(case.good)} | {did} | {'yes' if holds(tests) else '**NO**'} | "
                     f"{sum(test.seconds for test in tests):.1f} |")
    return "\n".join(lines) + "\n"


def version():
    listing = (pathlib.Path(__file__).parent.parent / "CMakeLists.txt").read_text()
    return re.search(r"project\(Touchstone VERSION (\S+)", listing).group(1)


def processor():
    models = [line.split(":", 1)[1].strip() for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines()
              if line.startswith("model name")]
    return f"{models[0] if models else 'unknown'} ({os.cpu_count()} processors)"


def write(cases, header, page):
    """Writes the page, and says under which names."""
    page.parent.mkdir(parents=True, exist_ok=True)
    if page.suffix == ".html":
        page.write_text(to_html(cases, header))
    page.with_suffix(".md").write_text(to_markdown(cases, header))
    return ", ".join(sorted({str(page), str(page.with_suffix(".md"))}))


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("-o", dest="page", type=pathlib.Path, required=True, metavar="PAGE")
    parser.add_argument("--date", default="", help="stands on the page; none is made up")
    parser.add_argument("how", choices=["run", "read"])
    parser.add_argument("files", nargs="+", metavar="FILE", help="programs to run, or reports to read")
    given = parser.parse_args(arguments)
    if given.page.suffix not in (".html", ".md"):
        parser.error(f"-o is '{given.page}'; its name must end with .html (the Markdown form is put beside it) or .md")
    tests = []
    for file in given.files:
        if not pathlib.Path(file).is_file():
            print(f"{file}: there is no such file: what it tests wasn't run", file=sys.stderr)
        elif given.how == "run":
            print(f"{pathlib.Path(file).name} ...", file=sys.stderr, flush=True)
            tests += run(str(pathlib.Path(file).absolute()))
        else:
            tests += tests_of(json.loads(pathlib.Path(file).read_text()))
    cases, others = by_case(tests)
    header = [f"Touchstone {version()}", f"Processor: {processor()}"] + ([f"Date: {given.date}"] if given.date else [])
    names = write(cases, header, given.page)
    for number, case in enumerate(cases, 1):
        for text, fault in lines_of(case):
            if fault:
                print(f"case {number}: {text}", file=sys.stderr)
    for test in others:
        print(f"{test.id()}: its suite's name bears no case's number of 1 to {len(CASES)}", file=sys.stderr)
    print(f"{summary(cases)} {names}")
    return 0 if all(holds(case) for case in cases) and not others else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
