//! Compressed files: recognised by their first bytes, and decompressed on the fly.

use std::io::{self, BufReader, Read};

/// Maximum memory of the decompression window, in MiB: as needed by `xz -9` and `zstd --ultra --long`.
const WINDOW_MIB: u32 = 128;
/// Bytes read from the file at a time.
const PIECE: usize = 1 << 16;

/// Number of bytes that identify the compression.
pub(super) const MAGIC: usize = 6;

/// A compression.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Packing {
    Gzip,
    Zstd,
    Xz,
}

impl Packing {
    /// Compression of a file with these first bytes, if any.
    pub(super) fn of(head: &[u8]) -> Option<Self> {
        let begins: [(&[u8], Self); 3] = [
            (b"\x1f\x8b\x08", Self::Gzip),
            (b"\x28\xb5\x2f\xfd", Self::Zstd),
            (b"\xfd7zXZ\0", Self::Xz),
        ];
        let found = begins.iter().find(|(magic, _)| head.starts_with(magic));
        found.map(|(_, packing)| *packing)
    }

    /// Name for messages, which is also that of the program.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Gzip => "gzip",
            Self::Zstd => "zstd",
            Self::Xz => "xz",
        }
    }

    /// Content of a file with that compression, with several members joined.
    pub(super) fn unpack(
        self,
        packed: impl Read + Send + 'static,
    ) -> io::Result<Box<dyn Read + Send>> {
        let packed = BufReader::with_capacity(PIECE, packed);
        let bytes: Box<dyn Read + Send> = match self {
            Self::Gzip => Box::new(flate2::bufread::MultiGzDecoder::new(packed)),
            Self::Zstd => {
                let mut decoder = zstd::Decoder::with_buffer(packed)?;
                decoder.window_log_max(WINDOW_MIB.ilog2() + 20)?;
                Box::new(decoder)
            }
            Self::Xz => {
                let limit = (WINDOW_MIB + 1) << 10;
                Box::new(lzma_rust2::XzReader::new_mem_limit(packed, true, limit))
            }
        };
        Ok(Box::new(Unpacked {
            packing: self,
            bytes,
        }))
    }
}

/// Content of a compressed file.
struct Unpacked {
    packing: Packing,
    bytes: Box<dyn Read + Send>,
}

impl Read for Unpacked {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.bytes.read(bytes).map_err(|error| {
            // An error of the system is not a fault of the content.
            match error.raw_os_error().is_some() || error.kind() == io::ErrorKind::Interrupted {
                true => error,
                false => self.damaged(&error),
            }
        })
    }
}

impl Unpacked {
    fn damaged(&self, error: &io::Error) -> io::Error {
        let name = self.packing.name();
        let why = match error.kind() {
            io::ErrorKind::UnexpectedEof => "the file ends early".to_owned(),
            _ => error.to_string(),
        };
        io::Error::new(
            io::ErrorKind::InvalidData,
            format!(
                "its {name} data are damaged ({why}); copy it again, or save the intact part with {name} -dc FILE > \
                 NEW and read that"
            ),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// "time_s,torque_n_m\n0,1\n", packed by gzip 1.12, zstd 1.5 and xz 5.4, is in `tests/recordings`; incomplete
    /// archives are tested here.
    #[test]
    fn an_archive_that_ends_early_is_no_end_of_its_content() {
        use std::io::Write;
        let text = b"0,1\n".repeat(50_000);
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        gzip.write_all(&text).unwrap();
        let gzip = gzip.finish().unwrap();
        let zstd = zstd::encode_all(&text[..], 1).unwrap();
        for (packed, packing) in [(gzip, Packing::Gzip), (zstd, Packing::Zstd)] {
            assert_eq!(Packing::of(&packed), Some(packing));
            let twice = [packed.as_slice(), &packed].concat();
            let mut content = Vec::new();
            let mut whole = packing.unpack(io::Cursor::new(twice)).unwrap();
            whole.read_to_end(&mut content).unwrap();
            assert_eq!(content, [&text[..], &text].concat());
            for cut in [packed.len() - 1, packed.len() / 2, 7] {
                let cut = io::Cursor::new(packed[..cut].to_vec());
                let read = packing.unpack(cut).unwrap().read_to_end(&mut Vec::new());
                let error = read.unwrap_err();
                assert_eq!(error.kind(), io::ErrorKind::InvalidData);
                assert!(error.to_string().contains("ends early"), "{error}");
            }
        }
    }
}
