"""Writes people of one topology as a binary glTF 2.0 file: the first is the base, each other one a morph target. Nothing but the core
of the format is used, so that any program shows them. Who they are, and where their joints are, stands in the mesh's `extras`.
"""

import json
import struct

import numpy as np

FLOAT, USHORT, UBYTE = 5126, 5123, 5121


def write(path, bones, people, primitives):
    """`primitives` are (name, points of (people, vertices, 3), faces, weights over `bones`)."""
    blob, views, accessors = bytearray(), [], []

    def put(array, kind, component, target=None, bounds=False, normalized=False):
        while len(blob) % 4:
            blob.append(0)
        data = np.ascontiguousarray(array).tobytes()
        view = dict(buffer=0, byteOffset=len(blob), byteLength=len(data))
        if target:
            view["target"] = target
        views.append(view)
        blob.extend(data)
        accessor = dict(bufferView=len(views) - 1, componentType=component, count=len(array), type=kind)
        if bounds:
            accessor.update(min=array.min(axis=0).tolist(), max=array.max(axis=0).tolist())
        if normalized:
            accessor["normalized"] = True
        accessors.append(accessor)
        return len(accessors) - 1

    parts = []
    for name, points, faces, weights in primitives:
        points = points.astype(np.float32)
        # Four bones at most, in shares of 255 that sum up.
        order = np.argsort(-weights, axis=1)[:, :4]
        share = np.take_along_axis(weights, order, axis=1)
        whole = np.floor(255.0 * share / share.sum(axis=1, keepdims=True)).astype(int)
        whole[:, 0] += 255 - whole.sum(axis=1)
        order[whole == 0] = 0
        parts.append(dict(
            attributes=dict(
                POSITION=put(points[0], "VEC3", FLOAT, 34962, bounds=True),
                JOINTS_0=put(order.astype(np.uint8), "VEC4", UBYTE, 34962),
                WEIGHTS_0=put(whole.astype(np.uint8), "VEC4", UBYTE, 34962, normalized=True),
            ),
            indices=put(faces.astype(np.uint16).reshape(-1), "SCALAR", USHORT, 34963),
            targets=[dict(POSITION=put(other - points[0], "VEC3", FLOAT, 34962, bounds=True)) for other in points[1:]],
            extras=dict(name=name),
        ))
    at = {bone: np.array(people[0]["joints_m"][bone]) for bone in bones}
    parents = {"Thorax": "Pelvis", "Head": "Thorax"}
    for side in ("Left", "Right"):
        parents.update({"UpperArm" + side: "Thorax", "Forearm" + side: "UpperArm" + side, "Thigh" + side: "Pelvis"})
        parents.update({"Shank" + side: "Thigh" + side, "Foot" + side: "Shank" + side, "Toes" + side: "Foot" + side})
    nodes = []
    for bone in bones:
        children = [i for i, other in enumerate(bones) if parents.get(other) == bone]
        node = dict(name=bone, translation=(at[bone] - (at[parents[bone]] if bone in parents else 0.0)).tolist())
        nodes.append({**node, "children": children} if children else node)
    bind = np.tile(np.eye(4, dtype=np.float32), (len(bones), 1, 1))
    bind[:, 3, :3] = [-at[bone] for bone in bones]
    skin = dict(joints=list(range(len(bones))), skeleton=0, inverseBindMatrices=put(bind.reshape(-1, 16), "MAT4", FLOAT))
    nodes.append(dict(name="people", mesh=0, skin=0))
    root = dict(
        asset=dict(version="2.0", generator="umbracast-sim/bodies/export.py", copyright="CC0, MakeHuman"),
        scene=0, scenes=[dict(nodes=[0, len(bones)])], nodes=nodes, skins=[skin],
        meshes=[dict(primitives=parts, weights=[0.0] * (len(people) - 1), extras=dict(people=people))],
        accessors=accessors, bufferViews=views, buffers=[dict(byteLength=len(blob))],
    )
    text = json.dumps(root, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    blob.extend(b"\0" * (-len(blob) % 4))
    root_chunk = struct.pack("<I4s", len(text), b"JSON") + text
    blob_chunk = struct.pack("<I4s", len(blob), b"BIN\0") + bytes(blob)
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(root_chunk) + len(blob_chunk)) + root_chunk + blob_chunk)
    vertices = sum(points.shape[1] for _, points, _, _ in primitives)
    print(path.name, len(people), "people,", vertices, "vertices,", sum(len(f) for _, _, f, _ in primitives), "triangles,", path.stat().st_size, "bytes")
