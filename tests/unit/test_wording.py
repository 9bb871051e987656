"""Values in messages."""

import pytest

from physid_drake.wording import named, one_line, shown

LARGE = {
    "text": "x" * 70_000,
    "bytes": b"x" * 70_000,
    "list": [0] * 10_000,
    "number": 16**50_000,
    "deep": {1: "y" * 70_000},
}


@pytest.mark.parametrize("value", LARGE.values(), ids=LARGE)
def test_a_value_is_shown_in_sixty_characters(value):
    assert 5 < len(shown(value)) <= 60


def test_a_short_value_is_shown_whole():
    assert [shown(v) for v in ("a", 1.5, None, [1, "b"])] == ["'a'", "1.5", "None", "[1, 'b']"]


def test_no_value_moves_the_cursor():
    class Loud:
        def __repr__(self):
            return "\x1b[2J\n"

    for text in (shown("\x1b[2J\n\u202e"), shown(Loud()), named("a\nb\x1b"), one_line(ValueError("a\n\x1b[2J"))):
        assert text.isprintable()


def test_lists_in_lists_are_no_recursion():
    deep = []
    for _ in range(100_000):
        deep = [deep]
    assert shown(deep) == "a list too large to show"
    while deep:
        deep = deep.pop()


def test_another_librarys_error_is_one_line_and_never_empty():
    assert one_line(ValueError(" two\n lines. ")) == "two lines"
    assert one_line(KeyError()) == "KeyError"
    assert len(one_line(ValueError("x" * 10**6))) == 200
