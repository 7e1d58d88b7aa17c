#!/usr/bin/env python3
"""Measure what becomes of colours, normals and texture coordinates, beside the simplifiers that carry them.

    attributes.py MESH… --ratios 0.5 0.1 0.02 --keep outputs --csv attributes.csv --json attributes.json
    report.py attributes.json -o attributes.html            the tables with pictures

Each tool is given the file, or its arrays with a vertex for each wedge, and told how many triangles to keep:

    decimate             attributes in the cost, the default
    decimate carry       attributes go along and cost nothing (--attributes carry)
    decimate ignore      positions alone: what the others' geometric error is held against
    meshoptimizer        simplifyWithUpdate, weights 0.5 for normals, 1 for colours and texture coordinates
    meshoptimizer-simplify  simplifyWithAttributes, the same weights; it leaves vertices where they are
    pymeshlab            meshing_decimation_quadric_edge_collapse_with_texture where there is a texture, else
                         meshing_decimation_quadric_edge_collapse, which carries colours
    vtk                  vtkQuadricDecimation with its attribute error metric, weights 0.1 as is its default

`decimate compare --attributes` judges all alike, against the file. rms and Hausdorff are two-sided, in 1e-4 of its
diagonal; attributes are compared at nearest points, both ways. "turned" are triangles that run the other way round in
the texture than the original's. An output with over 2 % more triangles than asked for does not compete.

Exits with 2 where a tool failed.
"""
import argparse
import csv
import json
import multiprocessing
import pathlib
import sys
import tempfile
import traceback

import numpy as np

import peers
import regress
from regress import EXTRA_TRIANGLES, RACE, ROOT, Failed, run

# As report.py has them: key, heading, factor, digits.
COLUMNS = [("triangles", "triangles", 1, 0), ("rms_of_diagonal", "rms", 1e4, 3),
           ("rms_to_ignore", "rms / positions alone", 1, 3), ("hausdorff_of_diagonal", "Hausdorff", 1e4, 2),
           ("normal_rms_degrees", "normals °", 1, 3),
           ("texture_coordinate_rms_texture_units", "texture 1e-3", 1e3, 3),
           ("texture_coordinate_mean_texture_units", "its mean 1e-3", 1e3, 3),
           ("color_rms_of_full_range", "colour 1e-3", 1e3, 3), ("new_boundary_edges", "new boundary", 1, 0),
           ("triangles_turned_against_reference", "turned", 1, 0),
           ("flipped_chart_triangles", "flipped in chart", 1, 0), ("lost_attributes", "attributes lost", 1, 0)]
ERRORS = ["normal_rms_degrees", "texture_coordinate_rms_texture_units", "color_rms_of_full_range"]
CSV_COLUMNS = ["mesh", "ratio_kept", "tool", *(c[0] for c in COLUMNS), "error"]
IGNORE = "decimate ignore"


class Ours:
    def __init__(self, use):
        self.tool = f"decimate {use}".removesuffix(" optimize")
        self.use = use

    def run(self, case, out, options):
        run(options.decimate, case["mesh"], "-o", out, "--triangles", case["target"], "--attributes", self.use, "--quiet",
            seconds=options.timeout)


class Meshoptimizer:
    def __init__(self, tool, method):
        self.tool, self.method = tool, method

    def run(self, case, out, options):
        run(RACE, "attributes", case["mesh"], case["target"], out, "--method", self.method, seconds=options.timeout)


class Python:
    """A peer that Python calls, in a process of its own: some of them end it."""

    def __init__(self, tool, call):
        self.tool, self.call = tool, call

    def run(self, case, out, options):
        context = multiprocessing.get_context("spawn")
        here, there = context.Pipe(duplex=False)
        process = context.Process(target=told, args=(there, self.call, case, out))
        process.start()
        there.close()
        process.join(options.timeout)
        if process.is_alive():
            process.kill()
            process.join()
            raise Failed(f"not done after {options.timeout} s")
        if process.exitcode:
            raise Failed(here.recv() if here.poll() else f"exit status {process.exitcode}")


def told(pipe, call, case, out):
    """Calls, and sends what went wrong."""
    try:
        call(case, out)
    except Exception as error:
        pipe.send(traceback.format_exception_only(error)[-1].strip())
        sys.exit(1)


def pymeshlab(case, out):
    import pymeshlab
    meshes = pymeshlab.MeshSet(verbose=False)
    # It reads what a file says of faces' corners; of formats that hold none the arrays do.
    has_texture = "texture_coordinate" in case["attributes"]
    meshes.load_new_mesh(str(case["mesh"] if has_texture else case["split"]))
    if has_texture:
        meshes.meshing_decimation_quadric_edge_collapse_with_texture(targetfacenum=case["target"])
        meshes.save_current_mesh(str(out), save_wedge_texcoord=True, save_vertex_normal=False, save_vertex_color=False,
                                 save_face_color=False)
    else:
        meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=case["target"])
        meshes.save_current_mesh(str(out), save_vertex_color=True, save_vertex_normal=False, save_face_color=False)


def vtk(case, out):
    import pyvista

    import render
    points, triangles, columns = render.read_ply(case["split"].read_bytes())
    mesh = pyvista.PolyData.from_regular_faces(np.array(points), np.array(triangles, dtype=np.int64))
    names = {"scalars": [n for n in (*render.COLOR, "alpha") if n in columns],
             "normals": [n for n in ("nx", "ny", "nz") if n in columns],
             "tcoords": next((pair for pair in render.TEXTURE if set(pair) <= columns.keys()), ())}
    rows = {what: np.stack([columns[n] for n in of], axis=1) for what, of in names.items() if of}
    if "scalars" in rows and rows["scalars"].dtype.kind == "u":
        rows["scalars"] = rows["scalars"] / np.iinfo(rows["scalars"].dtype).max
    data = mesh.GetPointData()
    for what, put in (("scalars", data.SetScalars), ("normals", data.SetNormals), ("tcoords", data.SetTCoords)):
        if what in rows:
            array = pyvista.convert_array(np.ascontiguousarray(rows[what], dtype=np.float32))
            array.SetName(what)
            put(array)
    out_mesh = mesh.decimate(1 - case["target"] / len(triangles), enable_all_attribute_error=True)
    columns = {}
    for what in rows:
        kept = np.asarray(out_mesh.point_data[what])
        columns |= {name: kept[:, k] for k, name in enumerate(names[what])}
    peers.write_ply(out, np.asarray(out_mesh.points), out_mesh.regular_faces, columns)


TOOLS = [Ours("optimize"), Ours("carry"), Ours("ignore"), Meshoptimizer("meshoptimizer", "update"),
         Meshoptimizer("meshoptimizer-simplify", "attributes"), Python("pymeshlab", pymeshlab), Python("vtk", vtk)]


def compare(case, file, options):
    said = run(options.decimate, "compare", case["mesh"], file, "--attributes", "--json", "--samples", options.samples)
    return json.loads(said)[0]


def judge(case, output, options):
    """Adds what `decimate compare --attributes` says."""
    result = compare(case, output["file"], options)
    output.update(regress.numbers(result))
    attributes = result["attributes"] or {"channels": [], "only_in_reference": []}
    for channel in attributes["channels"]:
        for key in ("rms", "mean", "max"):
            output[f"{channel['name']}_{key}_{channel['unit']}"] = channel["two_sided"][key]
    textures = [channel for channel in attributes["channels"] if "mesh_charts" in channel]
    if textures:
        output["triangles_turned_against_reference"] = sum(c["triangles_turned_against_reference"] for c in textures)
        output["flipped_chart_triangles"] = sum(c["mesh_flipped_chart_triangles"] for c in textures)
    output["lost_attributes"] = len(attributes["only_in_reference"])


def split(mesh, out):
    """The mesh with a vertex for each wedge as a PLY that render.py reads with its attributes."""
    run(RACE, "attributes", mesh, 2**30, out, "--method", "attributes")
    return out


def prepare(mesh, folder, options):
    """What all ratios of a mesh have in common."""
    case = {"mesh": mesh, "name": mesh.stem, "split": split(mesh, folder / f"{mesh.stem}-split.ply")}
    itself = compare(case, mesh, options)
    attributes = itself["attributes"] or {"channels": []}
    # The file without the faces that cleaning drops, and with all attributes.
    return case | {"triangles_in": itself["reference"]["kept_faces"],
                   "attributes": [channel["name"] for channel in attributes["channels"]]}


def run_case(case, folder, options):
    outputs = []
    for tool in options.tools:
        output = {"tool": tool.tool, "error": None, "file": None}
        outputs.append(output)
        stem = f"{case['name']}-{case['ratio']:g}-{tool.tool.replace(' ', '-')}"
        out = folder / f"{stem}.ply"
        try:
            tool.run(case, out, options)
            output["file"] = out
            judge(case, output, options)
            if options.json:
                output["file"] = split(out, folder / f"{stem}-split.ply")
        except Failed as failure:
            output["error"] = str(failure)
    alone = next((o.get("rms_of_diagonal") for o in outputs if o["tool"] == IGNORE), None)
    for output in outputs:
        if alone and alone > regress.EXACT and "rms_of_diagonal" in output:
            output["rms_to_ignore"] = output["rms_of_diagonal"] / alone
    return outputs


def print_case(case):
    shown = [c for c in COLUMNS if any(o.get(c[0]) is not None for o in case["outputs"])]
    print(f"\n**{case['name']}**, {case['triangles_in']} triangles, {case['ratio']:g} kept\n")
    print("| tool | " + " | ".join(c[1] for c in shown) + " |\n|---|" + "--:|" * len(shown))
    for output in case["outputs"]:
        if output["error"]:
            print(f"| {output['tool']} | failed: {output['error']} |" + " |" * (len(shown) - 1))
            continue
        cells = [regress.text(output.get(key), factor, digits) for key, _, factor, digits in shown]
        print(f"| {output['tool']} | " + " | ".join(cells) + " |")
    sys.stdout.flush()


def print_summary(cases):
    """Ours over the best peer that competes and has lost no attribute, per attribute."""
    print("\n**Ours over the best peer** (those with more than 2 % too many triangles or a lost attribute left out)\n")
    print("| mesh | kept | attribute | ours | best peer | which | ratio |\n|---|--:|---|--:|--:|---|--:|")
    for case in cases:
        rivals = [o for o in case["outputs"] if not o["tool"].startswith("decimate") and not o["error"]
                  and o["triangles"] <= case["target"] * EXTRA_TRIANGLES]
        ours = next((o for o in case["outputs"] if o["tool"] == "decimate" and not o["error"]), {})
        for key in ERRORS:
            best = min((o for o in rivals if o.get(key) is not None), key=lambda o: o[key], default=None)
            if ours.get(key) is None or best is None:
                continue
            ratio = f"{ours[key] / best[key]:.3f}" if best[key] > 0 else "–"
            print(f"| {case['name']} | {case['ratio']:g} | {key} | {ours[key]:.4g} | {best[key]:.4g} | {best['tool']} | "
                  f"{ratio} |")


def write_csv(cases, path):
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, CSV_COLUMNS, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        for case in cases:
            for output in case["outputs"]:
                short = {k: f"{v:.6g}" if isinstance(v, float) else v for k, v in output.items()}
                writer.writerow({**short, "mesh": case["name"], "ratio_kept": f"{case['ratio']:g}"})


def write_json(cases, path):
    """As report.py reads it: files are those with a vertex a wedge."""
    def place(file):
        return str(file.resolve()) if file else None

    plain = [{"mesh": place(c["mesh"]), "ratio": c["ratio"], "triangles_in": c["triangles_in"],
              "target_triangles": c["target"], "reference": place(c["split"]),
              "outputs": [{**o, "file": None if o["error"] else place(o["file"])} for o in c["outputs"]]} for c in cases]
    path.write_text(json.dumps({"cases": plain}, indent=1) + "\n")


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="+", type=pathlib.Path, metavar="MESH")
    parser.add_argument("--ratios", nargs="+", type=float, default=[0.5, 0.1, 0.02], metavar="R",
                        help="fractions of the triangles to keep (default 0.5 0.1 0.02)")
    names = [tool.tool for tool in TOOLS]
    parser.add_argument("--tools", nargs="+", default=names, choices=names, metavar="TOOL", help="default: all")
    parser.add_argument("--samples", type=int, default=200_000, metavar="N", help="on each surface (default 200000)")
    parser.add_argument("--timeout", type=float, default=600, metavar="SECONDS", help="for one run (default 600)")
    parser.add_argument("--csv", type=pathlib.Path, metavar="FILE")
    parser.add_argument("--json", type=pathlib.Path, metavar="FILE", help="for report.py; needs --keep")
    parser.add_argument("--keep", type=pathlib.Path, metavar="FOLDER", help="where outputs stay")
    parser.add_argument("--decimate", default=str(ROOT / "target/release/decimate"), metavar="BINARY")
    options = parser.parse_args()
    if options.json and not options.keep:
        parser.error("--json needs --keep, for the files it names")
    if not RACE.exists():
        parser.error(f"{RACE.relative_to(ROOT)} is not there; build it with "
                     "`cargo build --release --manifest-path scripts/race/Cargo.toml`")
    options.tools = [tool for tool in TOOLS if tool.tool in options.tools]
    return options


def main():
    options = parse()
    cases, failures = [], []
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep or pathlib.Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for mesh in options.meshes:
            try:
                common = prepare(mesh, folder, options)
            except Failed as failure:
                failures.append(f"{mesh}: {failure}")
                continue
            for ratio in options.ratios:
                case = common | {"ratio": ratio, "target": int(common["triangles_in"] * ratio)}
                case["outputs"] = run_case(case, folder, options)
                failures += [f"{mesh.name} {ratio:g}, {o['tool']}: {o['error']}" for o in case["outputs"] if o["error"]]
                cases.append(case)
                print_case(case)
        print_summary(cases)
        if options.csv:
            write_csv(cases, options.csv)
        if options.json:
            write_json(cases, options.json)
    print()
    for line in failures:
        print(f"failed: {line}")
    print(f"{len(cases)} cases, {len(failures)} failed")
    return 2 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
