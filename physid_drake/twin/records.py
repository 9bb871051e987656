"""What the compiled functions read: one record per object and rollout, and one per law."""

from __future__ import annotations

from typing import Final

import numpy as np

BODY: Final = np.dtype([(name, np.float64) for name in (
    "mass",              # kg
    "inertia",           # about the vertical through Bcm [kg m^2]
    "weight",            # on the table [N]
    "com_x", "com_y",    # of Bcm in B [m]
    "com_height",        # of Bcm above the table [m]
    "outline_radius",    # of a disc [m]
    "notched",           # 1 for an outline that is not convex
    "tip_radius",        # of the hand's tip [m]
    "tip_arm",           # of the contact above Bcm [m]
    "hand_friction",     # [-]
    "restitution",       # [-]
    "tip_mass",          # of a tip that gives way [kg]; 0 of one that is moved as its path says
    "tip_stiffness",     # [N/m]
    "tip_damping",       # [N s/m]
    "swing_mass",        # of what swings inside, a part of the whole beside ``mass`` [kg]
    "swing_stiffness",   # [N/m]
    "swing_damping",     # [N s/m]
    "swing_load",        # of the weight that moves with it [N]
    "reach",             # from Bcm, within which slip may turn about a place [m]; the rollout fills it in
    "begin", "end",      # [s]
    "wander_middle", "wander_width",   # when frictions and forces differ most, how long before and after at all [s]
    "wander_support", "wander_hand",   # by which share of friction then: with the table, and at the tip
    "wander_x", "wander_y", "wander_torque",  # by which force at Bcm in W [N], and torque [N m]
    "rough", "grip",     # those frictions' factors in a stage; the rollout fills them in
    "push_x", "push_y", "push_torque",  # and those forces
)])  # fmt: skip
"""The object and the hand's tip in one rollout."""

LAW: Final = np.dtype([("kind", np.int64), *((name, np.float64) for name in "abcdefgh")])
"""One law of the vocabulary; what its numbers are stands with its kind."""

# Friction of a support point: factors, which multiply.
PATCH = 1  # a: ratio within a disc on the table; b, c: its middle [m]; d: its radius [m]
GRADIENT = 2  # 1 + a x + b y [1/m], not below 0 nor above c
PLACE_TABLE = 3  # bilinear: a: first number; b, c: counts along x, y; d, e: first place on the table [m]; f, g: steps
ELLIPSE = 4  # a: ratio of the coefficients on its axes; b: angle of the slippery one [rad]; c: 1: fixed in the object
FALLING = 5  # 1 + a exp(-(slip / b)^2), b in m/s
SPEED_TABLE = 6  # linear over ln(slip): a: first number; b: count; c: first ln(m/s); d: step
HEADING_TABLE = 7  # by the slip's heading in W: a: first number; b: count, of factors and then of their slopes
# Forces at Bcm in W.
PUSH = 16  # a, b: N
VISCOUS = 17  # -a v, and a torque -b w: N s/m, N m s
QUADRATIC = 18  # -a v |v|: N s^2/m^2
SPRING = 19  # to b, c [m], a [N/m] times what exceeds the length d [m]
ATTRACTION = 20  # to b, c [m]: a / (distance^2 + d^2), a in N m^2
FORCE_TABLE = 21  # two bilinear tables over the table, of fx and then of fy [N]: numbers as of PLACE_TABLE
MOTION_TABLE = 22  # along the velocity and then across it [N], over ln(speed): numbers as of SPEED_TABLE; e: slowest
