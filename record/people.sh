#!/usr/bin/env bash
# Real people, and bodies that the predictor was not made for: one table of all modes beside the ORCA row.
# record/people.sh [SCENES] [MODES]; `umbracast` is the one on the path, UMBRACAST_DATA the folder of the real data.
set -euo pipefail
cd "$(dirname "$0")/.."
: "${UMBRACAST_DATA:?expected the folder of the real data}"
scenes="${1:-20}"
modes="${2:-hdl,paper,default}"
source record/score.sh

score plain --scenes "$scenes" --preset orca-03
for kind in bag phone pockets child wheelchair; do
    score "$kind" --scenes "$scenes" --preset orca-03 --bodies "$kind"
done
score cmu-walk --scenes "$scenes" --preset orca-03 --bodies cmu-walk \
    --gait "$UMBRACAST_DATA/cmu_walk/scaled_131_01.bvh"
walkers="$UMBRACAST_DATA/circle_antipode"
score antipode --unit cm --fps 25 --trajectories "$walkers/circle-10m-08-2.txt" "$walkers/circle-10m-16-2.txt" \
    "$walkers/circle-10m-32-2x.txt" "$walkers/circle-10m-64-2x.txt"
# Of the bottlenecks the part in which people wait and push through; the corridor's people trained the residual,
# as did other clips of the crowd in the street.
score bottleneck --seconds 20 --trajectories "$UMBRACAST_DATA/pedpy/030_c_56_h0.txt" \
    "$UMBRACAST_DATA/pedpy/040_c_56_h-.txt"
score trained-on --seconds 20 --trajectories "$UMBRACAST_DATA/pedpy/traj_UNI_CORR_500_01.txt"
score madras --trajectories "$UMBRACAST_DATA/madras/Topview_1A.csv" "$UMBRACAST_DATA/madras/Topview_1C.csv" \
    "$UMBRACAST_DATA/madras/Topview_2F.csv"
compare
