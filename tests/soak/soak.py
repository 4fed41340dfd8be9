#!/usr/bin/env python3
"""Random scenes: builds one from each seed, runs the program on it as users do, and asks whether all that must agree
does.

    tests/soak/soak.py COUNT [--from SEED] [--program FILE] [--jobs N] [--keep FOLDER]
    tests/soak/soak.py --replay FILE...          a kept scene again, all checks

A scene that fails is shrunk, as long as it fails the same way, and kept as FOLDER/SEED.json. The last line is
`N tried, N held`; exit code 1 where they differ. docs/campaigns.md tells what is asked. Needs nothing but Python 3.
"""

import argparse
import multiprocessing
import os
import sys
import tempfile
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import checks
import oracle
from generator import random_scene
from lab import Lab
from program import Program
from scene import load
from shrink import shrunk

ROOT = Path(__file__).resolve().parents[2]
# Each check, and of how many scenes one is asked.
CHECKS = [(checks.sweeps, 1), (checks.plane, 1), (checks.energy, 1), (checks.kinematics, 1), (checks.equilibrium, 1),
          (checks.integrators, 2), (checks.differences, 2), (checks.tilt, 2), (checks.rounded, 2), (checks.order, 4),
          (checks.again, 20), (checks.brief, 1), (checks.loose_bounds, 20), (checks.interrupted, 25),
          (checks.own_check, 15), (checks.other_commands, 10), (oracle.agrees, 50)]


def examine(scene, program, chosen, folder):
    """The failures of a scene as (kind, words), by check, and what may be told of it: whether it was refused, and what
    explained its disagreements."""
    lab = Lab(scene, program, folder)
    try:
        base = lab.run("simulate")
        failures, seen = {checks.ends: lab.complaints()}, len(lab.complaints())
        for check in chosen:
            if base.ok or check in (checks.sweeps, checks.other_commands):
                found = check(lab)
                failures[check] = lab.complaints()[seen:] + (found if base.ok else [])
                seen = len(lab.complaints())
        told = {"refused": "" if base.ok else f"{base.code}: {base.message}", "explained": lab.explained,
                "slow": [f"{run.command}: {run.slow[-1]}" for run in lab.outcomes.values() if run.slow]}
        return {check: found for check, found in failures.items() if found}, told
    finally:
        lab.close()


def try_seed(job):
    seed, options = job
    program = Program(options.program, options.patience)
    chosen = [check for k, (check, every) in enumerate(CHECKS) if (seed + k) % every == 0]
    with tempfile.TemporaryDirectory(prefix="soak_", dir=options.scratch) as folder:
        scene = random_scene(seed)
        failures, told = examine(scene, program, chosen, Path(folder) / "whole")
        if failures and not options.whole:
            check, found = next(iter(failures.items()))

            def kinds(candidate):
                again = examine(candidate, program, [check], Path(folder) / "part")[0]
                return {kind for kind, _ in again.get(check, [])}
            scene = shrunk(scene, found[0][0], kinds, options.patience)
        if failures:
            scene.save(options.keep / f"{seed}.json")
    return seed, scene.about, [failure for found in failures.values() for failure in found], told


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("count", type=int, nargs="?", default=5000, help="scenes")
    parser.add_argument("--from", dest="first", type=int, default=1, metavar="SEED")
    parser.add_argument("--program", default=ROOT / "build/release/mbsopt", type=Path)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--keep", default=ROOT / "out/soak", type=Path, metavar="FOLDER")
    parser.add_argument("--whole", action="store_true", help="keep failing scenes as they are")
    parser.add_argument("--patience", type=float, default=1.0, help="times 8 s is how long a run may take")
    parser.add_argument("--replay", nargs="+", type=Path, metavar="FILE")
    options = parser.parse_args()
    options.scratch = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    if not options.program.exists():
        parser.error(f"there is no {options.program}: build it first")
    return options


def say(failures, name, about):
    for kind, words in failures:
        print(f"{name} ({about}): {kind}: {words}", flush=True)


def replay(options):
    held = 0
    for file in options.replay:
        with tempfile.TemporaryDirectory(prefix="soak_", dir=options.scratch) as folder:
            scene = load(file)
            program = Program(options.program, options.patience)
            by_check, told = examine(scene, program, [check for check, _ in CHECKS], folder)
            failures = [failure for found in by_check.values() for failure in found]
            say(failures, file, scene.about)
            if told["refused"]:
                print(f"{file}: refused, {told['refused']}")
            held += not failures
    return len(options.replay), held


def campaign(options):
    held, refused, explained, slow = 0, Counter(), Counter(), Counter()
    if oracle.missing():
        print(f"without the second solver: {oracle.missing()}")
    seeds = range(options.first, options.first + options.count)
    with multiprocessing.Pool(options.jobs) as pool:
        done = pool.imap_unordered(try_seed, [(seed, options) for seed in seeds])
        for k, (seed, about, failures, told) in enumerate(done, 1):
            held += not failures
            say(failures, f"seed {seed}", about.split(": ", 1)[-1])
            refused[told["refused"][:90]] += bool(told["refused"])
            explained.update({words[:90] for words in told["explained"]})
            slow.update(words[:90] for words in told["slow"])
            if k % 100 == 0:
                print(f"{k} of {options.count} tried, {held} held", file=sys.stderr, flush=True)
    for title, counter in (("refused in words", +refused), ("disagreements that a warning explains", explained),
                           ("runs of more than 8 s that say how far they are", slow)):
        print(f"{title}: {sum(counter.values())}")
        for words, count in counter.most_common(12):
            print(f"  {count} x {words}")
    return options.count, held


if __name__ == "__main__":
    given = arguments()
    tried, held = replay(given) if given.replay else campaign(given)
    print(f"{tried} tried, {held} held")
    sys.exit(tried != held)
