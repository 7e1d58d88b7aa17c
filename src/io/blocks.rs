//! The bytes of a binary file in blocks, through one buffer that is used again.

use std::io::{self, ErrorKind, Read};

use crate::error::Result;

use super::input::Input;

/// How much is read at a time: few calls, and what has been read is still in the cache when it is
/// decoded. In tests few bytes, so that small files have many ends of blocks.
const BLOCK_BYTES: usize = if cfg!(test) { 60 } else { 1 << 19 };

/// A binary file behind its header.
pub(super) struct Blocks {
    input: Input,
    buffer: Vec<u8>,
    /// Where in `buffer` the bytes begin and end that have been read and not yet consumed.
    start: usize,
    end: usize,
    position: u64,
}

impl Blocks {
    /// The bytes of `input`, of which `position` have been read.
    pub fn after(input: Input, position: u64) -> Self {
        Blocks {
            input,
            buffer: Vec::new(),
            start: 0,
            end: 0,
            position,
        }
    }

    /// The next bytes: `wanted` of them or more, and fewer only where the file ends.
    ///
    /// The buffer grows to hold them, but never to more than twice what the file has.
    pub fn peek(&mut self, wanted: usize) -> Result<&[u8]> {
        self.fill(wanted).map_err(|e| self.input.io_error(e))?;
        Ok(&self.buffer[self.start..self.end])
    }

    /// Goes on behind the next `n` bytes, which have been peeked at.
    pub fn consume(&mut self, n: usize) {
        self.start += n;
        self.position += n as u64;
        assert!(self.start <= self.end, "{n} bytes consumed that never came");
    }

    /// Where in the file the next byte stands.
    pub fn position(&self) -> u64 {
        self.position
    }

    /// How many bytes follow, where that is known.
    pub fn bytes_left(&self) -> Option<u64> {
        self.input.length.map(|n| n.saturating_sub(self.position))
    }

    /// The file, for messages about it.
    pub fn input(&self) -> &Input {
        &self.input
    }

    #[inline]
    fn fill(&mut self, wanted: usize) -> io::Result<()> {
        if self.end - self.start < wanted {
            self.fill_from_file(wanted)
        } else {
            Ok(())
        }
    }

    #[cold]
    fn fill_from_file(&mut self, wanted: usize) -> io::Result<()> {
        self.buffer.copy_within(self.start..self.end, 0);
        self.end -= self.start;
        self.start = 0;
        while self.end < wanted {
            if self.buffer.is_empty() {
                // Fresh zeros cost nothing before they are read into.
                self.buffer = vec![0; BLOCK_BYTES];
            } else if self.end == self.buffer.len() {
                self.buffer.resize(2 * self.buffer.len(), 0);
            }
            match self.input.reader.read(&mut self.buffer[self.end..]) {
                Ok(0) => break,
                Ok(n) => self.end += n,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        Ok(())
    }
}

impl Read for Blocks {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.fill(1)?;
        let n = bytes.len().min(self.end - self.start);
        bytes[..n].copy_from_slice(&self.buffer[self.start..self.start + n]);
        self.consume(n);
        Ok(n)
    }

    #[inline]
    fn read_exact(&mut self, bytes: &mut [u8]) -> io::Result<()> {
        self.fill(bytes.len())?;
        if self.end - self.start < bytes.len() {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        bytes.copy_from_slice(&self.buffer[self.start..self.start + bytes.len()]);
        self.consume(bytes.len());
        Ok(())
    }
}
