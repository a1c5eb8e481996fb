#!/usr/bin/env python3
"""Casts a parallel ray per pixel at the spheres of a scene; writes the index of the nearest, or -1.

    python3 scenes/report/cast.py scenes/report/occlusion.toml ids.npy          in float64
    python3 scenes/report/cast.py scenes/report/occlusion.toml ids.npy --f32    the same in float32

docs/ray-sphere.md explains it. It reads scenes as they are in this folder: orthographic, with an
origin, a view, an up and a width.
"""
import sys
import tomllib

import numpy as np

Real = np.float32 if "--f32" in sys.argv else np.float64
words = [word for word in sys.argv[1:] if word != "--f32"]
if len(words) != 2:
    sys.exit(__doc__)
with open(words[0], "rb") as file:
    scene = tomllib.load(file)
camera, image = scene["camera"], scene["image"]
unit = lambda v: v / np.sqrt(v @ v)
origin, view, up = (np.array(camera[key], Real) for key in ("origin", "view", "up"))
view = unit(view)
right = unit(np.cross(view, up))
up = np.cross(right, view)

# Where the ray of each pixel starts: column 0 at the left, row 0 at the top.
columns, rows = image["width"], image["height"]
width, height = Real(camera["width"]), Real(camera["width"] * rows / columns)
x = ((np.arange(columns, dtype=Real) + Real(0.5)) / Real(columns) - Real(0.5)) * width
y = (Real(0.5) - (np.arange(rows, dtype=Real) + Real(0.5)) / Real(rows)) * height
start = origin + x[None, :, None] * right + y[:, None, None] * up

# The nearest sphere so far at each pixel, and its depth.
ids = np.full((rows, columns), -1, np.int32)
best = np.full((rows, columns), np.inf, Real)
for index, sphere in enumerate(scene["sphere"]):
    to_center = np.array(sphere["center"], Real) - start
    middle = to_center @ view
    apart = to_center - middle[..., None] * view
    square = Real(sphere["radius"]) ** 2 - (apart * apart).sum(-1)
    half = np.sqrt(np.where(square >= 0, square, np.nan))
    depth = np.where(middle - half >= 0, middle - half, middle + half)
    nearer = (depth >= 0) & (depth < best)
    best[nearer], ids[nearer] = depth[nearer], index
np.save(words[1], ids)
