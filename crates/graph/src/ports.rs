//! Ports: the macros that declare a node's inputs and outputs once, and the reader of the inputs.

use crate::{
    field::Field,
    job::{InputValue, Job, Lane, NodeError},
    lines::Lines,
    strata::Strata,
    value::Value,
};

/// Reads the inputs of a job in declaration order; used by [`inputs!`](crate::inputs).
pub struct InputReader<'a>(std::slice::Iter<'a, InputValue>);

/// The type of a value on a wire into a typed input.
pub trait Carried {
    /// Returns None when the value is of another type.
    fn of(value: &Value) -> Option<&Self>;
}

impl Carried for Field {
    fn of(value: &Value) -> Option<&Self> {
        value.as_field()
    }
}

impl Carried for Strata {
    fn of(value: &Value) -> Option<&Self> {
        value.as_strata()
    }
}

impl Carried for Lines {
    fn of(value: &Value) -> Option<&Self> {
        value.as_lines()
    }
}

impl<'a> InputReader<'a> {
    /// A reader at the first input.
    #[must_use]
    pub fn new(job: &'a Job<'_>) -> Self {
        Self(job.inputs.iter())
    }

    /// The next input, which is required.
    ///
    /// # Errors
    /// When nothing is wired; the graph's check reports this before a run.
    pub fn required<T: Carried>(&mut self, name: &str) -> Result<&'a T, NodeError> {
        self.optional().ok_or_else(|| NodeError::failed(format!("nothing is wired to `{name}`")))
    }

    /// The next input, which is optional.
    pub fn optional<T: Carried>(&mut self) -> Option<&'a T> {
        match self.0.next()? {
            InputValue::Value(value) => T::of(value),
            InputValue::Constant(_) | InputValue::Absent => None,
        }
    }

    /// The next input, which takes a wire or a number.
    ///
    /// # Errors
    /// When it has neither, because the job does not follow the declaration.
    pub fn lane(&mut self, name: &str) -> Result<Lane<'a>, NodeError> {
        match self.0.next() {
            Some(InputValue::Constant(v)) => Ok(Lane::Constant(*v as f32)),
            Some(InputValue::Value(Value::Field(field))) => Ok(Lane::Samples(field.samples())),
            _ => Err(NodeError::failed(format!("`{name}` has neither a raster nor a number"))),
        }
    }
}

/// The hard range of an input as data.
#[must_use]
pub const fn ends(range: &std::ops::RangeInclusive<f64>) -> [f64; 2] {
    [*range.start(), *range.end()]
}

/// Declares a node's inputs once: `Inputs::PORTS` for the declaration, a typed struct `Inputs`, and its reader.
///
/// A row is `name: Type;`, where the type is a [`PortType`](crate::PortType), with its unit if it has one:
///
/// - `height: Height;` is required: a `&Field`, or `&Lines` for `Lines` and `&Strata` for `Strata`;
/// - `debris: Option<Scalar(Metres)>;` is optional: an `Option<&Field>`;
/// - `talus: Scalar(Degrees) = 35.0, 5.0..=80.0, soft 20.0..=45.0;` takes a wire or a number: a [`Lane`]. The slider
///   covers the hard range unless `soft` is given.
///
/// ```
/// use orograph_graph::{Fallback, Job, NodeError, inputs};
///
/// inputs! {
///     /// The terrain.
///     height: Height;
///     /// Slope above which loose material slides.
///     talus: Scalar(Degrees) = 35.0, 5.0..=80.0, soft 20.0..=45.0;
///     /// Thickness of debris.
///     debris: Option<Scalar(Metres)>;
/// }
///
/// fn steepest(job: &Job<'_>) -> Result<f32, NodeError> {
///     let inputs = Inputs::read(job)?;
///     let debris = inputs.debris.map_or(0.0, |debris| debris.samples()[0]);
///     Ok(inputs.height.samples()[0] + inputs.talus.at(0) + debris)
/// }
///
/// assert_eq!(Inputs::PORTS[1].doc, "Slope above which loose material slides.");
/// assert_eq!(Inputs::PORTS[2].fallback, Fallback::None);
/// ```
///
/// A mistyped port does not compile:
///
/// ```compile_fail,E0609
/// use orograph_graph::{Job, NodeError, inputs};
///
/// inputs! {
///     /// The terrain.
///     height: Height;
/// }
///
/// fn lowest(job: &Job<'_>) -> Result<f32, NodeError> {
///     Ok(Inputs::read(job)?.hieght.samples()[0])
/// }
/// ```
#[macro_export]
macro_rules! inputs {
    ($( $(#[doc = $doc:literal])+
        $name:ident: $ty:ident $(($unit:ident))? $(<$of:ident $(($of_unit:ident))?>)?
            $(= $default:expr, $hard:expr $(, soft $lo:literal ..= $hi:literal)?)?; )+) => {
        /// The node's inputs, typed.
        #[derive(Clone, Copy, Debug)]
        pub struct Inputs<'a> { $(
            $(#[doc = $doc])+
            pub $name: $crate::inputs!(@field 'a [$ty $(($unit))? $(<$of $(($of_unit))?>)?] [$($default)?]),
        )+ }

        impl<'a> Inputs<'a> {
            /// The declarations, in display order.
            pub const PORTS: &'static [$crate::Input] = &[ $( $crate::Input {
                name: stringify!($name),
                ty: $crate::inputs!(@type $ty $(($unit))? $(<$of $(($of_unit))?>)?),
                fallback: $crate::inputs!(
                    @fallback [$ty $(($unit))? $(<$of $(($of_unit))?>)?] [$($default, $hard $(, $lo, $hi)?)?]
                ),
                doc: concat!($($doc, "\n"),+).trim_ascii(),
            } ),+ ];

            /// Reads the inputs of a job.
            ///
            /// # Errors
            /// When a required input has no wire; the graph's check reports this before a run.
            pub fn read(job: &'a $crate::Job<'_>) -> Result<Self, $crate::NodeError> {
                let mut reader = $crate::InputReader::new(job);
                Ok(Self { $(
                    $name: $crate::inputs!(
                        @read reader $name [$ty $(($unit))? $(<$of $(($of_unit))?>)?] [$($default)?]
                    ),
                )+ })
            }
        }
    };

    (@type Option<$ty:ident $(($unit:ident))?>) => { $crate::PortType::$ty $(($crate::Unit::$unit))? };
    (@type $ty:ident $(($unit:ident))?) => { $crate::PortType::$ty $(($crate::Unit::$unit))? };

    (@value Lines) => { $crate::Lines };
    (@value Strata) => { $crate::Strata };
    (@value $ty:ident) => { $crate::Field };

    (@field $a:lifetime [$($ty:tt)+] [$default:expr]) => { $crate::Lane<$a> };
    (@field $a:lifetime [Option<$ty:ident $(($unit:ident))?>] []) => { Option<&$a $crate::inputs!(@value $ty)> };
    (@field $a:lifetime [$ty:ident $(($unit:ident))?] []) => { &$a $crate::inputs!(@value $ty) };

    (@read $reader:ident $name:ident [$($ty:tt)+] [$default:expr]) => { $reader.lane(stringify!($name))? };
    (@read $reader:ident $name:ident [Option<$($ty:tt)+] []) => { $reader.optional() };
    (@read $reader:ident $name:ident [$($ty:tt)+] []) => { $reader.required(stringify!($name))? };

    (@fallback [Option<$($ty:tt)+] []) => { $crate::Fallback::None };
    (@fallback [$($ty:tt)+] []) => { $crate::Fallback::Required };
    (@fallback [$($ty:tt)+] [$default:expr, $hard:expr]) => {
        $crate::Fallback::Constant { default: $default, hard: $crate::ends(&$hard), soft: $crate::ends(&$hard) }
    };
    (@fallback [$($ty:tt)+] [$default:expr, $hard:expr, $lo:literal, $hi:literal]) => {
        $crate::Fallback::Constant { default: $default, hard: $crate::ends(&$hard), soft: [$lo, $hi] }
    };
}

/// Declares a node's outputs once: `Given::PORTS` for the declaration, `Wants` with the outputs that are requested, and
/// `Given`, which a kernel fills with exactly these.
///
/// A row is `name: Type;` with a [`PortType`](crate::PortType), `SameAs(input)` for the type of the wire into that
/// input of [`inputs!`](crate::inputs), or `Chosen(function)` for a type that the parameters choose. A value is
/// `Lines`, `Strata` or a `Report` if the type says so, and a `Field` otherwise.
///
/// ```
/// use orograph_graph::{Field, Job, NodeError, Outputs, inputs, outputs};
///
/// inputs! {
///     /// The terrain.
///     height: Height;
/// }
///
/// outputs! {
///     /// The inverted terrain.
///     turned: SameAs(height);
///     /// Where it is above 0.
///     above: Mask;
/// }
///
/// fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
///     let (land, wants) = (Inputs::read(job)?.height.samples(), Wants::of(job));
///     let field = |value: fn(f32) -> f32| Field::new(job.window(), land.iter().map(|&h| value(h)).collect());
///     Ok(Given {
///         turned: wants.turned.then(|| field(|h| -h)),
///         above: wants.above.then(|| field(|h| if h > 0.0 { 1.0 } else { 0.0 })),
///     }
///     .into())
/// }
///
/// assert_eq!(Given::PORTS[1].name, "above");
/// ```
///
/// A mistyped port does not compile:
///
/// ```compile_fail,E0560
/// use orograph_graph::{Field, Job, Outputs, outputs};
///
/// outputs! {
///     /// Terrain at 0 m.
///     height: Height;
/// }
///
/// fn run(job: &Job<'_>) -> Outputs {
///     Given { hieght: Some(Field::constant(job.window(), 0.0)) }.into()
/// }
/// ```
///
/// The type of an undeclared input does not compile either:
///
/// ```compile_fail,E0609
/// use orograph_graph::{inputs, outputs};
///
/// inputs! {
///     /// The terrain.
///     height: Height;
/// }
///
/// outputs! {
///     /// The inverted terrain.
///     turned: SameAs(hieght);
/// }
/// ```
#[macro_export]
macro_rules! outputs {
    ($( $(#[doc = $doc:literal])+ $name:ident: $ty:ident $(($($of:tt)+))?; )+) => {
        /// The requested outputs of the node.
        #[allow(dead_code, reason = "a kernel of one output has nothing to ask")]
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub struct Wants { $( $(#[doc = $doc])+ pub $name: bool, )+ }

        #[allow(dead_code, reason = "a kernel of one output has nothing to ask")]
        impl Wants {
            /// The requested outputs of a job.
            #[must_use]
            pub fn of(job: &$crate::Job<'_>) -> Self {
                Self::among(job.wanted)
            }

            /// The same by position.
            #[must_use]
            pub fn among(wanted: $crate::Wanted) -> Self {
                let mut wanted = (0..).map(|output| wanted.contains(output));
                Self { $( $name: wanted.next().is_some_and(|wanted| wanted), )+ }
            }

            /// Number of requested outputs.
            #[must_use]
            pub const fn count(self) -> usize {
                0 $( + self.$name as usize )+
            }
        }

        /// The node's outputs: those that are requested, and no others.
        #[derive(Clone, Debug, Default)]
        pub struct Given { $( $(#[doc = $doc])+ pub $name: Option<$crate::outputs!(@value $ty)>, )+ }

        impl Given {
            /// The declarations, in display order.
            pub const PORTS: &'static [$crate::Output] = &[ $( $crate::Output {
                name: stringify!($name),
                ty: $crate::outputs!(@type $ty $(($($of)+))?),
                doc: concat!($($doc, "\n"),+).trim_ascii(),
            } ),+ ];
        }

        impl From<Given> for $crate::Outputs {
            fn from(given: Given) -> Self {
                let outputs = Self::default();
                $( let outputs = match given.$name {
                    Some(value) => outputs.with(stringify!($name), value),
                    None => outputs,
                }; )+
                outputs
            }
        }
    };

    (@value Lines) => { $crate::Lines };
    (@value Strata) => { $crate::Strata };
    (@value Report) => { $crate::Report };
    (@value $ty:ident) => { $crate::Field };

    (@type SameAs($input:ident)) => {
        $crate::OutputType::SameAs({
            const _: fn(&Inputs<'_>) = |inputs| _ = inputs.$input;
            stringify!($input)
        })
    };
    (@type Chosen($of:path)) => { $crate::OutputType::Chosen($of) };
    (@type $ty:ident $(($unit:ident))?) => {
        $crate::OutputType::Fixed($crate::PortType::$ty $(($crate::Unit::$unit))?)
    };
}
