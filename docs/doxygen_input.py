#!/usr/bin/env python3
"""Writes the headers of an installed mbsopt as Doxygen reads them, and docs/library.md as their first page:

    docs/doxygen_input.py PREFIX/include/mbsopt FOLDER

A comment above a declaration becomes "///", one behind it "///<". The comment at the head of a file describes the file,
and the class that has the file's name. Indented lines of a comment keep their columns.
"""

import re
import sys
from pathlib import Path

COMMENT = re.compile(r"^( *)// ?(.*)$")
TRAILING = re.compile(r"^( *[^ /#}].*?)  // (.*)$")
CLASS = re.compile(r"^(?:class|struct) (\w+).*\{$")


def escaped(text):
    """Text without what Doxygen reads as commands. It reads none between quotes and back quotes."""
    parts = re.split(r"""(`[^`]*`|"[^"]*")""", text)
    parts[::2] = [re.sub(r"([\\@<>#&|])", r"\\\1", part) for part in parts[::2]]
    return "".join(parts)


def as_block(lines):
    """Indented lines: C++ where they have statements, else formulas."""
    while not lines[-1]:
        lines.pop()
    is_code = any(re.search(r"[;{}]( *//.*)?$", line) for line in lines)
    return ["@code{.cpp}" if is_code else "@code{.unparsed}", *lines, "@endcode"]


def described(lines, indent=""):
    """The text of a comment as a comment of Doxygen."""
    out, block = [], []
    for line in [*lines, None]:
        if line is not None and (line.startswith("  ") or (block and not line)):
            block.append(line)
            continue
        out += as_block(block) if block else []
        out += [] if line is None else [escaped(line)]
        block = []
    return [f"{indent}/// {line}" for line in out]


def header(lines, stem, is_public):
    """The lines of a header for Doxygen."""
    at = lines.index("#pragma once")
    head = described([COMMENT.match(line)[2] for line in lines[:at]])
    yield from ["/// @file", *head, *(["///", f"/// `#include <mbsopt/{stem}.hpp>`"] if is_public else [])]
    column = None  # of a comment behind code that the next line may go on with
    while at < len(lines):
        line, at = lines[at], at + 1
        comment, trailing, of_class = COMMENT.match(line), TRAILING.match(line), CLASS.match(line)
        if of_class and re.sub(r"(?<!^)(?=[A-Z])", "_", of_class[1]).lower() == stem:
            yield from head
        if comment and len(comment[1]) == column:
            yield f"{comment[1]}///< {escaped(comment[2])}"
        elif comment:
            block = [comment[2]]
            while more := COMMENT.match(lines[at]):
                block.append(more[2])
                at += 1
            yield from described(block, comment[1])
        elif trailing and trailing[1].endswith("{"):
            yield from [f"/// {escaped(trailing[2])}", trailing[1]]
        elif trailing:
            column = len(trailing[1]) + 2
            yield f"{trailing[1]}  ///< {escaped(trailing[2])}"
        else:
            column = None
            yield line


def main():
    include, folder = Path(sys.argv[1]), Path(sys.argv[2])
    for path in sorted((include / "detail").rglob("*.hpp")):
        to = folder / path.relative_to(include / "detail")
        to.parent.mkdir(parents=True, exist_ok=True)
        is_public = (include / path.name).exists()
        to.write_text("\n".join(header(path.read_text().splitlines(), path.stem, is_public)) + "\n")
    page = (Path(__file__).parent / "library.md").read_text().replace("```c++", "```cpp")
    (folder / "library.md").write_text(re.sub(r"\[([^]]*)\]\((?!https?:)[^)]*\)", r"\1", page))  # links become text


if __name__ == "__main__":
    main()
