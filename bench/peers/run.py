"""Umbracast beside what a user would take instead, on the same inputs, one core each, in one run.

    python3 bench/peers/run.py [ROW ...]

Each row's inputs and our times come from `target/release/peers ROW FOLDER` (in `bench/`), which this script builds; the peer's from
the program of the row in this folder, which reads the same folder and prints the same JSON: for each case its times in ms
and what it found. `install.sh` fetches the peers; a row whose peer is not there is named as skipped, with the reason.
"""

import json
import math
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).parent
BENCH = HERE.parent
VENV = BENCH / "target" / "peers"

OURS = str(BENCH / "target" / "release" / "peers")
CLOUDS = [
    ("PCL, thinned first", ["{built}/background_pcl", "{folder}"]),
    ("PCL, whole cloud", ["{built}/background_pcl", "{folder}", "whole"]),
    ("Open3D", ["{python}", "{here}/background_open3d.py", "{folder}"]),
]
# Row and its peers: name and command, with {python}, {here} (this folder), {built} (compiled peers) and {folder}.
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
    (
        "forecast",
        [(peer, ["{python}", f"{{here}}/forecast_{peer}.py", "{folder}"]) for peer in ["torch", "onnxruntime"]]
        + [("its multiply-adds alone", [OURS, "forecast-multiply-adds", "{folder}"])],
    ),
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
    (
        "loss",
        [
            ("NumPy + SciPy", ["{python}", "{here}/loss_scipy.py", "{folder}"]),
            ("Sionna RT", ["{python}", "{here}/loss_sionna.py", "{folder}"]),
        ],
    ),
    ("paths", [("Sionna RT", ["{python}", "{here}/paths_sionna.py", "{folder}"])]),
]

# The ratios that were aimed at when these rows were chosen: by row, else by row and peer, or by row and case for its
# first peer.
WANTED = {
    "simulate": 2,
    "links": 10,
    "background": 30,
    "unorganised": 8,
    "tracking": 20,
    ("forecast", "torch"): 4,
    ("forecast", "onnxruntime"): 1.5,
    ("algorithm1", "10 people"): 3,
    ("algorithm1", "100 people"): 15,
    ("algorithm1", "1000 people"): 30,
    "assignment": 3,
    ("orca", "10 people"): 1,
    ("orca", "1000 people"): 1.5,
    ("orca", "10000 people"): 2,
    "reading": 20,
    "loss": 100,
    "paths": 10,
}


def machine():
    """The processor, and the versions of what is compared."""
    with open("/proc/cpuinfo") as about:
        model = next((line.split(":")[1].strip() for line in about if line.startswith("model name")), "unknown")
    debian = ["dpkg-query", "--show", "--showformat", "${Package} ${Version}, ", "libembree-dev", "libpcl-dev", "libllvm19"]
    packages = subprocess.run(debian, capture_output=True, text=True).stdout
    lines = (HERE / "requirements.txt").read_text().splitlines()
    return f"{model}; {packages}{', '.join(line for line in lines if not line.startswith('#'))}"


def told(name, ours, theirs):
    """What both found, or what only the peer can tell of."""
    return f"{name} {theirs:.6g}" if ours is None else f"{name} {ours:.6g} / {theirs:.6g}"


def answer(command):
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
    print(f"machine: {machine()}\n")
    print(f"{'row, case':34} {'peer':40} {'ours, ms':>10} {'peer, ms':>10} {'ratio':>7} {'aimed at':>8}")
    found = []
    for row, peers in ROWS:
        if asked and row not in asked:
            continue
        with tempfile.TemporaryDirectory() as folder:
            ours = answer([OURS, row, folder])
            if "skipped" in ours:
                sys.exit(f"{row}: ours failed: {ours['skipped']}")
            for place, (name, command) in enumerate(peers):
                words = {"python": str(VENV / "bin" / "python"), "built": str(VENV), "here": str(HERE), "folder": folder}
                command = [word.format(**words) for word in command]
                there = pathlib.Path(command[0]).exists()
                theirs = answer(command) if there else {"skipped": "it is not there"}
                if "skipped" in theirs:
                    print(f"{row:34} {name:40} skipped: {theirs['skipped']}")
                    continue
                by_case = {case["case"]: case for case in theirs["cases"]}
                for case in ours["cases"]:
                    if case["case"] not in by_case:
                        continue
                    peer = by_case[case["case"]]
                    ours_ms, peer_ms = (statistics.median(side["ms"]) for side in (case, peer))
                    keys = [row, (row, name), *([(row, case["case"])] if place == 0 else [])]
                    aims = [WANTED[key] for key in keys if key in WANTED]
                    aim = f"{aims[0]:8g}" if aims else ""
                    here = f"{row}, {case['case']}"
                    print(f"{here:34} {name:40} {ours_ms:10.4g} {peer_ms:10.4g} {peer_ms / ours_ms:7.2f} {aim}", flush=True)
                    both = [told(k, case["found"].get(k), v) for k, v in peer["found"].items() if not math.isnan(v)]
                    if both:
                        found.append(f"{here}, {name}: {'; '.join(both)}")
    print("\nWhat both found, ours / the peer's:")
    print("\n".join(found))


if __name__ == "__main__":
    main()
