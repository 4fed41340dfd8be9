#!/usr/bin/env python3
"""Prints what docs/architecture.md promises, measured: lines, types and files of each folder, and which includes break
the order of its table. Exit code 1 where one does, where files include each other in a circle, where a file is not in
the namespace of its folder, or where a page or a comment names a file that does not exist.

    docs/architecture.py              run from anywhere; needs Python 3 alone
    docs/architecture.py --sample N   100 comments of the sources at random, by the seed N: is each clear alone?
"""

import random
import re
import sys
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
INCLUDE = re.compile(r'^#include "((?:core|optim|app)/[^"]+)"', re.M)
TYPE = re.compile(r"^ *(?:template *<.*> *)?(?:struct|class|enum class) +(\w+)(?: final)?(?: *:[^:;]*)?(?: *:[^:;].*)? *\{", re.M)

# A path as pages and comments write it; some leave the ending out, and some stand for several files.
PATH = re.compile(r"(?<![\w/.])(?:core|optim|app|tests|bench|docs|problems|data|examples|cmake)/"
                  r"[\w./-]*\w(?![\w{*-]|/?[{*])")
NAMESPACE = re.compile(r"^namespace (mbsopt[\w:]*(?: \w+)?) \{", re.M)
NAMESPACES = {"core": "mbsopt", "optim": "mbsopt::inline optim", "app": "mbsopt::inline app"}
ENDINGS = ("", ".hpp", ".cpp", ".md", ".py", ".json")


def folders_in_order():
    """The folders of the table, lowest first."""
    rows = re.findall(r"^\| `((?:core|optim|app)/[\w/]*)` \|", (ROOT / "docs/architecture.md").read_text(), re.M)
    return [row.rstrip("/") for row in rows]


def circles(includes):
    """The strongly connected sets of more than one file (Tarjan, SIAM J. Comput. 1, 1972)."""
    index, low, stack, found = {}, {}, [], []

    def visit(file):
        index[file] = low[file] = len(index)
        stack.append(file)
        for other in includes[file]:
            if other not in index:
                visit(other)
                low[file] = min(low[file], low[other])
            elif other in stack:
                low[file] = min(low[file], index[other])
        if low[file] == index[file]:
            members = []
            while not members or members[-1] != file:
                members.append(stack.pop())
            if len(members) > 1:
                found.append(sorted(members))

    sys.setrecursionlimit(10000)
    for file in list(includes):
        if file not in index:
            visit(file)
    return found


def stale_names():
    """The paths that pages and sources name, and that do not exist."""
    pages = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md"))]
    tops = ("core", "optim", "app", "tests", "bench")
    sources = [path for top in tops for path in sorted((ROOT / top).rglob("*.[ch]pp"))]
    for page in pages + sources:
        for path in sorted(set(PATH.findall(page.read_text()))):
            if "NAME" not in path and not any((ROOT / (path + ending)).exists() for ending in ENDINGS):
                yield f"{page.relative_to(ROOT)} names {path}, which does not exist"


def print_comments(seed):
    comments = []
    for path in [path for top in ("core", "optim", "app") for path in sorted((ROOT / top).rglob("*.[ch]pp"))]:
        text = path.read_text()
        for comment in re.finditer(r"(?:^ *//.*\n)+|^(?!}).*\S +//.*$", text, re.M):
            line = text.count("\n", 0, comment.start()) + 1
            comments.append(f"{path.relative_to(ROOT)}:{line}\n{comment.group().rstrip()}\n")
    print("\n".join(random.Random(seed).sample(comments, 100)))


def main():
    if sys.argv[1:2] == ["--sample"]:
        return print_comments(int(sys.argv[2]))
    order = folders_in_order()
    text = {path.relative_to(ROOT).as_posix(): path.read_text()
            for top in ("core", "optim", "app") for path in sorted((ROOT / top).rglob("*.[ch]pp"))}
    # A header and the source that implements it are one concept, so one node.
    node = lambda file: file.rsplit(".", 1)[0]
    folder = lambda file: file.rsplit("/", 1)[0]
    includes, counts = defaultdict(set), defaultdict(lambda: [0, 0, 0])
    wrong = []
    for file, content in text.items():
        count = counts[folder(file)]
        count[0] += 1
        count[1] += content.count("\n")
        count[2] += len(TYPE.findall(content))
        namespace = NAMESPACES[file.split("/")[0]]
        wrong += [f"{file} is in namespace {other}, not {namespace}"
                  for other in set(NAMESPACE.findall(content)) if not re.fullmatch(namespace + r"(::\w+)?", other)]
        for other in INCLUDE.findall(content):
            if node(other) != node(file):
                includes[node(file)].add(node(other))
            here, there = folder(file), folder(other)
            if here != there and not (here in order and there in order and order.index(there) < order.index(here)):
                wrong.append(f"{file} includes {other}, which the table has below it")
    wrong += ["a circle: " + ", ".join(members) for members in circles(includes)]
    print(f"{'folder':<20}{'files':>6}{'lines':>8}{'types':>7}")
    for name in sorted(counts, key=lambda f: order.index(f) if f in order else len(order)):
        print(f"{name:<20}{counts[name][0]:>6}{counts[name][1]:>8}{counts[name][2]:>7}")
    print(f"{'all':<20}" + "".join(f"{sum(c[k] for c in counts.values()):>{w}}" for k, w in enumerate((6, 8, 7))))
    for top in NAMESPACES:
        print(f"{top:<26}{sum(c[1] for name, c in counts.items() if name.split('/')[0] == top):>8}")
    scripts = sum(path.read_text().count("\n") for ending in ("js", "css", "in")
                  for path in (ROOT / "app").rglob(f"*.{ending}"))
    print(f"{'scripts and styles of app':<26}{scripts:>8}")
    wrong += stale_names()
    well = "no include against the order of docs/architecture.md, no circle, no stale path, no foreign namespace"
    print("\n".join(wrong) if wrong else well)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
