"""What a diagnosis of a real recording came to, beside what its publishers say; nothing here is simulated."""

from __future__ import annotations

import csv
import io
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from physid_drake.files import read_text
from physid_drake.recording import read_recording
from physid_drake.validation.scoring.real import RealCase
from physid_drake.validation.scoring.score import NOT_AS_WRITTEN, described, number
from physid_drake.validation.sealing.diagnosing import FRESH_ERRORS, RESULT, attempt_of, verdict_of
from physid_drake.validation.sealing.written import AGAIN, broken, is_number, read_object
from physid_drake.validation.worlds.shapes import Array

"""Beside a diagnosis: end-point errors of its model on pushes that it did not get."""
NEAR: Final = 0.015
"""m from a point of support."""
PUBLISHED: Final = ("quadratic", "poly4")
"""The publishers' models: ellipsoidal and 4th-order limit surface."""
_CORNER: Final = 0.05  # m from the right-angle corner of the CMU triangle to its centroid, along x and along y
_LEG: Final = 0.15
_GRID: Final = 1e-3  # m
_ROUNDS: Final = 50  # in which springs that would pull are let go


@dataclass(frozen=True, kw_only=True)
class Pressure:
    """A recovered pressure map against the points that the object stood on.

    Attributes:
        map: (150, 150) pressure over its mean per square millimetre, rows along x of B; zero outside the triangle.
        points: (3, 2) of support, in B [m]; none of full contact.
        near: share of the weight within `NEAR` of the points; NaN without points, as below.
        even: the same share if the pressure were even.
        arm: mean distance of the weight from the centre of mass [m]: found, of the points, and if it were even. It is
            the largest friction torque over the largest friction force; friction feels hardly more of a pressure.
    """

    map: Array
    points: tuple[tuple[float, float], ...]
    near: float
    even: float
    arm: tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class RealOutcome:
    """One real case.

    Attributes:
        case: which.
        pushes: that were diagnosed.
        skipped: why nothing was diagnosed, or why the diagnosis failed; None where it was.
        verdict: of the diagnosis.
        classes: per finding, its name and those it cannot be told from.
        chi2: reduced chi-square of the baseline model, and after.
        position: held-out errors [m], before and after.
        rotation: held-out errors [rad], before and after.
        force: held-out errors of the hand's force [N], before and after; NaN where none was compared.
        fresh: end-point errors [m, rad] of the model on pushes that the diagnosis did not get.
        published: name to end-point errors [m, rad] of the publishers' models on the diagnosed pushes.
        pressure: the map that was found; None where none was.
        seconds: that the diagnosis took.
    """

    case: RealCase
    pushes: int = 0
    skipped: str | None = None
    verdict: str = ""
    classes: tuple[tuple[str, ...], ...] = ()
    chi2: tuple[float, float] = (math.nan, math.nan)
    position: tuple[float, float] = (math.nan, math.nan)
    rotation: tuple[float, float] = (math.nan, math.nan)
    force: tuple[float, float] = (math.nan, math.nan)
    fresh: tuple[float, float] = (math.nan, math.nan)
    published: dict[str, tuple[float, float]] | None = None
    pressure: Pressure | None = None
    seconds: float = math.nan


def real_outcome(case: RealCase, published: Path, out: Path) -> RealOutcome:
    """Open one case: only now its source is read again, for what it says about the answer.

    Args:
        case: which.
        published: folder of all published files.
        out: folder of the proof.

    Raises:
        ProofError: if what was written of it cannot be read.
    """
    recording, folder = out / "recordings" / case.id, out / "diagnoses" / case.id
    pushes = read_recording(recording).pushes
    attempt = attempt_of(folder)
    if attempt is None or attempt.error is not None:
        error = "there is no diagnosis." if attempt is None else attempt.error
        return RealOutcome(case=case, pushes=len(pushes), skipped=f"failed: {error}")
    verdict = verdict_of(folder)
    said = read_object(folder / RESULT, AGAIN)
    try:
        return RealOutcome(
            case=case,
            pushes=len(pushes),
            verdict=verdict,
            fresh=_fresh(folder / FRESH_ERRORS),
            published=published_errors(published / case.source, [p.note for p in pushes])
            if case.group == "mit"
            else None,
            seconds=attempt.seconds,
            **_said(case, said),
        )
    except NOT_AS_WRITTEN as error:
        raise broken(folder / RESULT, f"it is not as a diagnosis writes it ({described(error)})", AGAIN) from error


def _said(case: RealCase, said: dict[str, Any]) -> dict[str, Any]:
    """What a diagnosis says, as the fields of an outcome."""
    fit = said["fit"]
    return {
        "classes": tuple((e["name"], *e["indistinguishable_from"]) for e in said["effects"]),
        "chi2": (number(said["reduced_chi2_before"]), number(said["reduced_chi2_after"])),
        "position": (number(fit["held_out_rms_before_m"]), number(fit["held_out_rms_after_m"])),
        "rotation": (number(fit["held_out_rms_before_rad"]), number(fit["held_out_rms_after_rad"])),
        "force": (number(fit.get("held_out_rms_before_n")), number(fit.get("held_out_rms_after_n"))),
        "pressure": _pressure(case, said) if case.group == "cmu" else None,
    }


def published_errors(file: Path, notes: list[str]) -> dict[str, tuple[float, float]]:
    """Root mean square end-point errors [m, rad] of the publishers' models.

    Args:
        file: table of end points.
        notes: of the pushes, which end with ``row <number>``, the header being row 1.
    """
    rows = list(csv.DictReader(io.StringIO(read_text(file), newline="")))
    numbers = [int(match[1]) - 2 for note in notes if (match := re.search(r"row (\d+)$", note))]
    found = {}
    for model in PUBLISHED:
        errors = np.array([
            [float(rows[k][f"{model}_end_object_{c}"]) - float(rows[k][f"end_object_{c}"])
             for c in ("x_m", "y_m", "yaw_rad")]
            for k in numbers
        ])  # fmt: skip
        turns = (errors[:, 2] + math.pi) % (2.0 * math.pi) - math.pi
        distances = np.hypot(errors[:, 0], errors[:, 1])
        found[model] = (float(np.sqrt(np.mean(distances**2))), float(np.sqrt(np.mean(turns**2))))
    return found


def points_of_support(name: str) -> Array | None:
    """Points (3, 2) in B [m] that the name of a CMU folder gives in mm from the corner; None for full contact."""
    numbers = name.split("_")
    if len(numbers) != 6:
        return None
    x, y = np.array([float(n) for n in numbers]).reshape(2, 3)
    points: Array = 1e-3 * np.column_stack([x, y]) - _CORNER
    return points


def balanced_pressure(weights: Array) -> Array:
    """Pressure (150, 150) over its mean under the CMU triangle, one value per square millimetre, rows along x.

    A bed of springs of stiffness in proportion to the weights, pressed by a plane so that the load stands under the
    centre of mass: what the cell makes of weights. Springs do not pull.

    Args:
        weights: (n, m) of the cells of a regular grid over the triangle's box, rows along x.
    """
    x, y, inside = _raster()
    cells = (x / _LEG * weights.shape[0]).astype(int), (y / _LEG * weights.shape[1]).astype(int)
    stiffness = weights[cells] * inside
    plane = np.column_stack([np.ones_like(x), x - _CORNER, y - _CORNER])
    pressed = stiffness > 0.0
    for _ in range(_ROUNDS):
        loaded = plane * (stiffness * pressed)[:, None]
        depth = plane @ np.linalg.lstsq(plane.T @ loaded, np.array([1.0, 0.0, 0.0]), rcond=None)[0]
        if np.array_equal(depth > 0.0, pressed):
            break
        pressed = depth > 0.0
    pressure = stiffness * np.maximum(depth, 0.0)
    over_mean: Array = pressure / pressure[inside].mean()
    return over_mean.reshape(round(_LEG / _GRID), -1)


def weight_near(pressure: Array, points: Array) -> tuple[float, float]:
    """Share of the weight within `NEAR` of points under the CMU triangle, and what it would be if even.

    Args:
        pressure: (150, 150) as of `balanced_pressure`.
        points: (k, 2) in B [m].
    """
    x, y, inside = _raster()
    places = np.column_stack([x, y]) - _CORNER
    near = (np.linalg.norm(places[:, None] - points[None], axis=2) <= NEAR).any(axis=1)
    load = pressure.ravel()
    return float(load[near].sum() / load.sum()), float((inside & near).sum() / inside.sum())


def mean_arm(pressure: Array, points: Array | None) -> tuple[float, float, float]:
    """Mean distance of the weight from the centroid [m].

    Args:
        pressure: (150, 150) as of `balanced_pressure`.
        points: (3, 2) of feet in B [m]; None where there are none.

    Returns:
        Of the pressure; of feet at the points that balance, NaN without points; and if the pressure were even.
    """
    x, y, inside = _raster()
    distances = np.hypot(x - _CORNER, y - _CORNER)
    load = pressure.ravel()
    of_points = math.nan
    if points is not None:
        loads = np.linalg.solve(np.vstack([np.ones(3), points.T]), np.array([1.0, 0.0, 0.0]))
        of_points = float(loads @ np.linalg.norm(points, axis=1))
    return float(load @ distances / load.sum()), of_points, float(distances[inside].mean())


def _raster() -> tuple[Array, Array, NDArray[np.bool_]]:
    """Square millimetres of the box: x, y from the right angle [m], and which are in the triangle; (22500,) each."""
    ticks = np.arange(0.5 * _GRID, _LEG, _GRID)
    x, y = (axis.ravel() for axis in np.meshgrid(ticks, ticks, indexing="ij"))
    return x, y, x + y <= _LEG


def _pressure(case: RealCase, said: dict[str, Any]) -> Pressure | None:
    found = next((e for e in said["effects"] if e["name"] == "uneven_support"), None)
    if found is None or not case.name.startswith("cmu_"):
        return None
    points = points_of_support(Path(case.source).name)
    pressure = balanced_pressure(np.array(found["parameters"]["weights"]["value"], dtype=np.float64))
    near, even = (math.nan, math.nan) if points is None else weight_near(pressure, points)
    places = () if points is None else tuple((x, y) for x, y in points.tolist())
    return Pressure(map=pressure, points=places, near=near, even=even, arm=mean_arm(pressure, points))


def _fresh(file: Path) -> tuple[float, float]:
    if not file.is_file():
        return math.nan, math.nan
    errors = read_object(file, remedy := "delete it, and it is written again")
    both = [errors.get("position_m"), errors.get("rotation_rad")]
    if not all(map(is_number, both)):
        raise broken(file, "it must have the numbers 'position_m' and 'rotation_rad'", remedy)
    return number(both[0]), number(both[1])
