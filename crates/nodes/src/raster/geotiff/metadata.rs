//! Scale, offset and unit of the first band of a GeoTIFF: XML in a tag of GDAL's.
//!
//! Source: GDAL, "GTiff: GeoTIFF File Format", and the names of its `GDALMetadata` items. `<Item name="SCALE"
//! sample="0" role="scale">0.1</Item>` is the scale of the first band, `role="offset"` its offset, and
//! `role="unittype"` the unit of its values.

use quick_xml::{
    Reader,
    events::{BytesStart, Event},
};

use crate::raster::Problem;

/// The items of the first band.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Items {
    pub(super) scale: Option<f64>,
    pub(super) offset: Option<f64>,
    pub(super) unit: Option<String>,
}

impl Items {
    /// Parses the text of the tag.
    ///
    /// # Errors
    /// [`Problem::Damaged`] if it is not XML, or a scale or an offset is not a number or beyond what elevations need.
    pub(super) fn parse(xml: &str) -> Result<Self, Problem> {
        let broken = || Problem::damaged("its GDAL metadata is not well-formed XML");
        let mut reader = Reader::from_str(xml);
        let (mut items, mut role, mut text) = (Self::default(), None, String::new());
        loop {
            match reader.read_event().map_err(|_| broken())? {
                Event::Start(start) => (role, text) = (Role::of(&start).ok_or_else(broken)?, String::new()),
                Event::Text(part) if role.is_some() => text += &part.decode().map_err(|_| broken())?,
                Event::End(_) => {
                    if let Some(role) = role.take() {
                        items.set(role, text.trim())?;
                    }
                }
                Event::Eof => return Ok(items),
                _ => {}
            }
        }
    }

    fn set(&mut self, role: Role, text: &str) -> Result<(), Problem> {
        let number = |name: &str, fits: fn(f64) -> bool| {
            let number = text.parse().ok().filter(|number: &f64| fits(*number));
            number.ok_or_else(|| Problem::damaged(format!("`{}` is no {name}", text.escape_debug())))
        };
        match role {
            Role::Scale => self.scale = Some(number("scale", |number| (1e-9..=1e6).contains(&number.abs()))?),
            Role::Offset => self.offset = Some(number("offset", |number| number.abs() <= 1e9)?),
            Role::Unit => self.unit = Some(text.to_owned()).filter(|text| !text.is_empty()),
        }
        Ok(())
    }
}

/// The items that are read.
#[derive(Clone, Copy)]
enum Role {
    Scale,
    Offset,
    Unit,
}

impl Role {
    /// Returns the role of an item of the first band, or else `Some(None)`. Returns None if its attributes are broken.
    fn of(start: &BytesStart<'_>) -> Option<Option<Self>> {
        let value = |name: &str| match start.try_get_attribute(name) {
            Ok(found) => Some(found.map(|attribute| attribute.value.into_owned())),
            Err(_) => None,
        };
        let (sample, role) = (value("sample")?, value("role")?);
        if start.name().as_ref() != b"Item" || sample.as_deref() != Some(b"0") {
            return Some(None);
        }
        Some(match role.as_deref() {
            Some(b"scale") => Some(Self::Scale),
            Some(b"offset") => Some(Self::Offset),
            Some(b"unittype") => Some(Self::Unit),
            _ => None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_band_counts() {
        let xml = r#"<GDALMetadata>
            <Item name="AREA_OR_POINT">Area</Item>
            <Item name="SCALE" sample="1" role="scale">7</Item>
            <Item name="SCALE" sample="0" role="scale">0.1</Item>
            <Item name="OFFSET" sample="0" role="offset"> -500 </Item>
            <Item name="UNITTYPE" sample="0" role="unittype">ft</Item>
        </GDALMetadata>"#;
        let expected = Items { scale: Some(0.1), offset: Some(-500.0), unit: Some("ft".to_owned()) };
        assert_eq!(Items::parse(xml).expect("items"), expected);
        assert_eq!(Items::parse("").expect("nothing"), Items::default());
    }

    #[test]
    fn nonsense_is_refused() {
        let scale = |text: &str| format!("<GDALMetadata><Item sample='0' role='scale'>{text}</Item></GDALMetadata>");
        assert_eq!(Items::parse(&scale("2")).expect("a scale").scale, Some(2.0));
        for text in ["0", "inf", "NaN", "1e300", "ten", ""] {
            assert!(matches!(Items::parse(&scale(text)), Err(Problem::Damaged(_))), "{text}");
        }
        for xml in ["<GDALMetadata><Item", "<Item sample='0'>1</Metadata>", "<Item sample=0 role=>1</Item>"] {
            assert!(matches!(Items::parse(xml), Err(Problem::Damaged(_))), "{xml}");
        }
    }
}
