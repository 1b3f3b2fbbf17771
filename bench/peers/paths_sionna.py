"""Every static path of the hall with at most one reflection, with Sionna RT on one thread; the scene and kernels are ready."""

import numpy as np
import sionna.rt as rt

from exchange import Answer, read, times
from sionna_scene import LIGHT_M_S, fields, place, scene_of

aps_m, devices_m, ours_s = read("access_points"), read("devices"), read("delays")
# So few rays meet each of the six surfaces many times.
RAYS = 10_000
FREQUENCY_HZ = 28e9

scene = scene_of(FREQUENCY_HZ, read("surfaces"))
place(scene, aps_m, devices_m)
solver = rt.PathSolver()


def work():
    most = 2 * ours_s.shape[2] * len(devices_m)
    paths = solver(scene, max_depth=1, samples_per_src=RAYS, max_num_paths_per_src=most, refraction=False)
    return fields(paths, len(devices_m), len(aps_m))


ms, (_, tau_s, valid) = times(3, work)
# As ours: by access point and device, in order.
in_order_s = np.sort(np.where(valid, tau_s, np.inf).astype(np.float64), axis=2).transpose(1, 0, 2)
in_order_s = np.where(np.isfinite(in_order_s), in_order_s, 0.0)
counts = [(of > 0).sum(axis=2) for of in (ours_s, in_order_s)]
same = counts[0] == counts[1]
most = min(ours_s.shape[2], in_order_s.shape[2])
apart_s = np.abs(ours_s[same][:, :most] - in_order_s[same][:, :most]).max() if same.any() else np.nan
found = {
    "paths": valid.sum(),
    "mean length, m": LIGHT_M_S * in_order_s.sum() / valid.sum(),
    "pairs with other paths": (~same).sum(),
    "greatest difference of lengths, mm": 1e3 * LIGHT_M_S * apart_s,
    "greatest difference of delays, ps": 1e12 * apart_s,
}
answer = Answer()
answer.case(f"{same.size} links, one reflection", ms, found)
answer.print()
