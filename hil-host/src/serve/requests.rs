//! What the page sends about flights.

use serde::Deserialize;
use std::collections::BTreeMap;

/// A dropped file.
#[derive(Debug, Deserialize)]
pub struct File {
    /// Its name, only for messages and to tell csv from vehicle.
    pub name: String,
    /// Its content, if it is text.
    #[serde(default)]
    pub text: String,
    /// Its content, if it may not be text.
    #[serde(default)]
    pub base64: Option<String>,
}

/// `POST /api/open`.
#[derive(Debug, Deserialize)]
pub struct Open {
    /// Dropped files: a flight and its vehicle file, or whatever `glider import` reads.
    #[serde(default)]
    pub files: Vec<File>,
    /// Or the number of an offered flight.
    pub listed: Option<usize>,
    /// Or the example: a simulated flight with an effect that its model lacks.
    #[serde(default)]
    pub example: bool,
}

/// `POST /api/evaluate` and `/api/save`.
#[derive(Debug, Deserialize)]
pub struct Evaluate {
    /// Number of the open flight.
    pub flight: usize,
    /// Effects that are on, with the values of their parameters in catalogue order.
    #[serde(default)]
    pub effects: BTreeMap<String, Vec<f64>>,
}

/// `POST /api/own`.
#[derive(Debug, Deserialize)]
pub struct Own {
    /// An effect of one's own, as `glider add` takes it.
    pub expression: String,
}

/// `POST /api/overlay`.
#[derive(Debug, Deserialize)]
pub struct Overlay {
    /// Number of the open flight.
    pub flight: usize,
    /// Number of the one shown with it.
    pub second: usize,
}

/// `POST /api/fit` and `/api/diagnose`.
#[derive(Debug, Deserialize)]
pub struct Fit {
    /// Number of the open flight.
    pub flight: usize,
    /// Effects to fit.
    #[serde(default)]
    pub effects: Vec<String>,
}
