#!/usr/bin/env bash
# Where sensors hang, how many sensors there are, how many people walk and how: one table of all modes.
# record/sites.sh [SCENES] [MODES]; `umbracast` is the one on the path.
set -euo pipefail
cd "$(dirname "$0")/.."
scenes="${1:-20}"
modes="${2:-hdl,paper,default}"
scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
reports=()

score() { # NAME ARGUMENTS...
    local name="$1"
    shift
    mkdir "$scratch/$name"
    reports+=("$scratch/$name")
    printf '# %s: umbracast evaluate --scenes %s --mode %s %s\n' "$name" "$scenes" "$modes" "$*"
    umbracast evaluate --scenes "$scenes" --mode "$modes" "$@" --json --quiet >"$scratch/$name/scores.json"
}

score default --preset orca-03
for site in height-3 height-5 height-6 height-8 lost-sensor; do
    score "$site" --preset orca-03 --site "config/sites/$site.toml"
done
score people-20 --preset orca-03 --people 20
score people-40 --preset orca-03 --people 40
score pairs --preset pairs
echo
umbracast compare "${reports[@]}"
