#!/usr/bin/env bash
# Why the paper's figures are what they are: `record/explain.txt` and `record/explain.svg`. Tuning scenes, without data.
set -euo pipefail
cd "$(dirname "$0")/.."
scenes=2
command="cargo run --release -p umbracast-eval --example explain -- $scenes record/explain.svg"
text="$($command)"
printf '$ %s\n%s\n' "$command" "$text" >record/explain.txt
echo record/explain.txt
