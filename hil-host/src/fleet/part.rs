//! The table of dives: one row a dive, in the order of vehicles, deployments, flights and dives.
//!
//! Columns: `dive`, `segment`, `rows`; `vehicle`, `deployment`, `flight`, `left_out` (why a flight has no dives; empty else); `start_s`,
//! `depth_m`, `noise_m_s`; `information_A_B` and `vector_A` of the eight numbers of a history, in their sizes (N and u of
//! [`discovery::history::summary`]); and for every number that dives are asked for `NAME`, `NAME_noise`, `NAME_calibration`
//! in its unit ([`discovery::workbench::dive_estimates`]). Units stand in the metadata of the file under `units`.

use std::path::Path;

use anyhow::{Context as _, bail, ensure};
use discovery::history::numbers::{ALL, NUMBERS};
use discovery::workbench::dive_estimates::{Asked, Estimated, asked};
use logs::export::table::Table;
use logs::record::bounded;
use serde::{Deserialize, Serialize};

use rig::shards::shard::Shard;

/// One dive as it is kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DiveRow {
    /// Number in its flight, from 1; 0 in the row of a flight that was left out.
    pub dive: i32,
    /// Segment of its flight.
    pub segment: i32,
    /// Rows compared.
    pub rows: i32,
    /// In the order of [`number_columns`].
    pub numbers: Vec<f64>,
}

/// A row of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Name and hash of its vehicle file.
    pub vehicle: String,
    /// Folder of its flight.
    pub deployment: String,
    /// Its flight.
    pub flight: String,
    /// Why the flight was left out; empty where it was not.
    pub left_out: String,
    /// What the dive says.
    pub dive: DiveRow,
}

impl Row {
    fn place(&self) -> (&str, &str, &str, i32) {
        (&self.vehicle, &self.deployment, &self.flight, self.dive.dive)
    }

    /// Equal bit by bit: NaN is itself here.
    fn is_same(&self, other: &Self) -> bool {
        let bits = |r: &Self| r.dive.numbers.iter().map(|v| if v.is_nan() { u64::MAX } else { v.to_bits() }).collect::<Vec<_>>();
        let rest = |r: &Self| (r.left_out.clone(), r.dive.segment, r.dive.rows);
        self.place() == other.place() && rest(self) == rest(other) && bits(self) == bits(other)
    }
}

/// Names of the columns of numbers.
#[must_use]
pub fn number_columns() -> Vec<String> {
    let mut out: Vec<String> = ["start_s", "depth_m", "noise_m_s"].map(str::to_owned).to_vec();
    for (i, a) in ALL.iter().enumerate() {
        out.extend(ALL[i..].iter().map(|b| format!("information_{}_{}", a.name, b.name)));
    }
    out.extend(ALL.iter().map(|n| format!("vector_{}", n.name)));
    for Asked { name, .. } in asked() {
        out.extend(["", "_noise", "_calibration"].map(|part| format!("{name}{part}")));
    }
    out
}

/// A dive as it is kept.
#[must_use]
pub fn dive_row(number: usize, of: &Estimated) -> DiveRow {
    let whole = |n: usize| i32::try_from(n).unwrap_or(i32::MAX);
    let u = &of.unit;
    let deepest_pa = u.rows.iter().map(|r| r.pressure_pa).fold(0.0, f64::max);
    let mut numbers = vec![u.start_s(), deepest_pa / 1e4, of.noise_m_s];
    for i in 0..NUMBERS {
        numbers.extend((i..NUMBERS).map(|j| of.says.n[(i, j)]));
    }
    numbers.extend(of.says.u.iter());
    numbers.extend(of.estimates.iter().flat_map(|e| [e.value, e.noise, e.calibration]));
    DiveRow { dive: whole(number), segment: whole(u.segment as usize), rows: whole(u.rows.len()), numbers }
}

/// The dives of a fleet, or of a shard of it.
#[derive(Clone, Debug, Default)]
pub struct Part {
    /// Which shard; none where it is all of it.
    pub shard: Option<Shard>,
    /// Columns of numbers.
    pub columns: Vec<String>,
    /// In order.
    pub rows: Vec<Row>,
}

impl Part {
    /// With its rows in order.
    #[must_use]
    pub fn new(shard: Option<Shard>, mut rows: Vec<Row>) -> Self {
        rows.sort_by(|a, b| a.place().cmp(&b.place()));
        Self { shard, columns: number_columns(), rows }
    }

    /// As Parquet: equal parts give equal bytes.
    ///
    /// # Errors
    /// What the writer says.
    pub fn bytes(&self) -> anyhow::Result<Vec<u8>> {
        let units: serde_json::Map<String, serde_json::Value> = asked().iter().map(|a| (a.name.to_owned(), a.unit.into())).collect();
        let mut about = vec![("units".to_owned(), serde_json::Value::from(units).to_string())];
        about.extend(self.shard.map(|s| ("shard".to_owned(), s.to_string())));
        let text = |of: fn(&Row) -> &String| self.rows.iter().map(|r| of(r).clone()).collect::<Vec<_>>();
        let whole = |of: fn(&DiveRow) -> i32| self.rows.iter().map(|r| of(&r.dive)).collect::<Vec<_>>();
        let number = |k: usize| self.rows.iter().map(|r| r.dive.numbers.get(k).copied().unwrap_or(f64::NAN)).collect::<Vec<_>>();
        let table = Table {
            about,
            whole: vec![("dive".into(), whole(|d| d.dive)), ("segment".into(), whole(|d| d.segment)), ("rows".into(), whole(|d| d.rows))],
            texts: vec![
                ("vehicle".into(), text(|r| &r.vehicle)),
                ("deployment".into(), text(|r| &r.deployment)),
                ("flight".into(), text(|r| &r.flight)),
                ("left_out".into(), text(|r| &r.left_out)),
            ],
            numbers: self.columns.iter().enumerate().map(|(k, c)| (c.clone(), number(k))).collect(),
        };
        let mut bytes = Vec::new();
        table.write("dives", &mut bytes)?;
        Ok(bytes)
    }

    /// Reads one.
    ///
    /// # Errors
    /// No such file, or no table of dives.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let name = path.display();
        let file = bounded::file(path, bounded::LOG).with_context(|| format!("{name}: cannot be read"))?;
        let table = Table::read(file).with_context(|| format!("{name}: is no Parquet file, or cut; make it anew with glider fleet"))?;
        let whole = |name: &str| table.whole.iter().find(|c| c.0 == name).map_or(&[][..], |c| &c.1);
        let n = table.text("flight").len();
        let texts = ["vehicle", "deployment", "flight", "left_out"].map(|c| table.text(c));
        let wholes = ["dive", "segment", "rows"].map(whole);
        let sound = texts.iter().all(|c| c.len() == n) && wholes.iter().all(|c| c.len() == n);
        ensure!(sound, "{name}: is no table of dives; glider fleet writes one");
        let shard = table.about.iter().find(|a| a.0 == "shard");
        let shard = shard.map(|a| a.1.parse().map_err(|e| anyhow::anyhow!("{name}: shard {e}"))).transpose()?;
        let rows = (0..n).map(|i| Row {
            vehicle: texts[0][i].clone(),
            deployment: texts[1][i].clone(),
            flight: texts[2][i].clone(),
            left_out: texts[3][i].clone(),
            dive: DiveRow {
                dive: wholes[0][i],
                segment: wholes[1][i],
                rows: wholes[2][i],
                numbers: table.numbers.iter().map(|c| c.1.get(i).copied().unwrap_or(f64::NAN)).collect(),
            },
        });
        Ok(Self { shard, rows: rows.collect(), columns: table.numbers.iter().map(|c| c.0.clone()).collect() })
    }

    /// All parts together; `names` are those of their files.
    ///
    /// # Errors
    /// A shard is missing, parts were made by different programs, or two disagree on a dive.
    pub fn merged(parts: Vec<Self>, names: &[String]) -> anyhow::Result<Self> {
        let columns = number_columns();
        if let Some(k) = parts.iter().position(|p| p.columns != columns) {
            bail!("{}: has the columns of another version of glider; make it anew with this one", names[k]);
        }
        let shards: Vec<Shard> = parts.iter().filter_map(|p| p.shard).collect();
        for of in shards.iter().map(|s| s.of) {
            let missing = (1..=of).find(|number| !shards.contains(&Shard { number: *number, of }));
            if let Some(number) = missing.filter(|_| parts.iter().all(|p| p.shard.is_some())) {
                bail!(
                    "the part of shard {number}/{of} is missing; make it with glider fleet … --shard {number}/{of}, and name all {of} parts"
                );
            }
        }
        let mut out = Self::new(None, parts.into_iter().flat_map(|p| p.rows).collect());
        let mut clash = None;
        out.rows.dedup_by(|b, a| {
            let same_place = a.place() == b.place();
            if same_place && !a.is_same(b) {
                clash = Some(format!("{}/{}, dive {}", a.deployment, a.flight, a.dive.dive));
            }
            same_place
        });
        if let Some(which) = clash {
            bail!("two parts disagree on {which}: they are of another flight of this name, or of another program; make both with this one");
        }
        Ok(out)
    }

    /// A column of numbers.
    #[must_use]
    pub fn place_of(&self, column: &str) -> Option<usize> {
        self.columns.iter().position(|c| c == column)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(flight: &str, dive: i32, value: f64) -> Row {
        let numbers = vec![value; number_columns().len()];
        let dive = DiveRow { dive, segment: dive, rows: 9, numbers };
        Row { vehicle: "v".into(), deployment: "d".into(), flight: flight.into(), left_out: String::new(), dive }
    }

    fn merged(parts: Vec<Part>) -> anyhow::Result<Part> {
        let names: Vec<String> = (0..parts.len()).map(|k| format!("part {k}")).collect();
        Part::merged(parts, &names)
    }

    #[test]
    fn merging_does_not_depend_on_order_and_repeated_rows() {
        let part = |shard: Option<(usize, usize)>, rows| Part::new(shard.map(|(number, of)| Shard { number, of }), rows);
        let all = part(None, vec![row("a", 1, 1.0), row("b", 1, f64::NAN), row("b", 2, 3.0)]).bytes().expect("bytes");
        let two = || part(Some((2, 2)), vec![row("b", 2, 3.0), row("b", 1, f64::NAN)]);
        let one = || part(Some((1, 2)), vec![row("a", 1, 1.0)]);
        for parts in [vec![one(), two()], vec![two(), one()], vec![two(), one(), two()]] {
            assert_eq!(merged(parts).expect("merged").bytes().expect("bytes"), all);
        }
        let said = |parts| format!("{:#}", merged(parts).expect_err("refused"));
        assert!(said(vec![two()]).contains("--shard 1/2"));
        assert!(said(vec![one(), two(), part(Some((1, 2)), vec![row("a", 1, 1.5)])]).contains("d/a, dive 1"));
        let mut old = one();
        old.columns.pop();
        assert!(said(vec![two(), old]).contains("part 1"));
    }
}
