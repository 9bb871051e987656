"""Results as tables for a terminal."""

from __future__ import annotations

import math

from rich.table import Table

from physid_drake.identify import Accuracy, Estimate, Identification
from physid_drake.identify.identify import EXPLAINED
from physid_drake.pushes.stated import FAR_BELOW, quieter_by
from physid_drake.report.pages import sigma_means
from physid_drake.report.terminal import narrow_table, numbers, words


def estimates_table(result: Identification, title: str) -> Table:
    """The parameters with intervals, and whether they are identifiable from these pushes."""
    table = narrow_table(
        title, words("parameter"), numbers("identified"), numbers("90 % interval"), words("identifiable"),
        numbers("initial guess"),
    )  # fmt: skip
    for e in result.estimates:
        unit = "" if e.unit == "-" else f" {e.unit}"
        table.add_row(
            e.name, f"{e.value:.4g}{unit}", f"{e.ci90[0]:.4g} to {e.ci90[1]:.4g}", identifiable_text(e),
            f"{e.prior:.4g}{unit}",
        )  # fmt: skip
    return table


def identifiable_text(estimate: Estimate) -> str:
    """Whether a parameter is identifiable, in words."""
    if not estimate.identifiable:
        return "no (interval is the prior)"
    return "yes, at its bound (theta.bounds)" if estimate.at_bound else "yes"


def accuracy_table(result: Identification) -> Table:
    """How well pushes are predicted, with the initial guess and with what was identified."""
    headings = ("path\n[mm]", "path\n[deg]", "end\n[mm]", "end\n[deg]", "force\n[N]", "path\n[sigma]")
    table = narrow_table(
        "prediction error (root mean square)", words("pushes"), words("parameters"), *map(numbers, headings),
        caption=sigma_means(known=result.case.noise.known),
    )  # fmt: skip
    rows = (
        ("held-out", "initial guess", result.before),
        ("held-out", "identified", result.after),
        ("next push", "from earlier pushes", result.foreseen),
    )
    for pushes, parameters, accuracy in rows:
        if accuracy is not None:
            table.add_row(pushes, parameters, *accuracy_cells(accuracy))
    return table


def accuracy_cells(accuracy: Accuracy) -> list[str]:
    """The numbers of an accuracy as text: mm, degrees, mm, degrees, N, sigma; a dash for none."""
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
            f"The errors of the baseline model are far below the assumed noise (reduced chi-square {chi2:.2g}; 1 ="
            f" noise only): the noise is {quieter:,.0f} times as large, and smaller effects cannot be detected. Is it"
            " stated too large (sensors of recording.yaml)?"
        )
    if result.explains:
        return f"The baseline model explains these pushes (reduced chi-square {chi2:.2f}; 1 = noise only)."
    if result.reduced_chi2 < EXPLAINED:
        scatter = 100.0 * result.friction_scatter
        return (
            "The baseline model explains these pushes to their noise (reduced chi-square"
            f" {chi2:.2f}) only with a friction scatter between pushes of {scatter:.0f} %, which is too much."
        )
    return (
        f"The baseline model does not explain these pushes (reduced chi-square {chi2:.2f}; 1 = noise only): the"
        " intervals are widened accordingly. Physics is missing, or a sensor's noise is stated too small."
    )
