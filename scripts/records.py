#!/usr/bin/env python3
"""Measure our output against recorded results of other simplifiers.

    records.py RECORDS.csv MESH… --ratios 0.5 0.1 0.02

RECORDS.csv has the columns mesh, ratio_kept, tool, triangles, rms_of_diagonal. Our distance is the two-sided rms, the
root of the mean of both directions' squares, from samples on each surface to the nearest point of the other, as a
fraction of the mesh's bounding-box diagonal; measured by pymeshlab's Hausdorff filter, so that the ruler is not ours.
One line a case with the ratio to the best recorded tool whose triangle count is within 1 % of ours.
"""
import argparse
import csv
import math
import pathlib
import subprocess
import sys
import tempfile

import pymeshlab


def load(path):
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(str(path))
    meshes.meshing_remove_duplicate_vertices()
    meshes.meshing_remove_unreferenced_vertices()
    return meshes


def two_sided_rms(reference, output, samples):
    meshes = load(reference)
    meshes.load_new_mesh(str(output))
    diagonal = meshes.mesh(0).bounding_box().diagonal()
    squares = []
    for here, there in ((0, 1), (1, 0)):
        found = meshes.get_hausdorff_distance(
            sampledmesh=here, targetmesh=there, samplevert=False, sampleedge=False, sampleface=True, samplenum=samples,
            maxdist=pymeshlab.PercentageValue(100))
        squares.append((found["RMS"] / diagonal) ** 2)
    return math.sqrt(sum(squares) / 2)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("records", type=pathlib.Path, metavar="RECORDS.csv")
    parser.add_argument("meshes", nargs="+", type=pathlib.Path, metavar="MESH")
    parser.add_argument("--ratios", nargs="+", type=float, default=[0.5, 0.1, 0.02], metavar="R")
    parser.add_argument("--samples", type=int, default=200_000, metavar="N")
    parser.add_argument("--decimate", default="target/release/decimate", metavar="BINARY")
    options = parser.parse_args()
    with open(options.records, newline="") as file:
        records = list(csv.DictReader(file))
    print("| mesh | ratio | triangles | rms of diagonal | best recorded | by | ours / best |\n|---|---|---|---|---|---|---|")
    ratios = []
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "out.ply"
        for mesh in options.meshes:
            for ratio in options.ratios:
                subprocess.run([options.decimate, mesh, "-o", out, "--ratio", str(ratio), "--quiet"], check=True)
                rms = two_sided_rms(mesh, out, options.samples)
                meshes = pymeshlab.MeshSet(verbose=False)
                meshes.load_new_mesh(str(out))
                triangles = meshes.current_mesh().face_number()
                peers = [(float(r["rms_of_diagonal"]), r["tool"]) for r in records
                         if r["mesh"] == mesh.stem and float(r["ratio_kept"]) == ratio
                         and abs(int(r["triangles"]) - triangles) <= 0.01 * triangles]
                if not peers:
                    print(f"| {mesh.stem} | {ratio} | {triangles} | {rms:.4g} | - | - | - |", flush=True)
                    continue
                best, tool = min(peers)
                ratios.append(rms / best)
                print(f"| {mesh.stem} | {ratio} | {triangles} | {rms:.4g} | {best:.4g} | {tool} | {rms / best:.3f} |",
                      flush=True)
    if ratios:
        mean = math.exp(sum(map(math.log, ratios)) / len(ratios))
        print(f"\n{len(ratios)} cases: {sum(r <= 1 for r in ratios)} at or under 1.00, {sum(r > 1.05 for r in ratios)} "
              f"over 1.05, worst {max(ratios):.3f}, geometric mean {mean:.3f}")


if __name__ == "__main__":
    sys.exit(main())
