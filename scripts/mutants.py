#!/usr/bin/env python3
"""Break the library on purpose, in one place at a time, and say which tests notice.

    mutants.py                  all of them
    mutants.py 9 10 --tests lib cases

All breaks are built into one copy of the last commit, each behind a switch that the environment turns on, so that there
is one build and not one for each. Exits with 1 where no test notices a break, or one fails without any.
"""
import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
TESTS = ["lib", "cases", "properties", "golden"]
SWITCH = """
/// Whether this break is on.
pub(crate) fn mutant(number: u32) -> bool {
    static ON: std::sync::LazyLock<u32> = std::sync::LazyLock::new(|| std::env::var("MUTANT").map_or(0, |n| n.parse().unwrap()));
    *ON == number
}
"""
# What breaks, the file in src/, what stands there once, and what then does; ON says whether the break is on.
MUTANTS = [
    ("link condition: other common neighbours allowed", "mesh/collapse.rs",
     "!self.has_other_common_neighbour(u, v, &apexes) &&", "(ON || !self.has_other_common_neighbour(u, v, &apexes)) &&"),
    ("link condition between disks: the same", "mesh/disk.rs", "!is_common &&", "(ON || !is_common) &&"),
    ("link condition between disks: a tetrahedron collapses", "mesh/disk.rs", "&& !is_tetrahedron", "&& (ON || !is_tetrahedron)"),
    ("link condition: a common edge across allowed", "mesh/collapse.rs",
     "&& !self.has_common_link_edge(u, v, &star)", "&& (ON || !self.has_common_link_edge(u, v, &star))"),
    ("collapse: a mate not linked back", "mesh/collapse.rs",
     "self.set_opposite(a, Opposite::Edge(b));", "if !ON { self.set_opposite(a, Opposite::Edge(b)); }"),
    ("collapse: the wrong mate", "mesh/collapse.rs", "(behind, b, Opposite::Edge(a))",
     "(behind, b, Opposite::Edge(if ON { self.next(a) } else { a }))"),
    ("collapse: a row of the side table keeps a dead edge", "mesh/collapse.rs",
     "self.edge_rows.replace(row, dying, survivor);", "if !ON { self.edge_rows.replace(row, dying, survivor); }"),
    ("collapse: a row of the side table not freed", "mesh/collapse.rs",
     "self.edge_rows.remove(row);", "if !ON { self.edge_rows.remove(row); }"),
    ("collapse: the outgoing edge of an apex not updated", "mesh/collapse.rs",
     "self.replace_fan(apex, before, leaving);", "if !ON { self.replace_fan(apex, before, leaving); }"),
    ("collapse: the outgoing edge of the merged vertex not updated", "mesh/disk.rs",
     "self.set_outgoing(kept, Outgoing::Fan(first));", "if !ON { self.set_outgoing(kept, Outgoing::Fan(first)); }"),
    ("faces may turn over", "decimate/rules.rs", "(!(turns & stays & had_shape).any())",
     "(ON || !(turns & stays & had_shape).any())"),
    ("tensors not rebuilt", "decimate/cost/memoryless.rs", "&mut self.tensors[x.index()], now[i - first])",
     "&mut self.tensors[x.index()], if ON { Tensor { left: 0, ..Tensor::default() } } else { now[i - first] })"),
    ("the volume may change", "decimate/cost/memoryless.rs", "T::choose(is_constrained, x[i] + direction[i] * step, x[i])",
     "T::choose(is_constrained, x[i] + direction[i] * (if ON { T::splat(0.0) } else { step }), x[i])"),
    ("faces twice not found", "clean.rs", ".chunk_by(|a, b| a.0 == b.0)\n                .filter(|same| same.len() > 1)",
     ".chunk_by(|a, b| a.0 == b.0)\n                .filter(|same| same.len() > 1 && !ON)"),
    ("opposite faces dropped and not folded", "clean.rs", "if !folded && (", "if !ON && !folded && ("),
    ("the last face dropped", "clean.rs", "t[1] != t[2] && t[2] != t[0];",
     "t[1] != t[2] && t[2] != t[0] && !(ON && i + 1 == triangles.len());"),
    ("-0 and 0 not welded", "clean.rs", "positions[a as usize] == positions[b as usize]",
     "positions[a as usize] == positions[b as usize] && !(ON && positions[a as usize].x == 0.0)"),
    ("heap: nothing is ever out of date", "decimate/queue.rs",
     "self.current[e.index()] |= OUT_OF_DATE;", "if !ON { self.current[e.index()] |= OUT_OF_DATE; }"),
    ("buckets: nothing is ever out of date", "decimate/queue.rs",
     "self.places[e.index()] |= OUT_OF_DATE_MARK;", "if !ON { self.places[e.index()] |= OUT_OF_DATE_MARK; }"),
    ("chunks: own vertices on a seam may collapse", "decimate/chunked.rs",
     "v >= own || cut.is_shared(begin + v)", "v >= own || (!ON && cut.is_shared(begin + v))"),
    ("chunks: no care of the target", "decimate/chunked.rs", "triangles: least + MOST_AT_ONCE",
     "triangles: if ON { 0 } else { least + MOST_AT_ONCE }"),
    ("chunks: boundaries on a seam not weighed", "decimate/chunked.rs", "for (v, line) in &lines {",
     "for (v, line) in lines.iter().filter(|_| !ON) {"),
    ("chunks: the error so far forgotten", "decimate/chunked.rs", "flat.deviation[v] = kept.deviation;",
     "flat.deviation[v] = if ON { 0.0 } else { kept.deviation };"),
    ("faces that were turned stay so", "decimate/mod.rs",
     "turn_round(&mut triangles, &turned);", "if !ON { turn_round(&mut triangles, &turned); }"),
    ("one collapse beyond the target", "decimate/greedy.rs", "if self.triangles <= stop.triangles {",
     "if self.triangles < stop.triangles + usize::from(!ON) {"),
    ("a locked vertex loses its lock", "decimate/surface.rs",
     "if self.is_locked(collapse.removed) {", "if !ON && self.is_locked(collapse.removed) {"),
    ("the error so far forgotten", "decimate/surface.rs", "Some(deviation + moved?)",
     "Some(if ON { moved? } else { deviation + moved? })"),
    ("creases do not hold", "decimate/greedy.rs", "if keeps_topology && self.surface.curves.stay_apart(mesh, e)",
     "if keeps_topology && (ON || self.surface.curves.stay_apart(mesh, e))"),
    ("curves not counted", "decimate/curves.rs", "self.counts[collapse.kept.index()] = merging.count;",
     "if !ON { self.counts[collapse.kept.index()] = merging.count; }"),
    ("vertices may leave the box", "decimate/geometry.rs", "p.cmpge(self.min).all() && p.cmple(self.max).all()",
     "ON || p.cmpge(self.min).all() && p.cmple(self.max).all()"),
    ("attribute seams may be crossed", "decimate/surface.rs",
     "AttributeUse::Optimize => wedges.is_seam(mesh, e) ||", "AttributeUse::Optimize => !ON && wedges.is_seam(mesh, e) ||"),
    ("texture triangles may turn over", "decimate/wedges.rs",
     "before == 0.0 || before * after > 0.0", "ON || before == 0.0 || before * after > 0.0"),
    ("corners keep the wedge that they had", "decimate/wedges.rs",
     "self.at[e.index()] = wedge_of(self.at[e.index()]);", "if !ON { self.at[e.index()] = wedge_of(self.at[e.index()]); }"),
    ("attributes around a merged vertex not summed again", "decimate/cost/attributes.rs",
     "for &v in vertices {", "for &v in vertices.iter().filter(|_| !ON) {"),
]


def apply(folder):
    for number, (name, file, old, new) in enumerate(MUTANTS, 1):
        path = folder / "src" / file
        source = path.read_text()
        if source.count(old) != 1:
            sys.exit(f"{number} ({name}): stands in {file} {source.count(old)} times: {old}")
        path.write_text(source.replace(old, re.sub(r"\bON\b", f"crate::mutant({number})", new)))
    with open(folder / "src/lib.rs", "a") as file:
        file.write(SWITCH)


def build(folder, tests):
    flags = [word for test in tests for word in (["--lib"] if test == "lib" else ["--test", test])]
    done = subprocess.run(["cargo", "test", "--no-run", "--locked", "--message-format", "json", *flags], cwd=folder,
                          stdout=subprocess.PIPE, text=True, check=True)
    found = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    found = [m for m in found if m.get("executable")]
    return {"lib" if "lib" in m["target"]["kind"] else m["target"]["name"]: m["executable"] for m in found}


def failures(folder, binary, number, only, seconds):
    """The tests that fail while the break is on."""
    try:
        done = subprocess.run([binary, only], cwd=folder, env=os.environ | {"MUTANT": str(number)}, capture_output=True,
                              text=True, errors="replace", timeout=seconds)
    except subprocess.TimeoutExpired:
        return ["(does not end)"]
    failed = re.findall(r"^test (\S+).* FAILED$", done.stdout, re.M)
    return failed or ([f"(exit status {done.returncode})"] if done.returncode else [])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("numbers", nargs="*", type=int, metavar="NUMBER")
    parser.add_argument("--tests", nargs="+", default=TESTS, choices=TESTS)
    parser.add_argument("--only", default="", metavar="WORD", help="run the tests whose name has it")
    parser.add_argument("--timeout", type=float, default=600, metavar="SECONDS", help="for one test program (default 600)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, stdout=subprocess.PIPE, check=True)
        subprocess.run(["tar", "x", "-C", folder], input=archive.stdout, check=True)
        apply(folder)
        binaries = build(folder, options.tests)
        print("| | broken | noticed by |\n|--:|---|---|", flush=True)
        is_wrong = False
        for number in [0, *(options.numbers or range(1, len(MUTANTS) + 1))]:
            noticed = {test: failures(folder, binaries[test], number, options.only, options.timeout) for test in options.tests}
            is_wrong |= any(noticed.values()) == (number == 0)
            cells = [f"{test}: {len(failed)} ({failed[0].split('::')[-1]})" for test, failed in noticed.items() if failed]
            print(f"| {number} | {MUTANTS[number - 1][0] if number else 'nothing'} | {', '.join(cells) or '–'} |", flush=True)
    return int(is_wrong)


if __name__ == "__main__":
    sys.exit(main())
