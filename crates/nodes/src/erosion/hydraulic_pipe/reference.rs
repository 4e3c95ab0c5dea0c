//! One step in double precision, as described in the manual page: cell by cell, without bands, rows or tricks.

/// Bed, water and sediment of an n by n world with walls, and discharge through west and north faces.
pub(super) struct World {
    pub n: usize,
    pub cell_m: f64,
    pub bed: Vec<f64>,
    pub water: Vec<f64>,
    pub sediment: Vec<f64>,
    pub west: Vec<f64>,
    pub north: Vec<f64>,
}

impl World {
    /// A step of `dt` seconds with the node's defaults, without rain, rock, width and slippage.
    pub fn step(&mut self, dt: f64) {
        let (n, dx, g) = (self.n, self.cell_m, 9.81);
        let at = |i: usize, j: usize| j * n + i;
        let (bed, west, north) = (self.bed.clone(), self.west.clone(), self.north.clone());
        let water = self.water.clone();
        // the value at a cell, or `None` beyond the walls
        let cell = |values: &[f64], i: isize, j: isize| {
            let inside = (0..n as isize).contains(&i) && (0..n as isize).contains(&j);
            inside.then(|| values[at(i as usize, j as usize)])
        };
        let level: Vec<f64> = bed.iter().zip(&water).map(|(b, d)| b + d).collect();
        // by how much water is deeper at the far face of a cell on an axis, as a fraction; 0 beside walls
        let lean = |i: isize, j: isize, [di, dj]: [isize; 2]| {
            let (before, after) = (cell(&water, i - di, j - dj), cell(&water, i + di, j + dj));
            let (Some(before), Some(after)) = (before, after) else { return 0.0 };
            let here = water[at(i as usize, j as usize)];
            let (rise, next) = (here - before, after - here);
            if rise * next > 0.0 && here > 1e-4 { rise * next / (rise + next) / here } else { 0.0 }
        };
        // depth over the face from the cell before to (i, j), for the axis (di, dj), and the discharge before friction
        let driven = |i: isize, j: isize, [di, dj]: [isize; 2]| {
            let (k, l) = (i - di, j - dj);
            if k < 0 || l < 0 {
                return (0.0, 0.0);
            }
            let [a, b] = [at(k as usize, l as usize), at(i as usize, j as usize)];
            let fall = (level[a] - level[b]).clamp(-2.0 * dx, 2.0 * dx);
            let axis = [di, dj];
            let deeper = if fall > 0.0 { 1.0 + lean(k, l, axis) } else { 1.0 - lean(i, j, axis) };
            let h = (level[a].max(level[b]) - bed[a].max(bed[b])) * deeper;
            if h <= 1e-4 {
                return (0.0, 0.0);
            }
            let q = if di == 1 { west[b] } else { north[b] };
            (h, q + g * h * dt * fall / dx)
        };
        // the mean discharge along the axis through both faces of a cell, before friction
        let middle = |i: isize, j: isize, axis: [isize; 2]| {
            let (k, l) = (i + axis[0], j + axis[1]);
            let next = cell(&bed, k, l).map_or(0.0, |_| driven(k, l, axis).1);
            0.5 * (driven(i, j, axis).1 + next)
        };
        let face = |i: isize, j: isize, [di, dj]: [isize; 2]| {
            let (h, q) = driven(i, j, [di, dj]);
            if q == 0.0 {
                return 0.0;
            }
            let along = 0.5 * (middle(i - di, j - dj, [dj, di]) + middle(i, j, [dj, di]));
            let norm = libm::hypot(q, along);
            let drag = g * dt * 0.05 * 0.05 * libm::pow(h, -7.0 / 3.0);
            // the norm m that is left, from m (1 + drag m) = norm
            let left = (libm::sqrt(1.0 + 4.0 * drag * norm) - 1.0) / (2.0 * drag);
            q / norm * left.min(h * libm::sqrt(g * h))
        };
        for j in 0..n {
            for i in 0..n {
                self.west[at(i, j)] = face(i as isize, j as isize, [1, 0]);
                self.north[at(i, j)] = face(i as isize, j as isize, [0, 1]);
            }
        }
        let faces = |west: &[f64], north: &[f64], i: usize, j: usize| {
            let east = if i + 1 < n { west[at(i + 1, j)] } else { 0.0 };
            let south = if j + 1 < n { north[at(i, j + 1)] } else { 0.0 };
            [west[at(i, j)], -east, north[at(i, j)], -south]
        };
        let mut share = vec![1.0; n * n];
        for (k, share) in share.iter_mut().enumerate() {
            let out: f64 = faces(&self.west, &self.north, k % n, k / n).iter().map(|q| (-q).max(0.0)).sum();
            *share = (water[k] * dx / (dt * out)).min(1.0);
        }
        for k in 0..n * n {
            self.west[k] *= share[if self.west[k] > 0.0 { k - 1 } else { k }];
            self.north[k] *= share[if self.north[k] > 0.0 { k - n } else { k }];
        }
        let mut load = self.sediment.clone();
        for k in 0..n * n {
            let (i, j) = (k % n, k / n);
            let [w, e, no, s] = faces(&self.west, &self.north, i, j);
            self.water[k] = water[k] + dt / dx * (w + e + no + s);
            let depth = 0.5 * (water[k] + self.water[k]);
            let film = ((depth / 0.005 - 1.0) / 2.0).clamp(0.0, 1.0);
            let speed = 0.5 * libm::hypot(w - e, no - s) / depth * film * film * (3.0 - 2.0 * film);
            let beside = |values: &[f64], di: isize, dj: isize| {
                cell(values, i as isize + di, j as isize + dj).unwrap_or(values[k])
            };
            let gain =
                |q: f64, di: isize, dj: isize| q * (beside(&level, di, dj) - level[k]).clamp(-2.0 * dx, 2.0 * dx);
            let power = (gain(w, -1, 0) + gain(e, 1, 0) + gain(no, 0, -1) + gain(s, 0, 1)).max(0.0) / (2.0 * dx);
            let sine = power / libm::hypot(power, 0.5 * libm::hypot(w - e, no - s)).max(1e-30);
            let lowest = (0..9).map(|n| beside(&bed, n % 3 - 1, n / 3 - 1)).fold(bed[k], f64::min);
            let thick = (0.01 * sine * speed / 0.02 * (1.0 - depth / 5.0).max(0.0)).min(0.3);
            let missing = thick * depth - load[k];
            let rate = if missing > 0.0 { 0.2 * dt } else { 0.02 * dt / depth };
            let most = ((0.005 + 0.05 * depth) * dt).min(0.05 * dx);
            let taken = (2000.0 * missing * (1.0 - libm::exp(-rate))).clamp(-most, most);
            let taken = taken.min(0.25 * (bed[k] - lowest)).max(-2000.0 * load[k]);
            self.bed[k] -= taken;
            load[k] += taken / 2000.0;
        }
        for k in 0..n * n {
            let part = |from: usize| load[from] / water[from];
            let carried = |q: f64, from: usize| q * part(if q > 0.0 { from } else { k });
            let [w, e, no, s] = faces(&self.west, &self.north, k % n, k / n);
            let near = [k.wrapping_sub(1), k + 1, k.wrapping_sub(n), k + n];
            let gain: f64 = [w, e, no, s].into_iter().zip(near).map(|(q, from)| carried(q, from)).sum();
            self.sediment[k] = load[k] + dt / dx * gain;
        }
    }
}
