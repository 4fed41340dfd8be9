"""Runs commands of mbsopt on a scene, as users do, and looks at what every run owes: an end, an exit code, numbers and
words."""

import csv
import json
import os
import re
import signal
import subprocess
import time
from pathlib import Path

HANG = 8.0  # [s] of processor time without an end
STUCK = 60.0  # [s] without an end, whatever the processor did
NUMBERLESS = re.compile(r"(?<![A-Za-z_])[-+]?(nan|inf)(?![A-Za-z_])", re.IGNORECASE)
PROGRESS = re.compile(r"^.*: \S+ % after \d+ s(?:, \d+ s left)?$", re.MULTILINE)
CLUMSY = re.compile(r"\S  \S|''|std::|terminate called|0x[0-9a-f]{6,}|\be\+308")


class Outcome:
    def __init__(self, command, code, out, err, folder):
        self.command, self.code, self.out, self.err, self.folder = command, code, out, err, folder
        self.complaints = []  # (kind, words)
        self.interrupted = False
        self.slow = []  # its words of progress, where it was stopped because it took long
        self.result = self.read_result()

    def complain(self, kind, words):
        self.complaints.append((kind, f"{self.command}: {words}"))

    def read_result(self):
        def no_number(name):
            self.complain("no number", f"result.json holds {name}")

        try:
            return json.loads((self.folder / "result.json").read_text(), parse_constant=no_number)
        except FileNotFoundError:
            return {}
        except ValueError as error:
            self.complain("result", f"result.json cannot be read: {error}")
            return {}

    @property
    def ok(self):
        return self.code == 0

    @property
    def warnings(self):
        return self.result.get("warnings", [])

    @property
    def message(self):
        return self.result.get("message", "") or self.err.strip()

    def value(self, objective):
        return self.result["objectives"][objective]["value"]

    def gradient(self, objective):
        return self.result["objectives"][objective]["gradient"]

    def trajectory(self):
        """Columns by name."""
        with open(self.folder / "trajectory.csv", newline="") as file:
            rows = list(csv.reader(file))
        return {name: [float(row[k]) for row in rows[1:]] for k, name in enumerate(rows[0])}

    def look(self):
        """What is wrong with any run, whatever it computes."""
        if self.interrupted and self.code == -signal.SIGINT and not (self.folder / "journal.jsonl").exists():
            return  # it had not begun
        if self.code < 0:
            self.complain("signal", f"died by signal {-self.code} ({signal.Signals(-self.code).name})")
            return
        if self.code not in (0, 1, 2, 3, *((130,) if self.interrupted else ())):
            self.complain("exit code", f"ended with {self.code}")
        if self.code == 0:
            self.look_at_numbers(self.result.get("objectives"), "objectives")
            self.look_at_numbers(self.result.get("simulation"), "simulation")
            if self.result.get("status") != "ok":
                self.complain("result", f"exit code 0, status {self.result.get('status')!r}")
        elif (self.code != 3 and not self.err.strip()) or (self.code == 1 and not self.result.get("message")):
            self.complain("silence", f"exit code {self.code} without words")
        for text, where in ((self.out, "standard output"), (self.err, "standard error")):
            if NUMBERLESS.search(text):
                self.complain("no number", f"{where}: {line_of(NUMBERLESS, text)}")
        sentences = [line for line in self.err.splitlines() if "   " not in line]  # not of iterations
        for text in sentences + self.warnings:
            if CLUMSY.search(text):
                self.complain("words", text.strip()[:300])
        path = self.folder / "trajectory.csv"
        if self.command.startswith(("simulate", "kinematics")) and self.code == 0:
            text = path.read_text() if path.exists() else "nan"
            if NUMBERLESS.search(text):
                self.complain("no number", f"trajectory.csv: {line_of(NUMBERLESS, text)[:200]}")

    def look_at_numbers(self, node, path):
        if node is None:
            return
        for key, value in node.items():
            if isinstance(value, dict):
                self.look_at_numbers(value, f"{path}.{key}")
            elif value is None:
                self.complain("no number", f"result.json: {path}.{key} is null")


def line_of(pattern, text):
    return next(line for line in text.splitlines() if pattern.search(line)).strip()


class Program:
    """The built program; how patient to be with it."""

    def __init__(self, path, patience=1.0):
        self.path, self.patience = str(path), patience

    def run(self, command, file, folder, settings=(), arguments=(), patience=1.0, interrupt=None):
        """interrupt: after so many seconds the run gets a signal, as by Ctrl-C. Without a folder it resumes `file`."""
        line = [self.path, command, str(file), *(("--out", str(folder)) if folder else ()), *arguments]
        for path, value in dict(settings).items():
            line += ["--set", f"{path}={value if isinstance(value, str) else json.dumps(value)}"]
        for left in ("result.json", "trajectory.csv") if folder else ():
            (Path(folder) / left).unlink(missing_ok=True)
        folder = Path(folder or file)
        patience *= self.patience
        start, told = time.monotonic(), command + "".join(" " + word for word in line[5:])
        process = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL)
        hung, was_interrupted = False, interrupt is not None
        while True:
            try:
                out, err = process.communicate(timeout=interrupt or HANG)
                break
            except subprocess.TimeoutExpired:
                if interrupt:
                    process.send_signal(signal.SIGINT)
                    interrupt = None
                    continue
                waited = time.monotonic() - start
                if processor_seconds(process.pid) < HANG * patience and waited < STUCK * patience:
                    continue
                if hung:  # it was asked to end, and did not
                    process.kill()
                hung = True
                process.send_signal(signal.SIGTERM)
        outcome = Outcome(told, process.returncode, out.decode(errors="replace"), err.decode(errors="replace"), folder)
        outcome.seconds = time.monotonic() - start
        if hung:
            outcome.code = 130
            outcome.slow = PROGRESS.findall(outcome.err)
            if not outcome.slow:
                outcome.complain("hang", f"no end and no word within {HANG:g} s: {outcome.message[-200:]}")
        else:
            outcome.interrupted = was_interrupted
            outcome.look()
        return outcome


def processor_seconds(pid):
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    except (OSError, IndexError):
        return 0.0
