"""Meshes: OBJ statements with every form of index, numbers out of all proportion, and names of other files."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from random import Random

from fuzz import seeds
from fuzz.case import Case
from fuzz.damage import damaged, replaced
from fuzz.reading import inspect
from fuzz.trees import yaml_text
from physid_drake.cell.solid import solid_of

NUMBERS = ("0", "1", "-1", "0.03", "-0.05", "1e9", "1e10", "1e308", "1e400", "1e-320", "nan", "inf", "1_0",
           "0x1", "x", "", "1,5",
           "--1", "1e", "9" * 400, "\u0661", "1d0", "+.5", "1e-9")  # fmt: skip
INDICES = ("0", "1", "2", "8", "9", "10", "100", "-1", "-8", "-9", "-100", "4294967296", "99999999999999999999",
           "1/1", "1//1",
           "1/1/1", "1/", "1//", "/1", "1/1/1/1", "1.0", "x", "+1", "-0", "1\\", "2147483648", "-2147483648",
           "\u0662",
           "500001", "1/9", "1//9", "1/-9/9")  # fmt: skip
FILES = ("cube.mtl", "../secret.txt", "/etc/passwd", "..\\secret.txt", "C:\\x.mtl", "~/x", "a b.mtl",
         "/dev/zero", "pipe.mtl",
         "link.mtl", "", "http://a/b.mtl", "x" * 3000, "cube.obj", ".", "\x1b[2J")  # fmt: skip
MATERIAL = "newmtl a\nKd 1 0 0\nmap_Kd {0}\nmap_Ka ../secret.txt\nbump /dev/zero\nmap_Kd cube.png\n"


def make(rng: Random, folder: Path) -> Case:
    """A recording of a mesh."""
    lines = seeds.CUBE.splitlines()
    for _ in range(rng.choice((1, 1, 1, 2, 5))):
        lines = _changed(rng, lines)
    end = rng.choice(("\n", "\n", "\n", "\r\n", "\r"))
    content = (end.join(lines) + end).encode("utf-8", "surrogatepass")
    if rng.random() < 0.12:
        content = damaged(rng, content)
    scale = rng.choice((1.0,) * 20 + (1e-3, 1e3, 1e-300, 1e300, -1.0))
    shape = {"shape": "mesh", "file": "meshes/cube.obj", "scale": scale}
    root = seeds.lay(folder / "r", {
        **seeds.recording(), "meshes/cube.obj": content,
        "meshes/cube.mtl": MATERIAL.format(rng.choice(FILES)).encode(),
        "recording.yaml": yaml_text({**seeds.description(), "object": shape}).encode(),
    })  # fmt: skip
    (root / "meshes/link.mtl").symlink_to(folder.parent / "secret.txt")
    if rng.random() < 0.03:
        replaced(rng, root / "meshes/cube.obj", secret=folder.parent / "secret.obj")
    return Case(partial(_read, root, folder / "written"))


def _read(root: Path, out: Path) -> None:
    recording = inspect(root, out)
    solid_of(recording.object.shape)  # by Drake


def _changed(rng: Random, lines: list[str]) -> list[str]:  # noqa: PLR0911
    at = rng.randrange(len(lines) + 1)
    match rng.randrange(12):
        case 0 | 1:
            return [*lines[:at], rng.choice(STATEMENTS)(rng), *lines[at:]]
        case 2:
            return lines[:at] + lines[at + 1 :]
        case 3:
            return lines[:at] + lines[at : at + 1] * rng.choice((2, 300)) + lines[at:]
        case 4 | 5:  # a word
            if at == len(lines):
                return lines
            words = lines[at].split(" ")
            words[rng.randrange(len(words))] = rng.choice(INDICES if words[0] == "f" else NUMBERS)
            return [*lines[:at], " ".join(words), *lines[at + 1 :]]
        case 6:  # flat, or a line
            zero = rng.choice((1, 2, 3))
            return [" ".join(["v", *("0" if k == zero else word for k, word in enumerate(line.split()) if k)])
                    if line.startswith("v ") else line for line in lines]  # fmt: skip
        case 7:  # scaled
            factor = rng.choice((1e-12, 1e-6, 1e3, 1e9, 1e12, 1e300, -1.0, 1e-3))
            return [_scaled(line, factor) for line in lines]
        case 8:
            return [line.replace(" ", rng.choice(("  ", "\t", " \\\n ", " # x ", "\u00a0"))) if k == at else line
                    for k, line in enumerate(lines)]  # fmt: skip
        case 9:
            rng.shuffle(lines)
            return lines
        case 10:
            return [line for line in lines if not line.startswith(rng.choice(("f", "v")))]
        case _:
            return [
                *lines[:at],
                rng.choice(("\\", "#", "# \\", "\x00", "\x1b[2J", "g", "o a\0b", "\ufeff", "end", "s off")),
                *lines[at:],
            ]


def _scaled(line: str, factor: float) -> str:
    words = line.split()
    try:
        return " ".join([words[0], *(repr(float(word) * factor) for word in words[1:])]) if words[0] == "v" else line
    except (IndexError, ValueError):
        return line


def _words(rng: Random, first: str, some: tuple[str, ...], most: int) -> str:
    return " ".join([first, *(rng.choice(some) for _ in range(rng.randrange(most)))])


NAMING = ("mtllib", "maplib", "usemap", "call", "csh", "shadow_obj", "trace_obj")
GROUPS, GROUP_NAMES = ("usemtl", "o", "g", "s", "mg", "lod"), ("a", "", "x" * 3000, "../x", "0")
ELEMENTS = ("l", "p", "fo", "curv", "surf", "parm u", "deg", "cstype bezier")


def _vertices(rng: Random, count: int) -> str:
    return "\n".join(f"v {rng.gauss(0, 0.05)} {rng.gauss(0, 0.05)} {rng.gauss(0, 0.05)}" for _ in range(count))


STATEMENTS = (
    lambda rng: _words(rng, "v", NUMBERS, 9),
    lambda rng: _words(rng, "f", INDICES, 7),
    lambda rng: _words(rng, "f", ("1", "2", "3", "4", "-1"), 7),
    lambda rng: _words(rng, "f", ("1/1/1", "2/2/2", "3//3", "4/4", "-1/-1/-1"), 7),
    lambda rng: "f " + " ".join(["1 2 3"] * rng.choice((1, 100, 3000))),
    lambda rng: _words(rng, rng.choice(("vt", "vn", "vp")), NUMBERS, 5),
    lambda rng: _words(rng, rng.choice(ELEMENTS), INDICES, 5),
    lambda rng: f"{rng.choice(NAMING)} {rng.choice(FILES)}",
    lambda rng: f"{rng.choice(GROUPS)} {rng.choice(GROUP_NAMES)}",
    lambda rng: _vertices(rng, rng.choice((1, 50))),
)
