#!/usr/bin/env python3
"""Keeps the measured figures of `mbsopt tradeoff` in data/tradeoffs/ and writes them into docs/tradeoffs.md.

    docs/tradeoffs.py keep RUNS     from the output folders RUNS/{gallery,sweep,alpha}/NAME to data/tradeoffs/; what is not there stays
    docs/tradeoffs.py rises OUT     of one output folder: whether curves are monotone, where an error rises along one, and why
    docs/tradeoffs.py write         from data/tradeoffs/ to docs/tradeoffs.md (between its two markers) and docs/tradeoffs/*.svg

./dev tradeoffs does both after measuring. Needs nothing but Python 3.
"""

import csv
import json
import math
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DATA, PAGE, PLOTS = ROOT / "data/tradeoffs", ROOT / "docs/tradeoffs.md", ROOT / "docs/tradeoffs"
BEGIN, END = "<!-- measured: begin -->", "<!-- measured: end -->"
KEPT = ("curve", "method", "integrator", "rtol", "step", "status", "wall_seconds", "repetitions", "steps",
        "rhs_evaluations", "factorisations")
EXACT = ("curve", "rtol", "step", "steps", "rhs_evaluations", "factorisations")  # of these: as they are
WANTED = {"objective": 1e-5, "gradient": 1e-4}  # of the gallery at default settings
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b8860b", "#56b4e9", "#7a5195", "#666666")


def rows_of(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def write_rows(path, rows):
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def number(text):
    return float(text) if text not in ("", None) else math.nan


def short(text):
    """Three digits are enough for what varies from run to run."""
    try:
        return f"{float(text):.3g}"
    except ValueError:
        return text


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
    for kind in ("sweep", "alpha"):
        for folder in sorted((runs / kind).glob("*")):
            result = json.loads((folder / "result.json").read_text())
            name = folder.name
            rows = rows_of(folder / "tradeoff.csv")
            if kind == "sweep":
                names = [c for c in rows[0] if c in KEPT or c.startswith(("error ", "deviation "))]
                rows = [{c: r[c] if c in EXACT else short(r[c]) for c in names} for r in rows]
            else:
                names = [c for c in rows[0] if not c.endswith("message")]
                rows = [{c: short(r[c]) for c in names} for r in rows]
            write_rows(DATA / f"{kind}_{name}.csv", rows)
            reference = result["reference"]
            about.append({
                "file": f"{kind}_{name}.csv", "problem": name.replace("__", "/"), "kind": kind,
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
    write_rows(DATA / "runs.csv", sorted(kept + about, key=lambda a: (a["kind"] != "sweep", a["file"])))


# ---- plots


def log_plot(path, title, x_label, y_label, series, beside={}, front=()):
    """Lines on two logarithmic axes; series: name -> [(x, y)]; beside: name -> points off that line; front: points to mark."""
    width, height, left, right, top, bottom = 800, 400, 70, 230, 34, 48
    points = [p for line in (*series.values(), *beside.values()) for p in line]
    if not points:
        return False

    def ends(values):
        return math.floor(math.log10(min(values)) - 0.05), math.ceil(math.log10(max(values)) + 0.05)

    (x0, x1), (y0, y1) = ends([p[0] for p in points]), ends([p[1] for p in points])
    px = lambda x: left + (math.log10(x) - x0) / (x1 - x0) * (width - left - right)
    py = lambda y: top + (y1 - math.log10(y)) / (y1 - y0) * (height - top - bottom)
    svg = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="system-ui,sans-serif" '
           f'font-size="12"><rect width="{width}" height="{height}" fill="#fff"/>',
           f'<text x="{left}" y="20" font-size="14" font-weight="600" fill="#1b1f24">{title}</text>']
    power = lambda k: f'10<tspan dy="-4" font-size="9">{k}</tspan>'
    for k in range(x0, x1 + 1):
        x = px(10.0**k)
        svg.append(f'<path d="M{x:.1f} {top}V{height - bottom}" stroke="#dfe3e8"/>'
                   f'<text x="{x:.1f}" y="{height - bottom + 18}" text-anchor="middle" fill="#5d6670">{power(k)}</text>')
    stride = max(1, math.ceil((y1 - y0) / 8))
    for k in range(math.ceil(y0 / stride) * stride, y1 + 1, stride):
        y = py(10.0**k)
        svg.append(f'<path d="M{left} {y:.1f}H{width - right}" stroke="#dfe3e8"/>'
                   f'<text x="{left - 8}" y="{y + 4:.1f}" text-anchor="end" fill="#5d6670">{power(k)}</text>')
    svg.append(f'<rect x="{left}" y="{top}" width="{width - left - right}" height="{height - top - bottom}" fill="none" stroke="#5d6670"/>')
    svg.append(f'<text x="{(left + width - right) / 2}" y="{height - 10}" text-anchor="middle" fill="#5d6670">{x_label}</text>')
    svg.append(f'<text transform="translate(16 {(top + height - bottom) / 2}) rotate(-90)" text-anchor="middle" fill="#5d6670">{y_label}</text>')
    for x, y in front:
        svg.append(f'<circle cx="{px(x):.1f}" cy="{py(y):.1f}" r="5.5" fill="none" stroke="#1b1f24"/>')
    for i, (name, line) in enumerate(series.items()):
        colour, dash = COLOURS[i % 8], ' stroke-dasharray="6 4"' if i >= 8 else ""
        path_text = "L".join(f"{px(x):.1f} {py(y):.1f}" for x, y in line)
        svg.append(f'<path d="M{path_text}" fill="none" stroke="{colour}" stroke-width="1.6"{dash}/>')
        svg += [f'<circle cx="{px(x):.1f}" cy="{py(y):.1f}" r="2.2" fill="{colour}"/>' for x, y in line]
        svg += [f'<circle cx="{px(x):.1f}" cy="{py(y):.1f}" r="1.8" fill="#fff" stroke="{colour}"/>' for x, y in beside.get(name, ())]
        y = top + 10 + 18 * i
        svg.append(f'<path d="M{width - right + 14} {y}h24" stroke="{colour}" stroke-width="1.6"{dash}/>'
                   f'<text x="{width - right + 44}" y="{y + 4}" fill="#1b1f24">{name}</text>')
    keys = [("error beside its line", 'r="1.8" fill="#fff" stroke="#5d6670"')] if any(beside.values()) else []
    keys += [("Pareto front", 'r="5.5" fill="none" stroke="#1b1f24"')] if front else []
    for i, (name, circle) in enumerate(keys, len(series)):
        y = top + 10 + 18 * i
        svg.append(f'<circle cx="{width - right + 26}" cy="{y}" {circle}/><text x="{width - right + 44}" y="{y + 4}" fill="#1b1f24">{name}</text>')
    path.write_text("\n".join(svg) + "\n</svg>\n")
    return True


# ---- curves: optim/tradeoff_curves says the same of a sweep


def stands_alone(row):
    return row["curve"] in ("as in the file", "defaults")


def has_error(row, quantity):
    return row["status"] == "ok" and math.isfinite(number(row["error " + quantity]))


def bounds_of(rows, quantity):
    """Per row the largest error of it and of all tighter settings of its curve; nan where it has none."""
    largest, bounds = {}, [math.nan] * len(rows)
    for i in reversed(range(len(rows))):
        if has_error(rows[i], quantity):
            curve = rows[i]["curve"]
            largest[curve] = bounds[i] = max(largest.get(curve, 0.0), number(rows[i]["error " + quantity]))
    return bounds


class Point:
    """A setting of a curve: what it costs (right-hand sides are no matter of the machine) and how wrong a quantity is."""

    def __init__(self, row, quantity, bound):
        self.row, self.setting = row, f"rtol {number(row['rtol']):.0e}" if row["rtol"] else f"step {number(row['step']):.3g} s"
        self.work, self.error, self.bound = int(row["rhs_evaluations"]), number(row["error " + quantity]), bound
        self.seconds = number(row["wall_seconds"])
        self.deviation = number(row.get("deviation " + quantity, ""))  # the error with its sign, where it has one


def curves_of(rows, quantity):
    """Curve -> points from loose to tight; penalty forms keep a model error and are left out."""
    curves = {}
    for r, bound in zip(rows, bounds_of(rows, quantity)):
        if has_error(r, quantity) and not stands_alone(r) and not r["curve"].startswith("penalty"):
            curves.setdefault(r["curve"], []).append(Point(r, quantity, bound))
    return curves


def better_than_zero(points, relative):
    """A relative error of 1 is that of the answer zero, or of the mechanism that stays where it is."""
    return [p for p in points if p.bound < 1 or not relative]


def split(points, cost=lambda p: p.work):
    """The points of a line, and pairs of those that a tighter one dominates, which costs no more, and that one."""
    line, dominated = [], []
    for p in reversed(points):
        if line and cost(p) >= cost(line[-1]):
            dominated.append((p, line[-1]))
        else:
            line.append(p)
    return line[::-1], dominated[::-1]


def work_precision(rows, quantity, relative):
    """Lines through bounds over time, the errors beside them, and the points that nothing measured beats in both."""
    lines, beside = {}, {}
    for curve, points in curves_of(rows, quantity).items():
        row = points[0].row
        if row["method"] == "simulate" and curve != row["integrator"]:
            continue  # a formulation
        kept = better_than_zero(points, relative)
        line = split(split(kept)[0], cost=lambda p: p.seconds)[0]  # which time is a matter of the machine, and of chance
        if line:
            lines[curve] = [(p.seconds, p.bound) for p in line if p.bound > 0]
            beside[curve] = [(p.seconds, p.error) for p in kept if p.error > 0 and (p not in line or p.error < p.bound)]
    drawn, front, least = {p for line in lines.values() for p in line}, [], math.inf
    measured = sorted((number(r["wall_seconds"]), b) for r, b in zip(rows, bounds_of(rows, quantity)) if not math.isnan(b))
    for seconds, bound in measured:
        if bound < least:
            least = bound
            front += [(seconds, bound)] if (seconds, bound) in drawn else []
    return lines, beside, front


NO_DIGIT = 0.1   # errors above it are not measured by any order of a method
SAME_WORK = 1.05  # right-hand sides that a decade of tolerance costs where it does not set the steps
STARVED = 2.5    # what a decade costs where rounding does: methods of order 2 and more need 10^(1/3)


def changes_sign(points, i):
    """Whether the deviation goes through zero into the point i or out of it: then its error is small by chance."""
    signs = [p.deviation > 0 for p in points[max(i - 1, 0):i + 2] if p.deviation == p.deviation]
    return len(set(signs)) > 1


def same_setting(points, row, but_curve=False):
    same = ("integrator", "rtol", "step") if but_curve else ("curve", "rtol", "step")
    return next((k for k, p in enumerate(points) if all(p.row[c] == row[c] for c in same)), None)


def why_it_rises(curves, curve, quantity, i):
    """What the figures say about a rise from the point i of a curve to the next; curves: quantity -> curve -> points."""
    points = curves[quantity][curve]
    here, after = points[i], points[i + 1]
    if after.error > NO_DIGIT:
        return "no digit is right yet"
    of_gradient = quantity.startswith("gradient of ")
    if of_gradient and curve.startswith(("tlm, ", "adjoint, ")):
        twin = curves[quantity].get(curve.replace("tlm", "adjoint") if curve.startswith("tlm") else curve.replace("adjoint", "tlm"), [])
        k = same_setting(twin, after.row, but_curve=True)
        if k is not None and abs(twin[k].deviation - after.deviation) > 0.3 * after.error:
            return f"rounding, magnified: TLM and adjoint, one derivative on the same steps, differ by {abs(twin[k].deviation - after.deviation):.1e}"
    if of_gradient and after.work > STARVED * here.work:
        return f"rounding: {after.work / here.work:.0f} times the right-hand sides, in steps that are shortened next to singular positions in vain"
    if changes_sign(points, i):
        return "the error passes through zero, the first is small by chance"
    for name in ("motion", "sensors"):
        other = curves.get(name, {}).get(curve, [])
        k = same_setting(other, here.row)
        if quantity in ("motion", "sensors") or k is None or k + 1 >= len(other) or other[k + 1].error > other[k].error:
            continue
        return f"the error of the {name} falls, {other[k].error:.1e} to {other[k + 1].error:.1e}: the first is small by chance"
    for name, others in curves.items():
        other = others.get(curve, [])
        k = same_setting(other, here.row)
        if name != quantity and not of_gradient and k is not None and changes_sign(other, k):
            return f"the error of {name} passes through zero there, and with it most of this one"
    if after.work < SAME_WORK * here.work:
        return "stability, not the tolerance, sets the steps: they are the same but for a few"
    if i > 0 and after.error < (points[i - 1].error * here.error) ** 0.5:
        return "the first is below the line through its neighbours, by chance"
    if after.error < 1.5 * here.error:
        return "the error stays as it is over this decade"
    return "a multistep method's error follows the tolerance loosely" if "cvodes" in here.row["integrator"] else "not explained by these figures"


def rises(curves, quantity, floor, relative):
    """Steps from a setting to the next, tighter one that begin with an error that can be told: how many; where it rises, and why."""
    steps, found = 0, []
    for curve, points in curves[quantity].items():
        for i, (here, after) in enumerate(zip(points, points[1:])):
            if here.error < floor or not better_than_zero([here], relative):
                continue
            steps += 1
            if after.error > max(here.error, floor):
                found.append((curve, quantity, here, after, why_it_rises(curves, curve, quantity, i)))
    return steps, found


def counted(part, whole):
    return f"all {whole}" if part == whole else f"{part} of {whole}"


def monotony(rows, apart, absolute):
    """In words: of the bounds, of the work, and every error that rises by name."""
    curves = {quantity: curves_of(rows, quantity) for quantity in apart}
    settings, points, close, steps, falls, grows, told, found = 0, 0, 0, 0, 0, 0, 0, []
    dominated = {}
    for quantity, certain in apart.items():
        relative = quantity not in absolute
        for curve, every in curves[quantity].items():
            kept = better_than_zero(every, relative)
            settings, points = settings + len(every), points + len(kept)
            close += sum(p.bound <= 3 * p.error for p in kept)
            for here, after in zip(kept, kept[1:]):
                steps, falls, grows = steps + 1, falls + (after.bound <= here.bound), grows + (after.work > here.work)
            for p, cheaper in split(kept)[1]:
                dominated.setdefault((curve, cheaper.setting, cheaper.work), {})[p.setting] = p.work
        more = rises(curves, quantity, max(3 * certain, 1e-13), relative)
        told, found = told + more[0], found + more[1]
    names = {curve for of in curves.values() for curve in of}
    lines = [f"{len(names)} curves of {len(apart)} quantities, {steps} steps from a setting to the next, tighter one: the bound falls or stays in {counted(falls, steps)},",
             f"right-hand sides grow in {counted(grows, steps)}. The bound is at most three times the error in {counted(close, points)} points."]
    if dominated:
        lines.append("Beside their lines, since a tighter setting needed no more right-hand sides: " + "; ".join(
            f"`{curve}` at {', '.join(of)} ({', '.join(map(str, of.values()))}; {work} at {setting})" for (curve, setting, work), of in dominated.items()) + ".")
    if settings > points:
        lines.append(f"Points on no line, since their bounds are 1 or more: {settings - points}.")
    lines.append(f"The error itself falls or stays in {counted(told - len(found), told)} steps that begin where it can be told" + ("." if not found else "; it rises"))
    if not found:
        return lines + [""]
    cells = [[f"`{curve}`", quantity, f"{here.setting} to {after.setting.split()[1]}", f"{here.error:.1e} to {after.error:.1e}",
              f"{here.work} to {after.work}", why] for curve, quantity, here, after, why in found]
    return lines + [""] + table(["curve", "of", "from", "error", "right-hand sides", "because"], cells)


# ---- the page


def table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "| " + " | ".join("---" for _ in header) + " |"]
    return lines + ["| " + " | ".join(row) + " |" for row in rows] + [""]


def with_verdict(text, wanted):
    if text == "":
        return "-"
    return text if float(text) <= wanted else f"**{text}**"


def gallery_section():
    rows = rows_of(DATA / "gallery.csv")
    lines = ["### The gallery at default settings", "",
             "What a file without `integrator` and `formulation` is run with: augmented Lagrangian, `dopri853`, rtol 1e-8, atol 1e-10, steps of at most",
             "1/150 of the run. The largest error of its objectives and of their gradients, relative unless said; of files that identify also that of",
             "the sum of squares and of its gradient, at the values from which they start. Wanted: 1e-5 and 1e-4; **bold** where it is missed. Apart: how",
             "much the two methods of the reference differ. Own: the settings of the file.", ""]
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
    lines += [f"{good['objective']} of {of['objective']} objectives and {good['gradient']} of {of['gradient']} gradients are as exact as wanted.", ""]
    return lines


def sweep_section(run):
    rows, problem = rows_of(DATA / run["file"]), run["problem"]
    stem = run["file"].removesuffix(".csv").removeprefix("sweep_")
    apart, advice = json.loads(run["apart"]), json.loads(run["advice"])
    absolute = json.loads(run.get("absolute") or "[]")
    lines = [f"### `{problem}`", "", f"    {run['command']}", "",
             f"Reference: {run['first']}, certified by {run['second']}; apart by " +
             ", ".join(f"{v:.0e} ({q})" for q, v in apart.items()) + ".", ""] + monotony(rows, apart, absolute)
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


def alpha_section(run):
    rows = rows_of(DATA / run["file"])
    stem = run["file"].removesuffix(".csv")
    objective = next(q for q in json.loads(run["apart"]) if q not in ("motion", "sensors"))
    lines = [f"### Penalty: `{run['problem']}`", "", f"    {run['command']}", "",
             "Relative errors of the accelerations at 100 states of the motion; then runs, quasi-definite and by Cholesky: error of",
             f"`{objective}`, right-hand sides, drift of the constraints [m].", ""]
    cells = []
    for r in rows:
        pair = lambda c: f"{r['quasidefinite ' + c] or '-'}, {r['cholesky ' + c] or '-'}"
        ok = lambda s: r[f"{s} status"] == "ok"
        rhs = ", ".join(r[f"{s} rhs_evaluations"] + ("" if ok(s) else " (gave up)") for s in ("quasidefinite", "cholesky"))
        cells.append([f"{float(r['alpha']):.0e}", r["acceleration model_error"], r["acceleration rounding"],
                      r["acceleration augmented_lagrangian"], pair("error " + objective), rhs, pair("drift")])
    lines += table(["alpha", "model", "rounding by Cholesky", "augmented Lagrangian", f"error of {objective}", "right-hand sides", "drift"], cells)
    names = {"acceleration model_error": "model", "acceleration rounding": "rounding", "acceleration augmented_lagrangian": "augmented"}
    series = {label: [(float(r["alpha"]), number(r[c])) for r in rows if number(r[c]) > 0] for c, label in names.items()}
    file = PLOTS / f"{stem}.svg"
    if log_plot(file, f"{run['problem']}: accelerations", "alpha", "relative error", {k: v for k, v in series.items() if v}):
        lines += [f"![errors of accelerations over alpha](tradeoffs/{file.name})", ""]
    return lines


def write():
    PLOTS.mkdir(parents=True, exist_ok=True)
    runs = rows_of(DATA / "runs.csv")
    lines = [f"Measured on: {', '.join(sorted({r['machine'] for r in runs}))}. Times are medians of up to five rounds.", ""]
    loads = [float(r["load"]) for r in runs]
    cores = min(int(r["machine"].rsplit(", ", 1)[1].split()[0]) for r in runs)
    if max(loads) > 0.7 * cores:
        lines += [f"**The machine was busy**: a load of {min(loads):.0f} to {max(loads):.0f} on {cores} cores, so that times are longer than they would be",
                  "alone and their order is uncertain where they are close; errors and counts do not depend on it.", ""]
    lines += gallery_section()
    for run in runs:
        lines += sweep_section(run) if run["kind"] == "sweep" else alpha_section(run)
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
