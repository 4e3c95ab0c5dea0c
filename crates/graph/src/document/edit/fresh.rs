//! Names that are not in use.

/// The first unused name: the stem, or else the stem with a number from 2 on.
#[must_use]
pub fn fresh_name(stem: &str, taken: impl Fn(&str) -> bool) -> String {
    let mut name = stem.to_owned();
    let mut number = 2;
    while taken(&name) {
        name = format!("{stem}{number}");
        number += 1;
    }
    name
}

#[cfg(test)]
mod tests {
    use super::fresh_name;

    #[test]
    fn fresh_names_are_numbered_from_two() {
        assert_eq!(fresh_name("ridged", |_| false), "ridged");
        assert_eq!(fresh_name("ridged", |name| ["ridged", "ridged2"].contains(&name)), "ridged3");
    }
}
