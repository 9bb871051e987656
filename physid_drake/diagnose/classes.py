"""Which effects pushes cannot tell from one that was found, and how likely that one is."""

from __future__ import annotations

from collections.abc import Sequence

from scipy import stats

from physid_drake.diagnose.candidate import Candidate, out_of_question, rivals, spread, surely_better
from physid_drake.diagnose.evidence import Evidence
from physid_drake.diagnose.model import Fitted
from physid_drake.diagnose.screen import cosine

ALIKE = 0.95  # cosine of two projected signatures that these pushes cannot tell apart
SURELY = 3.0  # standard errors of a difference of gains: signatures that are alike need more than others
LIKELY = 0.5  # odds against what was found: so likely a candidate is in its class though nothing confirms it


def class_of(plain: Fitted, step: Sequence[Candidate]) -> tuple[str, ...]:
    """Names that explain these pushes as well as the best of a step, or look like it from the plain model.

    Also what one push speaks for so loudly that it is likely, although the others do not confirm it.
    """
    best = step[0]
    close = {c.name for c in rivals(best, step)}
    if not best.score.in_order:  # whose gains spread as widely as they are large: odds say nothing then
        close |= {c.name for c in step[1:] if not out_of_question(best, c) and _odds(best, c) > LIKELY}
    for other in step[1:]:
        if not other.accepted or out_of_question(best, other) or surely_better(best, other, SURELY):
            continue
        if abs(cosine(plain, best.score, other.score)) > ALIKE:
            close.add(other.name)
    return tuple(sorted(close))


def others_than(evidence: Evidence, k: int) -> set[str]:
    """Effects of the model but that of step k: what the model has beside it is no rival of it."""
    return {step[0].name for j, step in enumerate(evidence.steps) if j != k}


def class_beside(evidence: Evidence, k: int) -> tuple[str, ...]:
    """Names that these pushes cannot tell from the effect of step k, beside the model's other effects."""
    others = others_than(evidence, k)
    return tuple(name for name in class_of(evidence.plain, evidence.steps[k]) if name not in others)


def probability_of(step: Sequence[Candidate], others: set[str]) -> float:
    """That the best of a step is the right one: odds of each rival from its held-out deficit and standard error."""
    best, total = step[0], 1.0
    for other in step[1:]:
        if other.name not in others and not out_of_question(best, other):
            total += _odds(best, other)
    return 1.0 / total


def _odds(best: Candidate, other: Candidate) -> float:
    """Of another candidate against the best, from its held-out deficit and the standard error of that."""
    difference = best.gains - other.gains
    deficit = float(difference.sum())
    if other.coordinates > best.coordinates:  # a little better for being more complicated is not likelier
        deficit = max(0.0, deficit)
    worse = float(stats.norm.sf(deficit / spread(difference)))
    return worse / max(1.0 - worse, 1e-9)
