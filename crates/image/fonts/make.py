#!/usr/bin/env python3
"""Writes the font of the overlays: DejaVu Sans, cut down to what labels need.

    pip install fonttools
    python3 make.py /usr/share/fonts/truetype/dejavu/DejaVuSans.ttf

With `--check` it compares what is there, and writes nothing.
"""

import sys
from io import BytesIO
from pathlib import Path

from fontTools import subset
from fontTools.ttLib import TTFont

# Ranges of characters, both ends included.
KEPT = [
    (0x0020, 0x007E),  # ASCII
    (0x00A0, 0x024F),  # Latin with marks; degree, micro, superscripts 1 to 3
    (0x0370, 0x03FF),  # Greek
    (0x0400, 0x045F),  # Cyrillic
    (0x1E9E, 0x1E9E),  # capital sharp s
    (0x2010, 0x2015),  # dashes
    (0x2018, 0x201E),  # quotation marks
    (0x2020, 0x2022),
    (0x2026, 0x2026),
    (0x2030, 0x2030),  # per mille
    (0x2032, 0x2033),  # minutes and seconds of arc
    (0x2070, 0x208E),  # superscripts and subscripts
    (0x20AC, 0x20AC),
    (0x210F, 0x210F),  # Planck's constant
    (0x2113, 0x2113),
    (0x2126, 0x2126),  # ohm
    (0x212B, 0x212B),  # angstrom
    (0x2190, 0x2194),  # arrows
    (0x2202, 0x2202),
    (0x2206, 0x2207),
    (0x2211, 0x2212),  # sum, minus
    (0x221A, 0x221A),
    (0x221D, 0x221E),
    (0x2225, 0x2225),
    (0x222B, 0x222B),
    (0x2248, 0x2248),
    (0x2260, 0x2260),
    (0x2264, 0x2265),
    (0x2295, 0x2295),
    (0x2297, 0x2297),
    (0x2299, 0x2299),
    (0x22A5, 0x22A5),
    (0x22C5, 0x22C5),
    (0x2609, 0x2609),  # the sun, of solar masses
    (0x2640, 0x2642),
]

# What a label does not use: hints for small screens, and rules of typesetting.
DROPPED = ["FFTM", "GDEF", "GPOS", "GSUB", "MATH", "cvt ", "fpgm", "gasp", "prep"]


def cut(source: str) -> bytes:
    """The font, cut down."""
    options = subset.Options()
    options.layout_features = []
    options.legacy_kern = True
    options.hinting = False
    options.notdef_outline = True
    # Its names, whose they are and under which licence.
    options.name_IDs = [0, 1, 2, 3, 4, 5, 6, 13, 14]
    options.drop_tables += DROPPED
    font = TTFont(source, recalcTimestamp=False)
    cutter = subset.Subsetter(options)
    cutter.populate(unicodes=[c for a, b in KEPT for c in range(a, b + 1)])
    cutter.subset(font)
    into = BytesIO()
    font.save(into, reorderTables=False)
    return into.getvalue()


def main() -> None:
    """Writes the font, or compares it."""
    arguments = [a for a in sys.argv[1:] if a != "--check"]
    made = cut(arguments[0])
    there = Path(__file__).parent / "DejaVuSans.ttf"
    if "--check" not in sys.argv:
        there.write_bytes(made)
    elif there.read_bytes() != made:
        sys.exit(f"{there} is not what is made of {arguments[0]}")


main()
