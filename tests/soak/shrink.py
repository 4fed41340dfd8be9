"""Takes away from a failing scene what its failure does not need."""

import re
import time

ENOUGH = 120  # [s] for one scene


def shrunk(scene, kind, kinds_of, patience=1.0):
    """The smallest scene found that still fails in this way; kinds_of gives the ways in which a scene fails."""
    end = time.monotonic() + ENOUGH * patience
    progress = True
    while progress and time.monotonic() < end:
        progress = False
        for change in changes(scene.problem):
            candidate = scene.copy()
            try:
                change(candidate.problem)
                still = candidate.problem != scene.problem and kind in kinds_of(candidate)
            except (KeyError, IndexError, ValueError, TypeError):  # what was left is no scene
                continue
            if still:
                scene, progress = candidate, True
                break
            if time.monotonic() > end:
                break
    used = str(scene.problem.get("drives", [])) + str(scene.problem.get("signals", {}))
    scene.files = {name: text for name, text in scene.files.items() if name in used}
    return scene


def changes(problem):
    """One change each, the largest first."""
    for body in reversed(problem["bodies"]):
        if len(problem["bodies"]) > 1:
            yield lambda p, name=body["name"]: drop_body(p, name)
    for section in ("joints", "drives", "forces"):
        for item in reversed(problem.get(section, [])):
            yield lambda p, section=section, name=item["name"]: drop(p, section, name)
    for section in ("objectives", "sensors"):
        for name in problem.get(section, {}):
            if section == "sensors" or len(problem["objectives"]) > 1:
                yield lambda p, section=section, name=name: drop(p, section, name)
    for name in problem.get("definitions", {}):
        yield lambda p, name=name: write_out(p, "definitions", name)
    for name in problem.get("parameters", {}):
        yield lambda p, name=name: write_out(p, "parameters", name)
    yield lambda p: p.pop("initial")
    for field in ("integrator", "formulation"):
        yield lambda p, field=field: p["simulation"].pop(field)
    yield lambda p: p.update(gravity=[0, 0, 0])
    for k, body in enumerate(problem["bodies"]):
        for field in ("velocity", "angular_velocity", "points", "com"):
            yield lambda p, k=k, field=field: p["bodies"][k].pop(field)
    for k in range(len(problem.get("forces", []))):
        for field in ("damping", "torsional_damping", "actuator", "frame"):
            yield lambda p, k=k, field=field: p["forces"][k].pop(field)
    for digits in (3, 6):
        if any(abs(x - round_to(x, digits)) > 0 for x in numbers(problem)):
            yield lambda p, digits=digits: round_all(p, digits)


def drop(problem, section, name):
    """With all that speaks of it."""
    items = problem[section]
    if isinstance(items, dict):
        del items[name]
    else:
        items[:] = [item for item in items if item["name"] != name]
    key = {"joints": ("joint", "joint1", "joint2"), "forces": ("force",), "drives": ("drive",),
           "sensors": ("sensor",)}.get(section, ())
    for other in ("joints", "drives", "forces"):
        for item in list(problem.get(other, [])):
            measured = section == "sensors" and mentions(item.get("components", []), name)
            if measured or any(item.get(k) == name for k in key):
                drop(problem, other, item["name"])
    for sensor, fields in list(problem.get("sensors", {}).items()):
        if any(fields.get(k) == name for k in key):
            drop(problem, "sensors", sensor)
    if section == "sensors":
        drop_conditions(problem, name)
        for objective, fields in list(problem["objectives"].items()):
            if mentions(fields, name):
                del problem["objectives"][objective]
        if not problem["objectives"]:
            raise KeyError("no objective is left")


def drop_conditions(problem, sensor):
    conditions = problem.get("initial", {}).get("conditions")
    if conditions is not None:
        conditions[:] = [c for c in conditions if c["sensor"] != sensor]


def drop_body(problem, name):
    problem["bodies"] = [body for body in problem["bodies"] if body["name"] != name]
    for section in ("joints", "drives", "forces"):
        for item in list(problem.get(section, [])):
            if name in (item.get("body"), item.get("body1"), item.get("body2")) and item in problem[section]:
                drop(problem, section, item["name"])
    for sensor, fields in list(problem.get("sensors", {}).items()):
        of = (fields.get("body"), fields.get("body1"), fields.get("body2"), fields.get("relative_to", {}).get("body"))
        if name in of and sensor in problem["sensors"]:
            drop(problem, "sensors", sensor)


def mentions(node, name):
    return re.search(rf"\b{re.escape(name)}\b", str(node)) is not None


def write_out(problem, section, name):
    """A parameter by its value, a definition by its expression."""
    item = problem[section].pop(name)
    value = item["value"] if isinstance(item, dict) else item
    if not problem[section]:
        del problem[section]

    def written(node):
        if isinstance(node, dict):
            return {k: written(v) for k, v in node.items()}
        if isinstance(node, list):
            return [written(v) for v in node]
        if isinstance(node, str) and mentions(node, name):
            inside = f"({value})" if isinstance(value, str) else f"({value!r})"
            return plain(re.sub(rf"\b{re.escape(name)}\b", inside, node))
        return node

    for key in ("definitions", "gravity", "bodies", "joints", "drives", "forces", "sensors", "initial", "objectives"):
        if key in problem:
            problem[key] = written(problem[key])


def plain(text):
    """The number that an expression without names is."""
    if re.search(r"[A-Za-z_]", re.sub(r"\d[eE][-+]?\d", "", text).replace("exp", "")):
        return text
    import math
    return float(eval(text.replace("^", "**"), {"__builtins__": {}}, {"exp": math.exp}))


def numbers(node):
    items = node.values() if isinstance(node, dict) else node if isinstance(node, list) else []
    for item in items:
        if isinstance(item, float):
            yield item
        else:
            yield from numbers(item)


def round_to(x, digits):
    return float(f"{x:.{digits}g}")


def round_all(node, digits):
    pairs = list(node.items() if isinstance(node, dict) else enumerate(node))
    for key, item in pairs:
        if key == "orientation" and isinstance(item, list):  # Euler parameters of norm 1
            continue
        if isinstance(item, float):
            node[key] = round_to(item, digits)
        elif isinstance(item, (dict, list)):
            round_all(item, digits)
