"""What looks cost, against flat pictures of one sample a pixel: whole processes, by their time on
the processor, in turn.

    cargo build --release
    python3 benches/looks.py > benches/results/looks.txt

Scenes are clouds of `planisphere make cloud` at 1024 x 1024, and the same with all radii such that
a sphere has 30 and 10 pixels. Pictures are QOI, which takes little time to write.
"""

import pathlib
import platform
import resource
import statistics
import struct
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "target" / "release" / "planisphere"
RUNS = 9
LOOKS = [
    ["--look", "matte", "--aa", "1"],
    ["--outline", "1"],
    ["--aa", "2"],
    ["--aa", "4"],
    ["--aa", "8"],
    ["--look", "matte"],
    ["--look", "illustrative"],
    ["--look", "soft"],
]


def radii(path, count, radius):
    """An array of one radius, as NumPy writes it."""
    head = "{'descr': '<f4', 'fortran_order': False, 'shape': (%d,), }" % count
    head += " " * (63 - (10 + len(head)) % 64) + "\n"
    body = struct.pack("<f", radius) * count
    path.write_bytes(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode() + body)


def processor(command):
    """Milliseconds on the processor, of all threads."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return 1e3 * (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def main():
    print(f"{RUNS} runs each, alternating; medians; {platform.machine()}, Python "
          f"{platform.python_version()}")
    print(f"{'scene':<10} {'look':<28} {'flat ms':>8} {'ms':>8} {'ratio':>6}")
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for count in (10_000, 100_000, 1_000_000):
            subprocess.run([PROGRAM, "make", "cloud", folder / f"{count}", "--count", str(count)],
                           check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            for pixels, radius in ((None, None), (30, 0.0513), (10, 0.0171)):
                if radius is not None:
                    radii(folder / f"{count}" / "radii.npy", count, radius)
                scene = folder / f"{count}" / "scene.toml"
                name = f"{count:.0e}".replace("+0", "") + (f" {pixels} px" if pixels else "")
                common = [PROGRAM, "render", scene, "--size", "1024x1024", "--device", "cpu",
                          "-o", folder / "out.qoi"]
                for look in LOOKS:
                    pairs = [(processor(common), processor(common + look)) for _ in range(RUNS)]
                    flat, other = (statistics.median(times) for times in zip(*pairs))
                    words = " ".join(look).replace("--", "")
                    print(f"{name:<10} {words:<28} {flat:8.1f} {other:8.1f} {other / flat:6.2f}",
                          flush=True)


if __name__ == "__main__":
    main()
