#!/usr/bin/env bash
# Real people and unusual bodies: record/people.txt. Called by record/record.sh, or by itself:
#   UMBRACAST_DATA=... record/people.sh
# SCENES=5 has fewer scenes of each kind of body than the 20 that are the rule.
set -euo pipefail
cd "$(dirname "$0")/.."
: "${UMBRACAST_DATA:?folder of the real data}"
cargo build --release -p umbracast-cli
cargo build --release -p umbracast-eval --example sets_table
bin="$(realpath "${CARGO_TARGET_DIR:-target}")/release"
out="$(mktemp -d)"
trap 'rm -rf "$out"' EXIT
scenes="${SCENES:-20}"
file=record/people.txt
: >"$file"

scored() { # NAME ARGUMENTS... of evaluate
    local name="$1"
    shift
    printf '$ umbracast evaluate %s\n' "$*" | sed "s|$UMBRACAST_DATA|\$UMBRACAST_DATA|g" >>"$file"
    "$bin/umbracast" evaluate "$@" --quiet --json >"$out/$name.json"
    printf '%s\n' "$out/$name.json" >>"$out/order"
}

scored 00-orca --scenes "$scenes" --preset orca-03
for kind in bag phone pockets child wheelchair; do
    scored "10-$kind" --scenes "$scenes" --preset orca-03 --bodies "$kind"
done
for clip in 01 02; do
    scored "11-cmu-$clip" --scenes "$scenes" --preset orca-03 --bodies cmu-walk \
        --gait "$UMBRACAST_DATA/cmu_walk/scaled_131_$clip.bvh"
done
walkers="$UMBRACAST_DATA/circle_antipode"
scored 20-antipode --unit cm --fps 25 --trajectories "$walkers/circle-10m-08-2.txt" \
    "$walkers/circle-10m-16-2.txt" "$walkers/circle-10m-32-2x.txt" "$walkers/circle-10m-64-2x.txt"
scored 30-pedpy --seconds 20 --trajectories "$UMBRACAST_DATA/pedpy/traj_UNI_CORR_500_01.txt" \
    "$UMBRACAST_DATA/pedpy/030_c_56_h0.txt"
scored 40-madras --trajectories "$UMBRACAST_DATA/madras/Topview_1A.csv" \
    "$UMBRACAST_DATA/madras/Topview_1C.csv" "$UMBRACAST_DATA/madras/Topview_2F.csv"

printf '\n$ sets_table scores of all of these\n' >>"$file"
xargs "$bin/examples/sets_table" <"$out/order" >>"$file"
echo "$file"
