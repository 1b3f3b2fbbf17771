"""The package `lap`, which knows no forbidden pairs: they cost nothing, and so does a row left alone."""

import lap
import numpy as np

from exchange import Answer, read, times

answer = Answer()
for name in ["dense", "gated"]:
    costs = np.minimum(read(name), 0.0)
    ms, columns = times(5, lambda: lap.lapjv(costs, return_cost=False)[0])
    answer.case(name, ms, {"sum": costs[np.arange(len(costs)), columns].sum()})
answer.print()
