"""What is asked of a scene beyond an end in numbers and words. Each check reads the scene alone, so that it judges a
shrunk scene as well. It gives the disagreements that no warning of the program explains, as (check, words)."""

import copy
import random

from lab import DOUBT, KINK, STEP_DOUBT, SWEEP_DOUBT
from rotations import inverse, random_turn
from tilt import invariant, names_in, tilted, turned_pose

SAME = 1e-7  # relative; what the program may differ by without a word
ADAPTIVE = {"verner6": 1e-9, "dopri5": 1e-9, "gauss6": 1e-9, "radau5": 1e-8, "sdirk4": 1e-7,
            "cvodes_adams": 1e-10, "cvodes_bdf": 1e-9}
SMALL = 1e-3  # [m] below it one atol for lengths and for Euler parameters asks the impossible of methods of low order


ROUNDING = 1e-13  # of an objective's natural size: what sums of numbers of that size lose
STEPS = (1e-3, 1e-4, 1e-5, 1e-2, 1e-6, 1e-7, 1e-8)  # of differences, of a parameter's size
ERRORS = 1e-10  # of the same: what the integrator loses at the scene's own tolerances


def natural_size(lab, name):
    """Objectives of random scenes are made of terms of size 1; of kept scenes as well."""
    return lab.end_time if "running" in lab.problem["objectives"][name] else 1.0


def gradient_difference(a, b, sizes, value, noise):
    """The worst entry of two gradients, apart from noise. Entries below 1e-3 of the largest are compared relative to
    that level, as `check` does; where all are next to nothing, relative to the value."""
    contributions = {name: abs(a[name] * sizes[name]) for name in a}
    level = max(1e-3 * max(contributions.values(), default=0), 1e-3 * abs(value), 1e-300)
    worst, where = 0.0, ""
    for name in a:
        difference = max(0.0, abs(a[name] - b[name]) * sizes[name] - noise)
        relative = difference / max(contributions[name], level) if difference else 0.0
        if not relative <= worst:
            worst, where = relative, f"d/d {name}: {a[name]!r} and {b[name]!r}"
    return worst, where


def compare_gradients(lab, check, first, second, allowed=SAME, noise=ROUNDING, objectives=None,
                      doubt=SWEEP_DOUBT):
    """The gradients of two runs. By default both differentiate the same motion, so that no doubt about the motion
    explains a difference."""
    if not (first.ok and second.ok):
        return []
    found = []
    for name in lab.problem["objectives"] if objectives is None else objectives:
        worst, where = gradient_difference(first.gradient(name), second.gradient(name), lab.parameter_sizes(),
                                           first.value(name), noise * lab.distance * natural_size(lab, name))
        if worst > allowed and not lab.doubts(first, second, about=doubt):
            found.append((check, f"{name}, {where}: {worst:.1e} apart"))
    return found


def compare_by_steps(lab, check, first, second, allowed, noise, objectives=None, doubt=DOUBT):
    """Gradients by (method, file, settings) over different steps. No step is chosen for the quadrature of smooth
    extremes, so that a difference has to remain at a tenth and a hundredth of the largest step."""
    def found(settings):
        runs = [lab.run("gradient", settings | own, ("--method", method), file)
                for method, file, own in (first, second)]
        return compare_gradients(lab, check, *runs, allowed, noise, objectives, doubt)

    return found(lab.tight()) and found(finer(lab)) and found(finer(lab, 100))


def finer(lab, times=10):
    return lab.tight(max_step=lab.tight()["simulation.integrator"]["max_step"] / times)


# ---- the checks


def ends(lab):
    """The run of the scene as it is."""
    return []


def sweeps(lab):
    """TLM and adjoint, at the scene's own settings. `check` tells what is rounding."""
    if not lab.problem.get("parameters"):
        return []
    found = compare_gradients(lab, "tlm = adjoint", lab.run("gradient", arguments=("--method", "tlm")),
                              lab.run("gradient", arguments=("--method", "adjoint")))
    if not found:
        return []
    check = lab.run("check", patience=10)  # it makes dozens of runs
    if rounding_alone(check):
        lab.explained.append("check: TLM and adjoint agree within their rounding")
        return []
    return [] if lab.doubts(check, about=SWEEP_DOUBT) else found


def rounding_alone(check):
    """Whether `check` finds nothing but rounding between TLM and adjoint, whatever it finds of differences."""
    entries = check.result.get("verdict", {}).get("entries", {}) if check.result else {}
    verdicts = [entry["exact"] for row in entries.values() for entry in row.values()]
    return bool(verdicts) and not {"DISAGREES", "FAILED"} & set(verdicts)


def plane(lab):
    """The planar model and the spatial one, in motion, sensors and gradients."""
    base = watched(lab)
    if not base.ok or base.result["model"].get("type") != "planar":
        return []
    spatial = {"simulation.model": "spatial"}
    space = lab.run("simulate", lab.tight() | spatial, file="watched")
    if not space.ok and lab.doubts(space):
        return []
    if not space.ok:
        return [("planar = spatial", f"planar runs, spatial ends with: {space.message[-300:]}")]
    worst, where = lab.apart(base.trajectory(), space.trajectory())
    if worst > SAME and certain(lab, worst) and not lab.doubts(base, space):
        return [("planar = spatial", f"{where}: {worst:.1e} apart")]
    if not lab.problem.get("parameters"):
        return []
    return compare_by_steps(lab, "planar = spatial", ("adjoint", "scene", {}), ("adjoint", "scene", spatial), 1e-6,
                            ERRORS, doubt=STEP_DOUBT)


def watched(lab):
    """The scene with sensors of its energies, by an integrator whose errors do not count."""
    if "watched" not in lab.files:
        problem = copy.deepcopy(lab.problem)
        for component in ("kinetic", "potential"):
            problem.setdefault("sensors", {})[f"e_{component}"] = {"quantity": "energy", "component": component}
        lab.variant("watched", problem)
    return lab.run("simulate", lab.tight(), file="watched")


def certain(lab, difference):
    """Whether a difference from the tight run is more than a hundred times what that run changes at ten times its
    tolerance: some motions magnify rounding by 1e10 and more, and no two runs of them agree."""
    looser = lab.run("simulate", lab.tight(rtol=1e-10), file="watched")
    return looser.ok and difference > 100 * lab.apart(watched(lab).trajectory(), looser.trajectory())[0]


def integrators(lab):
    """Other methods, each within ten times what its own result changes at a tenth of its tolerance."""
    base = watched(lab)
    if not base.ok:
        return []
    found = []
    rng = random.Random(lab.problem["name"])
    able = sorted(ADAPTIVE) if lab.length > SMALL else ["dopri5", "verner6"]
    for method in rng.sample(able, 2):
        # CVODES projects nothing, which lets soft joints go their own way.
        own_way = {"simulation.formulation.projection": "none"} if method.startswith("cvodes") and has_penalty(lab) else {}
        run = lambda rtol: lab.run("simulate", lab.tight(type=method, rtol=rtol) | own_way, file="watched")
        ours = lab.run("simulate", lab.tight() | own_way, file="watched") if own_way else base
        if not ours.ok:
            continue
        reference, rtol = ours.trajectory(), ADAPTIVE[method]
        other = run(rtol)
        if not other.ok:
            continue
        worst, where = lab.apart(reference, other.trajectory())
        if worst <= 1e-6 or lab.doubts(ours, other):
            continue
        closer = run(rtol / 10)
        if not closer.ok or lab.doubts(closer):
            continue
        own = lab.apart(other.trajectory(), closer.trajectory())[0]
        nearer, where = lab.apart(reference, closer.trajectory())
        if nearer > max(10 * own, 1e-6, allowed_by_penalty(lab, ours)) and certain(lab, nearer):
            found.append(("integrators", f"dopri853 and {method}, {where}: {nearer:.1e} apart"))
    return found


def conserves_energy(problem):
    def nothing(force, *fields):
        return all(force.get(field, 0) in (0, [0, 0, 0]) for field in fields)

    return not problem.get("drives") and all(
        force["type"] in ("tsda", "rsda", "bushing") and "law" not in force
        and nothing(force, "damping", "torsional_damping", "actuator") for force in problem.get("forces", []))


def has_penalty(lab):
    return lab.problem["simulation"].get("formulation", {}).get("type") == "penalty"


def allowed_by_penalty(lab, run):
    """Soft joints move and work, by about what projections take out of the motion."""
    return max(SAME, 10 * run.result["simulation"]["max_acceleration_residual"]) if has_penalty(lab) else SAME


def energy(lab):
    if not conserves_energy(lab.problem):
        return []
    base = watched(lab)
    if not base.ok or base.result["model"]["degrees_of_freedom"] == 0:  # what cannot move has nothing to exchange
        return []
    run = base.trajectory()
    kinetic, potential = run["e_kinetic"], run["e_potential"]
    total = [k + p for k, p in zip(kinetic, potential)]
    size = max(kinetic) + max(potential) - min(potential)
    change = max(total) - min(total)
    still = 1e-24 * lab.mass * (lab.length / lab.end_time) ** 2  # of one that rounding alone moves
    if change > allowed_by_penalty(lab, base) * size + 1e-12 * max(map(abs, potential)) + still and not lab.doubts(base):
        return [("energy", f"changes by {change:.2e} J of {size:.2e} J although nothing does work")]
    return []


def differences(lab):
    """The gradient along two directions against central differences of runs with other parameters. `check` names
    kinks, such as the norm of a reaction that is zero."""
    found = differences_at(lab, lab.tight()) and differences_at(lab, finer(lab))
    return [] if found and lab.doubts(lab.run("check", patience=10), about=KINK) else found


def differences_at(lab, settings):
    parameters = lab.problem.get("parameters")
    if not parameters:
        return []
    base = lab.run("gradient", settings, ("--method", "adjoint"))
    if not base.ok:
        return []
    rng, sizes, found = random.Random(lab.problem["name"]), lab.parameter_sizes(), []
    single = rng.choice(sorted(parameters))
    for direction in ({name: sizes[name] * rng.uniform(-1, 1) for name in parameters}, {single: sizes[single]}):
        missed = set(lab.problem["objectives"])
        best = {}
        for h in STEPS:
            slopes = [central(lab, settings, direction, step) for step in (h, h / 2)]
            if None in slopes:
                continue
            for name in sorted(missed):
                coarse, fine = slopes[0][name], slopes[1][name]
                exact = sum(base.gradient(name)[k] * d for k, d in direction.items())
                level = sum(abs(base.gradient(name)[k] * d) for k, d in direction.items())
                slope = (4 * fine - coarse) / 3  # Richardson's
                error = abs(slope - exact)
                above = h * (error - 1e-6 * level - 0.1 * abs(fine - coarse))
                rounding = 1e-11 * (abs(base.value(name)) + natural_size(lab, name))
                words = f"{name} along {sorted(direction)}: {exact!r}, differences {slope!r}"
                best[name] = min(best.get(name, (float("inf"), "")), (error / max(level, 1e-300), words))
                if above <= rounding or above <= scattered(lab, settings, direction)[name]:  # six more runs
                    missed.discard(name)
            if not missed:
                break
        for name in missed & set(best):
            change = abs(sum(base.gradient(name)[k] * d for k, d in direction.items())) * min(STEPS)
            if change < natural_size(lab, name) and not lab.doubts(base):  # or no step is small enough
                found.append(("differences", f"{best[name][1]}: {best[name][0]:.1e} apart"))
    return found


def central(lab, settings, direction, h):
    values = [values_at(lab, settings, direction, sign * h) for sign in (1, -1)]
    if None in values:
        return None
    return {name: (values[0][name] - values[1][name]) / (2 * h) for name in values[0]}


def values_at(lab, settings, direction, h):
    changed = dict(settings)
    for name, d in direction.items():
        p = lab.problem["parameters"][name]
        changed[f"parameters.{name}.value" if isinstance(p, dict) else f"parameters.{name}"] = (
            (p["value"] if isinstance(p, dict) else p) + h * d)
    run = lab.run("simulate", changed)
    return {name: run.value(name) for name in lab.problem["objectives"]} if run.ok else None


def scattered(lab, settings, direction):
    """How much rounding changes the objectives from run to run: the largest third difference over parameters that
    differ by 1e-8. Smaller changes are below the rounding of coordinates far from the origin."""
    values = [values_at(lab, settings, direction, k * 1e-8) for k in range(-2, 4)]
    runs = [four for four in zip(values, values[1:], values[2:], values[3:]) if all(four)]
    return {name: max((abs(a[name] - 3 * b[name] + 3 * c[name] - d[name]) for a, b, c, d in runs), default=0.0)
            for name in lab.problem["objectives"]}


def tilt(lab):
    """The scene turned as a whole: the same motion in other axes, for a planar one by the equations of space."""
    turn = random_turn(random.Random(lab.problem["name"]))
    problem = tilted(lab.problem, turn)
    base = watched(lab)
    if problem is None or not base.ok:
        return []
    lab.variant("tilted", problem)
    other = lab.run("simulate", lab.tight(), file="tilted")
    if not other.ok and lab.doubts(other):
        return []
    if not other.ok:
        return [("tilt", f"runs as it is; turned as a whole it ends with: {other.message[-300:]}")]
    reference = base.trajectory()
    worst, where = lab.apart(reference, turned_back(other.trajectory(), lab, turn, reference))
    if worst > 1e-6 and certain(lab, worst) and not lab.doubts(base, other):
        return [("tilt", f"{where}: {worst:.1e} apart")]
    if not lab.problem.get("parameters"):
        return []
    sensors = lab.problem.get("sensors", {})
    same = [name for name, objective in lab.problem["objectives"].items()
            if all(invariant(sensors[s]) for s in names_in(objective) & set(sensors))]
    return compare_by_steps(lab, "tilt", ("adjoint", "scene", {}), ("adjoint", "tilted", {}), 1e-5, ERRORS, same)


def rounded(lab):
    """Redundant loops that are turned in space and written with a few digits, as CAD does, against all digits.

    Neither a drive nor a condition acts where the loop alone decides: rounded numbers change what it decides.
    """
    base = watched(lab)
    redundant = {words.split(" ")[0] for words in base.result["model"]["redundant"]} if base.ok else set()
    if not redundant or redundant & {drive["name"] for drive in lab.problem["drives"]}:
        return []
    rng = random.Random(lab.problem["name"])
    problem, digits = tilted(lab.problem, random_turn(rng)), rng.randint(6, 10)
    if problem is None:
        return []
    problem["initial"] = {k: v for k, v in problem.get("initial", {}).items() if k != "conditions"}
    lab.variant("tilted", problem)
    lab.variant("rounded", problem | {"joints": rounded_numbers(problem["joints"], digits)})
    runs = [lab.run("simulate", lab.tight(), file=file) for file in ("tilted", "rounded")]
    if not runs[0].ok:
        return []
    if not runs[1].ok:
        return [] if lab.doubts(runs[1]) else [("rounded", f"{digits} digits end with: {runs[1].message[-300:]}")]
    worst, where = lab.apart(*(run.trajectory() for run in runs))
    if worst > 1e3 * 10**-digits * lab.distance and certain(lab, worst) and not lab.doubts(*runs):
        return [("rounded", f"{digits} digits and all of them, {where}: {worst:.1e} apart")]
    return []


def rounded_numbers(node, digits):
    if isinstance(node, dict):
        return {key: rounded_numbers(value, digits) for key, value in node.items()}
    if isinstance(node, list):
        return [rounded_numbers(value, digits) for value in node]
    return float(f"{node:.{digits}g}") if isinstance(node, float) else node


def turned_back(run, lab, turn, reference):
    back, result = inverse(turn), {"t": run["t"]}
    for body in (b["name"] for b in lab.problem["bodies"]):
        names = [f"{body}.{c}" for c in ("x", "y", "z", "e0", "e1", "e2", "e3", "vx", "vy", "vz", "wx", "wy", "wz")]
        rows = []
        for k in range(len(run["t"])):
            row = [run[name][k] for name in names]
            position, p = turned_pose(back, row[:3], row[3:7])
            velocity, _ = turned_pose(back, row[7:10], p)
            omega, _ = turned_pose(back, row[10:], p)
            rows.append(position + p + velocity + omega)
        if sum(rows[0][3 + k] * reference[f"{body}.e{k}"][0] for k in range(4)) < 0:
            rows = [row[:3] + [-x for x in row[3:7]] + row[7:] for row in rows]
        result |= {name: [row[k] for row in rows] for k, name in enumerate(names)}
    return result


def order(lab):
    """The same bodies and joints, listed the other way round."""
    base = watched(lab)
    if not base.ok:
        return []
    problem = copy.deepcopy(lab.problem)
    for section in ("bodies", "joints", "forces"):
        problem[section] = problem.get(section, [])[::-1]
    lab.variant("reversed", problem)
    other = lab.run("simulate", lab.tight(), file="reversed")
    if not other.ok:
        return [("order", f"runs as listed; in reverse it ends with: {other.message[-300:]}")]
    worst, where = lab.apart(base.trajectory(), other.trajectory())
    if worst > 1e-6 and certain(lab, worst) and not lab.doubts(base, other):
        return [("order", f"{where}: {worst:.1e} apart")]
    return []


def kinematics(lab):
    """Where drives leave nothing free, positions need no integration."""
    base = watched(lab)
    if not base.ok or base.result["model"]["degrees_of_freedom"] != 0:
        return []
    solved = lab.run("kinematics")
    if not solved.ok and "which kinematics cannot hold" in solved.message:
        return []
    if not solved.ok:
        return [("kinematics = simulate", f"simulate runs, kinematics ends with: {solved.message[-300:]}")]
    worst, where = lab.apart(base.trajectory(), solved.trajectory())
    if worst > (1e-4 if has_penalty(lab) else SAME) and not lab.doubts(base, solved):  # warned of from 1e-4 on
        return [("kinematics = simulate", f"{where}: {worst:.1e} apart")]
    return []


def equilibrium(lab):
    """A start in equilibrium stays there, where nothing depends on time."""
    if not lab.problem.get("initial", {}).get("equilibrium") or depends_on_time(lab.problem):
        return []
    base = watched(lab)
    if not base.ok:
        return []
    run = base.trajectory()
    start = {name: [column[0]] * len(column) for name, column in run.items()}
    worst, where = lab.apart(start, run)
    if worst > 1e-6 and not lab.doubts(base):
        return [("equilibrium", f"does not stay: {where}: {worst:.1e} apart")]
    return []


def depends_on_time(problem):
    laws = [problem.get("drives", []), [force.get("law", "") for force in problem.get("forces", [])],
            [force.get("components", []) for force in problem.get("forces", [])]]
    of_time = {"t", *problem.get("signals", {})}
    return bool(of_time & names_in(laws)) or any(isinstance(drive["law"], dict) for drive in problem.get("drives", []))


def brief(lab):
    """Blows on bodies and fast steps of drives, that the steps of the scene as it is might pass over, against a run by
    steps of a 20 000th of the time. A driven scene is integrated for this, with its true extremes left out."""
    text = str(lab.problem.get("forces", [])) + str(lab.problem.get("drives", []))
    if not any(mark in text for mark in ("abs(t", "exp(-((t", "tanh((t", "max(0, (t", "blow")):
        return []
    def run(parts):
        return lab.run("simulate", finer(lab, parts) | {"simulation.solve": "dynamics"}, patience=5)

    def apart(one, other):
        worst, where = lab.apart(one.trajectory(), other.trajectory())
        for name, objective in lab.problem["objectives"].items():
            if {"maximum_of", "minimum_of"} & set(objective):
                continue
            by = abs(one.value(name) - other.value(name)) / (abs(one.value(name)) + natural_size(lab, name))
            if not by <= max(worst, 1e-4):
                worst, where = by, f"{name} {one.value(name)!r} and {other.value(name)!r}"
        return worst, where

    base, fine = lab.run("simulate"), run(500)
    if not base.ok or not fine.ok:
        return []
    worst, where = apart(fine, base)
    if not worst > 1e-4 or not certain(lab, worst) or lab.doubts(base, fine):
        return []
    for parts in (250, 125):  # an integrand may turn many times within a pulse of a force
        coarser = run(parts)
        if not coarser.ok or apart(fine, coarser)[0] > 0.1 * worst:
            return []
    return [("brief", f"steps of a 20 000th and the scene's own, {where}: {worst:.1e} apart")]


def loose_bounds(lab):
    """A design within bounds far beyond its start is no worse than this start."""
    if not lab.problem.get("parameters"):
        return []
    problem = copy.deepcopy(lab.problem)
    rng = random.Random(lab.problem["name"])
    name, reach = rng.choice(sorted(problem["parameters"])), 10 ** rng.uniform(3, 10)
    value, size = problem["parameters"][name]["value"], lab.parameter_sizes()[name]
    problem["parameters"][name] |= {"lower": value - size * reach, "upper": value + size * reach}
    problem["design"] = {"minimize": sorted(problem["objectives"])[0], "variables": [name],
                         "optimizer": {"type": rng.choice(["ipopt", "slsqp", "mma", "lbfgs"]), "max_iterations": 5,
                                       "max_evaluations": 15}}
    lab.variant("loose", problem)
    run = lab.run("design", file="loose", patience=3)
    optimizer = run.result.get("optimizer", {}) if run.ok else {}
    before, after = optimizer.get("objective_initial"), optimizer.get("objective_final")
    if before is None or after is None:
        return []
    if after <= before + 1e-9 * (abs(before) + natural_size(lab, problem["design"]["minimize"])):
        return []
    return [("loose bounds", f"{name} within {reach:.0e} times its size: {before!r} before, {after!r} after")]


def interrupted(lab):
    """A sweep, and the starts of a design, that a signal ends and `resume` goes on with are those that nothing ends."""
    parameters = lab.problem.get("parameters")
    if not parameters:
        return []
    name = sorted(parameters)[0]
    value, size = parameters[name]["value"], 0.01 * lab.parameter_sizes()[name]
    points = ("--threads", "1", "--vary", f"{name}={value - size!r}:{value + size!r}:8")
    design = {"minimize": sorted(lab.problem["objectives"])[0], "variables": [name],
              "optimizer": {"max_iterations": 2, "max_evaluations": 4}, "multistart": {"starts": 4, "seed": 3}}
    bounded = parameters | {name: {"value": value, "lower": value - size, "upper": value + size}}
    lab.variant("starts", lab.problem | {"design": design, "parameters": bounded})

    def rows(run):
        table = run.folder / "sweep.csv"
        return table.read_text().splitlines() if table.exists() else []

    def ends(run):
        starts = run.result.get("multistart", {}).get("waterfall", [])
        return [{key: start[key] for key in start if key != "wall_seconds"} for start in starts]
    return (broken_off(lab, "sweep", "scene", points, rows)
            + broken_off(lab, "design", "starts", ("--threads", "1"), ends))


def broken_off(lab, command, file, arguments, results):
    whole = lab.run(command, {}, arguments, file, patience=3)
    if not results(whole):
        return []
    instant = random.Random(command + lab.problem["name"]).uniform(0.1, 0.9) * whole.seconds
    cut = lab.run(command, {}, (*arguments, "--keep-journal"), file, interrupt=instant)
    if not (cut.folder / "journal.jsonl").exists():
        return []
    found = [results(whole), results(lab.resume(cut))]
    if found[0] != found[1]:
        differ = sum(a != b for a, b in zip(*found)) or "the number"
        return [("interrupted", f"{command}: {differ} of {len(found[0])} results differ after resume")]
    return []


def own_check(lab):
    if not lab.problem.get("parameters") or len(lab.problem["parameters"]) * len(lab.problem["bodies"]) > 12:
        return []
    run = lab.run("check")
    if run.code == 3 and not lab.doubts(run):
        wrong = [line.strip() for line in run.out.splitlines() if "DISAGREES" in line or "FAILED" in line]
        return [("check", "; ".join(wrong))]
    return []


def again(lab):
    """The same inputs give the same bytes."""
    first = lab.run("simulate")
    second = lab.run("simulate", {})  # the same, run anew
    if first.ok and (first.folder / "trajectory.csv").read_bytes() != (second.folder / "trajectory.csv").read_bytes():
        return [("again", "a second run writes another trajectory.csv")]
    return []


def other_commands(lab):
    """Commands that only have to end in numbers or words."""
    lab.run("validate")
    if lab.problem.get("parameters"):
        # CVODES chooses its steps by rtol alone. A start that a parameter moves by 1e8 of itself magnifies errors.
        forward = [("cvodes_forward", "scene", {"simulation.integrator.rtol": rtol}) for rtol in (1e-11, 1e-13)]
        found = compare_by_steps(lab, "cvodes_forward = adjoint", forward[0], ("adjoint", "scene", {}), 1e-4, 1e-8)
        found = found and compare_by_steps(lab, "cvodes_forward = adjoint", forward[1], ("adjoint", "scene", {}),
                                           1e-4, 1e-8)
        lab.run("gradient", {"simulation.integrator": {"type": "dopri5"}}, ("--method", "adjoint", "--hessian"))
        name = sorted(lab.problem["parameters"])[0]
        design = {"minimize": sorted(lab.problem["objectives"])[0], "variables": [name],
                  "optimizer": {"max_iterations": 3, "max_evaluations": 6}}
        lab.run("design", {"design": design})
        return found
    return []
