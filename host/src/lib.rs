//! The laptop's side of Sohle.
