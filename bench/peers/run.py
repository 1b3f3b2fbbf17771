"""Umbracast beside what a user would take instead, on the same inputs, one core each, in one run.

    python3 bench/peers/run.py [ROW ...]

Each row's inputs and our times come from `cargo run --release --bin peers -- ROW FOLDER` (in `bench/`); the peer's from
the program of the row in this folder, which reads the same folder and prints the same JSON: for each case its times in ms
and what it found. `install.sh` fetches the peers; a row whose peer is not there is named as skipped, with the reason.
"""

import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).parent
BENCH = HERE.parent
VENV = BENCH / "target" / "peers"

# Row, what it is, and its peers: name and command, with {python}, {built} (the folder of compiled peers) and {folder}.
OURS = str(BENCH / "target" / "release" / "peers")
CLOUDS = [
    ("PCL, thinned first", ["{built}/background_pcl", "{folder}"]),
    ("PCL, whole cloud", ["{built}/background_pcl", "{folder}", "whole"]),
    ("Open3D", ["{python}", "{here}/background_open3d.py", "{folder}"]),
]
ROWS = [
    (
        "simulate",
        [
            ("Embree", ["{built}/simulate_embree", "{folder}"]),
            ("Embree, bodies still through the frame", ["{built}/simulate_embree", "{folder}", "still"]),
        ],
    ),
    (
        "links",
        [
            ("Embree", ["{built}/links_embree", "{folder}"]),
            ("Embree, rays culled by hand", ["{built}/links_embree", "{folder}", "culled"]),
        ],
    ),
    ("background", CLOUDS),
    ("unorganised", CLOUDS),
    ("tracking", [(peer, ["{python}", f"{{here}}/tracking_{peer}.py", "{folder}"]) for peer in ["norfair", "motpy", "stonesoup"]]),
    ("forecast", [(peer, ["{python}", f"{{here}}/forecast_{peer}.py", "{folder}"]) for peer in ["torch", "onnxruntime"]]),
    (
        "algorithm1",
        [
            ("scalar listing", [OURS, "algorithm1-listing", "{folder}"]),
            ("trimesh", ["{python}", "{here}/algorithm1_trimesh.py", "{folder}"]),
        ],
    ),
    (
        "assignment",
        [(peer, ["{python}", f"{{here}}/assignment_{peer}.py", "{folder}"]) for peer in ["lapjv", "lap"]]
        + [("pathfinding", [OURS, "assignment-pathfinding", "{folder}"])],
    ),
    ("orca", [("dodgy_2d, kiddo", [OURS, "orca-dodgy", "{folder}"])]),
    (
        "reading",
        [
            ("rosbags", ["{python}", "{here}/reading_rosbags.py", "{folder}"]),
            ("rosbags + velodyne-decoder", ["{python}", "{here}/reading_velodyne.py", "{folder}"]),
        ],
    ),
    ("loss", [("NumPy + SciPy", ["{python}", "{here}/loss_scipy.py", "{folder}"])]),
]


def answer(command, folder):
    """What a side printed: its last line, as JSON. One core, one thread."""
    one = {name: "1" for name in ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS"]}
    pinned = ["taskset", "--cpu-list", "0", *command]
    done = subprocess.run(pinned, env=os.environ | one, capture_output=True, text=True)
    if done.returncode != 0:
        said = (done.stderr or done.stdout).strip().splitlines()
        return {"skipped": said[-1] if said else f"exit {done.returncode}"}
    return json.loads(done.stdout.strip().splitlines()[-1])


def main():
    build = ["cargo", "build", "--release", "--quiet", "--bin", "peers"]
    subprocess.run(build, cwd=BENCH, check=True)
    asked = sys.argv[1:]
    print(f"{'row, case':58} {'ours, ms':>10} {'peer, ms':>10} {'ratio':>8}  peer, and what both found")
    for row, peers in ROWS:
        if asked and row not in asked:
            continue
        with tempfile.TemporaryDirectory() as folder:
            ours = answer([OURS, row, folder], folder)
            if "skipped" in ours:
                sys.exit(f"{row}: ours failed: {ours['skipped']}")
            for name, command in peers:
                words = {"python": str(VENV / "bin" / "python"), "built": str(VENV), "here": str(HERE), "folder": folder}
                try:
                    theirs = answer([word.format(**words) for word in command], folder)
                except FileNotFoundError as missing:
                    theirs = {"skipped": str(missing)}
                if "skipped" in theirs:
                    print(f"{row + ', ' + name:58} skipped: {theirs['skipped']}")
                    continue
                by_case = {case["case"]: case for case in theirs["cases"]}
                for case in ours["cases"]:
                    if case["case"] not in by_case:
                        continue
                    peer = by_case[case["case"]]
                    ours_ms, peer_ms = (statistics.median(side["ms"]) for side in (case, peer))
                    found = "; ".join(f"{k} {case['found'].get(k, float('nan')):.6g} / {v:.6g}" for k, v in peer["found"].items())
                    print(f"{row + ', ' + case['case']:58} {ours_ms:10.4g} {peer_ms:10.4g} {peer_ms / ours_ms:8.2f}  {name}; {found}")


if __name__ == "__main__":
    main()
