"""Words that only this project used do not come back into what a user reads."""

import ast
import re
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "physid_drake"
FILES = sorted([*PACKAGE.rglob("*.py"), *PACKAGE.rglob("*.html")])
GONE = {
    r"\btold\b": "identifiable",
    r"\bno \(prior\)": "no (interval is the prior)",
    r"plain[ _](cell|push|model|plan)": "baseline model, baseline plan",
    r"--plain\b": "--baseline",
    r"\bsigmas\b": "sigma: in units of tracker noise",
    r"standard deviations of (the|a|one) (sensor|tracker|noise|measurement)": "sigma: in units of tracker noise",
    r"left[- ]out pushes|pushes (that were )?left out|(while|that were) left out\b": "held-out pushes",
    r"[Ww]hat is missing": "missing physics",
    r"over what (that )?noise leaves|noise alone": "reduced chi-square (1 = noise only)",
    r"one heading|the other one\b": "the ranges of headings or speeds",
    r"another regime|pushes of another kind": "generalisation across regimes",
    r"log density|\b[Ss]core gain|log score": "log-likelihood gain",
    r"others lose|explains far less": "why other effects were rejected; much smaller gain",
    r"cannot (be told|tell)|tells? (them|rivals) apart|told apart": "indistinguishable, distinguishes",
    r"alike in all|slippery axis": "isotropic, low-friction axis",
    r"numerics guard": "solver check",
    r"\bticks? (in|of) ": "time step",
    r"push's own|pushes' own|\bpush_unknowns\b": "per-push parameters",
    r"under the belief|draws from the belief|of \{\} draws|over the draws": "expected miss, posterior samples",
    r"that push with them|planned without effects|plain_push": "baseline plan, simulated with the effect",
    r"\bbeware\b|otherwise there": "warning: extrapolates beyond the recorded speeds",
    r"would be refused": "ERROR",
    r"from push to push": "friction scatter between pushes",
    r"of everything random|\bof theta\b": "random seed, posterior samples",
    r"settings tried|pushes tried": "candidates evaluated",
    r"force without a name|without a name": "unnamed force",
    r"[Ll]eft over\b": "remaining misfit",
    r"as loud as|\blouder\b": "as large as",
    r"while it is pushed|in its free slide|most surely|most along|heads\b": "during contact, during free sliding",
    r"named rightly": "named correctly",
    r"nominal theta|true theta|likely theta|identified theta|no theta\b|any theta\b": "parameters",
    r"pushes that change most|would tell (most|more)": "largest change, most informative",
}


def docstrings(tree):
    """Literals that stand alone: nobody but a reader of the code sees them."""
    return {id(line.value) for line in ast.walk(tree) if isinstance(line, ast.Expr)}


def literals(source):
    """String literals that may be shown, an f-string with ``{}`` where it puts something in."""
    tree = ast.parse(source)
    hidden, inside = docstrings(tree), set()
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            inside |= {id(part) for part in node.values}
            yield "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in node.values)
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and not {id(node)} & (hidden | inside):
            yield node.value


def shown(file):
    text = file.read_text(encoding="utf-8")
    return [text] if file.suffix == ".html" else list(literals(text))


def found(texts):
    """The words of a text that are gone, and what to say instead."""
    flat = [" ".join(text.split()) for text in texts]
    return [
        f"{word!r}: say {say!r} ({text[:80]})" for word, say in GONE.items() for text in flat if re.search(word, text)
    ]


def test_no_word_that_is_gone_is_shown():
    assert [f"{file.relative_to(PACKAGE)}: {line}" for file in FILES for line in found(shown(file))] == []


def test_the_words_are_found_where_they_are():
    source = '"""told"""\nx = f"{count} of {count} draws"\ny = ("cost under " "the belief", "told")\n'
    assert len(found(literals(source))) == 3
    assert found(["12 pushes; held-out pushes are predicted; identifiable"]) == []
