#!/usr/bin/env python3
"""Measures how fast particle files are read, side by side with the libraries that others use.

    python3 benches/formats.py --planisphere target/release/planisphere
    python3 benches/formats.py --planisphere PATH --work FOLDER --out benches/results/formats.txt
    python3 benches/formats.py --quick              a hundredth of the size: does it run at all?
    python3 benches/formats.py --peers-only         without planisphere
    python3 benches/formats.py --only dump npz      of these rows only

The others: pip install numpy polars gemmi biopython. What is missing is skipped, loudly.

Inputs are made in the folder (2.5 GB at full size; default: one in the temporary folder) if they
are not there. Each row of the table is two ways of the same file, in turn (A, B, A, B ...), after
one round that does not count and brings the file into the page cache; medians of 5. planisphere is
timed as a whole process. Of a Python library only the read itself is timed, not its start or its
import. Peak memory is the largest resident set of the whole process, which holds mapped pages of
the input file too. Ratios are ours over theirs, of the medians.
"""

import argparse
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

MB = 1024 * 1024

# ------------------------------------------------------------------------------------- inputs


def six_digits(values):
    """Rounded to six significant digits, as LAMMPS writes (%g)."""
    import numpy as np

    digits = 5 - np.floor(np.log10(np.maximum(np.abs(values), 1e-30)))
    scale = 10.0 ** np.clip(digits, -10, 10)
    return np.round(values * scale) / scale


def dump_frame(file, rng, step, count):
    """One frame of a dump; the text after its header is what polars reads as CSV."""
    import numpy as np
    import polars

    file.write(f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{count}\n"
               "ITEM: BOX BOUNDS pp pp pp\n-50 50\n-50 50\n-50 50\n"
               "ITEM: ATOMS id type x y z\n".encode())
    at = six_digits(rng.uniform(-50, 50, (count, 3)))
    table = polars.DataFrame({"id": np.arange(1, count + 1), "type": rng.integers(1, 5, count),
                              "x": at[:, 0], "y": at[:, 1], "z": at[:, 2]})
    table.write_csv(file, include_header=False, separator=" ")


def make_dump(path, count):
    import numpy as np

    with open(path, "wb") as file:
        dump_frame(file, np.random.default_rng(1), 0, count)


def make_frames(path, count):
    import numpy as np

    rng = np.random.default_rng(2)
    with open(path, "wb") as file:
        for step in range(1000):
            dump_frame(file, rng, step, count)


CHAINS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789"


def waters(count):
    """Number, name, element, chain, residue and position of each atom."""
    import numpy as np

    at = np.random.default_rng(3).uniform(-99, 99, (count, 3))
    for i, (x, y, z) in enumerate(at.tolist()):
        name = ("O", "H1", "H2")[i % 3]
        chain, residue = divmod(i // 3, 9999)
        yield i, name, name[0], CHAINS[chain], residue + 1, x, y, z


def make_pdb(path, count):
    with open(path, "w") as file:
        for i, name, element, chain, residue, x, y, z in waters(count):
            serial = (i + 1) % 100000
            file.write(f"HETATM{serial:5d}  {name:<3} HOH {chain}{residue:4d}    {x:8.3f}{y:8.3f}"
                       f"{z:8.3f}  1.00 20.00           {element}  \n")
        file.write("END\n")


COLUMNS = ("group_PDB id type_symbol label_atom_id label_alt_id label_comp_id label_asym_id "
           "label_entity_id label_seq_id pdbx_PDB_ins_code Cartn_x Cartn_y Cartn_z occupancy "
           "B_iso_or_equiv pdbx_formal_charge auth_seq_id auth_comp_id auth_asym_id auth_atom_id "
           "pdbx_PDB_model_num").split()


def make_cif(path, count):
    with open(path, "w") as file:
        file.write("data_waters\n#\nloop_\n")
        file.write("".join(f"_atom_site.{column}\n" for column in COLUMNS))
        for i, name, element, chain, residue, x, y, z in waters(count):
            file.write(f"HETATM {i + 1} {element} {name} . HOH {chain} 1 . ? {x:.3f} {y:.3f} "
                       f"{z:.3f} 1.00 20.00 ? {residue} HOH {chain} {name} 1\n")
        file.write("#\n")


def numbers(count, kind):
    import numpy as np

    rng = np.random.default_rng(4)
    centers = rng.uniform(-50, 50, (count, 3)).astype("f4").astype(kind)
    radii = rng.uniform(0.05, 0.2, count).astype("f4").astype(kind)
    return centers, radii, rng.integers(0, 256, (count, 3), dtype=np.uint8)


def make_ply(path, count):
    import numpy as np

    centers, radii, colors = numbers(count, "f4")
    names = ["red", "green", "blue"]
    rows = np.empty(count, [(a, "<f4") for a in "xyz"] + [(c, "u1") for c in names]
                    + [("radius", "<f4")])
    for axis in range(3):
        rows["xyz"[axis]] = centers[:, axis]
        rows[names[axis]] = colors[:, axis]
    rows["radius"] = radii
    with open(path, "wb") as file:
        file.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n".encode())
        file.write(b"".join(b"property float %c\n" % a for a in b"xyz"))
        file.write(b"".join(f"property uchar {c}\n".encode() for c in names))
        file.write(b"property float radius\nend_header\n")
        rows.tofile(file)


def make_npz(path, count):
    import numpy as np

    centers, radii, colors = numbers(count, "f8")
    np.savez(path, centers=centers, radii=radii, colors=colors)


def make_scene(path, count, kind):
    """The same numbers as a scene file with arrays."""
    import numpy as np

    for name, array in zip(("c", "r", "col"), numbers(count, kind)):
        np.save(path.with_name(f"{path.stem}-{name}.npy"), array)
    path.write_text(f'[[spheres]]\ncenters = "{path.stem}-c.npy"\nradii = "{path.stem}-r.npy"\n'
                    f'colors = "{path.stem}-col.npy"\n')


def inputs(folder, part):
    """The paths of the inputs, and how each is made."""
    many, atoms, frame = int(1e7 * part), int(1e6 * part), max(int(1e4 * part), 10)
    return {"dump": ("big.dump", lambda p: make_dump(p, many)),
            "pdb": ("big.pdb", lambda p: make_pdb(p, atoms)),
            "cif": ("big.cif", lambda p: make_cif(p, atoms)),
            "ply": ("big.ply", lambda p: make_ply(p, many)),
            "npz": ("big.npz", lambda p: make_npz(p, many)),
            "scene-f4": ("scene-f4.toml", lambda p: make_scene(p, many, "f4")),
            "scene-f8": ("scene-f8.toml", lambda p: make_scene(p, many, "f8")),
            "frames": ("frames.dump", lambda p: make_frames(p, frame))}


def made(folder, part, names):
    """The inputs. Each is made by another process: what a process needed before it starts another
    counts as the other's peak memory, so this one has to stay small."""
    paths = {}
    for name in names:
        paths[name] = folder / inputs(folder, part)[name][0]
        if not paths[name].exists():
            start = time.perf_counter()
            subprocess.run([sys.executable, __file__, "--make", name, str(paths[name]), str(part)],
                           check=True)
            size = paths[name].stat().st_size
            print(f"made {paths[name].name}: {size / 1e6:.0f} MB, "
                  f"{time.perf_counter() - start:.0f} s")
    return paths


def make(name, path, part):
    """One input: under its name only when it is whole."""
    path = Path(path)
    write = inputs(path.parent, float(part))[name][1]
    if name.startswith("scene"):
        write(path)  # its arrays are named after it, and it is written last
        return
    unfinished = path.with_name("unfinished-" + path.name)
    write(unfinished)
    unfinished.rename(path)


# ------------------------------------------------------------------------------------- peers

# Programs in Python; each prints the seconds of the read and how many it found.
PEERS = {
    "polars.read_csv": ("polars", """
table = polars.read_csv(path, separator=" ", has_header=False, skip_rows=9)
count = table.height"""),
    "gemmi.read_pdb": ("gemmi", """
structure = gemmi.read_pdb(path)
count = structure[0].count_atom_sites()"""),
    "gemmi.read_structure": ("gemmi", """
structure = gemmi.read_structure(path)
count = structure[0].count_atom_sites()"""),
    "Bio.PDB.PDBParser": ("Bio.PDB", """
structure = Bio.PDB.PDBParser(QUIET=True).get_structure("x", path)
count = sum(1 for _ in structure.get_atoms())"""),
    "Bio.PDB.FastMMCIFParser": ("Bio.PDB", """
structure = Bio.PDB.FastMMCIFParser(QUIET=True).get_structure("x", path)
count = sum(1 for _ in structure.get_atoms())"""),
}


def has(module):
    found = subprocess.run([sys.executable, "-c", f"import {module}"], capture_output=True)
    return found.returncode == 0


class Way:
    """One way to read a file: wall seconds and peak bytes of each run."""

    def __init__(self, label, command, reports_itself, out=None):
        self.label, self.command, self.reports_itself = label, command, reports_itself
        self.seconds, self.peaks, self.out = [], [], out

    def run(self, counts):
        start = time.perf_counter()
        process = subprocess.Popen(self.command, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   cwd=self.out)
        output = process.stdout.read().decode()
        complaint = process.stderr.read().decode()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        wall = time.perf_counter() - start
        if process.returncode != 0:
            raise RuntimeError(f"{self.label} fails: {complaint.strip().splitlines()[-1:]}")
        if counts:
            self.seconds.append(float(output.split()[0]) if self.reports_itself else wall)
            self.peaks.append(usage.ru_maxrss * 1024)

    def median(self):
        return statistics.median(self.seconds)

    def peak(self):
        return max(self.peaks)


def peer(name, path):
    module, code = PEERS[name]
    program = f"""
import sys, time, {module}
path = sys.argv[1]
start = time.perf_counter()
{code}
print(time.perf_counter() - start, count)"""
    return Way(name, [sys.executable, "-W", "ignore", "-c", program, str(path)], True)


def ours(program, folder, label, *arguments):
    return Way(label, [program, *map(str, arguments)], False, out=folder)


# ------------------------------------------------------------------------------------- table


def rows(paths, program, folder, part):
    """Title, our way, the other way, limit of the ratio, bytes of the arrays that are read."""
    convert = lambda name, *more: ours(program, folder, f"convert {paths[name].name}", "convert",
                                       paths[name], *more, "--to", "none")
    render = lambda name, *more: ours(program, folder, f"render {paths[name].name}", "render",
                                      paths[name], *more, "-o", "none", "--ids", "ids.npy")
    many, atoms = 1e7 * part, 1e6 * part
    table = {
        "dump": lambda: [(convert("dump"), peer("polars.read_csv", paths["dump"]), 1.0,
                          many * (24 + 8 + 4))],
        "pdb": lambda: [(convert("pdb"), peer("gemmi.read_pdb", paths["pdb"]), None, atoms * 28),
                        (convert("pdb"), peer("Bio.PDB.PDBParser", paths["pdb"]), 0.1,
                         atoms * 28)],
        "cif": lambda: [(convert("cif"), peer("gemmi.read_structure", paths["cif"]), None,
                         atoms * 28),
                        (convert("cif"), peer("Bio.PDB.FastMMCIFParser", paths["cif"]), 0.1,
                         atoms * 28)],
        "ply": lambda: [(render("ply"), render("scene-f4"), 1.3, many * (12 + 4 + 3))],
        "npz": lambda: [(render("npz"), render("scene-f8"), 1.3, many * (24 + 8 + 3))],
        "frames": lambda: [(render("frames", "--frame", 900),
                            convert("frames", "--frames", "0.."), 0.15, 1e4 * part * 36)]}
    return table


NEEDS = {"dump": ["dump"], "pdb": ["pdb"], "cif": ["cif"], "ply": ["ply", "scene-f4"],
         "npz": ["npz", "scene-f8"], "frames": ["frames"]}


def measure(ways, runs, report):
    """All ways in turn; the round before the first does not count."""
    for round_ in range(runs + 1):
        for way in list(ways):
            try:
                way.run(round_ > 0)
            except RuntimeError as error:
                report.append(f"*** SKIPPED: {error} ***")
                ways.remove(way)


def line(way, other, limit, arrays):
    text = f"{way.label:24} {way.median():9.3f} s {way.peak() / MB:8.0f} MB"
    text += f"   {other.label:24} {other.median():9.3f} s {other.peak() / MB:8.0f} MB"
    ratio = way.median() / other.median()
    said = "" if limit is None else f" (limit {limit})" + ("" if ratio <= limit else " TOO SLOW")
    over = way.peak() / MB - arrays / MB
    return (text + f"   ratio {ratio:.3f}{said}"
            f"   peak {over:.0f} MB above its arrays" + ("" if over <= 256 else " (limit 256)"))


def machine():
    model = ""
    if Path("/proc/cpuinfo").exists():
        names = [l for l in Path("/proc/cpuinfo").read_text().splitlines() if "model name" in l]
        model = names[0].split(":")[1].strip() if names else ""
    load = ", ".join(f"{x:.2f}" for x in os.getloadavg())
    return (f"{time.strftime('%d %B %Y')}, {platform.system()} {platform.machine()}, {model}, "
            f"{os.cpu_count()} cores (load average: {load})")


def versions():
    from importlib import metadata

    found = []
    for package in ("numpy", "polars", "gemmi", "biopython"):
        try:
            found.append(f"{package} {metadata.version(package)}")
        except metadata.PackageNotFoundError:
            found.append(f"no {package}")
    return ", ".join(found)


def arguments():
    read = argparse.ArgumentParser(description=__doc__,
                                   formatter_class=argparse.RawDescriptionHelpFormatter)
    read.add_argument("--planisphere", type=Path, default=Path("target/release/planisphere"))
    read.add_argument("--work", type=Path,
                      default=Path(tempfile.gettempdir()) / "planisphere-formats")
    read.add_argument("--out", type=Path)
    read.add_argument("--runs", type=int)
    read.add_argument("--quick", action="store_true")
    read.add_argument("--peers-only", action="store_true")
    read.add_argument("--only", nargs="+", choices=list(NEEDS), default=list(NEEDS))
    return read.parse_args()


def main():
    asked = arguments()
    part = 0.01 if asked.quick else 1.0
    runs = asked.runs or (3 if asked.quick else 5)
    folder = asked.work / ("quick" if asked.quick else "full")
    folder.mkdir(parents=True, exist_ok=True)
    program = str(asked.planisphere.resolve())
    only = [n for n in asked.only if not (asked.peers_only and n in ("ply", "npz", "frames"))]
    paths = made(folder, part, dict.fromkeys(n for row in only for n in NEEDS[row]))
    report = [f"benches/formats.py, {machine()}", versions(),
              f"medians of {runs}; whole processes, but reads alone of Python libraries", ""]
    for name in only:
        for way, other, limit, arrays in rows(paths, program, folder, part)[name]():
            module = PEERS[other.label][0] if other.label in PEERS else "sys"
            if not has(module):
                report.append(f"*** SKIPPED: {other.label}: there is no {module} ***")
                continue
            ways = [other] if asked.peers_only else [way, other]
            measure(ways, runs, report)
            if len(ways) == 2:
                report.append(line(way, other, limit, arrays))
            elif ways == [other]:
                report.append(f"{other.label:24} {other.median():9.3f} s "
                              f"{other.peak() / MB:8.0f} MB")
    text = "\n".join(report) + "\n"
    print(text)
    if asked.out:
        asked.out.parent.mkdir(parents=True, exist_ok=True)
        asked.out.write_text(text)
    return 1 if any(bad in text for bad in ("TOO SLOW", "(limit 256)", "SKIPPED")) else 0


if __name__ == "__main__":
    if sys.argv[1:2] == ["--make"]:
        make(*sys.argv[2:])
    else:
        sys.exit(main())
