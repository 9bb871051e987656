"""Values of the formulas that stand in the docs: as much of TeX as they use."""

import math
import re

import numpy as np

TOKEN = re.compile(
    r"\\d?dot \w|\\left\||\\right\||\\mathrm\{\w+\}"
    r"|(?:\\[a-zA-Z]+|[a-zA-Z])(?:_\{[^}]*\}|_\w)?|\d+(?:\.\d+)?|\^|[-+/(){}|,=]"
)
NOTHING = re.compile(r"\\left(?=\()|\\right(?=\))|\\q?quad|\\text\{[^}]*\}")
FUNCTIONS = {
    r"\exp": np.exp, r"\sin": np.sin, r"\max": max, r"\pi": math.pi,
    r"\mathrm{diag}": lambda *values: np.diag(values),
    "R": lambda angle: np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]),
}  # fmt: skip


def equations(formula):
    """Right-hand sides by left-hand sides, of equations that commas separate."""
    sides = {}
    for part in re.split(r",\s*(?:\\q?quad|(?=[\\\w]+ =))", formula):
        left, found, right = part.partition("=")
        if found:
            sides[left.strip()] = right.strip()
    return sides


def value_of(formula, name, **symbols):
    """The right-hand side of ``name`` in a formula whose other equations define symbols.

    Vectors are arrays (2,), matrices (2, 2).
    """
    sides = equations(formula)

    def look_up(symbol):
        known = FUNCTIONS | symbols
        return known[symbol] if symbol in known else value(sides[symbol], look_up)

    return value(sides[name], look_up)


def value(text, look_up):
    """An expression's; ``look_up`` says the value of a symbol."""
    stripped = NOTHING.sub("", text)
    tokens = TOKEN.findall(stripped)
    assert "".join(tokens).replace(" ", "") == re.sub(r"\s", "", stripped), text
    reader = _Reader(tokens, look_up)
    found = reader.sum()
    assert not reader.tokens, (text, reader.tokens)
    return found


class _Reader:
    def __init__(self, tokens, look_up):
        self.tokens, self.look_up = list(tokens), look_up

    def next_is(self, *tokens):
        return bool(self.tokens) and self.tokens[0] in tokens

    def take(self, *expected):
        token = self.tokens.pop(0)
        assert not expected or token in expected, (token, self.tokens)
        return token

    def sum(self):
        total = self.product()
        while self.next_is("+", "-"):
            sign = 1.0 if self.take() == "+" else -1.0
            total = total + sign * self.product()
        return total

    def product(self):
        sign = -1.0 if self.next_is("-") and self.take() else 1.0
        product = _times(sign, self.power())
        while self.tokens and not self.next_is("+", "-", ")", "}", ",", r"\right|"):
            if self.next_is("/"):
                self.take()
                product = product / self.power()
            else:
                product = _times(product, self.power())
        return product

    def power(self):
        base = self.atom()
        if not self.next_is("^"):
            return base
        self.take()
        exponent = self.take()
        if exponent == "T":
            return base.T
        return np.linalg.matrix_power(base, int(exponent)) if np.ndim(base) == 2 else base ** float(exponent)

    def atom(self):
        token = self.take()
        if token in ("(", "{"):
            inner = self.arguments()
            self.take(")", "}")
            return inner[0] if len(inner) == 1 else np.array(inner)
        if token == r"\left|":
            inner = self.sum()
            self.take(r"\right|")
            return np.linalg.norm(inner)
        if token == r"\frac":
            return self.atom() / self.atom()
        if token == r"\sqrt":
            return np.sqrt(self.atom())
        return float(token) if re.fullmatch(r"[\d.]+", token) else self.symbol(token)

    def symbol(self, token):
        known = self.look_up(token)
        if not callable(known):
            return known
        if not self.next_is("("):
            return known(self.power())
        self.take("(")
        inner = self.arguments()
        self.take(")")
        return known(*inner)

    def arguments(self):
        inner = [self.sum()]
        while self.next_is(","):
            self.take()
            inner.append(self.sum())
        return inner


def _times(a, b):
    return a @ b if np.ndim(a) == 2 and np.ndim(b) else a * b
