"""How commands begin and end, whatever the terminal, the working folder and the words are."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from physid_drake import run_cell
from physid_drake.cli import main
from physid_drake.command import NUMBER, run_command
from physid_drake.errors import ConfigError
from physid_drake.process_start import is_interruption
from physid_drake.resources import shipped

ERASER = str(shipped("recordings") / "eraser_reference")


def ends(code, *, shell="", **words):
    """A command that runs ``code`` and ends with ``run_command``: the finished process."""
    script = (
        f"import sys; from physid_drake.command import run_command\ndef run():\n    {code}\n    return 0\n"
        "sys.exit(run_command(run))"
    )
    argv = ["bash", "-c", f'exec "$0" -c "$1" {shell}', sys.executable, script]
    return subprocess.run(argv, check=False, capture_output=True, text=True, timeout=60, **words)


def test_a_refusal_is_one_line_of_a_length_that_can_be_read_without_control_characters(capsys):
    def refuse():
        raise ConfigError("the name \x1b[2J\x07\udc80 " + 70_000 * "x" + "\n is wrong")

    assert run_command(refuse) == 1
    said = capsys.readouterr().err
    assert said.startswith("error: the name \\x1b[2J") and said.endswith("is wrong\n")
    assert said.count("\n") == 1 and len(said) < 2000 and said[:-1].isprintable()


@pytest.mark.parametrize(
    ("shell", "status", "said"),
    [
        (">/dev/full", 1, "error: standard output: No space left on device.\n"),
        (">&-", 0, ""),
        ("<&- >&- 2>&-", 0, ""),
    ],
)
def test_an_output_that_takes_nothing_is_no_traceback(shell, status, said):
    done = ends("print('x' * 100_000)", shell=shell)
    assert (done.returncode, done.stderr) == (status, said)


def test_a_reader_that_is_gone_is_no_traceback():
    done = ends("print('x' * 1_000_000)", shell="| head -c 1; exit ${PIPESTATUS[0]}".replace("exec ", ""))
    assert done.stderr == ""


def test_a_file_does_not_take_the_place_of_a_closed_output(tmp_path):
    file = tmp_path / "result"
    code = f"import os; file = open({str(file)!r}, 'w'); os.write(1, b'said'); file.write('r'); file.close()"
    assert ends(code, shell=">&-").returncode == 0
    assert file.read_text() == "r"


def test_a_terminal_that_knows_only_ascii_gets_all_that_it_can_show():
    done = ends("print('Löffel ┃ 3 mm')", env={**os.environ, "PYTHONIOENCODING": "ascii", "LC_ALL": "C"})
    assert (done.returncode, done.stdout, done.stderr) == (0, "L?ffel ? 3 mm\n", "")


def test_a_working_folder_that_is_gone_is_one_line(tmp_path):
    (tmp_path / "gone").mkdir()
    script = (
        "import os, sys; from physid_drake.command import run_command; "
        "os.rmdir(os.getcwd()); sys.exit(run_command(lambda: 0))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], check=False, capture_output=True, text=True, cwd=tmp_path / "gone"
    )
    assert (done.returncode, done.stderr) == (1, "error: the working folder is gone; change into another.\n")


def test_too_little_memory_is_one_line(capsys):
    def run():
        raise MemoryError

    assert run_command(run) == 1
    assert capsys.readouterr().err == "error: there is not enough memory for this.\n"


def test_an_error_that_nobody_foresaw_is_not_hidden():
    with pytest.raises(ZeroDivisionError):
        run_command(lambda: 1 // 0)
    with pytest.raises(ImportError):
        run_command(lambda: __import__("no_such_module"))


def test_ctrl_c_is_behind_what_a_compiled_module_makes_of_it():
    try:
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as error:
            raise ImportError("initialization failed") from error
    except ImportError as error:
        assert is_interruption(error)
    assert not is_interruption(ImportError("no"))


def test_ctrl_c_in_a_callback_of_an_import_is_not_lost_and_no_traceback():
    code = """
import weakref
from physid_drake.process_start import begin
class Lock: pass
def callback(_): raise KeyboardInterrupt
begin()
lock = Lock()
kept = weakref.ref(lock, callback)
del lock
import time
time.sleep(5.0)
print("went on")
"""
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True, timeout=60)
    assert (done.stderr.strip(), done.stdout) == ("interrupted", "") and done.returncode != 0


@pytest.mark.parametrize("argv", [["-m", "physid_drake.run_cell"], ["-m", "physid_drake", "diagnose", ERASER]])
def test_ctrl_c_while_a_command_starts_is_one_word(argv, tmp_path):
    for wait in (0.25, 0.6):
        child = subprocess.Popen([sys.executable, *argv], stderr=subprocess.PIPE, cwd=tmp_path, text=True)
        time.sleep(wait)
        while child.poll() is None:  # some compiled modules swallow one as they are imported
            child.send_signal(signal.SIGINT)
            time.sleep(0.5)
        said = child.stderr.read()
        child.stderr.close()
        assert "Traceback" not in said, said
        assert child.returncode != 0


@pytest.mark.parametrize("text", ["-1e-1", "-.5", "-3", "-2.", "-1E+2"])
def test_a_number_is_no_flag(text, capsys):
    assert NUMBER.fullmatch(text)
    assert main(["plan", "--goal", text, "0"]) == 1
    assert "give the folder" in capsys.readouterr().err


@pytest.mark.parametrize("name", [5000 * "x", "a\0b"])
@pytest.mark.parametrize(
    "words",
    [
        ["inspect"], ["inspect", "a", "--out"], ["convert", "cmu"], ["convert", "cmu", "a"], ["diagnose"],
        ["diagnose", "a", "--out"], ["plan", "--goal", "0", "0"], ["plan", "--goal", "0", "0", "--model"],
        ["prove", "--out"], ["prove", "--real"], ["experiment"], ["experiment", "x", "--out"],
    ],
)  # fmt: skip
def test_a_name_that_no_file_can_have_is_a_few_words(words, name, capsys):
    try:
        status = main([*words, name])
    except SystemExit as ended:
        status = ended.code
    said = capsys.readouterr().err
    assert status in (1, 2) and "error: " in said and len(said) < 3000


@pytest.mark.parametrize("words", [["--recording"], ["--out"], []])
def test_a_name_that_no_file_can_have_is_a_few_words_in_the_main_job(words, capsys):
    try:
        status = run_cell.main([*words, 5000 * "x"])
    except SystemExit as ended:
        status = ended.code
    assert status in (1, 2) and len(capsys.readouterr().err) < 3000


@pytest.mark.parametrize("module", ["physid_drake", "physid_drake.run_cell"])
def test_what_lies_in_the_working_folder_is_not_run(module, tmp_path):
    """``python -m`` looks for modules there first; a recording may hold anything."""
    for name in ("yaml", "numpy", "typing", "pydrake", "argparse", "__future__", "csv", "rich"):
        (tmp_path / f"{name}.py").write_text(f"open('ran_{name}', 'w')")
    done = subprocess.run([sys.executable, "-m", module, "--help"], check=False, capture_output=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert list(tmp_path.glob("ran_*")) == []


def test_a_checkout_that_is_not_installed_runs_where_it_lies(tmp_path):
    root = Path(__file__).parents[2]
    shutil.copytree(root / "physid_drake", tmp_path / "physid_drake", ignore=shutil.ignore_patterns("__pycache__"))
    script = "import physid_drake, sys; print(physid_drake.__file__); sys.exit()"
    (tmp_path / "physid_drake" / "where.py").write_text(script)
    done = subprocess.run(
        [sys.executable, "-m", "physid_drake.where"], check=False, capture_output=True, text=True, cwd=tmp_path
    )
    assert Path(done.stdout.strip()).parent == tmp_path / "physid_drake", done.stderr


def test_processes_that_work_for_a_command_run_nothing_of_the_working_folder(tmp_path):
    for name in ("joblib", "contextlib", "threading", "random"):
        (tmp_path / f"{name}.py").write_text(f"open('ran_{name}', 'w')")
    script = (
        "import sys; from joblib import Parallel, delayed; from physid_drake.command import run_command\n"
        "sys.exit(run_command(lambda: len(Parallel(n_jobs=2)(delayed(abs)(k) for k in range(4))) - 4))"
    )
    done = subprocess.run([sys.executable, "-P", "-c", script], check=False, capture_output=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert list(tmp_path.glob("ran_*")) == []
