"""All files of an exported model."""

from __future__ import annotations

from physid_drake.export.mjcf import mujoco_file
from physid_drake.export.parts import parts_of
from physid_drake.export.sdf import drake_files
from physid_drake.model import Model

README = """Model of '{name}', exported by physid_drake.

Drake:  parser = Parser(plant)
        parser.package_map().AddPackageXml("package.xml")
        parser.AddModels("scene.dmd.yaml")
        The plant takes discrete steps, with contact_model "hydroelastic_with_fallback" and
        discrete_contact_approximation "lagged". The tip follows plant.get_desired_state_input_port(hand).
MuJoCo: mujoco.MjModel.from_xml_path("model.xml"), keyframe "rest"; ctrl: x, vx, y, vy, z, vz of the tip.

{left_out}
"""


def exported(model: Model) -> dict[str, str]:
    """Texts by file name.

    Args:
        model: with a hand.

    Raises:
        ConfigError: if the model has no hand.
    """
    parts, left_out = parts_of(model)
    lines = [f"- {line}" for line in left_out]
    said = "\n".join(["Not in these files:", *lines]) if lines else "All of the model is in these files."
    return {
        **drake_files(parts, model.body.static_ratio),
        "model.xml": mujoco_file(parts, model.recording),
        "README.txt": README.format(name=model.recording, left_out=said),
    }
