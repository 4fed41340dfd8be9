"""Vectors as lists of three numbers and rotations as Euler parameters (e0, e1, e2, e3)."""

import math


def add(a, b):
    return [x + y for x, y in zip(a, b)]


def sub(a, b):
    return [x - y for x, y in zip(a, b)]


def times(c, a):
    return [c * x for x in a]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def norm(a):
    return math.sqrt(dot(a, a))


def unit(a):
    return times(1 / norm(a), a)


def multiply(p, q):
    """First the turn q, then the turn p."""
    e, f = p[1:], q[1:]
    return [p[0] * q[0] - dot(e, f)] + add(add(times(p[0], f), times(q[0], e)), cross(e, f))


def inverse(q):
    return [q[0], -q[1], -q[2], -q[3]]


def about(axis, angle):
    return [math.cos(angle / 2)] + times(math.sin(angle / 2) / norm(axis), axis)


def rotate(q, v):
    """A(q) v: from the axes of a body to global ones."""
    e = q[1:]
    w = cross(e, v)
    return add(v, times(2, add(times(q[0], w), cross(e, w))))


def unrotate(q, v):
    return rotate(inverse(q), v)


def matrix(q):
    columns = [rotate(q, axis) for axis in ([1, 0, 0], [0, 1, 0], [0, 0, 1])]
    return [[columns[j][i] for j in range(3)] for i in range(3)]


def random_direction(rng):
    while True:
        v = [rng.gauss(0, 1) for _ in range(3)]
        if norm(v) > 0.1:
            return unit(v)


def random_turn(rng):
    return unit([rng.gauss(0, 1) for _ in range(4)])


def perpendicular(rng, axis):
    while True:
        v = cross(axis, random_direction(rng))
        if norm(v) > 0.1 * norm(axis):
            return unit(v)
