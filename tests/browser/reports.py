#!/usr/bin/env python3
"""Reports in headless Chromium: each opens without errors, is live, and loses nothing in print.

    tests/browser/reports.py PROGRAM [--keep FOLDER]

A probe is added to a copy of each report. It runs in the page, works its controls and leaves what it found in the
document, which Chromium prints. With --keep the reports and screenshots (420 and 1300 px wide, light and dark) stay
in the folder. Exit code 77, a skipped test for CTest, where Chromium is not installed.
"""
import argparse
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

PROBLEMS = pathlib.Path(__file__).resolve().parents[2] / "problems"
# Command with options, problem file, whether a mechanism moves in the report.
RUNS = [("simulate", "quarter_car/ride.json", True), ("kinematics", "four_bar/kinematics.json", True),
        ("linearise", "quarter_car/ride.json", False), ("gradient", "five_bar/sensitivities.json", False),
        ("check", "quarter_car/ride.json", False), ("design", "five_bar/design.json", True),
        ("identify", "pendulum/identify.json", True), ("identify", "double_pendulum/identify_windows.json", True),
        ("simulate", "andrews/simulate.json", True), ("tradeoff --budget 2", "five_bar/design.json", False),
        ("sweep --vary k1=10:30:6 --vary c1=0:2:5", "five_bar/design.json", False)]
LARGE = ("simulate", "quarter_car/ride.json", "--set", "simulation.output_step=0.00003")  # 100001 rows
WIDTHS = (420, 1300)

# Runs in the page after its own script. The widths of tables in print are measured with the rules for print in force.
PROBE = r"""
const found = {errors: window.probe_errors, plots: 0, cells_outside: 0, overflow: 0, small: 0};
const wait = ms => new Promise(done => setTimeout(done, ms));
// The parts of a mechanism in sight.
const drawn = viewer => [...viewer.querySelectorAll("path:not([visibility=hidden])")].map(
  e => e.getAttribute("d") + e.getAttribute("transform"));
(async () => {
  await wait(200);
  const chosen = [...document.querySelectorAll("[data-keys]")];
  found.choices = document.querySelectorAll("[data-choices]").length;
  found.shown = chosen.filter(e => !e.hidden).length;
  const hidden = chosen.filter(e => e.hidden);
  for (const e of hidden) e.hidden = false;
  await wait(100);
  for (const plot of document.querySelectorAll("figure[data-plot]")) {
    const svg = plot.querySelector("svg"), box = svg.querySelector(".catch").getBoundingClientRect();
    const at = {clientX: box.x + box.width / 2, clientY: box.y + box.height / 2, bubbles: true, pointerId: 1};
    svg.querySelector(".catch").dispatchEvent(new PointerEvent("pointermove", at));
    if (/=/.test(plot.querySelector(".readout").textContent)) found.plots += 1;
  }
  for (const e of hidden) e.hidden = true;
  await wait(100);
  // Words of a drawing lie within it, and not on each other.
  found.outside = 0, found.overlaps = [];
  for (const svg of document.querySelectorAll("figure>svg, main>svg")) {
    const frame = svg.getBoundingClientRect(), words = [...svg.querySelectorAll("text")].filter(e => e.textContent);
    const boxes = words.map(e => e.getBoundingClientRect());
    if (!frame.width) continue;
    boxes.forEach((a, i) => {
      if (a.left < frame.left - 1 || a.right > frame.right + 1) found.outside += 1;
      boxes.slice(0, i).forEach((b, k) => {
        const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
        const high = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
        if (wide > 1 && high > 4) found.overlaps.push(words[k].textContent + " and " + words[i].textContent);
      });
    });
  }
  // A plot in sight is as wide as its place: it neither scrolls nor is cut.
  found.cut = [...document.querySelectorAll("figure")].filter(f => f.scrollWidth > f.clientWidth + 1).length;
  found.expected_plots = document.querySelectorAll("figure[data-plot]").length;
  const viewer = document.querySelector(".viewer>svg");
  if (viewer) {
    const before = drawn(viewer), slider = document.querySelector(".viewer input[type=range]");
    slider.value = 430;
    slider.dispatchEvent(new Event("input"));
    const after = drawn(viewer), box = viewer.getBoundingClientRect();
    const bodies = [...viewer.querySelectorAll(".body")].map(e => e.getBoundingClientRect());
    found.drawn = bodies.length && bodies.every(b => b.left > box.left && b.right < box.right) && !/NaN/.test(after);
    found.moved = before.join() != after.join();
    found.cursors = document.querySelectorAll(".cursor:not([visibility=hidden])").length;
  }
  found.compared = document.querySelectorAll("[data-comparison] tbody tr").length;
  // A page that is wider than its window scrolls sideways.
  found.overflow = document.documentElement.scrollWidth - document.documentElement.clientWidth;
  found.height = document.documentElement.scrollHeight;
  if (innerWidth < 700) {
    for (const e of document.querySelectorAll("p,td,th,a,h2,button,svg text")) {
      const box = e.ownerSVGElement ? Math.hypot(e.getScreenCTM().a, e.getScreenCTM().b) : 1;
      if (e.getClientRects().length && e.textContent.trim() && !e.closest("tspan") &&
          parseFloat(getComputedStyle(e).fontSize) * box < 11.9) found.small += 1;
    }
  }
  // Print: the page's rules for it, on the width of A4 with margins of 1 cm.
  let rules = "";
  for (const sheet of document.styleSheets)
    for (const rule of sheet.cssRules)
      if (rule.media && rule.media.mediaText == "print") for (const r of rule.cssRules) rules += r.cssText;
  const style = document.createElement("style");
  style.textContent = rules + " body { width: 718px !important }";
  document.head.append(style);
  for (const cell of document.querySelectorAll("td,th")) {
    const r = cell.getBoundingClientRect();
    if (r.right > 719 || r.left < -1 || cell.scrollWidth > cell.clientWidth + 1) found.cells_outside += 1;
  }
  style.remove();
  const out = document.createElement("pre");
  out.id = "probe", out.textContent = JSON.stringify(found);
  document.body.append(out);
})();
"""
CATCH = "window.probe_errors = []; window.onerror = (m, s, l) => { window.probe_errors.push(m + ' at ' + l); };"


def chromium(program, url, *options, budget=5000):
    with tempfile.TemporaryDirectory(prefix="mbsopt_browser_") as user:
        return subprocess.run(
            [program, "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
             "--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars",
             f"--user-data-dir={user}", "--enable-logging=stderr",
             *([f"--virtual-time-budget={budget}"] if budget else []), *options, url],
            capture_output=True, text=True, timeout=120)


def framed(report, width, height, folder):
    """A page that shows the report in a frame: a window of Chromium is at least 500 px wide."""
    page = folder / f"frame_{width}.html"
    page.write_text(f'<body style="margin:0"><iframe src="{report.resolve().as_uri()}" '
                    f'style="border:0;width:{width}px;height:{height}px"></iframe>')
    return page.resolve().as_uri()


def probed(program, report, width, folder):
    """What the probe found, and errors on the console."""
    copy = folder / f"probe_{width}.html"
    text = report.read_text()
    # The last </body>, and the first <head>: the page's own script comes between.
    at = text.rindex("</body>")
    text = text[:at] + f"<script>{PROBE}</script>" + text[at:]
    copy.write_text(text.replace("<head>", f"<head><script>{CATCH}</script>", 1))
    if width < 500:  # the frame hands on what it found
        frame = folder / f"probe_frame_{width}.html"
        frame.write_text('<body style="margin:0"><script>onmessage = e => document.body.append(e.data);</script>'
                         f'<iframe src="{copy.resolve().as_uri()}" style="border:0;width:{width}px;height:2000px"></iframe>')
        copy.write_text(copy.read_text().replace("document.body.append(out);",
                                                 "parent.postMessage('<pre id=probe>' + out.textContent + '</pre>', '*');"))
        copy = frame
    run = chromium(program, copy.resolve().as_uri(), "--dump-dom", f"--window-size={max(width, 500)},2000")
    match = re.search(r'(?:<|&lt;)pre id="?probe"?(?:>|&gt;)(.*?)(?:<|&lt;)/pre', run.stdout, re.S)
    console = [line for line in run.stderr.splitlines() if "CONSOLE" in line]
    return (json.loads(match[1].replace("&quot;", '"')) if match else None), console


def seconds_to_open(program, report, folder):
    """From the start of the navigation to the end of the page's script, in real time."""
    copy = folder / "timed.html"
    text = report.read_text()
    at = text.rindex("</body>")
    copy.write_text(text[:at] + "<script>document.documentElement.dataset.opened = performance.now();</script>" + text[at:])
    run = chromium(program, copy.resolve().as_uri(), "--dump-dom", budget=None)
    match = re.search(r'data-opened="([0-9.]+)"', run.stdout)
    return float(match[1]) / 1000 if match else float("inf")


def problems_of(found, console, moves, width):
    if found is None:
        return ["the probe did not run"] + console
    wrong = [f"console: {line}" for line in console] + [f"error: {e}" for e in found["errors"]]
    if found["plots"] != found["expected_plots"]:
        wrong.append(f"{found['plots']} of {found['expected_plots']} plots show values")
    if moves and not found.get("drawn"):
        wrong.append("the mechanism is not drawn")
    if moves and not found.get("moved"):
        wrong.append("the slider does not move the mechanism")
    if found["shown"] != found["choices"]:
        wrong.append(f"{found['choices']} selectors show {found['shown']} parts")
    if found["outside"]:
        wrong.append(f"{found['outside']} words are outside their drawing")
    wrong += [f"words lie on each other: {pair}" for pair in found["overlaps"]]
    if found["cut"]:
        wrong.append(f"{found['cut']} plots are wider than their place")
    if found["cells_outside"]:
        wrong.append(f"{found['cells_outside']} cells are cut in print")
    if found["overflow"] > 0:
        wrong.append(f"the page is {found['overflow']} px wider than its window")
    if found["small"]:
        wrong.append(f"{found['small']} texts are below 12 px")
    return [f"{width} px: {w}" for w in wrong]


def index_opens(browser, runs):
    wrong = []
    for width in WIDTHS:
        found, console = probed(browser, runs / "index.html", width, runs)
        wrong += problems_of(found, console, False, width)
        if found and found["compared"] < 3:
            wrong.append(f"{width} px: two runs are not compared")
    print("index: " + ("ok" if not wrong else "; ".join(wrong)))
    return not wrong


def large_report_opens(program, browser, folder):
    subprocess.run([program, *LARGE[:1], str(PROBLEMS / LARGE[1]), *LARGE[2:], "--out", str(folder)], capture_output=True,
                   timeout=600, check=True)
    size = (folder / "report.html").stat().st_size / 1e6
    seconds = seconds_to_open(browser, folder / "report.html", folder)
    print(f"a report of 100001 rows: {size:.2f} MB, open after {seconds:.2f} s")
    return size < 3 and seconds < 2


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("--only", help="one command")
    arguments = parser.parse_args()
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if not browser:
        print("skipped: Chromium is not installed (Debian package chromium)")
        return 77
    failed = False
    with tempfile.TemporaryDirectory(prefix="mbsopt_reports_") as temporary:
        base = (arguments.keep or pathlib.Path(temporary)) / "out"
        for command, problem, moves in RUNS:
            command, *options = command.split()
            if arguments.only and command != arguments.only:
                continue
            folder = base / f"{command}_{pathlib.Path(problem).stem}"
            run = subprocess.run([arguments.program, command, str(PROBLEMS / problem), *options, "--out", str(folder)],
                                 capture_output=True, text=True, timeout=600)
            report = folder / "report.html"
            if not report.is_file():
                print(f"{folder.name}: no report; {run.stderr.strip()}")
                failed = True
                continue
            wrong = []
            for width in WIDTHS:
                found, console = probed(browser, report, width, folder)
                wrong += problems_of(found, console, moves, width)
                if not arguments.keep:
                    continue
                height = found["height"] + 20 if found else 2600
                for scheme, value in (("light", 1), ("dark", 0)):
                    chromium(browser, framed(report, width, height, folder), f"--window-size={max(width, 500)},{height}",
                             f"--blink-settings=preferredColorScheme={value}",
                             f"--screenshot={folder / f'{scheme}_{width}.png'}")
            size = report.stat().st_size / 1024
            if size > 400:
                wrong.append(f"the report has {size:.0f} KB, more than 400")
            print(f"{folder.name}: {size:.0f} KB, " + ("ok" if not wrong else "; ".join(wrong)))
            failed = failed or bool(wrong)
        if not arguments.only:
            failed = not index_opens(browser, base) or failed
            failed = not large_report_opens(arguments.program, browser, base / "large") or failed
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
