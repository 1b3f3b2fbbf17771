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

debian_packages() {
    local packages=(g++ pkg-config libembree-dev libpcl-dev python3-venv) as_root=()
    if dpkg -s "${packages[@]}" >/dev/null 2>&1; then
        return
    fi
    if [ "$(id -u)" -ne 0 ]; then
        as_root=(sudo)
    fi
    "${as_root[@]}" apt-get install -y --no-install-recommends "${packages[@]}" || without "packages of Debian: ${packages[*]}"
}

# Sionna RT compiles its kernels with Debian's LLVM, the newest, for version 15 cannot compile all of them.
llvm() {
    local newest as_root=()
    newest="$(apt-cache search --names-only '^libllvm[0-9]+$' | cut -d' ' -f1 | sort -V | tail -n 1)" || newest=""
    if [ -z "$newest" ]; then
        without "an LLVM library for sionna-rt"
        return
    fi
    if dpkg -s "$newest" >/dev/null 2>&1; then
        return
    fi
    if [ "$(id -u)" -ne 0 ]; then
        as_root=(sudo)
    fi
    "${as_root[@]}" apt-get install -y --no-install-recommends "$newest" || without "$newest for sionna-rt"
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
    # One by one, so that a package that cannot be had costs its own row alone.
    for package in $(grep -v '^#' "$here/requirements.txt"); do
        "$built/bin/pip" install --quiet "$package" || without "$package"
    done
}

mkdir -p "$built"
debian_packages
llvm
compiled_peers
python_peers
echo "all is there but: ${missing[*]:-nothing}"
