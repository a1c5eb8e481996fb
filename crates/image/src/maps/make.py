#!/usr/bin/env python3
"""Writes the tables of colours beside it, or compares them: red, green and blue bytes, in order.

    pip install matplotlib cmcrameri
    python3 crates/image/src/maps/make.py            writes
    python3 crates/image/src/maps/make.py --check    fails where a table differs

A table has the bytes that matplotlib gives for the indices of the map.
"""

import pathlib
import sys

import cmcrameri.cm
import matplotlib
import numpy as np

FOLDER = pathlib.Path(__file__).parent
CONTINUOUS = ["viridis", "magma", "inferno", "plasma", "cividis", "turbo", "batlow", "coolwarm"]
CATEGORICAL = ["tab10", "tab20"]


def table(name):
    """The bytes of a map."""
    cmap = cmcrameri.cm.batlow if name == "batlow" else matplotlib.colormaps[name]
    entries = int(name[3:]) if name in CATEGORICAL else 256
    assert cmap.N == entries, f"{name} has {cmap.N} entries, not {entries}"
    return cmap(np.arange(entries), bytes=True)[:, :3].tobytes()


def main():
    if sys.argv[1:] not in ([], ["--check"]):
        sys.exit(__doc__)
    different = []
    for name in CONTINUOUS + CATEGORICAL:
        path = FOLDER / f"{name}.rgb"
        if not sys.argv[1:]:
            path.write_bytes(table(name))
        elif not path.exists() or path.read_bytes() != table(name):
            different.append(name)
    if different:
        sys.exit(f"not what matplotlib {matplotlib.__version__} gives: {', '.join(different)}")


if __name__ == "__main__":
    main()
