"""A seed gives a scene: tree or loops, loads, sensors, objectives, and parameters in fields of every kind."""

import random

from families import draw_family
from formulas import Formula, Parameters, places, resolved
from loads import Loads
from measures import Measures
from mechanism import Mechanism
from rotations import perpendicular, random_direction, times
from scene import Scene
from tilt import tilted

FIXED = {"orientation", "simulation", "sharpness", "time", "axis"}  # an Euler parameter alone has no neighbours


def random_scene(seed):
    rng = random.Random(f"scene {seed}")
    family = draw_family(rng)
    mechanism = Mechanism(rng, family)
    loads = Loads(rng, mechanism, f"{seed}_{{}}.csv")
    measures = Measures(rng, mechanism, loads)
    problem = {"format": 1, "name": f"scene_{seed}", "gravity": gravity(rng, family), "bodies": mechanism.bodies,
               "joints": mechanism.joint_fields, "drives": loads.drives, "signals": loads.signals,
               "forces": loads.forces,
               "sensors": measures.sensors, "simulation": settings(rng, family), "objectives": measures.objectives}
    if family.has("equilibrium"):
        problem["initial"] = {"equilibrium": True}
    elif measures.conditions:
        problem["initial"] = {"conditions": measures.conditions}
    if family.has("rough"):
        roughen(rng, family, problem["bodies"])
    if family.has("rotated planar"):
        problem = tilted(problem, family.turn) or problem
    give_parameters(rng, family, problem)
    return Scene(resolved(problem), loads.files, f"seed {seed}: {family.words()}")


def gravity(rng, family):
    if rng.random() < 0.1:
        return [0, 0, 0]
    flat = family.planar and rng.random() < 0.85
    return times(family.gravity, perpendicular(rng, family.normal) if flat else random_direction(rng))


def settings(rng, family):
    simulation = {"end_time": family.end_time, "output_step": family.end_time / 20}
    if rng.random() < 0.3:
        simulation["integrator"] = {"type": rng.choice(["dopri5", "dopri853", "verner6", "radau5", "sdirk4", "gauss6"]),
                                    "rtol": 1e-7, "atol": 1e-9 * min(1, family.length)}
    if rng.random() < 0.1:
        simulation["formulation"] = rng.choice([
            {"projection": "velocity"}, {"projection": "none"}, {"alpha": 1e6}, {"omega": 5 / family.time},
            {"type": "penalty", "linear_solver": "quasidefinite", "alpha": 1e8 * family.mass,
             "projection": "position_velocity"}])
    return simulation


def roughen(rng, family, bodies):
    for body in bodies:
        body["position"] = [x + family.length * rng.uniform(-0.15, 0.15) for x in body["position"]]


def turns_one_axis(problem, section, path):
    """A joint without normals has no angle where a parameter turns one of its axes away from the other."""
    return (section == "joints" and str(path[-2]).startswith("axis") and
            "normal1" not in problem[section][path[0]])


def give_parameters(rng, family, problem):
    parameters = Parameters(rng)
    weights = {"bodies": 3, "joints": 3, "forces": 3, "drives": 1, "initial": 1, "gravity": 0.3,
               "sensors": 0.5, "objectives": 0.3}
    for _ in range(rng.choices(range(7), [1, 3, 4, 4, 3, 2, 1])[0]):
        section = rng.choices(list(weights), weights.values())[0]
        if not problem.get(section):
            continue
        able = [place for place in places(problem[section]) if not FIXED & set(place[2]) or place[2][-1] == "angle"]
        able = [(items, key, path) for items, key, path in able if items[key] != 0 or rng.random() < 0.1]
        able = [place for place in able if not turns_one_axis(problem, section, place[2])]
        if not able:
            continue
        items, key, path = rng.choice(able)
        direction = any(str(part).startswith(("axis", "normal")) for part in path)
        beside = [abs(x) for x in items if isinstance(x, (int, float))] if isinstance(items, list) else [0]
        size = abs(items[key]) or (1.0 if direction else max(beside, default=0) or family.length)
        items[key] = parameters.defined(parameters.express(items[key], size))
    if parameters.values and rng.random() < 0.15:
        name = rng.choice(list(parameters.values))
        scale = abs(parameters.values[name]["value"]) or 1.0
        sums = [o for o in problem["objectives"].values() if not {"maximum_of", "minimum_of", "rms_of"} & set(o)]
        if sums:
            rng.choice(sums)["parameters_only"] = Formula("({}*{})^2", name, 1 / scale)
    if parameters.values:
        problem["parameters"] = parameters.values
    if parameters.definitions:
        problem["definitions"] = parameters.definitions
