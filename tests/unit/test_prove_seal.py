"""The seal on the truth, what is secret of it, and what hides it."""

import errno
import json
import os
import re
import shutil
import stat
import subprocess
import sys
from contextlib import nullcontext

import pytest

from physid_drake.errors import ConfigError, ProofError
from physid_drake.resources import shipped
from physid_drake.validation.sealing import hiding, seal
from physid_drake.validation.sealing.blindfold import HIDDEN_BY
from physid_drake.validation.sealing.diagnosing import diagnose_command
from physid_drake.validation.sealing.seal import (
    RECORDING,
    check_seal,
    files_digest,
    seal_of,
    shut,
    unlock,
    write_seal,
)
from physid_drake.validation.sealing.secret import keep_secret, name_by_seed, settled_secret
from physid_drake.whole_files import write_whole


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "sealed").mkdir()
    for name in ("aa", "bb"):
        (tmp_path / "sealed" / f"{name}.json").write_text(json.dumps({"id": name}))
    return tmp_path


def test_a_truth_that_changed_after_it_was_sealed_is_refused(folder):
    written = write_seal(folder, ["aa", "bb"])
    check_seal(folder, written)
    (folder / "sealed" / "bb.json").write_text("{}")
    with pytest.raises(ProofError, match=r"^the seal is broken: .* nothing is scored\.$"):
        check_seal(folder, written)
    # The hash that is written down cannot be made to fit either.
    with pytest.raises(ProofError, match=r"bb\.json' has changed since it was sealed"):
        write_seal(folder, ["aa", "bb"])
    assert (folder / "seal.sha256").read_text() == f"{written}\n"


def test_a_recording_that_changed_after_it_was_sealed_is_refused(folder):
    push = folder / "recordings" / "aa" / "pushes" / "001.csv"
    push.parent.mkdir(parents=True)
    push.write_text("time_s\n0\n")
    truth = {"id": "aa", RECORDING: files_digest(folder / "recordings" / "aa")}
    (folder / "sealed" / "aa.json").write_text(json.dumps(truth))
    written = write_seal(folder, ["aa", "bb"])
    check_seal(folder, written)
    push.write_text("time_s\n1\n")
    with pytest.raises(ProofError, match=r"recordings/aa' is not the recording that was sealed"):
        check_seal(folder, written)
    push.rename(push.with_name("002.csv"))
    with pytest.raises(ProofError, match="not the recording that was sealed"):
        check_seal(folder, written)


def test_a_truth_that_is_missing_is_named(folder):
    with pytest.raises(ProofError, match=r"cc\.json': cannot be read"):
        seal_of(folder / "sealed", ["aa", "cc"])


def test_a_seal_grows_with_its_worlds(folder):
    one = write_seal(folder, ["aa"])
    both = write_seal(folder, ["aa", "bb"])
    assert one != both
    assert write_seal(folder, ["bb", "aa"]) == both
    assert (
        subprocess.run(["sha256sum", "-c", "seal.txt"], cwd=folder, capture_output=True, check=False).returncode == 0
    )


def test_a_seal_of_more_worlds_holds_for_fewer(folder):
    both = write_seal(folder, ["aa", "bb"])
    assert write_seal(folder, ["aa"]) == both == (folder / "seal.sha256").read_text().strip()
    check_seal(folder, both)


def test_a_folder_with_a_colon_is_hidden_too(tmp_path):
    (tmp_path / "a:b").mkdir()
    (tmp_path / "a:b" / "truth.json").write_text("{}")
    words = diagnose_command(tmp_path / "a:b" / "truth.json", tmp_path / "out", tmp_path / "a:b", tmp_path / "other")
    words = (*words[:4], "inspect", str(tmp_path / "a:b"))
    said = subprocess.run(words, capture_output=True, text=True, check=False)
    assert said.returncode == 1 and ("is sealed" in said.stderr or "missing file" in said.stderr)


def test_a_shut_folder_opens_again_whatever_ends_the_block(folder):
    sealed = folder / "sealed"
    before = stat.S_IMODE(sealed.stat().st_mode)
    with pytest.raises(KeyboardInterrupt), shut(sealed):
        assert stat.S_IMODE(sealed.stat().st_mode) == 0
        raise KeyboardInterrupt
    assert stat.S_IMODE(sealed.stat().st_mode) == before
    sealed.chmod(0)
    unlock(sealed)  # as after a run that was killed
    assert (sealed / "aa.json").read_text()


LOOKS = """
import ctypes, glob, mmap, os, pathlib, shutil, subprocess, sys
from physid_drake.validation.sealing.blindfold import blind_to
sealed = pathlib.Path(sys.argv[1])
above = os.open(sealed.parent, os.O_RDONLY)
within = os.open(sealed, os.O_RDONLY)
file = os.open(sealed / "aa.json", os.O_RDONLY)
libc = ctypes.CDLL(None)
blind_to(str(sealed))
looks = [lambda: open(sealed / "aa.json"), lambda: os.listdir(sealed), lambda: list(os.scandir(sealed)),
         lambda: (sealed / "aa.json").read_text(), lambda: list(sealed.glob("*")),
         lambda: open(os.path.join(sealed, "..", "sealed", "aa.json")), lambda: open(sealed.parent / "link"),
         lambda: os.open("sealed/aa.json", os.O_RDONLY, dir_fd=above), lambda: os.open("aa.json", 0, dir_fd=within),
         lambda: os.listdir(within), lambda: list(os.scandir(within)), lambda: os.chdir(within),
         lambda: os.fchdir(within), lambda: list(os.fwalk("sealed", dir_fd=above, onerror=print)),
         lambda: list(os.walk(sealed)), lambda: os.fdopen(file), lambda: mmap.mmap(file, 1, prot=mmap.PROT_READ),
         lambda: open(f"/proc/self/fd/{within}/aa.json"), lambda: open(f"/proc/self/fd/{file}"),
         lambda: os.truncate(sealed / "aa.json", 0), lambda: shutil.copytree(sealed, sealed.parent / "copy"),
         lambda: shutil.copy(sealed / "aa.json", sealed.parent / "copy"),
         lambda: shutil.make_archive("x", "tar", sealed),
         lambda: os.link("sealed/aa.json", "mine", src_dir_fd=above, dst_dir_fd=above),
         lambda: os.rename(sealed.parent, str(sealed.parent) + "2"), lambda: shutil.move(sealed, "elsewhere"),
         lambda: glob.glob("*", root_dir=sealed) and 0, lambda: subprocess.run(["cat", str(sealed / "aa.json")]),
         lambda: os.system("true"), lambda: os.posix_spawn("/bin/true", ["true"], {}), lambda: os.fork(),
         lambda: os.execv("/bin/true", ["true"]), lambda: libc.open, lambda: libc["fopen"]]
for number, look in enumerate(looks):
    try:
        look()
    except PermissionError:
        print("refused")
    else:
        print("seen", number)
print(len(looks), open(sealed.parent / "beside").read())
os.close(within)
os.chdir(sealed.parent)
print(open("beside").read(), open("beside", opener=lambda name, flags: os.open(name, flags, dir_fd=above)).read(),
      *sorted(os.listdir(".")), libc.getpid() == os.getpid())
"""


def test_the_blindfold_refuses_every_look_and_nothing_else(folder):
    (folder / "beside").write_text("seen")
    (folder / "link").symlink_to(folder / "sealed" / "aa.json")
    said = subprocess.run(
        [sys.executable, "-c", LOOKS, str(folder / "sealed")], capture_output=True, text=True, check=True
    )
    *refused, beside, last = said.stdout.splitlines()
    count, text = beside.split()
    assert refused == ["refused"] * int(count) and text == "seen"
    assert last == "seen seen beside link sealed True"
    assert json.loads((folder / "sealed" / "aa.json").read_text()) == {"id": "aa"}


HIDDEN = """
import ctypes, json, os, pathlib, subprocess, sys
from physid_drake.validation.sealing.hiding import hide
sealed = pathlib.Path(sys.argv[1])
if os.access(sealed, os.X_OK):
    os.chdir(sealed)
print(hide([str(sealed), str(sealed.parent / "none such")]))
truth, libc, parent = str(sealed / "aa.json"), ctypes.CDLL(None, use_errno=True), os.getppid()
def run(*words):
    return subprocess.run(words, capture_output=True).stdout
mount_point = ["unshare", "-rm", "sh", "-c", f"umount {sealed}; cat {truth}"]
looks = {
    "open": lambda: open(truth).read(),
    "relative": lambda: open("aa.json").read(),
    "list": lambda: os.listdir(sealed),
    "open of C": lambda: libc.open(truth.encode(), 0) >= 0,
    "cat": lambda: run("cat", truth),
    "root of the parent": lambda: open(f"/proc/{parent}/root{truth}").read(),
    "words of the parent": lambda: open(f"/proc/{parent}/cmdline").read(),
    "umount": lambda: libc.umount2(str(sealed).encode(), 2) == 0,
    "umount /proc": lambda: libc.umount2(b"/proc", 2) == 0,
    "umount by another user": lambda: run(*mount_point),
    "mounts of the parent": lambda: run("nsenter", "-t", str(parent), "-m", "cat", truth),
    "write": lambda: open(truth, "w"),
}
seen = {}
for name, look in looks.items():
    try:
        seen[name] = bool(look())
    except OSError:
        seen[name] = False
(sealed.parent / "result").write_text("written")
print(json.dumps({"seen": [name for name in seen if seen[name]], "proc": os.listdir("/proc"), "pid": os.getpid(),
                  "status": pathlib.Path("/proc/self/status").read_text()}))
"""


def mounts_can_be_had(*before):
    words = (*before, "unshare", *(() if os.geteuid() == 0 and not before else ("-r",)), "-m", "true")
    try:
        return subprocess.run(words, capture_output=True, check=False).returncode == 0
    except OSError:
        return False


@pytest.mark.parametrize("before", [(), ("unshare", "-U", "--map-user=1000", "--map-group=1000")])
def test_a_hidden_folder_is_empty_to_a_process_that_cannot_undo_it(folder, before):
    """As whoever runs the tests, and as a user without any rights."""
    if not mounts_can_be_had(*before):
        pytest.skip("this system lets nobody mount")
    words = [*before, sys.executable, "-c", HIDDEN, str(folder / "sealed")]
    with shut(folder / "sealed") if before else nullcontext():
        said = subprocess.run(words, capture_output=True, text=True, check=True).stdout.splitlines()
    found = json.loads(said[1])
    assert said[0] == "mount namespace"
    assert found["seen"] == []
    assert {name for name in found["proc"] if name.isdigit()} == {str(found["pid"])}
    assert "NoNewPrivs:\t1" in found["status"]
    kept = int(re.search(r"CapPrm:\t(\w+)", found["status"])[1], 16)
    assert kept in ((0, 2) if not before else (0,))
    assert (folder / "result").read_text() == "written"
    # Nobody else sees the folder hidden.
    assert json.loads((folder / "sealed" / "aa.json").read_text()) == {"id": "aa"}


def test_a_process_that_may_not_mount_says_that_permissions_are_all_there_is(folder, monkeypatch):
    def refused(name, *arguments):
        raise OSError(errno.EPERM, "no", name)

    monkeypatch.setattr(hiding, "_call", refused)
    assert hiding.hide([str(folder / "sealed")]) == hiding.PERMISSIONS
    assert hiding.hide([str(folder / "none such")]) == hiding.PERMISSIONS


def test_a_seal_is_written_whole_and_one_that_was_interrupted_is_ended(folder, monkeypatch):
    first = write_seal(folder, ["aa"])

    def killed(path, content):
        if path.name == "seal.sha256":
            raise KeyboardInterrupt
        write_whole(path, content)

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(seal, "write_whole", killed)
        write_seal(folder, ["aa", "bb"])
    assert seal.read_seal(folder) == first
    with pytest.raises(ProofError, match=r"nothing is scored\. If sealing was interrupted, the command without"):
        check_seal(folder, first)
    check_seal(folder, write_seal(folder, ["aa", "bb"]))
    assert sorted(path.name for path in folder.iterdir()) == ["seal.sha256", "seal.txt", "sealed"]


@pytest.mark.parametrize(
    ("name", "content", "rule"),
    [
        ("seal.txt", b"x", "line 1 must be '<sha256>  sealed/<world>.json', but is 'x'"),
        ("seal.txt", b"\xff\xfe", "line 1 is not UTF-8 text"),
        ("seal.txt", b"ab  sealed/aa.json\n", "line 1 must be"),
        ("seal.sha256", b"\xff", "line 1 is not UTF-8 text"),
        ("seal.sha256", b"no", "it must be 64 hex digits, but is 'no'"),
    ],
)
def test_a_seal_that_is_none_is_one_line(folder, name, content, rule):
    write_seal(folder, ["aa"])
    (folder / name).write_bytes(content)
    read = seal.read_seal if name == "seal.sha256" else seal.sealed_names
    with pytest.raises(ProofError) as caught:
        read(folder)
    said = str(caught.value)
    assert rule in said and str(folder / name) in said and "\n" not in said and said.endswith("another --out.")


def test_a_sealed_truth_that_is_no_object_is_one_line(folder):
    (folder / "sealed" / "aa.json").write_text("[1]")
    with pytest.raises(ProofError, match=r"aa\.json' cannot be read: it must be a JSON object, but is \[1\]; put it"):
        check_seal(folder, write_seal(folder, ["aa", "bb"]))


def test_names_are_salted_and_kept_and_the_seed_is_drawn(tmp_path):
    one, other = (keep_secret(tmp_path / name, 7) for name in ("one", "other"))
    assert one.seed == other.seed == 7 and not set(one.names(50)) & set(other.names(50))
    assert not set(one.names(50)) & {name_by_seed(index, 7) for index in range(50)}
    assert keep_secret(tmp_path / "one", 7) == keep_secret(tmp_path / "one", None) == one
    drawn = keep_secret(tmp_path / "drawn", None, "none")
    assert drawn.seed != keep_secret(tmp_path / "again", None).seed
    assert settled_secret(tmp_path / "drawn", None, None) == drawn
    # Of world 0 of seed 42042, whose answers are in docs/archive/answers.
    assert keep_secret(tmp_path / "opened", 42042, by_seed=True).name_of(0) == name_by_seed(0, 42042)


@pytest.mark.parametrize(("seed", "kind"), [(8, None), (7, "none"), (None, "none")])
def test_a_folder_of_another_seed_or_kind_is_refused_without_a_word_of_it(tmp_path, seed, kind):
    keep_secret(tmp_path, 7)
    for ask in (keep_secret, settled_secret):
        with pytest.raises(ConfigError, match="holds another proof") as caught:
            ask(tmp_path, seed, kind)
        assert "7" not in str(caught.value).replace(str(tmp_path), "")


@pytest.mark.parametrize(
    "content",
    ["", "{", "null", '"x"', "{}", '{"salt": 1, "seed": 1, "kind": null, "effect": null}',
     '{"salt": "a", "seed": true, "kind": null, "effect": null}', '{"salt": "a", "seed": 1, "kind": null}'],
)  # fmt: skip
def test_a_secret_that_is_none_is_one_line(tmp_path, content):
    keep_secret(tmp_path, 7)
    (tmp_path / "sealed" / "secret.json").write_text(content)
    with pytest.raises(ProofError, match=r"secret\.json' cannot be read: .*; put it back, or choose another"):
        keep_secret(tmp_path, 7)


def test_worlds_whose_secret_is_lost_get_no_other_names(folder):
    with pytest.raises(ProofError, match="worlds are sealed beside it"):
        keep_secret(folder, 7)
    with pytest.raises(ProofError, match="holds no sealed worlds"):
        settled_secret(folder / "empty", None, None)


@pytest.mark.slow
def test_a_command_under_the_blindfold_works_and_cannot_read_what_is_sealed(folder):
    shutil.copytree(shipped("recordings") / "eraser_reference", folder / "open")
    shutil.copytree(folder / "open", folder / "sealed" / "hidden")

    def inspect(recording):
        words = [
            sys.executable,
            "-m",
            "physid_drake.validation.sealing.blindfold",
            json.dumps([str(folder / "sealed")]),
            "inspect",
            str(recording),
        ]
        return subprocess.run(words, capture_output=True, text=True, check=False)

    assert inspect(folder / "open").returncode == 0
    refused = inspect(folder / "sealed" / "hidden")
    assert refused.returncode == 1
    assert "is sealed" in refused.stderr or "is not a folder" in refused.stderr
    by = (hiding.MOUNTS,) if mounts_can_be_had() else (hiding.MOUNTS, hiding.PERMISSIONS)
    assert refused.stdout.removeprefix(HIDDEN_BY).strip() in by


AUDIT = """
import os, sys
seen = []
looks = ("open", "os.listdir", "os.scandir", "glob.glob", "os.chdir")
def note(event, arguments):
    if event in looks and isinstance(arguments[0], (str, bytes, os.PathLike)):
        seen.append(os.path.realpath(os.fsdecode(arguments[0])))
sys.addaudithook(note)
from pathlib import Path
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording import read_recording
recording = read_recording(Path(sys.argv[1]))
case = case_of(recording, cell_config(recording), ThetaConfig(), jobs=1)
for path in seen:
    print(path)
"""


def test_what_a_diagnosis_is_made_from_is_the_recording_alone(folder):
    """Everything that is read to make a case; what follows works on it in memory."""
    recording = folder / "recordings" / "aa"
    shutil.copytree(shipped("recordings") / "eraser_reference", recording)
    said = subprocess.run([sys.executable, "-c", AUDIT, str(recording)], capture_output=True, text=True, check=True)
    within = [line for line in said.stdout.splitlines() if line.startswith(str(folder.resolve()))]
    assert within
    assert all(line.startswith(str(recording.resolve())) for line in within)
