"""The same knife edges on arrays, with the Fresnel integrals of SciPy."""

import numpy as np
from scipy.special import fresnel

from exchange import Answer, read, times

tx, rx, foot = read("tx"), read("rx"), read("foot")
wavelength, width, top = read("constants")


def power(nu):
    """Of what comes round an edge, as a share of that in free space: ITU-R P.526, 4.1."""
    s, c = fresnel(nu)
    return 0.5 * ((0.5 - c) ** 2 + (0.5 - s) ** 2)


def passages():
    """Distances from both ends in plan view, how far a body is aside, how high the path is there, and how steep."""
    way = tx[:, :2] - rx[:, :2]
    length = np.hypot(way[:, 0], way[:, 1])
    off = foot - rx[:, :2]
    to_rx = (way[:, 0] * off[:, 0] + way[:, 1] * off[:, 1]) / length
    aside = (way[:, 0] * off[:, 1] - way[:, 1] * off[:, 0]) / length
    slope = (tx[:, 2] - rx[:, 2]) / length
    return length - to_rx, to_rx, aside, rx[:, 2] + slope * to_rx, slope


def nu_per_m(to_tx, to_rx):
    return np.sqrt(2.0 / wavelength * (1.0 / to_tx + 1.0 / to_rx))


def losses(powers, to_tx, to_rx):
    """A body that is not between the ends of a link costs it nothing."""
    return np.where((to_tx > 0.0) & (to_rx > 0.0), -10.0 * np.log10(powers), 0.0)


def two_edges():
    to_tx, to_rx, aside, _, _ = passages()
    per_m = nu_per_m(to_tx, to_rx)
    half = 0.5 * width
    return losses(power(per_m * (half - aside)) + power(per_m * (half + aside)), to_tx, to_rx)


def three_edges():
    to_tx, to_rx, aside, height, slope = passages()
    slant = np.sqrt(1.0 + slope * slope)
    per_m = nu_per_m(to_tx * slant, to_rx * slant)
    half = 0.5 * width
    sides = power(per_m * (half - aside)) + power(per_m * (half + aside))
    return losses(sides + power(per_m * (top - height)), to_tx, to_rx)


answer = Answer()
for name, work in [("two edges", two_edges), ("three edges", three_edges)]:
    ms, found = times(5, work)
    difference = np.abs(found - read(name)).max()
    answer.case(name, ms, {"mean, dB": found.mean(), "greatest difference, dB": difference})
answer.print()
