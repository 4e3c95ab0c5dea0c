//! `orograph run --sweep`: the same graph for several values of a parameter, each into its own folder.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    str::FromStr,
};

use crate::{
    build::request::{Changes, Request, Setting, same_value},
    report::{failure::Failure, terminal::counted},
};

/// Maximum number of terrains of one sweep.
const MAX_BUILDS: usize = 10_000;

/// The name of the world's seed in a sweep.
pub(super) const SEED: &str = "seed";

/// `name=1..20`, `name=0.5..2/0.5` or `name=a,b,c` as typed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sweep {
    /// A parameter of the file or of a node, or `seed`.
    place: String,
    values: Vec<String>,
}

impl Sweep {
    /// The name of the parameter.
    pub(super) fn place(&self) -> &str {
        &self.place
    }

    /// Its values, as text.
    pub(super) fn values(&self) -> &[String] {
        &self.values
    }
}

impl FromStr for Sweep {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (place, values) = text.split_once('=').ok_or("there is no `=`; write `name=1..20` or `name=a,b,c`")?;
        let place = place.trim().to_owned();
        if place.is_empty() {
            return Err("no parameter name; write `name=1..20` or `name=a,b,c`".to_owned());
        }
        let mut all = Vec::new();
        for part in parts(values) {
            match part.split_once("..") {
                Some((from, rest)) if starts_like_a_number(from) => all.extend(range(from, rest)?),
                _ if part.is_empty() => return Err(format!("a value of `{place}` is missing")),
                _ => all.push(part.to_owned()),
            }
            if all.len() > MAX_BUILDS {
                return Err(format!("`{place}` has more than {MAX_BUILDS} values"));
            }
        }
        check_units(&place, &all)?;
        Ok(Self { place, values: all })
    }
}

/// Refuses a list in which some numbers have a unit and others none: in `0.5,1 Myr` the first may be meant as half a year
/// or as half a million.
fn check_units(place: &str, values: &[String]) -> Result<(), String> {
    let is_number = |text: &str| text.parse::<f64>().is_ok();
    let is_unit = |text: &str| text.chars().all(|c| c.is_alphanumeric() || "/²³°%µ^-".contains(c));
    let united = |value: &&String| {
        let (number, unit) = value.split_at(digits_end(value));
        is_number(number.trim()) && !unit.trim().is_empty() && is_unit(unit.trim())
    };
    match (values.iter().find(|value| is_number(value)), values.iter().find(united)) {
        (Some(plain), Some(united)) => Err(format!(
            "`{place}` has `{plain}` without a unit and `{united}` with one; write a unit after each value"
        )),
        _ => Ok(()),
    }
}

/// The elements of a list; commas in brackets do not separate elements.
fn parts(text: &str) -> Vec<&str> {
    let (mut depth, mut start, mut parts) = (0_i32, 0, Vec::new());
    for (at, c) in text.char_indices() {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(text[start..at].trim());
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(text[start..].trim());
    parts
}

fn starts_like_a_number(text: &str) -> bool {
    text.trim_start().starts_with(|c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.'))
}

/// The length of the number, or of `to/step`, that a text begins with.
fn digits_end(text: &str) -> usize {
    let number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '+' | '-' | '/' | 'e' | 'E');
    let end = text.find(|c: char| !number(c)).unwrap_or(text.len());
    // An `e` that begins a unit is not an exponent.
    text[..end].trim_end_matches(['e', 'E']).len()
}

/// The values of `from..to/step`, both ends included; a unit after the last number applies to all.
fn range(from: &str, rest: &str) -> Result<Vec<String>, String> {
    let wrong = || format!("`{from}..{rest}` is not a range; write `1..20`, `0.5..2/0.5` or `1..3/0.5 Myr`");
    let rest = rest.trim();
    let (numbers, unit) = rest.split_at(digits_end(rest));
    let (to, step) = numbers.split_once('/').unwrap_or((numbers, "1"));
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(wrong);
    let (first, last, by) = (number(from)?, number(to)?, number(step)?);
    if by <= 0.0 || last < first {
        return Err(format!(
            "`{from}..{rest}` is empty: the second number must be larger than the first, and the step above 0"
        ));
    }
    // A rounding error of the last step still counts as the end.
    let count = ((last - first) / by * (1.0 + 1e-12) + 1e-9).floor();
    if count >= MAX_BUILDS as f64 {
        return Err(format!("`{from}..{rest}` has more than {MAX_BUILDS} values"));
    }
    let value = |i: u32| {
        // Typed numbers have few digits; computed ones must not have more.
        let exact = first + f64::from(i) * by;
        let rounded: f64 = format!("{exact:.12e}").parse().unwrap_or(exact);
        format!("{rounded} {}", unit.trim()).trim_end().to_owned()
    };
    Ok((0..=count as u32).map(value).collect())
}

/// One terrain of a sweep.
#[derive(Debug)]
pub struct Variant {
    /// The request to build.
    pub request: Request,
    /// The folder for its files.
    pub folder: PathBuf,
    /// The swept values, by name.
    pub values: BTreeMap<String, String>,
}

impl Variant {
    /// The swept values, as text: `seed=3, age=2 Myr`.
    pub fn label(&self) -> String {
        self.values.iter().map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>().join(", ")
    }
}

/// All terrains of sweeps: every combination of values, with the last sweep varying fastest. All are checked before any
/// is built.
///
/// # Errors
/// When a sweep names an unknown parameter or values that do not fit, or when two terrains would share a folder.
pub fn variants(
    request: &Request,
    changes: &Changes,
    sweeps: &[Sweep],
    template: &Path,
) -> Result<Vec<Variant>, Failure> {
    for (at, sweep) in sweeps.iter().enumerate() {
        let same = |other: &str| same_value(&request.document, other, &sweep.place);
        let set = changes.set.iter().find(|setting| same(&setting.place));
        if set.is_some() || sweep.place == SEED && changes.seed.is_some() {
            let what = match set.filter(|set| set.place != sweep.place) {
                Some(set) => format!("`{}` is set and `{}` swept, but they are the same value", set.place, sweep.place),
                None => format!("`{}` is both set and swept", sweep.place),
            };
            return Err(Failure::wrong(what).hint("remove one of them"));
        }
        if let Some(other) = sweeps[..at].iter().find(|other| same(&other.place)) {
            return Err(match other.place == sweep.place {
                true => Failure::wrong(format!("`{}` is swept twice", sweep.place)).hint("write one list of values"),
                false => Failure::wrong(format!("`{}` and `{}` sweep the same value", other.place, sweep.place))
                    .hint("remove one of them"),
            });
        }
    }
    let count = sweeps.iter().try_fold(1_usize, |all, sweep| all.checked_mul(sweep.values.len()));
    if count.is_none_or(|count| count > MAX_BUILDS) {
        return Err(Failure::wrong(format!("the sweeps make more than {MAX_BUILDS} terrains"))
            .hint("several sweeps build every combination of their values"));
    }
    check_template(sweeps, template)?;

    let mut all: Vec<BTreeMap<String, String>> = vec![BTreeMap::new()];
    for sweep in sweeps {
        let with = |known: &BTreeMap<String, String>, value: &String| {
            let mut values = known.clone();
            values.insert(sweep.place.clone(), value.clone());
            values
        };
        all = all.iter().flat_map(|known| sweep.values.iter().map(move |value| with(known, value))).collect();
    }
    let mut folders: BTreeMap<PathBuf, String> = BTreeMap::new();
    let mut variants = Vec::with_capacity(all.len());
    for values in all {
        let mut seed = None;
        let mut settings = Vec::new();
        for (place, value) in &values {
            if place == SEED {
                let number = value.parse().map_err(|_| {
                    Failure::wrong(format!("`--sweep seed={value}`: a seed is a whole number from 0 to {}", u32::MAX))
                })?;
                seed = Some(number);
            } else {
                settings.push(Setting { place: place.clone(), value: value.clone() });
            }
        }
        let request = request.with(&settings, seed, "--sweep")?;
        let folder = filled(template, &values);
        let variant = Variant { request, folder, values };
        let key = PathBuf::from(variant.folder.to_string_lossy().to_lowercase());
        if let Some(other) = folders.insert(key, variant.label()) {
            let (label, folder) = (variant.label(), variant.folder.display());
            return Err(Failure::wrong(format!("`{other}` and `{label}` would both be written to `{folder}`"))
                .hint("remove duplicate values"));
        }
        variants.push(variant);
    }
    Ok(variants)
}

/// Refuses a folder with unknown names in braces, and a folder that several terrains would share.
fn check_template(sweeps: &[Sweep], template: &Path) -> Result<(), Failure> {
    let text = template.to_string_lossy();
    let mut rest = &*text;
    while let Some((name, after)) = rest.split_once('{').and_then(|(_, after)| after.split_once('}')) {
        if !sweeps.iter().any(|sweep| sweep.place == name) {
            let known: Vec<String> = sweeps.iter().map(|sweep| format!("`{{{}}}`", sweep.place)).collect();
            return Err(Failure::wrong(format!("`{{{name}}}` in `{text}` is not the name of a sweep"))
                .hint(format!("the sweeps are {}", known.join(", "))));
        }
        rest = after;
    }
    let missing = sweeps.iter().find(|sweep| sweep.values.len() > 1 && !text.contains(&format!("{{{}}}", sweep.place)));
    if let Some(sweep) = missing {
        let mut all = text.trim_end_matches('/').to_owned();
        for sweep in sweeps.iter().filter(|sweep| !text.contains(&format!("{{{}}}", sweep.place))) {
            all.push_str(&format!("/{{{}}}", sweep.place));
        }
        return Err(Failure::wrong(format!(
            "the {} of `{}` would overwrite each other in `{text}`",
            counted(sweep.values.len(), "terrain"),
            sweep.place
        ))
        .hint(format!("name the folder by the value: `-o \"{all}\"`")));
    }
    Ok(())
}

/// Refuses a new folder that is named by a value, as in a sweep, although there is no sweep.
///
/// # Errors
/// When the folder is refused.
pub(super) fn check_without_sweep(request: &Request, folder: &Path) -> Result<(), Failure> {
    check_is_plain(request, &[], folder, "there is no sweep", |name| {
        format!("add `--sweep {name}=VALUES`, or choose another folder")
    })
}

/// Refuses a new folder that is named by a value, for a cube, which holds all terrains.
///
/// # Errors
/// When the folder is refused.
pub(super) fn check_of_cube(request: &Request, sweeps: &[Sweep], folder: &Path) -> Result<(), Failure> {
    let hint = |_: &str| "choose a folder without names in braces".to_owned();
    check_is_plain(request, sweeps, folder, "one cube holds all terrains", hint)
}

fn check_is_plain(
    request: &Request,
    sweeps: &[Sweep],
    folder: &Path,
    but: &str,
    hint: impl Fn(&str) -> String,
) -> Result<(), Failure> {
    let text = folder.to_string_lossy();
    let parameters = request.document.parameters().iter().map(|parameter| parameter.name.as_str());
    let mut names = parameters.chain([SEED]).chain(sweeps.iter().map(Sweep::place));
    match names.find(|name| text.contains(&format!("{{{name}}}"))).filter(|_| !folder.exists()) {
        Some(name) => Err(Failure::wrong(format!("`{text}` is named by `{name}`, but {but}")).hint(hint(name))),
        None => Ok(()),
    }
}

/// The folder of a terrain: `{name}` is replaced by the value; characters that file names cannot have become `_`.
fn filled(template: &Path, values: &BTreeMap<String, String>) -> PathBuf {
    let plain = |value: &str| -> String {
        let kept = |c: char| c.is_alphanumeric() || matches!(c, '.' | '-' | '+' | '_');
        let text: String = value.chars().map(|c| if kept(c) { c } else { '_' }).collect();
        // A value of dots only would be the current or the parent folder.
        if text.chars().all(|c| c == '.') { "_".to_owned() } else { text }
    };
    let mut text = template.to_string_lossy().into_owned();
    for (name, value) in values {
        text = text.replace(&format!("{{{name}}}"), &plain(value));
    }
    PathBuf::from(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(text: &str) -> Vec<String> {
        text.parse::<Sweep>().expect("a sweep").values
    }

    #[test]
    fn ranges_include_both_ends() {
        assert_eq!(values("seed=1..4"), ["1", "2", "3", "4"]);
        assert_eq!(values("a=0.1..0.5/0.1"), ["0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(values("a=-1..1/0.75"), ["-1", "-0.25", "0.5"]);
        assert_eq!(values("a=1..2/0.5 Myr"), ["1 Myr", "1.5 Myr", "2 Myr"]);
        assert_eq!(values("a=1e6..3e6/1e6"), ["1000000", "2000000", "3000000"]);
        assert_eq!(values("a=7..7"), ["7"]);
    }

    #[test]
    fn lists_split_at_commas_outside_brackets() {
        assert_eq!(values("mode=add, max"), ["add", "max"]);
        assert_eq!(values("at=(1, 2),(3, 4)"), ["(1, 2)", "(3, 4)"]);
        assert_eq!(values("n=1..3,7"), ["1", "2", "3", "7"]);
        assert_eq!(values("map=../a.tif,../b.tif"), ["../a.tif", "../b.tif"]);
        assert_eq!(values("age=1 kyr,1 Myr"), ["1 kyr", "1 Myr"]);
        assert_eq!(values("map=1,2 valleys.tif"), ["1", "2 valleys.tif"]);
    }

    #[test]
    fn invalid_sweeps_are_refused() {
        for text in [
            "seed",
            "=1..2",
            "a=3..1",
            "a=1..2/0",
            "a=1..2/-1",
            "a=1..x",
            "a=1,,2",
            "a=",
            "a=0..1/1e-9",
            "a=0.5,1 Myr",
            "a=1,2km²",
        ] {
            assert!(text.parse::<Sweep>().is_err(), "{text}");
        }
    }

    #[test]
    fn values_become_folder_names() {
        let values = BTreeMap::from([("age".to_owned(), "2 Myr".to_owned()), ("f".to_owned(), "../x".to_owned())]);
        assert_eq!(filled(Path::new("out/{age}/{f}"), &values), Path::new("out/2_Myr/.._x"));
        assert_eq!(filled(Path::new("{f}"), &BTreeMap::from([("f".to_owned(), "..".to_owned())])), Path::new("_"));
    }
}
