"""Archives of arrays, whoever made them."""

import io
import os
import zipfile

import numpy as np
import pytest

from physid_drake.files import FileError, MissingFileError
from physid_drake.npz import read_arrays


def refusal(path):
    with pytest.raises(FileError) as caught:
        read_arrays(path)
    message = str(caught.value)
    assert message.isprintable() and len(message) < 400
    return message


def header_of(shape, descr="<f8"):
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"shape": shape, "fortran_order": False, "descr": descr})
    return stream.getvalue()


def archive(path, content, name="traj.npy", method=zipfile.ZIP_DEFLATED):
    with zipfile.ZipFile(path, "w", method) as file:
        file.writestr(name, content)
    return path


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_what_numpy_wrote_is_read(tmp_path, save):
    arrays = {
        "a": np.arange(6.0).reshape(2, 3), "b": np.asfortranarray(np.arange(6).reshape(2, 3)), "c": np.array("text"),
        "d": np.zeros((0, 3)), "e": np.array(3.0), "f": np.array([True, False]),
    }  # fmt: skip
    save(tmp_path / "a.npz", **arrays)
    read = read_arrays(tmp_path / "a.npz")
    assert set(read) == set(arrays)
    for name, array in arrays.items():
        np.testing.assert_array_equal(read[name], array)
        assert read[name].dtype == array.dtype


@pytest.mark.parametrize("shape", [(10**9, 13), (2**62, 2**62), (10**400,), (-1,), (-1, -8), (8, -1, -1), (3,), (9,)])
def test_a_header_that_claims_what_is_not_there_is_refused(tmp_path, shape):
    assert "claims" in refusal(archive(tmp_path / "a.npz", header_of(shape) + bytes(16)))


def test_a_header_that_numpy_does_not_write_is_refused_in_words_of_ours(tmp_path):
    header = header_of((10,)).replace(b"(10,)", b"2**40")
    assert refusal(archive(tmp_path / "a.npz", header)).endswith("'traj.npy' has no header as NumPy writes it")


@pytest.mark.parametrize("descr", ["|O", [("a", "<f8"), ("b", "|O")], "|V8", "<c16"])
def test_only_numbers_times_and_text_are_read(tmp_path, descr):
    refusal(archive(tmp_path / "a.npz", header_of((1,), descr) + bytes(16)))


def test_objects_are_never_unpickled(tmp_path):
    class Loud:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "made"),)

    np.savez(tmp_path / "a.npz", traj=np.array([Loud()], dtype=object))
    assert "holds no numbers" in refusal(tmp_path / "a.npz")
    assert not (tmp_path / "made").exists()


def test_a_bomb_is_not_unpacked(tmp_path):
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as file:
        for k in range(11):
            file.writestr(f"a{k}.npy", bytes(1000))
    lying = content.getvalue().replace((1000).to_bytes(4, "little"), (100_000_000).to_bytes(4, "little"))
    (tmp_path / "a.npz").write_bytes(lying)
    assert "unpacks to more than 1000 MB" in refusal(tmp_path / "a.npz")


def test_a_member_that_says_it_is_small_is_read_as_far_as_that(tmp_path):
    whole = header_of((10**6,)) + bytes(8 * 10**6)
    archive(tmp_path / "a.npz", whole)
    content = (
        (tmp_path / "a.npz").read_bytes().replace(len(whole).to_bytes(4, "little"), (1000).to_bytes(4, "little"))
    )
    (tmp_path / "a.npz").write_bytes(content)
    refusal(tmp_path / "a.npz")


BROKEN = (
    b"", b"\x93NUMPY", b"\x93NUMPY\x01\x00\xff\xff", b"\x93NUMPY\x03\x00", b"\x93NUMPY\x01\x00\x04\x00((((",
    b"\x93NUMPY\x02\x00\xff\xff\xff\x7f",
)  # fmt: skip


@pytest.mark.parametrize("content", BROKEN, ids=range(6))
def test_a_member_that_is_no_array_is_refused(tmp_path, content):
    refusal(archive(tmp_path / "a.npz", content))


def test_an_archive_that_is_cut_off_or_none_is_refused(tmp_path):
    np.savez(tmp_path / "whole.npz", traj=np.arange(1000.0))
    whole = (tmp_path / "whole.npz").read_bytes()
    for length in (0, 1, 10, len(whole) // 2, len(whole) - 1):
        (tmp_path / "a.npz").write_bytes(whole[:length])
        refusal(tmp_path / "a.npz")
    np.save(tmp_path / "a.npy", np.zeros(3))
    refusal(tmp_path / "a.npy")
    refusal(archive(tmp_path / "lzma.npz", header_of((0,)), method=zipfile.ZIP_LZMA))
    os.mkfifo(tmp_path / "pipe.npz")
    assert "it is a named pipe" in refusal(tmp_path / "pipe.npz")
    with pytest.raises(MissingFileError):
        read_arrays(tmp_path / "nowhere.npz")


def test_a_thousand_broken_archives_are_one_line_each(tmp_path):
    np.savez_compressed(tmp_path / "whole.npz", traj=np.arange(100.0).reshape(10, 10), header=np.array('{"a": 1}'))
    whole = np.frombuffer((tmp_path / "whole.npz").read_bytes(), dtype=np.uint8)
    rng = np.random.default_rng(0)
    for _ in range(1000):
        broken = whole.copy()
        places = rng.integers(0, len(whole), size=rng.integers(1, 6))
        broken[places] = rng.integers(0, 256, size=len(places))
        (tmp_path / "a.npz").write_bytes(broken.tobytes())
        try:
            arrays = read_arrays(tmp_path / "a.npz")
        except FileError as error:
            assert str(error).isprintable()
        else:
            assert all(isinstance(array, np.ndarray) for array in arrays.values())
