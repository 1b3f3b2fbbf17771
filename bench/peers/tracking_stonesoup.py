"""Stone Soup: a constant-velocity Kalman filter, assignment of least cost in two dimensions, and its initiator of many
measurements, both with its KD-tree, which is its faster way. The first frames only, for it takes long."""

import datetime

import numpy as np
from stonesoup.dataassociator.tree import DetectionKDTreeGNN2D
from stonesoup.deleter.time import UpdateTimeStepsDeleter
from stonesoup.hypothesiser.distance import DistanceHypothesiser
from stonesoup.initiator.simple import MultiMeasurementInitiator
from stonesoup.measures import Mahalanobis
from stonesoup.models.measurement.linear import LinearGaussian
from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
from stonesoup.predictor.kalman import KalmanPredictor
from stonesoup.types.detection import Detection
from stonesoup.types.state import GaussianState
from stonesoup.updater.kalman import KalmanUpdater

from tracking_score import run

START = datetime.datetime(2026, 1, 1)
FRAMES_MAX = 8


def tracker():
    motion = CombinedLinearGaussianTransitionModel([ConstantVelocity(0.5), ConstantVelocity(0.5)])
    measured = LinearGaussian(4, (0, 2), np.diag([0.0025, 0.0025]))
    predictor, updater, deleter = KalmanPredictor(motion), KalmanUpdater(measured), UpdateTimeStepsDeleter(5)
    hypothesiser = DistanceHypothesiser(predictor, updater, Mahalanobis(), missed_distance=4)
    tree = lambda: DetectionKDTreeGNN2D(hypothesiser, predictor, updater, number_of_neighbours=3)
    associator = tree()
    born = GaussianState(np.zeros((4, 1)), np.diag([0.0025, 1.5, 0.0025, 1.5]))
    initiator = MultiMeasurementInitiator(
        born, deleter, tree(), updater, measurement_model=measured, min_points=2
    )
    numbers, kept = {}, {"tracks": set(), "frame": 0}

    def step(detected_m):
        now = START + datetime.timedelta(seconds=0.1 * kept["frame"])
        kept["frame"] += 1
        detections = {Detection(at_m[:, None], timestamp=now, measurement_model=measured) for at_m in detected_m}
        tracks, given = kept["tracks"], set()
        for track, hypothesis in associator.associate(tracks, detections, now).items():
            if hypothesis:
                track.append(updater.update(hypothesis))
                given.add(hypothesis.measurement)
            else:
                track.append(hypothesis.prediction)
        tracks -= deleter.delete_tracks(tracks)
        tracks |= initiator.initiate(detections - given, now)
        at = lambda track: (float(track.state_vector[0]), float(track.state_vector[2]))
        return [(numbers.setdefault(track.id, len(numbers)), *at(track)) for track in tracks]

    return step


run(tracker, FRAMES_MAX)
