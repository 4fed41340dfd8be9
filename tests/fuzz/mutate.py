#!/usr/bin/env python3
"""Runs whole commands of mbsopt on problem files that are wrong in some way.

    python3 tests/fuzz/mutate.py build/release/mbsopt --minutes 30 --finds build/fuzz/finds

Each case is a file of problems/ with one to four mutations, and a command. Its number is its seed: the same number makes
the same case. A command holds if it ends without a signal, with an exit code of docs/cli.md, with words where it
fails, without a library's text, without NaN in its results, and if it neither runs silently for 8 s nor ignores Ctrl-C.
A case that does not hold is shrunk to the fewest keys and kept.
"""

import argparse
import concurrent.futures
import copy
import hashlib
import json
import os
import pathlib
import pty
import random
import re
import resource
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
SILENCE = 8.0  # s of processor time without any output
PATIENCE = 4.0  # s of processor time after Ctrl-C
MOST_MEMORY = 4 << 30  # bytes per command
COMMANDS = ["validate", "simulate", "gradient", "kinematics", "linearise", "check", "design", "identify", "tradeoff", "sweep"]

NUMBERS = ["0", "-0.0", "1", "-1", "1e-320", "2.3e-308", "1e-200", "1e-30", "1e-12", "1e-6", "1e6", "1e12", "1e30", "1e200",
           "1e308", "-1e308", "1.7976931348623157e308", "1e400", "-1e400", "9223372036854775807", "18446744073709551616",
           "2147483648", "-2147483649", "0.1", "1e9", "-1e9", "3.141592653589793"]
TEXTS = ["", " ", "O", "ground", "t", "x", "sin", "1", "e", "a.b", "a[0]", "\u0000", "\u001b[31mred", "\u202ereversed", "\u00e9t\u00e9",
         "\U0001f600", "n" * 300, "../../x", "/", "NaN", "null", "*", "-"]
EXPRESSIONS = ["1/0", "0/0", "sqrt(-1)", "log(0)", "asin(2)", "0^-1", "(-1)^0.5", "1e308*10", "t", "t^t", "1/t", "sqrt(t)",
               "abs(t-0.1)", "tan(t)", "if(t<1,0,1)", "sign(t)", "min()", "max(1)", "atan2(0,0)", "smooth_abs(t,0)",
               "smooth_max(t,1,0)", "exp(exp(exp(9)))", "(" * 300 + "1" + ")" * 300, "-" * 300 + "1", "1+" * 300 + "1",
               "t [s]", "1 [kg", "1 [bogus]", "1 []", "2 [m^99]", "1 [deg] + 1 [kg]", "a^b^c", "1..2", "1e", ".", "+", "t t",
               "sin t", "sin(", "sin()", "sin(1,2)", "\u03c0", "1\u00a0", "1/(t-0.05)", "1e-300*t/1e-300", "exp(1000*t)", "sin(1e15*t)"]
RAW = "@@raw "  # a string that stands for JSON text: duplicate keys and numbers that json would not write


class Pool:
    """What all problem files say: their values by key, their commands."""

    def __init__(self):
        self.files = sorted((ROOT / "problems").glob("*/*.json"))
        self.problems = [load(path) for path in self.files]
        self.by_key = {}
        for problem in self.problems:
            for holder, key in places(problem):
                if isinstance(key, str):
                    self.by_key.setdefault(key, []).append(holder[key])
        self.keys = sorted(self.by_key)


def load(path):
    """The value of a problem file: JSON with comments outside of strings."""
    text = path.read_text()
    return json.loads(re.sub(r'("(?:[^"\\]|\\.)*")|//[^\n]*|/\*.*?\*/', lambda m: m[1] or "", text, flags=re.S))


def text_of(problem):
    text = json.dumps(problem, indent=1)
    return re.sub(r'"%s((?:[^"\\]|\\.)*)"' % RAW, lambda m: json.loads('"%s"' % m[1]), text)


def places(value):
    """Every place of a value as (holder, key), outermost first."""
    found = []
    waiting = [value]
    while waiting:
        holder = waiting.pop(0)
        keys = list(holder) if isinstance(holder, dict) else range(len(holder)) if isinstance(holder, list) else []
        for key in keys:
            found.append((holder, key))
            if isinstance(holder[key], (dict, list)):
                waiting.append(holder[key])
    return found


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


# Mutations: each changes one place of the problem and returns what it did, or None where it does not apply.


def extreme_number(r, pool, problem):
    spots = [(h, k) for h, k in places(problem) if is_number(h[k])]
    if not spots:
        return None
    h, k = r.choice(spots)
    kind = r.randrange(4)
    if kind == 0:
        h[k] = -h[k]
    elif kind == 1:
        h[k] = h[k] * r.choice([1e-15, 1e-9, 1e-6, 1e-3, 1.000000001, 2, 1e3, 1e6, 1e9, 1e15])
    else:
        h[k] = RAW + r.choice(NUMBERS)
    return f"{k}: a number is now {h[k]}"


def expression_for_value(r, pool, problem):
    spots = [(h, k) for h, k in places(problem) if is_number(h[k]) or isinstance(h[k], str)]
    h, k = r.choice(spots)
    names = list(problem.get("parameters", {})) + list(problem.get("definitions", {})) + list(problem.get("sensors", {}))
    candidates = EXPRESSIONS + [f"{n}*1e300" for n in names] + [f"1/({n}-{n})" for n in names] + names
    h[k] = r.choice(candidates)
    return f"{k}: is now the expression {h[k][:40]}"


def changed_expression(r, pool, problem):
    spots = [(h, k) for h, k in places(problem) if isinstance(h[k], str) and re.search(r"[-+*/^(]", h[k])]
    if not spots:
        return None
    h, k = r.choice(spots)
    tokens = re.findall(r"[A-Za-z_.0-9]+|\s+|.", h[k])
    i = r.randrange(len(tokens))
    kind = r.randrange(4)
    if kind == 0:
        del tokens[i]
    elif kind == 1:
        tokens[i] = r.choice(["+", "-", "*", "/", "^", "(", ")", ",", "t", "0", "1e308", "sqrt", "log", "[kg]"])
    elif kind == 2:
        tokens.insert(i, r.choice(tokens))
    else:
        tokens = tokens[:i]
    h[k] = "".join(tokens)
    return f"{k}: is now the expression {h[k][:40]}"


def other_type(r, pool, problem):
    h, k = r.choice(places(problem))
    old = h[k]
    h[k] = r.choice([None, True, False, 0, 1, -1, 0.5, "", "x", [], {}, [old], {"value": old}, [[]], [1], [1, 2, 3], {"": 1},
                     [None] * 3, str(old)[:50], [old] * 4])
    return f"{k}: another type, {json.dumps(h[k])[:40]}"


def drop(r, pool, problem):
    h, k = r.choice(places(problem))
    del h[k]
    return f"{k}: dropped"


def duplicate(r, pool, problem):
    h, k = r.choice(places(problem))
    if isinstance(h, list):
        for _ in range(r.choice([1, 1, 1, 2, 30])):
            h.insert(k, copy.deepcopy(h[k]))
        return f"[{k}]: repeated"
    other = r.choice(["_", "2", "x", " "]) if r.random() < 0.7 else ""
    h[k + other] = copy.deepcopy(h[k])
    if not other:  # the same key twice, in the text
        h[k] = RAW + json.dumps(h[k]) + ", " + json.dumps(k) + ": " + json.dumps(h[k])
    return f"{k}: there twice"


def swap(r, pool, problem):
    spots = places(problem)
    (h1, k1), (h2, k2) = r.choice(spots), r.choice(spots)
    if isinstance(h1[k1], (dict, list)) or isinstance(h2[k2], (dict, list)):  # one may hold the other
        siblings = list(h1) if isinstance(h1, dict) else list(range(len(h1)))
        h2, k2 = h1, r.choice(siblings)
    h1[k1], h2[k2] = h2[k2], h1[k1]
    return f"{k1} and {k2}: swapped"


def rename_key(r, pool, problem):
    spots = [(h, k) for h, k in places(problem) if isinstance(h, dict)]
    h, k = r.choice(spots)
    new = r.choice(TEXTS + pool.keys)
    h[new] = h.pop(k)
    return f"{k}: is called {new[:30]!r}"


def other_name(r, pool, problem):
    spots = [(h, k) for h, k in places(problem) if isinstance(h[k], str)]
    if not spots:
        return None
    h, k = r.choice(spots)
    others = [x[y] for x, y in spots]
    same_key = [v for v in pool.by_key.get(k, []) if isinstance(v, str)] if isinstance(k, str) else []
    h[k] = r.choice(r.choice([others, TEXTS, same_key or others, same_key or others]))
    return f"{k}: says {h[k][:30]!r}"


def transplant(r, pool, problem):
    spots = [(h, k) for h, k in places(problem) if isinstance(k, str)]
    h, k = r.choice(spots)
    h[k] = copy.deepcopy(r.choice(pool.by_key.get(k, [h[k]])))
    return f"{k}: that of another file"


def added_key(r, pool, problem):
    holders = [problem] + [h[k] for h, k in places(problem) if isinstance(h[k], dict)]
    h = r.choice(holders)
    k = r.choice(pool.keys)
    h[k] = copy.deepcopy(r.choice(pool.by_key[k]))
    return f"{k}: added"


def setting(r, pool, problem):
    """Settings of the simulation that only some files have."""
    path, value = r.choice([
        ("integrator", {"type": r.choice(["dopri853", "dopri5", "rk4", "radau5", "cvodes_bdf", "cvodes_adams", "bogus"])}),
        ("integrator", {"type": "rk4", "step": r.choice([0, -1, 1e-300, 1e300, 0.01])}),
        ("integrator", {"rtol": r.choice([0, 1e-16, 1, -1, 1e300]), "atol": r.choice([0, 1e-300, 1e300])}),
        ("output_step", r.choice([0, -1, 1e-12, 1e300, 1e-300])),
        ("end_time", r.choice([-1, 0, 1e-300, 1e-9, 1e9, 1e300])),
        ("start_time", r.choice([-1e300, 1e300, 1e-9, 1e9])),
        ("accuracy", r.choice([0, 1e-30, 1e-3, 1, 1e9])),
        ("formulation", r.choice(["penalty", "lagrange", {"type": "penalty", "alpha": 1e300}, {"alpha": 0}])),
    ])
    simulation = problem.get("simulation")
    if not isinstance(simulation, dict):
        return None
    simulation[path] = value
    return f"simulation.{path}: {value}"


MUTATIONS = [extreme_number] * 5 + [expression_for_value] * 2 + [changed_expression, other_type, other_type, drop, drop, duplicate,
             swap, rename_key, other_name, other_name, transplant, added_key, setting]


class Case:
    def __init__(self, pool, seed):
        r = random.Random(seed)
        self.seed = seed
        index = r.randrange(len(pool.files))
        self.source = pool.files[index]
        self.problem = copy.deepcopy(pool.problems[index])
        self.mutations = []
        for _ in range(r.choice([1, 1, 1, 2, 2, 4])):
            try:
                done = r.choice(MUTATIONS)(r, pool, self.problem)
            except (IndexError, ValueError, OverflowError, TypeError, KeyError):  # nothing of that kind is left
                done = None
            if done:
                self.mutations.append(done)
        fitting = ["validate", "simulate", "simulate", "gradient"]
        if "drives" in self.problem:
            fitting.append("kinematics")
        if "design" in self.problem:
            fitting += ["design", "design"]
        if "identification" in self.problem:
            fitting += ["identify", "identify"]
        self.command = r.choice(fitting) if r.random() < 0.85 else r.choice(COMMANDS)

    def arguments(self):
        if self.command == "sweep":
            parameters = self.problem.get("parameters")
            name = next(iter(parameters), "") if isinstance(parameters, dict) else ""
            return ["--vary", f"{name}=0.1:10:3", "--gradients"]
        return {"tradeoff": ["--budget", "0.5"]}.get(self.command, [])


class Outcome:
    """How a command ended, and what is wrong with that (empty: it held)."""

    def __init__(self, wrong="", output="", interrupted=False):
        self.wrong, self.output, self.interrupted = wrong, output, interrupted


def processor_seconds(pid):
    """Of a process and its children, those that ended and those that run: what one of them used before a signal is not
    to be counted after it, when it is waited for."""
    try:
        process = pathlib.Path(f"/proc/{pid}")
        fields = (process / "stat").read_text().rpartition(")")[2].split()
        own = sum(int(field) for field in fields[11:15]) / os.sysconf("SC_CLK_TCK")
        children = (process / "task" / str(pid) / "children").read_text().split()
    except (FileNotFoundError, ProcessLookupError, IndexError):
        return 0.0
    return own + sum(processor_seconds(child) for child in children)


RAW_WORDS = re.compile(r"std::|bad_alloc|basic_string|vector::|json\.exception|Eigen|\b0x[0-9a-fA-F]{5,}|terminate called|"
                       r"AddressSanitizer|runtime error:|Assertion|_M_\w+|bad optional|bad variant|stoi|stod")
NOT_A_NUMBER = re.compile(r"(?<![\w.'\"/-])[-+]?(?:nan|inf)(?![\w'\"])", re.I)


def limits():
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def run(program, case, text):
    with tempfile.TemporaryDirectory(prefix="mbsopt_fuzz_") as folder:
        folder = pathlib.Path(folder)
        os.symlink(ROOT / "data", folder / "data")
        file = folder / "problems" / "fuzz" / "problem.json"
        file.parent.mkdir(parents=True)
        file.write_bytes(text.encode("utf-8", "surrogatepass"))
        return run_on(program, case, file, folder / "out")


def run_on(program, case, file, out):
    terminal, end = pty.openpty()  # a terminal, so that progress is shown
    child = subprocess.Popen([program, case.command, str(file), "--out", str(out)] + case.arguments(), stdin=subprocess.DEVNULL,
                             stdout=end, stderr=end, preexec_fn=limits, start_new_session=True)
    os.close(end)
    output = b""
    interrupted_at = None
    killed = False
    heard_at = 0.0
    while True:
        ready = select.select([terminal], [], [], 0.1)[0]
        if ready:
            try:
                got = os.read(terminal, 65536)
            except OSError:
                got = b""
            if not got:
                break
            heard_at = processor_seconds(child.pid)
            output = (output + got)[-200000:]
        elif child.poll() is not None:
            break
        used = processor_seconds(child.pid)
        if interrupted_at is None and used > SILENCE:
            silent = used - heard_at > SILENCE
            interrupted_at = used
            if silent:
                break_reason = "ran silently"
                killed = True
            else:
                child.send_signal(signal.SIGINT)
        if interrupted_at is not None and not killed and used > interrupted_at + PATIENCE:
            break_reason = "ignored Ctrl-C"
            killed = True
        if killed:
            os.killpg(child.pid, signal.SIGKILL)
            child.wait()
            os.close(terminal)
            return Outcome(break_reason, output.decode("utf-8", "replace"))
    code = child.wait()
    os.close(terminal)
    words = output.decode("utf-8", "replace")
    interrupted = interrupted_at is not None
    return Outcome(what_is_wrong(case, file, code, words, out, interrupted), words, interrupted)


def what_is_wrong(case, file, code, words, out, interrupted):
    if code < 0:
        return "ended by " + signal.Signals(-code).name
    if code not in ((0, 1, 2, 3, 130) if interrupted else (0, 1, 2, 3)):
        return f"exit code {code}"
    if code == 3 and case.command != "check":
        return "exit code 3"
    if code in (1, 2) and not words.strip():
        return f"exit code {code} without a word"
    said = words
    result = out / "result.json"
    if result.exists():
        text = result.read_text(errors="replace")
        try:
            value = json.loads(text, parse_constant=lambda name: name)
        except ValueError:
            return "result.json is not JSON"
        if re.search(r"[:\[,]\s*-?(NaN|Infinity|nan|inf)\b", text):
            return "NaN in result.json"
        if value.get("status") == "running":
            return "result.json says running"
        if (value.get("status") == "ok") != (code == 0):
            return f"exit code {code}, status {value.get('status')}"
        said += " ".join(str(value.get(key, "")) for key in ("message", "warnings"))
        if code == 0:
            for name, objective in value.get("objectives", {}).items():
                if objective.get("value", 0) is None or None in objective.get("gradient", {}).values():
                    return "an objective without a value, and exit code 0"
            for name, parameter in value.get("parameters", {}).items():
                if parameter.get("value", 0) is None:
                    return "a parameter without a value, and exit code 0"
    elif code == 0:
        return "exit code 0 without result.json"
    own = file.read_text(errors="replace")
    raw = [m for m in RAW_WORDS.findall(said) if m not in own]
    if raw:
        return f"a library's words: {raw[0]}"
    # What the file itself says may be quoted.
    quoted = re.sub(r"is -?(inf|nan) at the (?:values|start)|'[^']*'|\"[^\"]*\"", "", said)
    if NOT_A_NUMBER.search(quoted) and not re.search(r"\b(?:nan|inf)\b", own, re.I):
        return "NaN or inf in words"
    trajectory = out / "trajectory.csv"
    if trajectory.exists() and NOT_A_NUMBER.search(trajectory.read_text().partition("\n")[2]):
        return "NaN in trajectory.csv"
    return ""


def shrink(program, case, wrong, seconds):
    """The smallest problem found in that time which goes wrong in the same way."""
    until = time.monotonic() + seconds
    best = case.problem

    def still_wrong(candidate):
        trial = copy.copy(case)
        trial.problem = candidate
        return run(program, trial, text_of(candidate)).wrong == wrong

    changed = True
    while changed and time.monotonic() < until:
        changed = False
        for index in range(len(places(best)) - 1, -1, -1):
            if time.monotonic() > until:
                break
            candidate = copy.deepcopy(best)
            spots = places(candidate)
            if index >= len(spots):
                continue
            holder, key = spots[index]
            del holder[key]
            if still_wrong(candidate):
                best, changed = candidate, True
    return best


def keep(folder, program, case, outcome, small):
    folder.mkdir(parents=True, exist_ok=True)
    name = re.sub(r"\W+", "_", outcome.wrong)[:40] + "_" + hashlib.sha256(text_of(small).encode("utf-8", "replace")).hexdigest()[:8]
    (folder / f"{name}.json").write_bytes(text_of(small).encode("utf-8", "surrogatepass"))
    (folder / f"{name}.txt").write_text(
        f"{outcome.wrong}\nseed {case.seed}: {case.command} {case.source.relative_to(ROOT)}\n" + "\n".join(case.mutations) +
        "\n\n" + outcome.output[-3000:], errors="replace")
    return name


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("program")
    parser.add_argument("--minutes", type=float, default=1)
    parser.add_argument("--cases", type=int, default=0, help="so many cases, whatever the time")
    parser.add_argument("--seed", type=int, default=None, help="of the first case")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--finds", type=pathlib.Path, default=ROOT / "build" / "fuzz" / "finds")
    parser.add_argument("--shrink", type=float, default=60, help="seconds for shrinking a find")
    parser.add_argument("--print", action="store_true", help="print the file of --seed, run nothing")
    options = parser.parse_args()
    program = shutil.which(options.program) or sys.exit(f"there is no program {options.program}")
    program = os.path.abspath(program)
    pool = Pool()
    seed = random.randrange(10**9) if options.seed is None else options.seed
    if options.print:
        case = Case(pool, seed)
        print(f"// {case.command} {case.source}: {'; '.join(case.mutations)}\n{text_of(case.problem)}")
        return 0
    print(f"mutate: seeds from {seed}", file=sys.stderr)
    until = time.monotonic() + 60 * options.minutes
    lock = threading.Lock()
    counts = {"next": 0, "tried": 0, "long": 0}
    codes = {}
    finds = {}

    def work():
        while True:
            with lock:
                number = counts["next"]
                if number >= options.cases if options.cases else time.monotonic() > until:
                    return
                counts["next"] += 1
            case = Case(pool, seed + number)
            outcome = run(program, case, text_of(case.problem))
            with lock:
                counts["tried"] += 1
                counts["long"] += outcome.interrupted
                if not outcome.wrong:
                    continue
                first = outcome.wrong not in finds
                finds.setdefault(outcome.wrong, []).append(case.seed)
            print(f"seed {case.seed}: {outcome.wrong}: {case.command} {case.source.relative_to(ROOT)}: "
                  f"{'; '.join(case.mutations)}", file=sys.stderr)
            small = shrink(program, case, outcome.wrong, options.shrink) if first else case.problem
            name = keep(options.finds, program, case, outcome, small)
            print(f"   kept as {options.finds / name}.json", file=sys.stderr)

    with concurrent.futures.ThreadPoolExecutor(options.jobs) as threads:
        for done in [threads.submit(work) for _ in range(options.jobs)]:
            done.result()
    bad = sum(len(seeds) for seeds in finds.values())
    print(f"{counts['long']} of {counts['tried']} commands ran for {SILENCE:g} s and were interrupted", file=sys.stderr)
    print(f"{counts['tried']} tried, {counts['tried'] - bad} held")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
