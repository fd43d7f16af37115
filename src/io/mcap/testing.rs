//! MCAP files for tests, written by the crate `mcap`.

use std::collections::BTreeMap;
use std::io::{Cursor, Read};

use mcap::records::{MessageHeader, op};
use mcap::{Compression, WriteOptions, Writer};

use super::record::file::FileReader;
use super::record::input::CountedInput;
use super::record::reader::RecordReader;
use super::{FieldChoice, Inventory, SignalReader, TimeOptions};
use crate::failure::Failure;
use crate::io::Input;

/// Records of bytes in memory.
pub fn reader(bytes: &[u8]) -> RecordReader {
    let input = CountedInput::new(stream(bytes));
    RecordReader::new("test.mcap".to_owned(), input).unwrap()
}

/// Bytes in memory as a stream.
pub fn stream(bytes: &[u8]) -> Box<dyn Read + Send> {
    Box::new(Cursor::new(bytes.to_vec()))
}

/// Inventory of bytes in memory.
pub fn inventory(bytes: &[u8]) -> Inventory {
    Inventory::read("test.mcap".to_owned(), stream(bytes)).unwrap()
}

/// Opens a number in bytes in memory.
pub fn open(
    bytes: &[u8],
    (topic, field): (&str, &str),
    options: &TimeOptions,
) -> Result<SignalReader, Failure> {
    let choice = FieldChoice {
        topic: Some(topic.to_owned()),
        field: Some(field.to_owned()),
        signal: None,
    };
    SignalReader::with_stream(&Input::Stdin, stream(bytes), &choice, options)
}

/// All times and values of a signal.
pub fn drain(reader: &mut SignalReader) -> (Vec<i64>, Vec<f64>) {
    let (mut all_times, mut all_values) = (Vec::new(), Vec::new());
    let (mut times, mut values) = (Vec::new(), Vec::new());
    while reader.next(&mut times, &mut values).unwrap() {
        all_times.append(&mut times);
        all_values.append(&mut values);
    }
    (all_times, all_values)
}

/// Offsets of the chunks of a file.
pub fn chunks(bytes: &[u8]) -> Vec<usize> {
    let input = CountedInput::new(stream(bytes));
    let mut file = FileReader::new("test.mcap".to_owned(), input).unwrap();
    let mut chunks = Vec::new();
    while let Some(record) = file.next().unwrap() {
        if record.op == op::CHUNK {
            chunks.push(record.offset as usize);
        }
    }
    chunks
}

/// A file under construction.
pub struct File {
    writer: Writer<Cursor<Vec<u8>>>,
}

/// Options with a compression and small chunks.
pub fn options(compression: Option<Compression>) -> WriteOptions {
    WriteOptions::new()
        .compression(compression)
        .compression_threads(0)
        .chunk_size(Some(4096))
        .profile("ros2")
        .library("test")
}

impl File {
    /// An empty file.
    pub fn new(options: WriteOptions) -> Self {
        let writer = options.create(Cursor::new(Vec::new())).unwrap();
        Self { writer }
    }

    /// Adds a channel with its schema; encodings such as `cdr+ros2msg`.
    pub fn channel(&mut self, id: u16, topic: &str, encodings: &str, schema: (&str, &[u8])) {
        let (message, language) = encodings.split_once('+').unwrap();
        let schema = self
            .writer
            .add_schema(schema.0, language, schema.1)
            .unwrap();
        let metadata = BTreeMap::from([("id".to_owned(), id.to_string())]);
        self.writer
            .add_channel_with_id(id, schema, topic, message, &metadata)
            .unwrap();
    }

    /// Adds a message, published 1 ns before it is logged.
    pub fn message(&mut self, channel_id: u16, log_time: u64, data: &[u8]) {
        let header = MessageHeader {
            channel_id,
            sequence: 0,
            log_time,
            publish_time: log_time.saturating_sub(1),
        };
        self.writer.write_to_known_channel(&header, data).unwrap();
    }

    /// The writer, for anything else.
    pub fn writer(&mut self) -> &mut Writer<Cursor<Vec<u8>>> {
        &mut self.writer
    }

    /// The bytes.
    pub fn finish(mut self) -> Vec<u8> {
        self.writer.finish().unwrap();
        self.writer.into_inner().into_inner()
    }
}

/// The message `float64 data` in CDR.
pub fn float64(value: f64) -> Vec<u8> {
    let mut data = vec![0, 1, 0, 0];
    data.extend_from_slice(&value.to_le_bytes());
    data
}
