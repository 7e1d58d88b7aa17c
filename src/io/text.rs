//! Lines, words and numbers of the text formats.

use std::io::{self, BufRead, BufReader, Read, Write};

use crate::error::{Error, Place, Result};

use super::input::Input;

/// The longest piece of a file that a message repeats, in characters.
const QUOTE_CHARS: usize = 40;
/// How much either half of a message says: room for the properties of a vertex that has sixty.
const MESSAGE_CHARS: usize = 1000;

/// The lines of a text file, one at a time in one buffer.
///
/// Ends lines at `\n`, `\r\n` and `\r`, takes any 8-bit encoding, and decodes UTF-16 behind a byte
/// order mark (all but ASCII becomes `?`: only names are written in it).
pub(super) struct Lines {
    input: Input,
    line: Vec<u8>,
    first: usize,
    last: usize,
    ended_with_cr: bool,
}

impl Lines {
    /// The lines of a whole file.
    pub fn new(mut input: Input) -> Result<Self> {
        let bom_bytes = match input.head.as_slice() {
            [0xFE, 0xFF, ..] | [0xFF, 0xFE, ..] => 2,
            [0xEF, 0xBB, 0xBF, ..] => 3,
            _ => 0,
        };
        let mut bom = [0; 3];
        if let Err(source) = input.reader.read_exact(&mut bom[..bom_bytes]) {
            return Err(input.io_error(source));
        }
        if bom_bytes == 2 {
            let utf16 = Utf16 {
                reader: input.reader,
                big_endian: bom[0] == 0xFE,
            };
            input.reader = BufReader::new(Box::new(utf16));
        }
        Ok(Self::after(input, 0))
    }

    /// The lines that follow where `read` of them have been read already.
    pub fn after(input: Input, read: usize) -> Self {
        Lines {
            input,
            line: Vec::new(),
            first: read,
            last: read,
            ended_with_cr: false,
        }
    }

    /// Goes to the next line. `false` at the end of the file.
    pub fn advance(&mut self) -> Result<bool> {
        self.line.clear();
        self.first = self.last + 1;
        self.append()
    }

    /// Goes to the next line, joined with those behind it as long as `\` ends them.
    pub fn advance_continued(&mut self) -> Result<bool> {
        if !self.advance()? {
            return Ok(false);
        }
        while let [start @ .., b'\\'] = self.line.as_slice() {
            let length = start.len();
            self.line.truncate(length);
            self.line.push(b' ');
            if !self.append()? {
                break;
            }
        }
        Ok(true)
    }

    fn append(&mut self) -> Result<bool> {
        let mut any = false;
        loop {
            let chunk = match self.input.reader.fill_buf() {
                Ok(chunk) => chunk,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => continue,
                Err(e) => return Err(self.input.io_error(e)),
            };
            if std::mem::take(&mut self.ended_with_cr) && chunk.first() == Some(&b'\n') {
                self.input.reader.consume(1);
                continue;
            }
            if chunk.is_empty() {
                self.last += usize::from(any);
                return Ok(any);
            }
            any = true;
            match find_line_end(chunk) {
                Some(end) => {
                    self.line.extend_from_slice(&chunk[..end]);
                    self.ended_with_cr = chunk[end] == b'\r';
                    self.input.reader.consume(end + 1);
                    self.last += 1;
                    return Ok(true);
                }
                None => {
                    let length = chunk.len();
                    self.line.extend_from_slice(chunk);
                    self.input.reader.consume(length);
                }
            }
        }
    }

    /// The current line without its end.
    pub fn line(&self) -> &[u8] {
        &self.line
    }

    /// The words of the current line before a comment.
    pub fn words(&self) -> impl Iterator<Item = &[u8]> {
        words_before_comment(&self.line)
    }

    /// The number of the current line, counted from 1; of its first where several are joined.
    pub fn number(&self) -> usize {
        self.first
    }

    /// A parse error in the current line.
    pub fn error(&self, found: &str, expected: &str) -> Error {
        self.error_at(self.first, found, expected)
    }

    /// A parse error in another line.
    pub fn error_at(&self, line: usize, found: &str, expected: &str) -> Error {
        self.input.error(Place::Line(line), found, expected)
    }

    /// A parse error where lines are missing.
    pub fn error_at_end(&self, found: &str, expected: &str) -> Error {
        self.error_at(self.last, found, expected)
    }

    /// A parse error about the file as a whole.
    pub fn error_in_file(&self, found: &str, expected: &str) -> Error {
        self.input.error(Place::File, found, expected)
    }
}

/// UTF-16 without its byte order mark, read as ASCII with `?` for everything else.
struct Utf16 {
    reader: BufReader<Box<dyn Read>>,
    big_endian: bool,
}

impl Read for Utf16 {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut filled = 0;
        while filled < buffer.len() {
            let mut pair = [0; 2];
            match self.reader.read_exact(&mut pair) {
                Ok(()) => {}
                Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => break,
                Err(e) => return Err(e),
            }
            let unit = if self.big_endian {
                u16::from_be_bytes(pair)
            } else {
                u16::from_le_bytes(pair)
            };
            buffer[filled] = u8::try_from(unit).ok().filter(u8::is_ascii).unwrap_or(b'?');
            filled += 1;
        }
        Ok(filled)
    }
}

/// Where the first line ends.
fn find_line_end(text: &[u8]) -> Option<usize> {
    let ends = |&b: &u8| b == b'\n' || b == b'\r';
    // Without a branch for each byte.
    let none = |piece: &&[u8; 16]| !piece.iter().fold(false, |any, b| any | ends(b));
    let without = 16 * text.as_chunks().0.iter().take_while(none).count();
    let end = text[without..].iter().position(ends)?;
    Some(without + end)
}

/// The words of a line, whatever blanks stand between them.
pub(super) fn words(mut line: &[u8]) -> impl Iterator<Item = &[u8]> {
    std::iter::from_fn(move || {
        let start = line.iter().position(|b| !b.is_ascii_whitespace())?;
        line = &line[start..];
        let end = line.iter().position(u8::is_ascii_whitespace);
        let word;
        (word, line) = line.split_at(end.unwrap_or(line.len()));
        Some(word)
    })
}

/// The words of a line up to one that begins with `#`; within a word (`1.#INF`) it is none.
pub(super) fn words_before_comment(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    words(line).take_while(|word| word[0] != b'#')
}

/// What a message says, on one line whatever names of the file stand in it, and no longer than
/// anyone reads.
pub(super) fn one_line(text: &str) -> String {
    let mut line: String = without_control(text).take(MESSAGE_CHARS).collect();
    if text.chars().nth(MESSAGE_CHARS).is_some() {
        line.push('…');
    }
    line
}

/// A text with blanks for what would end a line or move a cursor.
pub(super) fn without_control(text: &str) -> impl Iterator<Item = char> + '_ {
    let clean = |c: char| if c.is_control() { ' ' } else { c };
    text.chars().map(clean)
}

/// A name as it is kept: on one line, without blanks around it.
pub(super) fn name_of(text: &str) -> String {
    let name: String = without_control(text).collect();
    name.trim_ascii().to_string()
}

/// A piece of a file as a message repeats it: in quotes, shortened.
pub(super) fn quote(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(4 * QUOTE_CHARS)]);
    let text = text.trim();
    let start: String = text.chars().take(QUOTE_CHARS).collect();
    if start.len() < text.len() {
        format!("'{start}…'")
    } else {
        format!("'{start}'")
    }
}

/// A number that need not be finite: besides Rust's spellings those of C on Windows
/// (`1.#IND`, `-1.#INF`, `-nan(ind)`).
pub(super) fn parse_number(word: &[u8]) -> Option<f64> {
    if let Some(number) = parse_short_number(word) {
        return Some(number);
    }
    let text = std::str::from_utf8(word).ok()?;
    text.parse().ok().or_else(|| not_finite(text))
}

/// The value of up to 15 digits with or without a point, which most coordinates are: such a whole
/// number and such a power of ten are exact, so their quotient is the nearest number there is.
fn parse_short_number(word: &[u8]) -> Option<f64> {
    const POWERS_OF_TEN: [f64; 16] = [
        1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
    ];
    let (is_negative, digits) = match word {
        [b'-', digits @ ..] => (true, digits),
        digits => (false, digits),
    };
    if digits.len() > 16 {
        return None;
    }
    let (mut whole, mut count, mut point) = (0_u64, 0, None);
    for &b in digits {
        match b {
            b'0'..=b'9' => {
                whole = 10 * whole + u64::from(b - b'0');
                count += 1;
            }
            b'.' if point.is_none() => point = Some(count),
            _ => return None,
        }
    }
    if count == 0 || count > 15 {
        return None;
    }
    let magnitude = whole as f64 / POWERS_OF_TEN[count - point.unwrap_or(count)];
    Some(if is_negative { -magnitude } else { magnitude })
}

/// The value of a spelling of NaN or infinity that Rust does not know.
fn not_finite(text: &str) -> Option<f64> {
    let (sign, magnitude) = match text.strip_prefix('-') {
        Some(rest) => (-1.0, rest),
        None => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    let magnitude = magnitude.to_ascii_lowercase();
    if magnitude.starts_with("1.#inf") {
        Some(sign * f64::INFINITY)
    } else if ["1.#ind", "1.#qnan", "1.#snan", "nan("]
        .iter()
        .any(|s| magnitude.starts_with(s))
    {
        Some(f64::NAN)
    } else {
        None
    }
}

/// A whole number.
pub(super) fn parse_integer(word: &[u8]) -> Option<i64> {
    if (1..=18).contains(&word.len()) && word.iter().all(u8::is_ascii_digit) {
        let append = |n, b: &u8| 10 * n + i64::from(b - b'0');
        return Some(word.iter().fold(0, append));
    }
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// `1 vertex`, `2 vertices`.
pub(super) fn count(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

/// Writes a coordinate: with all the digits that it takes to read back the same bits of an `f32`
/// (`single`) or an `f64`, or with that many significant ones; with an exponent where the number
/// is shorter for it.
pub(super) fn write_number(
    writer: &mut dyn Write,
    x: f64,
    single: bool,
    digits: Option<usize>,
) -> io::Result<()> {
    // Between these no exponent makes a number shorter by more than a character or two.
    let plain = x == 0.0 || (1e-5..1e9).contains(&x.abs());
    if let Some(digits) = digits {
        let rounded: f64 = format!("{x:.*e}", digits.saturating_sub(1))
            .parse()
            .unwrap_or(x);
        return if plain {
            write!(writer, "{rounded}")
        } else {
            write!(writer, "{rounded:e}")
        };
    }
    match (single, plain) {
        (true, true) => write!(writer, "{}", x as f32),
        (true, false) => write!(writer, "{:e}", x as f32),
        (false, true) => write!(writer, "{x}"),
        (false, false) => write!(writer, "{x:e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(bytes: impl Into<Vec<u8>>) -> Vec<(usize, String)> {
        let mut lines = Lines::new(Input::from_stream("a", bytes).unwrap()).unwrap();
        let mut found = Vec::new();
        while lines.advance_continued().unwrap() {
            found.push((
                lines.number(),
                String::from_utf8_lossy(lines.line()).into_owned(),
            ));
        }
        found
    }

    #[test]
    fn every_line_end_ends_a_line() {
        let expected = ["a", "", "b", "c", "d"].map(String::from);
        for text in ["a\n\nb\nc\nd", "a\r\n\r\nb\r\nc\r\nd\r\n", "a\r\rb\rc\rd\r"] {
            let found = lines(text);
            assert_eq!(
                found
                    .iter()
                    .map(|(_, line)| line.clone())
                    .collect::<Vec<_>>(),
                expected
            );
            assert_eq!(
                found.iter().map(|&(n, _)| n).collect::<Vec<_>>(),
                [1, 2, 3, 4, 5]
            );
        }
    }

    #[test]
    fn a_backslash_joins_lines_and_keeps_their_count() {
        assert_eq!(
            lines("a \\\nb\\\r\nc\nd\\"),
            [(1, "a  b c".to_string()), (4, "d ".to_string())]
        );
    }

    #[test]
    fn utf16_reads_as_ascii() {
        let text = "v 1\nö\n";
        let big: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
        let little: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let expected = [(1, "v 1".to_string()), (2, "?".to_string())];
        assert_eq!(lines([vec![0xFE, 0xFF], big].concat()), expected);
        assert_eq!(lines([vec![0xFF, 0xFE], little].concat()), expected);
    }

    /// A name from a file's header may hold what moves a terminal's cursor, and be as long as it likes.
    #[test]
    fn a_message_is_one_line_of_bounded_length() {
        assert_eq!(one_line("a\x1b[2J\0\u{85}b"), "a [2J  b");
        let long = "ö".repeat(MESSAGE_CHARS);
        assert_eq!(one_line(&long), long);
        assert_eq!(one_line(&format!("{long}ö")), format!("{long}…"));
    }

    #[test]
    fn numbers_in_every_spelling() {
        for (text, value) in [
            ("1", 1.0),
            ("+2.", 2.0),
            ("-.5e1", -5.0),
            ("1.#INF", f64::INFINITY),
        ] {
            assert_eq!(parse_number(text.as_bytes()), Some(value), "{text}");
        }
        for text in ["nan", "-NaN", "1.#IND", "-1.#QNAN", "-nan(ind)"] {
            assert!(
                parse_number(text.as_bytes()).is_some_and(f64::is_nan),
                "{text}"
            );
        }
        for text in ["", "x", "1,5", "3.1+e2", "1.#", "0x10"] {
            assert_eq!(parse_number(text.as_bytes()), None, "{text}");
        }
    }

    /// What the short way reads has the bits that Rust's own parser gives it, and it leaves alone
    /// what is no number.
    #[test]
    fn short_numbers_are_the_nearest_ones() {
        let mut seed = 1_u64;
        for i in 0..200_000 {
            seed = seed
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            let digits = 1 + (seed >> 33) as usize % 17;
            let number = format!("{:0digits$}", (seed >> 3) % 10_u64.pow(digits as u32));
            let at = (seed >> 50) as usize % (digits + 1);
            let sign = ["", "-"][i % 2];
            let point = ["", "."][i / 2 % 2];
            let text = format!("{sign}{}{point}{}", &number[..at], &number[at..]);
            let expected = text.parse::<f64>().unwrap();
            let found = parse_number(text.as_bytes()).map(f64::to_bits);
            assert_eq!(found, Some(expected.to_bits()), "{text}");
        }
        for text in ["", "-", ".", "-.", "1.2.3", "--1", "1-", "+-1", "1e", "1 2"] {
            assert_eq!(parse_number(text.as_bytes()), None, "{text}");
        }
        for text in ["7", "+7", "-7", "007", "999999999999999999", "-0"] {
            assert_eq!(parse_integer(text.as_bytes()), text.parse().ok(), "{text}");
        }
        for text in ["", "-", "1.", "1x", "9223372036854775808"] {
            assert_eq!(parse_integer(text.as_bytes()), None, "{text}");
        }
    }

    fn written(x: f64, single: bool, digits: Option<usize>) -> String {
        let mut bytes = Vec::new();
        write_number(&mut bytes, x, single, digits).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn numbers_are_short_and_read_back() {
        assert_eq!(written(f64::from(0.1_f32), true, None), "0.1");
        assert_eq!(
            written(f64::from(0.1_f32), false, None),
            "0.10000000149011612"
        );
        assert_eq!(written(-0.0, true, None), "-0");
        assert_eq!(written(1e-30, false, None), "1e-30");
        assert_eq!(written(f64::from(f32::MAX), true, None), "3.4028235e38");
        assert_eq!(written(1234.5678, false, Some(6)), "1234.57");
        assert_eq!(written(1e-30 / 3.0, false, Some(3)), "3.33e-31");
        assert_eq!(written(f64::NAN, true, None), "NaN");
    }
}
