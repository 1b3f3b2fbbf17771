"""Bodies as thin screens of metal that diffract at their edges, one scene for each, with Sionna RT on one thread.

Scenes are built and kernels compiled beforehand, and cost nothing. Times are scaled to as many pairs as ours does.
"""

import numpy as np
import sionna.rt as rt

from exchange import Answer, read, times
from sionna_scene import LIGHT_M_S, fields, place, scene_of

aps_m, devices_m = read("screen_aps"), read("screen_devices")
wavelength_m, width_m, top_m = read("constants")
# Ten times as many find no more edges that cover a link.
RAYS = 10_000
# Of a screen without an upper and a lower edge.
FAR_M = 20.0
DIFFRACTED = dict(max_depth=1, specular_reflection=False, refraction=False, diffraction=True, edge_diffraction=True)


def screen(bottom_m, height_m):
    half_m = 0.5 * width_m
    return [[[0, -half_m, bottom_m], [0, half_m, bottom_m], [0, half_m, height_m], [0, -half_m, height_m]]]


def losses_db(paths, ap_m, at_m):
    """What comes round each edge adds as powers, as ours does; to the field of the edge that it passes, a way in sight belongs."""
    field, tau_s, valid = (of[:, 0] for of in fields(paths, len(at_m), 1))
    # Amplitudes come without the phase of the delay.
    field = field * np.exp(-2j * np.pi * LIGHT_M_S / wavelength_m * tau_s.astype(np.float64))
    is_straight = valid & (paths.interactions.numpy()[0].reshape(valid.shape) == 0)
    straight = np.where(is_straight, field, 0).sum(axis=1)
    is_edge = valid & ~is_straight
    nearest = np.where(is_edge, tau_s, np.inf).argmin(axis=1)[:, None] == np.arange(field.shape[1])
    together = straight + np.where(nearest & is_edge, field, 0).sum(axis=1)
    power = np.abs(together) ** 2 + np.where(is_edge & ~nearest, np.abs(field) ** 2, 0).sum(axis=1)
    free = wavelength_m / (4 * np.pi * np.linalg.norm(at_m - ap_m, axis=1))
    return -10 * np.log10(np.maximum(power / free**2, 1e-12))


def case(answer, name, bottom_m, height_m):
    scenes = []
    for ap_m, at_m in zip(aps_m, devices_m):
        scene = scene_of(LIGHT_M_S / wavelength_m, screen(bottom_m, height_m))
        place(scene, [ap_m], at_m)
        scenes.append(scene)
    solver = rt.PathSolver()

    def work():
        most = 8 * devices_m.shape[1]
        found = [solver(scene, samples_per_src=RAYS, max_num_paths_per_src=most, **DIFFRACTED) for scene in scenes]
        return np.array([losses_db(*of) for of in zip(found, aps_m, devices_m)])

    ms, db = times(3, work)
    pairs = read("screen_pairs")[0] / db.size
    covered = read(f"{name}, covered").astype(bool)
    found = {
        "mean, dB": db.mean(),
        "mean of links that are covered, dB": db[covered].mean(),
        "mean difference of these, dB": np.abs(db - read(name))[covered].mean(),
    }
    answer.case(name, [pairs * one for one in ms], found)


answer = Answer()
case(answer, "screens, two edges", -FAR_M, FAR_M)
case(answer, "screens, three edges", 0.0, top_m)
answer.print()
