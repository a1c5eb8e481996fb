#!/usr/bin/env python3
"""Writes scenes/first.toml, the README's picture: python3 scenes/first.py > scenes/first.toml

A ball of spheres placed as sunflower seeds are (golden angle, equal areas), inside a tilted ring
of small ones. Colours are flat, so that depth has to be painted: every sphere is lit as if it were
a point of the large shape. Plain Python.
"""

import math

GOLDEN = math.pi * (3 - math.sqrt(5))
LIGHT = (0.45, -0.55, 0.70)  # where the light comes from, a unit vector nearly
BALL, RING = 800, 700
PALETTE = [
    (0xF9, 0x41, 0x44),
    (0xF8, 0x96, 0x1E),
    (0xF9, 0xC7, 0x4F),
    (0x90, 0xBE, 0x6D),
    (0x43, 0xAA, 0x8B),
    (0x5A, 0x8F, 0xC7),
]


def mix(a, b, t):
    return tuple(x + (y - x) * t for x, y in zip(a, b))


def ramp(t):
    """The palette, along 0 to 1."""
    t = min(max(t, 0.0), 1.0) * (len(PALETTE) - 1)
    k = min(int(t), len(PALETTE) - 2)
    return mix(PALETTE[k], PALETTE[k + 1], t - k)


def lit(color, normal, ambient):
    light = max(0.0, sum(n * l for n, l in zip(normal, LIGHT)))
    shade = ambient + (1 - ambient) * light
    color = tuple(c * shade for c in color)
    return mix(color, (255, 250, 240), 0.55 * light**12)


def sphere(center, radius, color):
    numbers = ", ".join(f"{c:.4f}" for c in center)
    text = "".join(f"{min(255, max(0, round(c))):02x}" for c in color)
    print(f'[[sphere]]\ncenter = [{numbers}]\nradius = {radius:.4f}\ncolor = "#{text}"\n')


print(f"""\
# The README's picture: a sunflower ball of {BALL} spheres around a dark core, and {RING} more in a
# ring. Perspective camera.
#
# Written by scenes/first.py. Colours are flat; the light is painted into them, sphere by sphere.

[camera]
projection = "perspective"
origin = [10.0, -7.5, 4.2]
look_at = [0.0, 0.0, -0.05]
fov = 18.5

[image]
width = 1200
height = 800
background = "#10131c"
""")

sphere((0, 0, 0), 1.46, (0x1B, 0x22, 0x33))

for k in range(BALL):
    z = 1 - (2 * k + 1) / BALL
    across, angle = math.sqrt(1 - z * z), GOLDEN * k
    normal = (across * math.cos(angle), across * math.sin(angle), z)
    # Neighbours are about sqrt(4 pi / N) apart; every 21st belongs to the same spiral.
    swell = (1.0, 0.84, 0.92)[k % 21 % 3]
    color = lit(ramp(0.5 - 0.5 * z), normal, 0.32)
    sphere([1.5 * c for c in normal], 1.5 * swell * 0.56 * math.sqrt(4 * math.pi / BALL), color)

for k in range(RING):
    turn = 2 * math.pi * k / RING
    # Three strands that wind around the ring's core.
    strand = 2 * math.pi * (k % 3) / 3 + 14 * turn
    along, up = 2.45 + 0.17 * math.cos(strand), 0.17 * math.sin(strand)
    x, y = along * math.cos(turn), along * math.sin(turn)
    across, along = math.cos(strand), math.sin(strand)
    normal = (across * math.cos(turn), across * math.sin(turn), along)
    base = [(0x8E, 0xCA, 0xE6), (0xF1, 0xFA, 0xEE), (0xE5, 0x6B, 0x6F)][k % 3]
    # Tilted about the x axis.
    c, s = math.cos(0.42), math.sin(0.42)
    tilt = lambda v: (v[0], c * v[1] - s * v[2], s * v[1] + c * v[2])
    sphere(tilt((x, y, up)), 0.062, lit(base, tilt(normal), 0.35))
