"""Background and clusters with Open3D: the cloud is thinned to voxels of 0.1 m, points near one of the empty hall are left out,
and the rest is clustered with heights divided by a hundred. The argument is the folder."""

import json
import pathlib
import sys
import time

import numpy as np
import open3d as o3d

FOLDER = pathlib.Path(sys.argv[1])
TRIES = 7
THIN_M = 0.1
# As far as the middle of a voxel of 0.2 m is from its corners.
HALL_M = 0.17


def read(name):
    return np.load(FOLDER / f"{name}.npy")


def cloud_of(points):
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points.astype(np.float64)))


def together(clouds, poses):
    whole = o3d.geometry.PointCloud()
    for cloud, pose in zip(clouds, poses):
        # Transforming is in place, and the next try begins from the same points.
        whole += o3d.geometry.PointCloud(cloud).transform(pose)
    return whole


def foreground(clouds, poses, hall):
    thinned = together(clouds, poses).voxel_down_sample(THIN_M)
    away_m = np.asarray(thinned.compute_point_cloud_distance(hall))
    return np.asarray(thinned.points)[away_m > HALL_M]


def clusters(points):
    """The points of each cluster of sixteen or more."""
    if len(points) == 0:
        return []
    labels = np.asarray(cloud_of(points * [1, 1, 0.01]).cluster_dbscan(eps=0.2, min_points=1))
    groups = [points[labels == label] for label in range(labels.max() + 1)]
    return [group for group in groups if len(group) >= 16]


def times(work):
    taken_ms = []
    for _ in range(TRIES + 1):
        begun = time.perf_counter()
        result = work()
        taken_ms.append(1e3 * (time.perf_counter() - begun))
    return taken_ms[1:], result


def main():
    poses = [read(f"site_from_sensor_{sensor}").astype(np.float64) for sensor in range(2)]
    hall = together([cloud_of(read(f"empty_{sensor}")) for sensor in range(2)], poses).voxel_down_sample(THIN_M)
    cases = []
    for people in (10, 100):
        clouds = [cloud_of(read(f"cloud_{people}_{sensor}")) for sensor in range(2)]
        truth_m = read(f"truth_{people}")
        background_ms, points = times(lambda: foreground(clouds, poses, hall))
        clusters_ms, groups = times(lambda: clusters(foreground(clouds, poses, hall)))
        middles_m = np.array([group[:, :2].mean(axis=0) for group in groups]).reshape(-1, 2)
        away_m = np.linalg.norm(truth_m[:, None] - middles_m[None], axis=2)
        near = int((away_m < 0.5).any(axis=1).sum())
        cases.append({"case": f"{people} people, background", "ms": background_ms, "found": {"points": len(points)}})
        found = {"people": near, "groups": len(groups)}
        cases.append({"case": f"{people} people, clusters", "ms": clusters_ms, "found": found})
    print(json.dumps({"cases": cases}))


main()
