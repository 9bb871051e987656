"""Scenarios: what a configuration may say, and how it is refused."""

import dataclasses as dc
import os

import pytest
import yaml

from physid_drake.errors import ConfigError
from physid_drake.resources import shipped
from physid_drake.scenario import dump_scenario, load_scenario
from physid_drake.scenario_schema import Scenario


def config(tmp_path, text):
    file = tmp_path / "mine.yaml"
    file.write_text(text)
    return str(file)


def refusal(config, override=None):
    with pytest.raises(ConfigError) as caught:
        load_scenario(config, override)
    return str(caught.value)


@pytest.mark.parametrize("file", sorted(path.name for path in shipped("configs").glob("*.yaml")))
def test_every_shipped_scenario_loads(file):
    content = yaml.safe_load((shipped("configs") / file).read_text())
    for name in content:
        found, scenario = load_scenario(f"{file}:{name}", None)
        assert found == name
        assert scenario.recording == content[name]["recording"]


def test_without_a_config_the_shipped_sealed_world_is_read():
    assert load_scenario(None, None) == load_scenario("sealed.yaml:sealed", None)
    assert load_scenario("eraser", None) == load_scenario("eraser.yaml", None)


def test_a_recording_without_a_config_has_the_defaults_under_its_own_name():
    """The shipped eraser's plan starts and ends on the eraser's table."""
    name, scenario = load_scenario(None, "{search: {budget: 7}}", recording="somewhere/my pushes/", seed=3)
    want = Scenario(recording="somewhere/my pushes/", seed=3)
    want.search.budget = 7
    assert (name, scenario) == ("my_pushes", want)
    assert load_scenario("eraser", None, recording="elsewhere")[1].plan == load_scenario("eraser", None)[1].plan


def test_the_first_scenario_is_taken_where_none_is_named(tmp_path):
    file = config(tmp_path, "second: {seed: 2}\nfirst: {seed: 1}\n")
    assert load_scenario(file, None)[0] == "second"
    assert load_scenario(f"{file}:first", None)[1].seed == 1


def test_a_path_with_a_colon_is_a_path(tmp_path):
    (tmp_path / "a:b").mkdir()
    file = config(tmp_path / "a:b", "second: {seed: 2}\nfirst: {seed: 1}\n")
    assert load_scenario(file, None)[0] == "second"
    assert load_scenario(f"{file}:first", None)[1].seed == 1


def test_an_empty_scenario_is_the_defaults(tmp_path):
    assert load_scenario(config(tmp_path, "plain:\n"), None) == ("plain", Scenario())


def test_a_template_serves_scenarios_and_is_none(tmp_path):
    file = config(tmp_path, "_base: &base {seed: 7}\nmine: {<<: *base, pushes: 5}\n")
    name, scenario = load_scenario(file, None)
    assert (name, scenario.seed, scenario.pushes) == ("mine", 7, 5)
    assert "there is no scenario '_base'" in refusal(f"{file}:_base")


def test_a_key_changes_itself_and_nothing_else(tmp_path):
    scenario = load_scenario(config(tmp_path, "a: {cell: {solver: {impact_law: false}}}"), None)[1]
    want = Scenario()
    want.cell.solver.impact_law = False
    assert scenario == want


def test_an_override_lies_over_the_file(tmp_path):
    file = config(tmp_path, "a: {seed: 3, search: {budget: 9, batch: 2}, theta: {nominal: {mass: 0.2}}}")
    scenario = load_scenario(file, "{search: {budget: 20}, theta: {parameters: [mass]}}")[1]
    assert scenario.search == dc.replace(Scenario().search, budget=20, batch=2)
    assert scenario.seed == 3
    assert scenario.theta.parameters == ["mass"]
    assert scenario.theta.nominal == {"mass": 0.2}


@pytest.mark.parametrize("override", ["", "{}", "null"])
def test_an_empty_override_changes_nothing(override):
    assert load_scenario(None, override) == load_scenario(None, None)


def test_loading_leaves_the_defaults_alone():
    before = Scenario()
    load_scenario(None, "{theta: {bounds: {mass: [0.1, 1.0]}}, cell: {friction_cells: [2, 1]}}")
    assert Scenario() == before


def test_what_is_dumped_is_read_back(tmp_path):
    override = (
        "{seed: 5, theta: {parameters: [mass, com_x], bounds: {mass: [0.1, 1.0]}, nominal: {com_x: 0.01}},"
        " cell: {friction_cells: [2, 1], contact: {rest_depth_m: 1.0e-5}}}"
    )
    name, scenario = load_scenario("eraser.yaml:eraser_point", override)
    text = dump_scenario(name, scenario)
    assert load_scenario(config(tmp_path, text), None) == (name, scenario)
    assert dump_scenario(name, scenario) == text


def test_a_dump_says_every_key():
    said = yaml.safe_load(dump_scenario("a", Scenario()))["a"]
    assert said == dc.asdict(Scenario())


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("a: {sed: 1}", "'sed'"),
        ("a: {search: {bugdet: 1}}", "'search': the key 'bugdet'"),
        ("a: {cell: {contact: {modell: point}}}", "key 'cell.contact': the key 'modell'"),
    ],
)
def test_an_unknown_key_is_named_with_its_file_and_place(tmp_path, text, key):
    file = config(tmp_path, text)
    message = refusal(file)
    assert file in message
    assert key in message
    assert "known are" in message
    assert key in refusal(None, str(yaml.safe_load(text)["a"]))


@pytest.mark.parametrize(
    "override",
    [
        "{seed: many}",
        "{seed: 2.5}",
        "{search: {budget: null}}",
        "{search: 3}",
        "{search: null}",
        "{recording: [1]}",
        "{cell: {friction_cells: [a, b]}}",
        "{theta: {bounds: {mass: 3}}}",
        "{theta: {bounds: {mass: [low, high]}}}",
        pytest.param(
            "{theta: {bounds: null}}",
        ),
        "[1, 2]",
        "3",
        "{seed: 2020-01-01}",
    ],
)
def test_a_value_of_the_wrong_kind_is_refused(override):
    assert refusal(None, override).startswith("--set")


@pytest.mark.parametrize("override", ["{search: {budget: many}}", "{theta: {bounds: {mass: 3}}}"])
def test_a_value_of_the_wrong_kind_is_refused_by_the_name_of_its_key(override):
    message = refusal(None, override)
    assert "budget" in message or "mass" in message


def test_a_string_is_no_list_of_parameters():
    assert "parameters" in refusal(None, "{theta: {parameters: mass}}")


@pytest.mark.parametrize("override", ["{a: [", "a: b: c", "{[1, 2]: 3}", "\0"])
def test_an_override_that_is_no_yaml_is_refused(override):
    assert refusal(None, override).startswith("--set: is no YAML")


@pytest.mark.parametrize("text", ["a: [1, 2\nb: }", "a: \0", "a: &x [*y]"])
def test_a_file_that_is_no_yaml_is_named(tmp_path, text):
    file = config(tmp_path, text)
    message = refusal(file)
    assert f"config '{file}': is no YAML" in message
    assert "\n" not in message


@pytest.mark.parametrize(
    "text",
    [
        "",
        "- 1",
        "eraser",
        pytest.param(
            "_base: {seed: 1}",
        ),
    ],
)
def test_a_file_without_scenarios_is_refused(tmp_path, text):
    assert "scenario" in refusal(config(tmp_path, text))


def test_a_file_that_is_none_is_named(tmp_path):
    assert "there is no such file" in refusal(str(tmp_path / "nowhere.yaml"))
    assert "cannot be read" in refusal(str(tmp_path))
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00")
    assert "cannot be read" in refusal(str(tmp_path / "binary.yaml"))


def test_an_unknown_scenario_is_answered_with_the_known_ones():
    message = refusal("eraser.yaml:rubber")
    assert "'rubber'" in message
    assert "eraser, eraser_point" in message


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("cell.contact.model", "hydro"),
        ("cell.contact.support_points", 3),
        ("cell.contact.support_points", 1001),
        ("cell.contact.rest_depth_m", 0.0),
        ("cell.contact.rest_depth_m", float("nan")),
        ("cell.solver.scheme", "euler"),
        ("cell.solver.time_step_s", 0.0),
        ("cell.solver.time_step_s", 0.1),
        ("cell.solver.slide_time_step_s", 1e-4),
        ("cell.friction_cells", [3]),
        ("cell.friction_cells", [0, 1]),
        ("cell.default_density_kgpm3", 0.0),
        ("cell.default_density_kgpm3", 1e4),
        ("pushes", 0),
        ("pushes", -1),
        ("search.budget", 0),
        ("search.candidates", 1),
        ("search.batch", 0),
        ("search.patience", 0),
        pytest.param("seed", -1),
        pytest.param("plan.tolerance_m", 10**400),
        pytest.param("search.jobs", -1),
        pytest.param("search.entropy_tolerance_nats", -1.0),
        pytest.param("cell.contact.dissipation_s_per_m", -1.0),
        pytest.param("cell.contact.stiction_tolerance_mps", 0.0),
        pytest.param("cell.contact.hand_frequency_rad_s", 0.0),
        pytest.param("cell.contact.hand_frequency_rad_s", -5.0),
        ("search.candidates", 99999999999999),
        ("search.budget", 10**9),
        ("search.batch", 10**9),
        ("search.patience", 10**30),
        ("search.refine_every", 10**9),
        ("search.jobs", 10**9),
        ("search.entropy_tolerance_nats", 1e300),
        ("plan.budget", 10**9),
        ("plan.sweep", 10**9),
        ("plan.draws", 10**9),
        ("plan.tolerance_m", 1e308),
        ("plan.goal_m", [1e308, 0.0]),
        ("plan.goal_m", [1e300] * 1000),
        ("plan.start_m", [0.0, -1e308]),
        ("plan.start_deg", 1e308),
        ("seed", 10**30),
        ("theta.cell_spread", 1e300),
        ("theta.cell_length", 1e-320),
        ("theta.bounds.mass", [1e300, 1e308]),
        ("theta.bounds.mass", [0.1] * 1000 + [1e300]),
        ("theta.nominal.com_x", -1e308),
        ("cell.friction_cells", [10**9, 10**9]),
        ("cell.friction_cells", [1] * 9000),
        ("cell.solver.time_step_s", 1e-300),
        ("cell.contact.support_points", 10**30),
        ("cell.contact.dissipation_s_per_m", 1e300),
        ("cell.contact.stiction_tolerance_mps", 1e300),
        ("cell.contact.hand_frequency_rad_s", 1e300),
    ],
)
def test_a_value_that_no_run_can_use_is_refused_by_its_key(key, value):
    content = value
    for part in reversed(key.split(".")):
        content = {part: content}
    message = refusal(None, yaml.safe_dump(content))
    assert f"key '{key}'" in message and len(message) < 250


LONG = "x" * 70_000


@pytest.mark.parametrize(
    "override",
    [
        f"{{seed: {LONG}}}",
        f"{{{LONG}: 1}}",
        f"{{search: {{{LONG}: 1}}}}",
        f"{{search: {LONG}}}",
        f"{{search: {{method: {LONG}}}}}",
        f"{{plan: {{policy: {LONG}}}}}",
        f"{{plan: {{goal_m: [{'1, ' * 5000}1]}}}}",
        f"{{theta: {{bounds: {{{LONG}: 3}}}}}}",
        f"{{cell: {{contact: {{model: {LONG}}}}}}}",
        f"{{seed: !{LONG} 1}}",
        f"{{seed: {'[' * 70_000}}}",
        f"{{seed: 0x{'f' * 70_000}}}",
    ],
    ids=range(12),
)
def test_a_value_of_many_letters_is_cut(override):
    message = refusal(None, override)
    assert message.isprintable() and len(message) < 600


@pytest.mark.parametrize(
    "name", [LONG, f"{LONG}.yaml", f"eraser.yaml:{LONG}", f"{LONG}:{LONG}", "a/" * 5000], ids=range(5)
)
def test_a_name_of_many_letters_is_cut(name):
    assert len(refusal(name)) < 600


def test_aliases_that_stand_for_a_billion_values_are_refused_at_once(tmp_path):
    lines = ["_a0: &a0 [lol]", *(f"_a{k + 1}: &a{k + 1} [{', '.join([f'*a{k}'] * 9)}]" for k in range(9))]
    text = "\n".join([*lines, "mine: {recording: *a9}"])
    assert "holds more than 10000 values" in refusal(config(tmp_path, text))
    assert "holds more than 10000 values" in refusal(None, "{" + ", ".join([*lines, "seed: *a9"]) + "}")
    assert "inside of what it names" in refusal(None, "{seed: &a [*a]}")


def test_a_named_pipe_is_no_config(tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    assert "it is a named pipe" in refusal(str(tmp_path / "pipe.yaml"))


def test_keys_beside_scenarios_are_refused(tmp_path):
    """What should lie below a scenario, and was not indented, would be left out in silence."""
    (tmp_path / "flat.yaml").write_text("mine:\nrecording: rec\nseed: 3\n")
    with pytest.raises(ConfigError, match="scenario 'recording' needs keys and values below it"):
        load_scenario(str(tmp_path / "flat.yaml"), None)
