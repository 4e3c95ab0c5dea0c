//! The macros that declare parameters and choices once.

#[cfg(doc)]
use super::{
    ColourStops, CurvePoints, FileName, OutlinePoints, PathPoints, Position, Seed, StepPoints, Strokes, TimedStrokes,
    Waypoints,
};

/// Declares a node's parameters once: a typed struct `Params`, its specifications and its reader.
///
/// A row is `name: type = default, Unit, hard range;`. Before the semicolon it may have `soft lo..=hi`, and then, for a
/// parameter that has an effect only in some cases:
///
/// - `when other = "name" | "name"`: with these settings;
/// - `given other`: if that number is not 0;
/// - `lacking other`: if that table is empty;
/// - `with input`: if that input is wired;
/// - `unless input`: if it is not.
///
/// The type is one of `f64`, `i64`, `bool`, [`Seed`], `[f64; 2]`, [`Position`], [`CurvePoints`], [`StepPoints`],
/// [`PathPoints`], [`OutlinePoints`], [`Waypoints`], [`ColourStops`], [`Strokes`], [`TimedStrokes`], [`FileName`] or a
/// [`choice!`](crate::choice) enum; types without a range write `..`.
///
/// ```
/// use orograph_graph::params;
///
/// params! {
///     /// Slope above which loose material slides.
///     talus: f64 = 35.0, Degrees, 5.0..=80.0, soft 20.0..=45.0;
///     /// Number of passes.
///     passes: i64 = 60, Count, 0..=5000;
///     /// Whether ground dries.
///     dry: bool = false, One, ..;
///     /// How fast it dries.
///     rate: f64 = 2.0, One, 0.0..=10.0, when dry = true;
/// }
///
/// let specs = Params::specs();
/// assert_eq!(specs[0].name, "talus");
/// let values = orograph_graph::ParamValues::defaults(&specs);
/// assert_eq!(Params::read(&values).passes, 60);
/// assert_eq!(specs[3].idle(&values, |_| false).map(ToString::to_string).as_deref(), Some("`dry` is `true`"));
/// ```
#[macro_export]
macro_rules! params {
    ($( $(#[doc = $doc:literal])+
        $name:ident: $ty:ty = $default:expr, $unit:ident, $hard:expr
            $(, soft $lo:literal ..= $hi:literal)? $(, when $on:ident = $($is:literal)|+)*
            $(, given $amount:ident)* $(, lacking $table:ident)?
            $(, with $owner:ident)? $(, unless $heir:ident)?; )*) => {
        /// The node's parameters, typed.
        #[derive(Clone, Debug, PartialEq)]
        pub struct Params { $( $(#[doc = $doc])+ pub $name: $ty, )* }

        impl Params {
            /// The declarations, in display order.
            #[must_use]
            pub fn specs() -> Vec<$crate::ParamSpec> {
                vec![ $( $crate::ParamSpec {
                    name: stringify!($name),
                    doc: concat!($($doc, "\n"),+).trim_ascii(),
                    unit: $crate::Unit::$unit,
                    kind: <$ty as $crate::ParamType>::kind($default, $hard)$(.with_soft($lo as f64, $hi as f64))?,
                    when: &[
                        $( $crate::When::Setting { param: stringify!($on), is: &[ $( concat!($is) ),+ ] }, )*
                        $( $crate::When::NonZero(stringify!($amount)), )*
                        $( $crate::When::Empty(stringify!($table)), )?
                        $( $crate::When::Wired(stringify!($owner)), )?
                        $( $crate::When::Unwired(stringify!($heir)), )?
                    ],
                } ),* ]
            }

            /// Reads checked values.
            #[must_use]
            pub fn read(values: &$crate::ParamValues) -> Self {
                let _ = values;
                Self { $( $name: values.read(stringify!($name)) ),* }
            }
        }
    };
}

/// Declares an enum for a choice parameter. Its names in a file are written here, never derived from positions.
///
/// ```
/// orograph_graph::choice! {
///     /// How two heights are combined.
///     pub enum Mode {
///         /// The sum.
///         Add = "add",
///         /// The higher of the two.
///         Max = "max",
///     }
/// }
/// assert_eq!(Mode::Max.name(), "max");
/// ```
#[macro_export]
macro_rules! choice {
    ($(#[doc = $doc:literal])+ $vis:vis enum $name:ident {
        $( $(#[doc = $vdoc:literal])+ $variant:ident = $text:literal, )+
    }) => {
        $(#[doc = $doc])+
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        $vis enum $name { $( $(#[doc = $vdoc])+ $variant, )+ }

        impl $name {
            /// Names in a file, with their documentation.
            pub const OPTIONS: &'static [(&'static str, &'static str)] =
                &[ $( ($text, concat!($($vdoc, "\n"),+).trim_ascii()), )+ ];

            /// The name in a file.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $( Self::$variant => $text, )+ }
            }
        }

        impl $crate::ParamType for $name {
            type Range = core::ops::RangeFull;

            fn kind(default: Self, _: core::ops::RangeFull) -> $crate::Kind {
                $crate::Kind::Choice { default: default.name(), options: Self::OPTIONS }
            }

            fn from_value(value: &$crate::ParamValue) -> Option<Self> {
                match value {
                    $( $crate::ParamValue::Choice($text) => Some(Self::$variant), )+
                    _ => None,
                }
            }
        }
    };
}
