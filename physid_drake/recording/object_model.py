"""The pushed object as a recording describes it: its shape, and what a scale said of its mass; frozen."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal, TypeAlias, get_args

from physid_drake.errors import RecordingError
from physid_drake.recording.checks import check_choice, check_not_negative, check_positive
from physid_drake.recording.limits import check_lengths
from physid_drake.recording.outlines import check_polygon
from physid_drake.wording import shown

CylinderAxis = Literal["z", "y"]
DEFAULT_MASS_STD_SHARE: Final = 0.01
"""A mass given without a standard deviation is known to this share of itself."""


@dataclass(frozen=True, kw_only=True)
class Box:
    """A box; ``size`` along x, y, z of B, in m."""

    size: tuple[float, float, float]

    def __post_init__(self) -> None:
        check_positive("size_m", "m", *self.size)
        check_lengths("size_m", *self.size)


@dataclass(frozen=True, kw_only=True)
class Cylinder:
    """A cylinder, standing (axis z of B) or lying (axis y, it rolls); radius and length in m."""

    radius: float
    length: float
    axis: CylinderAxis

    def __post_init__(self) -> None:
        check_positive("radius_m", "m", self.radius)
        check_positive("length_m", "m", self.length)
        check_lengths("radius_m", self.radius)
        check_lengths("length_m", self.length)
        check_choice("axis", self.axis, get_args(CylinderAxis))


@dataclass(frozen=True, kw_only=True)
class Prism:
    """An upright prism: counter-clockwise ``polygon`` about its centroid, maybe with notches; ``height``; in m."""

    polygon: tuple[tuple[float, float], ...]
    height: float

    def __post_init__(self) -> None:
        check_positive("height_m", "m", self.height)
        check_lengths("height_m", self.height)
        check_polygon(self.polygon)


@dataclass(frozen=True, kw_only=True)
class MeshShape:
    """A mesh: absolute path of its ``file``, and the ``scale`` that turns its numbers into m."""

    file: Path
    scale: float = 1.0

    def __post_init__(self) -> None:
        check_positive("scale", "", self.scale)
        if not self.file.is_absolute():
            raise RecordingError(
                f"a mesh's file must be an absolute path, but is {shown(str(self.file))}; resolve it."
            )


Shape: TypeAlias = Box | Cylinder | Prism | MeshShape


@dataclass(frozen=True, kw_only=True)
class ObjectModel:
    """The pushed object: its shape, and mass and standard deviation in kg where a scale said so.

    A mass without a standard deviation is known to 1 %, and ``mass_std`` is filled in so.
    """

    shape: Shape
    mass: float | None = None
    mass_std: float | None = None

    def __post_init__(self) -> None:
        check_positive("mass_kg", "kg", self.mass)
        check_not_negative("mass_std_kg", "kg", self.mass_std)
        if self.mass is None and self.mass_std is not None:
            raise RecordingError("mass_std_kg is given without mass_kg; give the mass too, or neither.")
        if self.mass is not None and self.mass_std is not None and self.mass_std >= self.mass:
            raise RecordingError(
                f"mass_std_kg must be below mass_kg, {self.mass:g} kg, but is {self.mass_std:g} kg;"
                " leave both out if nobody weighed the object."
            )
        if self.mass is not None and self.mass_std is None:
            object.__setattr__(self, "mass_std", DEFAULT_MASS_STD_SHARE * self.mass)
