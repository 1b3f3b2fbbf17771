#!/usr/bin/env bash
# Makes every figure that the documents quote: each file here begins with the command it comes from.
# Real data are found through UMBRACAST_DATA; without it their files are left as they are.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo build --release
scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
export PATH="$(realpath "${CARGO_TARGET_DIR:-target}")/release:$PATH"

record() { # FILE COMMAND...
    local file="record/$1.txt"
    shift
    printf '$ %s\n' "$*" | sed "s|${UMBRACAST_DATA:-/nowhere}|\$UMBRACAST_DATA|g; s|$scratch|/tmp|g" >"$file"
    "$@" --quiet 2>&1 | sed "s|${UMBRACAST_DATA:-/nowhere}|\$UMBRACAST_DATA|g; s|$scratch|/tmp|g" >>"$file" || true
    echo "$file"
}
more() { # the same, added to the file
    local file="record/$1.txt"
    shift
    printf '\n$ %s\n' "$*" | sed "s|${UMBRACAST_DATA:-/nowhere}|\$UMBRACAST_DATA|g; s|$scratch|/tmp|g" >>"$file"
    "$@" --quiet 2>&1 | sed "s|${UMBRACAST_DATA:-/nowhere}|\$UMBRACAST_DATA|g; s|$scratch|/tmp|g" >>"$file" || true
}

# The headline: what the default mode scores on 100 test scenes.
record orca-03-100-scenes umbracast evaluate --scenes 100 --preset orca-03 --mode default --out "$scratch/headline"

# 40 test scenes, every mode, baselines, error budget, ladder.
record orca-40-scenes umbracast evaluate --scenes 20 --preset orca-03,orca-06 --out "$scratch/orca"
# The page holds baselines, error budget and ladder too.
sed "s|$scratch|/tmp|g" "$scratch/orca/report.html" >record/orca-40-scenes.html

# What the sensors see of a standing person, and the floor plan.
record coverage umbracast coverage --out "$scratch/coverage"
cp "$scratch/coverage/coverage.svg" record/coverage.svg

# Other heights, a lost sensor, more people, pairs.
record sites record/sites.sh 20 default

# Why the paper's figures are what they are.
record/explain.sh

# The job files: on a Slurm of this one machine, and as a cluster would read the Kubernetes ones.
if command -v slurmctld >/dev/null && [ "$(id -u)" = 0 ]; then
    { echo '$ deploy/slurm/try.sh' && deploy/slurm/try.sh; } >record/slurm.txt || true
fi
if python3 -c 'import yaml' 2>/dev/null; then
    { echo '$ deploy/kubernetes/try.py umbracast' && deploy/kubernetes/try.py "$(command -v umbracast)"; } \
        >record/kubernetes.txt || true
fi

# How fast: one scene of 10 people with two HDL-32E on one core, and a frame through every mode.
record speed umbracast simulate --scenes 1 --threads 1 --out "$scratch/sim"
for mode in default paper hdl; do
    more speed umbracast run "$scratch/sim" --mode "$mode" --threads 1 --out "$scratch/$mode"
done

# The same seed twice, on one thread and on two.
record same-bytes umbracast simulate --scenes 2 --threads 1 --out "$scratch/one"
more same-bytes umbracast simulate --scenes 2 --threads 2 --out "$scratch/two"
for mode in default paper hdl; do
    more same-bytes umbracast run "$scratch/one" --mode "$mode" --threads 1 --out "$scratch/one/$mode"
    more same-bytes umbracast run "$scratch/two" --mode "$mode" --threads 2 --out "$scratch/two/$mode"
done
{
    printf '\n$ diff -rq --exclude run.json /tmp/one /tmp/two && echo the same\n'
    diff -rq --exclude run.json "$scratch/one" "$scratch/two" && echo "the same"
} >>record/same-bytes.txt || true

if [ -n "${UMBRACAST_DATA:-}" ]; then
    walkers="$UMBRACAST_DATA/circle_antipode"
    record circle-antipode umbracast evaluate --unit cm --fps 25 --out "$scratch/walkers" \
        --trajectories "$walkers/circle-10m-08-2.txt" "$walkers/circle-10m-16-2.txt"
    record walkers record/walkers.sh
    record people record/people.sh 6 default
    record forecasts record/forecasts.sh 20
    frames="$UMBRACAST_DATA/logictronix_vlp16"
    site=config/sites/logictronix.toml
    : >record/logictronix.txt
    for run in "70 95" "117 140"; do
        read -r first last <<<"$run"
        mkdir -p "$scratch/clouds-$first"
        for n in $(seq "$first" "$last"); do ln -s "$frames/pcd/$n.pcd" "$scratch/clouds-$first/"; done
        for mode in default paper hdl; do
            more logictronix umbracast run "$scratch/clouds-$first" --site "$site" --mode "$mode" --out "$scratch/lt-$first-$mode"
            more logictronix umbracast evaluate "$scratch/lt-$first-$mode" --labels "$frames/labels.csv"
        done
    done
fi

# Killed and started again.
record resume record/resume.sh

# The paper's experiment in 40 scenes, with the LSTM that ships.
record reproduce-quick umbracast reproduce --quick --out "$scratch/quick"

# The paper's experiment whole, training first: an hour on two cores. REPRODUCE names a folder in which an earlier try is gone on with.
reproduced="${REPRODUCE:-$scratch/reproduce}"
weights="$reproduced/training"
record reproduce cargo run -q --release --manifest-path train/Cargo.toml -- --commit "$(git describe --always --dirty)" --out "$weights"
more reproduce umbracast reproduce --weights "$weights/paper_lstm.safetensors" --out "$reproduced"
sed -i "s|$reproduced|/tmp/reproduce|g" record/reproduce.txt
cp "$reproduced/report.html" record/reproduce.html
cp "$reproduced/boxes.svg" record/reproduce-boxes.svg
