//! Before a launch: what the strap allows, which check is asked for, what the last one found.

use crate::mark::Seat;
use signals::{Preflight, Strap};

/// Checks on deck; the loop makes them, this only carries question and answer.
#[derive(Clone, Copy, Debug)]
pub struct Deck {
    strap: Strap,
    wanted: Option<bool>,
    /// Of the last check; none was made.
    found: Option<Preflight>,
    /// The chip's option bytes, and whether they are to be set.
    options: Option<u32>,
    set_options: bool,
}

impl Deck {
    pub(crate) const fn new() -> Self {
        Self { strap: Strap::None, wanted: None, found: None, options: None, set_options: false }
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

    /// The chip's option bytes are these.
    pub const fn options_are(&mut self, options: Option<u32>) {
        self.options = options;
    }

    /// Whether they are to be set now, once.
    pub const fn take_options(&mut self) -> bool {
        core::mem::replace(&mut self.set_options, false)
    }

    pub(crate) fn ask_options(&mut self, set: bool) -> Option<u32> {
        self.set_options |= set;
        self.options
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
    fn option_bytes_are_told_always_and_set_once_on_deck_only() {
        let mut helm = Helm::new(Config::default(), Boot::NEW, RamStorage::new());
        helm.handle(ToBoard::Hello { nonce: 1 });
        assert_eq!(helm.handle(ToBoard::OptionBytes { set: false }), ToHost::OptionBytes(None));
        helm.deck.options_are(Some(7));
        assert!(!helm.deck.take_options());
        assert_eq!(helm.handle(ToBoard::OptionBytes { set: true }), ToHost::OptionBytes(Some(7)));
        helm.handle(ToBoard::OptionBytes { set: false });
        assert_eq!((helm.deck.take_options(), helm.deck.take_options()), (true, false));
        helm.handle(ToBoard::OptionBytes { set: true });
        helm.handle(ToBoard::Launch(Mission::default()));
        assert!(!helm.deck.take_options(), "what was not done before the mission is not done in it");
        assert_eq!(helm.handle(ToBoard::OptionBytes { set: true }), ToHost::Refused(Refusal::UnderWay));
        assert_eq!(helm.handle(ToBoard::OptionBytes { set: false }), ToHost::OptionBytes(Some(7)));
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
