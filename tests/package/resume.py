"""A program of a user's own, killed half-way, resumes to the end of the whole run.

    python3 tests/package/resume.py build/.../own_program examples/own_program.json FOLDER
"""

import json
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

STARTS_DONE = 3  # of six, when the run is killed


def outcome(folder):
    """result.json without what says how it was run."""
    def repeatable(value):
        if isinstance(value, dict):
            return {k: repeatable(v) for k, v in value.items() if k != "wall_seconds"}
        return [repeatable(v) for v in value] if isinstance(value, list) else value

    result = repeatable(json.loads((folder / "result.json").read_text()))
    del result["provenance"]
    result["optimizer"].pop("simulations", None)  # of the last process
    return result


def kill_half_way(command, folder):
    process = subprocess.Popen(command)
    journal = folder / "journal.jsonl"
    while process.poll() is None:
        if journal.exists() and journal.read_text().count('\n{"start":') >= STARTS_DONE:
            process.send_signal(signal.SIGKILL)
            break
        time.sleep(0.001)
    if process.wait() != -signal.SIGKILL:
        sys.exit(f"{command[0]} ended before it was killed")
    if '\n{"ended":' in journal.read_text():
        sys.exit(f"{command[0]} was killed after its end")


def main():
    program, problem = sys.argv[1], sys.argv[2]
    work = Path(sys.argv[3])
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    whole, killed = work / "whole", work / "killed"
    design = [program, "design", problem, "--quiet", "--threads", "1", "--out"]
    subprocess.run(design + [str(whole)], check=True, stdout=subprocess.DEVNULL)
    kill_half_way(design + [str(killed)], killed)
    subprocess.run([program, "resume", str(killed), "--quiet"], check=True, stdout=subprocess.DEVNULL)
    if outcome(whole) != outcome(killed):
        sys.exit("the resumed run ends otherwise than the whole one")


if __name__ == "__main__":
    main()
