"""norfair: Euclidean distances and the faster of its constant-velocity Kalman filters, which is its default."""

from norfair import Detection, Tracker

from tracking_score import run


def tracker():
    follow = Tracker(distance_function="euclidean", distance_threshold=1.0, hit_counter_max=10, initialization_delay=2)

    def step(detected_m):
        tracks = follow.update([Detection(points=at_m[None]) for at_m in detected_m])
        return [(track.id, *track.estimate[0]) for track in tracks]

    return step


run(tracker)
