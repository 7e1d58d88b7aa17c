#!/usr/bin/env python3
"""Decimate meshes at random, again and again, and say where something became worse.

    soak.py FOLDER --runs 2000 --seed 1 --decimate target/release/decimate

Each turn draws a mesh, a ratio, a tier, a quality, a number of threads, chunks, what becomes of attributes, and what may
happen to boundary and topology; then it runs the command twice, the second time in another tier and with another number
of threads, to OBJ files, in which no seam takes a copy of a vertex. Wrong is:

* a status other than 0, or a word of a panic; `--check` is on where the mesh has fewer triangles than --check-below,
* other bytes the second time,
* a file that does not hold what its report says, or fewer triangles than were asked for,
* an output with isolated vertices, or faces twice or without three corners,
* more non-manifold edges or vertices than before, a boundary on what was closed, faces that no longer can be turned to
  agree; and where the topology is to stay, another number of components, boundary loops or another Euler characteristic.

Before is the mesh as `--ratio 1` writes it: welded, cleaned, nothing collapsed. Exits with 1 where something was wrong,
with the command that shows it. Python alone.
"""
import argparse
import collections
import hashlib
import json
import pathlib
import random
import subprocess
import sys
import tempfile
import time

READ = {".ply", ".obj", ".stl", ".off", ".glb", ".gltf"}
TIERS = ("full", "medium", "small")
KEPT = ("components", "boundary_loops", "euler_characteristic", "is_orientable")


class Soak:
    def __init__(self, options, folder):
        self.options = options
        self.folder = pathlib.Path(folder)
        self.before = {}
        self.counts = collections.Counter()
        self.violations = []

    def call(self, *arguments):
        command = [str(word) for word in (self.options.decimate, *arguments)]
        return command, subprocess.run(command, capture_output=True, text=True, errors="replace")

    def info(self, path):
        command, done = self.call("info", "--json", "--no-weld", path)
        if done.returncode:
            self.violate(command, f"exit status {done.returncode}: {done.stderr.strip()}")
            return None
        return json.loads(done.stdout)

    def violate(self, command, what):
        self.violations.append((" ".join(command), what))
        print(f"WRONG: {what}\n  {' '.join(command)}", flush=True)

    def decimate(self, mesh, out, arguments):
        """The command, and its report, or nothing where it failed."""
        command, done = self.call(mesh, "-o", out, "--quiet", "--report", "-", *arguments)
        self.counts["decimations"] += 1
        if done.returncode or "panicked" in done.stderr:
            self.violate(command, f"exit status {done.returncode}: {done.stderr.strip()}")
            return command, None
        return command, json.loads(done.stdout)

    def start(self, mesh):
        """What is in a mesh before anything is collapsed."""
        if mesh not in self.before:
            out = self.folder / "before.obj"
            _, report = self.decimate(mesh, out, ["--ratio", "1"])
            self.before[mesh] = report and self.info(out)
        return self.before[mesh]

    def turn(self, rng, mesh):
        before = self.start(mesh)
        if before is None:
            return
        ratio = rng.choice([0.9, 0.5, 0.25, 0.1, 0.05, 0.02, 0.005, 0.0, rng.random(), rng.random() ** 4])
        topology = rng.choice(["preserve", "preserve", "preserve", "simplify"])
        arguments = ["--ratio", f"{ratio:.6f}", "--quality", rng.choice(["fast", "standard", "standard", "best"]),
                     "--chunks", rng.choice(["auto", "auto", "off", "500", "3000", "20000"]),
                     "--boundary", rng.choice(["keep", "keep", "keep", "lock", "free"]), "--topology", topology]
        if rng.random() < 0.2:
            arguments += ["--placement", "endpoint"]
        if rng.random() < 0.3:
            arguments += ["--attributes", rng.choice(["ignore", "carry"])]
        if rng.random() < 0.2:
            arguments += ["--feature-angle", str(rng.choice([20, 40, 60]))]
        if rng.random() < 0.1:
            arguments += ["--max-error", str(before["diagonal"] * 10 ** rng.uniform(-5, -1))]
        if before["triangles"] < self.options.check_below:
            arguments.append("--check")
            self.counts["checked"] += 1
        first, second = rng.sample(TIERS, 2)
        threads = rng.sample(range(1, 5), 2)
        out, again = self.folder / "out.obj", self.folder / "again.obj"
        command, report = self.decimate(mesh, out, [*arguments, "--tier", first, "--threads", str(threads[0])])
        other, twin = self.decimate(mesh, again, [*arguments, "--tier", second, "--threads", str(threads[1])])
        if report is None or twin is None:
            return
        self.counts["in chunks"] += report["chunks"] > 0
        self.counts[report["stop_reason"]] += 1
        digests = [hashlib.sha256(path.read_bytes()).hexdigest() for path in (out, again)]
        if digests[0] != digests[1]:
            self.violate(other, f"other bytes than with --tier {first} --threads {threads[0]}")
        after = self.info(out)
        if after is not None:
            for what in wrongs(before, after, report, topology):
                self.violate(command, what)


def wrongs(before, after, report, topology):
    """What is worse than before, or not what the report says."""
    for key, told in (("vertices", "vertices_out"), ("triangles", "triangles_out")):
        if after[key] != report[told]:
            yield f"{key}: {after[key]}, the report says {report[told]}"
    # A collapse removes two triangles, four where both are double-sided, more on a non-manifold edge.
    if after["triangles"] < report["target_triangles"] - 4 and before["non_manifold_edges"] == 0 \
            and topology == "preserve":
        yield f"{after['triangles']} triangles, {report['target_triangles']} were asked for"
    for key in ("dropped_non_finite_faces", "dropped_degenerate_faces", "dropped_duplicate_faces",
                "dropped_isolated_vertices"):
        if after[key] > 0:
            yield f"{key} of the output: {after[key]}"
    for key in ("non_manifold_edges", "non_manifold_vertices"):
        if after[key] > before[key]:
            yield f"{key}: {before[key]} -> {after[key]}"
    if before["boundary_edges"] == 0 and after["boundary_edges"] > 0:
        yield f"it was closed and has {after['boundary_edges']} boundary edges"
    if before["is_orientable"] and not after["is_orientable"]:
        yield "it was orientable and is not"
    if topology == "preserve":
        for key in KEPT:
            if after[key] != before[key]:
                yield f"{key}: {before[key]} -> {after[key]}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--runs", type=int, default=1000, metavar="N", help="turns, of two decimations each")
    parser.add_argument("--seconds", type=float, default=float("inf"), metavar="S", help="no turn begins after this")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--check-below", type=int, default=7000, metavar="N")
    parser.add_argument("--most-triangles", type=int, default=sys.maxsize, metavar="N",
                        help="meshes with more are left out")
    parser.add_argument("--decimate", default="target/release/decimate", metavar="BINARY")
    options = parser.parse_args()
    meshes = sorted(path for path in options.folder.iterdir() if path.suffix.lower() in READ)
    if not meshes:
        raise SystemExit(f"{options.folder}: no mesh in it")
    end = time.monotonic() + options.seconds
    turns = 0
    with tempfile.TemporaryDirectory() as folder:
        soak = Soak(options, folder)
        for turn in range(options.runs):
            if time.monotonic() > end:
                break
            # A turn depends on the seed and its number alone, so that it can be run again.
            rng = random.Random(f"{options.seed} {turn}")
            mesh = rng.choice(meshes)
            before = soak.start(mesh)
            if before is not None and before["triangles"] > options.most_triangles:
                continue
            soak.turn(rng, mesh)
            turns += 1
            if turns % 50 == 0:
                print(f"{turns} turns, {len(soak.violations)} violations", flush=True)
    counts = ", ".join(f"{key} {n}" for key, n in sorted(soak.counts.items()))
    print(f"\nseed {options.seed}: {turns} turns over {len(soak.before)} meshes, {counts}: "
          f"{len(soak.violations)} violations")
    return 1 if soak.violations else 0


if __name__ == "__main__":
    sys.exit(main())
