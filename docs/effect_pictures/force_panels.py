"""Left panels of effects that are forces on the object."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from physid_drake.effects.law_values import object_at
from physid_drake.report.svg import INK
from physid_drake.report.table_view import MM, draw_ground

from .drawing import LEFT_ASPECT, PLAIN, WITH, curve, curve_id, draw_landmarks, put_label
from .laws import facts, force_at
from .picture import Picture
from .scenes import FRICTION, LYING, MASS, WEIGHT


def drag_over_speed(axes: Axes, picture: Picture) -> None:
    """A drag, beside what dry friction takes."""
    speeds = np.linspace(0.0, 0.6, 61)
    curve(axes, speeds, np.zeros(len(speeds)), plain=True)
    curve(axes, speeds, [-force_at(picture.effect, velocity=complex(v)).real for v in speeds])
    axes.axhline(FRICTION * WEIGHT, color=INK, linewidth=0.8, linestyle="-.")
    put_label(axes, 0.01, FRICTION * WEIGHT + 0.05, "friction with the table")
    axes.set(xlabel="speed of the object [m/s]", ylabel="drag [N]", xlim=(0.0, 0.6), ylim=(-0.03, 1.25))
    axes.grid()


def _arrows(axes: Axes, picture: Picture, box: tuple[float, float, float, float], arrow: float) -> None:
    """The force on the object at places of a grid; ``arrow`` is the longest, in mm."""
    draw_ground(axes, box, LEFT_ASPECT)
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    x, y = np.meshgrid(np.linspace(left, right, 11)[1:-1], np.linspace(low, high, 8)[1:-1])
    forces = np.array([force_at(picture.effect, place=complex(p)) for p in ((x + 1j * y) / MM).ravel()])
    strongest = float(np.abs(forces).max())
    pulled = np.abs(forces) > 0.0
    axes.quiver(
        x.ravel()[pulled], y.ravel()[pulled], forces.real[pulled], forces.imag[pulled], angles="xy", scale_units="xy",
        scale=strongest / arrow, width=0.007, color=WITH, pivot="middle", gid=curve_id(axes, False),
    )  # fmt: skip
    axes.plot(x.ravel()[~pulled], y.ravel()[~pulled], ".", color=PLAIN, markersize=2.5)
    put_label(axes, left + 0.015 * (right - left), high - 0.055 * (high - low), f"longest arrow {strongest:.2f} N")
    axes.texts[-1].set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 1.0})


def field_of_tilt(axes: Axes, picture: Picture) -> None:
    """The same force everywhere."""
    _arrows(axes, picture, (-150.0, -110.0, 150.0, 110.0), 24.0)


def field_of_tether(axes: Axes, picture: Picture) -> None:
    """A pull that begins where the cable is taut."""
    _arrows(axes, picture, (-110.0, -130.0, 290.0, 190.0), 45.0)
    draw_landmarks(axes, picture.effect)


def pull_over_distance(axes: Axes, picture: Picture) -> None:
    """A magnet's pull."""
    magnet = picture.effect
    away = np.linspace(0.0, 0.15, 101)
    at = complex(magnet.x, magnet.y)  # type: ignore[attr-defined]
    pulls = [abs(force_at(magnet, place=at - d)) for d in away]
    curve(axes, MM * away, np.zeros(len(away)), plain=True)
    curve(axes, MM * away[1:], pulls[1:])
    axes.axhline(FRICTION * WEIGHT, color=INK, linewidth=0.8, linestyle="-.")
    put_label(axes, 150.0, FRICTION * WEIGHT + 0.06, "friction with the table", ha="right")
    axes.axvline(MM * magnet.core, color=INK, linewidth=0.8, linestyle=":")  # type: ignore[attr-defined]
    put_label(axes, MM * magnet.core + 2.0, 0.08, "core")  # type: ignore[attr-defined]
    axes.set(xlabel="distance to the point [mm]", ylabel="pull [N]", xlim=(0.0, 150.0), ylim=(-0.03, 1.35))
    axes.grid()


def jolt(axes: Axes, picture: Picture) -> None:
    """The force of the swinging mass on an object that a jolt sets in motion at a constant speed."""
    speed, span = 0.3, 2e-3
    (law,), times = picture.effect.laws(facts()), np.arange(-100, 501) * span  # one law: the mass swings on
    forces = []
    for time in times:
        moves = time >= 0.0
        here = object_at(
            velocity=complex(speed) if moves else 0j, place=complex(speed * max(time, 0.0)), mass=MASS,
            time=time - times[0], span=span,
        )  # fmt: skip
        forces.append(law.wrench(here).fx)
    curve(axes, times[::5], np.zeros(len(times[::5])), plain=True)
    curve(axes, times[::5], forces[::5])
    axes.set(xlabel="time since the jolt [s]", ylabel="force on the object [N]", xlim=(-0.2, 1.0))
    axes.grid()


def rolling_force(axes: Axes, picture: Picture) -> None:
    """Coulomb's law of rolling."""
    radius = LYING.shape.radius  # type: ignore[union-attr]
    speeds = np.concatenate([np.linspace(-0.3, -1e-3, 20), np.linspace(-1e-5, 1e-5, 9), np.linspace(1e-3, 0.3, 20)])
    forces = [force_at(picture.effect, rolling_radius=radius, velocity=complex(v), span=1e-3).real for v in speeds]
    curve(axes, speeds, np.zeros(len(speeds)), plain=True)
    curve(axes, speeds, forces)
    axes.set(xlabel="rolling speed [m/s]", ylabel="braking force [N]", xlim=(-0.3, 0.3), ylim=(-0.16, 0.16))
    axes.grid()
