"""A problem and the data files beside it, as they are written and read."""

import copy
import json
from dataclasses import dataclass, field
from pathlib import Path


@dataclass
class Scene:
    problem: dict
    files: dict = field(default_factory=dict)  # name -> text of a CSV file
    about: str = ""  # a comment line in front

    def copy(self):
        return Scene(copy.deepcopy(self.problem), dict(self.files), self.about)

    def save(self, path):
        path = Path(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        comment = f"// {self.about}\n" if self.about else ""
        path.write_text(comment + json.dumps(self.problem, indent=1) + "\n")
        for name, text in self.files.items():
            (path.parent / name).write_text(text)


def load(path):
    path = Path(path)
    lines = path.read_text().splitlines()
    about = lines[0].removeprefix("//").strip() if lines and lines[0].startswith("//") else ""
    problem = json.loads("\n".join(line for line in lines if not line.lstrip().startswith("//")))
    laws = [drive.get("law") for drive in problem.get("drives", [])]
    names = [law["csv"] for law in laws if isinstance(law, dict)]
    names += [signal["file"] for signal in problem.get("signals", {}).values()]
    return Scene(problem, {name: (path.parent / name).read_text() for name in names}, about)
