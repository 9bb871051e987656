"""A recording's digest: the same for the same recording, another one after any change."""

import dataclasses as dc
import os
import shutil

import pytest

from physid_drake.errors import RecordingError
from physid_drake.recording import MeshShape, digest_of, read_recording
from physid_drake.resources import shipped


@pytest.fixture(scope="module")
def recording():
    return read_recording(shipped("recordings") / "eraser_reference")


def later(recording):
    push, *rest = recording.pushes
    stream = dc.replace(push.object, times=push.object.times + 1e-9)
    return dc.replace(recording, pushes=(dc.replace(push, object=stream), *rest))


def test_a_copy_has_the_same_digest(recording, tmp_path):
    copy = shutil.copytree(shipped("recordings") / recording.name, tmp_path / recording.name)
    assert digest_of(read_recording(copy)) == digest_of(recording)


@pytest.mark.parametrize(
    "changed",
    [
        later,
        lambda recording: dc.replace(recording, pushes=recording.pushes[1:]),
        lambda recording: dc.replace(recording, pushes=recording.pushes[::-1]),
        lambda recording: dc.replace(recording, object=dc.replace(recording.object, mass=0.06, mass_std=1e-3)),
    ],
)
def test_any_change_changes_it(recording, changed):
    assert digest_of(changed(recording)) != digest_of(recording)


def test_a_mesh_counts_by_what_is_in_it_and_not_by_where_it_is(recording, tmp_path):
    def with_mesh(folder, text):
        file = tmp_path / folder / "object.obj"
        file.parent.mkdir()
        file.write_text(text, encoding="utf-8")
        return dc.replace(recording, object=dc.replace(recording.object, shape=MeshShape(file=file)))

    first, copy, other = with_mesh("a", "v 0 0 0\n"), with_mesh("b", "v 0 0 0\n"), with_mesh("c", "v 0 0 1\n")
    assert digest_of(first) == digest_of(copy) != digest_of(other)


def test_a_mesh_that_cannot_be_read_any_more_is_one_line(recording, tmp_path):
    file = tmp_path / "object.obj"
    meshed = dc.replace(recording, object=dc.replace(recording.object, shape=MeshShape(file=file)))
    with pytest.raises(RecordingError, match=r"object\.obj.*no such file"):
        digest_of(meshed)
    os.mkfifo(file)
    with pytest.raises(RecordingError, match="it is a named pipe"):
        digest_of(meshed)
