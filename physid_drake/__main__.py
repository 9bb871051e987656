"""``python -m physid_drake``: the same as the command ``physid_drake``."""

import sys

from physid_drake.cli import main

sys.exit(main())
