"""Whatever units, axes and ways of writing a rotation a log has, its map makes the same recording of it."""

import itertools
import math

import numpy as np
import pytest
from drawn import arrays, costly, folder, generators, numbers
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from physid_drake.convert import convert_table
from physid_drake.convert.conventions import (
    forces_in_world,
    places_in_world,
    rotation_of,
    rotations_in_world,
    with_offset,
    wxyz_of,
)
from physid_drake.convert.mapping import ForceMap, Offset, Turn, World
from physid_drake.convert.source_frame import SourceFrame
from physid_drake.convert.units import ANGLES, FORCES, LENGTHS, TIMES
from physid_drake.recording import PoseStream

# ----------------------------------------------------------------------------------------------------- a table there

COLUMNS = ("t", "x", "y", "z", "r1", "r2", "r3", "hx", "hy", "hz", "fx", "fy", "fz")
MAP = """\
format: physid-map/1
recording:
  name: any
  object: {{shape: box, size_m: [0.1, 0.08, 0.06], mass_kg: 0.4}}
  table: {{size_m: [1.2, 0.8], centre_m: [0, 0]}}
  hand: {{tip: sphere, radius_m: 0.01, stream: measured}}
world: {world}
time: {{column: t, unit: {time}}}
object:
  position: {{columns: [x, y, z], unit: {length}}}
  rotation: {{columns: [r1, r2, r3], as: euler, order: {order}, unit: {angle}}}
hand: {{position: {{columns: [hx, hy, hz], unit: {length}}}, rotation: none}}
force: {{columns: [fx, fy, fz], unit: {force}}}
pushes: {{cut: whole}}
"""
# By their definitions: an inch, a foot, the standard fall, a pound.
FALL, POUND = 9.80665, 0.45359237
SIZES = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "length": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "inch": 0.0254, "in": 0.0254, "ft": 12 * 0.0254},
    "angle": {"rad": 1.0, "deg": math.pi / 180.0, "mrad": 1e-3},
    "force": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "kgf": FALL, "gf": 1e-3 * FALL, "lbf": POUND * FALL},
}
SI = {"time": "s", "length": "m", "angle": "rad", "force": "N"}
AXES = [
    [sign + axis for sign, axis in zip(signs, order, strict=True)]
    for order in ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx")
    for signs in itertools.product(("", "-"), repeat=3)
]


def matrix_of(axes):
    """A (3, 3), whose rows are these axes of the source."""
    rows = np.zeros((3, 3))
    for k, axis in enumerate(axes):
        rows[k, "xyz".index(axis[-1])] = -1.0 if axis[0] == "-" else 1.0
    return rows


def table(rng, count=9):
    """A push as a table in SI units, column by column."""
    away = np.linspace(0.0, 0.05, count)[:, None] * rng.normal(size=3)
    turned = 0.3 * rng.normal(size=(1, 3)) + 0.02 * rng.normal(size=(count, 3))
    place = rng.normal(size=3)
    hand = place + away + [-0.06, 0.0, 0.0] + 1e-3 * rng.normal(size=(count, 3))
    times = 0.02 * np.arange(count) + rng.uniform()
    return np.column_stack([times, place + away, turned, hand, rng.normal(size=(count, 3))])


def converted(values, world="{}", order="XYZ", **units):
    """The push that comes of a table (n, 13)."""
    lines = [",".join(COLUMNS), *(",".join(map(repr, row)) for row in values.tolist())]
    with folder() as place:
        (place / "log.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
        (place / "map.yaml").write_text(MAP.format(world=world, order=order, **SI | units), encoding="utf-8")
        (push,) = convert_table(place / "log.csv", place / "made", place / "map.yaml").pushes
    return push


@costly
@given(generators(), *(st.sampled_from(sorted(kind)) for kind in SIZES.values()))
def test_a_table_in_other_units_is_that_table_in_si_units(rng, time, length, angle, force):
    values = table(rng)
    sizes = [SIZES["time"][time], SIZES["length"][length], SIZES["angle"][angle], SIZES["force"][force]]
    sizes = np.repeat([*sizes[:3], sizes[1], sizes[3]], [1, 3, 3, 3, 3])
    values = values / sizes
    push = converted(values, time=time, length=length, angle=angle, force=force)
    same = converted(values * sizes)
    for one, other in ((push.object, same.object), (push.hand, same.hand)):
        assert one.times == pytest.approx(other.times, rel=1e-15, abs=1e-15)
        assert one.positions == pytest.approx(other.positions, rel=1e-15, abs=1e-15)
        assert one.quaternions == pytest.approx(other.quaternions, abs=1e-14)
    assert push.force.forces == pytest.approx(same.force.forces, rel=1e-15)


def test_every_unit_of_a_map_is_as_large_as_it_is_defined():
    for kind, units in (("time", TIMES), ("length", LENGTHS), ("angle", ANGLES), ("force", FORCES)):
        assert dict(units) == pytest.approx(SIZES[kind], rel=1e-14)


@costly
@given(generators(), st.sampled_from(AXES))
def test_a_table_by_other_axes_is_that_table_with_its_columns_exchanged(rng, axes):
    """p_W = A p_S; turns about axes that a mirror exchanges go the other way round."""
    values, rows = table(rng), matrix_of(axes)
    left = np.linalg.det(rows) < 0.0
    push = converted(values, f"{{axes: [{', '.join(axes)}], left_handed: {str(left).lower()}}}")
    order = "".join(axis[-1].upper() for axis in axes)
    places, hand, force = (values[:, k : k + 3] @ rows.T for k in (1, 7, 10))
    # About W's axis that was x of the source comes first, then y, then z: the angles stay in their columns.
    about = ["XYZ"[order.index(axis)] for axis in "XYZ"]
    signs = np.linalg.det(rows) * np.array([rows[order.index(axis)].sum() for axis in "XYZ"])
    other = np.column_stack([values[:, :1], places, signs * values[:, 4:7], hand, force])
    same = converted(other, order="".join(about))
    assert np.array_equal(push.object.positions, same.object.positions)
    assert np.array_equal(push.hand.positions, same.hand.positions)
    assert np.array_equal(push.force.forces, same.force.forces)
    assert np.abs(push.object.quaternions - same.object.quaternions).max() < 1e-14  # measured 1e-15


@given(generators(), st.sampled_from(AXES), st.booleans())
def test_what_came_into_w_goes_back_by_any_frame(rng, axes, inverse):
    quaternions = rng.normal(size=(2, 4))
    origin_turn, offset_turn = (tuple(q / np.linalg.norm(q)) for q in quaternions)
    world = World(axes=matrix_of(axes), origin=tuple(rng.normal(size=3)), rotation=origin_turn)
    offset = Offset(translation=tuple(0.1 * rng.normal(size=3)), rotation=offset_turn)
    places, turns = rng.normal(size=(5, 3)), Rotation.from_rotvec(rng.normal(size=(5, 3)))
    read = turns.inv() if inverse else turns
    positions, turned = with_offset(places_in_world(places, world), rotations_in_world(read, world), offset)
    stream = PoseStream(times=np.arange(5.0), positions=positions, quaternions=wxyz_of(turned))
    frame = SourceFrame(world=world, offset=offset, inverse=inverse)
    assert frame.places(stream) == pytest.approx(places, abs=1e-13)
    assert (frame.rotations(stream) * turns.inv()).magnitude().max() < 1e-12
    for again in (frame.with_places(stream, places), frame.with_rotations(stream, turns)):
        assert again.positions == pytest.approx(positions, abs=1e-13)
        assert np.abs((again.quaternions * stream.quaternions).sum(axis=1)) == pytest.approx(1.0, abs=1e-13)


# ---------------------------------------------------------------------------------------------------------- rotations

UNIT = {
    "X": lambda a: np.array([[1, 0, 0], [0, math.cos(a), -math.sin(a)], [0, math.sin(a), math.cos(a)]]),
    "Y": lambda a: np.array([[math.cos(a), 0, math.sin(a)], [0, 1, 0], [-math.sin(a), 0, math.cos(a)]]),
    "Z": lambda a: np.array([[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]]),
}
angles = arrays(-3.1, 3.1, 3)
orders = st.sampled_from([a + b + c for a in "XYZ" for b in "XYZ" for c in "XYZ" if a != b != c])
HERE = World()


def random_rotation(rng):
    return Rotation.from_quat(rng.normal(size=(1, 4)))


def worlds():
    """Origins, axes and rotations of W in a log's world."""

    def made(axes, origin, rng):
        turn = tuple(float(q) for q in wxyz_of(random_rotation(rng))[0])
        return World(axes=matrix_of(axes), origin=tuple(origin.tolist()), rotation=turn)

    return st.builds(made, st.sampled_from(AXES), arrays(-2.0, 2.0, 3), generators())


@given(angles, orders)
def test_capital_euler_angles_turn_about_the_bodys_axes_and_small_ones_about_the_worlds(turned, order):
    first, second, third = (UNIT[axis](angle) for axis, angle in zip(order, turned.tolist(), strict=True))
    of_body = rotation_of(Turn(kind="euler", order=order), turned[None], 1.0, HERE).as_matrix()[0]
    of_world = rotation_of(Turn(kind="euler", order=order.lower()), turned[None], 1.0, HERE).as_matrix()[0]
    assert np.abs(of_body - first @ second @ third).max() < 1e-14
    assert np.abs(of_world - third @ second @ first).max() < 1e-14


@given(generators(), st.booleans())
def test_a_rotation_is_the_same_however_it_is_written(rng, inverse):
    """The matrix of w, x, y, z in closed form; and its inverse the transposed one."""
    w, x, y, z = quaternion = wxyz_of(random_rotation(rng))[0]
    matrix = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    half = math.atan2(float(np.linalg.norm(quaternion[1:])), w)
    vector = 2.0 * half * quaternion[1:] / np.linalg.norm(quaternion[1:])
    written = {
        "wxyz": quaternion, "xyzw": np.array([x, y, z, w]), "matrix": matrix.ravel(),
        "rotation_vector": np.degrees(vector),
    }  # fmt: skip
    for kind, values in written.items():
        scale = ANGLES["deg" if kind == "rotation_vector" else "rad"]
        found = rotation_of(Turn(kind=kind, inverse=inverse), values[None], scale, HERE).as_matrix()[0]
        assert np.abs(found - (matrix.T if inverse else matrix)).max() < 1e-14, kind


@given(worlds(), numbers(-3.0, 3.0))
def test_a_yaw_turns_about_the_vertical_of_w_whichever_axis_of_the_log_that_is(world, yaw):
    """Counter-clockwise as the log sees it: the other way round in W, where the log's world is left-handed."""
    level = World(axes=world.axes)
    (found,) = rotations_in_world(
        rotation_of(Turn(kind="yaw"), np.array([[yaw]]), 1.0, level), level
    ).as_matrix()  # fmt: skip
    assert np.abs(found - UNIT["Z"](np.linalg.det(world.axes) * yaw)).max() < 1e-14


@given(worlds(), generators())
def test_where_w_lies_changes_no_distance_and_takes_a_body_along(world, rng):
    """What is fixed in a body stays fixed in it: p_W(o + R v) - p_W(o) = R_W A v for every v of it."""
    place, points, rotation = rng.normal(size=3), rng.normal(size=(4, 3)), random_rotation(rng)
    first, *others = places_in_world(place + np.vstack([np.zeros(3), rotation.apply(points)]), world)
    moved = np.array(others) - first
    assert np.abs(np.linalg.norm(moved, axis=1) - np.linalg.norm(points, axis=1)).max() < 1e-14
    assert np.abs(moved - rotations_in_world(rotation, world).apply(points @ world.axes.T)).max() < 1e-14
    assert np.abs(places_in_world(np.array(world.origin)[None], world)).max() < 1e-15


@given(generators())
def test_offsets_that_follow_one_another_are_one_offset(rng):
    turns = [random_rotation(rng) for _ in range(2)]
    shifts = rng.normal(size=(2, 3))
    one, other = (
        Offset(translation=tuple(s.tolist()), rotation=tuple(wxyz_of(t)[0].tolist()))
        for s, t in zip(shifts, turns, strict=True)
    )
    both = Offset(
        translation=tuple((shifts[0] + turns[0].apply(shifts[1])[0]).tolist()),
        rotation=tuple(wxyz_of(turns[0] * turns[1])[0].tolist()),
    )
    places, rotation = rng.normal(size=(1, 3)), random_rotation(rng)
    step, turned = with_offset(*with_offset(places, rotation, one), other)
    straight, same = with_offset(places, rotation, both)
    assert np.abs(step - straight).max() < 1e-14
    assert np.abs(turned.as_matrix() - same.as_matrix()).max() < 1e-14


@given(worlds(), generators(), numbers(0.0, 20.0))
def test_the_hand_feels_what_the_object_feels_the_other_way_round_and_its_tool(world, rng, weight):
    """Newton's third law: of the forces on both and the tool's weight nothing is left."""
    on_object, hand = rng.normal(size=(1, 3)), random_rotation(rng)
    for in_hand in (False, True):
        plain = forces_in_world(on_object, ForceMap(in_hand=in_hand), hand, world)
        assert np.abs(np.linalg.norm(plain) - np.linalg.norm(on_object)) < 1e-14
        down = np.array([0.0, 0.0, -weight])
        felt = (hand.inv().apply(down) if in_hand else _in_source(down, world)) - on_object
        sensor = ForceMap(in_hand=in_hand, on_hand=True, weight=weight)
        assert np.abs(forces_in_world(felt, sensor, hand, world) - plain).max() < 1e-13


def _in_source(vector, world):
    """A direction of W by the log's axes."""
    return Rotation.from_quat(np.roll(world.rotation, -1)).inv().apply(vector) @ world.axes
