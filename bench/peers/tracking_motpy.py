"""motpy: boxes a metre wide, matched by their overlap, and its constant-velocity Kalman filter."""

from motpy import Detection, MultiObjectTracker

from tracking_score import run

HALF_M = 0.5


def tracker():
    follow = MultiObjectTracker(
        dt=0.1,
        model_spec={"order_pos": 1, "dim_pos": 2, "order_size": 0, "dim_size": 2, "q_var_pos": 1.0, "r_var_pos": 0.0025},
    )
    numbers = {}

    def step(detected_m):
        follow.step([Detection(box=[x - HALF_M, y - HALF_M, x + HALF_M, y + HALF_M]) for x, y in detected_m])
        tracks = follow.active_tracks(min_steps_alive=3)
        middle = lambda box: ((box[0] + box[2]) / 2, (box[1] + box[3]) / 2)
        return [(numbers.setdefault(track.id, len(numbers)), *middle(track.box)) for track in tracks]

    return step


run(tracker)
