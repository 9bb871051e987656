"""The tosses of a cube: an archive that is none is one line."""

import os

import numpy as np
import pytest

from physid_drake.errors import RecordingError
from physid_drake.recording.adapters import convert_cube

ROWS = np.tile([0.0, 0, 0.05, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0], (30, 1))
LARGEST = 2**63 - 1


def refusal(tmp_path, **arrays):
    np.savez(tmp_path / "contactnets_all.npz", **arrays)
    with pytest.raises(RecordingError) as caught:
        convert_cube(tmp_path, tmp_path / "r")
    message = str(caught.value)
    assert message.isprintable() and len(message) < 300 + len(str(tmp_path)) and not (tmp_path / "r").exists()
    return message


@pytest.mark.parametrize(
    "arrays",
    [
        {},
        {"traj": ROWS},
        {"traj": ROWS, "length": np.array(["x"])},
        {"traj": ROWS.astype(str), "length": np.array([30])},
        {"traj": ROWS, "length": np.array([30.0])},
        {"traj": ROWS, "length": np.array([29])},
        {"traj": ROWS, "length": np.array([], dtype=int)},
        {"traj": ROWS, "length": np.array([31, -1])},
        {"traj": ROWS, "length": np.array([0, 30])},
        {"traj": ROWS, "length": np.array([LARGEST, LARGEST, 32])},
        {"traj": ROWS, "length": np.array([2**64 - 1, 31], dtype=np.uint64)},
        {"traj": ROWS, "length": np.array([[30]])},
        {"traj": ROWS, "length": np.array(30)},
        {"traj": np.array(3.0), "length": np.array([1])},
        {"traj": ROWS[:, :5], "length": np.array([30])},
        {"traj": np.full_like(ROWS, np.nan), "length": np.array([30])},
        {"traj": ROWS * 1e300, "length": np.array([30])},
        {"traj": 0.0 * ROWS, "length": np.array([30])},
        {"traj": np.array([ROWS, None], dtype=object), "length": np.array([30])},
        {"traj": ROWS, "length": np.array([30])},
    ],
    ids=range(20),
)
def test_arrays_that_are_no_tosses_are_refused(tmp_path, arrays):
    assert "contactnets_all.npz" in refusal(tmp_path, **arrays) or "length" in arrays


def test_a_pipe_and_a_file_that_is_cut_off_are_no_tosses(tmp_path):
    file = tmp_path / "contactnets_all.npz"
    np.savez(file, traj=ROWS, length=np.array([30]))
    file.write_bytes(file.read_bytes()[:500])
    with pytest.raises(RecordingError, match="is no table of tosses"):
        convert_cube(file, tmp_path / "r")
    file.unlink()
    os.mkfifo(file)
    with pytest.raises(RecordingError, match="it is a named pipe"):
        convert_cube(tmp_path, tmp_path / "r")
