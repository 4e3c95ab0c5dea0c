//! The record of events, and the exponents of their sizes.

use orograph_graph::{Axis, Balance, Report, Series};

use super::{draw::Kind, land::Ledger};
use crate::numerics::math;

/// Rows of the table of events; of more events, the largest are kept.
const MOST_ROWS: usize = 4096;
/// Fewest events from which an exponent is fitted.
const FEWEST: usize = 30;
/// Cut-offs that are tried in a fit.
const CUTS: usize = 64;

/// A slide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Event {
    pub kind: Kind,
    pub place_m: [f64; 2],
    pub time_yr: f64,
    /// Area of the scar, in the map.
    pub area_m2: f64,
    /// Volume of the scar.
    pub volume_m3: f64,
    pub runout_m: f64,
    pub drop_m: f64,
}

/// A power law p(x) ~ x^(−exponent) above `least`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tail {
    pub exponent: f64,
    pub least: f64,
    pub count: usize,
}

/// Fits the tail of a distribution by maximum likelihood, with the cut-off at which the distribution above it is
/// nearest to its fit: A. Clauset, C. R. Shalizi and M. E. J. Newman (2009). Returns None when there are too few
/// values.
pub(super) fn tail(values: impl Iterator<Item = f64>) -> Option<Tail> {
    let mut logs: Vec<f64> = values.filter(|value| *value > 0.0).map(math::ln).collect();
    logs.sort_unstable_by(f64::total_cmp);
    let last = logs.len().checked_sub(FEWEST)?;
    let mut best: Option<(f64, Tail)> = None;
    for cut in 0..CUTS {
        let first = last * cut / CUTS;
        let above = &logs[first..];
        let count = above.len();
        let sum: f64 = above.iter().map(|log| log - above[0]).sum();
        if sum <= 0.0 {
            continue;
        }
        let exceeded = count as f64 / sum;
        // the largest distance of the cumulative distributions
        let distance = above.iter().enumerate().fold(0.0_f64, |most, (k, log)| {
            let fitted = 1.0 - math::exp(-exceeded * (log - above[0]));
            let found = [k, k + 1].map(|k| (k as f64 / count as f64 - fitted).abs());
            most.max(found[0]).max(found[1])
        });
        if best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, Tail { exponent: 1.0 + exceeded, least: math::exp(above[0]), count }));
        }
    }
    best.map(|(_, tail)| tail)
}

/// Fits V = k A^γ: the most likely line through the logarithms if those of V scatter normally. Returns γ, or None when
/// there are too few events, or all of one area.
pub(super) fn scaling(pairs: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    let logs: Vec<[f64; 2]> = pairs.map(|(area, volume)| [math::ln(area), math::ln(volume)]).collect();
    if logs.len() < FEWEST {
        return None;
    }
    let mean = [0, 1].map(|k| logs.iter().map(|log| log[k]).sum::<f64>() / logs.len() as f64);
    let sum = |other: usize| logs.iter().map(|log| (log[0] - mean[0]) * (log[other] - mean[other])).sum::<f64>();
    let square = sum(0);
    (square > 0.0).then(|| sum(1) / square)
}

/// What the report says.
pub(super) struct Record {
    pub events: Vec<Event>,
    /// Places that were tested, and those that cells are too coarse for.
    pub tested: usize,
    pub unresolved: usize,
    pub ledger: Ledger,
    pub bulking: f64,
    /// Rock that cells have lost, and soil if there is any, in m³.
    pub rock_m3: f64,
    pub soil_m3: Option<f64>,
    /// Debris that lies on the land at the end.
    pub debris_m3: f64,
}

impl Record {
    /// The balances of rock and soil compare what cells have lost with what slides have broken; that of debris begins
    /// with none.
    fn balances(&self, report: &mut Report) {
        let Ledger { rock, soil, left, .. } = self.ledger;
        report.balance(Balance::new("rock", 0.0, &[("broken", self.rock_m3)], &[("became_debris", rock)], 0.0));
        if let Some(stripped) = self.soil_m3 {
            report.balance(Balance::new("soil", 0.0, &[("stripped", stripped)], &[("became_debris", soil)], 0.0));
        }
        report.balance(Balance::new(
            "debris",
            0.0,
            &[("broken_rock_and_pores", self.bulking * rock), ("stripped_soil", soil)],
            &[("left_the_world", left)],
            self.debris_m3,
        ));
    }

    pub fn report(&self) -> Report {
        let mut report = Report::default();
        let of = |kind: Kind| self.events.iter().filter(move |event| event.kind == kind);
        self.balances(&mut report);
        report.measure("tested_places", self.tested as f64, "");
        report.measure("unresolved_places", self.unresolved as f64, "");
        report.measure("rock_slides", of(Kind::Rock).count() as f64, "");
        report.measure("soil_slides", of(Kind::Soil).count() as f64, "");
        report.measure("debris_moved_again", self.ledger.again, "m³");
        let most = |value: &dyn Fn(&Event) -> f64| self.events.iter().map(value).fold(0.0, f64::max);
        report.measure("scar_area", self.events.iter().map(|event| event.area_m2).sum(), "m²");
        report.measure("largest_area", most(&|event| event.area_m2), "m²");
        report.measure("largest_volume", most(&|event| event.volume_m3), "m³");
        report.measure("longest_runout", most(&|event| event.runout_m), "m");
        let areas = tail(of(Kind::Rock).map(|event| event.area_m2));
        let volumes = tail(of(Kind::Rock).map(|event| event.volume_m3));
        let scaling = scaling(of(Kind::Rock).map(|event| (event.area_m2, event.volume_m3)));
        if let Some(Tail { exponent, least, count }) = areas {
            report.measure("area_exponent", exponent, "");
            report.measure("area_cut_off", least, "m²");
            report.measure("area_tail_count", count as f64, "");
        }
        if let Some(volumes) = volumes {
            report.measure("volume_exponent", volumes.exponent, "");
        }
        if let Some(scaling) = scaling {
            report.measure("volume_area_exponent", scaling, "");
        }
        self.tell(&mut report);
        if self.unresolved > 0 {
            report.notes.push(format!(
                "{} tested places have weak zones shorter than 3 cells, and are left out",
                self.unresolved
            ));
        }
        if areas.is_none() {
            report.notes.push(format!("exponents are fitted from {FEWEST} rock slides on"));
        }
        report
    }

    /// Adds the table of events, in order of time.
    fn tell(&self, report: &mut Report) {
        if self.events.is_empty() {
            return;
        }
        let mut rows: Vec<usize> = (0..self.events.len()).collect();
        if rows.len() > MOST_ROWS {
            let volume = |row: &usize| self.events[*row].volume_m3;
            rows.sort_by(|a, b| volume(b).total_cmp(&volume(a)).then(a.cmp(b)));
            rows.truncate(MOST_ROWS);
            rows.sort_unstable();
            report.notes.push(format!("the table has the {MOST_ROWS} largest of {} events", self.events.len()));
        }
        let axis = |label: &str, unit: &str, value: &dyn Fn(&Event) -> f64| {
            Axis::new(label, unit, rows.iter().map(|row| value(&self.events[*row])).collect())
        };
        let mut series = |name: &str, x: Axis, y: Axis| report.series.push(Series::new(name, x, y));
        series("places", axis("x", "m", &|event| event.place_m[0]), axis("y", "m", &|event| event.place_m[1]));
        series("sizes", axis("area", "m²", &|event| event.area_m2), axis("volume", "m³", &|event| event.volume_m3));
        series("runouts", axis("runout", "m", &|event| event.runout_m), axis("drop", "m", &|event| event.drop_m));
        series(
            "times",
            axis("time", "yr", &|event| event.time_yr),
            axis("soil", "", &|event| f64::from(u8::from(event.kind == Kind::Soil))),
        );
    }
}
