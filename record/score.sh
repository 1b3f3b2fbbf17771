# For the scripts beside this one, which read it in: `score` evaluates $modes, `compare` puts all runs in a table.
scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
reports=()

score() { # NAME ARGUMENTS...
    local name="$1"
    shift
    mkdir "$scratch/$name"
    reports+=("$scratch/$name")
    printf '# %s: umbracast evaluate --mode %s %s\n' "$name" "$modes" "$*" | sed "s|${UMBRACAST_DATA:-/nowhere}|\$UMBRACAST_DATA|g; s|$scratch|/tmp|g"
    umbracast evaluate --mode "$modes" "$@" --json --quiet >"$scratch/$name/scores.json"
}

compare() {
    echo
    umbracast compare "${reports[@]}"
}
