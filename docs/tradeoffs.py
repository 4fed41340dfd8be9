#!/usr/bin/env python3
"""Keeps the measured figures of `mbsopt tradeoff` in data/tradeoffs/ and writes them into docs/tradeoffs.md.

    docs/tradeoffs.py keep RUNS     from the output folders RUNS/{gallery,sweep}/NAME to data/tradeoffs/; others stay
    docs/tradeoffs.py rises OUT     of one output folder: whether curves are monotone, where an error rises along one, and why
    docs/tradeoffs.py write         from data/tradeoffs/ to docs/tradeoffs.md (between its two markers) and docs/tradeoffs/*.svg

./dev tradeoffs does both after measuring. Needs nothing but Python 3.
"""

import json
import sys
from pathlib import Path

from tradeoff_curves import monotony, paragraph, table, work_precision
from tradeoff_plots import log_plot
from tradeoff_rows import number, rows_of, short, write_rows

ROOT = Path(__file__).resolve().parent.parent
DATA, PAGE, PLOTS = ROOT / "data/tradeoffs", ROOT / "docs/tradeoffs.md", ROOT / "docs/tradeoffs"
BEGIN, END = "<!-- measured: begin -->", "<!-- measured: end -->"
KEPT = ("curve", "method", "integrator", "rtol", "step", "status", "wall_seconds", "repetitions", "steps",
        "rhs_evaluations", "factorisations")
EXACT = ("curve", "rtol", "step", "steps", "rhs_evaluations", "factorisations")  # of these: as they are
WANTED = {"objective": 1e-5, "gradient": 1e-4}  # of the gallery at default settings


# ---- keep


def is_objective(result, name):
    return name.removeprefix("objective ") in result.get("objectives", {})


def worst(errors, chosen):
    values = [error for name, error in errors.items() if chosen(name)]
    return f"{max(values):.2g}" if values else ""


def method_in_words(method, at="at rtol"):
    if "step" in method:
        return f"{method['integrator']} with steps of {method['step']:.3g} s"
    return f"{method['integrator']} {at} {method['rtol']:.0e}"


def gallery_row(name, result):
    row = {"problem": name, "status": result["status"], "reference": "", "apart_objective": "", "apart_gradient": "",
           "absolute": "", "defaults_objective": "", "defaults_gradient": "", "defaults_seconds": "", "own_setting": "",
           "own_objective": "", "own_gradient": "", "own_seconds": "", "message": result.get("message", "")}
    if "reference" not in result:
        return row
    reference = result["reference"]
    row["reference"] = " and ".join(method_in_words(reference[k], "at") for k in ("first", "second"))
    objective, gradient = (lambda q: is_objective(result, q)), (lambda q: q.startswith("gradient of "))
    apart = {q: v["apart"] for q, v in reference["quantities"].items()}
    row["apart_objective"], row["apart_gradient"] = worst(apart, objective), worst(apart, gradient)
    row["absolute"] = "; ".join(q for q, v in reference["quantities"].items() if not v["relative"] and q != "motion")
    for which in ("defaults", "own"):
        setting = result.get("settings", {}).get(which, {})
        row[f"{which}_objective"] = worst(setting.get("errors", {}), objective)
        row[f"{which}_gradient"] = worst(setting.get("gradient", {}).get("errors", {}), gradient)
        row[f"{which}_seconds"] = short(setting.get("wall_seconds", ""))
        for s in (setting, setting.get("gradient", {})):
            if s.get("status", "ok") != "ok":
                row["message"] = s["message"]
    row["own_setting"] = result.get("settings", {}).get("own", {}).get("setting", "").replace(" (as in the file)", "")
    return row


def fit_row(row, fit):
    """What identify minimises, as if it were an objective."""
    row = dict(row, problem=row["problem"] + ", sum of squares", reference="dopri853 at 1e-12 and gauss6 at 1e-11", absolute="",
               defaults_seconds="", own_seconds="", message=fit.get("message", ""))
    row["apart_objective"], row["apart_gradient"] = (f"{v:.2g}" for v in (fit["apart"], fit["gradient"]["apart"]))
    for which in ("defaults", "own"):
        setting = fit["settings"][which]
        row[f"{which}_objective"] = f"{setting['error']:.2g}" if "error" in setting else ""
        row[f"{which}_gradient"] = f"{setting['gradient_error']:.2g}" if "error" in setting else ""
        row["message"] = row["message"] or setting.get("message", "")
    return row


def absolute_in(reference):
    """The quantities whose errors are not relative."""
    return [q for q, v in reference["quantities"].items() if not v["relative"]]


def keep(runs):
    DATA.mkdir(parents=True, exist_ok=True)
    about, gallery = [], []
    for folder in sorted((runs / "gallery").glob("*")):
        result = json.loads((folder / "result.json").read_text())
        gallery.append(gallery_row(folder.name.replace("__", "/"), result))
        if "settings" in result.get("fit", {}):
            gallery.append(fit_row(gallery[-1], result["fit"]))
    if gallery:
        write_rows(DATA / "gallery.csv", gallery)
    for folder in sorted((runs / "sweep").glob("*")):
        result = json.loads((folder / "result.json").read_text())
        rows = rows_of(folder / "tradeoff.csv")
        names = [c for c in rows[0] if c in KEPT or c.startswith(("error ", "deviation "))]
        file = f"sweep_{folder.name}.csv"
        write_rows(DATA / file, [{c: r[c] if c in EXACT else short(r[c]) for c in names} for r in rows])
        reference = result["reference"]
        about.append({
            "file": file, "problem": folder.name.replace("__", "/"),
            "command": "mbsopt " + result["provenance"]["command_line"].removeprefix("mbsopt ").split(" --out")[0],
            "machine": f"{result['machine']['cpu']}, {result['machine']['cores']} cores",
            "load": f"{result['machine']['load'] or 0:.1f}",
            "first": method_in_words(reference["first"]),
            "second": method_in_words(reference["second"]),
            "apart": json.dumps({q: float(f"{v['apart']:.2g}") for q, v in reference["quantities"].items()}),
            "absolute": json.dumps(absolute_in(reference)),
            "advice": json.dumps([r["in_words"] for r in result.get("recommendations", [])]),
        })
    again = {a["file"] for a in about}
    kept = [r for r in rows_of(DATA / "runs.csv") if r["file"] not in again] if (DATA / "runs.csv").exists() else []
    kept = [dict({name: r.get(name, "[]") for name in about[0]}) for r in kept] if about else kept
    write_rows(DATA / "runs.csv", sorted(kept + about, key=lambda a: a["file"]))


# ---- the page


def with_verdict(text, wanted):
    if text == "":
        return "-"
    return text if float(text) <= wanted else f"**{text}**"


def gallery_section():
    rows = rows_of(DATA / "gallery.csv")
    lines = ["### The gallery at default settings", ""]
    lines += paragraph("A file without `integrator` and `formulation` runs with the augmented Lagrangian, `dopri853`, rtol 1e-8, atol 1e-10 and steps of "
                       "at most 1/150 of the run. The columns are the largest error of its objectives and of their gradients, relative unless stated. Files "
                       "that identify have a second row: the sum of squares and its gradient at the initial values. The aims are 1e-5 and 1e-4; "
                       "**bold** figures miss them. *Own setting* is that of the file. *Apart* is the difference between the two methods of the reference.") + [""]
    cells, missed = [], []
    for r in rows:
        absolute = " (absolute)" if r["absolute"] else ""
        cells.append([f"`{r['problem']}`", with_verdict(r["defaults_objective"], WANTED["objective"]) + absolute,
                      with_verdict(r["defaults_gradient"], WANTED["gradient"]), r["own_setting"] or "-",
                      r["own_objective"] or "-", r["own_gradient"] or "-",
                      f"{r['apart_objective'] or '-'}, {r['apart_gradient'] or '-'}"])
        if any(r["defaults_" + k] and float(r["defaults_" + k]) > w for k, w in WANTED.items()) or r["message"]:
            missed.append(r)
    lines += table(["problem", "objective", "gradient", "own setting", "objective", "gradient", "apart"], cells)
    known = [r for r in rows if r["defaults_objective"]]
    good = {k: sum(1 for r in known if r["defaults_" + k] and float(r["defaults_" + k]) <= w) for k, w in WANTED.items()}
    of = {k: sum(1 for r in known if r["defaults_" + k]) for k in WANTED}
    lines += [f"{good['objective']} of {of['objective']} objectives and {good['gradient']} of {of['gradient']} gradients meet their aims.", ""]
    return lines


def sweep_section(run):
    rows, problem = rows_of(DATA / run["file"]), run["problem"]
    stem = run["file"].removesuffix(".csv").removeprefix("sweep_")
    apart, advice = json.loads(run["apart"]), json.loads(run["advice"])
    absolute = json.loads(run.get("absolute") or "[]")
    lines = [f"### `{problem}`", "", f"    {run['command']}", ""]
    lines += paragraph(f"The reference is {run['first']}, certified by {run['second']}. The two differ by " +
                       ", ".join(f"{v:.0e} ({q})" for q, v in apart.items()) + ".") + [""]
    lines += monotony(rows, apart, absolute)
    objective = next((q for q in apart if q not in ("motion", "sensors") and not q.startswith("gradient of ")), "motion")
    gradient = "gradient of " + objective
    for quantity in (objective, gradient):
        found = [a for a in advice if f" in {quantity}: " in a]
        cells = []
        for words in found:
            aim, setting = words.split(": ", 1)
            cells.append([aim.split()[1], setting])
        if cells:
            lines += table([f"error of {quantity}", "fastest setting"], cells)
    for quantity, of_gradient in ((objective, False), (gradient, True)):
        relative = quantity not in absolute
        lines_of, beside, front = work_precision(rows, quantity, relative) if quantity in apart else ({}, {}, [])
        file = PLOTS / f"{stem}_{'gradient' if of_gradient else 'objective'}.svg"
        if log_plot(file, f"{problem}: {quantity}", "time [s]", "relative error" if relative else "absolute error", lines_of, beside, front):
            lines += [f"![error of {quantity} over time](tradeoffs/{file.name})", ""]
    return lines


def write():
    PLOTS.mkdir(parents=True, exist_ok=True)
    runs = rows_of(DATA / "runs.csv")
    lines = [f"Measured on: {', '.join(sorted({r['machine'] for r in runs}))}. Times are medians of up to five rounds.", ""]
    loads = [float(r["load"]) for r in runs]
    cores = min(int(r["machine"].rsplit(", ", 1)[1].split()[0]) for r in runs)
    if max(loads) > 0.7 * cores:
        lines += paragraph(f"**The machine was busy**: its load was {min(loads):.0f} to {max(loads):.0f} on {cores} cores. Times are longer than on an idle "
                           "machine, and the order of close ones is uncertain. Errors and counts do not depend on it.") + [""]
    lines += gallery_section()
    for run in runs:
        lines += sweep_section(run)
    page = PAGE.read_text()
    before, rest = page.split(BEGIN)
    after = rest.split(END)[1]
    PAGE.write_text(before + BEGIN + "\n\n" + "\n".join(lines).rstrip() + "\n\n" + END + after)


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1] == "keep":
        keep(Path(sys.argv[2]))
    elif len(sys.argv) == 3 and sys.argv[1] == "rises":
        result = json.loads((Path(sys.argv[2]) / "result.json").read_text())
        apart = {q: v["apart"] for q, v in result["reference"]["quantities"].items()}
        print("\n".join(monotony(rows_of(Path(sys.argv[2]) / "tradeoff.csv"), apart, absolute_in(result["reference"]))))
    elif sys.argv[1:] == ["write"]:
        write()
    else:
        sys.exit(__doc__)
