"""Results as tables for a terminal."""

from __future__ import annotations

import math

from rich.table import Table

from physid_drake.identify import Accuracy, Identification
from physid_drake.identify.identify import EXPLAINED
from physid_drake.pushes.stated import FAR_BELOW, quieter_by
from physid_drake.report.terminal import narrow_table, numbers, words


def estimates_table(result: Identification, title: str) -> Table:
    """Theta with intervals, and whether these pushes tell it."""
    table = narrow_table(
        title, words("parameter"), numbers("estimate"), numbers("90 % interval"), words("told by these pushes"),
        numbers("before"),
    )  # fmt: skip
    for e in result.estimates:
        unit = "" if e.unit == "-" else f" {e.unit}"
        told = "yes" if e.identifiable else "no: anything in this interval"
        if e.identifiable and e.at_bound:
            told = "at its bound: it may lie beyond (theta.bounds)"
        table.add_row(
            e.name, f"{e.value:.4g}{unit}", f"{e.ci90[0]:.4g} to {e.ci90[1]:.4g}", told, f"{e.prior:.4g}{unit}"
        )
    return table


def accuracy_table(result: Identification) -> Table:
    """How well pushes are predicted, before and after."""
    headings = ("path\n[mm]", "path\n[deg]", "end\n[mm]", "end\n[deg]", "force\n[N]", "std of\nsensors")
    table = narrow_table(
        "error of prediction (root mean square)", words("pushes"), words("theta"), *map(numbers, headings)
    )
    rows = (
        ("each, left out", "before", result.before),
        ("each, left out", "after", result.after),
        ("each, before it was learned from", "after those before", result.foreseen),
    )
    for pushes, theta, accuracy in rows:
        if accuracy is not None:
            table.add_row(pushes, theta, *accuracy_cells(accuracy))
    return table


def accuracy_cells(accuracy: Accuracy) -> list[str]:
    """The numbers of an accuracy as text: mm, degrees, mm, degrees, N, standard deviations; a dash for none."""
    numbers = (
        (1e3 * accuracy.position, 2), (math.degrees(accuracy.rotation), 2), (1e3 * accuracy.end_position, 2),
        (math.degrees(accuracy.end_rotation), 2), (accuracy.force, 3), (accuracy.rms, 2),
    )  # fmt: skip
    return [f"{value:.{digits}f}" if math.isfinite(value) else "-" for value, digits in numbers]


def verdict(result: Identification) -> str:
    """In one sentence, how well the baseline model explains the pushes."""
    chi2 = result.reduced_chi2
    quieter = quieter_by(chi2, result.degrees) if chi2 < FAR_BELOW else None
    if quieter is not None:
        return (
            f"The baseline model leaves far less than the noise that counts (reduced chi-square {chi2:.2g}, 1"
            f" expected): that is {quieter:,.0f} times what is left, and nothing smaller than it can be seen. Is it"
            " stated too large (sensors of recording.yaml)?"
        )
    if result.explains:
        return f"The baseline model explains these pushes to their noise (reduced chi-square {chi2:.2f})."
    if result.reduced_chi2 < EXPLAINED:
        scatter = 100.0 * result.friction_scatter
        return (
            f"The baseline model does not explain these pushes: it leaves no more than their noise (reduced"
            f" chi-square {chi2:.2f}), but with frictions that differ by {scatter:.0f} % from push to push."
        )
    return (
        f"The baseline model does not explain these pushes to their noise (reduced chi-square {chi2:.2f}, 1"
        " expected): the intervals are widened for it, and some physics or a sensor's figure is missing."
    )
