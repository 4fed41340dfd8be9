"""Work-precision curves of a sweep, as optim/tradeoff/tradeoff.hpp sees them: lines, whether they are monotone, where
an error rises along one, and why."""

import math
import textwrap

from tradeoff_rows import number

NO_DIGIT = 0.1   # errors above it are not measured by any order of a method
SAME_WORK = 1.05  # right-hand sides that a decade of tolerance costs where it does not set the steps
STARVED = 2.5    # what a decade costs where rounding does: methods of order 2 and more need 10^(1/3)


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
            return f"amplified rounding: TLM and adjoint, the same derivative on the same steps, differ by {abs(twin[k].deviation - after.deviation):.1e}"
    if of_gradient and after.work > STARVED * here.work:
        return f"rounding: {after.work / here.work:.0f} times the right-hand sides, in steps that are shortened without effect next to singular positions"
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
            return f"the error of {name} passes through zero there, and with it most of this error"
    if after.work < SAME_WORK * here.work:
        return "stability, not the tolerance, limits the steps: almost all are the same"
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


def paragraph(text):
    """Its lines, of at most 120 characters."""
    return textwrap.wrap(text, 120, break_long_words=False, break_on_hyphens=False)


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
    lines = paragraph(f"{len(names)} curves of {len(apart)} quantities have {steps} pairs of neighbouring settings. From the looser to the tighter one the "
                      f"bound falls or stays in {counted(falls, steps)} pairs, and right-hand sides grow in {counted(grows, steps)}. The bound is at most "
                      f"three times the error in {counted(close, points)} points.")
    if dominated:
        lines += [""] + paragraph("These settings are beside their lines, since a tighter one needs no more right-hand sides: " + "; ".join(
            f"`{curve}` at {', '.join(of)} ({', '.join(map(str, of.values()))}; {work} at {setting})" for (curve, setting, work), of in dominated.items()) + ".")
    if settings > points:
        lines += [""] + paragraph(f"Points on no line, since their bounds are 1 or more: {settings - points}.")
    lines += [""] + paragraph(f"The error itself falls or stays in {counted(told - len(found), told)} pairs whose first error is certain"
                              + ("." if not found else ". It rises here:"))
    if not found:
        return lines + [""]
    cells = [[f"`{curve}`", quantity, f"{here.setting} to {after.setting.split()[1]}", f"{here.error:.1e} to {after.error:.1e}",
              f"{here.work} to {after.work}", why] for curve, quantity, here, after, why in found]
    return lines + [""] + table(["curve", "of", "from", "error", "right-hand sides", "because"], cells)


def table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "| " + " | ".join("---" for _ in header) + " |"]
    return lines + ["| " + " | ".join(row) + " |" for row in rows] + [""]
