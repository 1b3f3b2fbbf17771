#!/usr/bin/env python3
"""Single reflections in three halls without people, by the ray tracer Sionna RT 2.2.

Prints the table that a test of the runtime compares with its own (tests/data/sionna_reflections.csv): hall, both places, the
delay of each way, and by how much less is received by it than on the straight way, as the mean power of both polarisations.

    pip install sionna-rt==2.2.0     # and LLVM 19: DRJIT_LIBLLVM_PATH=.../libLLVM.so.19
    python3 examples/sionna/reflections.py > tests/data/sionna_reflections.csv
"""

import tempfile
from pathlib import Path

import numpy as np
import sionna.rt as rt

CARRIER_HZ = 28e9
# A slab so thick swallows what enters it, as the half space of the runtime does.
THICK_M = 10.0

# Outline, height, and what walls, ceiling and floor are of; then access points and devices.
HALLS = {
    "hall": (
        [(-10, -6), (10, -6), (10, 6), (-10, 6)], 4.0, ("concrete", "ceiling-board", "wood"),
        [(-9.0, 0.5, 3.0), (3.0, -5.5, 2.5)], [(2.0, 1.0, 1.0), (-4.0, 4.0, 1.4), (8.5, -3.0, 0.9)],
    ),
    "corridor": (
        [(0, 0), (30, 0), (30, 3), (0, 3)], 2.8, ("plasterboard", "plywood", "marble"),
        [(0.5, 1.5, 2.5)], [(6.0, 0.7, 1.0), (15.0, 2.0, 1.2), (28.0, 1.5, 1.0)],
    ),
    "L": (
        [(0, 0), (14, 0), (14, 5), (5, 5), (5, 12), (0, 12)], 3.5, ("brick", "concrete", "chipboard"),
        [(4.5, 0.5, 3.0), (13.0, 4.0, 2.8)], [(2.0, 8.0, 1.0), (9.0, 2.0, 1.2), (3.0, 3.0, 1.5)],
    ),
}


def surfaces(outline, height_m):
    """Each surface as corners: floor, ceiling, walls."""
    yield "floor", [(x, y, 0.0) for x, y in outline]
    yield "ceiling", [(x, y, height_m) for x, y in outline]
    for i, (x, y) in enumerate(outline):
        u, v = outline[(i + 1) % len(outline)]
        yield f"wall-{i}", [(x, y, 0.0), (u, v, 0.0), (u, v, height_m), (x, y, height_m)]


def triangles(corners, outline_is_l):
    """A fan; of a level L from its inner corner, from which all of it is seen."""
    first = 3 if outline_is_l and len(corners) == 6 else 0
    at = [(first + i) % len(corners) for i in range(len(corners))]
    return [(at[0], at[i], at[i + 1]) for i in range(1, len(at) - 1)]


def scene_of(folder, name):
    outline, height_m, (walls, ceiling, floor), _, _ = HALLS[name]
    materials = {"floor": floor, "ceiling": ceiling}
    xml = ['<scene version="2.1.0">']
    for kind in {walls, ceiling, floor}:
        xml.append(
            f'<bsdf type="itu-radio-material" id="{kind}"><string name="type" value="{kind.replace("-", "_")}"/>'
            f'<float name="thickness" value="{THICK_M}"/></bsdf>'
        )
    for surface, corners in surfaces(outline, height_m):
        faces = triangles(corners, name == "L")
        ply = folder / f"{name}-{surface}.ply"
        ply.write_text(
            f"ply\nformat ascii 1.0\nelement vertex {len(corners)}\nproperty float x\nproperty float y\nproperty float z\n"
            f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
            + "".join(f"{x} {y} {z}\n" for x, y, z in corners)
            + "".join(f"3 {a} {b} {c}\n" for a, b, c in faces)
        )
        material = materials.get(surface, walls)
        xml.append(
            f'<shape type="ply" id="{surface}"><string name="filename" value="{ply}"/>'
            f'<boolean name="face_normals" value="true"/><ref id="{material}" name="bsdf"/></shape>'
        )
    xml.append("</scene>")
    path = folder / f"{name}.xml"
    path.write_text("\n".join(xml))
    return rt.load_scene(str(path), merge_shapes=False)


def main():
    print("hall,ap_x_m,ap_y_m,ap_z_m,ue_x_m,ue_y_m,ue_z_m,delay_ns,excess_db")
    with tempfile.TemporaryDirectory() as folder:
        for name in HALLS:
            scene = scene_of(Path(folder), name)
            scene.frequency = CARRIER_HZ
            both = rt.PlanarArray(
                num_rows=1, num_cols=1, vertical_spacing=0.5, horizontal_spacing=0.5, pattern="iso", polarization="VH"
            )
            scene.tx_array = scene.rx_array = both
            for ap in HALLS[name][3]:
                for ue in HALLS[name][4]:
                    scene.add(rt.Transmitter("ap", position=list(ap)))
                    scene.add(rt.Receiver("ue", position=list(ue)))
                    paths = rt.PathSolver()(
                        scene, max_depth=1, los=True, specular_reflection=True, diffuse_reflection=False, refraction=False,
                        samples_per_src=1_000_000,
                    )
                    re, im = (np.array(part) for part in paths.a)
                    power = re**2 + im**2  # receiver, its antennas, transmitter, its antennas, paths
                    gains = power[0, :, 0, :, :].sum(axis=0).mean(axis=0)
                    delays_ns = np.array(paths.tau).reshape(-1) * 1e9
                    straight_ns = np.linalg.norm(np.subtract(ap, ue)) / 0.299792458
                    straight = np.argmin(abs(delays_ns - straight_ns))
                    seen = abs(delays_ns[straight] - straight_ns) < 0.01
                    # Where the straight way is hidden, Friis' equation says what it would have carried.
                    free = (0.299792458 * straight_ns * 4 * np.pi * CARRIER_HZ / 299792458.0) ** -2
                    for k in np.argsort(delays_ns):
                        if gains[k] > 0 and not (seen and k == straight):
                            excess_db = -10 * np.log10(gains[k] / free)
                            print(name, *ap, *ue, f"{delays_ns[k]:.4f}", f"{excess_db:.3f}", sep=",")
                    scene.remove("ap")
                    scene.remove("ue")


if __name__ == "__main__":
    main()
