"""What is printed is printed as it is: neither units nor names of pushes are markup."""

from rich.table import Table

from physid_drake.report.progress import progress_bar
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
    with progress_bar(terminal()) as tick:
        tick(WORDS[1], 1, 2)


def test_a_file_has_room_for_a_table(capsys):
    terminal().print("x" * NARROWEST)
    assert capsys.readouterr().out == "x" * NARROWEST + "\n"


def test_a_log_says_every_stage_once_and_apart_from_the_results(capsys):
    with progress_bar(terminal()) as tick:
        for stage, done in (("search", 1), ("search", 2), (WORDS[1], 1)):
            tick(stage, done, 2)
    printed = capsys.readouterr()
    assert [line.split(" s  ")[1] for line in printed.err.splitlines()] == ["search", WORDS[1]]
    assert printed.out == ""


def test_a_log_says_once_a_minute_how_far_a_long_stage_is(capsys, monkeypatch):
    clock = iter([100.0, 100.0, 130.0, 170.0, 200.0, 231.0, 300.0])
    monkeypatch.setattr("time.monotonic", lambda: next(clock))
    with progress_bar(terminal()) as tick:
        for done in range(5):
            tick("search", done, 9)
        tick("search", 0, 0)  # nobody knows how far
    lines = capsys.readouterr().err.splitlines()
    assert [line.strip() for line in lines] == ["0 s  search", "70 s  search, 2 of 9", "131 s  search, 4 of 9"]
