"""The command ``physid_drake``, and ``python -m physid_drake``."""

import sys

from physid_drake.process_start import is_interruption


def main() -> int:
    """Run the command line; returns the exit status."""
    try:
        from physid_drake.cli import main as run  # noqa: PLC0415  # Ctrl-C may come while it is imported
    except (KeyboardInterrupt, ImportError) as error:
        if not is_interruption(error):
            raise
        print("interrupted", file=sys.stderr)
        return 130
    return run()


if __name__ == "__main__":
    sys.exit(main())
