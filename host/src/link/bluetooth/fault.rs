//! What goes wrong on Bluetooth, in one line with what helps.

use super::wanted::Wanted;
use std::io::{self, ErrorKind};

/// Why there is no connection to a shoe.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// The program cannot do it.
    #[error("this program was built without Bluetooth; build it with: cargo build --release --features ble")]
    NotBuilt,
    /// The system's part does not run.
    #[error("Bluetooth does not run on this machine; on Debian: apt-get install bluez && systemctl start bluetooth")]
    NoService,
    /// There is no hardware.
    #[error("this machine has no Bluetooth adapter")]
    NoAdapter,
    /// The hardware is off.
    #[error("the Bluetooth adapter is off; switch it on: rfkill unblock bluetooth && bluetoothctl power on")]
    Off,
    /// The system does not let this user.
    #[error("this user may not use Bluetooth; on Debian: adduser {} bluetooth, then log in anew", user())]
    Forbidden,
    /// The shoe cannot be heard.
    #[error("{}", not_heard(.wanted, .seen))]
    NotHeard {
        /// Which was wanted.
        wanted: Wanted,
        /// What was heard instead.
        seen: Vec<String>,
    },
    /// The shoe refuses whoever it is not paired with.
    #[error(
        "{0} is not paired with this laptop; open its pairing window ('sohle pair PORT' over its cable, or its button), \
         then: bluetoothctl pair {0}"
    )]
    NotPaired(String),
    /// Something answers that is no shoe.
    #[error("{0} has not the services of a shoe")]
    NoShoe(String),
    /// The connection did not come about in time.
    #[error("{0} does not answer")]
    Silent(String),
    /// The system says something else.
    #[error("Bluetooth: {0}")]
    Other(String),
}

fn user() -> String {
    std::env::var("USER").unwrap_or_else(|_| "USER".into())
}

fn not_heard(wanted: &Wanted, seen: &[String]) -> String {
    let what = match wanted {
        Wanted::Any => "no shoe is".to_owned(),
        named => format!("{named} is not"),
    };
    match seen {
        [] => format!("{what} in range, or it is off or connected elsewhere"),
        seen => format!("{what} in range; heard: {}", seen.join(", ")),
    }
}

impl Fault {
    /// What the words of the system mean; `address` is that of the shoe they are about.
    pub fn of(words: &str, address: &str) -> Self {
        let says = |any: &[&str]| any.iter().any(|word| words.contains(word));
        if says(&["ServiceUnknown", "FileNotFound", "NoServer", "NameHasNoOwner"]) {
            Self::NoService
        } else if says(&["AccessDenied", "PermissionDenied"]) {
            Self::Forbidden
        } else if says(&["Error.NotReady", "Error.Blocked"]) {
            Self::Off
        } else if says(&UNPAIRED) && !address.is_empty() {
            Self::NotPaired(address.to_owned())
        } else {
            Self::Other(words.split_whitespace().collect::<Vec<_>>().join(" "))
        }
    }
}

/// BlueZ's names of errors, and the attribute errors 0x05, 0x08, 0x0c and 0x0f, of a link that is not encrypted or not paired.
const UNPAIRED: [&str; 9] = [
    "Error.NotPermitted",
    "Error.NotAuthorized",
    "Error.Authentication",
    "Not paired",
    "ATT error: 0x05",
    "ATT error: 0x08",
    "ATT error: 0x0c",
    "ATT error: 0x0f",
    "nsufficient authentication",
];

impl From<Fault> for io::Error {
    fn from(fault: Fault) -> Self {
        // Each kind of reason is told once while a port is tried again and again.
        let kind = match fault {
            Fault::NotBuilt => ErrorKind::Unsupported,
            Fault::NoService => ErrorKind::NetworkUnreachable,
            Fault::NoAdapter => ErrorKind::NotConnected,
            Fault::Off => ErrorKind::NetworkDown,
            Fault::Forbidden => ErrorKind::PermissionDenied,
            Fault::NotHeard { .. } => ErrorKind::NotFound,
            Fault::NotPaired(_) => ErrorKind::ConnectionRefused,
            Fault::NoShoe(_) => ErrorKind::InvalidData,
            Fault::Silent(_) => ErrorKind::HostUnreachable,
            Fault::Other(_) => ErrorKind::Other,
        };
        Self::new(kind, fault)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_words_of_the_system_are_told_with_what_helps() {
        let bluez = |message: &str, name: &str| format!("Other(DbusError(D-Bus error: {message} ({name})))");
        let shoe = "C0:5E:00:00:00:0A";
        for (message, name, fault) in [
            ("Failed to connect to socket", "org.freedesktop.DBus.Error.FileNotFound", Fault::NoService),
            ("The name org.bluez was not provided", "org.freedesktop.DBus.Error.ServiceUnknown", Fault::NoService),
            ("Rejected send message", "org.freedesktop.DBus.Error.AccessDenied", Fault::Forbidden),
            ("Resource Not Ready", "org.bluez.Error.NotReady", Fault::Off),
            ("Not paired", "org.bluez.Error.NotPermitted", Fault::NotPaired(shoe.into())),
            ("Operation failed with ATT error: 0x0f", "org.bluez.Error.Failed", Fault::NotPaired(shoe.into())),
            ("Authentication Rejected", "org.bluez.Error.AuthenticationRejected", Fault::NotPaired(shoe.into())),
        ] {
            assert_eq!(Fault::of(&bluez(message, name), shoe), fault, "{message}");
        }
        assert_eq!(
            Fault::of("le-connection-abort-by-local\n", shoe).to_string(),
            "Bluetooth: le-connection-abort-by-local"
        );
    }

    #[test]
    fn every_fault_is_one_line() {
        let names = || vec!["Sohle-0001".to_owned(), "Sohle-0002".to_owned()];
        let faults = [
            Fault::NotBuilt,
            Fault::NoService,
            Fault::NoAdapter,
            Fault::Off,
            Fault::Forbidden,
            Fault::NotHeard { wanted: Wanted::Any, seen: Vec::new() },
            Fault::NotHeard { wanted: Wanted::Name("Sohle-0003".into()), seen: names() },
            Fault::NotPaired("C0:5E:00:00:00:0A".into()),
            Fault::NoShoe("C0:5E:00:00:00:0A".into()),
            Fault::Silent("C0:5E:00:00:00:0A".into()),
            Fault::Other("words".into()),
        ];
        let told: Vec<String> = faults.iter().map(ToString::to_string).collect();
        assert!(told.iter().all(|line| !line.contains('\n') && line.len() < 180), "{told:?}");
        assert_eq!(told[5], "no shoe is in range, or it is off or connected elsewhere");
        assert_eq!(told[6], "Sohle-0003 is not in range; heard: Sohle-0001, Sohle-0002");
        assert!(told[7].ends_with("then: bluetoothctl pair C0:5E:00:00:00:0A"));
    }
}
