//! A saved state as bytes: a header that shows whether the state fits, then the postcard encoding
//! of shell and model.
//!
//! | bytes | content |
//! |---|---|
//! | 8 | magic |
//! | 4 | format version, little endian |
//! | 1 | interface: 0 model exchange, 1 co-simulation |
//! | 36 | GUID |
//! | 8 | length of the payload, little endian |
//! | 4 | CRC-32 of the payload, little endian |
//! | … | payload |

use crate::types::Interface;

const MAGIC: &[u8; 8] = b"fmi2save";
const VERSION: u32 = 2;
const GUID: usize = 36;
const HEADER: usize = 8 + 4 + 1 + GUID + 8 + 4;

pub(crate) fn wrap(guid: &str, interface: Interface, payload: &[u8]) -> Box<[u8]> {
    let length = payload.len() as u64;
    [
        MAGIC.as_slice(),
        &VERSION.to_le_bytes(),
        &[interface as u8],
        guid.as_bytes(),
        &length.to_le_bytes(),
        &crc32fast::hash(payload).to_le_bytes(),
        payload,
    ]
    .concat()
    .into()
}

/// Returns the payload of `bytes` after checking the header.
///
/// # Errors
/// Says why the bytes are not a state of this FMU.
pub(crate) fn unwrap<'a>(
    guid: &str,
    interface: Interface,
    bytes: &'a [u8],
) -> Result<&'a [u8], String> {
    let Some((header, payload)) = bytes.split_at_checked(HEADER) else {
        return Err(format!(
            "the saved state is truncated: {} bytes, fewer than its header",
            bytes.len()
        ));
    };
    let (magic, header) = header.split_at(MAGIC.len());
    let (version, header) = header.split_at(4);
    let (kind, header) = header.split_at(1);
    let (owner, header) = header.split_at(GUID);
    let (length, checksum) = header.split_at(8);
    if magic != MAGIC {
        return Err("these bytes are not a saved state of an FMU of this project".into());
    }
    if version != VERSION.to_le_bytes() {
        return Err(format!("the saved state has a format version other than {VERSION}"));
    }
    if owner != guid.as_bytes() {
        let owner = String::from_utf8_lossy(owner);
        return Err(format!(
            "the saved state belongs to an FMU with GUID {owner}, but this FMU has {guid}"
        ));
    }
    if kind != [interface as u8] {
        return Err(
            "the saved state is of the other interface (co-simulation or model exchange)".into()
        );
    }
    if length != (payload.len() as u64).to_le_bytes() {
        return Err(format!("the saved state is truncated or too long: {} bytes", bytes.len()));
    }
    if checksum != crc32fast::hash(payload).to_le_bytes() {
        return Err("the saved state is damaged: its checksum does not fit".into());
    }
    Ok(payload)
}
