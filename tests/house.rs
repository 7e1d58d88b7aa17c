//! The house keeps its plan: which room of `src/` may use which, and what lives in one room only.
//!
//! Reads the sources as tokens, so that comments and strings do not count; what is under
//! `#[cfg(test)]` may reach anywhere.

use std::fs;
use std::path::{Path, PathBuf};

use proc_macro2::{Delimiter, Group, TokenStream, TokenTree};

/// Every room, and the rooms that it may use beside itself. `main`, `cli` and `text` are the command, over
/// the library: they may use everything.
const ARROWS: [(&str, &[&str]); 13] = [
    ("progress", &[]),
    ("error", &["progress"]),
    ("attributes", &["error"]),
    ("indexed_mesh", &["error", "attributes"]),
    ("mesh", &["progress"]),
    ("nearest", &[]),
    ("spatial", &["progress"]),
    ("clean", &["error", "indexed_mesh", "progress", "spatial"]),
    ("io", &["error", "attributes", "indexed_mesh"]),
    (
        "decimate",
        &[
            "error",
            "attributes",
            "indexed_mesh",
            "clean",
            "mesh",
            "nearest",
            "progress",
            "spatial",
        ],
    ),
    (
        "metrics",
        &[
            "error",
            "attributes",
            "indexed_mesh",
            "clean",
            "mesh",
            "nearest",
        ],
    ),
    (
        "repair",
        &["error", "indexed_mesh", "clean", "mesh", "metrics"],
    ),
    ("structures", &["error", "indexed_mesh", "clean", "mesh"]),
];

/// The files of the command, outside of the library.
const COMMAND: [&str; 3] = ["main.rs", "cli.rs", "text.rs"];

/// Tests and their shapes: a file here is allowed everything, and its `mod` must be `cfg(test)`.
const TEST_FILES: [&str; 7] = [
    "shapes.rs",
    "io/gltf_tests.rs",
    "mesh/tests.rs",
    "mesh/modify_tests.rs",
    "decimate/tests.rs",
    "decimate/attribute_tests.rs",
    "structures/tests.rs",
];

/// A token and its line, brackets of groups among them.
struct Token {
    text: String,
    line: usize,
}

/// The tokens outside of comments and `#[cfg(test)]` items, in order.
///
/// Literals stand as `""`, so that no string is taken for code.
fn tokens_of(source: &str) -> Vec<Token> {
    let stream: TokenStream = source.parse().expect("the crate compiles, so it is Rust");
    let mut tokens = Vec::new();
    flatten(stream, &mut tokens);
    tokens
}

fn flatten(stream: TokenStream, to: &mut Vec<Token>) {
    let mut trees = stream.into_iter().peekable();
    while let Some(tree) = trees.next() {
        if is_punct(&tree, '#')
            && let Some(TokenTree::Group(attribute)) = trees.peek()
            && is_cfg_test(attribute)
        {
            // The item behind ends at its body or its semicolon, whichever comes first.
            let ends = |t: &TokenTree| is_punct(t, ';') || is_brace(t);
            trees.find(ends);
            continue;
        }
        let line = tree.span().start().line;
        match tree {
            TokenTree::Group(group) => {
                let (open, close) = match group.delimiter() {
                    Delimiter::Parenthesis => ("(", ")"),
                    Delimiter::Brace => ("{", "}"),
                    Delimiter::Bracket => ("[", "]"),
                    Delimiter::None => ("", ""),
                };
                to.push(Token {
                    text: open.into(),
                    line,
                });
                flatten(group.stream(), to);
                let line = group.span_close().start().line;
                to.push(Token {
                    text: close.into(),
                    line,
                });
            }
            TokenTree::Literal(literal) => {
                // Of a number the suffix is kept: `0.5f32` is a float.
                let text = literal.to_string();
                let is_number = text.starts_with(|c: char| c.is_ascii_digit());
                let text = if is_number { text } else { "\"\"".into() };
                to.push(Token { text, line });
            }
            other => to.push(Token {
                text: other.to_string(),
                line,
            }),
        }
    }
}

fn is_punct(tree: &TokenTree, c: char) -> bool {
    matches!(tree, TokenTree::Punct(p) if p.as_char() == c)
}

fn is_brace(tree: &TokenTree) -> bool {
    matches!(tree, TokenTree::Group(g) if g.delimiter() == Delimiter::Brace)
}

/// Whether an attribute's brackets hold `cfg(test)`.
fn is_cfg_test(attribute: &Group) -> bool {
    attribute.stream().to_string().replace(' ', "") == "cfg(test)"
}

/// The first names of a path's continuation at `i`: one of `a::b`, several of `{a::b, c}`.
fn first_names(tokens: &[Token], i: usize) -> Vec<&Token> {
    let Some(first) = tokens.get(i) else {
        return Vec::new();
    };
    if first.text != "{" {
        return vec![first];
    }
    let mut names = Vec::new();
    let mut depth = 0;
    for (j, token) in tokens.iter().enumerate().skip(i) {
        match token.text.as_str() {
            "{" => depth += 1,
            "}" => depth -= 1,
            _ if depth == 1 && matches!(tokens[j - 1].text.as_str(), "{" | ",") => {
                names.push(token);
            }
            _ => {}
        }
        if depth == 0 {
            break;
        }
    }
    names
}

/// How many modules deep the code of a file lies: `clean.rs` and `io/mod.rs` one, `io/ply.rs` two.
fn depth_of(file: &str) -> usize {
    let rooms = file.trim_end_matches(".rs").trim_end_matches("/mod");
    rooms.split('/').filter(|r| *r != "lib").count()
}

/// Every room at the crate's root that the code names, with the line: in `crate::room`,
/// `crate::{room, …}`, and `super::` repeated up to the root.
fn rooms_named(file: &str, tokens: &[Token]) -> Vec<(String, usize)> {
    let mut named = Vec::new();
    let mut depth = depth_of(file);
    let mut open_blocks: Vec<bool> = Vec::new();
    let is_path = |i: usize| {
        let colon = |i: usize| tokens.get(i).is_some_and(|t| t.text == ":");
        colon(i) && colon(i + 1)
    };
    for (i, token) in tokens.iter().enumerate() {
        match token.text.as_str() {
            // A module within the file is one deeper.
            "{" => {
                let is_module = i >= 2 && tokens[i - 2].text == "mod";
                depth += usize::from(is_module);
                open_blocks.push(is_module);
            }
            "}" => depth -= usize::from(open_blocks.pop() == Some(true)),
            "crate" if is_path(i + 1) => {
                let names = first_names(tokens, i + 3);
                named.extend(names.into_iter().map(|t| (t.text.clone(), t.line)));
            }
            "super" if i == 0 || tokens[i - 1].text != ":" => {
                let mut end = i;
                let mut up = 0;
                while tokens.get(end).is_some_and(|t| t.text == "super") && is_path(end + 1) {
                    end += 3;
                    up += 1;
                }
                if up >= depth {
                    let names = first_names(tokens, end);
                    named.extend(names.into_iter().map(|t| (t.text.clone(), t.line)));
                }
            }
            _ => {}
        }
    }
    named
}

/// The lines where the tokens of `pattern` (between blanks) stand one behind the other.
fn lines_with(tokens: &[Token], pattern: &str) -> Vec<usize> {
    let pattern: Vec<&str> = pattern.split(' ').collect();
    let is_there = |w: &&[Token]| w.iter().zip(&pattern).all(|(t, p)| t.text == *p);
    tokens
        .windows(pattern.len())
        .filter(is_there)
        .map(|w| w[0].line)
        .collect()
}

/// What is allowed in some files only: the tokens, where, and why.
struct Reserved {
    patterns: &'static [&'static str],
    is_at_home: fn(&str) -> bool,
    why: &'static str,
}

const RESERVED: [Reserved; 6] = [
    Reserved {
        patterns: &["f32", "f64", "glam"],
        is_at_home: |file| !file.starts_with("mesh/"),
        why: "mesh is connectivity: a float belongs in decimate",
    },
    Reserved {
        patterns: &["i32 : : MIN", "as i32", "as i64", "as isize"],
        is_at_home: |file| !file.starts_with("mesh/") || file == "mesh/link.rs",
        why: "only mesh/link.rs knows a sign",
    },
    Reserved {
        patterns: &[
            "match tier",
            "Tier : : Full = >",
            "Tier : : Medium = >",
            "Tier : : Small = >",
            "run : : <",
        ],
        is_at_home: |file| file == "decimate/mod.rs",
        why: "a tier is chosen once, in decimate/mod.rs",
    },
    Reserved {
        patterns: &["unsafe"],
        is_at_home: |_| false,
        why: "there is no unsafe code",
    },
    Reserved {
        patterns: &[
            "println !",
            "eprintln !",
            "print !",
            "eprint !",
            "process : : exit",
            "process : : abort",
        ],
        is_at_home: |file| file == "main.rs",
        why: "only main.rs prints and exits",
    },
    Reserved {
        patterns: &["dbg !", "todo !", "unimplemented !"],
        is_at_home: |_| false,
        why: "this is left over from work in progress",
    },
];

/// What is wrong with a file of `src/`, a line each.
fn wrongs(file: &str, source: &str) -> Vec<String> {
    if TEST_FILES.contains(&file) {
        return Vec::new();
    }
    let tokens = tokens_of(source);
    let room = file.split(['/', '.']).next().unwrap_or(file);
    let mut wrongs = Vec::new();
    if !COMMAND.contains(&file) && file != "lib.rs" {
        match ARROWS.iter().find(|(name, _)| *name == room) {
            None => wrongs.push(format!("{file}: the room {room} is not in the plan")),
            Some((_, may_use)) => {
                for (used, line) in rooms_named(file, &tokens) {
                    if used != room && !may_use.contains(&used.as_str()) {
                        wrongs.push(format!("{file}:{line}: {room} may not use {used}"));
                    }
                }
            }
        }
    }
    for reserved in RESERVED.iter().filter(|r| !(r.is_at_home)(file)) {
        for pattern in reserved.patterns {
            for line in lines_with(&tokens, pattern) {
                let found = pattern.replace(" : : ", "::").replace("= >", "=>");
                wrongs.push(format!("{file}:{line}: {found}: {}", reserved.why));
            }
        }
    }
    wrongs
}

fn rust_files(folder: &Path, to: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, to);
        } else if path.extension().is_some_and(|e| e == "rs") {
            to.push(path);
        }
    }
}

/// Every file of `src/` by its path there, with `/` on every system, and its text.
fn sources() -> Vec<(String, String)> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    rust_files(&src, &mut paths);
    paths.sort();
    let name = |path: &Path| {
        let parts = path.strip_prefix(&src).unwrap().iter();
        let parts: Vec<_> = parts.map(|part| part.to_str().unwrap()).collect();
        parts.join("/")
    };
    paths
        .iter()
        .map(|path| (name(path), fs::read_to_string(path).unwrap()))
        .collect()
}

#[test]
fn every_arrow_points_the_way_of_the_plan() {
    let sources = sources();
    assert!(sources.len() > 20, "only {} files found", sources.len());
    let wrongs: Vec<String> = sources
        .iter()
        .flat_map(|(file, source)| wrongs(file, source))
        .collect();
    assert!(wrongs.is_empty(), "\n{}", wrongs.join("\n"));
}

/// A room that nobody enters any more, or a test file that is gone, has no place in the plan.
#[test]
fn the_plan_names_what_is_there() {
    let sources = sources();
    let is_there = |name: &str| sources.iter().any(|(file, _)| file == name);
    for (room, _) in ARROWS {
        assert!(
            is_there(&format!("{room}.rs")) || is_there(&format!("{room}/mod.rs")),
            "{room} is in the plan, not in src"
        );
    }
    for file in COMMAND.iter().chain(&TEST_FILES) {
        assert!(is_there(file), "{file} is in the plan, not in src");
    }
}

/// A file that is excused as a test is compiled for tests only.
#[test]
fn test_files_are_declared_under_cfg_test() {
    let sources = sources();
    for file in TEST_FILES {
        let (parent, module) = match file.rsplit_once('/') {
            Some((folder, module)) => (format!("{folder}/mod.rs"), module),
            None => ("lib.rs".into(), file),
        };
        let (_, source) = sources.iter().find(|(name, _)| *name == parent).unwrap();
        let declaration = format!("mod {} ;", module.trim_end_matches(".rs"));
        assert!(
            lines_with(&tokens_of(source), &declaration).is_empty(),
            "{parent}: `{declaration}` is not under cfg(test)"
        );
    }
}

/// A check that cannot fail is none: each bad line is found, and by the rule that forbids it.
#[test]
fn bad_lines_are_found() {
    for (file, source, expected) in [
        (
            "io/ply.rs",
            "use crate::decimate::Options;",
            "io may not use decimate",
        ),
        (
            "io/ply.rs",
            "use crate::{error::Error, clean};",
            "io may not use clean",
        ),
        (
            "io/ply.rs",
            "use crate::{error::{Error, Place}, mesh::{Mesh, Tier}};",
            "io may not use mesh",
        ),
        (
            "io/ply.rs",
            "use super::super::metrics::info;",
            "io may not use metrics",
        ),
        (
            "io/ply.rs",
            "fn f() { crate::clean::clean(m, true); }",
            "io may not use clean",
        ),
        ("io/ply.rs", "use crate::*;", "io may not use *"),
        ("clean.rs", "use super::io;", "clean may not use io"),
        (
            "clean.rs",
            "mod inner { use super::super::mesh::Mesh; }",
            "clean may not use mesh",
        ),
        (
            "mesh/mod.rs",
            "use super::{error, mesh};",
            "mesh may not use error",
        ),
        (
            "mesh/ring.rs",
            "use crate::error::Result;",
            "mesh may not use error",
        ),
        (
            "mesh/store/full.rs",
            "use super::super::super::error;",
            "mesh may not use error",
        ),
        (
            "indexed_mesh.rs",
            "use crate::io::Format;",
            "indexed_mesh may not use io",
        ),
        (
            "error.rs",
            "use crate::mesh::EdgeId;",
            "error may not use mesh",
        ),
        (
            "metrics/info.rs",
            "use crate::decimate::Options;",
            "metrics may not use decimate",
        ),
        (
            "decimate/mod.rs",
            "use crate::metrics::Info;",
            "decimate may not use metrics",
        ),
        (
            "decimate/cost.rs",
            "use crate::shapes::grid;",
            "decimate may not use shapes",
        ),
        ("attic.rs", "", "the room attic is not in the plan"),
        (
            "mesh/ring.rs",
            "fn length(x: f32) {}",
            "mesh/ring.rs:1: f32",
        ),
        ("mesh/ring.rs", "\nuse glam::Vec3;", "mesh/ring.rs:2: glam"),
        ("mesh/build.rs", "const NONE: i32 = i32::MIN;", "i32::MIN"),
        (
            "mesh/build.rs",
            "fn f(e: u32) -> i32 { e as i32 }",
            "as i32",
        ),
        (
            "decimate/greedy.rs",
            "fn f() { match tier { _ => {} } }",
            "match tier",
        ),
        (
            "metrics/info.rs",
            "fn f() { match t { Tier::Full => a, _ => b } }",
            "Tier::Full =>",
        ),
        ("main.rs", "fn f() { run::<Full>(mesh) }", "run::<"),
        ("mesh/ring.rs", "fn f() { unsafe { g() } }", "unsafe"),
        ("io/mod.rs", "fn f() { println!(\"{x}\") }", "println !"),
        (
            "cli.rs",
            "fn f() { std::process::exit(2) }",
            "process::exit",
        ),
        ("decimate/mod.rs", "fn f() { dbg!(x); }", "dbg !"),
    ] {
        let found = wrongs(file, source);
        assert_eq!(found.len(), 1, "{file}: {source}: {found:?}");
        assert!(found[0].contains(expected), "{}, not {expected}", found[0]);
    }
}

#[test]
fn good_lines_are_left_alone() {
    for (file, source) in [
        (
            "main.rs",
            "use decimate::decimate::Options; fn f() { eprintln!(\"a\") }",
        ),
        (
            "io/ply.rs",
            "use crate::error::{Error, Place}; use super::input::Input;",
        ),
        (
            "io/ply.rs",
            "// use crate::mesh::Mesh;\n/// `unsafe`, `crate::mesh`\nfn f() {}",
        ),
        (
            "io/ply.rs",
            "const WORDS: &str = \"use crate::mesh; unsafe\";",
        ),
        ("clean.rs", "mod inner { use super::helper; }"),
        (
            "metrics/info.rs",
            "#[cfg(test)] mod tests { use crate::decimate::decimate; use crate::shapes; }",
        ),
        (
            "decimate/mod.rs",
            "fn f() { match tier { Tier::Full => run::<Full>() } }",
        ),
        ("mesh/link.rs", "const DEAD: i32 = i32::MIN;"),
        ("mesh/build.rs", "const MOST: usize = i32::MAX as usize;"),
        (
            "mesh/store/mod.rs",
            "fn f(self) { match self { Self::Full => 5 } }",
        ),
    ] {
        let found = wrongs(file, source);
        assert!(found.is_empty(), "{file}: {source}: {found:?}");
    }
}

/// What follows a `#[cfg(test)]` item is read again.
#[test]
fn only_the_item_under_cfg_test_is_excused() {
    for item in [
        "mod tests;",
        "mod tests { fn a() {} }",
        "#[test] fn a() -> [u8; 2] { [0; 2] }",
        "use a::{b, c};",
    ] {
        let source = format!("#[cfg(test)] {item} use crate::io::Format;");
        assert_eq!(wrongs("mesh/ring.rs", &source).len(), 1, "{source}");
    }
}
