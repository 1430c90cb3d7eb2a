//! One clock for the flights of a mission: by their dates; else by their own clocks, where one went on through all of them; else one flight
//! right after the other.

use logs::record::flight::Flight;

/// When a flight was.
#[derive(Clone, Debug)]
pub struct When {
    /// Its name, for notes.
    pub name: String,
    /// First and last time of its log, s.
    pub time_s: [f64; 2],
    /// Unix time at which its `time_s` is zero, where that is known.
    pub zero_unix_s: Option<f64>,
}

impl When {
    /// Of a flight.
    #[must_use]
    pub fn of(flight: &Flight, zero_unix_s: Option<f64>) -> Self {
        let [first, last] = [flight.time_s.first(), flight.time_s.last()].map(|t| t.copied().unwrap_or(0.0));
        Self { name: flight.name.clone(), time_s: [first, last], zero_unix_s }
    }
}

/// The flights on one clock.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OneClock {
    /// Which flight comes when: its place among those given, and the second of the mission at which its `time_s` is zero.
    pub flights: Vec<(usize, f64)>,
    /// How they were placed, where that is not plain.
    pub notes: Vec<String>,
}

/// Puts flights on one clock. The first one's `time_s` is kept.
#[must_use]
pub fn one_clock(flights: &[When]) -> OneClock {
    let zeros: Option<Vec<f64>> = flights.iter().map(|f| f.zero_unix_s).collect();
    if let Some(zeros) = zeros {
        return by_dates(flights, &zeros);
    }
    if flights.windows(2).all(|two| two[1].time_s[0] >= two[0].time_s[1]) {
        return OneClock { flights: (0..flights.len()).map(|k| (k, 0.0)).collect(), notes: Vec::new() };
    }
    let undated: Vec<&str> = flights.iter().filter(|f| f.zero_unix_s.is_none()).map(|f| f.name.as_str()).collect();
    let mut out = OneClock::default();
    let mut end_s = None;
    for (k, f) in flights.iter().enumerate() {
        let zero_s = end_s.map_or(0.0, |end| end - f.time_s[0]);
        end_s = Some(zero_s + f.time_s[1]);
        out.flights.push((k, zero_s));
    }
    out.notes.push(format!(
        "days count as if each flight had begun when the one before it ended: {} no date (start_unix_s of an import.json next to flight.csv)",
        match undated.as_slice() {
            [one] => format!("{one} has"),
            many if many.len() == flights.len() => "they have".to_owned(),
            many => format!("{} of {} flights, such as {}, have", many.len(), flights.len(), many.first().copied().unwrap_or_default()),
        }
    ));
    out
}

/// By their dates, the earliest first; `zeros` are the Unix times at which their clocks are zero.
fn by_dates(flights: &[When], zeros: &[f64]) -> OneClock {
    let begin = |k: usize| zeros[k] + flights[k].time_s[0];
    let mut order: Vec<usize> = (0..flights.len()).collect();
    order.sort_by(|a, b| begin(*a).total_cmp(&begin(*b)));
    let mut notes = Vec::new();
    if let Some(first) = order.first().filter(|_| !order.is_sorted()) {
        notes.push(format!("flights are taken in the order of their dates, not as they were named: the first is {}", flights[*first].name));
    }
    for two in order.windows(2) {
        let [a, b] = [&flights[two[0]], &flights[two[1]]];
        let common_s = zeros[two[0]] + a.time_s[1] - begin(two[1]);
        if common_s > 1.0 {
            notes.push(format!("by their dates {} began {common_s:.0} s before {} ended: are both of one vehicle?", b.name, a.name));
        }
    }
    let mission_s = order.first().map_or(0.0, |k| zeros[*k]);
    OneClock { flights: order.into_iter().map(|k| (k, zeros[k] - mission_s)).collect(), notes }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn when(name: &str, time_s: [f64; 2], zero_unix_s: Option<f64>) -> When {
        When { name: name.into(), time_s, zero_unix_s }
    }

    #[test]
    fn regress_dated_flights_lie_by_their_dates_however_they_are_named() {
        let june = when("june", [0.0, 5e3], Some(1.7e9));
        let july = when("july", [10.0, 5e3], Some(1.7e9 + 2e6));
        let named = one_clock(&[june.clone(), july.clone()]);
        assert_eq!(named, OneClock { flights: vec![(0, 0.0), (1, 2e6)], notes: Vec::new() });
        let turned = one_clock(&[july.clone(), june.clone()]);
        assert_eq!(turned.flights, [(1, 0.0), (0, 2e6)]);
        assert!(turned.notes.len() == 1 && turned.notes[0].contains("the first is june"), "{:?}", turned.notes);
        let close = one_clock(&[june, When { zero_unix_s: Some(1.7e9 + 4e3), ..july }]);
        assert!(close.notes.len() == 1 && close.notes[0].contains("july began 990 s before june ended"), "{:?}", close.notes);
    }

    #[test]
    fn regress_a_clock_that_went_on_through_all_flights_is_kept() {
        let parts = [[0.0, 9e4], [9e4, 2e5], [3e5, 4e5]].map(|time_s| when("part", time_s, None));
        assert_eq!(one_clock(&parts), OneClock { flights: vec![(0, 0.0), (1, 0.0), (2, 0.0)], notes: Vec::new() });
    }

    #[test]
    fn regress_undated_flights_follow_each_other_and_that_is_said() {
        let one = |name: &str, time_s| when(name, time_s, None);
        let own_clocks = one_clock(&[one("a", [0.0, 100.0]), one("b", [0.0, 50.0]), one("c", [20.0, 60.0])]);
        assert_eq!(own_clocks.flights, [(0, 0.0), (1, 100.0), (2, 130.0)]);
        assert!(own_clocks.notes.len() == 1 && own_clocks.notes[0].contains("they have no date"), "{:?}", own_clocks.notes);
        let half_dated = one_clock(&[when("a", [0.0, 100.0], Some(1.7e9)), one("b", [0.0, 50.0])]);
        assert!(half_dated.notes.len() == 1 && half_dated.notes[0].contains("b has no date"), "{:?}", half_dated.notes);
        assert_eq!(one_clock(&[]), OneClock::default());
    }
}
