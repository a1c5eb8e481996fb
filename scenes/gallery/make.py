"""Makes the data of docs/gallery.md, into a folder: the same bytes on every machine.

    python3 scenes/gallery/make.py gallery
"""

import math
import pathlib
import random
import sys


def galaxy(path):
    """Two arms of a spiral with a bulge: points with a speed."""
    draw = random.Random(1)
    with path.open("w") as out:
        out.write("x,y,z,radius,speed\n")
        for k in range(60_000):
            bulge = k % 4 == 0
            r = abs(draw.gauss(0, 1.2)) if bulge else 0.6 + 9.4 * draw.random() ** 0.8
            turn = 2 * math.pi * draw.random() if bulge else (
                math.pi * (k % 2) + 0.55 * r + draw.gauss(0, 0.28))
            z = draw.gauss(0, 0.7 * math.exp(-r / 2) + 0.06)
            x, y = r * math.cos(turn), r * math.sin(turn)
            speed = 220 * math.tanh(r / 1.5) + draw.gauss(0, 8)
            size = 0.02 + 0.03 * draw.random() ** 3
            out.write(f"{x:.5f},{y:.5f},{z:.5f},{size:.5f},{speed:.3f}\n")


def crystal(path):
    """A face-centred cubic crystal with a void, whose neighbours are drawn towards it."""
    with path.open("w") as out:
        out.write("x,y,z,radius,displacement\n")
        n = 13
        for i in range(2 * n):
            for j in range(2 * n):
                for k in range(2 * n):
                    if (i + j + k) % 2:
                        continue
                    place = [0.5 * (v - n + 0.5) for v in (i, j, k)]
                    r = math.sqrt(sum(v * v for v in place))
                    if r < 2.2:
                        continue
                    # An eighth is left out, to look inside.
                    if place[0] > 0 and place[1] > 0 and place[2] > 0:
                        continue
                    pull = 0.5 * (2.2 / r) ** 2
                    x, y, z = (v * (1 - pull / r) for v in place)
                    out.write(f"{x:.6f},{y:.6f},{z:.6f},0.3536,{pull:.6f}\n")


def packing(path):
    """Spheres of many sizes that do not overlap, each as large as it finds room."""
    draw = random.Random(2)
    cells, spheres, side = {}, [], 0.14
    key = lambda p: tuple(int(v / side) for v in p)
    while len(spheres) < 9000:
        p = [draw.random() for _ in range(3)]
        room = min(0.065, *(min(v, 1 - v) + 0.02 for v in p))
        near = key(p)
        for a in (-1, 0, 1):
            for b in (-1, 0, 1):
                for c in (-1, 0, 1):
                    for q, r in cells.get((near[0] + a, near[1] + b, near[2] + c), ()):
                        room = min(room, math.dist(p, q) - r)
        if room > 0.006:
            spheres.append((p, room))
            cells.setdefault(near, []).append((p, room))
    with path.open("w") as out:
        out.write("x,y,z,radius\n")
        for p, r in spheres:
            out.write(",".join(f"{v:.6f}" for v in (*p, r)) + "\n")


if __name__ == "__main__":
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(exist_ok=True)
    for make in (galaxy, crystal, packing):
        make(folder / f"{make.__name__}.csv")
