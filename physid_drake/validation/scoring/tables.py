"""The figures of a proof as tables for people."""

from __future__ import annotations

import math

from physid_drake.validation.scoring.figures import NOT_CATALOGUED, Figures, Naming, Quantiles, Share
from physid_drake.validation.scoring.score import CLEAR


def table(figures: Figures) -> list[tuple[str, str, str, str]]:
    """Rows for people: what, the figure with its counts, its 95 % interval, what was asked for."""
    error, ratio = figures.parameter_error, figures.held_out_ratio
    return [
        _row("no effect: false alarms", figures.false_alarms, "at most 1 %"),
        ("  otherwise: held-out error over that of the true model, median", _times(ratio["none"]), "", ""),
        *_naming_rows(f"effect of {CLEAR:g} sigma or more", figures.clear, ("95 %", "90 %")),
        ("  amplitude error, median", _percent(error), "", "10 %"),
        ("  amplitude error, 90th percentile", _percent(error, tail=True), "", ""),
        (
            "  if named correctly: held-out error over that of the true model, median",
            _times(ratio["effect"]),
            "",
            "1.2",
        ),
        *_naming_rows(f"effect below {CLEAR:g} sigma", figures.faint, ("", "")),
        _row("amplitudes (pairs included): coverage of the 90 % intervals", figures.coverage, "85 to 95 %"),
        _row("  coverage for places, angles, speeds and the like", figures.others_coverage, "85 to 95 %"),
        ("error of friction and mass, median", _percent(figures.theta_error), "", ""),
        ("  90th percentile", _percent(figures.theta_error, tail=True), "", ""),
        _row("  coverage of the 90 % intervals", figures.theta_coverage, "85 to 95 %"),
        _row("not in the catalogue: unexplained", figures.abstained, "90 %"),
        _row("  wrong name", figures.others_named, "at most 3 %"),
        _row("two effects: both named", figures.pairs["both"], "70 %"),
        _row("  one named", figures.pairs["one"], ""),
        _row("  wrong name", figures.pairs["wrong"], ""),
        ("Brier score of the stated probabilities", decimals(figures.brier), "", ""),
        _row("no diagnosis", figures.failed, ""),
    ]


def _naming_rows(what: str, naming: Naming, asked: tuple[str, str]) -> list[tuple[str, str, str, str]]:
    size = naming.class_size
    sizes = f"{size.median:g} (90 %: {size.p90:g})" if size.count else "-"
    return [
        _row(f"{what}: found", naming.found, asked[0]),
        _row("  named correctly, alone or in a class of two", naming.right, asked[1]),
        _row("  first name correct", naming.first, ""),
        _row("  true effect in the class", naming.in_class, ""),
        ("  class size, median", sizes, "", ""),
        _row("  wrong name", naming.wrong, ""),
    ]


def power_table(figures: Figures) -> list[tuple[str, ...]]:
    """Rows for people: size, found, its interval, named rightly, its interval."""
    return [
        (size_words(p.low, p.high), *_row("", p.found, "")[1:3], *_row("", p.right, "")[1:3]) for p in figures.power
    ]


def held_out_table(figures: Figures) -> list[tuple[str, ...]]:
    """Rows for people: worlds, how many, mm before, after and at best, degrees likewise, sigmas likewise."""
    words = {"none": "no effect", "effect": "one clear effect, named correctly", "other": NOT_CATALOGUED,
             "pair": "two effects"}  # fmt: skip
    return [
        (words[kind], str(e.worlds), *(decimals(1e3 * v) for v in e.position),
         *(decimals(math.degrees(v)) for v in e.rotation), *(decimals(v) for v in e.rms))
        for kind, e in figures.held_out.items()
    ]  # fmt: skip


def size_words(low: float, high: float) -> str:
    """A bin of sizes in words."""
    return f"over {low:g}" if math.isinf(high) else f"{low:g} to {high:g}"


def _row(what: str, share: Share, asked: str) -> tuple[str, str, str, str]:
    if not share.of:
        return what, "0 of 0", "", asked
    low, high = share.interval
    return (
        what, f"{share.count} of {share.of} ({100 * share.share:.0f} %)",
        f"{100 * low:.0f} to {100 * high:.0f} %", asked,
    )  # fmt: skip


def _percent(error: Quantiles, *, tail: bool = False) -> str:
    return f"{100 * (error.p90 if tail else error.median):.1f} % (of {error.count})" if error.count else "-"


def _times(ratio: Quantiles) -> str:
    return f"{ratio.median:.2f} (90 %: {ratio.p90:.2f}; of {ratio.count})" if ratio.count else "-"


def decimals(value: float) -> str:
    """A number with two decimals, or a dash where there is none."""
    return f"{value:.2f}" if math.isfinite(value) else "-"
