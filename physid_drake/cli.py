"""The command line, one function for each command (``COMMANDS``)."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from physid_drake.command import Parser, path, run_command, say_error
from physid_drake.errors import ConfigError
from physid_drake.recording import Recording
from physid_drake.versions import made_with
from physid_drake.whole_files import write_whole

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[Parser]


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command.

    Args:
        argv: its words, without the program's name; None takes them from the command line.

    Returns:
        The exit status: 0 done, 1 an error of the input or output, 130 interrupted.
    """
    return run_command(lambda: _run(argv))


def _run(argv: Sequence[str] | None) -> int:
    words = sys.argv[1:] if argv is None else list(argv)
    if words[:1] == ["run_cell"]:
        # Drake takes a second to import, which the other commands need not wait for.
        from physid_drake.run_cell import main as run_cell  # noqa: PLC0415

        return run_cell(words[1:])
    arguments = build_parser().parse_args(words)
    return int(arguments.run(arguments))


def build_parser() -> argparse.ArgumentParser:
    """The parser with every command of ``COMMANDS``."""
    parser = Parser(
        prog="physid_drake",
        description="Identify an object's mass and friction from recorded pushes, and find the physics "
        "that a simulation is missing.",
        epilog="`physid_drake COMMAND --help` says more. Start: physid_drake diagnose eraser_reference",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="versions of this and of Drake")
    subparsers = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for register in COMMANDS:
        register(subparsers)
    return parser


EFFECTS, SEARCHES = "the effects", "the searches"
"""Stand for their names, for which the catalogues are imported only when help is asked for."""


class _WithEffects(argparse.HelpFormatter):
    def add_text(self, text: str | None) -> None:
        if text == EFFECTS:
            from physid_drake.effects import known_effects  # noqa: PLC0415

            names = ", ".join(sorted(kind.name for kind in known_effects()))
            text = f"effects: {names}. What each one is: docs/effects.md"
        super().add_text(text)


class _WithSearches(argparse.HelpFormatter):
    def _get_help_string(self, action: argparse.Action) -> str | None:
        if action.help != SEARCHES:
            return super()._get_help_string(action)
        from physid_drake.search import SEARCHES as KNOWN  # noqa: PLC0415

        return ", ".join(f"{name} (default)" if name == action.default else name for name in KNOWN)


class _Version(argparse.Action):
    """Says the versions that results depend on."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        print(made_with())
        parser.exit()


def _register_inspect(subparsers: Subparsers) -> None:
    parser = subparsers.add_parser("inspect", help="check a recording and show what is in it")
    parser.add_argument("recording", metavar="RECORDING", help="a FOLDER, or the name of a shipped recording")
    parser.add_argument("--out", type=path, metavar="FILE.png", help="also draw all pushes from above into this file")
    parser.add_argument("--no-fit", action="store_true", help="do not fit pushes to check units and conventions")
    parser.set_defaults(run=_run_inspect)


def _run_inspect(arguments: argparse.Namespace) -> int:
    # Drake takes a second to import, which the other commands need not wait for.
    from physid_drake.run_inspect import run  # noqa: PLC0415

    return run(arguments)


def _register_convert(subparsers: Subparsers) -> None:
    parser = subparsers.add_parser("convert", help="turn a log of your own or published data into a recording")
    parser.add_argument(
        "layout",
        choices=["table", "bag", "cmu", "mit", "cube"],
        help="table: columns that a map describes (CSV, npz, HDF5, Parquet); bag: a ROS 1 or 2 bag, with a map; cmu,"
        " mit, cube: published data sets",
    )
    parser.add_argument("source", type=path, metavar="SOURCE", help="a file, or a folder of them")
    parser.add_argument(
        "folder", type=path, nargs="?", metavar="FOLDER", help="output folder of the recording; new or empty"
    )
    parser.add_argument(
        "--guess",
        action="store_true",
        help="table and bag: show what is in SOURCE, and write a first map",
    )
    parser.add_argument("--map", type=path, metavar="FILE.yaml", help="table and bag: what each column or topic is")
    parser.add_argument(
        "--limit", type=int, metavar="N", help="published data sets: convert N pushes, chosen at random"
    )
    parser.add_argument("--seed", type=int, metavar="N", default=0, help="random seed of that choice (default 0)")
    parser.set_defaults(run=_run_convert)


def _run_convert(arguments: argparse.Namespace) -> int:
    if arguments.guess:
        return _guess(arguments)
    if arguments.folder is None:
        raise ConfigError("FOLDER is needed: where the recording goes; new or empty.")
    if arguments.layout in ("table", "bag"):
        if arguments.map is None:
            what = {"table": "columns", "bag": "topics"}[arguments.layout]
            raise ConfigError(f"--map is needed: a file that says what the {what} are (docs/bring_your_data.md).")
        from physid_drake.convert import convert_bag, convert_table  # noqa: PLC0415

        convert = {"table": convert_table, "bag": convert_bag}[arguments.layout]
        recording = convert(arguments.source, arguments.folder, arguments.map)
    else:
        recording = _published(arguments)
    print(f"{recording.name}: {len(recording.pushes)} pushes written to {arguments.folder}")
    if arguments.layout in ("table", "bag"):
        # Drake takes a second to import, which published layouts, whose frames are known, need not wait for.
        from physid_drake.run_inspect import look  # noqa: PLC0415

        refused = look(recording)[:1]
        for why in refused:
            say_error(why)
        if refused:
            print("A diagnosis would refuse it: correct the map, and convert to another folder.")
        print(f"next: physid_drake inspect {arguments.folder}")
        return 1 if refused else 0
    return 0


def _guess(arguments: argparse.Namespace) -> int:
    from physid_drake.convert.guess import guess_map, is_bag  # noqa: PLC0415
    from physid_drake.report.inspection import log_table  # noqa: PLC0415
    from physid_drake.report.progress import progress_bar  # noqa: PLC0415
    from physid_drake.report.terminal import terminal  # noqa: PLC0415

    if arguments.layout not in ("table", "bag"):
        raise ConfigError(f"--guess is for table and bag: the layout of {arguments.layout} is known; leave it out.")
    if arguments.folder is not None:
        raise ConfigError("FOLDER is for a conversion: --guess writes no recording; leave it out.")
    if is_bag(arguments.source) != (arguments.layout == "bag"):
        other = "bag" if arguments.layout == "table" else "table"
        raise ConfigError(f"'{arguments.source}': is no {arguments.layout}; use `convert {other}`.")
    if arguments.map is not None and arguments.map.exists():
        raise ConfigError(f"--map '{arguments.map}': is there; choose another name for the map that is guessed.")
    with progress_bar(terminal()) as progress:
        guess = guess_map(arguments.source, progress)
    terminal().print(log_table(arguments.source.name, guess.rows))
    if arguments.map is None:
        print(guess.text, end="")
        return 0
    write_whole(arguments.map, guess.text.encode())
    print(f"written: {arguments.map}; correct it, then convert with it")
    return 0


def _published(arguments: argparse.Namespace) -> Recording:
    from physid_drake.recording.adapters import convert_cmu, convert_cube, convert_mit  # noqa: PLC0415

    if arguments.map is not None:
        raise ConfigError(f"--map is for table and bag: the layout of {arguments.layout} is known; leave it out.")
    if arguments.seed < 0:
        raise ConfigError(f"--seed must be at least 0, but is {arguments.seed}.")
    convert = {"cmu": convert_cmu, "mit": convert_mit, "cube": convert_cube}[arguments.layout]
    return convert(arguments.source, arguments.folder, limit=arguments.limit, seed=arguments.seed)


def _register_diagnose(subparsers: Subparsers) -> None:
    parser = subparsers.add_parser(
        "diagnose", help="find the physics that a simulation of recorded pushes is missing",
        description="Test whether recorded pushes differ from a Drake simulation, locate the mismatch and name the "
        "missing physics; write a page, a 3D scene and a model with the effects found.",
        epilog=EFFECTS, formatter_class=_WithEffects,
    )  # fmt: skip
    parser.add_argument("recording", metavar="RECORDING", help="a FOLDER, or the name of a shipped recording")
    parser.add_argument("--out", type=path, metavar="FOLDER", help="output folder (default: diagnoses/FOLDER)")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="random seed (default 0)")
    parser.add_argument("--alpha", type=float, default=0.01, metavar="P", help="false-alarm rate (default 0.01)")
    parser.add_argument("--effects", nargs="+", metavar="NAME", help="test these effects only")
    parser.add_argument("--contact", choices=["point", "hydroelastic"], default="point",
                        help="contact model of the rollouts; the other model is the solver check")  # fmt: skip
    parser.add_argument(
        "--time-step", type=float, metavar="S", help="time step in contact (default: 1 ms, or by push speed)"
    )
    parser.add_argument(
        "--pushes", type=int, default=24, metavar="N", help="largest number of pushes used (default 24)"
    )
    parser.add_argument("--jobs", type=int, default=0, metavar="N", help="processes (default: number of cores)")
    parser.set_defaults(run=_run_diagnose)


def _run_diagnose(arguments: argparse.Namespace) -> int:
    # Drake takes a second to import, which the other commands need not wait for.
    from physid_drake.run_diagnose import run  # noqa: PLC0415

    return run(arguments)


def _register_prove(subparsers: Subparsers) -> None:
    parser = subparsers.add_parser(
        "prove", help="measure the diagnosis on sealed worlds of another simulator",
        description="Make recordings of pushes in MuJoCo, with and without an effect that the Drake model lacks; "
        "seal the ground truth; diagnose the recordings; open the ground truth and count effects found, named and "
        "located, and false alarms (pip install '.[proof]'). About a minute per world; an interrupted run resumes.",
    )  # fmt: skip
    parser.add_argument("--worlds", type=int, metavar="N", help="number of worlds (default 200)")
    parser.add_argument("--quick", action="store_true", help="ten worlds")
    parser.add_argument("--seed", type=int, metavar="N",
                        help="random seed (default: drawn, and sealed with the worlds; with --real: 0)")  # fmt: skip
    parser.add_argument(
        "--out",
        type=path,
        metavar="FOLDER",
        help="output folder (default: proofs/worlds or proofs/real)",
    )
    parser.add_argument(
        "--kind",
        choices=["none", "effect", "other", "pair", "notched"],
        help="make worlds of this kind only (default: a mix)",
    )
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, metavar="N",
                        help="parallel diagnoses (default: number of cores)")  # fmt: skip
    parser.add_argument("--timeout", type=float, default=1800.0, metavar="S",
                        help="a diagnosis that takes longer counts as failed (default 1800)")  # fmt: skip
    parser.add_argument("--cluster", metavar="ADDRESS",
                        help="run on the Dask scheduler at this address (pip install '.[cluster]')")  # fmt: skip
    parser.add_argument("--retry", action="store_true", help="repeat diagnoses that failed before")
    parser.add_argument("--open", action="store_true",
                        help="score the diagnoses made so far, and make no more")  # fmt: skip
    parser.add_argument("--real", type=path, metavar="FOLDER",
                        help="diagnose published recordings of real robots instead of worlds")  # fmt: skip
    parser.add_argument(
        "--only", nargs="+", metavar="NAME", help="with --real: only cases whose names begin with NAME"
    )
    parser.add_argument("--pushes", type=int, metavar="N",
                        help="with --real: number of pushes diagnosed (default 20)")  # fmt: skip
    parser.set_defaults(run=_run_prove)


def _run_prove(arguments: argparse.Namespace) -> int:
    # Matplotlib takes half a second to import and Drake a second, which the other commands need not wait for.
    if arguments.real is not None:
        given = {"--open": arguments.open, "--quick": arguments.quick, "--worlds": arguments.worlds is not None,
                 "--kind": arguments.kind is not None}  # fmt: skip
        for flag in (flag for flag, is_given in given.items() if is_given):
            raise ConfigError(f"{flag} is for sealed worlds: leave it out with --real.")
        from physid_drake.validation.run_prove_real import run_real  # noqa: PLC0415

        return run_real(arguments)
    for flag, given in (("--only", arguments.only), ("--pushes", arguments.pushes)):
        if given is not None:
            raise ConfigError(f"{flag} is for real recordings: give --real too.")
    from physid_drake.validation.run_prove import run  # noqa: PLC0415

    return run(arguments)


def _register_plan(subparsers: Subparsers) -> None:
    parser = subparsers.add_parser(
        "plan", help="find the push that brings the object to a goal, with a model", formatter_class=_WithSearches
    )
    parser.add_argument(
        "run_folder", nargs="?", type=path, metavar="RUN", help="folder of a run_cell run or a diagnosis"
    )
    wanted = parser.add_mutually_exclusive_group(required=True)
    wanted.add_argument("--goal", nargs=2, type=float, metavar=("X", "Y"), help="goal position on the table, in m")
    wanted.add_argument("--reach", metavar="ROBOT", help="baxter or motoman: any position that this robot reaches")
    parser.add_argument("--start", nargs=3, type=float, metavar=("X", "Y", "DEG"),
                        help="start pose of the object (default: the middle of the table)")  # fmt: skip
    parser.add_argument("--policy", default="push_speed", metavar="NAME",
                        help="push_speed (default), push_direction, push or two_pushes")  # fmt: skip
    parser.add_argument("--model", type=path, metavar="FILE", help="plan with this model instead of RUN's model.yaml")
    parser.add_argument("--baseline", action="store_true",
                        help="plan with the baseline model (without the effects found), to compare")  # fmt: skip
    parser.add_argument(
        "--speed", type=float, metavar="M/S", help="with push_direction: speed of the push (default 0.05)"
    )
    parser.add_argument("--direction", type=float, metavar="DEG",
                        help="direction of push_speed, or middle of the search (default: to the goal)")  # fmt: skip
    parser.add_argument(
        "--travel", type=float, metavar="M", help="distance that the hand moves from first contact until it brakes"
    )
    parser.add_argument(
        "--tolerance",
        type=float,
        default=0.01,
        metavar="M",
        help="largest miss that counts as a success (default 0.01)",
    )
    parser.add_argument(
        "--search",
        default="greedy_entropy",
        metavar="NAME",
        help=SEARCHES,
    )
    parser.add_argument(
        "--budget", type=int, metavar="N", help="candidates evaluated (default: 24, 48 or 64, by policy)"
    )
    parser.add_argument("--draws", type=int, default=20, metavar="N", help="posterior samples (default 20)")
    parser.add_argument("--risk", action="store_true", help="minimise the expected cost")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="random seed (default 0)")
    parser.add_argument(
        "--out", type=path, metavar="FOLDER", help="output folder (default: plans/ and the name of RUN)"
    )
    parser.set_defaults(run=_run_plan)


def _run_plan(arguments: argparse.Namespace) -> int:
    # Drake takes a second to import, which the other commands need not wait for.
    from physid_drake.run_plan import run  # noqa: PLC0415

    return run(arguments)


def _register_experiment(subparsers: Subparsers) -> None:
    parser = subparsers.add_parser(
        "experiment", help="repeat an experiment of the paper in hidden worlds",
        description="Repeat an experiment of the paper, with MuJoCo worlds in the place of its robot.",
        epilog="motion_prediction: how well identified frictions predict pushes. mit_pushes: the same on MIT's "
        "recorded pushes. push_direction: directions that bring an object to a goal. push_speed: speeds that let it "
        "slide there. next_push: whether informative pushes reduce the error faster than random ones. "
        "corrected_plan: what a plan gains from the effects that a diagnosis found. closed_loop: several pushes to "
        "a goal, each planned after observing the last.",
    )  # fmt: skip
    parser.add_argument(
        "name",
        metavar="NAME",
        help="motion_prediction, mit_pushes, push_direction, push_speed, next_push, corrected_plan or closed_loop",
    )
    parser.add_argument("--quick", action="store_true", help="a small version: two or three minutes")
    parser.add_argument("--data", type=path, metavar="FOLDER", help="mit_pushes: folder of the published end points")
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="parallel repetitions (default 1)")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="random seed (default 0)")
    parser.add_argument(
        "--out",
        type=path,
        metavar="FOLDER",
        help="output folder (default: experiments/NAME, with --quick NAME_quick)",
    )
    parser.set_defaults(run=_run_experiment)


def _run_experiment(arguments: argparse.Namespace) -> int:
    # Drake takes a second to import, which the other commands need not wait for.
    from physid_drake.validation.run_experiment import run  # noqa: PLC0415

    return run(arguments)


def _register_model(subparsers: Subparsers) -> None:
    parser = subparsers.add_parser(
        "model", help="export a model to your own simulation",
        description="Export the model of a run or a diagnosis to your own simulation.",
    )  # fmt: skip
    actions = parser.add_subparsers(title="actions", metavar="ACTION", required=True)
    export = actions.add_parser(
        "export", help="SDFormat, model directives and MJCF",
        description="Write a model as SDFormat with Drake's contact properties, as model directives that assemble"
        " object, table and hand, and as MJCF; README.txt lists the effects that these formats cannot express.",
    )  # fmt: skip
    export.add_argument("model", type=path, metavar="MODEL", help="model.yaml, or the folder of a run that holds it")
    export.add_argument("--out", type=path, metavar="FOLDER",
                        help="output folder (default: exports/ and the name of MODEL's folder)")  # fmt: skip
    export.set_defaults(run=_run_model_export)


def _run_model_export(arguments: argparse.Namespace) -> int:
    # Drake takes a second to import, which the other commands need not wait for.
    from physid_drake.run_model import run_export  # noqa: PLC0415

    return run_export(arguments)


def _register_run_cell(subparsers: Subparsers) -> None:
    # Its own parser reads its words, once Drake is imported.
    subparsers.add_parser("run_cell", help="everything at once: identify, diagnose, plan and show", add_help=False)


COMMANDS: list[Callable[[Subparsers], None]] = [
    _register_inspect,
    _register_convert,
    _register_diagnose,
    _register_plan,
    _register_model,
    _register_run_cell,
    _register_prove,
    _register_experiment,
]
"""One function for each command; it adds its parser, which sets ``run``: arguments -> exit status."""
