"""Fits the pushes as they are, and where they fit nothing, as they would be by other conventions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from physid_drake.doctor.convention import Convention
from physid_drake.doctor.conventions import conventions_of, pairs_of
from physid_drake.doctor.forces import conventions_of_forces, without_forces
from physid_drake.doctor.gaps import NEAR, elsewhere, gap_of, gaps_of, reading_by_most
from physid_drake.doctor.rough_fit import Left, left_by
from physid_drake.progress import Progress
from physid_drake.pushes.plausible import some_names
from physid_drake.recording import Recording

PUSHES: Final = 4
"""That are fitted: what is wrong with a convention is wrong with all."""
FAR: Final = 5.0
"""Deviations that a baseline leaves: less is physics that is missing, and what a diagnosis is for."""
MANY_PUSHES: Final = 7
"""The same, where some are not even pushes: of so many, most are as they seem."""
MUCH: Final = 3.0
"""Times: so much better a convention has to fit, to be offered."""
ALIKE: Final = 1.3
"""Times: conventions that fit as well as the best one."""
HAND_NOISE: Final = 3e-4
"""m: the hand's path is followed no better than that. A finer one has many more knots, and tells no frames."""
MOST_PAIRS: Final = 12
"""Pairs of conventions that are fitted."""
MOST_PUSHES: Final = 24
"""Pushes that are asked whether the tip drives them."""
DRIVEN: Final = 1.0 / 3.0
"""Of the pushes: more are hardly something else, even where every object was carried back."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """What the pushes say of the recording's conventions.

    Attributes:
        before: what the baseline model leaves, in units of noise (1 if it explains all); None where it is refused.
        refused: why it is refused; empty if it is not.
        after: deviations that it leaves by the best other convention; None where none is much better.
        better: conventions that fit as well as that one.
        elsewhere: names of pushes in which the object moves and the tip is elsewhere, while it is not in the others.
        odd: names of pushes that fit far worse than most of those that were fitted, of which the figures then are.
        asked: of how many pushes that is said.
    """

    before: float | None
    refused: str = ""
    after: float | None = None
    better: tuple[Convention, ...] = ()
    elsewhere: tuple[str, ...] = ()
    odd: tuple[str, ...] = ()
    asked: int = 0

    @property
    def left(self) -> float:
        """What is left at last, as the pushes are or by another convention; infinite where they are refused."""
        left = self.before if self.after is None else self.after
        return np.inf if left is None else left

    def lines(self) -> list[str]:
        """One line for each convention, and one of what is no push; none where pushes speak for what is said."""
        lines = []
        if self.after is not None:
            instead = "instead of not at all" if self.before is None else f"instead of {self.before:.3g}"
            lines = [
                f"the pushes fit to {self.after:.2g} sigma {instead} if {one.says} ({one.remedy})"
                for one in self.better
            ]
        if len(lines) > 1:
            lines.append("these are indistinguishable from the pushes: check which way the object really turned")
        if self.elsewhere:
            lines.append(
                f"in {len(self.elsewhere)} of {self.asked} pushes the object moves while the tip is not at it; were"
                f" they pushes? {some_names(self.elsewhere)} (left out of the rough fit)"
            )
        return lines

    def sentence(self) -> str:
        """What came of it."""
        if self.before is None:
            left = "some of the pushes cannot be fitted as recorded"
        else:
            left = (
                "a rough fit of the baseline model (no effects) to some pushes has an error of"
                f" {self.before:.3g} sigma (in units of tracker noise)"
            )
        if self.odd:
            left += f"; of these, {some_names(self.odd)} fit far worse than the others, and may be no pushes"
        if self.better or (self.before is not None and self.before < FAR):
            return left
        return f"{left}; no other unit or convention that was tested fits better"


def examined(recording: Recording, progress: Progress | None = None) -> Finding:
    """Whether the pushes speak for other conventions than what is said.

    Args:
        recording: the pushes.
        progress: called with the stage, steps done and steps in all.
    """
    moving = _moving(recording)
    few = _few(moving, PUSHES)
    here = left_by(few)
    if here[0] is not None and here[0].of_all < FAR:
        return Finding(before=here[0].of_all)
    near, astray = _driven(moving)
    if not astray or len(near) < max(2, DRIVEN * len(moving.pushes)):
        return _compared(few, *here, progress)
    few = _few(moving.subset(near), MANY_PUSHES)
    found = _compared(few, *left_by(few), progress)
    if not found.left < (FAR if here[0] is None else max(FAR, here[0].of_all / MUCH)):
        return found
    return replace(found, elsewhere=astray, asked=len(moving.pushes))


def _driven(recording: Recording) -> tuple[list[str], tuple[str, ...]]:
    """Names of pushes in which the tip is at the object as that is driven, and of those in which it is elsewhere.

    That is so by the convention by which it drives most. Of others, nobody knows.
    """
    if recording.hand is None:
        return [], ()
    reading = reading_by_most(_read_otherwise(recording))
    near = [push.name for push, gap in zip(reading.pushes, gaps_of(reading), strict=True) if gap < NEAR]
    return near, tuple(push.name for push in reading.pushes if elsewhere(reading, push))


def _read_otherwise(recording: Recording) -> Iterator[Recording]:
    """The recording as it is, and by each other convention of its places."""
    yield recording
    for convention in conventions_of(without_forces(recording)):
        yield convention.recording


def _compared(few: Recording, here: Left | None, refused: str, progress: Progress | None) -> Finding:
    """What the pushes say, of which so much is left as they are."""
    before = None if here is None else here.of_all
    if before is not None and before < FAR:
        return Finding(before=before)
    # What is said of forces may be wrong beside what is said of places: these are asked first, and alone.
    unforced = without_forces(few)
    placed = here
    if unforced is not few:
        placed, refused = left_by(unforced)
    if unforced is not few and placed is not None and placed.of_all < FAR:
        tried = list(conventions_of_forces(few))
    else:
        here, tried = placed, _likely(list(conventions_of(unforced)))
        before = None if here is None else here.of_all
    found = _fitted("other conventions", tried, progress)
    enough = _enough(before)
    least, seen = min(((left.of_all, one.recording) for left, one in found), key=_first, default=(np.inf, few))
    if not least < FAR and (odd := _of_most(here, refused, found)) is not None:
        return odd
    # No physics leaves the tip elsewhere than at what it pushes: by what fits, or as it is.
    if not least < FAR and gap_of(seen if before is None and least < enough else unforced) > NEAR:
        pairs = _fitted("two at once", _likely(list(pairs_of(unforced))), progress, most=MOST_PAIRS)
        both = min((left.of_all for left, _ in pairs), default=np.inf)
        if both < min(least / MUCH, enough if before is None else enough / MUCH):
            found, least = pairs, both
    if not least < enough:
        return Finding(before=before, refused=refused)
    better = _alike([(left.of_all, one) for left, one in found], least)
    return Finding(before=before, refused=refused, after=least, better=better)


def _of_most(here: Left | None, refused: str, found: Sequence[tuple[Left, Convention]]) -> Finding | None:
    """What is so for most pushes, where some fit by nothing; None where that is nothing."""
    if here is not None and here.of_most < FAR:
        return Finding(before=here.of_most, odd=_odd(here))
    before = None if here is None else here.of_most
    least, best = min(((left.of_most, left) for left, _ in found), key=_first, default=(np.inf, None))
    if best is None or not least < min(FAR, _enough(before)):
        return None
    better = _alike([(left.of_most, one) for left, one in found], least)
    return Finding(before=before, refused=refused, after=least, better=better, odd=_odd(best))


def _odd(left: Left) -> tuple[str, ...]:
    """Names of pushes that fit far worse than most."""
    far = left.each > max(FAR, MUCH * left.of_most)
    return tuple(name for name, is_far in zip(left.names, far, strict=True) if is_far)


def _enough(before: float | None) -> float:
    """What a convention may leave, to be offered. To be fitted at all is worth much, where it is refused as it is."""
    return MUCH * FAR if before is None else before / MUCH


def _first(pair: tuple[float, object]) -> float:
    return pair[0]


def _alike(found: Sequence[tuple[float, Convention]], least: float) -> tuple[Convention, ...]:
    """Those that fit about as well as the best, which is the first."""
    best = sorted((pair for pair in found if pair[0] <= ALIKE * least), key=_first)
    return _simplest([one for _, one in best])


def _simplest(conventions: Sequence[Convention]) -> tuple[Convention, ...]:
    """Without those that are another one and something more."""
    said = [one.says for one in conventions]
    return tuple(one for one in conventions if not any(one.says.startswith(f"{other}, and ") for other in said))


def _fitted(
    stage: str, conventions: Sequence[Convention], progress: Progress | None, most: int | None = None
) -> list[tuple[Left, Convention]]:
    """What the baseline leaves by each of the first conventions that are not refused."""
    found: list[tuple[Left, Convention]] = []
    for convention in conventions:
        if len(found) == most:
            break
        if progress is not None:
            progress(stage, len(found), most or len(conventions))
        left, _ = left_by(convention.recording)
        if left is not None:
            found.append((left, convention))
    return found


def _moving(recording: Recording) -> Recording:
    """The pushes in which something moves; some of many, drawn at random, since every second one may be of a kind."""
    ways = [float(np.hypot(*np.ptp(push.object.planar[:, :2], axis=0))) for push in recording.pushes]
    moving = [k for k, way in enumerate(ways) if way > 0.2 * float(np.median(ways))]
    drawn = np.random.default_rng(0).permutation(moving)[:MOST_PUSHES]
    return recording.subset(np.sort(drawn).tolist())


def _few(recording: Recording, most: int) -> Recording:
    """Some of the pushes, at equal distances."""
    count = len(recording.pushes)
    chosen = np.unique(np.linspace(0, count - 1, min(most, count)).round().astype(int))
    sensors = recording.sensors
    stated = max(sensors.hand_position_std or 0.0, HAND_NOISE)
    return replace(recording.subset(chosen.tolist()), sensors=replace(sensors, hand_position_std=stated))


def _likely(conventions: list[Convention]) -> list[Convention]:
    """Those by which the tip is about as near to what it pushes as by the best of them, the nearest first."""
    gaps = [(gap_of(convention.recording), convention) for convention in conventions]
    known = [gap for gap, _ in gaps if gap >= 0.0]
    if not known:
        return conventions
    near = [pair for pair in gaps if pair[0] < max(NEAR, MUCH * min(known))]
    return [convention for _, convention in sorted(near, key=lambda pair: pair[0])]
