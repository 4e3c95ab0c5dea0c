//! `--sea`: a sea level for drawing and measuring that replaces the one of the world.

use orograph_graph::{Field, Unit, Window, World};

/// The sea level for drawing and measuring.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct Sea {
    /// Elevation of the sea, or `none` for no sea [default: that of the world]
    #[arg(long = "sea", value_name = "METRES", allow_hyphen_values = true, value_parser = level)]
    level: Option<Level>,
}

/// A sea level in metres, or None for no sea.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Level(Option<f64>);

fn level(text: &str) -> Result<Level, String> {
    if text.trim() == "none" {
        return Ok(Level(None));
    }
    let level = Unit::Metres.parse(text).map_err(|error| error.to_string())?;
    World { sea_level: Some(level), ..World::default() }.check().map_err(|error| error.to_string())?;
    Ok(Level(Some(level)))
}

impl Sea {
    /// The field in a world with this sea level.
    pub fn around(self, field: Field) -> Field {
        let Some(Level(sea_level)) = self.level else { return field };
        let window = *field.window();
        field.crop(&Window { world: World { sea_level, ..window.world }, ..window })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sea_is_a_length_or_none() {
        assert_eq!(
            (level("0"), level("-1.5 km"), level("none")),
            (Ok(Level(Some(0.0))), Ok(Level(Some(-1500.0))), Ok(Level(None)))
        );
        for text in ["", "deep", "NaN", "13 km", "-inf", "3 yr"] {
            assert!(level(text).is_err(), "{text}");
        }
        let world = World { cells: [2, 2], sea_level: Some(7.0), ..World::default() };
        let field = Field::constant(Window::whole(world), 1.0);
        let seen = |level| Sea { level }.around(field.clone()).window().world.sea_level;
        assert_eq!([None, Some(Level(None)), Some(Level(Some(3.0)))].map(seen), [Some(7.0), None, Some(3.0)]);
    }
}
