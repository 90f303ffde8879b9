"""Lines of a model as somebody would evaluate them who has only what they say: nothing of the engine is imported."""

import math
import re

import numpy as np

STATE = re.compile(r"d\((\w+)\)/dt = (.+), \1\(0\) = (.+)")
ASSIGNMENT = re.compile(r"(\w+) = (.+)")
FIRST = re.compile(r"\b([A-Za-z]\w*)\(0\)")
SUBSTEPS = 2
"""Of an interval, in a step of Runge and Kutta each."""
NUMPY = {
    name: getattr(np, name) for name in ("sign", "maximum", "minimum", "where", "clip", "sqrt", "exp", "sin", "pi")
}
NUMPY |= {"abs": np.abs, "max": np.max, "inf": np.inf}


def code_of(line):
    """Without the comment."""
    return line.partition("  # ")[0]


def clipped_mean(value, limit, noise):
    """Mean of clip(value + e, -limit, limit), e normal of standard deviation `noise`, by summing its density."""
    fine = np.linspace(-8.0, 8.0, 16_001)
    weight = np.exp(-0.5 * fine**2)
    clipped = np.clip(np.asarray(value)[..., None] + noise * fine, -limit, limit)
    return (clipped @ weight) / weight.sum()


class Typed:
    """Evaluates lines one after the other. `dt`: s, the length of every interval; `names`: name -> (M,) or a number."""

    def __init__(self, dt, **names):
        size = max(np.size(value) for value in names.values())
        self.dt, self.t = dt, dt * (np.arange(size) + 0.5)
        own = {"delayed": self.delayed, "lowpass": self.lowpass, "play": self.play, "clipped_mean": clipped_mean}
        own |= {"since_opposite": self.since_opposite, "since_turned": self.since_turned}
        self.names = {"t": self.t, **own, **names}

    def run(self, lines):
        together = []
        for line in map(code_of, lines):
            state = STATE.fullmatch(line)
            if state is not None:
                together.append(state.groups())
                continue
            self.integrate(together)
            together = []
            name, expression = ASSIGNMENT.fullmatch(line).groups()
            self.names[name] = self.value(expression) + np.zeros_like(self.t)
        self.integrate(together)
        return self

    def __getitem__(self, name):
        return self.names[name]

    def value(self, expression):
        """`a(0)` is what `a` was at first."""
        return eval(FIRST.sub(r"\1[0]", expression), dict(NUMPY), self.names)

    def integrate(self, states):
        """Mean of each state over each interval: everything else stands still there."""
        if not states:
            return
        own = [name for name, _, _ in states]
        slopes = [compile(expression, "", "eval") for _, expression, _ in states]
        y = [float(self.value(begin)) for _, _, begin in states]
        used = {name for slope in slopes for name in slope.co_names} - set(own)
        moving = [name for name in used if isinstance(self.names.get(name), np.ndarray)]
        scope = {**NUMPY, "abs": abs, "sqrt": math.sqrt, "sign": lambda a: (a > 0) - (a < 0)}
        h, means = self.dt / SUBSTEPS, np.empty((len(own), self.t.size))

        def slope(at):
            scope.update(zip(own, at, strict=False))
            return [eval(each, scope) for each in slopes] + list(at[: len(own)])

        for i in range(self.t.size):
            scope.update((name, float(self.names[name][i])) for name in moving)
            z = [*y, *(0.0 for _ in own)]
            for _ in range(SUBSTEPS):
                a = slope(z)
                b = slope([v + 0.5 * h * s for v, s in zip(z, a, strict=True)])
                c = slope([v + 0.5 * h * s for v, s in zip(z, b, strict=True)])
                d = slope([v + h * s for v, s in zip(z, c, strict=True)])
                z = [v + h / 6 * (p + 2 * q + 2 * r + s) for v, p, q, r, s in zip(z, a, b, c, d, strict=True)]
            y = z[: len(own)]
            means[:, i] = np.array(z[len(own) :]) / self.dt
        self.names.update(zip(own, means, strict=True))

    def delayed(self, value, delay):
        return np.interp(self.t - delay, self.t, value)

    def lowpass(self, value, time_constant):
        inner = Typed(self.dt, u=value)
        return inner.run([f"d(y)/dt = (u - y) / {time_constant}, y(0) = 0"])["y"]

    def play(self, value, width):
        y, out = 0.0, []
        for v in value.tolist():
            y = min(max(y, v - width), v + width)
            out.append(y)
        return np.array(out)

    def since_opposite(self, x, beyond):
        return self._since(x, beyond)[0]

    def since_turned(self, x, beyond):
        return self._since(x, beyond)[1]

    def _since(self, x, beyond):
        """S since x was beyond the other way, s since it began to be beyond this way; inf until it has been both."""
        way, ended, began, out = 0, {}, 0.0, []
        for t, v in zip(self.t.tolist(), x.tolist(), strict=True):
            now = (v > beyond) - (v < -beyond)
            if now and now != way:
                way, began = now, t - 0.5 * self.dt
            if now:
                ended[now] = t + 0.5 * self.dt
            out.append((t - ended[-way], t - began) if -way in ended and way else (np.inf, np.inf))
        return np.array(out).T
