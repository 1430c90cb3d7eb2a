//! Before a launch: what the strap allows, which check is asked for, what the last one found.

use crate::boot::Seat;
use signals::{Preflight, Strap};

/// Checks on deck; the loop makes them, this only carries question and answer.
#[derive(Clone, Copy, Debug)]
pub struct Deck {
    strap: Strap,
    wanted: Option<bool>,
    /// Of the last check; none was made.
    found: Option<Preflight>,
}

impl Deck {
    pub(crate) const fn new() -> Self {
        Self { strap: Strap::None, wanted: None, found: None }
    }

    /// The strap as it is now.
    pub const fn strapped(&mut self, strap: Strap) {
        self.strap = strap;
    }

    /// The board is a backseat: no frame of a host is flown.
    pub(crate) fn is_backseat(&self) -> bool {
        self.strap == Strap::Backseat
    }

    /// No hello and no order makes a deployed vehicle fly on a host's frames, or a bench board on its own sensors.
    pub(crate) fn allows(&self, seat: Seat) -> bool {
        match self.strap {
            Strap::None => true,
            Strap::Bench => seat != Seat::Sensors,
            Strap::Deployment => seat == Seat::Sensors,
            Strap::Backseat => seat == Seat::Backseat,
        }
    }

    pub(crate) fn ask(&mut self, stroke: bool) -> Preflight {
        self.wanted = Some(stroke || self.wanted == Some(true));
        self.found.unwrap_or_default()
    }

    /// The check that is asked for, once: with a stroke or without.
    pub const fn take(&mut self) -> Option<bool> {
        self.wanted.take()
    }

    /// What a check found.
    pub fn found(&mut self, found: Preflight) {
        let number = self.found.map_or(0, |last| last.number).saturating_add(1);
        self.found = Some(Preflight { strap: self.strap, number, ..found });
    }
}

#[cfg(test)]
mod tests {
    use crate::{Boot, Helm, RamStorage};
    use control::Config;
    use signals::{Mission, Refusal, Strap, ToBoard, ToHost};

    #[test]
    fn the_strap_decides_and_no_message_does() {
        for (strap, begin, launch) in
            [(Strap::None, true, true), (Strap::Bench, true, false), (Strap::Deployment, false, true), (Strap::Backseat, false, false)]
        {
            for (message, allowed) in [(ToBoard::Begin(Mission::default()), begin), (ToBoard::Launch(Mission::default()), launch)] {
                let mut helm = Helm::new(Config::default(), Boot::NEW, RamStorage::new());
                helm.deck.strapped(strap);
                helm.handle(ToBoard::Hello { nonce: 1 });
                let said = helm.handle(message.clone());
                assert_eq!(matches!(said, ToHost::Ready { .. }), allowed, "{strap:?} {message:?}: {said:?}");
                assert!(allowed || said == ToHost::Refused(Refusal::Strap));
            }
        }
    }

    #[test]
    fn a_check_is_made_once_and_on_deck_only() {
        let mut helm = Helm::new(Config::default(), Boot::NEW, RamStorage::new());
        helm.handle(ToBoard::Hello { nonce: 1 });
        assert!(matches!(helm.handle(ToBoard::Check { stroke: true }), ToHost::Checked(p) if p.number == 0));
        helm.handle(ToBoard::Check { stroke: false });
        assert_eq!((helm.deck.take(), helm.deck.take()), (Some(true), None), "a stroke that is asked for is not forgotten");
        helm.deck.found(Default::default());
        assert!(matches!(helm.handle(ToBoard::Check { stroke: false }), ToHost::Checked(p) if p.number == 1));
        helm.handle(ToBoard::Launch(Mission::default()));
        assert_eq!(helm.handle(ToBoard::Check { stroke: true }), ToHost::Refused(Refusal::UnderWay));
    }
}
