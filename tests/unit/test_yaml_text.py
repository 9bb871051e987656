"""YAML as people write it."""

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
