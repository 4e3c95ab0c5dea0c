//! Reports as rows of text, for the terminal and the inspector.

use orograph_graph::{Balance, Measure, Report, plain};

use super::terminal::{Align, Page, Table};

/// The smallest volume in m³ that is written in km³.
const LARGE_M3: f64 = 1e8;

/// A name as text: `uplift_course` is "uplift course".
#[must_use]
pub fn words(name: &str) -> String {
    name.replace('_', " ")
}

/// A measure's value with four significant digits, and its unit.
#[must_use]
pub fn value(measure: &Measure) -> String {
    if measure.value.is_finite() {
        format!("{} {}", significant(measure.value), measure.unit).trim_end().to_owned()
    } else {
        "undefined".to_owned()
    }
}

/// The rows of a balance below its material: signs, names and volumes, then the error.
#[must_use]
pub fn rows(balance: &Balance) -> Vec<[String; 2]> {
    let row = |sign: &str, name: &str, m3: f64| [format!("{sign}{}", words(name)), volume(m3)];
    let mut rows = vec![row("", "start", balance.start)];
    rows.extend(balance.gained.iter().map(|amount| row("+ ", &amount.name, amount.volume)));
    rows.extend(balance.lost.iter().map(|amount| row("− ", &amount.name, amount.volume)));
    rows.push(row("", "end", balance.end));
    rows.push(["unaccounted for".to_owned(), format!("{:.1e} of what moved", balance.error)]);
    rows
}

/// The measures, ledger and notes of a report, for the terminal.
#[must_use]
pub fn text(report: &Report, page: Page) -> String {
    let mut table = Table::new(&[("", Align::Left), ("", Align::Right)]);
    for measure in &report.measures {
        // the name by which an expectation calls it
        table.row([measure.name.clone(), value(measure)]);
    }
    for balance in &report.ledger {
        table.row([page.bold(&words(&balance.material)), String::new()]);
        for [name, value] in rows(balance) {
            table.row([format!("  {name}"), value]);
        }
    }
    let notes: String = report.notes.iter().map(|note| page.paragraphs(note, 2) + "\n").collect();
    table.render(page, 2) + &notes
}

/// A volume in m³ or km³.
fn volume(m3: f64) -> String {
    if m3.abs() >= LARGE_M3 { format!("{} km³", significant(m3 / 1e9)) } else { format!("{} m³", significant(m3)) }
}

/// A number with four significant digits.
#[must_use]
pub fn significant(value: f64) -> String {
    plain(format!("{value:.3e}").parse().unwrap_or(value))
}

#[cfg(test)]
mod tests {
    use orograph_graph::Balance;

    use super::rows;

    #[test]
    fn a_balance_reads_from_start_to_error() {
        let ice = Balance::new("ice", 0.0, &[("snow", 2.5e9)], &[("left_the_world", 1.5e9)], 9.999_999e8);
        let rows: Vec<String> = rows(&ice).iter().map(|row| row.join(": ")).collect();
        assert_eq!(
            rows,
            [
                "start: 0 m³",
                "+ snow: 2.5 km³",
                "− left the world: 1.5 km³",
                "end: 1 km³",
                "unaccounted for: 4.0e-8 of what moved"
            ]
        );
    }
}
