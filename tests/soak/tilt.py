"""The same scene turned as a whole: nothing of its motion changes but the axes it is told in."""

import copy
import re

from formulas import Formula, literal
from rotations import about, cross, matrix, multiply, rotate

WITH_ANGLE = {"revolute", "cylindrical", "screw"}

ALIKE = {"angle", "rate", "displacement", "distance", "distance_rate", "energy", "force"}
VECTORS = {"position", "velocity", "acceleration", "angular_velocity"}


def combined(row, components):
    """A linear combination of numbers and expressions."""
    if all(isinstance(x, (int, float)) for x in components):
        return sum(c * x for c, x in zip(row, components))
    if any(isinstance(x, Formula) for x in components):
        values, terms = [], []
        for c, x in zip(row, components):
            formula = x if isinstance(x, Formula) else Formula("{}", x)
            terms.append("{}*(" + formula.template + ")")
            values += [c, *formula.values]
        return Formula(" + ".join(terms), *values)
    return " + ".join(f"{literal(c)}*({x if isinstance(x, str) else literal(x)})" for c, x in zip(row, components))


def turned(turn, v):
    return [combined(row, v) for row in matrix(turn)]


def turned_orientation(turn, orientation):
    """None where it is given by an expression that is no list of Euler parameters."""
    if isinstance(orientation, dict):
        angle, axis = orientation.get("angle"), orientation.get("axis")
        if axis is None or any(isinstance(x, str) for x in axis):
            return None
        if isinstance(angle, (int, float)):
            orientation = about(axis, angle)
        else:
            orientation = [f"cos(({angle})/2)"] + [f"{literal(x)}*sin(({angle})/2)" for x in axis]
    a, b, c, d = turn
    rows = [[a, -b, -c, -d], [b, a, -d, c], [c, d, a, -b], [d, -c, b, a]]
    return [combined(row, orientation) for row in rows]


def global_component(fields):
    return fields.get("component") != "norm" and fields.get("frame", "global") == "global"


def invariant(fields):
    """Whether a sensor measures the same in the turned scene."""
    return fields["quantity"] in ALIKE or (fields["quantity"] in VECTORS and not global_component(fields))


def names_in(node):
    if isinstance(node, str):
        return set(re.findall(r"[A-Za-z_]\w*", node))
    if isinstance(node, Formula):
        return set().union(names_in(node.template), *(names_in(v) for v in node.values))
    if isinstance(node, dict):
        node = node.values()
    return set().union(*(names_in(item) for item in node)) if hasattr(node, "__iter__") else set()


def tilted(problem, turn):
    """None where the scene speaks of global axes in a way that cannot be turned."""
    p = copy.deepcopy(problem)
    sensors = p.get("sensors", {})
    changed = {name for name, fields in sensors.items() if not invariant(fields)}
    if any(drive["type"] == "coordinate" for drive in p.get("drives", [])):
        return None
    for force in p.get("forces", []):
        if force["type"] == "bushing" and force.get("body1", "ground") == "ground":
            return None
        if names_in(force.get("components", [])) & changed:
            return None
    if any(c["sensor"] in changed for c in p.get("initial", {}).get("conditions", [])):
        return None
    p["gravity"] = turned(turn, p.get("gravity", [0, 0, -9.81]))
    for body in p["bodies"]:
        orientation = turned_orientation(turn, body.get("orientation", [1, 0, 0, 0]))
        if orientation is None:
            return None
        body["orientation"] = orientation
        for field in ("position", "velocity", "angular_velocity"):
            if field in body:
                body[field] = turned(turn, body[field])
    geared = {joint.get(key) for joint in p.get("joints", []) for key in ("joint1", "joint2")}
    for joint in p.get("joints", []):
        if joint.get("body1", "ground") == "ground" and joint["type"] not in ("gear", "rack_pinion"):
            if joint["type"] in WITH_ANGLE and "normal1" not in joint:
                from_file = joint["name"] in geared or joint["type"] == "screw"  # with normals they count from these
                if from_file or not give_normals(joint):
                    return None
            turn_fields(joint, turn, ("point1", "axis1", "normal1"))
    for item in p.get("forces", []) + p.get("drives", []) + list(sensors.values()):
        if item.get("body1") == "ground" or ("body1" not in item and "body2" in item):
            turn_fields(item, turn, ("point1",))
        if item.get("relative_to", {}).get("body") == "ground":
            turn_fields(item["relative_to"], turn, ("point",))
        if "components" in item and item.get("frame", "global") == "global":
            item["components"] = turned(turn, item["components"])
    return p


def give_normals(joint):
    """What the two bodies use without normals, said: one local direction. Turned, their axes differ."""
    axis = joint["axis1"]
    if any(not isinstance(x, (int, float)) for x in axis + joint["axis2"]):
        return False
    least = min(range(3), key=lambda k: abs(axis[k]))
    joint["normal1"] = cross(axis, [float(k == least) for k in range(3)])
    joint["normal2"] = list(joint["normal1"])
    return True


def turn_fields(item, turn, names):
    for name in names:
        if isinstance(item.get(name), list):
            item[name] = turned(turn, item[name])


def turned_pose(turn, position, orientation):
    return rotate(turn, position), multiply(turn, orientation)
