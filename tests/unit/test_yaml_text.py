"""YAML as people write it."""

import os

import pytest

from physid_drake.errors import ConfigError
from physid_drake.yaml_text import parsed, read_yaml


def test_numbers_are_what_they_look_like():
    assert parsed("[10, -3, 0, 1_000, 0x1F, 1e-3, 0.5]", "here") == [10, -3, 0, 1000, 31, "1e-3", 0.5]


@pytest.mark.parametrize("text", ["010", "1:30", "-007", "0b11"])
def test_a_number_in_another_base_is_refused(text):
    with pytest.raises(ConfigError, match=f"here: is no YAML: '{text}' is no number in base 10"):
        parsed(f"mass: {text}", "here")


def test_a_key_that_is_there_twice_is_refused():
    with pytest.raises(ConfigError, match="key 'mass_kg' is there twice"):
        parsed("object: {mass_kg: 1.0, shape: box, mass_kg: 2.0}", "here")


def test_what_a_template_gives_may_be_given_again():
    text = "_base: &base {budget: 3, seed: 1}\nrun: {<<: *base, budget: 4}"
    assert parsed(text, "here")["run"] == {"budget": 4, "seed": 1}


def test_a_path_that_cannot_be_is_one_line(tmp_path):
    with pytest.raises(ConfigError, match="cannot be read"):
        read_yaml(tmp_path / "a\0b.yaml", "here")


def laughs(depth, form="[{}]"):
    """Nine aliases in each of many lists: 9**depth values in a kilobyte."""
    lines = ["a0: &a0 lol"]
    for k in range(depth):
        lines.append(f"a{k + 1}: &a{k + 1} " + form.format(", ".join([f"*a{k}"] * 9)))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    "text",
    [
        laughs(9),
        laughs(400),
        "a: &a0 {k: 1}\n" + "".join(f"b{k}: &a{k + 1} {{<<: [*a{k}, *a{k}]}}\n" for k in range(60)),
        "a: &a [*a]",
        "a: &a {b: [1, {c: *a}]}",
        "a: &a {<<: *a}",
        "a: &a {<<: [*a, *a]}",
        "? &a [*a]\n: 1",
        "[" + "1, " * 20_000 + "1]",
    ],
    ids=["lists", "deep", "merged", "ring", "long ring", "merged ring", "merged twice", "key", "plain"],
)
def test_a_text_that_stands_for_too_much_is_refused_at_once(text):
    with pytest.raises(ConfigError, match="here: is no YAML: ") as caught:
        parsed(text, "here")
    assert len(str(caught.value)) < 300


def test_many_aliases_of_little_are_read():
    assert len(parsed(laughs(3), "here")["a3"]) == 9
    assert parsed("[&a [1, 2], *a, *a]", "here") == [[1, 2]] * 3


@pytest.mark.parametrize("text", ["a: &a 1\nb: *a", "a: &a 1", "b: *a", "a: &a {b: 1}\nc: {<<: *a}", "a: &a [*a]"])
def test_where_no_aliases_are_read_they_are_refused_by_name(text):
    with pytest.raises(ConfigError, match="the anchor or alias 'a' is not read here"):
        parsed(text, "here", aliases=False)


@pytest.mark.parametrize(
    "text",
    [
        "[" * 100_000,
        "{a: " * 50_000,
        "- " * 50_000,
        "!!bool maybe",
        "!!int x",
        "!!float x",
        "!!timestamp x",
        "!!binary é",
        "!!python/object/apply:os.getcwd []",
        "0x" + "f" * 100_000,
        "1" * 100_000,
        "2026-99-99",
        "{[1]: 2}",
        "*" + "a" * 70_000,
        "!" + "a" * 70_000 + " 1",
        "a" * 70_000 + ": 1\n" + "a" * 70_000 + ": 1",
    ],
    ids=range(16),
)
@pytest.mark.parametrize("aliases", [True, False])
def test_whatever_is_wrong_is_one_short_line(text, aliases):
    with pytest.raises(ConfigError, match="here: is no YAML") as caught:
        parsed(text, "here", aliases=aliases)
    assert str(caught.value).isprintable() and len(str(caught.value)) < 300


def test_a_character_that_no_yaml_may_hold_is_named():
    with pytest.raises(ConfigError, match=r"its character number 4 is U\+0000, which no YAML may hold\.$"):
        parsed("a: \0", "here")


def test_a_named_pipe_is_no_yaml(tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    with pytest.raises(ConfigError, match="here: cannot be read: it is a named pipe"):
        read_yaml(tmp_path / "pipe.yaml", "here")
