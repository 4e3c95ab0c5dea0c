//! Gives a field the distribution of another field, or a uniform or normal one.

use orograph_graph::memory::copied;

use crate::{
    numerics::{
        cells::{BLOCK, blocks, masked, samples},
        distribution, math, par,
    },
    prelude::*,
};

choice! {
    /// Distribution of the result.
    pub enum Like {
        /// That of the field wired to `reference`.
        Reference = "reference",
        /// Uniform between the lowest and the highest value.
        Uniform = "uniform",
        /// Normal, with the mean and the standard deviation of the input.
        Normal = "normal",
    }
}

params! {
    /// Distribution of the result.
    like: Like = Like::Reference, One, ..;
}

inputs! {
    /// Field to match.
    value: AnyScalar;
    /// Field with the distribution to match, for `reference`.
    reference: Option<AnyScalar>;
    /// Where the result replaces the input: fully at 1, not at all at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// The matched values, with the meaning of the input.
    value: SameAs(value);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Match",
    category: "combine",
    summary: "Gives a field the distribution of another field, or a uniform or normal one.",
    doc: include_str!("matching.md"),
    sources: &[
        "R. C. Gonzalez and R. E. Woods (2008), Digital Image Processing, 3rd edition, section 3.3",
        "M. J. Wichura (1988), Algorithm AS 241: The percentage points of the normal distribution, Applied Statistics 37, \
         477-484",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    scratch: Scratch::PerCell(8.0),
    refuses: Some(refuses),
    cpu: run,
    example: "value: \"base\", like: uniform",
    ..Node::DEFAULT
};

/// Refuses a reference that is not wired.
fn refuses(stated: &Stated<'_>) -> Result<(), NodeError> {
    let needs = Params::read(stated.params).like == Like::Reference;
    if needs && stated.feed("reference") == Feed::Nothing { Err(unwired()) } else { Ok(()) }
}

fn unwired() -> NodeError {
    NodeError::failed_with_hint(
        "nothing is wired to `reference`",
        "wire the field whose distribution is wanted, or write `like: uniform` or `like: normal`",
    )
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { value, reference, mask } = Inputs::read(job)?;
    let order = order(value.samples());
    job.advance(0.4)?;
    let count = order.len();
    let target = Target::new(job, reference, Params::read(job.params).like, value.samples(), &order)?;
    job.advance(0.6)?;
    let mut out = vec![0.0; count];
    let mut first = 0;
    while first < count {
        let equal = order[first..].iter().take_while(|entry| *entry >> 32 == order[first] >> 32).count();
        let value = target.at(first as f64 + 0.5 * (equal - 1) as f64, count);
        for entry in &order[first..first + equal] {
            out[*entry as u32 as usize] = value;
        }
        first += equal;
    }
    blocks(job, [0.8, 1.0], &mut out, |cells, first| {
        let mut spare = [0.0; BLOCK];
        let mask = samples(mask, first, cells.len(), &mut spare);
        for ((new, &old), &mask) in cells.iter_mut().zip(&value.samples()[first..]).zip(mask) {
            *new = masked(old, *new, mask);
        }
    })?;
    Ok(Given { value: Some(Field::new(job.window(), out)) }.into())
}

/// Returns keys sorted by value: the upper bits are the value as an order-preserving integer, the lower ones its cell
/// index.
fn order(samples: &[f32]) -> Vec<u64> {
    // adding 0 turns −0 into +0
    let entry = |place: usize| math::ordered(samples[place] + 0.0) << 32 | place as u64;
    let mut order = par::map(samples.len(), entry);
    par::sort_keys(&mut order);
    order
}

/// The target distribution.
enum Target {
    /// Sorted values.
    Sorted(Vec<f32>),
    Uniform {
        low: f64,
        high: f64,
    },
    Normal {
        mean: f64,
        deviation: f64,
    },
}

impl Target {
    fn new(
        job: &Job<'_>,
        reference: Option<&Field>,
        like: Like,
        samples: &[f32],
        order: &[u64],
    ) -> Result<Self, NodeError> {
        match like {
            Like::Reference => {
                let Some(reference) = reference else {
                    return Err(unwired());
                };
                let mut sorted = copied(reference.samples())?;
                par::sort(&mut sorted);
                Ok(Self::Sorted(sorted))
            }
            Like::Uniform => {
                let at = |entry: u64| f64::from(samples[entry as u32 as usize]);
                Ok(Self::Uniform { low: at(order[0]), high: at(order[order.len() - 1]) })
            }
            Like::Normal => {
                let (mean, deviation) = distribution::moments(samples, job.window().nx());
                Ok(Self::Normal { mean, deviation })
            }
        }
    }

    /// Returns the value of a rank among `count`.
    fn at(&self, rank: f64, count: usize) -> f32 {
        match self {
            Self::Sorted(sorted) => {
                let last = sorted.len() - 1;
                let at = if sorted.len() == count { rank } else { rank * last as f64 / (count - 1).max(1) as f64 };
                let below = (at.floor() as usize).min(last);
                let (low, high) = (f64::from(sorted[below]), f64::from(sorted[(below + 1).min(last)]));
                (low + (high - low) * (at - below as f64)) as f32
            }
            Self::Uniform { low, high } => {
                let share = if count > 1 { rank / (count - 1) as f64 } else { 0.5 };
                (low * (1.0 - share) + high * share) as f32
            }
            Self::Normal { mean, deviation } => (mean + deviation * quantile((rank + 0.5) / count as f64)) as f32,
        }
    }
}

/// Returns the quantile of the standard normal distribution at probability `p`, 0 < p < 1, by the rational functions of
/// Wichura's PPND7; relative error 1e-7.
fn quantile(p: f64) -> f64 {
    let q = p - 0.5;
    if q.abs() <= 0.425 {
        let r = 0.180_625 - q * q;
        let above = ((59.109_374_720 * r + 159.291_132_02) * r + 50.434_271_938) * r + 3.387_132_717_9;
        let below = ((67.187_563_600 * r + 78.757_757_664) * r + 17.895_169_469) * r + 1.0;
        return q * above / below;
    }
    let r = (-math::ln(p.min(1.0 - p))).sqrt();
    let size = if r <= 5.0 {
        let r = r - 1.6;
        let above = ((0.170_238_211_03 * r + 1.306_728_481_6) * r + 2.756_815_390_0) * r + 1.423_437_277_7;
        above / ((0.120_211_329_75 * r + 0.737_001_642_50) * r + 1.0)
    } else {
        let r = r - 5.0;
        let above = ((0.017_337_203_997 * r + 0.428_682_943_37) * r + 3.081_226_386_0) * r + 6.657_905_115_0;
        above / ((0.012_258_202_635 * r + 0.241_978_942_25) * r + 1.0)
    };
    size.copysign(q)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{field, moments, outputs, run as result, run_in, with_params, world};

    fn hills(nx: u32, ny: u32) -> Field {
        field(world(nx, ny, 5.0), |x, y| 300.0 * libm::sin(x * 0.05 + y * 0.02) * libm::cos(y * 0.3) + 0.1 * x)
    }

    fn sorted(field: &Field) -> Vec<f32> {
        let mut values = field.samples().to_vec();
        values.sort_by(f32::total_cmp);
        values
    }

    #[test]
    fn matched_with_itself_is_itself() {
        let land = hills(71, 40);
        let steps = field(world(71, 40, 5.0), |x, y| (x / 40.0).floor() - (y / 70.0).floor());
        for land in [land, steps] {
            let fields = [("value", &land), ("reference", &land)];
            assert_eq!(result(&NODE, &with_params(&NODE, ""), &fields, "value"), land);
        }
    }

    #[test]
    fn values_are_those_of_the_reference_and_order_stays() {
        // all values are distinct
        let land = field(world(71, 40, 5.0), |x, y| (x * 7.0) % 355.0 + 0.01 * y);
        let other = field(world(71, 40, 5.0), |x, y| libm::exp(0.01 * x) + 3.0 * libm::sin(y * x));
        let found = result(&NODE, &with_params(&NODE, ""), &[("value", &land), ("reference", &other)], "value");
        assert!(sorted(&found) == sorted(&other));
        let mut places: Vec<usize> = (0..land.samples().len()).collect();
        places.sort_by(|&a, &b| land.samples()[a].total_cmp(&land.samples()[b]));
        assert!(places.windows(2).all(|pair| found.samples()[pair[0]] <= found.samples()[pair[1]]));
        assert_eq!(
            run_in(1, &NODE, &with_params(&NODE, ""), &[("value", &land), ("reference", &other)]),
            run_in(3, &NODE, &with_params(&NODE, ""), &[("value", &land), ("reference", &other)])
        );
    }

    #[test]
    fn plain_distributions_are_what_they_say() {
        let land = hills(71, 40);
        let (low, high) = land.range(0).expect("finite");
        let uniform = sorted(&result(&NODE, &with_params(&NODE, "like=uniform"), &[("value", &land)], "value"));
        for (rank, value) in uniform.iter().enumerate() {
            let expected = low + (high - low) * rank as f32 / 2839.0;
            // equal values share a rank
            assert!((value - expected).abs() < 0.5, "{rank}: {value} {expected}");
        }
        let normal = result(&NODE, &with_params(&NODE, "like=normal"), &[("value", &land)], "value");
        let ((mean, deviation), (was_mean, was_deviation)) = (moments(normal.samples()), moments(land.samples()));
        // 2840 ranks cut off the tails of the distribution
        assert!((mean - was_mean).abs() < 0.1 && (deviation / was_deviation - 1.0).abs() < 2e-3, "{mean} {deviation}");
    }

    #[test]
    fn quantiles_turn_the_error_function_around() {
        for k in 1..4000 {
            let p = f64::from(k) / 4000.0;
            let back = 0.5 * libm::erfc(-quantile(p) / std::f64::consts::SQRT_2);
            assert!((back - p).abs() < 1e-7, "{p} {back}");
        }
        assert!((quantile(1e-9) + 5.997_807_015).abs() < 1e-5 && (quantile(1e-14) + 7.650_628_1).abs() < 1e-5);
    }

    #[test]
    fn one_cell_and_level_land_stay_and_a_missing_reference_is_told() {
        for land in [field(world(1, 1, 5.0), |_, _| 812.3), field(world(9, 7, 5.0), |_, _| 812.3)] {
            for changes in ["like=uniform", "like=normal"] {
                assert_eq!(
                    result(&NODE, &with_params(&NODE, changes), &[("value", &land)], "value"),
                    land,
                    "{changes}"
                );
            }
            let error =
                outputs(&NODE, &with_params(&NODE, ""), &[("value", &land)]).expect_err("no reference").to_string();
            assert!(error.contains("`reference`"), "{error}");
            let nowhere = field(land.window().world, |_, _| 0.0);
            let other = field(land.window().world, |x, _| x);
            let fields = [("value", &land), ("reference", &other), ("mask", &nowhere)];
            assert_eq!(result(&NODE, &with_params(&NODE, ""), &fields, "value"), land);
        }
    }
}
