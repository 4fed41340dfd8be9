#!/usr/bin/env python3
"""Keeps what the benchmarks measured in data/performance/ and writes docs/performance.md whole.

    docs/performance.py keep RUNS     from RUNS/*.json (Google Benchmark's --benchmark_out) to data/performance/*.csv
    docs/performance.py write         from data/performance/ to docs/performance.md

./dev bench does both after measuring. Needs nothing but Python 3.
"""

import csv
import json
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DATA, PAGE = ROOT / "data/performance", ROOT / "docs/performance.md"
# What Google Benchmark writes of every benchmark; the rest are counters.
OF_GOOGLE = {"name", "family_index", "per_family_instance_index", "run_name", "run_type", "repetitions",
             "repetition_index", "threads", "iterations", "real_time", "cpu_time", "time_unit", "label",
             "error_occurred", "error_message"}


def rows_of(name):
    path = DATA / f"{name}.csv"
    if not path.exists():
        return []
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def write_rows(name, rows):
    header = list(dict.fromkeys(key for row in rows for key in row))
    with open(DATA / f"{name}.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, header, lineterminator="\n", restval="")
        writer.writeheader()
        writer.writerows(rows)


# ---- keep


def kept(entry):
    row = {"name": re.sub(r"/iterations:\d+$", "", entry["name"])}
    if entry["name"].startswith("primitive/"):
        row["ns"] = f"{entry['cpu_time']:.3g}"
    row |= {key: f"{value:.6g}" for key, value in entry.items() if key not in OF_GOOGLE}
    row["label"] = entry.get("label", "") or entry.get("error_message", "")
    return row


def keep(runs):
    DATA.mkdir(parents=True, exist_ok=True)
    about = {row["file"]: row for row in rows_of("runs")}
    for path in sorted(runs.glob("*.json")):
        measured = json.loads(path.read_text())
        tables = {}
        for entry in measured["benchmarks"]:
            tables.setdefault(entry["name"].split("/")[0], []).append(kept(entry))
        machine = json.loads((runs / "machine.txt").read_text())
        for table, rows in tables.items():
            write_rows(table, rows)
            load = measured["context"].get("load_avg", [0])[0]
            about[table] = {"file": table, "program": path.stem, "command": command_of(path.stem, table),
                            "cpu": machine["cpu"], "cores": machine["cores"], "compiler": machine["compiler"],
                            "flags": machine["flags"], "load": f"{load:.1f}", "date": measured["context"]["date"][:10]}
    write_rows("runs", [about[table] for table in sorted(about)])


def command_of(program, table):
    peers = " --peers" if program == "mbsopt_peers" else ""
    return f"./dev bench{peers} --benchmark_filter='^{table}/'"


# ---- the page


def number(text):
    return float(text) if text not in ("", None) else None


def figure(value, digits=3):
    if value is None:
        return "-"
    if value != 0 and (abs(value) >= 1e5 or abs(value) < 1e-3):
        return f"{value:.1e}"
    if abs(value) >= 10 ** (digits - 1):
        return f"{value:.0f}"
    return f"{value:.{digits}g}"


def of(table, name, column):
    for row in rows_of(table):
        if row["name"] == name:
            return number(row.get(column))
    return None


def table_of(header, rows):
    lines = ["| " + " | ".join(header) + " |", "| " + " | ".join("---" for _ in header) + " |"]
    return lines + ["| " + " | ".join(row) + " |" for row in rows] + [""]


def command(table):
    return ["    " + next((r["command"] for r in rows_of("runs") if r["file"] == table), f"(not measured: {table})"), ""]


def models():
    found = {row["name"].split("/")[-1] for row in rows_of("right_hand_side") if row["name"].count("/") == 3}
    return [m for m in ("spatial", "planar") if m in found]


def largest(table, pattern, column):
    values = [number(r[column]) for r in rows_of(table) if re.search(pattern, r["name"]) and number(r.get(column)) is not None]
    return max(values) if values else None


def targets():
    """The rows of the aims: (what, aim as text, aim, measured, unit)."""
    sizes = r"^right_hand_side/(planar_chain|spatial_chain|four_bars)/(10|40|50|200|333|1000)/"
    mega = lambda table, name, column: of(table, name, column)
    rows = [("right-hand side per body, spatial, chains and N-four-bars of 10 to 1000: the slowest", "0.7 us", 0.7,
             largest("right_hand_side", sizes + "spatial", "us_per_body"), "us"),
            ("the same, planar", "0.25 us", 0.25, largest("right_hand_side", sizes + "planar", "us_per_body"), "us")]
    for kind in ("planar_chain", "spatial_chain", "four_bars"):
        for model in models():
            rows.append((f"per body at 10 000 bodies over that at 100, {kind}, {model}", "1.3", 1.3,
                         mega("right_hand_side_growth", f"right_hand_side_growth/{kind}/{model}", "ratio"), ""))
    best = models()[-1] if models() else "spatial"
    for windows, aim in ((10, 40), (40, 160)):
        ms = mega("time_to_error", f"time_to_error/four_bars/{windows}/{best}", "ms")
        rows.append((f"A02, N = {windows}, 10 s to 1e-5 m, default model ({best})", f"{aim} ms", aim, ms, "ms"))
        spatial = mega("time_to_error", f"time_to_error/four_bars/{windows}/spatial", "ms")
        rows.append((f"the same forced spatial, over the default", "4", 4, spatial / ms if ms and spatial and best != "spatial" else None, ""))
        name = f"peers_time_to_error/four_bars/{windows}"
        theirs, ours = of("peers_time_to_error", name, "mujoco_ms"), of("peers_time_to_error", name, "mbsopt_ms_for_mujoco")
        rows.append((f"A02, N = {windows}: MuJoCo's time over mbsopt's, at no larger error", "at least 10", -10,
                     theirs / ours if theirs and ours else None, ""))
    rows.append(("Bricard, 10 s to 1e-6 m", "30 ms", 30, mega("time_to_error", "time_to_error/bricard", "ms"), "ms"))
    for row in rows_of("gradient_scaling"):
        bodies, kind = row.get("bodies", ""), row["name"].split("/")[1].split("_")[0]
        if row["name"].split("/")[1].endswith("_dopri5") and bodies:
            rows.append((f"adjoint of 50 parameters over one simulation, {kind} of {bodies} bodies", "3.0", 3.0, number(row["adjoint_ratio"]), ""))
            rows.append((f"TLM per further parameter, {kind} of {bodies} bodies", "0.35", 0.35, number(row["tlm_per_parameter"]), ""))
    for row in rows_of("adjoint_memory"):
        if row["name"].startswith("adjoint_memory/four_bars"):
            budget = number(row["budget_mib"])
            rows.append((f"kept by an adjoint within {budget:g} MiB, N-four-bar of {row['bodies']} bodies", f"{budget:g} MiB", budget, number(row["kept_mib"]), "MiB"))
    rows.append(("FB-1 to its optimum", "50 ms", 50, mega("design", "design/five_bar", "ms"), "ms"))
    return rows


def targets_section():
    cells = []
    for what, aim_text, aim, measured, unit in targets():
        verdict = "-" if measured is None else ("met" if (measured >= -aim if aim < 0 else measured <= aim) else "**missed**")
        cells.append([what, aim_text, figure(measured) + (f" {unit}" if unit and measured is not None else ""), verdict])
    return table_of(["what", "aim", "measured", ""], cells)


def right_hand_side_section():
    lines = ["## Right-hand sides", "",
             "The columns are the time of one evaluation of the equations of motion [microseconds], and the same per body. *In a run*",
             "is the time per body and right-hand side of a run with the default method. It includes error norms and projections.",
             "N-four-bars have 2N + 1 bodies.", ""] + command("right_hand_side")
    cells = []
    for row in rows_of("right_hand_side"):
        _, kind, size, model = row["name"].split("/")
        cells.append([kind, size, row["bodies"], model, figure(number(row["us"])), figure(number(row["us_per_body"])),
                      figure(number(row["run_us_per_body"]))])
    lines += table_of(["mechanism", "size", "bodies", "model", "one", "per body", "per body in a run"], cells)
    cells = [[f"`{r['name'].split('/', 1)[1]}`", r["bodies"], figure(number(r["us"])), figure(number(r["us_per_body"]))]
             for r in rows_of("right_hand_side_of_problem")]
    if cells:
        lines += command("right_hand_side_of_problem") + table_of(["problem", "bodies", "one", "per body"], cells)
    return lines


def parts_section():
    lines = ["## Parts of a right-hand side", "",
             "The figures are nanoseconds per body. Each part is measured alone, so their sum differs from the whole. The *linear",
             "share* of the sum is assembly of S, its factorisation and the solution with its refinements.", ""] + command("right_hand_side_parts")
    columns = ("frames", "phi_ddot", "jacobian", "assembly", "factor", "solve", "whole")
    cells = []
    for r in rows_of("right_hand_side_parts"):
        ns = {c: number(r[c]) for c in columns}
        share = (ns["assembly"] + ns["factor"] + ns["solve"]) / sum(ns[c] for c in columns[:-1])
        cells.append([r["name"].split("/", 1)[1]] + [figure(ns[c]) for c in columns] + [figure(share, 2)])
    lines += table_of(["mechanism"] + list(columns) + ["linear share"], cells)
    cells = {}
    for r in rows_of("primitive"):
        _, primitive, part = r["name"].split("/")
        cells.setdefault(primitive, {})[part] = r["ns"]
    lines += ["Primitives between two bodies [ns]; the adjoint needs `pull_back`:", ""] + command("primitive")
    return lines + table_of(["primitive", "residual", "jacobian", "pull_back"],
                            [[p, c["residual"], c["jacobian"], c["pull_back"]] for p, c in cells.items()])


def growth_section():
    lines = ["## As mechanisms grow", "", "Time per body at 10 000 bodies over that at 100, in turn in one run:", ""] + command("right_hand_side_growth")
    lines += table_of(["mechanism", "model", "ratio"], [[*r["name"].split("/")[1:], figure(number(r["ratio"]))] for r in rows_of("right_hand_side_growth")])
    lines += ["The start of a run compiles the scene and assembles the initial state [ms]:", ""] + command("start")
    return lines + table_of(["N-four-bar", "bodies", "start"], [[r["name"].split("/")[-1], r["bodies"], figure(number(r["start_ms"]))] for r in rows_of("start")])


def sizes_section():
    lines = ["## Whole commands", "",
             "The problem files have 100 to 10 000 bodies. One parameter is the mass of all of them. The objective is the energy at",
             "the end. `gradient` chooses its method. A run takes twenty steps of `dopri5`. The table shows the processor time of the",
             "whole process [s] and its largest memory [MiB]. *Growth* is the time per body at 10 000 bodies over that at 1000.", ""] + command("sizes")
    kinds, cells = {}, []
    for r in rows_of("sizes"):
        _, kind, size, name = r["name"].split("/")
        kinds.setdefault(kind, {}).setdefault(int(size), {})[name] = r
    for kind, sizes in kinds.items():
        for size, of_name in sizes.items():
            cells.append([kind, next(iter(of_name.values()))["bodies"]])
            for name in ("validate", "simulate", "gradient"):
                r, growth = of_name[name], "-"
                if size == 10000 and 1000 in sizes:
                    growth = figure(number(r["seconds"]) / number(sizes[1000][name]["seconds"]) / 10, 2)
                cells[-1] += [figure(number(r["seconds"])), figure(number(r["mib"])), growth]
    header = ["mechanism", "bodies"]
    for name in ("validate", "simulate", "gradient"):
        header += [f"{name} [s]", "[MiB]", "growth"]
    return lines + table_of(header, cells)


def time_to_error_section():
    lines = ["## Time to an error", "",
             "The runs are 10 s of motion. The error is the largest distance of any rod's centre of mass from its right position, at",
             "201 times. The right motion is the exact one (A02 passes its singular position about ten times), for Bricard's",
             "mechanism that of `dopri853` at rtol 1e-12. The table shows the fastest of `dopri5`, `verner6` and `dopri853`",
             "at two tolerances per decade. It must meet the error at a third of the tolerance, too. The time is that of the",
             "complete `simulate`, including the initial assembly.", ""] + command("time_to_error")
    cells = []
    for r in rows_of("time_to_error"):
        f = lambda c, d=3: figure(number(r.get(c)), d)
        cells.append([r["name"].split("/", 1)[1], f("wanted"), f("ms"), f("assembly_ms"), f("error", 2), f"{r['label']} at {f('rtol', 2)}",
                      f("steps"), f("rhs", 4), f("default_ms"), f("default_error", 2)])
    return lines + table_of(["mechanism", "wanted [m]", "ms", "of it assembly", "error", "method", "steps", "right-hand sides", "defaults: ms", "error"], cells)


def gradients_section():
    lines = ["## Gradients", "",
             "There are 50 parameters. The figures are wall times divided by that of one simulation with its compilation and assembly,",
             "medians of rounds in turn. *Start* is the share of compilation and assembly in one simulation. *TLM of 1* is with the",
             "first parameter, *TLM of 50* with all. *Per further parameter* is their difference divided by 49.", ""] + command("gradient_scaling")
    cells = []
    for r in rows_of("gradient_scaling"):
        kind, method = r["name"].split("/")[1].split("_")
        cells.append([kind, r["bodies"], method, r["steps"], figure(number(r["start_share"]), 2), figure(number(r["adjoint_ratio"])),
                      figure(number(r.get("tlm_of_one"))), figure(number(r.get("tlm_of_all"))), figure(number(r["tlm_per_parameter"]))])
    lines += table_of(["mechanism", "bodies", "method", "steps", "start", "adjoint", "TLM of 1", "TLM of 50", "TLM per further parameter"], cells)
    lines += ["A full Hessian in ten parameters (FB-1): " + figure(of("hessian", "hessian/five_bar", "hessian_ratio")) + " simulations, by " +
              figure(of("hessian", "hessian/five_bar", "gradients")) + " gradients.", ""] + command("hessian")
    lines += ["The memory of an adjoint over 10 s is in MiB. *Grown* is the largest growth of the process during the run, including",
              "assembly and its derivatives.", ""] + command("adjoint_memory")
    cells = [[r["bodies"], r["budget_mib"], figure(number(r["kept_mib"])), figure(number(r["grown_mib"])), figure(number(r["recomputed"]), 2)]
             for r in rows_of("adjoint_memory") if r["name"].startswith("adjoint_memory/four_bars")]
    lines += table_of(["bodies", "budget", "kept", "grown", "steps computed again, of all"], cells)
    design = rows_of("design")
    if design:
        d = design[0]
        lines += [f"FB-1 from its start to its optimum: {figure(number(d['ms']))} ms, {d.get('optimizer_iterations', '-')} iterations, {d['evaluations']} evaluations with gradients;",
                  f"the lengths end within {figure(number(d['optimum_error']), 2)} of the known optimum.", ""] + command("design")
    return lines


# By hand: the reasons of the figures, above all of missed aims. Ratios and counts do not depend on the machine.
REASONS = """## Reasons for the figures

`perf record -e cpu-clock` profiles right-hand sides in the spatial model, N-four-bar, N = 40. The shares in per cent
are: assembly of S 19, its factorisation 15, both solves with their products with J 28, J 14, Phiddot 9, frames with
pddot 8, the rest 7. In a run with `dopri5` the right-hand sides take about three quarters of the time. The projection
takes one to two right-hand sides per step, and the sums of the stages the rest.

* **Absolute times vary by a factor of two** on a shared machine. One program takes 0.42 to 0.58 us (spatial, 10 to 1000
  bodies) in some quarters of an hour, 0.5 to 1.1 us in others, and 44 to 63 ms (FB-1). On the machine of this page it
  takes 0.33 to 0.42 us in most minutes, 0.45 to 0.56 us in the worst.
* **Growth to 10 000 bodies is memory.** A body has about 3.4 kB of frames, J, S and constraints, which a right-hand
  side reads several times. The data of 100 bodies stay in the second-level cache. Those of 10 000 come from the third
  or, if others use it, from memory. So the loops over bodies and over groups of rows prefetch the data of the fourth
  next one (`core/linear/prefetch.hpp`). The processor's own prefetching ends with each page of 4 kB. Prefetching gains
  nothing up to 1000 bodies, nor in tangents, which compute more with the data that they load.

  | time per body at 10 000 bodies over that at 100, in space (second-level cache of 1 MB) | without prefetching | with it |
  | --- | --- | --- |
  | planar chain | 1.26 to 1.36 | 1.20 to 1.23 |
  | spatial chain | 1.26 to 1.30 | 1.17 to 1.18 |
  | N-four-bars | 1.55 to 1.65 | 1.23 to 1.27 |
  | tree | 2.0 | 1.5 |
  | while other programs use the third-level cache | up to 1.9 | up to 1.4 |

  In four-bars (all cranks, then all couplers) and in trees neighbours are far apart in memory, which costs the rest.
  Three alternatives do not help. Portions of 16 to 512 bodies, each placed, assembled, factored and substituted
  together, give 1.4 to 2.4 instead of 1.3, since each portion starts a dozen short streams. Large pages change nothing.
  Blocks of S set at their first use, and frames computed just before constraints read them, are 3 to 8 per cent slower
  at 10 to 100 bodies. Chains of more than 316 joints in space take three passes of the solver. Planar chains need two.
* **TLM.** The directions of 50 parameters of 500 bodies take 23 MB with their stages. They do not fit the second-level
  cache, so a parameter costs a quarter more than with 81 bodies. The complete cost of TLM beyond a simulation, divided
  by 49 parameters, is 0.20, 0.23, 0.27, 0.34 for N-four-bars of 5, 21, 81, 501 bodies. For chains it is 0.28, 0.31,
  0.30, 0.38. It includes the matrices of the stages and the first parameter. Common arrays for the stage's directions
  of all blocks, and exchanged instead of copied states, gain 1 to 3 per cent. Prefetching of blocks gains nothing.
  Eight directions at a time would halve the loads of each, and double the cost of problems with up to four parameters.
* **The adjoint** of 1260 steps of 500 rods keeps 0.7 GB. With a budget of 256 MiB it computes every step again.
* **FB-1** takes nine evaluations with gradients at the tolerance of its file, 1e-9 with `dopri853`. It takes 41 to 44
  ms on an idle machine, up to 70 beside other programs. The linear solver of Ipopt needs a twentieth of this for the
  comparison of names. The search for singular positions takes 6 to 7 % of each simulation.
* **Hardening.** The release compiles its hot loops with `-fstack-protector-strong` and `-D_FORTIFY_SOURCE=2`. These
  cost 0.3 to 0.5 % more instructions (callgrind: a design, a simulation, a gradient). `-D_GLIBCXX_ASSERTIONS` in the
  same sources costs 11 to 12 % more, so only `optim/` and `app/` are compiled with it.
* **Set-up.** A table holds the names of bodies and joints. An elimination of one body after another finds rank and
  redundant equations (`core/linear/row_dependence.hpp`). It decides the rank inside small fronts, and finds the same
  rows as Gram-Schmidt on whole rows. Initial assembly is dense if the guess is not exact. Its time then grows with the
  cube of the number of bodies. So give large mechanisms a guess that satisfies the joints to rounding.
"""

PEERS = {"simbody": "Simbody", "mujoco": "MuJoCo", "dart": "DART"}


def peers_section():
    rows = rows_of("peers_right_hand_side")
    lines = ["## Other programs", ""]
    if not rows:
        return lines + ["Not measured: `./dev bench --peers` installs Simbody, MuJoCo and DART (Debian packages, for nothing but this) and measures them.", ""]
    lines += ["The programs are Debian's Simbody 3.7, MuJoCo 2.2 and DART 6.12. They evaluate the same mechanisms at the same state, in",
              "turn in one run, in one thread. The figures are microseconds per right-hand side, and in brackets the ratio to mbsopt",
              "(above 1: mbsopt is faster). mbsopt solves for 6 unknowns per body and all reactions. Simbody, MuJoCo and DART use joint",
              "coordinates. Accelerations agree to the figure in *apart* (MuJoCo closes loops by regularised constraints). DART closes",
              "loops only in its time stepping, so its figures are for open mechanisms only. MuJoCo's reader refuses chains of 100",
              "bodies and more.", ""] + command("peers_right_hand_side")
    cells = []
    for r in rows:
        line = [r["name"].split("/", 1)[1], r["bodies"], figure(number(r["mbsopt_us"]))]
        for p in PEERS:
            us, ratio, apart = (number(r.get(f"{p}_{c}")) for c in ("us", "ratio", "apart"))
            line.append("-" if us is None else f"{figure(us)} ({figure(ratio, 2)})")
        worst = [f"{p} {figure(number(r[f'{k}_apart']), 1)}" for k, p in PEERS.items() if number(r.get(f"{k}_apart")) is not None]
        cells.append(line + [", ".join(worst)])
    lines += table_of(["mechanism", "bodies", "mbsopt"] + list(PEERS.values()) + ["apart"], cells)
    lines += ["The runs are 10 s of motion, with the error as above. Each program has its coarsest setting that meets the wanted error,",
              "else its most exact setting. The error of mbsopt is not larger than this error.", ""] + command("peers_time_to_error")
    cells, words = [], []
    for r in rows_of("peers_time_to_error"):
        name = r["name"].split("/", 1)[1]
        for p, title in PEERS.items():
            theirs = number(r.get(f"{p}_ms"))
            said = next((s.split(": ", 1)[1] for s in r["label"].split("; ") if s.startswith(p + ":")), "")
            if theirs is None:
                if said:
                    words.append(f"{title} on `{name}`: {said}.")
                continue
            ours = number(r[f"mbsopt_ms_for_{p}"])
            setting, ours_setting = said.split(", mbsopt: ")
            cells.append([name, title, setting, figure(theirs), figure(number(r[f"{p}_error"]), 2), ours_setting, figure(ours),
                          figure(number(r[f"mbsopt_error_for_{p}"]), 2), figure(theirs / ours, 2)])
    lines += table_of(["mechanism", "program", "setting", "ms", "error [m]", "mbsopt", "ms", "error [m]", "ratio"], cells)
    return lines + words + [""] * bool(words)


def write():
    runs = rows_of("runs")
    machines = sorted({f"{r['cpu']}, {r['cores']} cores, {r['compiler']}, {r['flags']}" for r in runs})
    loads = [float(r["load"]) for r in runs]
    lines = ["# Performance", "",
             "`./dev bench` writes this page (`docs/performance.py`); do not edit it. The figures are in `data/performance/`, the",
             "programs in `bench/`. Each table is below the command that measures only this table. `./dev bench --peers` measures",
             "all tables, including those with other programs.", "", "Measured on:", "", *[f"* {machine}" for machine in machines], "",
             "All runs use one thread. Times are medians of this thread's processor time. Ratios are from one run, measured in turn.", ""]
    if loads and max(loads) > 0.7 * min(int(r["cores"]) for r in runs):
        lines += [f"**The machine was busy**: its load was {min(loads):.0f} to {max(loads):.0f}. Processor times are longer than on an idle machine, since",
                  "programs share a core's caches and arithmetic. Ratios within a run hardly depend on it.", ""]
    lines += ["## Aims", ""] + targets_section()
    for section in (right_hand_side_section, parts_section, growth_section, sizes_section, time_to_error_section, gradients_section, peers_section):
        lines += section()
    lines += ["", *REASONS.splitlines()]
    PAGE.write_text("\n".join(lines).rstrip() + "\n")


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1] == "keep":
        keep(Path(sys.argv[2]))
    elif sys.argv[1:] == ["write"]:
        write()
    else:
        sys.exit(__doc__)
