#!/usr/bin/env python3
"""Measure our output beside that of other simplifiers, and say whether it got worse than it was.

    regress.py MESH… --ratios 0.5 0.1 0.02 --json results.json --keep outputs
    regress.py --quick                     data/sample.ply alone, two peers, one run: under a minute

Each mesh is read and welded once by `decimate --ratio 1`; what comes out is the reference and everyone's input. Each
run is a process of its own, the runs take turns, seconds and MB are medians:

* seconds  without reading and writing: of ours as its report says, of a peer its call alone (see peers.py and race/);
* MB       10^6 bytes above the input arrays: of ours the peak of the whole command less 12 bytes a vertex and a
           triangle (its program and the file it reads are in there), of a peer what its call adds to the peak.

`decimate compare` judges all outputs alike. rms and Hausdorff are two-sided, in 1e-4 of the reference's diagonal. × is
the ratio to the best of the case; an output with over 2 % more triangles than asked for does not compete.

Exits with 1 where ours has another count of triangles than data/expected.csv says, is over its bounds, or differs among
runs or tiers; only the meshes beside that file are in it. Exits with 2 where a tool failed on a mesh.
"""
import argparse
import csv
import hashlib
import importlib.metadata
import itertools
import json
import math
import pathlib
import statistics
import subprocess
import sys
import tempfile
import tomllib

import numpy as np

import peers

ROOT = pathlib.Path(__file__).resolve().parent.parent
RACE = ROOT / "scripts/race/target/release/race"
DEFAULT_PEERS = ["fast-simplification", "pymeshlab", "vtk", "meshoptimizer"]
QUICK = {"meshes": [ROOT / "data/sample.ply"], "ratios": [0.5, 0.1], "peers": DEFAULT_PEERS[:2], "runs": 1,
         "qualities": ["fast", "standard", "best"]}
EXTRA_TRIANGLES = 1.02  # above this multiple of the target an output does not compete
RMS_MARGIN, HAUSDORFF_MARGIN = 1.03, 1.10  # of the bounds above what was measured
EXACT = 1e-9  # of the diagonal; below it a distance is rounding
RECORDED_TOLERANCE = 0.02
# Name in records.csv and here. meshoptimizer's result depends on the order of the vertices, which is not on record:
# shuffled meshes leave 1.87e-3 to 2.18e-3 of rms on rocker-arm at 0.02, where the record says 1.99e-3.
RECORDED_AS = ({"fast": "fast-simplification", "meshopt": "meshoptimizer"}
               | {name: name for name in ("pymeshlab", "pymeshlab-tuned", "vtk")})
# Key, heading, factor, digits, and whether a column with the ratio to the best follows.
COLUMNS = [("triangles", "triangles", 1, 0, False), ("rms_of_diagonal", "rms", 1e4, 3, True),
           ("hausdorff_of_diagonal", "Hausdorff", 1e4, 2, True),
           ("normal_deviation_mean_degrees", "normals °", 1, 2, False),
           ("triangle_quality_mean", "quality", 1, 3, False), ("new_boundary_edges", "new boundary", 1, 0, False),
           ("new_non_manifold_edges", "new non-manifold", 1, 0, False), ("seconds", "s", 1, 3, True),
           ("megabytes", "MB", 1, 1, True)]
RATED = [c for c in COLUMNS if c[4]]
EXPECTED_COLUMNS = ["mesh", "ratio", "quality", "triangles_out", "rms_of_diagonal_max", "hausdorff_of_diagonal_max"]
# The first ten as in records.csv.
CSV_COLUMNS = ["mesh", "ratio_kept", "tool", "triangles", "rms_of_diagonal", "mean_of_diagonal",
               "hausdorff_of_diagonal", "mean_triangle_quality", "boundary_edges", "non_manifold_edges",
               "normal_deviation_mean_degrees", "new_boundary_edges", "new_non_manifold_edges", "seconds", "megabytes",
               "error"]


class Failed(Exception):
    """A tool that did not do its work, with the last line it said."""


def run(*command, seconds=None):
    command = [str(word) for word in command]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=seconds)
    except subprocess.TimeoutExpired as expired:
        raise Failed(f"not done after {seconds} s") from expired
    if done.returncode:
        raise Failed((done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1])
    return done.stdout


def load_ply(path):
    """Points and triangles of a binary PLY as our command writes it."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:end].decode()
    count = {words[1]: int(words[2]) for line in header.splitlines() if (words := line.split())[0] == "element"}
    kind = "<f8" if "property double x" in header else "<f4"
    points = np.frombuffer(data, kind, 3 * count["vertex"], end).reshape(-1, 3)
    faces = np.frombuffer(data, [("count", "u1"), ("corners", "<i4", 3)], count["face"], end + points.nbytes)
    assert (faces["count"] == 3).all() and end + points.nbytes + faces.nbytes == len(data), f"{path}: unknown layout"
    return points, np.ascontiguousarray(faces["corners"])


def arrays(decimate, mesh, folder):
    """Welds the mesh, writes its arrays for the peers; the welded file and the count of its triangles."""
    welded = folder / f"{mesh.stem}-welded.ply"
    run(decimate, mesh, "-o", welded, "--ratio", "1", "--attributes", "ignore", "--quiet")
    points, triangles = load_ply(welded)
    np.save(folder / "points.npy", points)
    np.save(folder / "triangles.npy", triangles)
    return welded, len(triangles)


class Ours:
    def __init__(self, binary, quality, tier):
        self.tool = "decimate " + " ".join(word for word in (quality, tier) if word)
        self.quality = quality or "standard"
        self.command = [binary, "--tier", tier, "--quiet", "--report", "-"]
        if quality:
            self.command += ["--quality", quality]

    def run(self, case, out, seconds):
        said = run(*self.command, case["reference"], "-o", out, "--ratio", case["ratio"], seconds=seconds)
        report = json.loads(said)
        arrays_bytes = 12 * (report["vertices_in"] + report["triangles_in"])
        return {"seconds": sum(v for k, v in report.items()
                               if k.endswith("_seconds") and k not in ("read_seconds", "write_seconds")),
                "megabytes": (report["peak_rss_bytes"] - arrays_bytes) / 1e6}


class Peer:
    def __init__(self, name):
        self.tool = name

    def run(self, case, out, seconds):
        folder = case["folder"]
        return json.loads(run(sys.executable, ROOT / "scripts/peers.py", self.tool, folder / "points.npy",
                              folder / "triangles.npy", case["target"], out, seconds=seconds))

    def version(self):
        return importlib.metadata.version(peers.PACKAGES.get(self.tool, self.tool))


class Meshoptimizer:
    """Its simplifyWithUpdate, which only C++ and Rust have."""

    tool = "meshoptimizer"

    def run(self, case, out, seconds):
        return json.loads(run(RACE, "simplify", case["reference"], case["target"], out, seconds=seconds))

    def version(self):
        locked = tomllib.loads((ROOT / "scripts/race/Cargo.lock").read_text())["package"]
        return "crate meshopt " + next(p["version"] for p in locked if p["name"] == "meshopt")


def race(case, contestants, options):
    """Runs everyone in turns; one dictionary per tool, with its output file or its error, and its file's hashes."""
    outputs = []
    for contestant in contestants:
        out = case["folder"] / f"{case['name']}-{case['ratio']:g}-{contestant.tool.replace(' ', '-')}.ply"
        outputs.append({"tool": contestant.tool, "file": out, "hashes": set(), "runs": [], "error": None})
    for _ in range(options.runs):
        for contestant, output in zip(contestants, outputs):
            if output["error"]:
                continue
            try:
                output["runs"].append(contestant.run(case, output["file"], options.timeout))
                output["hashes"].add(hashlib.sha256(output["file"].read_bytes()).hexdigest())
            except Failed as failure:
                output["error"] = str(failure)
    for output in outputs:
        runs = output.pop("runs")
        if not output["error"]:
            for key in ("seconds", "megabytes"):
                output[key] = statistics.median(r[key] for r in runs)
                output[f"{key}_of_runs"] = [r[key] for r in runs]
    return outputs


def compare(options, reference, files):
    return json.loads(run(options.decimate, "compare", reference, *files, "--json", "--samples", options.samples))


def numbers(result):
    """What counts of what `decimate compare` says."""
    distance = result["surface"]["two_sided_of_diagonal"]
    keys = ("normal_deviation_mean_degrees", "normal_deviation_99th_percentile_degrees", "triangle_quality_mean",
            "sliver_share", "new_boundary_edges", "new_non_manifold_edges", "new_non_manifold_vertices")
    return {"triangles": result["mesh"]["triangles"], "rms_of_diagonal": distance["rms"],
            "mean_of_diagonal": distance["mean"], "hausdorff_of_diagonal": distance["max"],
            "boundary_edges": result["mesh"]["boundary_edges"],
            "non_manifold_edges": result["mesh"]["non_manifold_edges"],
            "inconsistent_edges": result["mesh"]["inconsistent_edges"], **{key: result[key] for key in keys}}


def judge(case, outputs, options):
    """Adds what `decimate compare` says; files of the same bytes are compared once, in one call for all."""
    files = {}
    for output in outputs:
        if not output["error"]:
            files.setdefault(min(output["hashes"]), output["file"])
    try:
        found = dict(zip(files, compare(options, case["reference"], files.values())))
    except Failed:
        # One that cannot be measured fails the call: each alone then.
        found = {}
        for key, file in files.items():
            try:
                found[key] = compare(options, case["reference"], [file])[0]
            except Failed as failure:
                found[key] = str(failure)
    for output in outputs:
        if output["error"]:
            continue
        result = found[min(output["hashes"])]
        if isinstance(result, str):
            output["error"] = result
            continue
        output.update(numbers(result))
        case["found_in"] = result["reference"]


def recorded_outputs(case, outputs, records):
    """The tools in the records that did not run here, as far as this case is there."""
    here = {o["tool"] for o in outputs}
    return [{"tool": f"{r['tool']} (recorded)", "error": None, "file": None, "triangles": int(r["triangles"]),
             "rms_of_diagonal": float(r["rms_of_diagonal"]), "mean_of_diagonal": float(r["mean_of_diagonal"]),
             "hausdorff_of_diagonal": float(r["hausdorff_of_diagonal"]),
             "triangle_quality_mean": float(r["mean_triangle_quality"]),
             "boundary_edges": int(r["boundary_edges"]), "non_manifold_edges": int(r["non_manifold_edges"])}
            for r in records if r["mesh"] == case["name"] and float(r["ratio_kept"]) == case["ratio"]
            and RECORDED_AS.get(r["tool"]) not in here]


def competes(output, case):
    return not output["error"] and output["triangles"] <= case["target"] * EXTRA_TRIANGLES


def rate(case):
    """Adds to each output its ratios to the best; none where the best is exact, or the output does not compete."""
    for key, *_ in RATED:
        values = [o[key] for o in case["outputs"] if competes(o, case) and o.get(key) is not None]
        best = min(values, default=0)
        for output in case["outputs"]:
            is_rated = competes(output, case) and output.get(key) is not None and best > EXACT
            output.setdefault("to_best", {})[key] = output[key] / best if is_rated else None


def text(value, factor=1, digits=2):
    return "–" if value is None else f"{value * factor:.{digits}f}"


def print_case(case):
    print(f"\n**{case['name']}**, {case['triangles_in']} triangles, {case['ratio']:g} kept\n")
    headings = [word for column in COLUMNS for word in ([column[1], "×"] if column[4] else [column[1]])]
    print("| tool | " + " | ".join(headings) + " |\n|---|" + "--:|" * len(headings))
    for output in case["outputs"]:
        if output["error"]:
            print(f"| {output['tool']} | failed: {output['error']} |" + " |" * (len(headings) - 1))
            continue
        cells = []
        for key, _, factor, digits, is_rated in COLUMNS:
            cells.append(text(output.get(key), factor, digits))
            if is_rated:
                cells.append(text(output["to_best"][key]))
        print(f"| {output['tool']} | " + " | ".join(cells) + " |")
    sys.stdout.flush()


def geometric_mean(values):
    return math.exp(sum(map(math.log, values)) / len(values)) if values else None


def print_means(cases, ours):
    """Per tool its mean ratio to the best; then ours beside the best of the peers, where it can be under 1."""
    tools = list(dict.fromkeys(o["tool"] for case in cases for o in case["outputs"]))
    print(f"\n**Geometric means of the ratios to the best**, {len(cases)} cases (in brackets: those that count, if "
          "fewer)\n")
    print("| tool | " + " | ".join(c[1] for c in RATED) + " |\n|---|" + "--:|" * len(RATED))
    for tool in tools:
        cells = []
        for key, *_ in RATED:
            values = [v for case in cases for o in case["outputs"] if o["tool"] == tool
                      and (v := o.get("to_best", {}).get(key)) is not None and v > 0]
            cells.append(text(geometric_mean(values)) + (f" ({len(values)})" if 0 < len(values) < len(cases) else ""))
        print(f"| {tool} | " + " | ".join(cells) + " |")
    print("\n**Ours over the best peer**: geometric mean, worst\n")
    print("| tool | " + " | ".join(c[1] for c in RATED) + " |\n|---|" + "--:|" * len(RATED))
    for tool in ours:
        cells = []
        for key, *_ in RATED:
            ratios = []
            for case in cases:
                mine = [o[key] for o in case["outputs"] if o["tool"] == tool and competes(o, case)]
                others = [o[key] for o in case["outputs"] if o["tool"] not in ours and competes(o, case) and o.get(key)]
                if mine and others and min(others) > EXACT and mine[0] > 0:
                    ratios.append(mine[0] / min(others))
            cells.append(f"{geometric_mean(ratios):.2f}, {max(ratios):.2f}" if ratios else "–")
        print(f"| {tool} | " + " | ".join(cells) + " |")


def print_harm(cases):
    """Per tool, on closed manifold inputs whose faces agree, the runs whose output is not so."""
    kinds = ["non_manifold_edges", "boundary_edges", "inconsistent_edges"]
    clean = [case for case in cases if (found := case.get("found_in")) and found["is_orientable"] and not any(
        found[key] for key in ("boundary_edges", "non_manifold_edges", "non_manifold_vertices", "inconsistent_edges"))]
    print(f"\n**Runs that harm a clean mesh**, {len(clean)} cases; most edges of the kind in a run in brackets\n\n"
          "| tool | runs | non-manifold edges | boundary edges | faces against their neighbours |\n|---|--:|--:|--:|--:|")
    for tool in dict.fromkeys(o["tool"] for case in clean for o in case["outputs"]):
        outputs = [o for case in clean for o in case["outputs"] if o["tool"] == tool and not o["error"]]
        cells = []
        for kind in kinds:
            counts = [o[kind] for o in outputs if kind in o]
            harmed = [count for count in counts if count]
            cells.append("–" if not counts else f"{len(harmed)} ({max(harmed)})" if harmed else "0")
        print(f"| {tool} | {len(outputs)} | " + " | ".join(cells) + " |")


def print_recorded(cases, records):
    """Whether the peers' rms is the recorded one."""
    lines = []
    recorded_rms = {(r["mesh"], float(r["ratio_kept"]), RECORDED_AS.get(r["tool"])): r for r in records}
    for case in cases:
        for output in case["outputs"]:
            if r := recorded_rms.get((case["name"], case["ratio"], output["tool"])):
                if not output["error"]:
                    found, recorded = output["rms_of_diagonal"], float(r["rms_of_diagonal"])
                    remark = " **off**" if abs(found / recorded - 1) > RECORDED_TOLERANCE else ""
                    lines.append(f"| {case['name']} | {case['ratio']:g} | {output['tool']} | {found:.4g} | "
                                 f"{recorded:.4g} | {found / recorded:.3f}{remark} |")
    print("\n**Peers' rms of the diagonal beside the recorded**\n\n| mesh | kept | tool | rms | recorded | ratio |\n"
          "|---|--:|---|--:|--:|--:|\n" + "\n".join(lines))


def read_csv(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def read_expected(path):
    return {(r["mesh"], float(r["ratio"]), r["quality"]): r for r in read_csv(path)} if path.exists() else {}


def of_quality(case, ours, quality):
    """The outputs of ours in one quality, whatever the tier."""
    tools = [o.tool for o in ours if o.quality == quality]
    return [o for o in case["outputs"] if o["tool"] in tools and not o["error"]]


def check(cases, ours, options):
    """What is wrong with ours, and remarks, as lines; the cases whose mesh lies beside expected.csv."""
    wrong, remarks = [], []
    expected = read_expected(options.expected)
    for case, quality in itertools.product(cases, dict.fromkeys(o.quality for o in ours)):
        where = f"{case['file_name']} {case['ratio']:g} {quality}"
        outputs = of_quality(case, ours, quality)
        if len({h for o in outputs for h in o["hashes"]}) > 1:
            wrong.append(f"{where}: the bytes differ among tiers or runs")
        if not case["is_expected"] or not outputs:
            continue
        row = expected.get((case["file_name"], case["ratio"], quality))
        if row is None:
            remarks.append(f"{where}: not in {options.expected}; --write-expected adds it")
            continue
        for output in outputs:
            if output["triangles"] != int(row["triangles_out"]):
                wrong.append(f"{where}, {output['tool']}: {output['triangles']} triangles, "
                             f"expected {row['triangles_out']}")
            for key in ("rms_of_diagonal", "hausdorff_of_diagonal"):
                bound = float(row[f"{key}_max"])
                if output[key] > bound:
                    wrong.append(f"{where}, {output['tool']}: {key} is {output[key]:.4g}, over its bound {bound:.4g}")
                elif max(output[key], EXACT) * 3 < bound:
                    remarks.append(f"{where}, {output['tool']}: {key} is {output[key]:.4g}; the bound {bound:.4g} can "
                                   "be tightened threefold")
    return wrong, remarks


def round_up(value):
    """To four digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 3)
    return f"{math.ceil(value / unit - 1e-6) * unit:.4g}"


def write_expected(cases, ours, path):
    """Replaces the rows of these cases, and leaves the others."""
    rows = read_expected(path)
    for case, quality in itertools.product(cases, dict.fromkeys(o.quality for o in ours)):
        output = next(iter(of_quality(case, ours, quality)), None)
        if case["is_expected"] and output:
            rows[case["file_name"], case["ratio"], quality] = {
                "mesh": case["file_name"], "ratio": f"{case['ratio']:g}", "quality": quality,
                "triangles_out": output["triangles"],
                "rms_of_diagonal_max": round_up(max(output["rms_of_diagonal"] * RMS_MARGIN, EXACT)),
                "hausdorff_of_diagonal_max": round_up(max(output["hausdorff_of_diagonal"] * HAUSDORFF_MARGIN, EXACT))}
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, EXPECTED_COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(row for _, row in sorted(rows.items(), key=lambda item: (item[0][0], -item[0][1], item[0][2])))


def write_csv(cases, path):
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, CSV_COLUMNS, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        for case in cases:
            for output in case["outputs"]:
                writer.writerow({**output, "mesh": case["name"], "ratio_kept": f"{case['ratio']:g}",
                                 "mean_triangle_quality": output.get("triangle_quality_mean")})


def write_json(cases, others, options):
    """With the files' names only where they are kept."""
    versions = {"decimate": run(options.decimate, "--version").split()[-1]} | {o.tool: o.version() for o in others}
    plain = []
    for case in cases:
        outputs = []
        for output in case["outputs"]:
            file = str(output["file"].resolve()) if options.keep and output["file"] and not output["error"] else None
            outputs.append({**{k: v for k, v in output.items() if k != "hashes"}, "file": file})
        plain.append({"mesh": str(case["mesh"].resolve()), "ratio": case["ratio"], "triangles_in": case["triangles_in"],
                      "target_triangles": case["target"],
                      "reference": str(case["reference"].resolve()) if options.keep else None, "outputs": outputs})
    result = {"samples": options.samples, "runs": options.runs, "versions": versions, "cases": plain}
    options.json.write_text(json.dumps(result, indent=1) + "\n")


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="*", type=pathlib.Path, metavar="MESH")
    parser.add_argument("--ratios", nargs="+", type=float, default=[0.5, 0.1, 0.02], metavar="R",
                        help="fractions of the triangles to keep (default 0.5 0.1 0.02)")
    parser.add_argument("--tiers", nargs="+", default=["full"], choices=["auto", "full", "medium", "small"])
    parser.add_argument("--qualities", nargs="+", default=[None], metavar="Q",
                        help="values of our --quality, where the command has one (default: none is given)")
    known = [*peers.PEERS, Meshoptimizer.tool]
    parser.add_argument("--peers", nargs="*", default=DEFAULT_PEERS, choices=known, metavar="PEER",
                        help=f"of {', '.join(known)} (default: {' '.join(DEFAULT_PEERS)})")
    parser.add_argument("--runs", type=int, default=3, metavar="N")
    parser.add_argument("--quick", action="store_true", help="data/sample.ply at 0.5 and 0.1 in every quality, two peers, one run")
    parser.add_argument("--samples", type=int, default=200_000, metavar="N", help="on each surface (default 200000)")
    parser.add_argument("--timeout", type=float, default=600, metavar="SECONDS", help="for one run (default 600)")
    parser.add_argument("--records", type=pathlib.Path, metavar="RECORDS.csv",
                        help="recorded results of tools: stand in for those that do not run here, check those that do")
    parser.add_argument("--csv", type=pathlib.Path, metavar="FILE")
    parser.add_argument("--json", type=pathlib.Path, metavar="FILE", help="for report.py, which needs --keep, too")
    parser.add_argument("--keep", type=pathlib.Path, metavar="FOLDER", help="where outputs and references stay")
    parser.add_argument("--expected", type=pathlib.Path, default=ROOT / "data/expected.csv", metavar="FILE")
    parser.add_argument("--write-expected", action="store_true", help="write that file instead of checking against it")
    parser.add_argument("--decimate", default=str(ROOT / "target/release/decimate"), metavar="BINARY")
    options = parser.parse_args()
    if options.quick:
        vars(options).update(QUICK)
    if not options.meshes:
        parser.error("no MESH, nor --quick")
    if Meshoptimizer.tool in options.peers and not RACE.exists():
        parser.error(f"the peer meshoptimizer needs {RACE.relative_to(ROOT)}; build it with "
                     "`cargo build --release --manifest-path scripts/race/Cargo.toml`, or give --peers without it")
    if options.runs < 1:
        parser.error("--runs: at least 1")
    return options


def main():
    options = parse()
    records = read_csv(options.records) if options.records else []
    ours = [Ours(options.decimate, quality, tier) for quality in options.qualities for tier in options.tiers]
    others = [Meshoptimizer() if name == Meshoptimizer.tool else Peer(name) for name in options.peers]
    contestants = ours + others
    cases, failures = [], []
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep or pathlib.Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for mesh in options.meshes:
            try:
                reference, triangles_in = arrays(options.decimate, mesh, folder)
            except Failed as failure:
                failures.append(f"{mesh}: {failure}")
                continue
            for ratio in options.ratios:
                case = {"mesh": mesh, "name": mesh.stem, "file_name": mesh.name, "folder": folder,
                        "reference": reference, "ratio": ratio, "triangles_in": triangles_in,
                        "target": int(triangles_in * ratio),
                        "is_expected": mesh.resolve().parent == options.expected.resolve().parent}
                case["outputs"] = race(case, contestants, options)
                judge(case, case["outputs"], options)
                failures += [f"{mesh.name} {ratio:g}, {o['tool']}: {o['error']}" for o in case["outputs"] if o["error"]]
                case["outputs"] += recorded_outputs(case, case["outputs"], records)
                rate(case)
                cases.append(case)
                print_case(case)
            for name in ("points.npy", "triangles.npy"):
                (folder / name).unlink()
        if cases:
            print_means(cases, [o.tool for o in ours])
            print_harm(cases)
        if records:
            print_recorded(cases, records)
        if options.csv:
            write_csv(cases, options.csv)
        if options.json:
            write_json(cases, others, options)
    wrong, remarks = [], []
    if options.write_expected:
        write_expected(cases, ours, options.expected)
    else:
        wrong, remarks = check(cases, ours, options)
    print()
    for line in remarks:
        print(f"remark: {line}")
    for line in failures:
        print(f"failed: {line}")
    for line in wrong:
        print(f"WRONG: {line}")
    print(f"{len(cases)} cases, {len(wrong)} wrong, {len(failures)} failed")
    return 1 if wrong else 2 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
