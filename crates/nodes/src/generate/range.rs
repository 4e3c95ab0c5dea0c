//! A mountain range along a path: a profile of the distance to it, with spurs by noise.

use super::noise::{Basis, Fractal, sum};
use crate::{
    par,
    prelude::*,
    range::{Range, fall_off},
};

choice! {
    /// How the range falls from its crest.
    pub enum Profile {
        /// exp(−w² / 2): a rounded crest and a foot that ends.
        Gaussian = "gaussian",
        /// 1 / (1 + w²): a narrower crest and long foothills.
        Foothills = "foothills",
        /// (1 − w / 3)², to nothing at three widths: a sharp crest and concave flanks.
        Sharp = "sharp",
    }
}

params! {
    /// Crest, from place to place.
    path: PathPoints = PathPoints(vec![[1500.0, 12500.0], [5500.0, 9800.0], [8200.0, 9000.0], [11000.0, 5500.0], [15000.0, 4000.0]]), Metres, -1e7..=1e7;
    /// Height of the crest above the land around.
    height: f64 = 2200.0, Metres, 0.0..=1e5, soft 100..=5000;
    /// Width of the flank to the right of the path.
    front: f64 = 1500.0, Metres, 1.0..=1e7, soft 200..=20000;
    /// Width of the flank to the left of the path.
    back: f64 = 2500.0, Metres, 1.0..=1e7, soft 200..=20000;
    /// How the range falls from its crest.
    profile: Profile = Profile::Sharp, One, ..;
    /// How far spurs and valleys reach into the flanks: 0 for even ones.
    spurs: f64 = 0.6, One, 0.0..=1.0;
    /// Distance between large spurs.
    spacing: f64 = 2500.0, Metres, 1.0..=1e6, soft 200..=10000;
    /// How much summits and passes differ from the height along the crest, as a share of it.
    variation: f64 = 0.35, One, 0.0..=1.0;
    /// Which spurs and summits these are.
    seed: Seed = Seed(0), Count, ..;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Range",
    category: "generate",
    summary: "A mountain range along a path, with spurs and summits.",
    doc: "With the distance w to the path in widths, `front` on its right and `back` on its left, and the profile φ(w),\n\n    \
          z = height (1 + variation n₁) φ(w √(1 + spurs s)),   s = 5 |n₂| − 0.8, rounded where n₂ is 0.\n\n\
          n₁ and n₂ are sums of octaves of gradient noise between ±1. Where n₂ crosses 0 the range reaches farther out: crests of spurs that \
          leave the main one at any angle, with valleys between them. On the crest itself they change nothing.\n\n\
          Each stretch of the path makes a range of its own and the highest counts; beyond the ends of the path the range is round. \
          `mask` is φ without spurs: wired to the `map` of `Uplift` it makes land rise where the range is, and rivers then cut valleys that \
          drain. That is the better way to mountains; this node is their first draft, and as good as they get without time.",
    outputs: &[
        Output::gives("height", PortType::Height, "Height above the land around."),
        Output::gives("mask", PortType::Mask, "The profile without spurs and summits, 1 on the crest."),
    ],
    params: Params::specs,
    cpu: run,
    example: "height: 2500, seed: 5",
    resolution: Resolution::Within(0.06), // crests of spurs are sharp
    ..Node::DEFAULT
};

/// Salts of the noise that varies the crest and of that which makes spurs.
const SALTS: [u32; 2] = [0x510e_527f, 0x9b05_688c];
/// How far from 0 the fold of the noise is rounded.
const ROUND: f32 = 0.06;

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let window = job.window();
    let mut mask = Range { path: &params.path.0, widths_m: [params.front, params.back] }.squares(job)?;
    let fractal = |salt: u32, wavelength_m: f64, octaves: i64| Fractal {
        wavelength_m,
        octaves,
        lacunarity: 2.0,
        gain: 0.5,
        tileable: false,
        seed: orograph_graph::mix(job.seed() ^ salt),
    };
    let crest = fractal(SALTS[0], 2.0 * params.spacing, 4).octaves(job.world());
    let crest = sum::lattices(job, &crest, Basis::Bell, params.variation)?;
    let spurs = fractal(SALTS[1], 2.0 * params.spacing, 10).octaves(job.world());
    let mut height = sum::lattices(job, &spurs, Basis::Bell, 1.0)?;
    let nx = window.nx();
    par::rows_within(job, [0.5, 0.8], &mut height, |j, row| {
        let (squares, crest) = (&mask[j * nx..][..nx], &crest[j * nx..][..nx]);
        for (height, &square) in row.iter_mut().zip(squares) {
            let folded = (*height * *height + ROUND * ROUND).sqrt() - ROUND;
            *height = square * (1.0 + params.spurs as f32 * (5.0 * folded - 0.8));
        }
        params.profile.of(row);
        for (height, &crest) in row.iter_mut().zip(crest) {
            *height *= params.height as f32 * (1.0 + crest);
        }
    })?;
    par::rows_within(job, [0.8, 1.0], &mut mask, |_, row| params.profile.of(row))?;
    Ok(Outputs::one("height", Field::new(window, height)).with("mask", Field::new(window, mask)))
}

impl Profile {
    /// Turns squares of distances in widths into shares of the height.
    fn of(self, row: &mut [f32]) {
        match self {
            Self::Gaussian => fall_off(row, 1.0),
            Self::Foothills => row.iter_mut().for_each(|value| *value = 1.0 / (1.0 + *value)),
            Self::Sharp => row.iter_mut().for_each(|value| {
                let left = (1.0 - value.sqrt() * (1.0 / 3.0)).max(0.0);
                *value = left * left;
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::ParamValue;

    use super::*;
    use crate::testing::{outputs_on, with_params, world};

    fn range(changes: &str) -> [Field; 2] {
        let mut params = with_params(&NODE, changes);
        params.set("path", ParamValue::Path(vec![[2000.0, 3000.0], [5000.0, 3000.0], [8000.0, 3000.0]]));
        let mut outputs = outputs_on(Window::whole(world(100, 60, 100.0)), &NODE, &params, &[]).expect("a result");
        ["height", "mask"].map(|name| outputs.take(name).expect("an output").as_field().expect("a field").clone())
    }

    /// To rounding: the path is half a cell from the centres of cells, and heads east, so that south is its front.
    #[test]
    fn an_even_range_is_its_profile() {
        type Shape = fn(f64) -> f64;
        let shapes: [(&str, Shape); 3] = [
            ("gaussian", |w| crate::math::exp(-0.5 * w * w)),
            ("foothills", |w| 1.0 / (1.0 + w * w)),
            ("sharp", |w| (1.0 - w / 3.0).max(0.0) * (1.0 - w / 3.0).max(0.0)),
        ];
        for (name, shape) in shapes {
            let [height, mask] = range(&format!("profile={name},height=1000,front=500,back=900,spurs=0,variation=0"));
            for j in 0..60 {
                let right = 100.0 * f64::from(j) + 50.0 - 3000.0;
                let expected = shape(if right > 0.0 { right / 500.0 } else { right / -900.0 });
                let at = j as usize * 100 + 50;
                assert!((f64::from(height.samples()[at]) - 1000.0 * expected).abs() < 2e-3, "{name} {right}");
                assert!((f64::from(mask.samples()[at]) - expected).abs() < 2e-6, "{name} {right}");
            }
        }
    }

    /// On the crest it has the height that varies along it alone; out on the flanks both spurs and valleys.
    #[test]
    fn spurs_leave_the_crest_as_it_is() {
        let even = range("front=800,back=800,spurs=0,variation=0");
        let spurred = range("front=800,back=800,spurs=1,variation=0");
        assert_eq!(even[1], spurred[1]);
        let row = |fields: &[Field; 2], j: usize| fields[0].samples()[j * 100 + 25..][..50].to_vec();
        let [crest, flank] = [29, 20].map(|j| {
            let pairs = row(&even, j).into_iter().zip(row(&spurred, j));
            pairs.map(|(even, spurred)| spurred / even).collect::<Vec<f32>>()
        });
        assert!(crest.iter().all(|ratio| (0.9..1.06).contains(ratio)), "{crest:?}");
        assert!(flank.iter().any(|ratio| *ratio > 1.15) && flank.iter().any(|ratio| *ratio < 0.9), "{flank:?}");
        let varied = range("spurs=0,variation=1");
        assert!(varied[0].samples().iter().all(|h| *h >= 0.0));
    }
}
