#!/usr/bin/env bash
# 16 real walkers with ten draws of bodies. Then where their F1 is lost: error budget and ladder of oracles, access
# point `side`, within 300 ms; as they walk, and once more with their hands in their pockets, so that no arm swings.
# record/walkers.sh; `umbracast` is the one on the path, the walkers are found through UMBRACAST_DATA.
set -euo pipefail
scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT

walkers="$UMBRACAST_DATA/circle_antipode/circle-10m-16-2.txt"
ten=()
for _ in {1..10}; do ten+=("$walkers"); done
echo "Ten draws of bodies"
umbracast evaluate --mode default --unit cm --fps 25 --quiet --trajectories "${ten[@]}" |
    sed -n 's/^circle-10m-16-2  //; /^access point/p; /^side/p; /^centre/p; /^position RMSE/p; /^velocity/p; /^displacement/p'
echo

for bodies in plain pockets; do
    kind=()
    [ "$bodies" = plain ] || kind=(--bodies "$bodies")
    umbracast evaluate --mode default --unit cm --fps 25 "${kind[@]}" --out "$scratch/$bodies" --quiet \
        --trajectories "$walkers" >/dev/null
    printf '%-10s within 300 ms                 base rate     F1  onset F1\n' "$bodies"
    awk '/^Error budget, access point side/ { part = "budget" }
        /^Ladder of oracles/ { part = "ladder" }
        /^$/ { part = "" }
        # Numbers begin at column 49: base rate, accuracy, precision, recall, F1, onset F1.
        part == "budget" && /^300 ms  default/ {
            split(substr($0, 49), of, " "); row(substr($0, 18, 31), of[1], of[5], of[6]) }
        # After the window: base rate, F1, onset F1.
        part == "ladder" && /  side +300 ms/ {
            split(substr($0, index($0, "300 ms") + 6), of, " "); row(substr($0, 1, 37), of[1], of[2], of[3]) }
        function row(name, base_rate, f1, onset) {
            printf "%-42s %9s  %s %9s\n", name, base_rate, f1, onset }' "$scratch/$bodies/report.txt"
    echo
done
