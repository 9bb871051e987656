"""Whether intervals and p-values hold what they say: calibration.py [--worlds N] [--effects NAME ...] [--chance].

Simulation-based calibration (S. Talts et al., arXiv 1804.06788, 2018) on worlds of the twin: theta, an effect and
each push's nuisance parameters are drawn, the pushes of a shipped recording are made with them and with noise as the
objective has it, and the hypothesis with that effect is fitted as a diagnosis fits it. If intervals are right, the
rank of the truth in what the fit believes is uniform. For every effect and coordinate: in how many worlds the 90 %
interval holds the truth, the same of those in which the effect was confirmed, and the p-value of a uniform rank
(Kolmogorov and Smirnov); with ``--out`` one figure of all ranks. 1,000 worlds take about an hour on one core.

With ``--chance`` no effect is drawn, and of all effects' p-value it is said how often it is below some values.
"""

import argparse
import dataclasses as dc
from collections import defaultdict
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table
from scipy import stats

from physid_drake.diagnose.hypotheses import freed, with_one_more
from physid_drake.diagnose.proposals import with_part
from physid_drake.effects import applicable
from physid_drake.identify.baseline import baseline, baseline_hypothesis, fitter_of, settled, with_tolerances
from physid_drake.identify.estimates import t_factor
from physid_drake.inference.fit import Fitter
from physid_drake.inference.predictions import Predictor
from physid_drake.inference.replicates import gains_by_chance, p_value, surprise, without_best
from physid_drake.inference.scores import columns
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording import read_recording
from physid_drake.resources import shipped

SIZES = (3.0, 30.0)  # steps of an amplitude's chart: from faint to strong, log-uniform
FRICTIONS = (0.3, 0.7)  # of the unit cube, what is drawn of theta
SCATTER = 0.6  # of friction from push to push, in units
SURE = 9.2  # nats of surprise: confirmed
LEVELS = (0.01, 0.05, 0.1, 0.2, 0.5)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worlds", type=int, default=50)
    parser.add_argument("--effects", nargs="*", metavar="NAME")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, metavar="FILE")
    parser.add_argument("--chance", action="store_true")
    given = parser.parse_args()
    recording = read_recording(shipped("recordings") / "eraser_reference")
    case = case_of(recording, cell_config(recording), ThetaConfig(), jobs=1)
    kinds = applicable(case.around, given.effects)
    if given.chance:
        draws = (chance(case, kinds, np.random.default_rng([given.seed, k])) for k in range(given.worlds))
        values = np.array([p for p in draws if p is not None])
        print(", ".join(f"below {a:g}: {np.sum(values < a)} of {len(values)}" for a in LEVELS))
        return
    scores, named, lost = defaultdict(list), defaultdict(list), 0
    for k in range(given.worlds):
        rng = np.random.default_rng([given.seed, k])
        kind = kinds[k % len(kinds)]
        made = world(case, kind, rng)
        if made is None:
            lost += 1
            continue
        for name, (score, sure) in made.items():
            scores[name].append(score)
            named[name].append(sure)
    print(f"{lost} of {given.worlds} draws could not be rolled out or fitted")
    Console(width=110).print(table(scores, named))
    if given.out is not None:
        figure(scores).savefig(given.out)


def recorded(case, h, z, rng):
    """What fits a recording of this truth, made by the twin, and its baseline; None if it cannot be rolled out."""
    maker = Fitter(case, Predictor(case))
    own = tuple(np.clip(rng.standard_normal(len(prior)), -2.0, 2.0) * prior for prior in maker.priors(SCATTER))
    point = maker.points([h], [z], [own])[0]
    if point is None:
        return None
    heard = [f + rng.standard_normal(len(f)) for f in point.predicted]
    features = tuple(
        dc.replace(f, recorded=np.linalg.solve(w, y))
        for f, w, y in zip(case.features, maker.predictor.whitening, heard, strict=True)
    )
    finder = fitter_of(dc.replace(case, features=features), 0)
    return finder, with_tolerances(finder, baseline(finder, rng))


def chance(case, kinds, rng):
    """The p-value of pushes without an effect."""
    h = baseline_hypothesis(case)
    seen = recorded(case, h, theta_of(h, rng), rng)
    if seen is None:
        return None
    finder, base = seen
    return p_value(*gains_by_chance(finder, base, columns(finder, base, kinds), rng))


def world(case, kind, rng):
    """By coordinate: the truth less the estimate in standard deviations, and whether the effect was confirmed."""
    h, z = drawn(case, kind, rng)
    seen = recorded(case, h, z, rng)
    if seen is None:
        return None
    finder, base = seen
    found = columns(finder, base, [kind])
    fits = [fit for fit in with_one_more(finder, base, found) if fit.hypothesis.parts]
    if not fits:
        return None
    fit = settled(finder, freed(finder, fits[0]), rng)
    _, by_chance = gains_by_chance(finder, base, found, rng)
    gain = without_best(finder.held_out(fit) - finder.held_out(base))
    sure = bool(surprise(gain[None], by_chance[kind.name])[0] > SURE)
    stds = t_factor(fit) * np.sqrt(np.diag(finder.covariance(fit)))
    d, here, there = h.space.dimension, fit.hypothesis, fit.point.z
    made = {}
    for j, name in enumerate(h.space.names):
        made[f"theta.{name}"] = (z[j] - there[j]) / stds[j], sure
    free = list(here.parts[0].free)
    for n, j in enumerate(free):
        c = kind.chart(case.around)[j]
        true = h.points(z)[0][j]
        made[f"{kind.name}.{c.name}"] = (true - there[d + n]) / stds[d + n], sure
    return made


def drawn(case, kind, rng):
    """A hypothesis with the effect at all of its coordinates, and its truth z."""
    base = baseline_hypothesis(case)
    family = kind.families(case.around)[rng.integers(len(kind.families(case.around)))]
    chart, point = kind.chart(case.around), np.array(family.point)
    size = np.exp(rng.uniform(*np.log(SIZES)))
    way = rng.standard_normal(len(family.free))
    for j, part in zip(family.free, way / np.linalg.norm(way), strict=True):
        step = size * part * chart[j].step
        step = abs(step) if chart[j].lower >= point[j] else step
        point[j] = np.clip(point[j] + step, chart[j].lower, chart[j].upper)
    h = with_part(base, kind, point)
    return h, np.concatenate([theta_of(base, rng), [point[j] for j in h.parts[0].free]])


def theta_of(base, rng):
    """Theta (d,) in the unit cube: frictions even within FRICTIONS, all else from its prior."""
    least, most = base.bounds
    theta = np.clip(base.mean + base.std * rng.standard_normal(len(base.mean)), least, most)
    told = [k for k, name in enumerate(base.space.names) if "friction" in name]
    theta[told] = rng.uniform(*FRICTIONS, size=len(told))
    return theta


def table(scores, named):
    z90 = stats.norm.ppf(0.95)
    rows = Table(
        "parameter", "worlds", "90 % intervals hold", "where confirmed", "p of uniform ranks", title_justify="left"
    )
    for name in sorted(scores):
        values, sure = np.array(scores[name]), np.array(named[name])
        held = np.abs(values) < z90
        p = stats.kstest(stats.norm.cdf(values), "uniform").pvalue
        some = f"{held[sure].sum()} of {sure.sum()}"
        rows.add_row(name, str(len(values)), f"{held.sum()} of {len(values)}", some, f"{p:.2g}")
    every = np.concatenate([np.abs(v) < z90 for v in scores.values()])
    rows.add_row("all", str(len(every)), f"{every.sum()} of {len(every)}", "", "")
    return rows


def figure(scores):
    names = sorted(scores)
    columns_ = 6
    made = Figure(figsize=(14, 1.6 * (len(names) // columns_ + 1)), layout="constrained")
    for k, name in enumerate(names):
        axes = made.add_subplot(len(names) // columns_ + 1, columns_, k + 1)
        axes.hist(stats.norm.cdf(scores[name]), bins=10, range=(0.0, 1.0), color="#3373cc")
        axes.axhline(len(scores[name]) / 10, color="0.3", linewidth=0.8)
        axes.set_title(name, fontsize=7)
        axes.set_xticks([0, 1])
        axes.set_yticks([])
    return made


if __name__ == "__main__":
    main()
