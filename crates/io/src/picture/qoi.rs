//! QOI: three or four channels, as the picture has them.

use std::io;

use super::whole::Whole;

/// The file of a picture.
pub(super) fn encode<W>(picture: &Whole<W>, values: &[u8]) -> io::Result<Vec<u8>> {
    let [width, height] = picture.size;
    qoi::encode_to_vec(values, width, height).map_err(io::Error::other)
}
