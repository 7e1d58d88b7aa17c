#!/usr/bin/env python3
"""Time whole commands on one mesh: ours in each tier, fast-simplification and pymeshlab.

    race.py MESH --ratio 0.1 --runs 3

Each run is a process of its own that reads the mesh, decimates it and writes a PLY; runs take turns. Prints the median
wall-clock seconds and the median of the peak memory (the system's own figure; on Linux and macOS), and their ratios to
ours in the full tier. fast-simplification has no reader: its process reads and writes through pymeshlab.
"""
import argparse
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

FAST = """
import sys, numpy, pymeshlab, fast_simplification
source, target, ratio = sys.argv[1], sys.argv[2], float(sys.argv[3])
meshes = pymeshlab.MeshSet(verbose=False); meshes.load_new_mesh(source); mesh = meshes.current_mesh()
points, faces = mesh.vertex_matrix().astype('float32'), mesh.face_matrix().astype('int32')
points, faces = fast_simplification.simplify(points, faces, 1 - ratio)
meshes.clear(); meshes.add_mesh(pymeshlab.Mesh(points.astype('float64'), faces)); meshes.save_current_mesh(target)
"""
PYMESHLAB = """
import sys, pymeshlab
source, target, ratio = sys.argv[1], sys.argv[2], float(sys.argv[3])
meshes = pymeshlab.MeshSet(verbose=False); meshes.load_new_mesh(source)
faces = int(meshes.current_mesh().face_number() * ratio)
meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=faces); meshes.save_current_mesh(target)
"""


def measure(command):
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - start
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{command[:2]} failed with {process.returncode}")
    kibibytes = usage.ru_maxrss / (1024 if sys.platform == "darwin" else 1)
    return seconds, kibibytes * 1024 / 1e6


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("mesh")
    parser.add_argument("--ratio", default="0.1")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--decimate", default="target/release/decimate", metavar="BINARY")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        out = str(pathlib.Path(folder) / "out.ply")
        contestants = {
            f"decimate, {tier}": [options.decimate, options.mesh, "-o", out, "--ratio", options.ratio, "--tier", tier,
                                  "--quiet"] for tier in ("full", "medium", "small")}
        contestants["fast-simplification"] = [sys.executable, "-c", FAST, options.mesh, out, options.ratio]
        contestants["pymeshlab"] = [sys.executable, "-c", PYMESHLAB, options.mesh, out, options.ratio]
        runs = {name: [] for name in contestants}
        for _ in range(options.runs):
            for name, command in contestants.items():
                runs[name].append(measure(command))
    medians = {name: [statistics.median(column) for column in zip(*found)] for name, found in runs.items()}
    base_seconds, base_megabytes = medians["decimate, full"]
    print("| | seconds | MB at peak | time to ours | memory to ours |\n|---|---|---|---|---|")
    for name, (seconds, megabytes) in medians.items():
        print(f"| {name} | {seconds:.2f} | {megabytes:.0f} | {seconds / base_seconds:.2f} | "
              f"{megabytes / base_megabytes:.2f} |")


if __name__ == "__main__":
    sys.exit(main())
