//! What was measured, and what is stated of the vehicle: flights and vehicle files, from and to files.
//!
//! Folders in the order in which they may use each other: [`channels`] (the one table of what is measured), [`record`] (a flight), [`vehicle`] (a vehicle file), [`import`] (files of
//! other people's gliders), [`export`] (files for other people's tools).
//!
//! # Words
//!
//! * **flight**: columns in SI units, a value a row, NaN where there is none.
//! * **segment**: what lies between two surfacings.
//! * **note**: what an import found and did; **left out**: what it could not use, and why.
//!
//! # Dependencies
//!
//! * `csv`: tables
//! * `netcdf-reader`, `hdf5-reader`, `netcdf-writer`: NetCDF without a C library
//! * `parquet`: tables of dives
//! * `mcap`: for viewers of robot logs
//! * `lz4_flex`, `flate2`: compressed Slocum and Seaglider files
//! * `gsw`: density of sea water (TEOS-10)
//! * `igrf`, `time`: magnetic variation by date and place
//! * `exmex`: expressions that a user writes
//! * `strsim`: which key a slip is nearest to
//! * `crc`: checks of MIDAS records
//! * `sha2`: which bytes a result was made from
//! * `serde`, `serde_json`, `toml`: vehicle files

pub mod channels;
pub mod digest;
pub mod export;
pub mod import;
pub mod record;
pub mod stop;
pub mod vehicle;

pub use record::flight::Flight;
pub use vehicle::Vehicle;

#[cfg(test)]
mod tests;
