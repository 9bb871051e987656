"""Where most is missing, in words."""

import math

import pytest

from physid_drake.diagnose.location import windows_in_words
from physid_drake.diagnose.values import Window


def window(push, place=(0.0, 0.0), heading=0.0, speed=0.05):
    return Window(
        push=f"pushes/{push:03d}.csv", start=0.0, end=0.1, place=place, heading=math.radians(heading), speed=speed,
        phase="contact",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("windows", "said"),
    [
        ([], ""),
        (
            [window(3, (0.1, -0.02), 90.0, 0.05)],
            "push 003: around (100, -20) mm, heading 90 deg, at 50 mm/s",
        ),
        (
            [window(7, (0.12, 0.0), 350.0, 0.2), window(3, (0.1, 0.02), 10.0, 0.04), window(7, (0.11, 0.01), 0.0)],
            "pushes 003 and 007: around (110, 10) mm, headings 350 through 0 to 10 deg, at 40 to 200 mm/s",
        ),
        (
            [window(1, (-0.1, 0.0), 0.0), window(2, (0.1, 0.3), 120.0), window(4, (0.0, 0.1), 240.0)],
            "pushes 001, 002 and 004: between (-100, 0) and (100, 300) mm, all headings, at 50 mm/s",
        ),
    ],
)
def test_where(windows, said):
    assert windows_in_words(windows) == (f"clearest in {said}" if said else "")


def test_the_words_hold_every_window():
    """Any set of windows lies within what is said of it."""
    windows = [window(k, (0.01 * k, -0.02 * k), 80.0 + 10.0 * k, 0.03 + 0.01 * k) for k in range(5)]
    said = windows_in_words(windows)
    assert "(0, -80) and (40, 0)" in said and "80 to 120 deg" in said and "30 to 70 mm/s" in said
