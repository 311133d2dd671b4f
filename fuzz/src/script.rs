//! Bytes as a list of things to do.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// The things to do that `data` holds, as [`written`] writes them. A byte that begins none is passed over, so that a
/// damaged script is still one.
pub fn read<T: DeserializeOwned>(data: &[u8]) -> impl Iterator<Item = T> {
    let mut rest = data;
    std::iter::from_fn(move || {
        loop {
            let (_, after) = rest.split_first()?;
            match postcard::take_from_bytes(rest) {
                // A thing that takes no bytes would be done for ever.
                Ok((thing, left)) if left.len() < rest.len() => {
                    rest = left;
                    return Some(thing);
                }
                _ => rest = after,
            }
        }
    })
}

/// The bytes of a script.
pub fn written<T: Serialize>(script: &[T]) -> Vec<u8> {
    let bytes = |thing| postcard::to_allocvec(thing).expect("a list of plain things can be written");
    script.iter().flat_map(bytes).collect()
}
