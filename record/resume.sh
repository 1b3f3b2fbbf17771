#!/usr/bin/env bash
# The paper's experiment in small, killed in its midst and started again, against one that ran through.
# record/resume.sh; `umbracast` is the one on the path.
set -euo pipefail
scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT

reproduce() { # DIR
    echo "\$ umbracast reproduce --scenes 8 --out /tmp/$1"
    umbracast reproduce --scenes 8 --quiet --out "$scratch/$1" >/dev/null
}

reproduce through
echo '$ umbracast reproduce --scenes 8 --out /tmp/killed, killed after its third scene'
umbracast reproduce --scenes 8 --quiet --out "$scratch/killed" >/dev/null &
until [ "$(find "$scratch/killed/scenes" -name '*.sums' 2>/dev/null | wc -l)" -ge 3 ]; do sleep 0.1; done
kill -KILL $!
wait $! 2>/dev/null || true
find "$scratch/killed" -type f -printf '%P\n' | sort
reproduce killed
echo '$ diff -r --exclude run.json /tmp/through /tmp/killed && echo the same'
diff -r --exclude run.json "$scratch/through" "$scratch/killed" && echo "the same"
