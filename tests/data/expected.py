#!/usr/bin/env python3
"""Reads the samples by other programs than ours, and writes what a reader must find in them.

    python3 tests/data/expected.py      writes expected.json and expected/FOLDER/NAME.frameK.npy

It needs what make.py needs, but for LAMMPS. Centres are f64. Numbers in text are the nearest f64
(Python's float, which rounds correctly); f32 of binary files is widened; units are those of the
file. Atoms stand in the order of the file. A second reader is held against the first where there
is one: `agree` names those that give the same numbers (or the same after rounding to f32, where
they keep no more: "f32"), `differ` what the others say. Words of expected.json:

    frames      how many the file has; `read` lists those that are here, each with its `index`
    tolerance   0: the same bits; else the greatest difference of a coordinate (scaled ones)
    elements    symbols as the file states them; in a list, null where it states none
    names       texts that stand for an atom where they may be no element
    radii, colors, types, ids       as in the file
    left_out    atoms that are alternates of another and not drawn

A word that is missing is something that the file has not.
"""

import bz2
import csv as csv_module
import gzip
import itertools
import json
import lzma
import math
import re
import struct
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
OUT = HERE / "expected"

from ase.data import chemical_symbols  # noqa: E402

SYMBOLS = {s.upper(): s for s in chemical_symbols[1:]} | {"D": "D"}


def number(text):
    """The nearest f64 of a number as C, Fortran and Python write it."""
    return float(text.replace("D", "e").replace("d", "e"))


def symbol(text):
    """An element of exactly this name, or None."""
    return SYMBOLS.get(text.strip().upper())


def frame(centers, index=0, tolerance=0.0, **more):
    centers = np.asarray(centers, "f8").reshape(-1, 3)
    found = dict(index=index, count=len(centers), centers=centers, tolerance=tolerance)
    for key in ("elements", "names", "radii", "colors", "types", "ids"):
        found[key] = more.pop(key, None)
        if isinstance(found[key], np.ndarray):
            found[key] = found[key].tolist()
        if found[key] is not None and all(value is None for value in found[key]):
            found[key] = None if len(centers) else []
    return {**found, **more}


def compare(frames, name, others, single=False):
    """Whether another reader found the same; None, or what differs."""
    if len(others) != len(frames):
        return f"{name}: {len(others)} frames"
    for mine, theirs in zip(frames, others):
        theirs = np.asarray(theirs, "f8").reshape(-1, 3)
        at = mine["centers"].astype("f4").astype("f8") if single else mine["centers"]
        theirs = theirs.astype("f4").astype("f8") if single else theirs
        if at.shape != theirs.shape:
            return f"{name}: {len(theirs)} atoms in frame {mine['index']}"
        wrong = ~((np.abs(at - theirs) <= mine["tolerance"]) | (at == theirs))
        if wrong.any():
            row = int(np.argmax(wrong.any(axis=1)))
            return (f"{name}: {int(wrong.any(axis=1).sum())} atoms differ in frame "
                    f"{mine['index']}, atom {row}: {at[row].tolist()} here, "
                    f"{theirs[row].tolist()} there")
    return None


class Found:
    """What is known of one file."""

    def __init__(self, path, reader, frames, total=None, **more):
        self.path, self.frames = path, frames
        self.facts = dict(reader=reader, frames=len(frames) if total is None else total, agree=[],
                          differ=[], **more)

    def check(self, name, read, single=False):
        try:
            others = read()
        except Exception as error:  # what other programs cannot read is a fact too
            words = f"{name} fails: {type(error).__name__}: {error}".replace(f"{HERE}/", "")
            self.facts["differ"].append(words[:200])
            return self
        differs = compare(self.frames, name, others, single)
        if differs:
            self.facts["differ"].append(differs)
        else:
            self.facts["agree"].append(name + (" (f32)" if single else ""))
        return self


def ase_positions(path, **how):
    from ase.io import read

    return [atoms.positions for atoms in read(path, index=":", **how)]


# ------------------------------------------------------------------------------------- arrays


def arrays(path):
    loaded = np.load(path)
    if path.suffix == ".npy":
        return Found(path, "numpy", [frame(loaded[:, :3], radii=loaded[:, 3]
                                           if loaded.shape[1] == 4 else None)])
    get = lambda name: loaded[name] if name in loaded else None
    found = frame(loaded["centers"], radii=get("radii"), colors=get("colors"))
    return Found(path, "numpy", [found])


# ------------------------------------------------------------------------------------- XYZ


PAIR = re.compile(r'([^\s=]+)\s*=\s*("(?:[^"\\]|\\.)*"|\'[^\']*\'|\[.*?\]+|\{.*?\}|\S+)')


def properties(comment):
    """Names, kinds and widths of columns."""
    for key, value in PAIR.findall(comment):
        if key.lower() == "properties":
            parts = value.strip('"').split(":")
            return [(parts[i].lower(), parts[i + 1], int(parts[i + 2]))
                    for i in range(0, len(parts), 3)]
    return [("species", "S", 1), ("pos", "R", 3)]


def xyz(path):
    lines = path.read_text().split("\n")
    frames, at = [], 0
    while at < len(lines) and lines[at].strip():
        count, columns = int(lines[at]), properties(lines[at + 1])
        rows = [line.split() for line in lines[at + 2 : at + 2 + count]]
        at += 2 + count
        values, start = {}, 0
        for name, kind, width in columns:
            values[name] = [row[start : start + width] for row in rows]
            start += width
        reals = lambda name: [[number(x) for x in row] for row in values[name]]
        first = lambda name, cast: [cast(row[0]) for row in values[name]]
        species = first("species", str) if "species" in values else None
        elements = species and [chemical_symbols[int(s)] if s.isdigit() else symbol(s)
                                for s in species]
        frames.append(frame(
            reals("pos"), len(frames), elements=elements, names=species,
            radii=first("radius", number) if "radius" in values else None,
            colors=reals("color") if "color" in values else None,
            types=first("type", int) if "type" in values else None,
            ids=first("id", int) if "id" in values else None))
    found = Found(path, "Python", frames)
    kind = "extxyz" if path.suffix == ".extxyz" else "xyz"
    return found.check("ase " + kind, lambda: ase_positions(path, format=kind))


# ------------------------------------------------------------------------------------- LAMMPS


def box_of(kind, rows):
    """Origin and the three vectors of a box of LAMMPS: of its bounds, the true ones."""
    rows = [[float(x) for x in row.split()] for row in rows]
    if "abc" in kind:
        return np.array([row[3] for row in rows]), np.array([row[:3] for row in rows])
    xy, xz, yz = [row[2] for row in rows] if "xy" in kind else (0.0, 0.0, 0.0)
    xlo = rows[0][0] - min(0.0, xy, xz, xy + xz)
    xhi = rows[0][1] - max(0.0, xy, xz, xy + xz)
    ylo, yhi = rows[1][0] - min(0.0, yz), rows[1][1] - max(0.0, yz)
    zlo, zhi = rows[2][:2]
    return (np.array([xlo, ylo, zlo]),
            np.array([[xhi - xlo, 0, 0], [xy, yhi - ylo, 0], [xz, yz, zhi - zlo]]))


def dump_frames(path):
    lines = path.read_text().splitlines()
    at, frames = 0, []
    while at < len(lines):
        item = lines[at]
        if item == "ITEM: NUMBER OF ATOMS":
            count = int(lines[at + 1])
        if item.startswith("ITEM: BOX BOUNDS"):
            box = box_of(item, lines[at + 1 : at + 4])
        if not item.startswith("ITEM: ATOMS"):
            at += 1
            continue
        names = item.split()[2:]
        rows = [line.split() for line in lines[at + 1 : at + 1 + count]]
        at += 1 + count
        frames.append(dump_frame(len(frames), names, rows, box))
    return frames


def dump_frame(index, names, rows, box):
    column = lambda name, cast: [cast(row[names.index(name)]) for row in rows]
    have = lambda name: name in names
    kind = next(k for k in (["x", "y", "z"], ["xu", "yu", "zu"], ["xs", "ys", "zs"],
                            ["xsu", "ysu", "zsu"]) if have(k[0]))
    at = np.array([column(name, float) for name in kind]).T.reshape(-1, 3)
    tolerance = 0.0
    if "s" in kind[0]:
        origin, vectors = box
        corners = np.abs(origin).max() + np.abs(vectors).sum(axis=0).max() * max(
            1.0, np.abs(at).max(initial=0))
        tolerance = 2 * math.ulp(corners)
        at = origin + at[:, :1] * vectors[0] + at[:, 1:2] * vectors[1] + at[:, 2:] * vectors[2]
    radii = column("radius", float) if have("radius") else None
    if radii is None and have("diameter"):
        radii = [d / 2 for d in column("diameter", float)]
    return frame(at, index, tolerance, radii=radii,
                 elements=[symbol(e) for e in column("element", str)] if have("element") else None,
                 types=column("type", int) if have("type") else None,
                 ids=column("id", int) if have("id") else None)


def dump(path):
    found = Found(path, "Python", dump_frames(path))
    found.check("ase lammps-dump-text, unsorted",
                lambda: ase_positions(path, format="lammps-dump-text", order=False))
    return found.check("MDAnalysis, sorted by id", lambda: [
        u for u in mdanalysis_dump(path, found.frames)], single=True)


def mdanalysis_dump(path, frames):
    """MDAnalysis gives atoms by id and moves nothing: back to the order of the file."""
    import MDAnalysis

    count = frames[0]["count"]
    universe = MDAnalysis.Universe.empty(count, trajectory=True)
    universe.load_new(str(path), format="LAMMPSDUMP")
    for mine, step in zip(frames, universe.trajectory):
        order = np.argsort(np.argsort(mine["ids"]))
        yield step.positions[order]


STYLES = {  # columns of `Atoms`, before image flags
    "atomic": "id type x y z", "charge": "id type q x y z", "molecular": "id mol type x y z",
    "angle": "id mol type x y z", "bond": "id mol type x y z", "full": "id mol type q x y z",
    "sphere": "id type diameter density x y z", "dipole": "id type q x y z mux muy muz",
    "hybrid": "id type x y z"}  # and what the file does not tell


def data(path, style=None):
    lines = [line.split("#")[0].strip() for line in path.read_text().splitlines()]
    start = next(i for i, line in enumerate(lines) if i and line == "Atoms")
    hint = path.read_text().splitlines()[start].partition("#")[2].strip()
    count = next(int(line.split()[0]) for line in lines[1:] if line.endswith("atoms"))
    name = path.stem.replace("-without-hint", "")
    used = style or hint or name
    columns = STYLES[used].split()
    rows = [line.split() for line in lines[start + 1 :] if line][:count]
    column = lambda key, cast: [cast(row[columns.index(key)]) for row in rows]
    plain = all(row[columns.index("type")].isdigit() for row in rows)
    radii = [d / 2 for d in column("diameter", float)] if "diameter" in columns else None
    labels = dict(line.split() for line in itertools.takewhile(
        bool, lines[lines.index("Atom Type Labels") + 2 :])) if "Atom Type Labels" in lines else {}
    types = [labels.get(kind, kind) for kind in column("type", str)]
    read = frame(np.array([column(k, float) for k in "xyz"]).T, radii=radii, ids=column("id", int),
                 types=[int(kind) for kind in types] if plain and not labels else types)
    found = Found(path, "Python", [read], style=used, hint=hint or None)
    return found.check("MDAnalysis, sorted by id", lambda: [
        mdanalysis_data(path, STYLES[used], read["ids"])], single=True)


def mdanalysis_data(path, columns, ids):
    """MDAnalysis is told the columns, and gives atoms by id."""
    import MDAnalysis

    columns = " ".join({"mol": "resid", "q": "charge"}.get(c, c) for c in columns.split())
    read = MDAnalysis.Universe(str(path), format="DATA", atom_style=columns)
    return read.atoms.positions[np.argsort(np.argsort(ids))]


# ------------------------------------------------------------------------------------- PDB


def without_alternates(atoms):
    """Atoms without the alternates that are not drawn; how many those are.

    Of atoms of the same key, of which one at least has a letter, the one that is there most often
    (occupancy) is drawn, the first among equals. Atoms without letters are all drawn: numbers of
    residues begin again in large systems.
    """
    groups = {}
    for atom in atoms:
        groups.setdefault(atom["key"], []).append(atom)
    kept = set()
    for group in groups.values():
        best = max(group, key=lambda atom: atom["occupancy"])
        lettered = any(atom["alternate"] for atom in group)
        kept.update(id(atom) for atom in ([best] if lettered else group))
    left = [atom for atom in atoms if id(atom) in kept]
    return left, len(atoms) - len(left)


# Residues of which every name begins with its element, in whatever column: many programs write
# ` CA ` and `CA  ` alike, and no protein has calcium where its carbons should be.
KNOWN = set("ALA ARG ASN ASP CYS GLN GLU GLY HIS ILE LEU LYS MET PHE PRO SER THR TRP TYR VAL "
            "HSD HSE HSP HID HIE HIP CYX CYM ASH GLH LYN A C G U DA DC DG DT DU ADE CYT GUA THY "
            "URA HOH WAT SOL TIP TIP3 TIP4 TP3 DOD H2O SPC".split())


def pdb_element(line):
    """What the file says; else by the residue; else by the columns of the name."""
    said = re.sub("[^A-Za-z]", "", line[76:78])
    if said:
        return symbol(said)
    if line[17:21].strip() in KNOWN:
        return symbol(re.sub("[^A-Za-z]", "", line[12:16])[:1])
    name = line[12:16].ljust(4)
    if name[0] in " 0123456789":  # one letter, in column 14
        return symbol(name[1:2])
    if name.strip().isalnum() and len(name.strip()) == 4 and name[0] in "HD":
        return symbol(name[0])  # HG11: a name of four letters begins one column early
    return symbol(name[:2]) or symbol(name[0])


def pdb_models(path):
    models, open_model, ended = [[]], False, False
    for line in path.read_text().splitlines():
        record = line[:6].strip()
        if record == "MODEL" or (record in ("ATOM", "HETATM") and ended):
            if models[-1]:
                models.append([])
            ended = False
        if record in ("END", "ENDMDL"):
            ended = True
        if record not in ("ATOM", "HETATM"):
            continue
        occupancy = line[54:60].strip()
        models[-1].append(dict(
            at=[float(line[30:38]), float(line[38:46]), float(line[46:54])],
            key=(line[21:22], line[22:26], line[26:27], line[12:16]),
            alternate=line[16:17].strip(), occupancy=float(occupancy) if occupancy else 1.0,
            element=pdb_element(line), name=line[12:16].strip()))
    return models


def atom_frames(models):
    frames = []
    for atoms in models:
        kept, left_out = without_alternates(atoms)
        frames.append(frame([a["at"] for a in kept], len(frames), left_out=left_out,
                            elements=[a["element"] for a in kept],
                            names=[a["name"] for a in kept]))
    return frames


def pdb(path):
    import gemmi

    models = pdb_models(path)
    found = Found(path, "Python", atom_frames(models))
    whole = [frame([a["at"] for a in atoms], i) for i, atoms in enumerate(models)]
    every = Found(path, "", whole)
    every.check("gemmi, with alternates", lambda: [
        [cra.atom.pos.tolist() for cra in model.all()]
        for model in gemmi.read_structure(str(path))])
    every.check("ase, with alternates", lambda: ase_positions(path, format="proteindatabank"))
    found.facts["agree"], found.facts["differ"] = every.facts["agree"], every.facts["differ"]
    try:
        theirs = gemmi.read_structure(str(path))
    except RuntimeError:
        return found
    for index, (model, atoms) in enumerate(zip(theirs, models)):
        mine = [a["element"] for a in atoms]
        names = [cra.atom.element.name for cra in model.all()]
        if len(mine) == len(names) and (pairs := {(a["name"], m, n) for a, m, n in
                                                  zip(atoms, mine, names) if m != n}):
            found.facts["differ"].append(
                f"gemmi's elements (name, here, there): {sorted(pairs, key=str)}")
            break
    return found


# ------------------------------------------------------------------------------------- mmCIF


def mmcif(path):
    import gemmi

    document = gemmi.cif.read(str(path))
    table = None
    for block in document:
        tags = [t for t in block.get_mmcif_category_names() if t.lower() == "_atom_site."]
        if tags and any(block.find_mmcif_category(tags[0]).tags):
            table = block.find_mmcif_category(tags[0])
    tags = [tag.split(".")[1].lower() for tag in table.tags]
    models = {}
    for row in table:
        raw = dict(zip(tags, row))
        value = {key: gemmi.cif.as_string(text) for key, text in raw.items()
                 if text not in (".", "?")}
        get = lambda *keys: next((value[k] for k in keys if k in value), "")
        real = lambda text: float(re.sub(r"\(\d+\)$", "", text))
        key = (get("auth_asym_id", "label_asym_id"), get("auth_seq_id", "label_seq_id"),
               get("pdbx_pdb_ins_code"), get("label_atom_id", "auth_atom_id"))
        models.setdefault(get("pdbx_pdb_model_num"), []).append(dict(
            at=[real(value[f"cartn_{axis}"]) for axis in "xyz"], key=key,
            alternate=get("label_alt_id"), element=symbol(get("type_symbol")),
            name=get("label_atom_id"), occupancy=real(get("occupancy") or "1")))
    found = Found(path, "gemmi.cif and Python", atom_frames(models.values()))
    every = Found(path, "", [frame([a["at"] for a in atoms], i)
                             for i, atoms in enumerate(models.values())])
    every.check("gemmi.read_structure, with alternates", lambda: [
        [cra.atom.pos.tolist() for cra in model.all()]
        for model in gemmi.read_structure(str(path))])
    every.check("Biopython, with alternates", lambda: biopython(path))
    found.facts["agree"], found.facts["differ"] = every.facts["agree"], every.facts["differ"]
    return found


def biopython(path):
    from Bio.PDB.MMCIF2Dict import MMCIF2Dict

    table = MMCIF2Dict(str(path))
    rows = np.array([[float(x) for x in table[f"_atom_site.Cartn_{a}"]] for a in "xyz"]).T
    models = table.get("_atom_site.pdbx_PDB_model_num", ["1"] * len(rows))
    return [rows[[m == model for m in models]] for model in dict.fromkeys(models)]


# ------------------------------------------------------------------------------------- GRO


def gro(path):
    lines = path.read_text().split("\n")
    frames, at = [], 0
    while at + 1 < len(lines) and lines[at + 1].strip():
        count = int(lines[at + 1])
        rows = lines[at + 2 : at + 2 + count]
        at += count + 3
        width = 8
        if rows:
            dots = [i for i, c in enumerate(rows[0]) if c == "." and i >= 20]
            width = dots[1] - dots[0]
        field = lambda row, k: float(row[20 + k * width : 20 + (k + 1) * width])
        frames.append(frame([[field(row, k) for k in range(3)] for row in rows], len(frames),
                            names=[row[10:15].strip() for row in rows]))
    found = Found(path, "Python", frames)
    found.check("mdtraj", lambda: mdtraj_gro(path), single=True)
    return found.check("ase, nm", lambda: [at / 10 for at in ase_positions(path, format="gromacs")],
                       single=True)


def mdtraj_gro(path):
    from mdtraj.formats import GroTrajectoryFile

    with GroTrajectoryFile(str(path)) as file:
        return list(file.read()[0])


# ------------------------------------------------------------------------------------- PLY


def ply(path):
    from plyfile import PlyData

    read = PlyData.read(str(path))["vertex"]
    names = [p.name for p in read.properties]
    column = lambda name: np.asarray(read[name])
    colors = None
    for kind in (("red", "green", "blue"), ("r", "g", "b"),
                 ("diffuse_red", "diffuse_green", "diffuse_blue")):
        if kind[0] in names:
            colors = np.stack([column(c) for c in kind], -1)
    found = frame(np.stack([column(c).astype("f8") for c in "xyz"], -1), colors=colors,
                  radii=column("radius").astype("f8") if "radius" in names else None)
    raw = path.read_bytes()
    if b"format ascii" in raw[:40]:
        # The numbers of the text, and not those of the type that the header gives them.
        found["centers"] = ply_text(raw.decode(), read)
        return Found(path, "plyfile, and Python for the text", [found])
    return Found(path, "plyfile", [found])


def ply_text(text, element):
    lines = text.replace("\r\n", "\n").split("end_header\n")[1].split("\n")
    lines = [line.split() for line in lines if line.strip()]
    names = [p.name for p in element.properties]
    header = re.findall(r"element\s+(\S+)\s+(\d+)", text)
    skip = 0
    for name, count in header:
        if name == "vertex":
            break
        skip += int(count)
    rows = []
    for words in lines[skip : skip + element.count]:
        row, at = {}, 0
        for prop, name in zip(element.properties, names):
            if type(prop).__name__ == "PlyListProperty":
                at += 1 + int(words[at])
                continue
            row[name] = float(words[at])
            at += 1
        rows.append([row[c] for c in "xyz"])
    return np.array(rows, "f8")


# ------------------------------------------------------------------------------------- CSV


def csv(path):
    text = path.read_text("utf-8-sig")
    text = "".join(line for line in text.splitlines(True) if not line.startswith("#"))
    head = text.split("\n")[0]
    separator = next((s for s in (";", "\t", ",") if s in head), None)
    decimal = "," if separator == ";" and re.search(r"\d,\d", text) else "."
    if separator:
        rows = list(csv_module.reader(text.splitlines(True), delimiter=separator))
    else:
        rows = [line.split() for line in text.splitlines()]
    rows = [[cell.strip() for cell in row] for row in rows if any(cell.strip() for cell in row)]
    named = not re.fullmatch(r"[-+.\d]+", rows[0][0] or "x")
    names = [n.lower() for n in rows.pop(0)] if named else ["x", "y", "z"]
    real = lambda cell: float(cell.replace(decimal, "."))
    column = lambda name, cast: [cast(row[names.index(name)]) for row in rows]
    have = lambda name: name in names
    found = frame(np.array([column(c, real) for c in "xyz"]).T,
                  radii=column("radius", real) if have("radius") else None,
                  elements=[symbol(e) for e in column("element", str)] if have("element") else None,
                  ids=column("id", int) if have("id") else None,
                  colors=[list(c) for c in zip(*[column(c, int) for c in "rgb"])]
                  if have("r") else None)
    made = Found(path, "Python", [found], header=named)
    return made.check("pandas", lambda: [pandas_centers(
        path, separator or r"\s+", decimal, named)])


def pandas_centers(path, separator, decimal, named):
    import pandas

    table = pandas.read_csv(path, sep=separator, decimal=decimal, comment="#", encoding="utf-8-sig",
                            header=0 if named else None, skipinitialspace=True)
    table.columns = [str(c).strip().lower() for c in table.columns] if named else list("xyz")
    return table[list("xyz")].to_numpy("f8")


# ------------------------------------------------------------------------------------- GSD


def gsd(path):
    import gsd.fl
    import gsd.hoomd

    low = gsd.fl.open(path, "r")
    frames, total = [], low.nframes
    with gsd.hoomd.open(path, "r") as file:
        few = range(total) if total < 10 else [0, 1, total // 2, total - 1]
        for index in few:
            read = file[index]
            wide = any(low.chunk_exists(k, "particles/diameter")
                       and (k == index or file[0].particles.N == read.particles.N)
                       for k in (index, 0))
            kinds = read.particles.types or ["A"]
            frames.append(frame(
                np.asarray(read.particles.position), index,
                radii=(np.asarray(read.particles.diameter, "f8") / 2) if wide else None,
                types=[int(k) for k in read.particles.typeid]))
    return Found(path, "gsd.hoomd", frames, total)


# ------------------------------------------------------------------------------------- XTC, DCD


def topology(path, count):
    for name in ("water.pdb", "lammps.data"):
        if path.stem.split("-")[0] == Path(name).stem:
            return name
    if path.stem == "mdanalysis":
        return "water.pdb"
    return f"argon-{count}.gro"


def xtc(path):
    from MDAnalysis.lib.formats.libmdaxdr import XTCFile
    from mdtraj.formats import XTCTrajectoryFile

    with XTCFile(str(path)) as file:
        frames = [frame(step.x, index) for index, step in enumerate(file)]
    found = Found(path, "MDAnalysis libmdaxdr", frames,
                  topology="xtc/" + topology(path, frames[0]["count"]))

    def mdtraj():
        with XTCTrajectoryFile(str(path)) as file:
            return list(file.read()[0])

    return found.check("mdtraj", mdtraj)


def dcd_frames(path):
    """Record by record."""
    raw = path.read_bytes()
    order = "<" if raw[:4] == b"\x54\0\0\0" else ">"
    at, records = 0, []
    while at < len(raw):
        size = struct.unpack_from(order + "i", raw, at)[0]
        if len(records) == 1:  # of titles their number is to be trusted, not their marks
            size = 4 + 80 * struct.unpack_from(order + "i", raw, at + 4)[0]
        records.append(raw[at + 4 : at + 4 + size])
        at += 8 + size
    integers = struct.unpack(order + "20i", records[0][4:84])
    count = struct.unpack(order + "i", records[2])[0]
    charmm = integers[19] != 0
    cell, fourth = (integers[10] != 0, integers[11] != 0) if charmm else (False, False)
    free, rest = None, records[3:]
    if integers[8]:
        free, rest = np.frombuffer(rest[0], order + "i4") - 1, rest[1:]
    step = 3 + cell + fourth
    frames, last = [], None
    for first in range(0, len(rest), step):
        axes = rest[first + cell : first + cell + 3]
        moved = np.stack([np.frombuffer(axis, order + "f4") for axis in axes], -1)
        if len(moved) != count:
            whole = last.copy()
            whole[free] = moved
            moved = whole
        last = moved
        frames.append(frame(moved, len(frames)))
    return frames


def dcd(path):
    from MDAnalysis.lib.formats.libdcd import DCDFile
    from mdtraj.formats import DCDTrajectoryFile

    frames = dcd_frames(path)
    found = Found(path, "Python", frames, topology="dcd/" + topology(path, frames[0]["count"]))

    def libdcd():
        with DCDFile(str(path)) as file:
            return [step.xyz.copy() for step in file]

    def mdtraj():
        with DCDTrajectoryFile(str(path)) as file:
            return list(file.read()[0])

    return found.check("MDAnalysis libdcd", libdcd).check("mdtraj", mdtraj)


# ------------------------------------------------------------------------------------- all


READERS = {"npy": arrays, "npz": arrays, "xyz": xyz, "dump": dump, "lammps-data": data, "pdb": pdb,
           "mmcif": mmcif, "gro": gro, "ply": ply, "csv": csv, "gsd": gsd, "xtc": xtc, "dcd": dcd}
SUFFIXES = {"xtc": [".xtc"], "dcd": [".dcd"]}


def packed(path):
    """What a packed file holds, as another file that is here."""
    import zstandard

    raw = path.read_bytes()
    opened = {b"\x1f\x8b": gzip.decompress, b"BZ": bz2.decompress, b"\xfd7": lzma.decompress,
              b"(\xb5": lambda raw: zstandard.ZstdDecompressor().stream_reader(
                  raw, read_across_frames=True).read()}
    plain = opened.get(raw[:2], bytes)(raw)
    for other in sorted(HERE.rglob("*")):
        elsewhere = {"packed", "broken"}.isdisjoint(other.parts)
        if other.is_file() and elsewhere and other.read_bytes() == plain:
            return str(other.relative_to(HERE))
    return None


def written(found):
    name = found.path.relative_to(HERE)
    for part in found.frames:
        target = OUT / name.parent / f"{name.name}.frame{part['index']}.npy"
        target.parent.mkdir(parents=True, exist_ok=True)
        np.save(target, np.ascontiguousarray(part["centers"]))
        part["centers"] = str(target.relative_to(HERE))
    return dict(file=str(name), **found.facts, read=found.frames)


def line(value):
    return json.dumps(value, ensure_ascii=True, allow_nan=False)


def main():
    for old in OUT.rglob("*.npy"):
        old.unlink()
    entries = []
    for folder, reader in READERS.items():
        for path in sorted((HERE / folder).iterdir()):
            if path.is_file() and path.suffix in SUFFIXES.get(folder, [path.suffix]):
                entries.append(written(reader(path)))
                for said in entries[-1]["differ"]:
                    print(f"{entries[-1]['file']}: {said}")
    for path in sorted((HERE / "packed").iterdir()):
        entries.append(dict(file=f"packed/{path.name}", same_as=packed(path)))
    for path in sorted(HERE.rglob("refused/*")):
        entries.append(dict(file=str(path.relative_to(HERE)), refused=True))
    text = "[\n"
    for at, entry in enumerate(entries):
        read = entry.pop("read", None)
        body = line(entry)[:-1]
        if read is not None:
            known = [{k: v for k, v in part.items() if v is not None} for part in read]
            body += ', "read": [\n' + ",\n".join("  " + line(part) for part in known) + "]"
        text += body + ("},\n" if at + 1 < len(entries) else "}\n")
    (HERE / "expected.json").write_text(text + "]\n")
    json.loads(text + "]")
    print(f"{len(entries)} files")


if __name__ == "__main__":
    main()
