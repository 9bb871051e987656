"""Everything that a diagnosis rests on, and when a model explains it."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from physid_drake.diagnose.candidate import Candidate
from physid_drake.diagnose.fit import Fitter
from physid_drake.diagnose.foils import Foil
from physid_drake.diagnose.linear import LinearPush, Whitened, solve
from physid_drake.diagnose.localise import MissingWrench
from physid_drake.diagnose.model import Fitted
from physid_drake.diagnose.screen import Screening, Signature
from physid_drake.diagnose.values import NextPush
from physid_drake.identify.identify import MOST_SCATTER
from physid_drake.pushes.case import UNIT_SCATTER, Case

Array = NDArray[np.float64]

# The cell's own error that guard, floor and tolerances leave: cost per degree of freedom where nothing is missing.
SLACK = 1.15
# What a model with effects may leave, as cost per degree of freedom above 1:
NOISE_LIKE = 0.2  # always, as the cell leaves where nothing is missing
DOUBTS = 2.0  # standard deviations of the noise's variance, as rests tell it, if that is more
MOST_SHARE = 0.16  # of what the plain cell leaves: an effect that leaves more explains something else
MOST_LEFT = 0.5  # beside what two laws of one effect differ by
EVER_LEFT = 2.0  # in all
LAW_ERROR = 0.1  # of an effect's motion: two honest implementations of a spring or a liquid differ by that much
MOST_OF_UNKNOWN = 0.5  # of the noise's variance, where it is not known
TOO_SCATTERED = 0.01  # p-value below which a model with effects leaves frictions that differ by more


@dc.dataclass(frozen=True, kw_only=True)
class Evidence:
    """Everything that was computed, for the report and the models that leave.

    Attributes:
        case: the recording.
        fitter: with guard and tolerances.
        plain: the plain cell, fitted.
        nearest: the plain cell where it predicts best; another one only where it is far from an explanation.
        screening: of the catalogue at the plain cell.
        signatures: of the catalogue at the plain cell.
        steps: one per accepted effect: all candidates of that step.
        rejected: candidates of a step in which none was accepted.
        superfluous: steps that were taken back: the other effects do as well without theirs.
        final: the model at the end.
        errors_before: per push (m,), recorded less what ``nearest`` predicts, fitted without that push.
        errors_after: the same with the effects of ``confirmed``; those before where there are none.
        remaining: screening of what it leaves.
        wrenches: what is missing from the plain cell, window by window.
        next_push: that would tell the rivals apart.
        noise_share: where the noise is not known, the share of its variance that the last model needs of what the
            plain cell needs; 1 where it is known.
        loud: the plain cell and the screening where the noise was as loud as what it leaves; None where it is known.
        foil: a law beside the catalogue that does better than an effect that was found, if there is one.
    """

    case: Case
    fitter: Fitter
    plain: Fitted
    nearest: Fitted
    screening: Screening
    signatures: tuple[Signature, ...]
    steps: tuple[tuple[Candidate, ...], ...]
    rejected: tuple[Candidate, ...]
    final: Fitted
    errors_before: tuple[Array, ...]
    errors_after: tuple[Array, ...]
    remaining: Screening
    wrenches: tuple[MissingWrench, ...] = ()
    next_push: NextPush | None = None
    superfluous: tuple[tuple[Candidate, ...], ...] = ()
    noise_share: float = 1.0
    loud: tuple[Fitted, Screening] | None = None
    foil: Foil | None = None


def confirmed(
    steps: Sequence[Sequence[Candidate]], rejected: Sequence[Candidate], final: Fitted
) -> tuple[tuple[str, ...], Fitted] | None:
    """The effects that were added, or the best rejected one that pushes left out confirm; with their model."""
    if steps:
        return tuple(step[0].name for step in steps), final
    accepted = [c for c in rejected if c.accepted]
    return ((accepted[0].name,), accepted[0].fitted) if accepted else None


def mismatch(fitted: Fitted, screening: Screening | None) -> float:
    """P-value of "this model explains the pushes": the best of the catalogue's, the cost's and the scatter's.

    Args:
        fitted: the model.
        screening: of the catalogue; None where pushes that were left out confirm nothing of it, so that only the cost
            speaks: one odd push is no physics.
    """
    looks = [_cost_p_value(fitted), 1.0 if screening is None else screening.p_value]
    scatter = scatter_p_value(fitted)
    # One within its bounds says nothing and is no look: of frictions that scatter by just so much, its own test calls
    # 0.2 % where 1 % is asked.
    if scatter < 1.0:
        looks.append(scatter)
    return float(-np.expm1(len(looks) * np.log1p(-min(*looks, 1.0 - 1e-16))))


def _cost_p_value(fitted: Fitted) -> float:
    """Of "noise and the cell's own error leave as much"; by Snedecor's F where rests had to tell the noise.

    Pushes with no more numbers than the model has say nothing.
    """
    cost, degrees = fitted.solution.chi2 / SLACK, fitted.degrees
    if degrees < 1:
        return 1.0
    if fitted.doubt == 0.0:
        return float(stats.chi2.sf(cost, degrees))
    # A variance seen with n degrees of freedom has a logarithm that is sqrt(2 / n) off.
    return float(stats.f.sf(cost / degrees, degrees, 2.0 / fitted.doubt**2))


def scatter_p_value(fitted: Fitted) -> float:
    """Of "frictions scatter by no more than ``MOST_SCATTER``", by the likelihood ratio.

    Friction that changes as an object slides, warms or sticks makes pushes of other lengths differ, which a model
    would otherwise take for scatter. The push that speaks most for it is left out: what is odd of one push, its own
    friction takes up, and that is no physics.
    """
    seen, most = fitted.state.scatter, MOST_SCATTER / UNIT_SCATTER
    if seen <= most or len(fitted.pushes) < 2:
        return 1.0
    pushes = fitted.pushes
    subsets = [pushes[:i] + pushes[i + 1 :] for i in range(len(pushes))]
    least = min(_more_likely(fitted, subset, seen, most) for subset in subsets)
    # The scatter at its bound is half of the cases where it is no larger (Chernoff 1954).
    return 0.5 * float(stats.chi2.sf(2.0 * max(0.0, least), 1))


def _more_likely(fitted: Fitted, pushes: Sequence[LinearPush], seen: float, most: float) -> float:
    """By how many nats one scatter of friction makes pushes likelier than another."""
    free, held = (
        solve(Whitened.of(pushes, s), fitted.prior_mean, fitted.prior_std, fitted.bounds).log_likelihood
        for s in (seen, most)
    )
    return float(free - held)


def takes_enough(plain: Fitted, final: Fitted) -> bool:
    """Whether a model takes as large a share of a mismatch away as one that explains it does, whatever it leaves."""
    return final.reduced_chi2 - 1.0 <= MOST_SHARE * (plain.reduced_chi2 - 1.0)


def unexplained(plain: Fitted, final: Fitted) -> bool:
    """Whether a model leaves more than noise, the cell's error and what two honest laws of an effect differ by.

    Or frictions that differ from push to push by more than scatter.
    """
    before, left = plain.reduced_chi2 - 1.0, final.reduced_chi2 - 1.0
    unsure = DOUBTS * final.doubt
    most = min(max(MOST_LEFT + LAW_ERROR**2 * max(0.0, before), unsure), EVER_LEFT)
    too_much = left > most or left > max(NOISE_LIKE, unsure, MOST_SHARE * before)
    return too_much or scatter_p_value(final) < TOO_SCATTERED
