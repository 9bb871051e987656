"""Figures of a whole proof from the outcomes of its worlds; every share comes with its counts and an interval."""

from __future__ import annotations

import dataclasses as dc
import math
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.stats import binomtest

from physid_drake.validation.scoring.score import CLEAR, NAMED, Outcome

KINDS = ("none", "effect", "pair", "other")
SIZES = ((0.0, 2.0), (2.0, 5.0), (5.0, 10.0), (10.0, 30.0), (30.0, math.inf))
"""Bins of effect sizes, in standard deviations of the tracker."""
PROBABILITIES = (0.0, 0.5, 0.7, 0.9, 0.97, 1.0)
"""Edges of the bins in which stated probabilities are compared with what came true."""
CONFIDENCE = 0.95  # of the intervals beside shares
NOT_CATALOGUED = "not in the catalogue"
NOTHING = "no effect"


@dc.dataclass(frozen=True, kw_only=True)
class Share:
    """``count`` of ``of``."""

    count: int
    of: int

    @property
    def share(self) -> float:
        """Between 0 and 1; nan of nothing."""
        return self.count / self.of if self.of else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Binomial 95 % interval (Clopper and Pearson); nan of nothing."""
        if not self.of:
            return math.nan, math.nan
        ends = binomtest(self.count, self.of).proportion_ci(CONFIDENCE)
        return float(ends.low), float(ends.high)


@dc.dataclass(frozen=True, kw_only=True)
class Quantiles:
    """Of how many numbers; median and 90th percentile, nan of nothing."""

    count: int
    median: float
    p90: float


@dc.dataclass(frozen=True, kw_only=True)
class Power:
    """Worlds with one effect whose size is in [low, high) standard deviations: found, and named rightly."""

    low: float
    high: float
    found: Share
    right: Share


@dc.dataclass(frozen=True, kw_only=True)
class Reliability:
    """Names that were given with a probability in [low, high]: its mean, and how many were right."""

    low: float
    high: float
    stated: float
    right: Share


@dc.dataclass(frozen=True, kw_only=True)
class Errors:
    """Medians over worlds of held-out errors before, after and of the true world.

    Attributes:
        worlds: over how many.
        rms: in standard deviations of the tracker.
        position: in the plane [m].
        rotation: [rad].
    """

    worlds: int
    rms: tuple[float, float, float]
    position: tuple[float, float, float]
    rotation: tuple[float, float, float]


@dc.dataclass(frozen=True, kw_only=True)
class Naming:
    """How worlds with one effect were named.

    Attributes:
        found: a mismatch was claimed.
        right: the name is right, or in a class of two.
        first: the name given first is right.
        in_class: the truth is in a class of any size.
        wrong: a name that is not there.
        class_size: of the classes that hold the truth.
    """

    found: Share
    right: Share
    first: Share
    in_class: Share
    wrong: Share
    class_size: Quantiles


@dc.dataclass(frozen=True, kw_only=True)
class Figures:
    """All figures of a proof.

    Attributes:
        worlds: how many of each kind.
        failed: worlds without a diagnosis.
        false_alarms: a mismatch claimed, or no diagnosis, where nothing is.
        power: against effect size.
        clear, faint: naming of single effects of `CLEAR` standard deviations or more, and below.
        abstained: ``unexplained`` where the effect is not in the catalogue.
        others_named: a name where the effect is not in the catalogue.
        pairs: of two effects: ``both``, ``one``, ``wrong``.
        parameter_error: relative, of clear effects that were named rightly.
        coverage, others_coverage: 90 % intervals that hold the truth, of amplitudes, and of places, angles and the
            like, of every effect that was named rightly, of pairs, too.
        theta_error, theta_coverage: the same of friction and mass, in worlds of which the right thing was said.
        held_out: per kind of world; ``effect`` where it is clear and named rightly.
        held_out_ratio: each world's error after over that of the true world, which is told the start exactly: of
            ``none``, the baseline model's where it is not called wrong, and of ``effect`` as above.
        reliability: stated probabilities against what came true.
        brier: mean square of probability minus what came true; nan without names.
        confusion: counts of (truth, said).
        seconds: median and largest of a world.
    """

    worlds: dict[str, int]
    failed: Share
    false_alarms: Share
    power: tuple[Power, ...]
    clear: Naming
    faint: Naming
    abstained: Share
    others_named: Share
    pairs: dict[str, Share]
    parameter_error: Quantiles
    coverage: Share
    others_coverage: Share
    theta_error: Quantiles
    theta_coverage: Share
    held_out: dict[str, Errors]
    held_out_ratio: dict[str, Quantiles]
    reliability: tuple[Reliability, ...]
    brier: float
    confusion: dict[tuple[str, str], int]
    seconds: tuple[float, float]


def figures_of(outcomes: Sequence[Outcome]) -> Figures:
    """The figures; a world without a diagnosis counts as nothing found, and as an alarm where nothing is."""
    kinds = {kind: [o for o in outcomes if o.kind == kind] for kind in KINDS}
    single = kinds["effect"]
    clear = [o for o in single if o.size >= CLEAR]
    right = [o for o in outcomes if o.fault is None and o.kind != "other"]
    bins, brier = calibration(outcomes)
    times = [o.seconds for o in outcomes if math.isfinite(o.seconds)]
    return Figures(
        worlds={kind: len(members) for kind, members in kinds.items()},
        failed=_count(o.failed for o in outcomes),
        false_alarms=_count(o.found or o.failed for o in kinds["none"]),
        power=tuple(_power(single, low, high) for low, high in SIZES),
        clear=_naming(clear),
        faint=_naming([o for o in single if o.size < CLEAR]),
        abstained=_count(o.verdict == "unexplained" for o in kinds["other"]),
        others_named=_count(o.verdict in NAMED for o in kinds["other"]),
        pairs={
            "both": _count(o.both for o in kinds["pair"]),
            "one": _count(o.named == 1 for o in kinds["pair"]),
            "wrong": _count(o.wrong_name for o in kinds["pair"]),
        },
        parameter_error=_quantiles([e for o in clear for e in o.errors]),
        coverage=_count(c for o in outcomes for c in o.covered),
        others_coverage=_count(c for o in outcomes for c in o.others_covered),
        theta_error=_quantiles([e for o in right for e in o.theta_errors]),
        theta_coverage=_count(c for o in right for c in o.theta_covered),
        held_out={
            "none": _errors(kinds["none"]),
            "effect": _errors([o for o in clear if o.right]),
            "other": _errors(kinds["other"]),
            "pair": _errors(kinds["pair"]),
        },
        held_out_ratio={
            "none": _quantiles(_ratios(o for o in kinds["none"] if not o.found)),
            "effect": _quantiles(_ratios(o for o in clear if o.right)),
        },
        reliability=bins,
        brier=brier,
        confusion=confusion(outcomes),
        seconds=(float(np.median(times)), max(times)) if times else (math.nan, math.nan),
    )


def calibration(outcomes: Sequence[Outcome]) -> tuple[tuple[Reliability, ...], float]:
    """Bins of stated probabilities, and the Brier score, over all names that were given."""
    named = [(p, names[0] in o.true) for o in outcomes for p, names in zip(o.probabilities, o.classes, strict=True)]
    bins = []
    for low, high in pairwise(PROBABILITIES):
        within = [(p, hit) for p, hit in named if low <= p and (p < high or high == PROBABILITIES[-1])]
        stated = float(np.mean([p for p, _ in within])) if within else math.nan
        bins.append(Reliability(low=low, high=high, stated=stated, right=_count(hit for _, hit in within)))
    brier = float(np.mean([(p - hit) ** 2 for p, hit in named])) if named else math.nan
    return tuple(bins), brier


def confusion(outcomes: Sequence[Outcome]) -> dict[tuple[str, str], int]:
    """How often (truth, first name or verdict); pairs, which have two truths, are left out."""
    pairs = (
        (
            {"none": NOTHING, "other": NOT_CATALOGUED}.get(o.kind) or o.true[0],
            o.classes[0][0] if o.classes else o.verdict,
        )
        for o in outcomes
        if o.kind != "pair"
    )
    return dict(sorted(Counter(pairs).items()))


def json_of(figures: Figures) -> dict[str, Any]:
    """The figures with fixed keys; what is unknown is null, and seconds, which are the machine's, stand alone."""
    return {
        "worlds": figures.worlds,
        "failed": _plain(figures.failed),
        "false_alarms": _plain(figures.false_alarms),
        "power": [_plain(p) for p in figures.power],
        "effect_clear": _plain(figures.clear),
        "effect_faint": _plain(figures.faint),
        "not_catalogued": {"abstained": _plain(figures.abstained), "named": _plain(figures.others_named)},
        "pairs": {name: _plain(share) for name, share in figures.pairs.items()},
        "parameter_error": _plain(figures.parameter_error),
        "coverage_90": _plain(figures.coverage),
        "others_coverage_90": _plain(figures.others_coverage),
        "theta": {"error": _plain(figures.theta_error), "coverage_90": _plain(figures.theta_coverage)},
        "held_out": {kind: _plain(errors) for kind, errors in figures.held_out.items()},
        "held_out_ratio": {kind: _plain(ratio) for kind, ratio in figures.held_out_ratio.items()},
        "calibration": {"brier": _plain(figures.brier), "bins": [_plain(b) for b in figures.reliability]},
        "confusion": [{"true": t, "said": s, "worlds": n} for (t, s), n in figures.confusion.items()],
        "seconds": {"median": _plain(figures.seconds[0]), "max": _plain(figures.seconds[1])},
    }


def _plain(value: Any) -> Any:
    if isinstance(value, Share):
        return {"count": value.count, "of": value.of, "share": _plain(value.share), "ci95": _plain(value.interval)}
    if dc.is_dataclass(value):
        return {f.name: _plain(getattr(value, f.name)) for f in dc.fields(value)}
    if isinstance(value, tuple):
        return [_plain(v) for v in value]
    if isinstance(value, float):
        return float(f"{value:.6g}") if math.isfinite(value) else None
    return value


def _naming(members: Sequence[Outcome]) -> Naming:
    sizes = [float(len(names)) for o in members for names in o.classes if set(names) & set(o.true)]
    return Naming(
        found=_count(o.found for o in members),
        right=_count(o.right for o in members),
        first=_count(o.first for o in members),
        in_class=_count(o.in_class for o in members),
        wrong=_count(o.wrong_name for o in members),
        class_size=_quantiles(sizes),
    )


def _power(members: Sequence[Outcome], low: float, high: float) -> Power:
    within = [o for o in members if low <= o.size < high]
    return Power(low=low, high=high, found=_count(o.found for o in within), right=_count(o.right for o in within))


def _errors(members: Sequence[Outcome]) -> Errors:
    known = [o.held_out for o in members if not o.failed]

    def medians(name: str) -> tuple[float, float, float]:
        rows = np.array([getattr(h, name) for h in known]).reshape(-1, 3)
        before, after, floor = (
            float(np.median(c[np.isfinite(c)])) if np.isfinite(c).any() else math.nan for c in rows.T
        )
        return before, after, floor

    return Errors(
        worlds=len(known), rms=medians("rms"), position=medians("position"), rotation=medians("rotation")
    )  # fmt: skip


def _ratios(members: Iterable[Outcome]) -> list[float]:
    """Errors of held-out pushes after the fix over those of the true world, in standard deviations."""
    pairs = [o.held_out.rms[1:] for o in members]
    return [after / floor for after, floor in pairs if math.isfinite(after) and floor > 0.0]


def _count(flags: Iterable[bool]) -> Share:
    every = list(flags)
    return Share(count=sum(every), of=len(every))


def _quantiles(values: Sequence[float]) -> Quantiles:
    if not values:
        return Quantiles(count=0, median=math.nan, p90=math.nan)
    median, tail = np.quantile(values, [0.5, 0.9]).tolist()
    return Quantiles(count=len(values), median=median, p90=tail)
