//! A shoe on Bluetooth LE as a port: its two streams of bytes, like those of a cable.
//!
//! [`radio`] finds the [`wanted`] shoe and connects to it by whatever implements [`radio::Radio`]: the adapter of this
//! machine ([`system`], with the feature `ble`), or one that is made up for a test. [`pipe`] makes a reader and a writer of the
//! connection, which the [`transport`](super::transport) keeps open like any other port. What can go wrong is a
//! [`fault`], told in one line with what helps.

pub mod fault;
#[cfg(test)]
mod lost;
pub mod pipe;
pub mod radio;
#[cfg(feature = "ble")]
mod system;
pub mod wanted;

use fault::Fault;
use pipe::{Reader, Writer};
use radio::{Radio, Sighting};
use std::time::Duration;
use wanted::Wanted;

/// A shoe that cannot be heard for so long is not there. Advertisements may be a second apart.
const PATIENCE: Duration = Duration::from_secs(8);

/// Connects to the shoe over this machine's adapter.
pub fn open(wanted: &Wanted) -> Result<(Reader, Writer), Fault> {
    let line = radio::connect(&mut *adapter()?, wanted, PATIENCE)?;
    Ok(pipe::ends(line))
}

/// The shoes that this machine's adapter hears within a time, the strongest first.
pub fn in_range(time: Duration) -> Result<Vec<Sighting>, Fault> {
    let mut seen = adapter()?.search(time, &|_| false)?;
    seen.sort_by_key(|shoe| std::cmp::Reverse(shoe.signal_dbm));
    Ok(seen)
}

#[cfg(feature = "ble")]
fn adapter() -> Result<Box<dyn Radio>, Fault> {
    Ok(Box::new(system::System::new()?))
}

#[cfg(not(feature = "ble"))]
fn adapter() -> Result<Box<dyn Radio>, Fault> {
    Err(Fault::NotBuilt)
}
