"""Computes the cohort's statistics again, with numpy and scipy, and compares.

    check_statistics.py CASES.json

Nothing here is the program's code in another language: sums go by numpy's own functions, α by the covariance matrix, mean
squares by an analysis of variance, the crossing of two normal curves by a root finder on their densities, lines and
correlations by scipy.stats. Where pingouin is installed, α and ICC are also compared with its figures, and
weighted κ with those of statsmodels, which pingouin brings along. Exits with 1 and a
line per difference.
"""

import json
import sys

import numpy
import scipy.optimize
import scipy.special
import scipy.stats

try:
    import pandas
    import pingouin
except ImportError:
    pingouin = None

try:
    from statsmodels.stats.inter_rater import cohens_kappa
except ImportError:
    cohens_kappa = None

#: How far two figures may differ: of their size, or of 1 if that is more.
TOLERANCE = 1e-9


def main(arguments):
    [path] = arguments
    cases = json.load(open(path))
    figures = 0
    differences = []
    for number, case in enumerate(cases):
        for name, ours, theirs in CHECKS[case["what"]](case):
            figures += 1
            if (ours is None) != (theirs is None) or ours is not None and not near(ours, theirs):
                differences.append(f"case {number}, {case['what']}: {name}: {ours} here, {theirs} in Python")
    print("\n".join(differences))
    with_pingouin = f"pingouin {pingouin.__version__}" if pingouin else "no pingouin"
    with_pingouin += ", statsmodels" if cohens_kappa else ", no statsmodels"
    print(f"{figures} figures of {len(cases)} tables, {with_pingouin}", file=sys.stderr)
    return 1 if differences or not figures else 0


def near(ours, theirs, tolerance=TOLERANCE):
    return abs(ours - theirs) <= tolerance * max(1.0, abs(theirs))


def pairs(name, ours, theirs):
    for index, (a, b) in enumerate(zip(ours, theirs, strict=True)):
        yield f"{name}[{index}]", a, float(b)


def bounded(case):
    """Student's intervals of the logarithm and of the logit of the mean, their standard errors by the delta method."""
    amounts, shares = numpy.array(case["amounts"]), numpy.array(case["percentages"]) / 100
    scale = scipy.stats.sem(amounts) / amounts.mean()
    interval = scipy.stats.t.interval(0.95, len(amounts) - 1, loc=numpy.log(amounts.mean()), scale=scale)
    yield from pairs("amounts", case["intervals"][0], numpy.exp(interval))
    mean = shares.mean()
    scale = scipy.stats.sem(shares) / (mean * (1 - mean))
    interval = scipy.stats.t.interval(0.95, len(shares) - 1, loc=scipy.special.logit(mean), scale=scale)
    yield from pairs("percentages", case["intervals"][1], 100 * scipy.special.expit(interval))


def spread(case):
    values = numpy.array(case["values"])
    yield "mean", case["mean"], values.mean()
    yield "sd", case["sd"], values.std(ddof=1)
    interval = scipy.stats.t.interval(0.95, len(values) - 1, loc=values.mean(), scale=scipy.stats.sem(values))
    yield from pairs("interval", case["interval"], interval)
    yield from pairs("quartiles", case["quartiles"], numpy.percentile(values, [25, 75]))
    yield "median", case["median"], numpy.median(values)


def share(case):
    interval = scipy.stats.binomtest(case["had"], case["of"]).proportion_ci(0.95, method="wilson")
    yield from pairs("interval", case["interval"], interval)


def alpha_of(answers):
    count = answers.shape[1]
    covariance = numpy.atleast_2d(numpy.cov(answers.T))
    if count < 2 or covariance.sum() <= 0:
        return None
    return count / (count - 1) * (1 - numpy.trace(covariance) / covariance.sum())


def alpha(case):
    answers = numpy.array(case["answers"])
    people, count = answers.shape
    value = alpha_of(answers)
    yield "alpha", case["alpha"], value
    freedom = (people - 1, (people - 1) * (count - 1))
    interval = [1 - (1 - value) * scipy.stats.f.ppf(share, *freedom) for share in (0.975, 0.025)]
    yield from pairs("interval", case["interval"], interval)
    for index, (with_rest, without) in enumerate(case["items"]):
        others = numpy.delete(answers, index, axis=1)
        own, rest = answers[:, index], others.sum(axis=1)
        varies = own.std() > 0 and rest.std() > 0
        yield f"with_rest[{index}]", with_rest, scipy.stats.pearsonr(own, rest)[0] if varies else None
        yield f"alpha_without[{index}]", without, alpha_of(others)
    if pingouin and people > 2:
        yield "alpha (pingouin)", case["alpha"], pingouin.cronbach_alpha(data=pandas.DataFrame(answers))[0]


def mean_squares(values):
    people, attempts = values.shape
    grand = values.mean()
    rows = attempts * ((values.mean(axis=1) - grand) ** 2).sum() / (people - 1)
    columns = people * ((values.mean(axis=0) - grand) ** 2).sum() / (attempts - 1)
    fitted = values.mean(axis=1)[:, None] + values.mean(axis=0)[None, :] - grand
    rest = ((values - fitted) ** 2).sum() / ((people - 1) * (attempts - 1))
    return rows, columns, rest


def icc(case):
    values = numpy.array(case["values"])
    n, k = values.shape
    rows, columns, rest = mean_squares(values)
    value = (rows - rest) / (rows + (k - 1) * rest + k * (columns - rest) / n)
    yield "icc", case["icc"], value
    # Shrout & Fleiss 1979, p. 424.
    ratio = columns / rest
    inner = n * (1 + (k - 1) * value) - k * value
    freedom = (k - 1) * (n - 1) * (k * value * ratio + inner) ** 2 / ((n - 1) * (k * value * ratio) ** 2 + inner**2)
    upper = scipy.stats.f.ppf(0.975, n - 1, freedom)
    lower = scipy.stats.f.ppf(0.975, freedom, n - 1)
    spare = k * columns + (k * n - k - n) * rest
    interval = [n * (rows - upper * rest) / (upper * spare + n * rows), n * (lower * rows - rest) / (spare + n * lower * rows)]
    yield from pairs("interval", case["interval"], interval)
    first, second = values[:, 0], values[:, 1]
    yield "correlation", case["correlation"], scipy.stats.pearsonr(first, second)[0]
    gains = second - first
    yield "gain", case["gain"], gains.mean()
    around = scipy.stats.t.interval(0.95, n - 1, loc=gains.mean(), scale=scipy.stats.sem(gains))
    yield from pairs("gain_interval", case["gain_interval"], around)
    yield "error", case["error"], gains.std(ddof=1) / numpy.sqrt(2)
    if pingouin and n > 4:
        table = pandas.DataFrame(values).reset_index().melt(id_vars="index")
        found = pingouin.intraclass_corr(table, targets="index", raters="variable", ratings="value").set_index("Type")
        name = next(name for name in found.index if name in ("ICC2", "ICC(A,1)"))
        yield "icc (pingouin)", case["icc"], found.loc[name, "ICC"]
        # pingouin rounds its interval to hundredths.
        bounds = next(found.loc[name, column] for column in ("CI95", "CI95%") if column in found.columns)
        for index, (ours, theirs) in enumerate(zip(case["interval"], bounds, strict=True)):
            yield f"interval (pingouin)[{index}]", numpy.round(ours, 2), numpy.round(float(theirs), 2)


def kappa(case):
    ratings, count, power = numpy.array(case["pairs"]) - 1, case["categories"], case["power"]
    n = len(ratings)
    distance = (numpy.abs(numpy.subtract.outer(numpy.arange(count), numpy.arange(count))) / (count - 1)) ** power
    table = numpy.zeros((count, count))
    numpy.add.at(table, (ratings[:, 0], ratings[:, 1]), 1)
    expected = numpy.outer(table.sum(axis=1), table.sum(axis=0)) / n**2
    value = 1 - (distance * table).sum() / n / (distance * expected).sum()
    yield "kappa", case["kappa"], value
    # The derivative of kappa by each work's cell: an influence function, whose variance over works is that of Fleiss, Cohen
    # and Everitt without their formula.
    chance = (distance * expected).sum()
    by_first, by_second = distance @ table.sum(axis=0) / n, distance.T @ table.sum(axis=1) / n
    own = distance[ratings[:, 0], ratings[:, 1]]
    influence = -own / chance + (1 - value) * (by_first[ratings[:, 0]] + by_second[ratings[:, 1]]) / chance
    half = scipy.stats.norm.ppf(0.975) * influence.std() / numpy.sqrt(n)
    yield from pairs("interval", case["interval"], [max(value - half, -1), min(value + half, 1)])
    if cohens_kappa:
        found = cohens_kappa(table, wt={1: "linear", 2: "quadratic"}[power])
        yield "kappa (statsmodels)", case["kappa"], found.kappa
        bounds = [max(found.kappa_low, -1), min(found.kappa_upp, 1)]
        yield from pairs("interval (statsmodels)", case["interval"], bounds)


def contrasting(case):
    below, above = numpy.array(case["not_yet"]), numpy.array(case["competent"])
    normal = [scipy.stats.norm(group.mean(), group.std(ddof=1)) for group in (below, above)]
    difference = lambda x: normal[0].logpdf(x) - normal[1].logpdf(x)
    low, high = below.mean(), above.mean()
    has_cut = low < high and difference(low) > 0 > difference(high)
    cut = scipy.optimize.brentq(difference, low, high, xtol=1e-13, rtol=1e-14) if has_cut else None
    yield "cut", case["cut"], cut
    if cut is not None:
        yield from pairs("wrong", case["wrong"], [(above < cut).sum(), (below >= cut).sum()])


def borderline(case):
    ratings, scores = numpy.array(case["judged"]).T
    line = scipy.stats.linregress(ratings, scores)
    n = len(ratings)
    yield "cut", case["cut"], line.intercept + 2.0 * line.slope
    yield "slope", case["slope"], line.slope
    yield "explained", case["explained"], line.rvalue**2
    # By the covariance of the two coefficients, from the design matrix.
    design = numpy.column_stack([numpy.ones(n), ratings])
    residuals = scores - design @ numpy.linalg.lstsq(design, scores, rcond=None)[0]
    covariance = numpy.linalg.inv(design.T @ design) * (residuals @ residuals) / (n - 2)
    at = numpy.array([1.0, 2.0])
    half = scipy.stats.t.ppf(0.975, n - 2) * numpy.sqrt(at @ covariance @ at)
    cut = line.intercept + 2.0 * line.slope
    yield from pairs("interval", case["interval"], [cut - half, cut + half])
    half = scipy.stats.t.ppf(0.975, n - 2) * line.stderr
    yield from pairs("slope_interval", case["slope_interval"], [line.slope - half, line.slope + half])


CHECKS = {
    "bounded": bounded,
    "spread": spread,
    "share": share,
    "alpha": alpha,
    "icc": icc,
    "kappa": kappa,
    "contrasting": contrasting,
    "borderline": borderline,
}


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
