"""Fewer triangles by collapsing edges (quadric error metric of Garland and Heckbert 1997), onto one of their ends and for many
shapes of one topology at once: what is left is a subset of the vertices, so morphs and weights stay as they are.
"""

import heapq

import numpy as np


def decimated(shapes, faces, vertices_left, importance):
    """Faces that are left, over the old vertices. `shapes` are (people, vertices, 3); `importance` weighs each vertex' error."""
    people, count, _ = shapes.shape
    around = [set() for _ in range(count)]
    triangles = {i: tuple(int(v) for v in face) for i, face in enumerate(faces)}
    for i, face in triangles.items():
        for vertex in face:
            around[vertex].add(i)
    quadrics = np.zeros((people, count, 4, 4))
    for p in range(people):
        a, b, c = (shapes[p][faces[:, i]] for i in range(3))
        normal = np.cross(b - a, c - a)
        area = np.linalg.norm(normal, axis=1)
        normal /= np.maximum(area, 1e-15)[:, None]
        plane = np.concatenate([normal, -np.einsum("ij,ij->i", normal, a)[:, None]], axis=1)
        own = area[:, None, None] * plane[:, :, None] * plane[:, None, :]
        for i in range(3):
            np.add.at(quadrics[p], faces[:, i], own)
    points = np.concatenate([shapes, np.ones((people, count, 1))], axis=2)

    def cost(gone, kept):
        sum_of = quadrics[:, gone] + quadrics[:, kept]
        at = points[:, kept]
        error = np.einsum("pi,pij,pj->", at, sum_of, at)
        length = np.linalg.norm(shapes[:, gone] - shapes[:, kept], axis=1).mean()
        # A flat place still wants short edges.
        return float((error + 1e-9 * length) * max(importance[gone], importance[kept]))

    def neighbours(vertex):
        return {v for i in around[vertex] for v in triangles[i]} - {vertex}

    version = [0] * count
    heap = []

    def offer(a, b):
        for gone, kept in ((a, b), (b, a)):
            heapq.heappush(heap, (cost(gone, kept), gone, kept, version[gone], version[kept]))

    for a, b in {tuple(sorted(e)) for f in triangles.values() for e in ((f[0], f[1]), (f[1], f[2]), (f[2], f[0]))}:
        offer(a, b)
    left = sum(1 for a in around if a)
    watched = shapes[:: max(1, people // 3)]
    while left > vertices_left and heap:
        _, gone, kept, *versions = heapq.heappop(heap)
        if not around[gone] or not around[kept] or versions != [version[gone], version[kept]]:
            continue
        shared = around[gone] & around[kept]
        # Link condition: else two sheets would be glued together.
        if len(shared) != 2 or len(neighbours(gone) & neighbours(kept)) != 2:
            continue
        moved = [(i, tuple(kept if v == gone else v for v in triangles[i])) for i in around[gone] - shared]
        if any(_flips(watched, triangles[i], face) for i, face in moved):
            continue
        for i in shared:
            for v in triangles.pop(i):
                around[v].discard(i)
        for i, face in moved:
            triangles[i] = face
            around[kept].add(i)
        around[gone].clear()
        quadrics[:, kept] += quadrics[:, gone]
        left -= 1
        version[kept] += 1
        for vertex in neighbours(kept):
            offer(kept, vertex)
    return np.array(list(triangles.values()))


def _flips(shapes, before, after):
    def normal(face):
        a, b, c = (shapes[:, v] for v in face)
        return np.cross(b - a, c - a)

    old, new = normal(before), normal(after)
    agree = np.einsum("ij,ij->i", old, new)
    return bool((agree <= 0.2 * np.linalg.norm(old, axis=1) * np.linalg.norm(new, axis=1)).any())
