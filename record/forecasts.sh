#!/usr/bin/env bash
# What the residual network adds to the filtered state carried on: ORCA's people, mixed crowds and real walkers.
# record/forecasts.sh [SCENES]; `umbracast` is the one on the path, UMBRACAST_DATA the folder of the real data.
set -euo pipefail
cd "$(dirname "$0")/.."
: "${UMBRACAST_DATA:?expected the folder of the real data}"
scenes="${1:-20}"
modes=default
source record/score.sh

printf '[forecast]\nmethod = "constant-velocity"\n' >"$scratch/constant-velocity.toml"
walkers="$UMBRACAST_DATA/circle_antipode"
for forecast in residual constant-velocity; do
    laid_over=()
    [ $forecast = residual ] || laid_over=(--site "$scratch/constant-velocity.toml")
    for preset in orca-03 mixed; do
        score "$preset-$forecast" --scenes "$scenes" --preset "$preset" "${laid_over[@]}"
    done
    score "walkers-$forecast" --unit cm --fps 25 --trajectories "$walkers/circle-10m-08-2.txt" \
        "$walkers/circle-10m-16-2.txt" "$walkers/circle-10m-32-2x.txt" "$walkers/circle-10m-64-2x.txt" "${laid_over[@]}"
done
compare
