"""The verdict as one sentence."""

from __future__ import annotations

from collections.abc import Sequence

from physid_drake.diagnose.values import EffectFinding, Partly


def _nothing_found(verdict: str, *, fewest: int | None, known: bool, quieter: float | None, rare: bool) -> str:
    if verdict == "underpowered" and fewest is not None:
        return f"Too few pushes for a diagnosis: it takes at least {fewest}."
    if verdict == "underpowered" and rare:
        return "Not conclusive: some physics may be missing, but held-out pushes confirm no effect."
    if verdict == "underpowered":
        return "Not conclusive: only a large effect would be detectable in these pushes."
    if not known:
        return (
            "The baseline model explains these pushes, as far as can be said: their noise is neither stated nor seen"
            " at rest, so it is taken to be as large as the errors of the baseline model."
        )
    if quieter is not None:
        return (
            "The baseline model explains these pushes, as far as can be said: the assumed noise, stated or seen, is"
            f" {quieter:,.0f} times the remaining errors, and effects smaller than it cannot be detected."
        )
    return "The baseline model explains these pushes: no missing physics is detectable in them."


def sentence(
    verdict: str,
    findings: Sequence[EffectFinding],
    partly: Partly | None,
    *,
    better: bool = False,
    fewest: int | None = None,
    known: bool = True,
    quieter: float | None = None,
    rare: bool = False,
) -> str:
    """The verdict in words.

    Args:
        verdict: as in ``diagnosis.json``.
        findings: the effects that are named.
        partly: effects that explain a part of the mismatch; None where there are none.
        better: whether a model with an unnamed force predicts held-out pushes better than the baseline.
        fewest: least number of pushes for a diagnosis, where the recording has fewer; otherwise None.
        known: whether the tracker's noise was stated or seen at rests.
        quieter: noise over the baseline's errors, where that is very large; otherwise None.
        rare: whether the p-value is below the false-alarm rate that was asked for.
    """
    match verdict:
        case "consistent" | "underpowered":
            return _nothing_found(verdict, fewest=fewest, known=known, quieter=quieter, rare=rare)
        case "unexplained" if partly is not None:
            return (
                "Simulation and recording differ, and no effect of the catalogue explains all of it:"
                f" {' and '.join(partly.effects)} would remove {_percent(partly.share)} of the squared error."
                f"{_nameless(better)}"
            )
        case "unexplained":
            return f"Simulation and recording differ, and no effect of the catalogue explains it.{_nameless(better)}"
    names = [
        f"{f.name} ({f.statement})"
        + (f", or {' or '.join(f.indistinguishable_from)}" if f.indistinguishable_from else "")
        for f in findings
    ]
    return "Missing physics: " + "; and ".join(names) + "."


def _nameless(better: bool) -> str:
    return " The model has an unnamed force, with which held-out pushes are predicted better." if better else ""


def _percent(share: float) -> str:
    return "more than 99 %" if share > 0.99 else f"{100.0 * share:.0f} %"
