//! MCAP files, written by the crate `mcap`, and the messages of ROS 2.

use std::collections::BTreeMap;
use std::io::Cursor;

use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions, Writer};

/// A file being written.
pub struct McapFile(Writer<Cursor<Vec<u8>>>);

impl McapFile {
    pub fn new(compression: Option<Compression>, profile: &str, library: &str) -> Self {
        let options = WriteOptions::new()
            .compression(compression)
            .compression_threads(0)
            .chunk_size(Some(16_384))
            .profile(profile)
            .library(library);
        Self(
            options
                .create(Cursor::new(Vec::new()))
                .expect("a file in memory"),
        )
    }

    pub fn channel(
        &mut self,
        topic: &str,
        encoding: &str,
        schema: Option<(&str, &str, &[u8])>,
    ) -> u16 {
        let schema = schema.map_or(0, |(name, language, text)| {
            self.0.add_schema(name, language, text).expect("a schema")
        });
        self.0
            .add_channel(schema, topic, encoding, &BTreeMap::new())
            .expect("a channel")
    }

    /// A message, logged 40 µs after it was published.
    pub fn message(&mut self, channel_id: u16, sequence: usize, published_ns: u64, data: &[u8]) {
        let header = MessageHeader {
            channel_id,
            sequence: sequence as u32,
            log_time: published_ns + 40_000,
            publish_time: published_ns,
        };
        self.0
            .write_to_known_channel(&header, data)
            .expect("a message");
    }

    pub fn finish(mut self) -> Vec<u8> {
        self.0.finish().expect("a whole file");
        self.0.into_inner().into_inner()
    }
}

/// CDR, little endian: values aligned to their size, relative to the end of the header.
pub struct Cdr(pub Vec<u8>);

impl Cdr {
    pub fn new() -> Self {
        Self(vec![0, 1, 0, 0])
    }

    pub fn align(&mut self, size: usize) {
        while !(self.0.len() - 4).is_multiple_of(size) {
            self.0.push(0);
        }
    }

    pub fn u32(&mut self, value: u32) {
        self.align(4);
        self.0.extend(value.to_le_bytes());
    }

    pub fn f64(&mut self, value: f64) {
        self.align(8);
        self.0.extend(value.to_le_bytes());
    }

    pub fn numbers(&mut self, values: &[f64]) {
        self.u32(values.len() as u32);
        values.iter().for_each(|value| self.f64(*value));
    }

    pub fn text(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.0.extend(text.bytes());
        self.0.push(0);
    }

    pub fn stamp(&mut self, time_ns: u64) {
        self.u32((time_ns / 1_000_000_000) as u32);
        self.u32((time_ns % 1_000_000_000) as u32);
    }
}
