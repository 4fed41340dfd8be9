#!/usr/bin/env python3
"""Draws each problem of the gallery: docs/gallery.md and docs/gallery/*.svg, from reports of PROGRAM.

    docs/gallery.py PROGRAM

A picture is the drawing at start and end of a report, made by the program. A file that does not simulate within a
minute has none, and the page says so.
"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
PICTURES = ROOT / "docs/gallery"
# The colours of report.css on white.
STYLE = """<style>text{fill:#5d6670;font:12px sans-serif} .title{fill:#1b1f24;font-weight:600}
.grid{stroke:#dfe3e8} .frame{fill:none;stroke:#5d6670} .body{fill-opacity:.12;stroke-width:2.4} .earlier{opacity:.55}
.earlier .body{stroke-dasharray:6 4;fill-opacity:.05} .solid{fill-opacity:.3;stroke-width:1.6}
.mark{vector-effect:non-scaling-stroke} .spring,.ground{fill:none;stroke:#5d6670}
.joint{fill:#fff;stroke:#1b1f24} .joint.fixed{fill:#1b1f24} COLOURS</style><rect width="100%" height="100%" fill="#fff"/>"""
COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b8860b", "#56b4e9", "#7a5195", "#444444"]


def picture(program, file, folder):
    """The first drawing of a mechanism in the file's report, as a page of its own; None without one."""
    try:
        subprocess.run([program, "simulate", str(file), "--out", str(folder), "--quiet"], capture_output=True, timeout=60)
    except subprocess.TimeoutExpired:
        return None
    report = folder / "report.html"
    still = re.search(r'<div class="still">.*?(<svg.*?</svg>)', report.read_text(), re.S) if report.is_file() else None
    if not still:
        return None
    colours = " ".join(f".c{k}{{stroke:{c}}} .f{k}{{fill:{c}}}" for k, c in enumerate(COLOURS))
    svg = re.sub(r"<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', still[1], count=1)
    return re.sub(r">", ">" + STYLE.replace("COLOURS", colours), svg, count=1) + "\n"


def main():
    program = pathlib.Path(sys.argv[1]).resolve()
    shutil.rmtree(PICTURES, ignore_errors=True)
    PICTURES.mkdir()
    page = ["# Gallery", "",
            "Each problem of [problems/](../problems/README.md), drawn by the program at the start and the end of its",
            "motion. `docs/gallery.py build/release/mbsopt` makes this page.", ""]
    for file in sorted((ROOT / "problems").glob("*/*.json")):
        name = f"{file.parent.name}/{file.stem}"
        with tempfile.TemporaryDirectory() as folder:
            svg = picture(program, file, pathlib.Path(folder))
        page += [f"## [{name}](../problems/{name}.json)", ""]
        if svg is None:
            page += ["No picture: it has no motion, or takes more than a minute.", ""]
            continue
        target = PICTURES / f"{file.parent.name}_{file.stem}.svg"
        target.write_text(svg)
        page += [f"![{name}](gallery/{target.name})", ""]
    (ROOT / "docs/gallery.md").write_text("\n".join(page).rstrip() + "\n")


if __name__ == "__main__":
    main()
