"""A small recording as people write it."""

YAML = """\
format: physid-recording/1
name: eraser
description: free text
object:
  shape: box
  size_m: [0.1, 0.05, 0.03]
  mass_kg: 0.05
table:
  size_m: [1.2, 0.8]
  centre_m: [0, 0]
hand:
  tip: sphere
  radius_m: 1e-2
  stream: measured
sensors:
  force_std_n: 0.02
pushes:
  - file: pushes/001.csv
    note: first
"""
HEADER = "time_s,hand_x_m,hand_y_m,hand_z_m,object_x_m,object_y_m,object_z_m,object_qw,object_qx,object_qy,object_qz"
ROWS = ["0.0,0,0,0.015,0.1,0,0.015,1,0,0,0", "0.1,0.01,0,0.015,,,,,,,", "0.2,,,,0.12,0,0.015,1,0,0,0"]


def write(folder, yaml=YAML, header=HEADER, rows=ROWS):
    """Write it into a folder, with another description or table."""
    (folder / "pushes").mkdir(exist_ok=True)
    (folder / "recording.yaml").write_text(yaml, encoding="utf-8")
    (folder / "pushes/001.csv").write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return folder
