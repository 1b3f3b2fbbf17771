#!/bin/bash
# Fetches and builds what run.py compares with: packages of Debian, the programs beside this file, and a Python environment.
# What it cannot have it names and goes on without; the rows that need it are skipped by run.py.
set -euo pipefail

here="$(cd "$(dirname "$0")" && pwd)"
built="$here/../target/peers"
missing=()

without() {
    echo "without $1" >&2
    missing+=("$1")
}

as_root() {
    if [ "$(id -u)" -eq 0 ]; then
        "$@"
    else
        sudo "$@"
    fi
}

debian() {
    if dpkg -s "$@" >/dev/null 2>&1; then
        return
    fi
    # A new machine knows no packages, or old ones.
    as_root apt-get update -q || true
    as_root apt-get install -y --no-install-recommends "$@" || without "packages of Debian: $*"
}

# Sionna RT compiles its kernels with Debian's LLVM, the newest, for version 15 cannot compile all of them.
llvm() {
    local newest
    newest="$(apt-cache search --names-only '^libllvm[0-9]+$' | cut -d' ' -f1 | sort -V | tail -n 1)" || newest=""
    if [ -n "$newest" ]; then
        debian "$newest"
    else
        without "an LLVM library for sionna-rt"
    fi
}

# NAME.cpp with these flags becomes a program; templates are built here, for this machine, and not taken from a library that
# was built for every machine.
compile() {
    local name="$1"
    shift
    g++ -std=c++17 -O3 -march=native -DNDEBUG "$here/$name.cpp" -o "$built/$name" "$@" || without "$name"
}

compiled_peers() {
    local pcl
    compile simulate_embree -lembree3
    compile links_embree -lembree3
    if pcl="$(pkg-config --cflags --libs pcl_filters pcl_segmentation pcl_search pcl_common)"; then
        # shellcheck disable=SC2086 # Flags are words.
        compile background_pcl -DPCL_NO_PRECOMPILE $pcl
    else
        without background_pcl
    fi
}

python_peers() {
    if ! { [ -x "$built/bin/python" ] || python3 -m venv "$built"; }; then
        without "an environment for Python"
        return
    fi
    # One by one, so that a package that cannot be had costs its own row alone; none brings another version of one before it.
    for package in $(grep -v '^#' "$here/requirements.txt"); do
        "$built/bin/pip" install --quiet --constraint "$here/requirements.txt" "$package" || without "$package"
    done
}

mkdir -p "$built"
debian g++ pkg-config libembree-dev libpcl-dev python3-venv
llvm
compiled_peers
python_peers
echo "all is there but: ${missing[*]:-nothing}"
