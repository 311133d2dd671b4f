//! What a Bluetooth adapter has to do, and how a shoe is found with it.

use super::fault::Fault;
use super::wanted::Wanted;
use std::io;
use std::sync::mpsc::Receiver;
use std::time::Duration;

/// A shoe that was heard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sighting {
    /// What it calls itself.
    pub name: Option<String>,
    /// Six pairs of hexadecimal digits, or what macOS has instead.
    pub address: String,
    /// How strong it is heard. **Units:** dBm.
    pub signal_dbm: Option<i16>,
}

impl Sighting {
    /// The name, or the address of one without.
    pub fn label(&self) -> &str {
        self.name.as_deref().unwrap_or(&self.address)
    }
}

/// Sends a piece of the stream to the shoe.
pub type Send = Box<dyn FnMut(&[u8]) -> io::Result<()> + std::marker::Send>;

/// A connection to a shoe. It ends when `send` is dropped.
pub struct Line {
    /// The pieces of the shoe's stream; it is disconnected when the shoe is.
    pub received: Receiver<Vec<u8>>,
    /// Sends a piece.
    pub send: Send,
    /// The longest piece that can be sent. **Units:** bytes.
    pub piece: usize,
}

/// A Bluetooth adapter.
pub trait Radio {
    /// The shoes that are heard within `time`, or until one is `enough`. Devices that advertise no shoe's service are none.
    fn search(&mut self, time: Duration, enough: &dyn Fn(&Sighting) -> bool) -> Result<Vec<Sighting>, Fault>;

    /// Connects to a shoe that was heard, and listens to its stream.
    fn connect(&mut self, shoe: &Sighting) -> Result<Line, Fault>;
}

/// Connects to the shoe that is wanted; to the one that is heard best if it may be any.
pub fn connect(radio: &mut dyn Radio, wanted: &Wanted, patience: Duration) -> Result<Line, Fault> {
    let seen = radio.search(patience, &|shoe| wanted.is(shoe))?;
    let best = seen.iter().filter(|shoe| wanted.is(shoe)).max_by_key(|shoe| shoe.signal_dbm);
    let Some(shoe) = best else {
        let seen = seen.iter().map(|shoe| shoe.label().to_owned()).collect();
        return Err(Fault::NotHeard { wanted: wanted.clone(), seen });
    };
    radio.connect(shoe)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    /// An adapter that hears what it is told to, and tells whom it was asked to connect to.
    struct Fake {
        heard: Result<Vec<Sighting>, Fault>,
        refuses: Option<Fault>,
        connected: Vec<String>,
    }

    impl Radio for Fake {
        fn search(&mut self, _: Duration, enough: &dyn Fn(&Sighting) -> bool) -> Result<Vec<Sighting>, Fault> {
            let heard = self.heard.clone()?;
            let stop = heard.iter().position(enough).map_or(heard.len(), |found| found + 1);
            Ok(heard.into_iter().take(stop).collect())
        }

        fn connect(&mut self, shoe: &Sighting) -> Result<Line, Fault> {
            self.connected.push(shoe.address.clone());
            match self.refuses.clone() {
                Some(fault) => Err(fault),
                None => Ok(Line { received: channel().1, send: Box::new(|_| Ok(())), piece: 20 }),
            }
        }
    }

    fn fake() -> Fake {
        let shoe = |name: &str, address: &str, signal| Sighting {
            name: Some(name.into()),
            address: address.into(),
            signal_dbm: Some(signal),
        };
        let heard = vec![shoe("Sohle-000A", "C0:5E:00:00:00:0A", -80), shoe("Sohle-000B", "C0:5E:00:00:00:0B", -50)];
        Fake { heard: Ok(heard), refuses: None, connected: Vec::new() }
    }

    fn connected(fake: &mut Fake, wanted: &str) -> Result<String, Fault> {
        connect(fake, &Wanted::parse(wanted).unwrap(), Duration::ZERO)?;
        Ok(fake.connected.pop().unwrap())
    }

    #[test]
    fn the_shoe_that_was_named_is_connected_to() {
        assert_eq!(connected(&mut fake(), "sohle-000b").unwrap(), "C0:5E:00:00:00:0B");
        assert_eq!(connected(&mut fake(), "c0:5e:00:00:00:0b").unwrap(), "C0:5E:00:00:00:0B");
        // The first that is heard will do.
        assert_eq!(connected(&mut fake(), "any").unwrap(), "C0:5E:00:00:00:0A");
    }

    #[test]
    fn what_was_heard_instead_is_told() {
        let mut fake = fake();
        let told = connected(&mut fake, "Sohle-000C").unwrap_err().to_string();
        assert_eq!(told, "Sohle-000C is not in range; heard: Sohle-000A, Sohle-000B");
        assert!(fake.connected.is_empty());
    }

    #[test]
    fn faults_of_adapter_and_shoe_come_through() {
        for fault in [Fault::NoAdapter, Fault::Off, Fault::Forbidden, Fault::NoService] {
            let mut fake = Fake { heard: Err(fault.clone()), ..fake() };
            assert_eq!(connected(&mut fake, "any").unwrap_err(), fault);
        }
        let refusal = Fault::NotPaired("C0:5E:00:00:00:0A".into());
        let mut fake = Fake { refuses: Some(refusal.clone()), ..fake() };
        assert_eq!(connected(&mut fake, "any").unwrap_err(), refusal);
    }
}
