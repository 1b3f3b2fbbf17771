#!/usr/bin/env bash
# Where sensors hang, how many sensors there are, how many people walk and how: one table of all modes.
# record/sites.sh [SCENES] [MODES]; `umbracast` is the one on the path.
set -euo pipefail
cd "$(dirname "$0")/.."
scenes="${1:-20}"
modes="${2:-hdl,paper,default}"
source record/score.sh

score default --scenes "$scenes" --preset orca-03
for site in height-3 height-5 height-6 height-8 lost-sensor out-of-step; do
    score "$site" --scenes "$scenes" --preset orca-03 --site "config/sites/$site.toml"
done
score people-20 --scenes "$scenes" --preset orca-03 --people 20
score people-40 --scenes "$scenes" --preset orca-03 --people 40
score pairs --scenes "$scenes" --preset pairs
compare
