//! Before a launch: what the strap allows, which check is asked for, what the last one found.

use crate::boot::Seat;
use signals::{Preflight, Strap};

/// Checks on deck; the loop makes them, this only carries question and answer.
#[derive(Clone, Copy, Debug)]
pub struct Deck {
    strap: Strap,
    wanted: Option<bool>,
    found: Preflight,
}

impl Deck {
    pub(crate) const fn new() -> Self {
        Self { strap: Strap::None, wanted: None, found: EMPTY }
    }

    /// The strap as it is now.
    pub const fn strapped(&mut self, strap: Strap) {
        self.strap = strap;
    }

    /// No hello and no order makes a deployed vehicle fly on a host's frames, or a bench board on its own sensors.
    pub(crate) fn allows(&self, seat: Seat) -> bool {
        match self.strap {
            Strap::None => true,
            Strap::Bench => seat != Seat::Sensors,
            Strap::Deployment => seat == Seat::Sensors,
        }
    }

    pub(crate) fn ask(&mut self, stroke: bool) -> Preflight {
        self.wanted = Some(stroke || self.wanted == Some(true));
        self.found
    }

    /// The check that is asked for, once: with a stroke or without.
    pub const fn take(&mut self) -> Option<bool> {
        self.wanted.take()
    }

    /// What a check found.
    pub const fn found(&mut self, mut found: Preflight) {
        found.strap = self.strap;
        found.number = self.found.number.saturating_add(1);
        self.found = found;
    }

    /// What the last check found.
    #[must_use]
    pub const fn last(&self) -> &Preflight {
        &self.found
    }
}

/// Nothing found: `Default` is not const.
const EMPTY: Preflight = {
    use signals::{Micros, Reading, SensorFrame, Stroke, Surface, Switch, Weight};
    let frame = SensorFrame {
        seq: 0,
        time: Micros(0),
        depth_m: Reading::Missing,
        depth2_m: Reading::Missing,
        pitch_rad: Reading::Missing,
        roll_rad: Reading::Missing,
        heading_rad: Reading::Missing,
        ballast_m3: Reading::Missing,
        battery_mass_m: Reading::Missing,
        fin_rad: Reading::Missing,
        density_kg_m3: Reading::Missing,
        altitude_m: Reading::Missing,
        battery_v: Reading::Missing,
        charge: Reading::Missing,
        vacuum_pa: Reading::Missing,
        leak: Switch::Unknown,
        weight: Weight::Unknown,
        surface: Surface { gps_fix: false, comms: false },
    };
    Preflight {
        number: 0,
        frame,
        pressure_pa: Reading::Missing,
        pump: Stroke::Never,
        mass: Stroke::Never,
        strap: Strap::None,
        log_bytes: 0,
        sentences: (0, 0),
    }
};

#[cfg(test)]
mod tests {
    use crate::{Boot, Helm, RamStorage};
    use control::Config;
    use signals::{Mission, Refusal, Strap, ToBoard, ToHost};

    #[test]
    fn the_strap_decides_and_no_message_does() {
        for (strap, begin, launch) in [(Strap::None, true, true), (Strap::Bench, true, false), (Strap::Deployment, false, true)] {
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
