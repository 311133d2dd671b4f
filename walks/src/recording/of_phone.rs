//! A walk with a phone in the hand: what is kept of it are its steps, which all methods take like those of a shoe.

use super::{Recording, live};
use crate::phone::sample::ReadError;
use crate::phone::{self, Parameters, PhoneSample};
use std::path::Path;

/// Metadata that tells who counted the steps.
const STEPS_OF: &str = "steps_of";
const PHONE: &str = "phone";

impl Recording {
    /// The steps in a recording of a phone, with these settings; its clock counts from 1970.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn of_phone(path: &Path, parameters: &Parameters) -> Result<Self, ReadError> {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self::of_phone_samples(name, &phone::open::open(path)?.samples, parameters))
    }

    /// The steps in what a phone measured, with these settings; its clock counts from 1970.
    pub fn of_phone_samples(name: String, samples: &[PhoneSample], parameters: &Parameters) -> Self {
        let steps = phone::steps(samples, parameters);
        let metadata = [(STEPS_OF, PHONE), (live::BEGAN, "0")].map(|(key, value)| (key.to_owned(), value.to_owned()));
        Self { name, steps, metadata: metadata.into(), ..Self::default() }
    }

    /// Whether a phone counted its steps: their lengths are estimated, and every step is one of both feet.
    pub fn is_of_phone(&self) -> bool {
        self.samples.is_empty() && self.metadata.get(STEPS_OF).is_some_and(|who| who == PHONE)
    }
}
