#!/usr/bin/env python3
"""Writes broken/: binary files that must be refused, each a good sample with one fault.

    python3 tests/data/make_broken.py

Faults of text, and files that are only cut, are in ../broken.toml itself. Needs NumPy, zstandard.
"""

import bz2
import gzip
import io
import lzma
import struct
import zipfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent


def put(name, data):
    path = HERE / "broken" / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)


def good(name):
    return bytearray((HERE / name).read_bytes())


def changed(name, at, form, *values):
    """A good file with other numbers at a place."""
    data = good(name)
    struct.pack_into(form, data, at, *values)
    return bytes(data)


# ------------------------------------------------------------------------------------- arrays


def npy_bytes(array):
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, np.asarray(array), allow_pickle=True)
    return buffer.getvalue()


def npy_header(descr, shape, fortran=False, data=b"\0" * 72):
    text = f"{{'descr': {descr!r}, 'fortran_order': {fortran}, 'shape': {shape}, }}"
    text = text.ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode() + data


def arrays():
    centers = np.arange(9.0).reshape(3, 3)
    put("five-columns.npy", npy_bytes(np.zeros((4, 5))))
    put("flat.npy", npy_bytes(np.zeros(12)))
    put("three-axes.npy", npy_bytes(np.zeros((2, 3, 3))))
    put("complex.npy", npy_bytes(centers.astype("c16")))
    put("text.npy", npy_bytes(centers.astype("U8")))
    put("object.npy", npy_bytes(np.array([[1, "a", None]], dtype=object)))
    put("named-columns.npy", npy_bytes(np.zeros(3, [("x", "f8"), ("y", "f8"), ("z", "f8")])))
    put("nan.npy", npy_bytes(np.array([[0, 1, 2], [3, np.nan, 5]])))
    put("infinite.npy", npy_bytes(np.array([[0, 1, 2], [3, 4, -np.inf]])))
    put("negative-radius.npy", npy_bytes(np.array([[0, 1, 2, 1], [3, 4, 5, -1.0]])))
    put("huge.npy", npy_header("<f8", (2**62, 3)))
    put("many.npy", npy_header("<f8", (4_000_000_000, 3)))
    put("negative-shape.npy", npy_header("<f8", (-3, 3)))
    put("no-such-type.npy", npy_header("<f7", (3, 3)))
    put("version-9.npy", b"\x93NUMPY\x09\x00" + npy_bytes(centers)[8:])
    put("header-too-long.npy", b"\x93NUMPY\x02\x00\xff\xff\xff\xff" + npy_bytes(centers)[10:])
    put("not-numpy.npy", b"x,y,z\n1,2,3\n")


def npz(name, **parts):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        for key, value in parts.items():
            data = value if isinstance(value, bytes) else npy_bytes(value)
            file.writestr(zipfile.ZipInfo(key.replace("__", ".")), data)
    put(name, buffer.getvalue())
    return buffer.getvalue()


def archives():
    centers = np.arange(9.0).reshape(3, 3)
    npz("no-centers.npz", positions__npy=centers, radii__npy=np.ones(3))
    npz("empty.npz")
    npz("other-count.npz", centers__npy=centers, radii__npy=np.ones(4))
    npz("other-colors.npz", centers__npy=centers, colors__npy=np.zeros((3, 5), "u1"))
    npz("five-columns.npz", centers__npy=np.zeros((3, 5)))
    npz("pickled.npz", centers__npy=np.array([[1, "a", None]], dtype=object))
    npz("not-an-array.npz", centers__npy=b"1 2 3\n")
    npz("folder.npz", centers__txt=b"1 2 3\n")
    whole = npz("checksum.npz", centers__npy=centers)
    at = whole.index(struct.pack("<d", 8.0))
    put("checksum.npz", whole[:at] + struct.pack("<d", 9.0) + whole[at + 8 :])
    data = bytearray(whole)
    directory = whole.index(b"PK\x01\x02")
    struct.pack_into("<I", data, directory + 42, 0x7FFFFFF0)  # where the array is said to be
    put("offset.npz", bytes(data))
    data = bytearray(whole)
    struct.pack_into("<II", data, directory + 20, 0xFFFFFFF0, 0xFFFFFFF0)  # its sizes
    put("sizes.npz", bytes(data))
    data = bytearray(whole)
    struct.pack_into("<H", data, directory + 8, 1)  # encrypted
    struct.pack_into("<H", data, 6, 1)
    put("encrypted.npz", bytes(data))
    data = bytearray(whole)
    struct.pack_into("<H", data, directory + 10, 99)  # a way of packing that nobody knows
    struct.pack_into("<H", data, 8, 99)
    put("method.npz", bytes(data))


# ------------------------------------------------------------------------------------- packed


def packed():
    import zstandard

    text = b"2\na comment\nC 0 0 0\nC 1 1 1\n" * 40
    packers = dict(gz=lambda t: gzip.compress(t, mtime=0), bz2=bz2.compress, xz=lzma.compress,
                   zst=zstandard.ZstdCompressor(write_checksum=True).compress)
    for suffix, pack in packers.items():
        whole = pack(text)
        put(f"cut.xyz.{suffix}", whole[: len(whole) * 2 // 3])
        wrong = bytearray(whole)
        at = {"gz": -8, "bz2": len(wrong) // 2, "xz": -40, "zst": -1}[suffix]
        wrong[at] ^= 0xFF
        put(f"checksum.xyz.{suffix}", bytes(wrong))
    put("behind.xyz.gz", packers["gz"](text) + b"not packed at all")
    put("second-member-cut.xyz.gz", packers["gz"](text) + packers["gz"](text)[:-9])
    put("only-magic.xyz.gz", b"\x1f\x8b")


# ------------------------------------------------------------------------------------- GSD


def gsd_entries(data):
    """Where the entries of the index stand, and what they say."""
    index, count = struct.unpack_from("<QQ", data, 8)
    for at in range(index, index + 32 * count, 32):
        entry = struct.unpack_from("<QQqIHBB", data, at)
        if entry[2]:
            yield at, entry


def gsd():
    name = "gsd/no-diameter.gsd"
    data = good(name)
    names_at = struct.unpack_from("<Q", data, 24)[0]
    names = bytes(data[names_at:]).split(b"\0\0")[0].split(b"\0")
    entries = list(gsd_entries(data))
    where = lambda text, frame: next(at for at, e in entries
                                     if e[0] == frame and names[e[4]] == text)
    position = where(b"particles/position", 1)
    put("magic.gsd", changed(name, 0, "<Q", 0x1234))
    put("version.gsd", changed(name, 44, "<I", 0x00090000))
    put("index-offset.gsd", changed(name, 8, "<Q", 2**62))
    put("index-entries.gsd", changed(name, 16, "<Q", 2**62))
    put("names-offset.gsd", changed(name, 24, "<Q", 2**40))
    put("names-entries.gsd", changed(name, 32, "<Q", 2**60))
    put("chunk-offset.gsd", changed(name, position + 16, "<q", 2**50))
    put("chunk-rows.gsd", changed(name, position + 8, "<Q", 2**62))
    put("chunk-columns.gsd", changed(name, position + 24, "<I", 2))
    put("chunk-type.gsd", changed(name, position + 30, "<B", 77))
    put("chunk-name.gsd", changed(name, position + 28, "<H", 60000))
    put("chunk-fewer.gsd", changed(name, position + 8, "<Q", 7))
    put("chunk-negative.gsd", changed(name, position + 16, "<q", -64))
    location = struct.unpack_from("<q", data, position + 16)[0]
    put("nan.gsd", changed(name, location + 4, "<f", float("nan")))
    name = "gsd/inherited.gsd"
    data = good(name)
    names_at = struct.unpack_from("<Q", data, 24)[0]
    names = bytes(data[names_at:]).split(b"\0\0")[0].split(b"\0")
    entries = list(gsd_entries(data))
    kinds = struct.unpack_from("<q", data, where(b"particles/typeid", 0) + 16)[0]
    put("typeid.gsd", changed(name, kinds, "<I", 3))
    width = struct.unpack_from("<q", data, where(b"particles/diameter", 0) + 16)[0]
    put("negative-diameter.gsd", changed(name, width, "<f", -1.0))


# ------------------------------------------------------------------------------------- XTC, DCD


def xtc():
    """Offsets: magic 0, atoms 4, step 8, time 12, box 16, atoms again 52; then, of packed ones,
    precision 56, least 60, greatest 72, smallest index 84, bytes 88."""
    name = "xtc/ten.xtc"
    data = good(name)
    size = struct.unpack_from(">i", data, 88)[0]
    second = 92 + (size + 3) // 4 * 4
    put("magic-frame-1.xtc", changed(name, second, ">i", 1996))
    put("magic.xtc", changed(name, 0, ">i", 1234))
    put("atoms-negative.xtc", changed(name, 4, ">i", -10))
    put("atoms-huge.xtc", changed(name, 4, ">I", 4_000_000_000))
    put("atoms-differ.xtc", changed(name, 52, ">i", 12))
    put("precision-0.xtc", changed(name, 56, ">f", 0.0))
    put("precision-nan.xtc", changed(name, 56, ">f", float("nan")))
    put("least-above-greatest.xtc", changed(name, 60, ">i", 2**30))
    put("span.xtc", changed(name, 60, ">6i", *[-(2**31)] * 3, *[2**31 - 1] * 3))
    put("small-index.xtc", changed(name, 84, ">i", 200))
    put("small-index-negative.xtc", changed(name, 84, ">i", -1))
    put("bytes-huge.xtc", changed(name, 88, ">i", 2**31 - 1))
    put("bytes-negative.xtc", changed(name, 88, ">i", -4))
    short = good(name)[:second]
    struct.pack_into(">i", short, 88, 8)
    put("bits-run-out.xtc", bytes(short[: 92 + 8]))
    put("nan.xtc", changed("xtc/nine.xtc", 60, ">f", float("nan")))


def dcd():
    """Offsets: mark 0, CORD 4, numbers 8; behind mark 88 titles; then the number of atoms."""
    name = "dcd/no-cell.dcd"
    data = good(name)
    titles = struct.unpack_from("<i", data, 92)[0]
    atoms = 92 + 4 + titles + 4
    first = atoms + 12
    put("mark.dcd", changed(name, first + 4 + 60, "<i", 64))
    put("mark-of-y.dcd", changed(name, first + 8 + 60, "<i", 56))
    put("magic.dcd", changed(name, 4, "4s", b"CARD"))
    put("velocities.dcd", changed(name, 4, "4s", b"VELD"))
    put("not-dcd.dcd", b"CORD and nothing else\n")
    put("atoms-negative.dcd", changed(name, atoms + 4, "<i", -15))
    put("atoms-huge.dcd", changed(name, atoms + 4, "<i", 2**31 - 1))
    put("atoms-fewer.dcd", changed(name, atoms + 4, "<i", 14))
    put("titles-huge.dcd", changed(name, 92, "<i", 2**31 - 16))
    put("fixed-too-many.dcd", changed(name, 8 + 4 * 8, "<i", 99))
    put("nan.dcd", changed(name, first + 8, "<f", float("inf")))
    free = good("dcd/fixed.dcd")
    put("free-index.dcd", changed("dcd/fixed.dcd", first + 4, "<i", 16))
    assert struct.unpack_from("<i", free, first)[0] == 48
    # 64-bit marks, as some compilers write: 84 as eight bytes.
    put("wide-marks.dcd", struct.pack("<q", 84) + bytes(data[4:88]) + struct.pack("<q", 84))


# ------------------------------------------------------------------------------------- PLY


def ply():
    data = bytes(good("ply/list-first.ply"))
    head = data.index(b"end_header\n") + 11
    put("list-length.ply", data[:head] + b"\xff" + data[head + 1 :])
    data = bytes(good("ply/little.ply"))
    head = data.index(b"end_header\n") + 11
    put("nan.ply", data[: head + 19] + struct.pack("<f", float("nan")) + data[head + 23 :])
    put("negative-radius.ply", data[: head + 15] + struct.pack("<f", -1) + data[head + 19 :])
    put("binary-in-xyz.xyz", data)
    put("nothing.ply", b"")
    put("utf-16.csv", "x,y,z\n1,2,3\n".encode("utf-16"))
    put("not-text.pdb", b"ATOM      1  CA  GLY A   1       0.0\xff\xfe00   0.000   0.000\n")


for make in (arrays, archives, packed, gsd, xtc, dcd, ply):
    make()
