"""Numbers of a scene that become expressions of parameters, with the same value."""

import math

SHAPES = ("p", "p", "c*p", "p + c", "p^2", "exp(p)", "shared")


class Formula:
    """An expression such as {} + {}*sin({}*t) with its numbers apart, so that each can become a parameter."""

    def __init__(self, template, *values):
        self.template, self.values = template, list(values)

    def text(self):
        return self.template.format(*(v if isinstance(v, str) else literal(v) for v in self.values))


def literal(x):
    return f"({x!r})" if x < 0 else repr(x)


class Parameters:
    """Gives a number as an expression, of a new parameter or of one that is there."""

    def __init__(self, rng):
        self.rng, self.values, self.definitions = rng, {}, {}

    def new(self, value, size):
        name = f"p{len(self.values) + 1}"
        self.values[name] = {"value": value, "allow_unused": True}
        if value == 0:  # nothing else tells what a step of it may be
            self.values[name].update(lower=-size, upper=size)
        return name

    def express(self, x, size):
        shape = self.rng.choice(SHAPES)
        if shape == "shared" and self.values:
            name = self.rng.choice(list(self.values))
            value = self.values[name]["value"]
            if abs(value) > 1e-3 * abs(x):
                return f"{literal(x / value)}*{name}"
        if shape == "c*p":
            c = self.rng.uniform(0.5, 2)
            return f"{literal(c)}*{self.new(x / c, size / c)}"
        if shape == "p + c":
            c = size * self.rng.uniform(-1, 1)
            return f"{self.new(x - c, size)} + {literal(c)}"
        if shape == "p^2" and x > 0:
            return f"{self.new(math.sqrt(x), math.sqrt(size))}^2"
        if shape == "exp(p)" and x > 0:
            return f"exp({self.new(math.log(x), 1.0)})"
        return self.new(x, size)

    def defined(self, expression):
        """Sometimes an expression goes through a definition."""
        if self.rng.random() > 0.15:
            return expression
        name = f"d{len(self.definitions) + 1}"
        self.definitions[name] = expression
        return name


def places(node, path=()):
    """All numbers of a scene: (container, key, path)."""
    items = node.values if isinstance(node, Formula) else node
    pairs = items.items() if isinstance(items, dict) else enumerate(items)
    for key, value in pairs:
        if isinstance(value, (dict, list, Formula)):
            yield from places(value, path + (key,))
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            yield items, key, path + (key,)


def resolved(node):
    """The scene with its formulas written out."""
    if isinstance(node, Formula):
        return node.text()
    if isinstance(node, dict):
        return {key: resolved(value) for key, value in node.items()}
    if isinstance(node, list):
        return [resolved(value) for value in node]
    return node
