"""What is printed is printed as it is: neither units nor names of pushes are markup."""

import io
import re

from rich.console import Console
from rich.table import Table

from physid_drake.report.progress import DIAGNOSIS_STAGES, Forecast, progress_bar
from physid_drake.report.terminal import NARROWEST, terminal

WORDS = ("path [mm]", "wild[/b].csv", "[red]")


def test_brackets_are_printed(capsys):
    table = Table(title=WORDS[1], caption=WORDS[2])
    table.add_column(WORDS[0])
    table.add_row(WORDS[1])
    console = terminal()
    console.print(table)
    console.print(*WORDS)
    printed = capsys.readouterr().out
    assert [printed.count(word) for word in WORDS] == [2, 3, 2]


def test_a_bar_takes_any_name_for_its_stage():
    with progress_bar(terminal()) as progress:
        progress(WORDS[1], 1, 2)


def test_a_file_has_room_for_a_table(capsys):
    terminal().print("x" * NARROWEST)
    assert capsys.readouterr().out == "x" * NARROWEST + "\n"


def test_a_log_says_every_stage_once_and_apart_from_the_results(capsys):
    with progress_bar(terminal()) as progress:
        for stage, done in (("search", 1), ("search", 2), (WORDS[1], 1)):
            progress(stage, done, 2)
    printed = capsys.readouterr()
    assert [line.split(" s  ")[1] for line in printed.err.splitlines()] == ["search", WORDS[1]]
    assert printed.out == ""


class Clock:
    """Seconds that pass when a test says so."""

    def __init__(self, monkeypatch):
        self.now = 100.0
        monkeypatch.setattr("time.monotonic", lambda: self.now)


def test_a_log_says_once_a_minute_how_far_a_long_stage_is(capsys, monkeypatch):
    clock = Clock(monkeypatch)
    with progress_bar(terminal()) as progress:
        for done, seconds in enumerate((0.0, 30.0, 70.0, 100.0, 131.0)):
            clock.now = 100.0 + seconds
            progress("search", done, 9)
        clock.now = 300.0
        progress("search", 0, 0)  # nobody knows how far
    lines = [line.strip() for line in capsys.readouterr().err.splitlines()]
    assert lines == [
        "0 s  search", "70 s  search, 2 of 9 (4 min left)", "131 s  search, 4 of 9 (3 min left)"
    ]  # fmt: skip


STAGES = {"first": 1.0, "second": 4.0, "third": 2.0}


def test_what_is_left_of_all_stages_by_how_long_those_before_have_lasted(monkeypatch):
    clock = Clock(monkeypatch)
    forecast = Forecast(STAGES)
    forecast.tell("first", 0, 0)
    assert forecast.left() is None and forecast.words() == ""
    clock.now += 10.0
    forecast.tell("second", 0, 0)
    assert forecast.left() == 60.0 and forecast.words() == "at most 60 s left"
    clock.now += 30.0
    assert forecast.left() == 30.0
    clock.now += 30.0  # longer than usual by 20 s: as long again, and what comes is slow, too
    assert forecast.left() == 20.0 + 36.0 and forecast.words() == "at most 55 s left"
    forecast.tell("third", 0, 0)
    assert forecast.left() == 28.0  # 70 s for 5 of 7 parts


def test_a_stage_that_is_slow_makes_what_comes_slow(monkeypatch):
    """A law that Drake has to roll out: stages that look for effects last twenty times as long as the first tell."""
    clock, shares = Clock(monkeypatch), {}
    as_usual = {"parameter fit", "refit in the Drake cell"}
    lasts = {name: seconds * (1.0 if name in as_usual else 20.0) for name, seconds in DIAGNOSIS_STAGES.items()}
    forecast, end = Forecast(DIAGNOSIS_STAGES), clock.now + sum(lasts.values())
    for name, seconds in lasts.items():
        forecast.tell(name, 0, 0)
        clock.now += 0.8 * seconds
        left = forecast.left()
        shares[name] = 0.0 if left is None else left / (end - clock.now)
        clock.now += 0.2 * seconds
    # It was .05 and .24 of what was left.
    assert shares["test for missing physics"] > 0.3 and 0.7 < shares["single effects"] < 1.2
    assert all(0.4 < share < 1.2 for share in list(shares.values())[3:])


def test_a_stage_may_be_left_out_or_unknown(monkeypatch):
    clock = Clock(monkeypatch)
    forecast = Forecast(STAGES)
    forecast.tell("first", 0, 0)
    clock.now += 10.0
    forecast.tell("third", 0, 0)
    assert forecast.left() == 20.0
    forecast.tell("something else", 0, 0)
    assert forecast.left() is None
    clock.now += 5.0
    forecast.tell("something else", 1, 3)
    assert forecast.left() == 10.0 and forecast.words() == "10 s left"


def test_eighty_columns_hold_the_line(monkeypatch):
    """Every stage's name, a bar, the time that passed and what is left."""
    console = Console(width=80, force_terminal=True, file=io.StringIO(), markup=False)
    clock = Clock(monkeypatch)
    for stage in DIAGNOSIS_STAGES:
        with progress_bar(console, DIAGNOSIS_STAGES) as progress:
            progress(next(iter(DIAGNOSIS_STAGES)), 0, 0)
            clock.now += 100.0
            progress(stage, 0, 0)
    written = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", console.file.getvalue())
    lines = [line for line in re.split(r"[\r\n]+", written) if line.strip()]
    assert lines and max(map(len, lines)) <= 80 and not any("…" in line for line in lines)
    assert any("left" in line for line in lines)
