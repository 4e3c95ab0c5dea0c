//! The data chunks of a PNG file, written before their length is known.

use std::io::{self, Read, Seek, SeekFrom, Write};

use super::super::part::Part;

/// The last chunk of every PNG file, whose checksum is always the same.
const END: [u8; 12] = [0, 0, 0, 0, b'I', b'E', b'N', b'D', 0xae, 0x42, 0x60, 0x82];

/// Chunks of at most `most` bytes; length and checksum are filled in when a chunk is full.
pub(super) struct Idat {
    most: usize,
    /// Position of the open chunk in the file.
    start: Option<u64>,
    length: usize,
    checksum: flate2::Crc,
    total: u64,
}

impl Idat {
    pub(super) fn new(most: usize) -> Self {
        Self { most, start: None, length: 0, checksum: flate2::Crc::new(), total: 0 }
    }

    /// Returns the bytes written so far, without the overhead of chunks.
    pub(super) const fn total(&self) -> u64 {
        self.total
    }

    pub(super) fn write(&mut self, to: &mut Part, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            if self.start.is_none() {
                self.start = Some(to.stream_position()?);
                to.write_all(&[0; 4])?;
                to.write_all(b"IDAT")?;
                self.checksum.reset();
                self.checksum.update(b"IDAT");
            }
            let (now, rest) = bytes.split_at(bytes.len().min(self.most - self.length));
            to.write_all(now)?;
            self.checksum.update(now);
            self.length += now.len();
            self.total += now.len() as u64;
            bytes = rest;
            if self.length == self.most {
                self.close(to)?;
            }
        }
        Ok(())
    }

    /// Completes the open chunk, if any.
    fn close(&mut self, to: &mut Part) -> io::Result<()> {
        let Some(start) = self.start.take() else { return Ok(()) };
        to.write_all(&self.checksum.sum().to_be_bytes())?;
        to.seek(SeekFrom::Start(start))?;
        to.write_all(&(self.length as u32).to_be_bytes())?;
        to.seek(SeekFrom::End(0))?;
        self.length = 0;
        Ok(())
    }

    /// Completes the file.
    pub(super) fn finish(mut self, to: &mut Part) -> io::Result<()> {
        self.close(to)?;
        to.write_all(&END)
    }
}

/// Maximum number of bytes of a stored (uncompressed) block.
const STORED: usize = 0xffff;

/// Writes `length` bytes of `from` as stored blocks of a zlib stream (RFC 1950).
pub(super) fn store(idat: &mut Idat, to: &mut Part, mut from: impl Read, length: u64) -> io::Result<()> {
    idat.write(to, &[0x78, 0x01])?;
    let mut block = vec![0; 5 + STORED];
    let (mut left, mut sums) = (length, [1, 0]);
    loop {
        let count = left.min(STORED as u64) as usize;
        left -= count as u64;
        let [low, high] = (count as u16).to_le_bytes();
        block[..5].copy_from_slice(&[u8::from(left == 0), low, high, !low, !high]);
        from.read_exact(&mut block[5..5 + count])?;
        sums = adler(sums, &block[5..5 + count]);
        idat.write(to, &block[..5 + count])?;
        if left == 0 {
            return idat.write(to, &(sums[1] << 16 | sums[0]).to_be_bytes());
        }
    }
}

/// Updates an Adler-32 checksum: the sum of bytes, and the sum of these sums.
fn adler([mut sum, mut sums]: [u32; 2], bytes: &[u8]) -> [u32; 2] {
    // sums of this many bytes of 255 fit into 32 bits
    for part in bytes.chunks(5552) {
        for byte in part {
            sum += u32::from(*byte);
            sums += sum;
        }
        (sum, sums) = (sum % 65_521, sums % 65_521);
    }
    [sum, sums]
}
