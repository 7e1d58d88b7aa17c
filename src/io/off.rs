//! OFF as text: a keyword, counts, vertices, faces; colours and normals behind them are skipped.

use crate::error::{Error, Result};
use crate::indexed_mesh::MeshBuilder;

use super::input::Input;
use super::text::{Lines, parse_integer, parse_number, quote, words_before_comment};

/// The first words of a file whose vertices begin with x, y, z.
const KEYWORDS: [&str; 6] = ["OFF", "COFF", "NOFF", "CNOFF", "STOFF", "STCNOFF"];

/// Whether a file begins with one of the keywords, behind comments and blank lines.
pub(super) fn is_off(head: &[u8]) -> bool {
    let mut lines = head.split(|&b| b == b'\n' || b == b'\r');
    lines
        .find_map(|line| words_before_comment(line).next())
        .is_some_and(is_keyword)
}

fn is_keyword(word: &[u8]) -> bool {
    KEYWORDS
        .iter()
        .any(|keyword| word.eq_ignore_ascii_case(keyword.as_bytes()))
}

/// Reads an OFF file into a mesh. A face of one or two corners is none.
pub(super) fn read(input: Input, builder: &mut MeshBuilder) -> Result<()> {
    let mut lines = Lines::new(input)?;
    let [vertices, faces] = read_counts(&mut lines)?;
    for i in 0..vertices {
        if !advance(&mut lines)? {
            return Err(missing(&lines, i, vertices, "vertices"));
        }
        builder.push_double(parse_vertex(&lines)?);
    }
    let mut corners = Vec::new();
    for i in 0..faces {
        if !advance(&mut lines)? {
            return Err(missing(&lines, i, faces, "faces"));
        }
        parse_face(&lines, vertices, &mut corners)?;
        builder.push_polygon(&corners);
    }
    Ok(())
}

/// Goes to the next line that says something.
fn advance(lines: &mut Lines) -> Result<bool> {
    while lines.advance()? {
        if lines.words().next().is_some() {
            return Ok(true);
        }
    }
    Ok(false)
}

fn missing(lines: &Lines, found: u64, promised: u64, what: &str) -> Error {
    let found = format!("the file ends after {found} of its {what}");
    lines.error_at_end(&found, &format!("{promised}, as the header says"))
}

/// The numbers of vertices and faces, in the keyword's line or behind it; that of edges, third, is
/// often wrong or missing, and nobody needs it.
fn read_counts(lines: &mut Lines) -> Result<[u64; 2]> {
    let mut counts = Vec::new();
    let mut first = true;
    while counts.len() < 2 {
        if !advance(lines)? {
            return Err(lines.error_at_end("the file ends in its header", COUNTS));
        }
        for word in lines.words() {
            if std::mem::take(&mut first) && is_keyword(word) {
                continue;
            }
            let count = parse_integer(word).and_then(|n| u64::try_from(n).ok());
            counts.push(count.ok_or_else(|| lines.error(&quote(word), COUNTS))?);
        }
    }
    Ok([counts[0], counts[1]])
}

const COUNTS: &str = "OFF and the numbers of vertices and faces";

fn parse_vertex(lines: &Lines) -> Result<[f64; 3]> {
    let mut words = lines.words();
    let mut coordinate = || words.next().and_then(parse_number);
    match (coordinate(), coordinate(), coordinate()) {
        (Some(x), Some(y), Some(z)) => Ok([x, y, z]),
        _ => Err(lines.error(&format!("vertex {}", quote(lines.line())), "three numbers")),
    }
}

fn parse_face(lines: &Lines, vertices: u64, corners: &mut Vec<u32>) -> Result<()> {
    let wrong = || {
        let expected = "the number of corners and that many vertex numbers";
        lines.error(&format!("face {}", quote(lines.line())), expected)
    };
    let mut numbers = lines.words().map(parse_integer);
    let n = numbers
        .next()
        .flatten()
        .filter(|&n| n >= 0)
        .ok_or_else(wrong)?;
    corners.clear();
    for _ in 0..n {
        let index = numbers.next().flatten().ok_or_else(wrong)?;
        let inside = u32::try_from(index)
            .ok()
            .filter(|&v| u64::from(v) < vertices);
        corners.push(inside.ok_or_else(|| {
            let expected = format!("0 to {}", vertices.saturating_sub(1));
            lines.error(&format!("face uses vertex {index}"), &expected)
        })?);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::indexed_mesh::IndexedMesh;

    fn mesh(text: &str) -> IndexedMesh {
        let mut builder = MeshBuilder::default();
        read(Input::from_bytes("a.off", text).unwrap(), &mut builder).unwrap();
        builder.finish().unwrap()
    }

    const BODY: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n3 0 1 2\n";

    #[test]
    fn the_header_has_many_forms() {
        let expected = mesh(&format!("OFF\n4 2 0\n{BODY}"));
        assert_eq!(expected.triangles(), [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
        for header in [
            "off 4 2",
            "4 2 0",
            "# x\n\nOFF # y\n\n 4\t2 # z",
            "OFF\n4\n2",
            "coff\r4 2 9",
        ] {
            assert_eq!(mesh(&format!("{header}\n{BODY}")), expected, "{header}");
        }
    }

    #[test]
    fn colours_and_normals_are_skipped() {
        let text = "CNOFF\n3 2 0\n0 0 0 9 9 9 1 1 1 1\n1 0 0 9 9 9\n1 1 0 9\n\
                    3 0 1 2 255 0 0\n3 2 1 0 0.5 0.5 0.5 1 # red\n";
        assert_eq!(mesh(text).triangles(), [[0, 1, 2], [2, 1, 0]]);
    }

    #[test]
    fn faces_of_one_or_two_corners_are_none() {
        assert_eq!(
            mesh("OFF 3 3 0\n0 0 0\n1 0 0\n1 1 0\n2 0 1\n0\n1 2\n").triangle_count(),
            0
        );
    }

    #[test]
    fn only_the_first_word_tells() {
        assert!(is_off(b"# a\n\n  OFF\n"));
        assert!(!is_off(b"v OFF\n"));
        assert!(!is_off(b"OFFICE\n"));
        assert!(!is_off(b""));
    }
}
