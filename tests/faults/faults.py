"""Faults: nothing that was finished is lost, nothing else comes out, and what goes wrong is said.

    python3 tests/faults/faults.py build/release/mbsopt build/release/libfail_calls.so [--kills 200] [--journals 300]

Runs the program on small problems under every fault that a system offers:

  streams    standard streams that are closed or full
  calls      the n-th call of write, fsync, rename, ... fails or is cut short, for every n (fail_calls.cpp)
  limits     few descriptors, processes, memory; small files; a folder that is read-only, taken or vanishes
  journals   damaged journals: each is refused in words, or `resume` ends as the undisturbed run
  kills      one to three signals at random moments, then `resume` (or the command again)

A trial holds if no signal of the program's own making ends it, if every failure has an exit code and words, if
result.json never says "running" of a run that has ended by itself, if no file is half-written, and if the run that
follows without a fault gives the bytes of the undisturbed one. The last line counts them: "N tried, N held".
Everything random follows from --seed.
"""

import argparse
import errno
import json
import math
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

NOBODY = 65534  # a user without the rights of root, to whom limits and permissions apply
PATIENCE = 60  # seconds after which a command hangs
LIBRARY_WORDS = ("json.exception", "terminate called", "std::", "basic_string", "bad_alloc", "Traceback")

ROD = {
    "format": 1,
    "name": "rod",
    "gravity": [0, -9.81, 0],
    "parameters": {
        "k": {"value": 20, "lower": 5, "upper": 200, "scale": "log"},
        "free": {"value": 0.5, "lower": 0.2, "upper": 1.2},
    },
    "bodies": [{"name": "rod", "mass": 2, "com": [0.5, 0, 0], "inertia": [1e-3, 0.1666, 0.1666], "points": {"tip": [1, 0, 0]}}],
    "joints": [
        {"name": "pin", "type": "revolute", "body1": "ground", "body2": "rod", "point1": [0, 0, 0], "point2": "O",
         "axis1": [0, 0, 1], "axis2": [0, 0, 1]}
    ],
    "forces": [
        {"name": "spring", "type": "tsda", "body1": "ground", "body2": "rod", "point1": [0, 1, 0], "point2": "tip",
         "stiffness": "k", "damping": 0.5, "free_length": "free"}
    ],
    "sensors": {
        "tip_y": {"quantity": "position", "body": "rod", "point": "tip", "component": "y"},
        "swing": {"quantity": "angle", "joint": "pin"},
    },
    "simulation": {"end_time": 1, "output_step": 0.25},
    "objectives": {"track": {"running": "(tip_y + 0.2*sin(5*t))^2", "parameters_only": "1e-4*k"}},
}
ROD_ON_A_DRIVE = {
    **{key: ROD[key] for key in ("format", "gravity", "bodies", "joints", "sensors", "simulation")},
    "name": "driven",
    "drives": [{"name": "motor", "type": "angle", "joint": "pin", "law": "2*t"}],
}
FIT = {
    "experiments": [
        {"name": name, "data": f"{name}/r.csv", "channels": [{"column": "theta", "sensor": "swing", "sigma": 0.01}]}
        for name in ("a", "b")
    ],
    "variables": ["k", "free"],
}
DESIGN = {"minimize": "track", "variables": ["k", "free"]}
STARTS = {"multistart": {"starts": 4, "seed": 11}}
PROBLEMS = {
    "one_design": {**ROD, "design": DESIGN},
    "four_designs": {**ROD, "design": {**DESIGN, **STARTS}},
    "one_fit": {**ROD, "identification": FIT},
    "four_fits": {**ROD, "identification": {**FIT, **STARTS}},
    "driven": ROD_ON_A_DRIVE,
}
LONG = {  # commands that journal and resume
    "one design": ["design", "one_design.json", "--keep-journal"],
    "four designs": ["design", "four_designs.json", "--threads", "2", "--keep-journal"],
    "one fit": ["identify", "one_fit.json", "--keep-journal"],
    "four fits": ["identify", "four_fits.json", "--threads", "2", "--keep-journal"],
}
SHORT = {
    "validate": ["validate", "one_design.json"],
    "simulate": ["simulate", "one_design.json"],
    "kinematics": ["kinematics", "driven.json"],
    "gradient": ["gradient", "one_design.json"],
    "check": ["check", "one_design.json"],
    "tradeoff": ["tradeoff", "one_design.json", "--budget", "0.1"],
}
MEASURED = {"tradeoff"}  # what it writes are measured times
ALL = {**LONG, **SHORT}


class Ended:
    """What a command has left."""

    def __init__(self, code, out, err, hung):
        self.code, self.out, self.err, self.hung = code, out, err, hung


class Trials:
    """Counts trials, and tells those that do not hold."""

    def __init__(self):
        self.tried = self.held = 0

    def add(self, name, complaint):
        self.tried += 1
        self.held += not complaint
        if complaint:
            print(f"NOT HELD  {name}: {complaint}", flush=True)


class Site:
    """A folder for one trial at a time, with the problems in it."""

    def __init__(self, program, top):
        self.program, self.top = program, Path(top)
        self.home = self.top / "problems"
        self.home.mkdir()
        for name, problem in PROBLEMS.items():
            (self.home / f"{name}.json").write_text(json.dumps(problem, indent=1))
        self.count = 0
        self.write_data()

    def write_data(self):
        """The rod's motion with other values and a little noise, as two records of one base name."""
        noise = random.Random(1)
        for name, (k, free) in {"a": (25, 0.5), "b": (25.2, 0.51)}.items():
            out = self.top / f"truth_{name}"
            sets = ["--set", f"parameters.k.value={k}", "--set", f"parameters.free.value={free}"]
            ended = self.run(["simulate", "one_design.json", *sets, "--set", "simulation.output_step=0.05"], self.home, out=out)
            if ended.code != 0:
                sys.exit(f"the data cannot be made: {ended.err}")
            header, *rows = (out / "trajectory.csv").read_text().splitlines()
            at = header.split(",").index("swing")
            (self.home / name).mkdir()
            lines = [f"{row.split(',')[0]},{float(row.split(',')[at]) + noise.gauss(0, 1e-3):.9f}" for row in rows[:11]]
            (self.home / name / "r.csv").write_text("\n".join(["t,theta", *lines]) + "\n")

    def folder(self):
        self.count += 1
        folder = self.top / f"trial{self.count}"
        shutil.copytree(self.home, folder)
        return folder

    def start(self, arguments, folder, out="out", **options):
        if arguments[0] not in ("resume", "schema") and not arguments[0].startswith("--"):
            arguments = [*arguments, "--out", str(out)]
        options = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
        return subprocess.Popen([self.program, *arguments], cwd=folder, start_new_session=True, **options)

    def wait(self, process, patience=PATIENCE):
        hung = False
        try:
            out, err = process.communicate(timeout=patience)
        except subprocess.TimeoutExpired:
            hung = True
            os.killpg(process.pid, signal.SIGKILL)
            out, err = process.communicate()
        return Ended(process.returncode, (out or b"").decode(errors="replace"), (err or b"").decode(errors="replace"), hung)

    def run(self, arguments, folder, **options):
        return self.wait(self.start(arguments, folder, **options))


def same_run(value):
    """A result without what differs between runs."""
    if isinstance(value, dict):
        return {k: same_run(v) for k, v in value.items() if "wall" not in k and k not in ("simulations", "machine")}
    return [same_run(v) for v in value] if isinstance(value, list) else value


def content(folder):
    """The files of an output folder. The journal's order and id differ between runs."""
    files = {}
    for file in sorted(folder.iterdir()):
        text = file.read_bytes()
        if file.name == "result.json":
            text = json.dumps(same_run(json.loads(text)))
        elif file.name == "journal.jsonl":
            text = b""
        elif file.name == "report.html":
            text = re.sub(rb"[0-9.e+-]+ s\b", b"", text)
        files[file.name] = text
    return files


def difference(folder, reference, measured, but_for=()):
    """In words what an output folder has other than the reference, but for these files; empty: nothing."""
    if not folder.is_dir():
        return "there is no output folder"
    here, reference = ({k: v for k, v in files.items() if k not in but_for} for files in (content(folder), reference))
    if measured:
        return "" if here.keys() == reference.keys() else f"other files: {sorted(here)}"
    if here.keys() != reference.keys():
        return f"other files: {sorted(here.keys() ^ reference.keys())}"
    return ", ".join(f"{name} differs" for name in here if here[name] != reference[name])


def half_written(folder):
    """Files that are not whole."""
    if not folder.is_dir():
        return ""
    for file in folder.iterdir():
        try:
            if file.suffix == ".json":
                text = file.read_text()
                json.loads(re.sub(r"^\s*//.*$", "", text, flags=re.M))
            elif file.suffix == ".csv" and not file.read_text().endswith("\n"):
                return f"{file.name} is half-written"
        except ValueError as error:
            return f"{file.name} is half-written: {error}"
    return ""


def status(folder):
    try:
        return json.loads((folder / "result.json").read_text())["status"]
    except (OSError, ValueError, KeyError):
        return "none"


def starts_in(folder):
    """The finished starts that a journal holds, whole lines only."""
    try:
        text = (folder / "journal.jsonl").read_text(errors="replace")
    except OSError:
        return {}
    lines = [line for line in text.split("\n")[:-1] if line.startswith('{"start":')]
    return {json.loads(line)["start"]["start"]: line for line in lines}


def in_words(ended, codes=(0, 1, 2)):
    """What is wrong with how a command that met a fault has ended."""
    if ended.hung:
        return "it hangs"
    if ended.code < 0:
        return f"ended by {signal.Signals(-ended.code).name}: {ended.err[-300:]}"
    if ended.code not in codes:
        return f"exit code {ended.code}: {ended.err[-300:]}"
    if ended.code != 0 and not ended.err.strip():
        return f"exit code {ended.code} without a word"
    found = [words for words in LIBRARY_WORDS if words in ended.err]
    return f"says '{found[0]}': {ended.err[-300:]}" if found else ""


class Campaign:
    def __init__(self, arguments, site):
        self.a, self.site, self.trials = arguments, site, Trials()
        self.random = random.Random(arguments.seed)
        self.reference, self.seconds, self.journal = {}, {}, {}
        for name, command in ALL.items():
            folder = site.folder()
            begin = time.monotonic()
            ended = site.run(command, folder)
            self.seconds[name] = time.monotonic() - begin
            if ended.code != 0:
                sys.exit(f"{name}, undisturbed: exit code {ended.code}: {ended.err}")
            self.reference[name] = content(folder / "out")
            if name in LONG:
                self.journal[name] = (folder / "out/journal.jsonl").read_bytes()
            shutil.rmtree(folder)

    def heal(self, name, folder):
        """Goes on without a fault, and says what then differs from the undisturbed run."""
        out = folder / "out"
        before = starts_in(out)
        if name in LONG and (out / "journal.jsonl").exists():
            ended = self.site.run(["resume", "out"], folder)
        else:
            ended = self.site.run(ALL[name], folder)
        if ended.code != 0 or ended.hung:
            return f"afterwards exit code {ended.code}: {ended.err[-300:]}"
        after = starts_in(out)
        if any(after.get(start) != line for start, line in before.items()):
            return "a finished start is lost"
        return difference(out, self.reference[name], name in MEASURED)

    def trial(self, what, name, attempt, codes=(0, 1, 2), ended_by_itself=True, but_for=()):
        """attempt(folder) runs the command under a fault."""
        folder = self.site.folder()
        ended = attempt(folder)
        complaint = in_words(ended, codes) or half_written(folder / "out")
        if not complaint and ended_by_itself and status(folder / "out") == "running":
            complaint = f"exit code {ended.code}, but the status stays 'running': {ended.err[-300:]}"
        if not complaint and ended.code == 0:
            complaint = difference(folder / "out", self.reference[name], name in MEASURED, but_for)
        complaint = complaint or self.heal(name, folder)
        self.trials.add(f"{what}, {name}", complaint)
        if complaint and self.a.keep:
            print(f"          {folder}")
        else:
            shutil.rmtree(folder)
        return ended

    def some(self, all_of_them, count):
        """All, or so many of them in the short form."""
        return self.random.sample(all_of_them, min(count, len(all_of_them))) if self.a.short else all_of_them

    # Standard streams

    def streams(self):
        cases = [(name, closed) for name in ALL for closed in range(1, 8)]
        for name, closed in self.some(cases, 6):

            def close(closed=closed):
                for stream in range(3):
                    if closed & 1 << stream:
                        os.close(stream)

            self.trial(f"closed streams {closed:03b}", name,
                       lambda folder: self.site.run(ALL[name], folder, stdout=None, stderr=None, preexec_fn=close)
                       if closed == 7 else self.site.run(ALL[name], folder, preexec_fn=close), codes=(0,))
        with open("/dev/full", "wb") as full:
            for name in self.some(list(ALL), 2):
                ended = self.trial("full standard error", name,
                                   lambda folder: self.site.run(ALL[name], folder, stderr=full), codes=(0,))
            for name in self.some([*ALL, "schema", "--help", "--version"], 4):
                folder = self.site.folder()
                ended = self.site.run(ALL.get(name, [name]), folder, stdout=full)
                complaint = in_words(ended, codes=(1,))
                if not complaint and name in ALL:
                    complaint = difference(folder / "out", self.reference[name], name in MEASURED)
                self.trials.add(f"full standard output, {name}", complaint)
                shutil.rmtree(folder)

    # Calls that fail

    def calls(self):
        faults = [("write", errno.ENOSPC, 0), ("write", errno.EIO, 0), ("write", errno.EINTR, 1), ("write", 0, 0),
                  ("read", errno.EIO, 0), ("read", errno.EINTR, 1), ("read", 0, 3), ("create", errno.ENOSPC, 0),
                  ("create", errno.EMFILE, 1), ("open", errno.EMFILE, 1), ("fsync", errno.EIO, 0), ("fdatasync", errno.EIO, 0),
                  ("rename", errno.EACCES, 0), ("fork", errno.EAGAIN, 1), ("fork", errno.EAGAIN, 0),
                  ("pipe2", errno.EMFILE, 1), ("pipe2", errno.EMFILE, 0)]
        cases = [(name, *fault) for name in ALL for fault in faults]
        for name, call, why, count in self.some(cases, 8):
            harmless = why in (0, errno.EINTR)
            first = 1
            while self.one_call(name, call, why, count, first, harmless):
                # Every early call; later ones of a long run are alike.
                first += 1 if first < 12 else math.ceil(first / 4)
                if self.a.short:
                    first += self.random.randrange(12)

    def one_call(self, name, call, why, count, first, harmless):
        log = self.site.top / "failed_calls"
        log.unlink(missing_ok=True)
        environment = {**os.environ, "LD_PRELOAD": self.a.fail_calls, "FAIL_CALL": call, "FAIL_FROM": str(first),
                       "FAIL_COUNT": str(count), "FAIL_ERRNO": str(why), "FAIL_LOG": str(log)}
        words = f"{call} {first}{'...' if count == 0 else ''} {errno.errorcode.get(why, 'cut short')}"
        self.trial(words, name, lambda folder: self.site.run(ALL[name], folder, env=environment),
                   codes=(0,) if harmless else (0, 1, 2))
        return log.exists()

    # Limits of the system

    def limits(self):
        def limited(which, amount, user=None):
            def apply():
                resource.setrlimit(which, (amount, amount))
                if user is not None:
                    os.setgroups([])
                    os.setgid(user)
                    os.setuid(user)
            return apply

        sizes = [0, 1, 100, 700, 1500, 2500, 3500, 5000, 9000, 20000]
        cases = [("file size", resource.RLIMIT_FSIZE, n) for n in sizes]
        megabytes = (20, 40, 60, 80, 100, 120, 140, 160, 180, 200, 240, 280, 320, 400)
        # Sanitizers, with which fail_calls is left out, need terabytes of addresses, and pipes to look at an object.
        if self.a.fail_calls:
            cases += [("descriptors", resource.RLIMIT_NOFILE, n) for n in (3, 4, 5, 6, 7, 8, 10, 12)]
            cases += [("memory", resource.RLIMIT_AS, n << 20) for n in megabytes]
        for name, (what, which, amount) in self.some([(n, c) for n in ALL for c in cases], 12):
            # The loader says with 127 that it finds no room for the libraries.
            self.trial(f"{what} {amount}", name,
                       lambda folder: self.site.run(ALL[name], folder, preexec_fn=limited(which, amount)),
                       codes=(0, 1, 2, 127), ended_by_itself=what != "memory")
        if os.geteuid() == 0:
            for name, most in self.some([(name, most) for name in LONG for most in (1, 2, 3)], 2):
                self.trial(f"processes {most}", name,
                           lambda folder: self.as_nobody(name, folder, limited(resource.RLIMIT_NPROC, most, NOBODY)))
            for name in self.some(list(ALL), 2):
                self.trial("read-only folder", name, lambda folder: self.read_only(name, folder, limited), codes=(1, 2))
        for name in self.some(list(LONG), 1):
            # The outcome is written to a new folder, with a warning. A journal goes with the old one.
            self.trial("vanishing folder", name, lambda folder: self.vanishing(name, folder),
                       but_for=["journal.jsonl", "result.json", "report.html"])
            self.trial("folder that another run holds", name, lambda folder: self.taken(name, folder))

    def as_nobody(self, name, folder, apply):
        os.chmod(self.site.top, 0o755)
        os.chown(folder, NOBODY, NOBODY)
        ended = self.site.run(ALL[name], folder, preexec_fn=apply)
        return ended

    def read_only(self, name, folder, limited):
        os.chmod(self.site.top, 0o755)
        (folder / "out").mkdir(mode=0o555)
        return self.site.run(ALL[name], folder,
                             preexec_fn=limited(resource.RLIMIT_CORE, 0, NOBODY))

    def vanishing(self, name, folder):
        process = self.site.start(ALL[name], folder)
        for _ in range(2000):
            if (folder / "out/journal.jsonl").exists() or process.poll() is not None:
                break
            time.sleep(0.002)
        shutil.rmtree(folder / "out", ignore_errors=True)
        return self.site.wait(process)

    def taken(self, name, folder):
        process = self.site.start(ALL[name], folder)
        while not (folder / "out/journal.jsonl").exists() and process.poll() is None:
            time.sleep(0.002)
        os.kill(process.pid, signal.SIGSTOP)
        second, third = self.site.run(ALL[name], folder), self.site.run(["resume", "out"], folder)
        os.kill(process.pid, signal.SIGCONT)
        first = self.site.wait(process)
        for other in (second, third):
            if other.code != 2 or "another mbsopt" not in other.err:
                return Ended(99, other.out, f"a second run is not refused: {other.err}", other.hung)
        return first

    # Journals

    def journals(self):
        for number in range(self.a.journals):
            name = self.random.choice(list(LONG))
            self.damaged(number, name)

    def damaged(self, number, name):
        lines = self.journal[name].splitlines(keepends=True)
        lines = [line for line in lines if not line.startswith(b'{"ended"')]
        lines = lines[: self.random.randint(1, len(lines))]
        text = b"".join(lines)
        kind = self.random.choice(["bit", "digit", "cut", "remove", "swap", "repeat", "other run", "zeros", "insert", "edit"])
        at = self.random.randrange(len(text))
        if kind == "bit":
            text = text[:at] + bytes([text[at] ^ 1 << self.random.randrange(8)]) + text[at + 1:]
        elif kind == "digit":
            digits = [i for i, byte in enumerate(text) if chr(byte).isdigit()]
            at = self.random.choice(digits)
            other = self.random.choice([d for d in b"0123456789" if d != text[at]])
            text = text[:at] + bytes([other]) + text[at + 1:]
        elif kind == "cut":
            text = text[:at]
        elif kind == "zeros":
            text = text[:at] + bytes(self.random.randrange(1, 5000))
        elif kind == "insert":
            text = text[:at] + self.random.randbytes(self.random.randrange(1, 20)) + text[at:]
        elif kind == "edit":
            words = [(b'"objective":', b'"objective":1'), (b'"cost":', b'"cost":1'), (b"null", b"0"),
                     (b'"iteration":', b'"iteration":1'), (b"converged", b"stopped"), (b"[]", b"[[]]"),
                     (b'"parameters":{', b'"parameters":{"a":1,')]
            fitting = [pair for pair in words if pair[0] in text] or [(b"{", b"[")]
            text = text.replace(*self.random.choice(fitting), 1)
        else:
            i, j = self.random.randrange(len(lines)), self.random.randrange(len(lines))
            if kind == "remove":
                del lines[i]
            elif kind == "swap":
                lines[i], lines[j] = lines[j], lines[i]
            elif kind == "repeat":
                lines.insert(j, lines[i])
            else:
                others = self.journal[self.random.choice(list(LONG))].splitlines(keepends=True)
                lines.insert(j + 1, self.random.choice(others[1:]))
            text = b"".join(lines)
        folder = self.site.folder()
        (folder / "out").mkdir()
        running = json.loads(self.reference[name]["result.json"])
        (folder / "out/result.json").write_text(json.dumps({**running, "status": "running"}))
        (folder / "out/journal.jsonl").write_bytes(text)
        ended = self.site.run(["resume", "out"], folder)
        complaint = in_words(ended, codes=(0, 2))
        if not complaint and ended.code == 2 and "journal.jsonl" not in ended.err:
            complaint = f"refused without the journal's name: {ended.err}"
        if not complaint and ended.code == 0:
            complaint = difference(folder / "out", self.reference[name], False)
        self.trials.add(f"journal {number} ({kind} at {at}), {name}", complaint)
        if not complaint or not self.a.keep:
            shutil.rmtree(folder)

    # Signals

    def kills(self):
        for name in ALL:
            for number in range(self.a.kills):
                self.kill(name, number)

    def kill(self, name, number):
        folder = self.site.folder()
        process = self.site.start(ALL[name], folder)
        listens, sent = self.signals(process, self.random.uniform(0, 1.1 * self.seconds[name]), folder)
        complaint = self.after_signals(self.site.wait(process), listens, sent, folder)
        resumed_under_fire = ""
        if not complaint and name in LONG and (folder / "out/journal.jsonl").exists() and self.random.random() < 0.3:
            before = starts_in(folder / "out")
            process = self.site.start(["resume", "out"], folder)
            _, again = self.signals(process, self.random.uniform(0, self.seconds[name]), folder)
            complaint = self.after_signals(self.site.wait(process), False, again, folder)
            resumed_under_fire = f", then {again}"
            if not complaint and any(starts_in(folder / "out").get(s) != line for s, line in before.items()):
                complaint = "resume has lost a finished start"
        complaint = complaint or self.heal(name, folder)
        self.trials.add(f"kill {number} ({sent}{resumed_under_fire}), {name}", complaint)
        if complaint and self.a.keep:
            print(f"          {folder}")
        else:
            shutil.rmtree(folder)

    def signals(self, process, moment, folder):
        """One to three signals, to the process or to its group: whether a new run listened to them, and which ones."""
        time.sleep(moment)
        listens, sent = (folder / "out/journal.jsonl").exists(), []
        for _ in range(self.random.choice((1, 1, 1, 2, 2, 3))):
            which = self.random.choice((signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGPIPE, signal.SIGKILL))
            to_group = self.random.random() < 0.5
            try:
                os.killpg(process.pid, which) if to_group else os.kill(process.pid, which)
            except ProcessLookupError:
                break
            sent.append(f"{which.name}{' to the group' if to_group else ''}")
            time.sleep(self.random.choice((0, 0, 0.01, 0.1)))
        return listens and "SIGKILL" not in " ".join(sent), " ".join(sent)

    def after_signals(self, ended, listens, sent, folder):
        if ended.hung:
            return "it hangs"
        if ended.code < 0 and signal.Signals(-ended.code).name not in sent:
            return f"ended by {signal.Signals(-ended.code).name}: {ended.err[-300:]}"
        # All came within a second, which is one; but the program no longer listens when all is written.
        if ended.code < 0 and listens and status(folder / "out") == "running":
            return f"ended at once by {signal.Signals(-ended.code).name}"
        if ended.code > 0 and ended.code not in (1, 130):
            return f"exit code {ended.code}: {ended.err[-300:]}"
        if ended.code >= 0 and status(folder / "out") == "running":
            return f"exit code {ended.code}, but the status stays 'running'"
        return half_written(folder / "out")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("fail_calls", help="library of failing calls; '' leaves them out")
    parser.add_argument("--kills", type=int, default=200, help="per command")
    parser.add_argument("--journals", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=("streams", "calls", "limits", "journals", "kills"), action="append")
    parser.add_argument("--short", action="store_true", help="a sample of all, below a minute")
    parser.add_argument("--keep", action="store_true", help="keep the folders of trials that do not hold")
    arguments = parser.parse_args()
    arguments.program = os.path.abspath(arguments.program)
    arguments.fail_calls = os.path.abspath(arguments.fail_calls) if arguments.fail_calls else ""
    if arguments.short:
        arguments.kills, arguments.journals = 1, 12
    top = tempfile.mkdtemp(prefix="mbsopt_faults_")
    try:
        campaign = Campaign(arguments, Site(arguments.program, top))
        parts = arguments.only or ["streams", "calls", "limits", "journals", "kills"]
        for part in parts:
            if part == "calls" and not arguments.fail_calls:
                continue
            begin, tried = time.monotonic(), campaign.trials.tried
            getattr(campaign, part)()
            print(f"{part}: {campaign.trials.tried - tried} in {time.monotonic() - begin:.0f} s", flush=True)
        print(f"{campaign.trials.tried} tried, {campaign.trials.held} held")
        return campaign.trials.tried != campaign.trials.held
    finally:
        if not arguments.keep:
            shutil.rmtree(top, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main())
