"""Which picture each effect has."""

from __future__ import annotations

from physid_drake.effects import effect_named

from .force_panels import drag_over_speed, field_of_tether, field_of_tilt, jolt, pull_over_distance, rolling_force
from .friction_panels import friction_over_pushes, friction_over_slip, limit_curve, place_map
from .hand_and_tracker_panels import (
    deflection,
    lagging_tip,
    late_report,
    rebound,
    scaled_places,
    shifted_tip,
    tracked_frame,
)
from .object_panels import centre_of_mass, grid_of_weights, radii_of_gyration, two_sizes
from .picture import Picture
from .pushes_panel import above, along_x, heading, over_time
from .scenes import LYING, push

THROWS = (push(0, 0.25, 0.06), push(0, 0.5, 0.08))
TWO_SPEEDS = ("0.25 m/s", "0.5 m/s")

FRICTION = (
    Picture(
        effect=effect_named("stribeck_friction")(excess=0.5, speed=0.3),
        law=friction_over_slip, law_title="Friction over slip",
        pushes=THROWS, pushes_title="Two pushes that let go", shown=over_time(along_x, "x [mm]", TWO_SPEEDS),
    ),
    Picture(
        effect=effect_named("anisotropic_table")(ratio=2.0, angle=0.5),
        law=limit_curve("table"), law_title="Limit curve of the friction force",
        pushes=(push(0, 0.5, 0.05, at=(0.06, 0.0)), push(90, 0.5, 0.05, at=(-0.06, -0.02), yaw=90)),
        pushes_title="Two pushes that let go, from above", shown=above,
    ),
    Picture(
        effect=effect_named("anisotropic_object")(ratio=2.0, angle=0.5),
        law=limit_curve("object"), law_title="Limit curve of the friction force",
        pushes=(push(0, 0.5, 0.05, at=(-0.16, 0.0)), push(0, 0.5, 0.05, at=(0.07, 0.0), yaw=90)),
        pushes_title="One push, two headings of the object", shown=above,
    ),
    Picture(
        effect=effect_named("friction_patch")(ratio=2.5, x=0.12, y=0.06, radius=0.05),
        law=place_map, law_title="Friction by place",
        pushes=(push(0, 0.5, 0.06, at=(0.0, 0.03)), push(0, 0.5, 0.06, at=(0.0, -0.09))),
        pushes_title="Two pushes that let go, from above", shown=above,
    ),
    Picture(
        effect=effect_named("friction_gradient")(slope_x=3.0, slope_y=1.5),
        law=place_map, law_title="Friction by place",
        pushes=(push(0, 0.5, 0.06, at=(0.0, 0.06)), push(180, 0.5, 0.06, at=(0.0, -0.06))),
        pushes_title="Two pushes that let go, from above", shown=above,
    ),
    Picture(
        effect=effect_named("friction_drift")(per_push=-0.04),
        law=friction_over_pushes, law_title="Friction over the number of the push",
        pushes=tuple(push(0, 0.5, 0.08, order=order) for order in (0, 6, 12)),
        pushes_title="One push, made three times",
        shown=over_time(along_x, "x [mm]", ("push 0", "push 6", "push 12")),
    ),
)  # fmt: skip

FORCES = (
    Picture(
        effect=effect_named("viscous_drag")(coefficient=1.0),
        law=drag_over_speed, law_title="Drag over speed",
        pushes=THROWS, pushes_title="Two pushes that let go", shown=over_time(along_x, "x [mm]", TWO_SPEEDS),
    ),
    Picture(
        effect=effect_named("quadratic_drag")(coefficient=2.5),
        law=drag_over_speed, law_title="Drag over speed",
        pushes=THROWS, pushes_title="Two pushes that let go", shown=over_time(along_x, "x [mm]", TWO_SPEEDS),
    ),
    Picture(
        effect=effect_named("table_tilt")(x=0.03, y=0.05),
        law=field_of_tilt, law_title="Force on the object",
        pushes=(push(0, 0.5, 0.05, at=(0.0, 0.05)), push(180, 0.5, 0.05, at=(0.05, -0.08))),
        pushes_title="Two pushes that let go, from above", shown=above,
    ),
    Picture(
        effect=effect_named("sloshing")(fraction=0.4, frequency=3.0, damping=0.05),
        law=jolt, law_title="Force after a jolt to 0.3 m/s",
        pushes=THROWS,
        pushes_title="Two pushes that let go", shown=over_time(along_x, "x [mm]", TWO_SPEEDS),
    ),
    Picture(
        effect=effect_named("rolling_resistance")(coefficient=8e-4),
        law=rolling_force, law_title="Braking force over speed",
        pushes=(push(0, 0.1, 0.05, shape=LYING, end=2.0), push(0, 0.2, 0.05, shape=LYING, end=2.0)),
        pushes_title="Two pushes of a lying cylinder", shown=over_time(along_x, "x [mm]", ("0.1 m/s", "0.2 m/s")),
        end=2.0, rolls=True,
    ),
    Picture(
        effect=effect_named("tether")(stiffness=6.0, x=0.0, y=0.1, rest_length=0.08),
        law=field_of_tether, law_title="Force on the object",
        pushes=(push(0, 0.5, 0.08, at=(0.0, -0.04)), push(180, 0.25, 0.08, at=(0.25, 0.08))),
        pushes_title="Two pushes, from above", shown=above,
    ),
    Picture(
        effect=effect_named("magnet")(strength=8e-4, x=0.13, y=0.06, core=0.03),
        law=pull_over_distance, law_title="Pull over distance",
        pushes=(push(0, 0.5, 0.06), push(0, 0.5, 0.06, at=(0.0, 0.12))),
        pushes_title="Two pushes that let go, from above", shown=above,
    ),
)  # fmt: skip

OBJECT = (
    Picture(
        effect=effect_named("uneven_support")(weights=((0.2, 0.2, 0.2), (0.2, 6.0, 0.2), (0.2, 0.2, 0.2))),
        law=grid_of_weights, law_title="Weights under the object",
        pushes=(push(90, 0.5, 0.05, at=(-0.1, 0.0), aside=0.01), push(90, 0.3, 0.05, at=(0.1, 0.0), aside=-0.02)),
        pushes_title="Two pushes that let go, from above", shown=above,
    ),
    Picture(
        effect=effect_named("com_offset")(x=0.02, y=0.01),
        law=centre_of_mass, law_title="Centre of mass",
        pushes=(push(90, 0.1, 0.10, at=(-0.09, 0.0)), push(0, 0.1, 0.10, at=(0.06, 0.02))),
        pushes_title="Two slow pushes, from above", shown=above, end=1.2,
    ),
    Picture(
        effect=effect_named("rotational_inertia")(ratio=2.0),
        law=radii_of_gyration, law_title="Radius of gyration",
        pushes=(push(90, 0.5, 0.06, aside=-0.03), push(90, 0.25, 0.06, aside=0.03)),
        pushes_title="Two pushes off the centre",
        shown=over_time(heading, "yaw [deg]", ("0.5 m/s", "0.25 m/s"), hand=False),
        hand=False,
    ),
    Picture(
        effect=effect_named("size_error")(ratio=1.1),
        law=two_sizes, law_title="Outline from above",
        pushes=(
            push(0, 0.1, 0.09, at=(0.0, 0.07), gap=0.012),
            push(0, 0.1, 0.09, at=(0.0, -0.07), aside=-0.02, gap=0.012),
        ),
        pushes_title="Two slow pushes, from above", shown=above, end=1.2,
    ),
)  # fmt: skip

HAND = (
    Picture(
        effect=effect_named("restitution")(coefficient=0.4),
        law=rebound, law_title="Rebound at the touch",
        pushes=(push(0, 0.4, 0.042, gap=0.03), push(0, 0.2, 0.06, gap=0.015)),
        pushes_title="A tap and a long push", shown=over_time(along_x, "x [mm]", ("0.4 m/s", "0.2 m/s")), end=0.6,
    ),
    Picture(
        effect=effect_named("hand_compliance")(compliance=0.005, damping=0.3, share=0.2),
        law=deflection, law_title="Deflection of the tip at rest",
        pushes=(push(0, 0.1, 0.04), push(0, 0.3, 0.08)),
        pushes_title="Two pushes", shown=over_time(along_x, "x [mm]", ("0.1 m/s", "0.3 m/s")), end=0.6,
    ),
    Picture(
        effect=effect_named("actuator_lag")(time_constant=0.05),
        law=lagging_tip, law_title="Speed of the tip",
        pushes=(push(0, 0.3, 0.08), push(0, 0.1, 0.04)),
        pushes_title="Two pushes", shown=over_time(along_x, "x [mm]", ("0.3 m/s", "0.1 m/s")), end=0.6,
    ),
    Picture(
        effect=effect_named("hand_offset")(x=0.004, y=0.008),
        law=shifted_tip, law_title="Place of the tip",
        pushes=(
            push(0, 0.1, 0.09, at=(0.0, 0.07), gap=0.012),
            push(0, 0.1, 0.09, at=(0.0, -0.07), aside=-0.015, gap=0.012),
        ),
        pushes_title="Two slow pushes, from above", shown=above, end=1.2,
    ),
)  # fmt: skip

TRACKER = (
    Picture(
        effect=effect_named("tracker_latency")(delay=0.05),
        law=late_report, law_title="True and reported place",
        pushes=(push(0, 0.3, 0.08), push(0, 0.1, 0.04)),
        pushes_title="Two pushes, as reported",
        shown=over_time(along_x, "x [mm]", ("0.3 m/s", "0.1 m/s")), end=0.6,
    ),
    Picture(
        effect=effect_named("tracker_bias")(x=0.012, y=0.006, yaw=0.15),
        law=tracked_frame, law_title="Tracked frame",
        pushes=(
            push(0, 0.1, 0.09, at=(0.0, 0.07), gap=0.02),
            push(0, 0.1, 0.09, at=(0.0, -0.07), aside=-0.02, gap=0.02),
        ),
        pushes_title="Two slow pushes, as reported", shown=above, end=1.2,
    ),
    Picture(
        effect=effect_named("tracker_scale")(ratio=1.1),
        law=scaled_places, law_title="True and reported places",
        pushes=(push(0, 0.1, 0.09, at=(-0.2, 0.09)), push(90, 0.1, 0.09, at=(0.16, 0.02), aside=0.02)),
        pushes_title="Two slow pushes, as reported", shown=above, end=1.2,
    ),
)  # fmt: skip

PICTURES = {picture.effect.name: picture for picture in (*FRICTION, *FORCES, *OBJECT, *HAND, *TRACKER)}
"""By the name of the effect."""
