"""Computes the examiners' agreement again, with numpy, scipy and, where they are there, statsmodels and pingouin.

    check_agreement.py FOLDER RATINGS.csv COHORT.json

FOLDER holds the bundles, RATINGS.csv is the review desk's export, COHORT.json is what `typodont cohort --ratings` made of
both. Prints a line per difference and exits with 1 if there is one.
"""

import csv
import json
import pathlib
import sys

import numpy
import scipy.stats

try:
    import pandas
    import pingouin
    from statsmodels.stats.inter_rater import cohens_kappa
except ImportError:
    pingouin = None

TOLERANCE = 1e-9


def main(arguments):
    folder, table, summary = arguments
    sessions = {}
    for path in pathlib.Path(folder).glob("*/session.json"):
        session = json.loads(path.read_text())
        sessions[session["digests"]["recording.mcap"]] = session
    ratings = {}
    for row in csv.DictReader(open(table, newline="", encoding="utf-8-sig")):
        about = (row["item"], row["metric"])
        ratings.setdefault(about, {}).setdefault(row["rater"], {})[row["recording"]] = int(row["rating"])
    [scenario] = json.load(open(summary))["scenarios"]
    differences, figures = [], 0
    told = {(a["item"]["title"], a["item"]["metric"]) if a["item"] else ("", ""): a for a in scenario["agreement"]}
    if sorted(told) != sorted(ratings):
        differences.append(f"rated: {sorted(ratings)}, told: {sorted(told)}")
    for about, by_rater in ratings.items():
        by_rater = dict(by_rater)
        by_rater["machine"] = {recording: computed(session["grade"], about) for recording, session in sessions.items()}
        for pair in told[about]["pairs"]:
            first, second = (by_rater[name] for name in pair["raters"])
            works = sorted(set(first) & set(second))
            values = numpy.array([[first[w], second[w]] for w in works], dtype=float)
            for name, ours, theirs, tolerance in expected(pair, values):
                figures += 1
                if (ours is None) != (theirs is None) or ours is not None and abs(ours - theirs) > tolerance:
                    differences.append(f"{about} {pair['raters']}: {name}: {ours} told, {theirs} in Python")
    print("\n".join(differences))
    print(f"{figures} figures, {'with' if pingouin else 'without'} statsmodels and pingouin", file=sys.stderr)
    return 1 if differences or not figures else 0


def computed(grade, about):
    if about[0]:
        [item] = [i for i in grade["items"] if (i["title"], i["metric"]) == about]
        return 1 + 4 * item["points"] / item["max_points"]
    if grade["hard_fails"] or not grade["finished"]:
        return 1.0
    return float(numpy.interp(grade["points"], [0, grade["pass_points"], grade["max_points"]], [1, 2, 5]))


def expected(pair, values):
    yield "works", pair["works"], len(values), 0
    categories = numpy.floor(values + 0.5).astype(int) - 1
    table = numpy.zeros((5, 5))
    numpy.add.at(table, (categories[:, 0], categories[:, 1]), 1)
    for power, key in ((1, "kappa_linear"), (2, "kappa_quadratic")):
        value, interval = kappa(table, power)
        found = pair[key]
        yield key, found and found["kappa"], value, TOLERANCE
        if found:
            for index in (0, 1):
                yield f"{key} interval", found["interval"][index], interval[index], TOLERANCE
            if pingouin:
                other = cohens_kappa(table, wt={1: "linear", 2: "quadratic"}[power])
                yield f"{key} (statsmodels)", found["kappa"], other.kappa, TOLERANCE
                yield f"{key} low (statsmodels)", found["interval"][0], max(other.kappa_low, -1), TOLERANCE
                yield f"{key} high (statsmodels)", found["interval"][1], min(other.kappa_upp, 1), TOLERANCE
    if pair["icc"] and pingouin:
        long = pandas.DataFrame(values).reset_index().melt(id_vars="index")
        found = pingouin.intraclass_corr(long, targets="index", raters="variable", ratings="value").set_index("Type")
        name = next(name for name in found.index if name in ("ICC2", "ICC(A,1)"))
        yield "icc (pingouin)", pair["icc"]["icc"], found.loc[name, "ICC"], TOLERANCE
        bounds = next(found.loc[name, column] for column in ("CI95", "CI95%") if column in found.columns)
        for index in (0, 1):
            # pingouin rounds to hundredths.
            yield "icc interval (pingouin)", pair["icc"]["interval"][index], float(bounds[index]), 0.005 + TOLERANCE


def kappa(table, power):
    """Kappa, and its interval by the delta method on the cells of the table, with numerical derivatives."""
    n, count = table.sum(), len(table)
    steps = numpy.arange(count)
    distance = numpy.abs(steps[:, None] - steps[None, :]) ** power

    def of(shares):
        return 1 - (distance * shares).sum() * shares.sum() / (distance * numpy.outer(shares.sum(1), shares.sum(0))).sum()

    shares = table / n
    value = of(shares)
    gradient = numpy.zeros_like(shares)
    h = 1e-5
    for cell in numpy.ndindex(shares.shape):
        moved = numpy.zeros_like(shares)
        moved[cell] = h
        # Central differences of fourth order.
        gradient[cell] = (
            8 * (of(shares + moved) - of(shares - moved)) - (of(shares + 2 * moved) - of(shares - 2 * moved))
        ) / (12 * h)
    mean = (shares * gradient).sum()
    error = numpy.sqrt(((shares * gradient**2).sum() - mean**2) / n)
    half = scipy.stats.norm.ppf(0.975) * error
    return value, (max(value - half, -1), min(value + half, 1))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
