"""Which lines the tests run: tested_lines.py [coverage.json], after ``pytest -m "slow or not slow" --cov``.

(with ``--cov-report=json``). Prints the share of lines by package, and by file the lines that no test runs.
Compiled code (``twin/``) is run by numba, which coverage does not see; its files are not counted.
"""

import argparse
import json
from collections import defaultdict
from pathlib import Path

COMPILED = ("batch", "contact", "hand", "laws", "plane", "rollout", "stage", "support", "swing", "tip", "touch")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("report", type=Path, nargs="?", default=Path("coverage.json"))
    files = json.loads(parser.parse_args().report.read_text())["files"]
    packages = defaultdict(lambda: [0, 0])
    missing = {}
    for name, found in sorted(files.items()):
        path = Path(name).relative_to("physid_drake")
        if path.parts[0] == "twin" and path.stem in COMPILED:
            continue
        package = path.parts[0] if len(path.parts) > 1 else "(top level)"
        packages[package][0] += found["summary"]["covered_lines"]
        packages[package][1] += found["summary"]["num_statements"]
        if found["missing_lines"]:
            missing[path] = found["missing_lines"]
    print("| package | statements | run by tests |\n| --- | --- | --- |")
    for package, (covered, count) in [
        *sorted(packages.items()),
        ("all", [sum(c) for c in zip(*packages.values(), strict=True)]),
    ]:
        print(f"| {package} | {count} | {100.0 * covered / max(count, 1):.1f} % |")
    print("\n| file | lines that no test runs |\n| --- | --- |")
    for path, lines in missing.items():
        print(f"| `{path}` | {', '.join(spans(lines))} |")


def spans(lines):
    """Numbers, neighbours joined: 3, 5-9."""
    found = []
    for line in lines:
        if found and line == found[-1][1] + 1:
            found[-1][1] = line
        else:
            found.append([line, line])
    return [f"{a}" if a == b else f"{a}-{b}" for a, b in found]


if __name__ == "__main__":
    main()
