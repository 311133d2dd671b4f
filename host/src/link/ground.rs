//! The floor mode of the shoe: what it should be, and what the shoe has acknowledged.
//!
//! One command is under way at a time, and the next one says what is wanted by then: a line that was down for a while brings
//! the latest, not all that was wanted meanwhile. A shoe that starts anew, or whose tracker is reset, knows nothing of it.

use sohle_shared::step::FloorMode;
use sohle_shared::wire::message::Outcome;

/// Keeps the shoe's floor mode as it is wanted. `None` leaves it to the shoe.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ShoeMode {
    wanted: Option<FloorMode>,
    /// What the shoe has acknowledged; nothing after a reset.
    acknowledged: Option<Option<FloorMode>>,
    /// Number of the command under way, and its mode.
    under_way: Option<(u32, Option<FloorMode>)>,
    /// Modes that were acknowledged so far.
    pub told: u64,
}

impl ShoeMode {
    /// The shoe should have this mode.
    pub fn want(&mut self, mode: Option<FloorMode>) {
        self.wanted = mode;
    }

    /// The mode that is to be sent now, if there is one to send.
    pub fn due(&self) -> Option<Option<FloorMode>> {
        (self.under_way.is_none() && self.acknowledged != Some(self.wanted)).then_some(self.wanted)
    }

    /// The mode was sent as the command of this number.
    pub fn sent(&mut self, number: u32, mode: Option<FloorMode>) {
        self.under_way = Some((number, mode));
    }

    /// A command was answered. The mode, if it was the one under way, and whether the shoe took it. A mode that was refused
    /// is not tried again: it would be refused again.
    pub fn answered(&mut self, number: u32, outcome: &Outcome) -> Option<(Option<FloorMode>, bool)> {
        let (_, mode) = self.under_way.take_if(|(asked, _)| *asked == number)?;
        let taken = *outcome == Outcome::Done;
        self.acknowledged = Some(mode);
        self.told += u64::from(taken);
        Some((mode, taken))
    }

    /// Whether the shoe holds a mode, as far as is known.
    pub fn holds_a_mode(&self) -> bool {
        matches!(self.acknowledged, Some(Some(_))) || matches!(self.under_way, Some((_, Some(_))))
    }

    /// The tracker of the shoe is as new.
    pub fn forgotten(&mut self) {
        self.acknowledged = None;
        self.under_way = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sohle_shared::wire::message::Refusal;

    const STAIRS: Option<FloorMode> = Some(FloorMode::Stairs);

    #[test]
    fn one_command_is_under_way_and_the_latest_mode_follows() {
        let mut shoe = ShoeMode::default();
        assert_eq!(shoe.due(), Some(None), "what an earlier program left on the shoe is taken back");
        shoe.sent(1, None);
        shoe.want(STAIRS);
        shoe.want(Some(FloorMode::Level));
        assert_eq!(shoe.due(), None);
        assert_eq!(shoe.answered(7, &Outcome::Done), None, "another command's answer");
        assert_eq!(shoe.answered(1, &Outcome::Done), Some((None, true)));
        assert_eq!(shoe.due(), Some(Some(FloorMode::Level)));
        shoe.sent(2, Some(FloorMode::Level));
        assert!(shoe.answered(2, &Outcome::Done).is_some() && shoe.due().is_none());
    }

    #[test]
    fn a_shoe_that_starts_anew_is_told_again_and_a_refusal_is_no_reason_to_go_on_asking() {
        let mut shoe = ShoeMode::default();
        shoe.want(STAIRS);
        shoe.sent(1, STAIRS);
        shoe.forgotten();
        assert_eq!(shoe.due(), Some(STAIRS));
        assert_eq!(shoe.answered(1, &Outcome::Done), None, "an answer from before");
        shoe.sent(2, STAIRS);
        assert_eq!(shoe.answered(2, &Outcome::Refused(Refusal::Unsupported)), Some((STAIRS, false)));
        assert_eq!((shoe.due(), shoe.told), (None, 0));
    }
}
