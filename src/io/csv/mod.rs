//! Text tables as recorders write them.

mod chunks;
mod habit;
mod layout;
mod names;
mod scan;

use crate::failure::Failure;

pub use super::Reading as Options;
pub(crate) use chunks::head;
pub use chunks::{Chunks, Piece};
pub use layout::{Delimiter, Dialect, Layout, decode_line, is_skipped};
pub(crate) use layout::{dialects, find as find_layout_in, is_not_a_number};
pub use names::Column;
pub use scan::{Defect, Problem, RowPlan, Rows, place_of};

/// Names the formats that are often handed over in place of text.
pub(crate) fn refuse_other_formats(head: &[u8]) -> Result<(), Failure> {
    let known: [(&[u8], &str); 5] = [
        (b"\xFF\xFE", "UTF-16 text; save it as UTF-8"),
        (b"\xFE\xFF", "UTF-16 text; save it as UTF-8"),
        (
            b"PK\x03\x04",
            "a zip archive or a spreadsheet; export the sheet as CSV",
        ),
        (
            b"\x1F\x8B",
            "compressed with gzip; pipe it: gunzip -c FILE | torqcomp … -",
        ),
        (
            b"\x28\xB5\x2F\xFD",
            "compressed with zstd; pipe it: zstdcat FILE | torqcomp … -",
        ),
    ];
    match known.iter().find(|(magic, _)| head.starts_with(magic)) {
        Some((_, what)) => Err(Failure::failed(format_args!("the file is {what}"))),
        None if is_binary(head) => Err(Failure::failed(
            "the file is binary; expected a text table (CSV, TSV or a recorder's export)",
        )),
        None => Ok(()),
    }
}

/// Whether there are more zero bytes than a fault in a text would leave.
fn is_binary(head: &[u8]) -> bool {
    head.iter().filter(|byte| **byte == 0).count() > head.len() / 100
}
