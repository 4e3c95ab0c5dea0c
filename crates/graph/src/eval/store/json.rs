//! Lines and reports as JSON with an exact round-trip.

use std::io;

use crate::{
    lines::{Area, Line, Lines, Vertex},
    report::{Amount, Axis, Balance, Measure, Report, Series},
};

/// Numbers in JSON are written as their bits: JSON has no infinities, and the round-trip must be exact.
type Bits = u64;
/// Label, unit, values, and whether the axis is logarithmic.
type StoredAxis = (String, String, Vec<Bits>, bool);
type StoredAmounts = Vec<(String, Bits)>;
/// Material, start, gained, lost, end and error.
type StoredBalance = (String, Bits, StoredAmounts, StoredAmounts, Bits, Bits);
/// Name, both axes, and the reference whose curve it is.
type StoredSeries = (String, StoredAxis, StoredAxis, Option<String>);
/// Measures, series, ledger and notes.
type StoredReport = (Vec<(String, Bits, String)>, Vec<StoredSeries>, Vec<StoredBalance>, Vec<String>);

/// Order, index of the line downstream, and the numbers of the vertices.
type StoredLine = (u32, Option<u32>, Vec<[Bits; 6]>);
/// Lines, then the number of rings and the numbers of each area, and whether the lines are draped.
type StoredLines = (Vec<StoredLine>, Vec<(u32, [Bits; 6])>, bool);

pub(super) fn encode_report(report: &Report) -> io::Result<Vec<u8>> {
    let axis = |axis: &Axis| -> StoredAxis {
        (axis.label.clone(), axis.unit.clone(), axis.values.iter().map(|v| v.to_bits()).collect(), axis.log)
    };
    let measures = report.measures.iter().map(|m| (m.name.clone(), m.value.to_bits(), m.unit.clone()));
    let series = report.series.iter().map(|s| (s.name.clone(), axis(&s.x), axis(&s.y), s.of.clone()));
    let amounts = |amounts: &[Amount]| amounts.iter().map(|a| (a.name.clone(), a.volume.to_bits())).collect();
    let ledger = report.ledger.iter().map(|b| {
        let [start, end, error] = [b.start, b.end, b.error].map(f64::to_bits);
        (b.material.clone(), start, amounts(&b.gained), amounts(&b.lost), end, error)
    });
    let stored: StoredReport = (measures.collect(), series.collect(), ledger.collect(), report.notes.clone());
    Ok(serde_json::to_vec(&stored)?)
}

pub(super) fn decode_report(json: &[u8]) -> io::Result<Report> {
    let (measures, series, ledger, notes): StoredReport = serde_json::from_slice(json)?;
    let axis = |(label, unit, values, log): StoredAxis| Axis {
        label,
        unit,
        values: values.into_iter().map(f64::from_bits).collect(),
        log,
    };
    let measures = measures.into_iter().map(|(name, bits, unit)| Measure { name, value: f64::from_bits(bits), unit });
    let series = series.into_iter().map(|(name, x, y, of)| Series { name, x: axis(x), y: axis(y), of });
    let amounts = |amounts: StoredAmounts| {
        amounts.into_iter().map(|(name, bits)| Amount { name, volume: f64::from_bits(bits) }).collect()
    };
    let ledger = ledger.into_iter().map(|(material, start, gained, lost, end, error)| {
        let [start, end, error] = [start, end, error].map(f64::from_bits);
        Balance { material, start, gained: amounts(gained), lost: amounts(lost), end, error }
    });
    Ok(Report { measures: measures.collect(), series: series.collect(), ledger: ledger.collect(), notes })
}

pub(super) fn encode_lines(lines: &Lines) -> io::Result<Vec<u8>> {
    let stored = lines.lines.iter().map(|line| -> StoredLine {
        let vertices = line.vertices.iter().map(|vertex| vertex.numbers().map(f64::to_bits));
        (line.order, line.downstream, vertices.collect())
    });
    let areas = lines.areas.iter().map(|area| (area.rings, area.numbers().map(f64::to_bits)));
    let stored: StoredLines = (stored.collect(), areas.collect(), lines.draped);
    Ok(serde_json::to_vec(&stored)?)
}

pub(super) fn decode_lines(json: &[u8]) -> io::Result<Lines> {
    let (lines, areas, draped): StoredLines = serde_json::from_slice(json)?;
    let lines = lines.into_iter().map(|(order, downstream, vertices)| Line {
        order,
        downstream,
        vertices: vertices.into_iter().map(|bits| Vertex::from_numbers(bits.map(f64::from_bits))).collect(),
    });
    let areas = areas.into_iter().map(|(rings, bits)| Area::from_numbers(rings, bits.map(f64::from_bits)));
    Ok(Lines { lines: lines.collect(), areas: areas.collect(), draped })
}
