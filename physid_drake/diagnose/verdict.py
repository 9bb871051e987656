"""What evidence says: whether the plain cell explains the pushes, and whether the last model does."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from physid_drake.diagnose.classes import class_beside
from physid_drake.diagnose.evidence import MOST_OF_UNKNOWN, Evidence, mismatch, unexplained
from physid_drake.diagnose.left_out import comes_nearer, errors_of, shown_by_several
from physid_drake.diagnose.values import Detectable

FEWEST_PUSHES = 3
QUIET = 5e-5  # m: a tracker's noise that is no longer what hides the cell's own error
OWN_POSITION, OWN_ROTATION = 2e-4, 2e-3  # m, rad: of left-out pushes, what the cell itself may be off by
VISIBLE = 10.0  # standard deviations of motion: pushes that would not show such an effect show nothing


def p_value_of(evidence: Evidence) -> float:
    """Of "the plain cell explains these pushes".

    A simulation without noise shows how two honest simulators differ: all of that has structure, and is no physics.
    Where the noise is not known, it is as loud as what the plain cell leaves: what was found made it quieter.
    """
    if is_own_error(evidence):
        return 1.0
    plain, screening = evidence.loud or (evidence.plain, evidence.screening)
    confirmed_by_pushes = bool(evidence.steps) and predicts(evidence)
    return mismatch(plain, screening if confirmed_by_pushes else None)


def is_own_error(evidence: Evidence) -> bool:
    """Whether there is hardly any noise, and the plain cell predicts pushes to its own error."""
    before = errors_of(evidence.case, evidence.errors_before)
    near = before.position < OWN_POSITION and before.rotation < OWN_ROTATION
    return evidence.case.noise.position < QUIET and near


def verdict_of(evidence: Evidence, p_value: float, alpha: float, detectable: Sequence[Detectable]) -> str:
    """``consistent``, ``explained``, ``ambiguous``, ``unexplained`` or ``underpowered``.

    Args:
        evidence: what it rests on.
        p_value: of "the plain cell explains these pushes".
        alpha: the share of false alarms that is allowed.
        detectable: how large effects would have to be to show.
    """
    if len(evidence.case.problems) < FEWEST_PUSHES:
        return "underpowered"  # nothing can be confirmed on pushes that were left out
    if p_value >= alpha:
        return "underpowered" if _blind(evidence, detectable) else "consistent"
    if not evidence.steps or not is_explained(evidence):
        return "unexplained"
    return "ambiguous" if any(class_beside(evidence, k) for k in range(len(evidence.steps))) else "explained"


def _blind(evidence: Evidence, detectable: Sequence[Detectable]) -> bool:
    """Whether most effects could be large and not show; one that these pushes do not feel at all never shows."""
    unfelt = {signature.kind.name for signature in evidence.signatures} - {one.name for one in detectable}
    sizes = [one.sigmas for one in detectable] + [math.inf] * len(unfelt)
    return not sizes or float(np.median(sizes)) > VISIBLE


def predicts(evidence: Evidence) -> bool:
    """Whether the last model comes visibly nearer to pushes that were left out than the plain one."""
    return comes_nearer(evidence.case, evidence.errors_before, evidence.errors_after)


def by_several(evidence: Evidence) -> bool:
    """Whether more than one of these pushes shows it; those of an order do, which their number bears out."""
    ordered = bool(evidence.steps) and all(step[0].score.in_order for step in evidence.steps)
    return ordered or shown_by_several(evidence.case, evidence.errors_before, evidence.errors_after)


def is_explained(evidence: Evidence) -> bool:
    """Whether the last model accounts for the pushes."""
    if evidence.foil is not None or not predicts(evidence) or not by_several(evidence):
        return False
    if evidence.case.noise.known:
        return not unexplained(evidence.plain, evidence.final)
    # A noise that was taken to be what a model leaves: it must have become much less. Nobody states there how much
    # friction scatters either: what it leaves is said (``left``), and takes no name away.
    return evidence.noise_share <= MOST_OF_UNKNOWN
