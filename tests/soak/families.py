"""What kind of scene a seed gives: its size, its masses, and what is hard about it."""

import math
from dataclasses import dataclass, field

from rotations import random_direction, random_turn, times

WEIGHTS = {"space": 4, "planar": 4, "nearly planar": 2, "rotated planar": 2, "far": 1, "tiny": 1, "huge": 1,
           "mass ratios": 2, "spin": 1, "stiff": 1, "massless": 1, "rough": 1, "driven": 2, "equilibrium": 1,
           "pulse": 1, "swift": 1, "micrometres": 1}


@dataclass
class Family:
    names: set = field(default_factory=set)
    bodies: int = 1
    length: float = 1.0  # [m]
    mass: float = 1.0  # [kg]
    gravity: float = 9.81  # [m/s^2]
    time: float = 0.3  # [s], sqrt(length/g): how long a body of this size falls along itself
    end_time: float = 0.5
    planar: bool = False
    normal: list = field(default_factory=lambda: [0, 0, 1])
    off_plane: float = 0.0  # how far axes are off the normal [rad]
    turn: list = field(default_factory=lambda: [1, 0, 0, 0])  # of the whole scene, at the end
    origin: list = field(default_factory=lambda: [0, 0, 0])
    mass_decades: float = 0.5
    spin: float = 0.0  # [rad/s]

    def has(self, name):
        return name in self.names

    def words(self):
        return ", ".join(sorted(self.names))


def log_uniform(rng, low, high):
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def draw_family(rng):
    f = Family()
    names = list(WEIGHTS)
    f.names.add(rng.choices(names, WEIGHTS.values())[0])
    if rng.random() < 0.25:  # two difficulties at once
        f.names.add(rng.choices(names, WEIGHTS.values())[0])
    if not f.names & {"space", "planar", "nearly planar", "rotated planar"}:
        f.names.add(rng.choice(["space", "planar"]))
    if f.has("swift"):  # a fast step in a drive's law
        f.names.add("driven")
        f.names.discard("equilibrium")
    f.planar = bool(f.names & {"planar", "nearly planar", "rotated planar"})
    f.bodies = rng.choices(range(1, 13), [6, 6, 6, 5, 4, 3, 2, 1, 1, 1, 1, 1])[0]
    f.length = 1e-6 if f.has("tiny") else 1e4 if f.has("huge") else log_uniform(rng, 0.2, 2)
    f.mass = log_uniform(rng, 0.1, 10)
    if f.has("tiny") and rng.random() < 0.5:
        f.mass *= 1e-15  # as dense as water
    if f.has("micrometres"):  # in um, ug and us instead of m, kg and s
        f.length, f.mass, f.gravity = log_uniform(rng, 50, 500), log_uniform(rng, 1e2, 1e4), 9.81e-6
    f.time = math.sqrt(f.length / f.gravity)
    f.end_time = f.time * rng.uniform(0.5, 3)
    f.normal = [0, 0, 0]
    f.normal[rng.randrange(3)] = 1
    if f.has("nearly planar"):
        f.off_plane = log_uniform(rng, 1e-9, 1e-3)
    if f.has("rotated planar"):
        f.turn = random_turn(rng)
    if f.has("far"):
        f.origin = times(3000, random_direction(rng))
    if f.has("mass ratios"):
        f.mass_decades = 2.0
    if f.has("spin"):
        f.spin = log_uniform(rng, 10, 300) / f.time
        f.end_time = min(f.end_time, 40 / f.spin)
    return f
