"""What comes before everything else where the package runs as a program: ``python -m physid_drake...``."""

# Nothing may be imported here that is not there already: it would be looked for in the working folder.
import _signal  # type: ignore[import-not-found]  # of the interpreter: signal is a file
import os
import sys


def begin() -> None:
    """Keep the working folder's own modules out, and let Ctrl-C during the imports end it with one line.

    ``python -m`` puts the working folder first on the module path, so that a ``yaml.py`` that lies in a recording
    would run. Where the package itself lies there, as in a checkout, the folder comes last instead.
    """
    if not getattr(sys.flags, "safe_path", False) and sys.path:
        here = os.path.abspath(sys.path.pop(0) or os.curdir)  # noqa: PTH100
        if os.path.abspath(__file__).startswith(os.path.join(here, "physid_drake", "")):  # noqa: PTH100, PTH118
            sys.path.append(here)
    sys.excepthook = _quiet_interrupt
    sys.unraisablehook = _postponed_interrupt


def is_interruption(error: "BaseException | None") -> bool:
    """Whether Ctrl-C is behind an error: compiled modules that are being imported make an ImportError of it."""
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return True
        error = error.__cause__ or error.__context__
    return False


def _quiet_interrupt(kind, error, traceback):  # type: ignore[no-untyped-def]
    if is_interruption(error):
        print("interrupted", file=sys.stderr)
    else:
        sys.__excepthook__(kind, error, traceback)


def _postponed_interrupt(unraisable):  # type: ignore[no-untyped-def]
    """Ctrl-C in a callback, as the import of a module has them: Python would print it and go on; it comes again."""
    if isinstance(unraisable.exc_value, KeyboardInterrupt):
        # A little later: what is raised here would be printed, too.
        _signal.signal(_signal.SIGALRM, _signal.default_int_handler)
        _signal.setitimer(_signal.ITIMER_REAL, 0.01)
    else:
        sys.__unraisablehook__(unraisable)
