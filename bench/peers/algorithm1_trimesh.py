"""trimesh with Embree: the boxes of a step as one mesh, and one ray from the access point to the centre of each box. The first
box that the ray meets is another's where somebody is hidden. Boxes that overlap are the one thing that this tells
otherwise than Algorithm 1."""

import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from exchange import Answer, read, times

ap_m, half_m = read("ap"), read("half")
BOX = trimesh.creation.box(extents=2 * half_m)
FACES = len(BOX.faces)


def cast(steps_m):
    blocked = np.zeros(steps_m.shape[1], dtype=bool)
    for places_m in steps_m:
        people = len(places_m)
        middles_m = np.column_stack([places_m, np.full(people, half_m[2])])
        corners_m = (middles_m[:, None] + BOX.vertices[None]).reshape(-1, 3)
        faces = (BOX.faces[None] + len(BOX.vertices) * np.arange(people)[:, None, None]).reshape(-1, 3)
        mesh = trimesh.Trimesh(corners_m, faces, process=False, validate=False)
        asked = np.flatnonzero(~blocked)
        rays = middles_m[asked] - ap_m
        met = RayMeshIntersector(mesh).intersects_first(np.broadcast_to(ap_m, rays.shape), rays)
        blocked[asked] = (met >= 0) & (met // FACES != asked)
    return blocked


answer = Answer()
for people in [10, 100, 1000]:
    steps_m = read(f"steps_{people}")
    ms, blocked = times(20, lambda: cast(steps_m))
    answer.case(f"{people} people", ms, {"blocked": blocked.sum()})
answer.print()
