#!/usr/bin/env python3
"""Writes the C++ examples of the docs as one source, so that the tests' build compiles them:

    tests/docs/examples.py OUTPUT PAGE...

Each ```cpp block becomes a function with the names of tests/docs/given.hpp. A block with main() keeps its own scope.
"""

import re
import sys
from pathlib import Path


def main():
    includes, functions = set(), []
    for page in map(Path, sys.argv[2:]):
        text = page.read_text()
        for block in re.finditer(r"^```cpp\n(.*?)^```", text, re.M | re.S):
            lines = block[1].splitlines()
            includes.update(line for line in lines if line.startswith("#include"))
            line = text[: block.start()].count("\n") + 2
            code = "\n".join("" if l.startswith("#include") else l for l in lines)
            place = f'#line {line} "{page.resolve().as_posix()}"'
            name = f"{page.stem.replace('-', '_')}_{line}"
            if "int main()" in code:
                functions.append(f"{place}\n{code.replace('int main()', f'int {name}()')}\n")
            else:
                functions.append(f"void {name}(const Given& given) {{\n  UNPACK(given)\n  {{\n{place}\n{code}\n  }}\n}}\n")
    if not functions:
        sys.exit("no example found")
    Path(sys.argv[1]).write_text("\n".join(sorted(includes)) + '\n#include "tests/docs/given.hpp"\n\n' + "\n".join(functions))


if __name__ == "__main__":
    main()
