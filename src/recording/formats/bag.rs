//! Files of other programs that are rejected with advice on conversion: ROS 2 bags of SQLite, and HDF5.

use super::bytes::Bytes;
use super::{Content, Format};
use crate::failure::{ErrorCode, Failure};
use crate::io::Reading;

pub(super) const BAG: Format = Format {
    name: "db3",
    called: "not a file that torqcomp can read",
    is,
    takes: &[],
    read,
};

const SQLITE: &[u8] = b"SQLite format 3\0";
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Offset of HDF5 in a MATLAB file.
const BEHIND_MATLAB: usize = 512;

fn is(head: &[u8]) -> bool {
    let begins = [SQLITE, HDF5];
    begins.iter().any(|begin| head.starts_with(begin)) || is_matlab_hdf5(head)
}

/// Whether it is a MATLAB 7.3 file: the version in its header is 2.
fn is_matlab_hdf5(head: &[u8]) -> bool {
    let version = head.get(124..BEHIND_MATLAB.min(128));
    head.starts_with(b"MATLAB") && version.is_some_and(|v| v == b"\0\x02IM" || v == b"\x02\0MI")
}

fn read(bytes: &mut Bytes, _: &Reading) -> Result<Content, Failure> {
    let head = bytes.take(BEHIND_MATLAB as u64)?;
    let message = if head.starts_with(SQLITE) {
        "this is an SQLite database, like a ROS 2 bag (.db3); convert the bag to MCAP with: mcap convert BAG.db3 \
         BAG.mcap, or with: ros2 bag convert -i BAG -o OUT.yaml (storage_id: mcap)"
    } else if is_matlab_hdf5(&head) {
        "this is a MATLAB file of version 7.3 (HDF5); save it with the flag -v7 in MATLAB: save('FILE.mat', 'NAME', '-v7')"
    } else {
        "this is an HDF5 file; export the channels as text, MATLAB 5 (-v7) or MCAP"
    };
    Err(ErrorCode::NotARecording.failed(message))
}
