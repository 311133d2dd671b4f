//! What the tracker of a recorded walk is told.

use sohle_shared::step::FloorMode;
use sohle_shared::tracker::Order;

/// Orders to the tracker of a recorded walk: those that the shoe got when it was recorded, else what a building asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Orders {
    /// Recorded orders that were given.
    given: usize,
    /// The floor mode that was asked for last.
    mode: Option<FloorMode>,
}

impl Orders {
    /// Those that are due before the sample of this number; `recorded` are all of the walk, each with its sample.
    pub fn before<'a>(
        &mut self,
        recorded: &'a [(usize, Order)],
        sample: usize,
    ) -> impl Iterator<Item = Order> + use<'a> {
        let later = recorded.get(self.given..).unwrap_or_default();
        let count = later.iter().take_while(|(at, _)| *at <= sample).count();
        self.given += count;
        later[..count].iter().map(|(_, order)| *order)
    }

    /// The tracker is as new, and so is who asks.
    pub fn forget_mode(&mut self) {
        self.mode = None;
    }

    /// The one that follows when the building asks for a floor mode.
    pub fn after(&mut self, recorded: &[(usize, Order)], mode: Option<FloorMode>) -> Option<Order> {
        let changed = mode != std::mem::replace(&mut self.mode, mode);
        (changed && recorded.is_empty()).then_some(Order::FloorMode(mode))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STAIRS: Option<FloorMode> = Some(FloorMode::Stairs);

    #[test]
    fn recorded_orders_come_once_and_take_the_place_of_those_of_a_building() {
        let recorded = [(0, Order::Reset), (5, Order::Init), (5, Order::Track)];
        let mut orders = Orders::default();
        let mut due = |sample| orders.before(&recorded, sample).collect::<Vec<_>>();
        assert_eq!((due(0), due(4)), (vec![Order::Reset], vec![]));
        assert_eq!((due(7), due(9)), (vec![Order::Init, Order::Track], vec![]));
        assert_eq!(orders.after(&recorded, STAIRS), None);
    }

    #[test]
    fn a_mode_is_ordered_when_it_changes() {
        let mut orders = Orders::default();
        assert_eq!(orders.after(&[], None), None);
        assert_eq!(orders.after(&[], STAIRS), Some(Order::FloorMode(STAIRS)));
        assert_eq!(orders.after(&[], STAIRS), None);
        assert_eq!(orders.after(&[], None), Some(Order::FloorMode(None)));
    }
}
