"""One quantile of a random sample."""

from tolstat.statistics.intervals.quantiles import quantiles


def quantile(values, share):
    return quantiles(values, [share])[share]
