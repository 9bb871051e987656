"""What is read of a file that somebody else put there."""

import os
import socket

import pytest

from physid_drake.files import FileError, MissingFileError, NotTextError, read_bytes, read_json, read_text


def refusal(path, **options):
    with pytest.raises(FileError) as caught:
        read_bytes(path, **options)
    message = str(caught.value)
    assert "\n" not in message and len(message) < 120
    return message


def test_a_plain_file_is_read_and_its_byte_order_mark_is_not(tmp_path):
    file = tmp_path / "a.txt"
    file.write_bytes(b"\xef\xbb\xbfhello\n")
    assert read_bytes(file) == b"\xef\xbb\xbfhello\n"
    assert read_text(file) == "hello\n"


def test_a_named_pipe_is_never_opened(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    assert "it is a named pipe" in refusal(tmp_path / "pipe")
    (tmp_path / "link").symlink_to(tmp_path / "pipe")
    assert "it is a named pipe" in refusal(tmp_path / "link")


def test_a_device_a_folder_and_a_socket_are_no_files(tmp_path, monkeypatch):
    assert "it is a device" in refusal("/dev/zero")
    assert "it is a folder" in refusal(tmp_path)
    monkeypatch.chdir(tmp_path)  # a socket's path must be short
    with socket.socket(socket.AF_UNIX) as one:
        one.bind("socket")
        assert "it is a socket" in refusal("socket")


def test_a_file_is_as_large_as_the_bound_at_most(tmp_path):
    file = tmp_path / "large"
    file.write_bytes(b"x" * 1001)
    assert read_bytes(file, most=1001)
    assert "larger than 0.001 MB" in refusal(file, most=1000)


def test_a_file_of_holes_takes_no_memory(tmp_path):
    with (tmp_path / "holes").open("wb") as file:
        file.truncate(10**12)
    assert "larger than 64 MB" in refusal(tmp_path / "holes")


@pytest.mark.parametrize("name", ["a\0b", "x" * 5000, "/".join(["x"] * 5000), "file/inside"])
def test_a_path_that_cannot_be_is_one_line(tmp_path, name):
    (tmp_path / "file").write_text("")
    refusal(f"{tmp_path}/{name}")


def test_a_ring_of_links_is_one_line(tmp_path):
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    refusal(tmp_path / "a")


def test_what_is_missing_and_what_is_no_text_say_so(tmp_path):
    with pytest.raises(MissingFileError, match="no such file"):
        read_bytes(tmp_path / "nowhere")
    (tmp_path / "noise").write_bytes(b"one\ntwo \xff\n")
    with pytest.raises(NotTextError, match="line 2 is not UTF-8") as caught:
        read_text(tmp_path / "noise")
    assert caught.value.line == 2


@pytest.mark.parametrize(
    "text", ["", "{", "[" * 100_000, "1" * 70_000, "{1:", "\ud800", "nope", "\x00"], ids=range(8)
)
def test_what_is_no_json_is_one_line(tmp_path, text):
    file = tmp_path / "a.json"
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    with pytest.raises(FileError, match="cannot be read") as caught:
        read_json(file)
    assert str(caught.value).isprintable() and len(str(caught.value)) < 120


def test_json_is_read(tmp_path):
    (tmp_path / "a.json").write_text('{"a": [1, null]}')
    assert read_json(tmp_path / "a.json") == {"a": [1, None]}
