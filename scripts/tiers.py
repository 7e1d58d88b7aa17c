#!/usr/bin/env python3
"""Decimate meshes in every tier and say whether the bytes are the same and what became of the topology.

    tiers.py MESH… --ratios 0.5 0.1 0.02 --check-below 30000

One line a mesh and ratio: triangles in, asked, got, why it stopped, one checksum if the tiers agree, seconds a tier, and
the boundary edges, non-manifold edges and vertices before and after. Exits with 1 where tiers differ, or where a mesh
without non-manifold edges or vertices got one, or one without boundary got a boundary. Python alone.
"""
import argparse
import hashlib
import json
import pathlib
import subprocess
import sys
import tempfile

TIERS = ("full", "medium", "small")


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(map(str, command))}\n{done.stderr}")
    return json.loads(done.stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="+", type=pathlib.Path, metavar="MESH")
    parser.add_argument("--ratios", nargs="+", default=["0.5", "0.1", "0.02"], metavar="R")
    parser.add_argument("--check-below", type=int, default=0, metavar="N",
                        help="verify every invariant after every collapse where the mesh has fewer triangles")
    parser.add_argument("--decimate", default="target/release/decimate", metavar="BINARY")
    options = parser.parse_args()
    print("| mesh | in | ratio | asked | got | stopped | sha-256 | check | full s | medium s | small s "
          "| boundary edges | non-manifold edges | non-manifold vertices |")
    print("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|")
    failures = 0
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "out.ply"
        for mesh in options.meshes:
            before = run(options.decimate, "info", "--json", mesh)
            check = ["--check"] if before["triangles"] < options.check_below else []
            for ratio in options.ratios:
                reports, sums = [], set()
                for tier in TIERS:
                    reports.append(run(options.decimate, mesh, "-o", out, "--ratio", ratio, "--tier", tier, "--quiet",
                                       "--report", "-", *check))
                    sums.add(hashlib.sha256(out.read_bytes()).hexdigest()[:12])
                after = run(options.decimate, "info", "--json", out)
                keys = ("boundary_edges", "non_manifold_edges", "non_manifold_vertices")
                was_manifold = before["non_manifold_edges"] == 0 and before["non_manifold_vertices"] == 0
                is_worse = was_manifold and any(before[k] == 0 and after[k] > 0 for k in keys)
                is_off = len(sums) > 1 or is_worse
                failures += is_off
                report = reports[0]
                seconds = (f"{r['build_seconds'] + r['decimate_seconds']:.2f}" for r in reports)
                stopped = report["stop_reason"]
                if report["stopped_short"]:
                    stopped += " (" + ", ".join(f"{k} {n}" for k, n in report["blocked"].items() if n) + ")"
                print("|", " | ".join([
                    mesh.name, str(report["triangles_in"]), ratio, str(report["target_triangles"]),
                    str(report["triangles_out"]), stopped, " ≠ ".join(sorted(sums)), "yes" if check else "-", *seconds,
                    *(f"{before[k]} → {after[k]}" for k in keys)]), "|" + (" **WRONG**" if is_off else ""), flush=True)
    print(f"\n{failures} of {len(options.meshes) * len(options.ratios)} wrong", file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
